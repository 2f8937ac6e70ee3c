"""Memory that kernels were given and that still lives: what sanitised kernels compare each address with.

With SHELDRAKE_SANITIZE=1 in the environment of a process each load and store of a kernel asks whether its address is in
an array that was placed (`binding.Here.place`) and that nobody has freed or replaced since. A kernel that leaves what
it was given, through a wrong shape or an address that has grown old, stops there and returns INDEX_ERROR.
"""

from __future__ import annotations

import os
import threading
import weakref
from collections import deque
from typing import Any

import numpy as np

SANITIZED = os.environ.get("SHELDRAKE_SANITIZE", "0") != "0"
"""For the life of a process: arrays that were placed before would not be known."""
SYMBOL = "sheldrake_living"
CODE = f"""
@{SYMBOL} = external global ptr
define internal i1 @in_living_memory(ptr %p) noinline nounwind {{
entry:
  %a = ptrtoint ptr %p to i64
  %table = load ptr, ptr @{SYMBOL}
  %count = load i64, ptr %table
  br label %search
search:                              ; how many arrays begin at the address or before it
  %low = phi i64 [0, %entry], [%low_next, %halve]
  %high = phi i64 [%count, %entry], [%high_next, %halve]
  %more = icmp slt i64 %low, %high
  br i1 %more, label %halve, label %found
halve:
  %sum = add i64 %low, %high
  %middle = lshr i64 %sum, 1
  %after = add i64 %middle, 1
  %word = add i64 %middle, %after
  %begin_at = getelementptr i64, ptr %table, i64 %word
  %begin = load i64, ptr %begin_at
  %is_after = icmp ule i64 %begin, %a
  %low_next = select i1 %is_after, i64 %after, i64 %low
  %high_next = select i1 %is_after, i64 %high, i64 %middle
  br label %search
found:                               ; of none, the end is the number of arrays, which is no address
  %last = shl i64 %low, 1
  %end_at = getelementptr i64, ptr %table, i64 %last
  %end = load i64, ptr %end_at
  %inside = icmp ult i64 %a, %end
  ret i1 %inside
}}
"""
_lock = threading.RLock()
_spans: dict[
    int, tuple[int, int]
] = {}  # where memory begins and ends [bytes], by the identity of the array that owns it
_tables = deque([np.zeros(1, np.int64)], maxlen=1000)  # a kernel of another thread may still read an old one
_cell = np.zeros(1, np.int64)


def note(array: np.ndarray) -> None:
    """The memory of an array, all that its owner has, is a kernel's from now on, for as long as it lives."""
    owner: Any = array
    while isinstance(owner.base, np.ndarray):
        owner = owner.base
    begin = owner.__array_interface__["data"][0]
    span = begin, begin + owner.nbytes
    with _lock:
        if span[0] < span[1] and _spans.get(id(owner)) != span:
            if id(owner) in _spans:
                _forget(id(owner))  # it was resized in place
            else:
                weakref.finalize(owner, _forget, id(owner)).atexit = False
            _spans[id(owner)] = span
            table = _tables[-1]
            at = 1 + 2 * int(np.searchsorted(table[1::2], span[0]))
            is_apart = (at == 1 or table[at - 1] <= span[0]) and (at == len(table) or span[1] <= table[at])
            _publish(np.concatenate([table[:at], span, table[at:]]) if is_apart else _merged())


def _forget(owner: int) -> None:
    with _lock:
        if (span := _spans.pop(owner, None)) is not None:
            table = _tables[-1]
            at = 1 + 2 * int(np.searchsorted(table[1::2], span[0]))
            is_alone = tuple(table[at : at + 2]) == span
            _publish(np.concatenate([table[:at], table[at + 2 :]]) if is_alone else _merged())


def _merged() -> np.ndarray:
    """The table anew; arrays that share memory, of which none owns all, are one."""
    merged: list[list[int]] = []
    for begin, end in sorted(_spans.values()):
        if merged and begin <= merged[-1][1]:
            merged[-1][1] = max(end, merged[-1][1])
        else:
            merged.append([begin, end])
    return np.array([0, *(word for span in merged for word in span)], np.int64)


def _publish(table: np.ndarray) -> None:
    """What kernels look into: how many, then where each begins and ends, in order."""
    table[0] = len(table) // 2
    _tables.append(table)
    _cell[0] = table.__array_interface__["data"][0]


def address() -> int:
    """Of the word that has the table's address."""
    return _cell.__array_interface__["data"][0]


_publish(_tables[-1].copy())
