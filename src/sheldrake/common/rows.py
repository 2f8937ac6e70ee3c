"""What kernels do that is no mathematics: native code that calls other native code by address, or asks for memory."""

from __future__ import annotations

from typing import Any


def call_row(table: Any, r: int, t: float, slab: Any, words: Any, at: int) -> int:
    """Calls row `r` and returns its status.

    Interpreted, `table` is a list of Python callables without arguments. Compiled (the same name inside a kernel),
    `table` is an int64 array of addresses of functions of the kernels' ABI, called on the slab and on `words[at:]`.
    """
    return table[r]() or 0


def prefetch(numbers: Any, i: int, j: int | None = None) -> None:
    """Compiled, asks for the cache line that has `numbers[i, j]`, or of a vector `numbers[i]`; waits for nothing."""


def into_lanes(rows: Any, who: Any, j: int, lanes: Any, begin: int, end: int) -> None:
    """The numbers `begin:end` of rows `who[j:j + 4]` become the same rows of `lanes`; they are four or more."""
    lanes[begin:end] = rows[who[j : j + 4], begin:end].T


def out_of_lanes(rows: Any, who: Any, j: int, lanes: Any, begin: int, end: int) -> None:
    """Rows `begin:end` of `lanes` become the same numbers of rows `who[j:j + 4]`; they are four or more."""
    rows[who[j : j + 4], begin:end] = lanes[begin:end].T
