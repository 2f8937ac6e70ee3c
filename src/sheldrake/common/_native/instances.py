"""Builtin functions of Python that make an object whose slots hold what other builtin functions give.

A query for a pose is one call then: the object, the object in it, and both arrays are made by machine code, where
three calls and two `object.__new__` of Python took twice the time. As in `builtin`, only what stays as it is for the
life of a process is touched, and `available` looks at a class of its own whether slots are where descriptors say.

Layout of a block, in words:

    0  address of PyType_GenericAlloc           2   address of Py_DecRef
    1  address of the class                     3   number of slots
    4 ... for each slot: a builtin function's code, its `self`, the slot's place in the object
"""

from __future__ import annotations

import ctypes
import functools
import types
from typing import Any

from sheldrake.common._native import builtin

SYMBOL = "sheldrake_instance"
_MEMBER, _PLACE = 40, 16  # [bytes] from a slot's descriptor to what describes the member; from there to the place
_OWNER, _CODE = 16, 8  # from a builtin function to its PyMethodDef; from there to the code

CODE = f"""
define ptr @{SYMBOL}(ptr %self, ptr %args, i64 %count) {{
entry:
  %block_at = getelementptr i8, ptr %self, i64 {builtin._DATA}
  %block = load ptr, ptr %block_at
  %alloc = load ptr, ptr %block
  %type_at = getelementptr i64, ptr %block, i64 1
  %type = load ptr, ptr %type_at
  %release_at = getelementptr i64, ptr %block, i64 2
  %release = load ptr, ptr %release_at
  %slots_at = getelementptr i64, ptr %block, i64 3
  %slots = load i64, ptr %slots_at
  %new = call ptr %alloc(ptr %type, i64 0)
  %no_memory = icmp eq ptr %new, null
  br i1 %no_memory, label %done, label %each
each:
  %i = phi i64 [0, %entry], [%i_next, %keep]
  %more = icmp slt i64 %i, %slots
  br i1 %more, label %fill, label %done
fill:
  %from = mul i64 %i, 3
  %start = add i64 %from, 4
  %slot = getelementptr i64, ptr %block, i64 %start
  %code = load ptr, ptr %slot
  %owner_at = getelementptr i64, ptr %slot, i64 1
  %owner = load ptr, ptr %owner_at
  %place_at = getelementptr i64, ptr %slot, i64 2
  %place = load i64, ptr %place_at
  %value = call ptr %code(ptr %owner, ptr null, i64 0)
  %failed = icmp eq ptr %value, null
  br i1 %failed, label %drop, label %keep
keep:
  %where = getelementptr i8, ptr %new, i64 %place
  store ptr %value, ptr %where
  %i_next = add i64 %i, 1
  br label %each
drop:
  call void %release(ptr %new)
  br label %done
done:
  %result = phi ptr [%new, %entry], [%new, %each], [null, %drop]
  ret ptr %result
}}
"""


def make(cls: type, fields: dict[str, Any]) -> Any:
    """A builtin function that gives a new `cls`, made without `__init__`; only where `available`.

    Args:
        cls: A class of nothing but slots.
        fields: For slots by name, a builtin function of `builtin` or of this module that takes no arguments.
    """
    words = [*_functions()[:1], id(cls), _functions()[1], len(fields)]
    for name, function in fields.items():
        words += [_code(function), id(function.__self__), _place(cls, name)]
    return builtin.make(words, (cls, fields), _method())


@functools.cache
def available() -> bool:
    """Whether builtin calls are to be had, and slots are where their descriptors say."""
    return builtin.available() and _slots_as_expected() and _address() is not None


class _Probe:
    __slots__ = ("a", "b")
    a: Any
    b: Any


def _slots_as_expected() -> bool:
    probe, value = _Probe(), object()
    probe.a = value
    places = [_place(_Probe, name) for name in ("a", "b")]
    if sorted(places) != [16, 24] or _Probe.__basicsize__ != 32:
        return False
    filled, empty = (ctypes.c_int64.from_address(id(probe) + place).value for place in places)
    return filled == id(value) and empty == 0 and _code(builtin.make([0], None)) == builtin._address()


def _place(cls: type, name: str) -> int:
    """Where a slot is in an object [bytes]."""
    descriptor = next(vars(base)[name] for base in cls.__mro__ if name in vars(base))
    assert isinstance(descriptor, types.MemberDescriptorType)
    member = ctypes.c_int64.from_address(id(descriptor) + _MEMBER).value
    return ctypes.c_int64.from_address(member + _PLACE).value


def _code(function: Any) -> int:
    """The address of a builtin function's machine code."""
    method = ctypes.c_int64.from_address(id(function) + _OWNER).value
    return ctypes.c_int64.from_address(method + _CODE).value


@functools.cache
def _functions() -> tuple[int, int]:
    """Addresses of PyType_GenericAlloc and Py_DecRef."""
    alloc, release = ctypes.pythonapi.PyType_GenericAlloc, ctypes.pythonapi.Py_DecRef
    return tuple(int(ctypes.cast(f, ctypes.c_void_p).value or 0) for f in (alloc, release))  # type: ignore[return-value]


@functools.cache
def _method() -> Any:
    return builtin._Method(b"make", _address(), builtin.METH_FASTCALL, b"A new object of what kernels give.")


@functools.cache
def _address() -> int | None:
    return builtin.code_address(SYMBOL, CODE)
