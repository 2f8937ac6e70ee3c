"""Arguments of an entry kernel as the int64 words of the ABI. Knows NumPy only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common.kernel import ArraySpec

if TYPE_CHECKING:
    from sheldrake.common.kernel import Kernel

Place = Sequence[int]
"""Where an array is: (offset into the slab in doubles, shape...)."""


def pack(kernel: Kernel, args: tuple) -> tuple[np.ndarray, dict[str, tuple[int, str]]]:
    """Words for a direct call on `args`, and where each float or int stands in them.

    Raises:
        TypeError: if the number, type, axes or memory order of an argument differ from the kernel's annotations.
    """
    if len(args) != len(kernel.parameters):
        names = ", ".join(kernel.names)
        raise TypeError(f"{kernel!r} takes {len(kernel.names)} arguments ({names}), not {len(args)}.")
    return _pack(kernel, dict(zip(kernel.names, args)), from_slab=False)


def pack_row(kernel: Kernel, places: Mapping[str, Any]) -> np.ndarray:
    """Words for a kernel that works in a slab.

    Args:
        kernel: an entry kernel.
        places: by parameter name: a `Place` for an array, a sequence of them for `Vectors` or a NamedTuple; the arrays
            themselves for `model` and `*_model`; the number for a float or int. `t` needs none.

    Raises:
        KeyError: if a parameter has no place.
        TypeError: if a model is not what the kernel's annotations say.
    """
    return _pack(kernel, places, from_slab=True)[0]


def _pack(kernel: Kernel, given: Mapping[str, Any], from_slab: bool) -> tuple[np.ndarray, dict[str, tuple[int, str]]]:
    words: list[int] = []
    behind: list[int] = []
    scalars: dict[str, tuple[int, str]] = {}
    head = sum(_size(p) for p in kernel.parameters)
    for parameter in kernel.parameters:
        name, kind = parameter.name, parameter.kind
        if kind == "t":
            continue
        argument = given[name]
        if kind in ("float", "int"):
            scalars[name] = len(words), kind
            words.append(int(np.float64(argument).view(np.int64)) if kind == "float" else int(argument))
            continue
        if kind == "arrays":
            words += [len(argument), head + len(behind)]
            fields = [(f"{name}[{i}]", parameter.fields[0], a) for i, a in enumerate(argument)]
        elif kind == "array":
            fields = [(name, parameter.fields[0], argument)]
        else:
            if not isinstance(argument, parameter.cls) and (parameter.fields[0].absolute or not from_slab):
                expected, found = parameter.cls.__name__, type(argument).__name__
                raise TypeError(f"{kernel!r}: {name} must be a {expected}, not {found}.")
            fields = [(f"{name}.{f}", s, a) for f, s, a in zip(parameter.cls._fields, parameter.fields, argument)]
        target = behind if kind == "arrays" else words
        for title, spec, a in fields:
            target.extend(a if from_slab and not spec.absolute else _array_words(kernel, title, spec, a))
    return np.array([*words, *behind, 0], np.int64), scalars


def first_words(kernel: Kernel) -> dict[str, int]:
    """Where the words of each parameter begin; those of an array are its offset, then its shape."""
    places, at = {}, 0
    for parameter in kernel.parameters:
        places[parameter.name] = at
        at += _size(parameter)
    return places


def _size(parameter: Any) -> int:
    """Words a parameter takes at its place."""
    if parameter.kind == "t":
        return 0
    if parameter.kind == "arrays":
        return 2
    return sum(1 + s.ndim for s in parameter.fields) or 1


def _array_words(kernel: Kernel, name: str, spec: ArraySpec, a: Any) -> tuple[int, ...]:
    if isinstance(a, np.ndarray) and a.dtype == object:
        raise TypeError(f"{kernel!r}: {name} holds objects; call the kernel as a function instead of binding it.")
    if not (isinstance(a, np.ndarray) and a.dtype == spec.dtype and a.ndim == spec.ndim and a.flags.c_contiguous):
        found = f"{a.dtype} array of shape {a.shape}" if isinstance(a, np.ndarray) else repr(type(a).__name__)
        raise TypeError(
            f"{kernel!r}: {name} must be a C-contiguous {spec.dtype} array of {spec.ndim} axes, not {found}."
        )
    address = a.__array_interface__["data"][0]
    return (address if spec.absolute else address >> 3, *a.shape)
