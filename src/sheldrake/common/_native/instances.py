"""Builtin functions of Python that make an object whose slots hold what other builtin functions give.

A query for a pose is one call then: the object, the object in it, and both arrays are made by machine code, where
three calls and two `object.__new__` of Python took twice the time. Python's own functions make the object and fill the
slots: nothing is assumed about how objects of Python look. All functions are given the same arguments.

Layout of a block, in words:

    0  address of PyType_GenericAlloc           3  address of the class
    1  address of PyObject_GenericSetAttr       4  number of slots
    2  address of Py_DecRef
    5 ... for each slot: code and block of the builtin function that gives its value, and its name
"""

from __future__ import annotations

import ctypes
import functools
import sys
from typing import Any

from sheldrake.common._native import builtin

SYMBOL = "sheldrake_instance"
HEAD, PER_SLOT = 5, 3

CODE = f"""
define ptr @{SYMBOL}(ptr %self, ptr %args, i64 %count) {{
entry:
  %block_at = getelementptr i8, ptr %self, i64 {builtin._DATA}
  %block = load ptr, ptr %block_at
  %alloc = load ptr, ptr %block
  %set_at = getelementptr i64, ptr %block, i64 1
  %set = load ptr, ptr %set_at
  %release_at = getelementptr i64, ptr %block, i64 2
  %release = load ptr, ptr %release_at
  %type_at = getelementptr i64, ptr %block, i64 3
  %type = load ptr, ptr %type_at
  %slots_at = getelementptr i64, ptr %block, i64 4
  %slots = load i64, ptr %slots_at
  %new = call ptr %alloc(ptr %type, i64 0)
  %no_memory = icmp eq ptr %new, null
  br i1 %no_memory, label %done, label %each
each:
  %i = phi i64 [0, %entry], [%i_next, %keep]
  %more = icmp slt i64 %i, %slots
  br i1 %more, label %ask, label %done
ask:
  %from = mul i64 %i, {PER_SLOT}
  %start = add i64 %from, {HEAD}
  %slot = getelementptr i64, ptr %block, i64 %start
  %code = load ptr, ptr %slot
  %its_block_at = getelementptr i64, ptr %slot, i64 1
  %its_block = load ptr, ptr %its_block_at
  %name_at = getelementptr i64, ptr %slot, i64 2
  %name = load ptr, ptr %name_at
  %value = call ptr %code(ptr %its_block, ptr %args, i64 %count)
  %failed = icmp eq ptr %value, null
  br i1 %failed, label %drop, label %keep
keep:
  %status = call i32 %set(ptr %new, ptr %name, ptr %value)
  call void %release(ptr %value)
  %i_next = add i64 %i, 1
  %refused = icmp ne i32 %status, 0
  br i1 %refused, label %drop, label %each
drop:
  call void %release(ptr %new)
  br label %done
done:
  %result = phi ptr [%new, %entry], [%new, %each], [null, %drop]
  ret ptr %result
}}
"""


INSTANCE = builtin.MachineCode(SYMBOL, CODE, b"A new object of what kernels give.")


def make(cls: type, fields: dict[str, Any]) -> Any:
    """A builtin function that gives a new `cls`, made without `__init__`; only where `available`.

    Args:
        cls: A class of nothing but slots.
        fields: For slots by name, a builtin function of `builtin` or of this module.
    """
    names = [sys.intern(name) for name in fields]
    words = [*_functions(), id(cls), len(fields)]
    for name, function in zip(names, fields.values()):
        words += [function.__self__.code, id(function.__self__), id(name)]
    return INSTANCE.make(words, (cls, fields, names))


@functools.cache
def available() -> bool:
    """Whether builtin calls are to be had, and this code too."""
    return builtin.available() and INSTANCE.address is not None


@functools.cache
def _functions() -> list[int]:
    """Words 0 to 2 of every block."""
    names = ("PyType_GenericAlloc", "PyObject_GenericSetAttr", "Py_DecRef")
    found = (ctypes.cast(getattr(ctypes.pythonapi, name), ctypes.c_void_p).value for name in names)
    return [int(address or 0) for address in found]
