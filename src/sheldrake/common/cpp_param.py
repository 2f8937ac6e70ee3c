"""Canonical spelling of template parameters: `numpy.float64` means `float`, `List[T]` means `list[T]`."""

from __future__ import annotations

import ctypes
import types
import typing
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from sheldrake.common._names import _MangledName, pretty_class_name

__all__ = ["Dict", "List", "Optional", "Union", "get_param_canonical", "get_param_names"]

_CANONICAL: dict[Any, Any] = {
    np.double: float,
    ctypes.c_double: float,
    ctypes.c_float: np.float32,
    np.int32: int,
    ctypes.c_int32: int,
    ctypes.c_int16: np.int16,
    ctypes.c_int64: np.int64,
    ctypes.c_uint8: np.uint8,
    ctypes.c_uint16: np.uint16,
    ctypes.c_uint32: np.uint32,
    ctypes.c_uint64: np.uint64,
    typing.Union: types.UnionType,
}


def _canonical(param: object) -> Any:
    try:
        return _CANONICAL.get(param, param)
    except TypeError:  # an unhashable literal stands for itself
        return param


def _generic_name(param: object, mangle: bool) -> str:
    origin = _name(typing.get_origin(param), mangle)
    args = [_name(arg, mangle) for arg in typing.get_args(param)]
    if origin == "typing.Union" and len(args) == 2 and args[1] == "NoneType":
        origin, args = "typing.Optional", args[:1]
    name = f"{origin}[{','.join(args)}]"
    return _MangledName.mangle(name) if mangle else name


def _name(param: object, mangle: bool) -> str:
    if typing.get_origin(param) is not None:
        return _generic_name(param, mangle)
    canonical = _canonical(param)
    if canonical is types.UnionType or canonical is typing.Union:
        return "typing.Union"
    if isinstance(canonical, type):
        return canonical.__name__ if mangle else pretty_class_name(canonical)
    return _MangledName.mangle(str(canonical)) if mangle else str(canonical)


def get_param_canonical(param: Sequence[Any]) -> tuple:
    """Each parameter in its canonical spelling.

    Args:
        param: Types or literals.
    """
    return tuple(_canonical(item) for item in param)


def get_param_names(param: Sequence[Any], *, mangle: bool = False) -> tuple[str, ...]:
    """Name of each parameter, as in `Foo_[name]`.

    Args:
        param: Types or literals.
        mangle: Give identifiers instead of expressions.
    """
    return tuple(_name(item, mangle) for item in param)


class _Generic:
    """A generic type whose parameters are brought to canonical spelling on subscription."""

    def __init__(self, name: str, instantiate: Callable[[tuple], Any], num_params: int | None):
        self._name = name
        self._instantiate = instantiate
        self._num_params = num_params

    def __getitem__(self, params: Any) -> Any:
        params = params if isinstance(params, tuple) else (params,)
        if self._num_params is not None and len(params) != self._num_params:
            raise RuntimeError(
                f"{self._name}[] requires exactly {self._num_params} type parameter(s), got {len(params)}"
            )
        return self._instantiate(get_param_canonical(params))

    def __repr__(self) -> str:
        return f"<Generic {self._name}>"


Dict = _Generic("Dict", lambda params: types.GenericAlias(dict, params), 2)
List = _Generic("List", lambda params: types.GenericAlias(list, params), 1)
Optional = _Generic("Optional", lambda params: typing.Optional[params[0]], 1)  # noqa: UP045
Union = _Generic("Union", lambda params: typing.Union[params], None)  # noqa: UP007
