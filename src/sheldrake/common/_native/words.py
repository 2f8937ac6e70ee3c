"""Arguments of an entry kernel as the int64 words of the ABI. Knows NumPy only."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common.kernel import ArraySpec

if TYPE_CHECKING:
    from sheldrake.common.kernel import Kernel


def arity_of(kernel: Kernel, args: tuple) -> int:
    """How many vectors the `Vectors` parameter has among `args`; 0 without one."""
    return next((len(a) for p, a in zip(kernel.parameters, args) if p.kind == "arrays"), 0)


def pack(kernel: Kernel, args: tuple) -> tuple[np.ndarray, dict[str, tuple[int, str]]]:
    """Words for a direct call on `args`, and where each float or int stands in them.

    Raises:
        TypeError: if the number, type, axes or memory order of an argument differ from the kernel's annotations.
    """
    parameters = kernel.parameters
    if len(args) != len(parameters):
        names = ", ".join(p.name for p in parameters)
        raise TypeError(f"{kernel!r} takes {len(parameters)} arguments ({names}), not {len(args)}.")
    words: list[int] = []
    places: dict[str, tuple[int, str]] = {}
    for parameter, argument in zip(parameters, args):
        if parameter.kind in ("float", "int"):
            places[parameter.name] = len(words), parameter.kind
            words.append(int(np.float64(argument).view(np.int64)) if parameter.kind == "float" else int(argument))
        elif parameter.kind == "array":
            _pack_array(kernel, parameter.name, parameter.fields[0], argument, words)
        elif parameter.kind == "arrays":
            for i, a in enumerate(argument):
                _pack_array(kernel, f"{parameter.name}[{i}]", parameter.fields[0], a, words)
        elif parameter.kind == "tuple":
            if not isinstance(argument, parameter.cls):
                raise TypeError(
                    f"{kernel!r}: {parameter.name} must be a {parameter.cls.__name__}, not {type(argument).__name__}."
                )
            for field, spec, a in zip(parameter.cls._fields, parameter.fields, argument):
                _pack_array(kernel, f"{parameter.name}.{field}", spec, a, words)
    return np.array([*words, 0], np.int64), places


def _pack_array(kernel: Kernel, name: str, spec: ArraySpec, a: Any, words: list[int]) -> None:
    if not (isinstance(a, np.ndarray) and a.dtype == spec.dtype and a.ndim == spec.ndim and a.flags.c_contiguous):
        if not (isinstance(a, np.ndarray) and a.dtype == object):
            found = f"{a.dtype} array of shape {a.shape}" if isinstance(a, np.ndarray) else repr(type(a).__name__)
            raise TypeError(
                f"{kernel!r}: {name} must be a C-contiguous {spec.dtype} array of {spec.ndim} axes, not {found}."
            )
        raise TypeError(f"{kernel!r}: {name} holds objects; call the kernel as a function instead of binding it.")
    address = a.__array_interface__["data"][0]
    words.append(address if spec.absolute else address >> 3)
    words.extend(a.shape)
