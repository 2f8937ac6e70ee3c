"""Linear constraints of a program as rows of one sparse matrix."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence
from typing import Any, TypeAlias, TypeVar

import numpy as np

from sheldrake.common._bound_calls import LARGEST, BoundCalls, room
from sheldrake.solvers import _arrays
from sheldrake.solvers._functions.bindings import BindingBase
from sheldrake.solvers._functions.constraints import BoundingBoxConstraint, LinearConstraint
from sheldrake.solvers._kernels.rows import entries_of_blocks
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.program import MathematicalProgram

Triplets: TypeAlias = "tuple[np.ndarray, np.ndarray, np.ndarray]"  # rows, columns and values


Block: TypeAlias = "_arrays.Matrix | list[float] | None"  # a matrix, its numbers row by row, or the identity


class Blocks:
    """Matrices that have rows and columns of their own each, their numbers one after the other.

    Args:
        blocks: The matrices.
        sizes: How many rows they have.
    """

    def __init__(self, blocks: Sequence[Block], sizes: Sequence[int]) -> None:
        self._blocks, self._sizes = blocks, sizes
        self._widths: list[int] = []  # as `entries_of_blocks` takes them, which leaves out sparse ones
        parts: list[Any] = []
        run: list[float] | None = None  # numbers of all lists between two arrays
        for A, size in zip(blocks, sizes):
            if A.__class__ is np.ndarray:
                self._widths.append(A.shape[1])  # type: ignore[union-attr]
                parts.append(A.ravel())  # type: ignore[union-attr]
                run = None
            elif A.__class__ is list:
                self._widths.append(len(A) // size)  # type: ignore[arg-type]
                if run is None:
                    parts.append(run := [])
                run += A  # type: ignore[arg-type]
            else:
                self._widths.append(-1 if A is None else -2 - A.shape[1])  # type: ignore[union-attr]
        self._numbers = np.concatenate(parts, dtype=float) if parts else np.zeros(0)

    def identity(self, largest: int) -> tuple[Any, ...] | None:
        """Equal for equal matrices alone, bit by bit; None if some are sparse, or there are more numbers than that."""
        if max(len(self._numbers), len(self._widths)) > largest or min(self._widths, default=0) < -1:
            return None
        return *self._sizes, *self._widths, self._numbers.tobytes()

    def entries(self) -> Triplets:
        """What is not zero: rows, columns and values."""
        numbers, sizes, widths = self._numbers, self._sizes, self._widths
        if not widths:
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros(0)
        n, most = len(widths), len(numbers) + sum([size for size, width in zip(sizes, widths) if width == -1])
        is_large = max(n, most) > LARGEST
        bound = _bound(n, most, numbers) if is_large else _calls.of(room(n), room(most))
        call, all_heights, all_widths, all_numbers, rows, cols, values = bound
        all_heights[:n], all_widths[:n] = sizes, widths
        if not is_large:
            all_numbers[: len(numbers)] = numbers
        call.set("blocks", n)
        count = call()
        found = rows[:count].copy(), cols[:count].copy(), values[:count].copy()
        return found if min(widths) >= -1 else _with_sparse(found, self._blocks, sizes, widths)


def entries(blocks: Sequence[Block], sizes: Sequence[int]) -> Triplets:
    """What is not zero in `Blocks`."""
    return Blocks(blocks, sizes).entries()


def _with_sparse(found: Triplets, blocks: Sequence[Any], sizes: Sequence[int], widths: Sequence[int]) -> Triplets:
    """The same with the entries of the sparse blocks at the end."""
    parts, row, col = [found], 0, 0
    for A, size, width in zip(blocks, sizes, widths):
        if width < -1:
            triplets = A.tocoo()
            parts.append((triplets.row + row, triplets.col + col, triplets.data))
        row, col = row + size, col + (size if width == -1 else width if width >= 0 else A.shape[1])
    rows, cols, values = (np.concatenate(each) for each in zip(*parts))
    return rows, cols, values


def _bound(blocks: int, entries: int, numbers: np.ndarray | None = None) -> tuple[Any, ...]:
    """A bound call of `entries_of_blocks`; heights, widths and numbers of the blocks; what it fills."""
    heights, widths = np.zeros((2, blocks), dtype=np.int64)
    numbers = np.zeros(entries) if numbers is None else numbers
    (rows, cols), values = np.zeros((2, entries), dtype=np.int64), np.zeros(entries)
    bound = entries_of_blocks.bind(0, heights, widths, numbers, rows, cols, values)
    return bound, heights, widths, numbers, rows, cols, values


_calls = BoundCalls(_bound)


Form = TypeVar("Form")


def another(form: Form) -> Form:
    """An object with the same attributes, in less time than copy.copy()."""
    out: Form = object.__new__(type(form))
    out.__dict__.update(form.__dict__)
    return out


class LinearRows:
    """lower <= A x <= upper, x being all decision variables.

    Args:
        prog: The program.
        bindings: Which of its linear constraints, bounds of variables included.

    Attributes:
        blocks: The matrices of the constraints, until `entries` are asked for.
        at: Places of the variables of these.
        lower, upper: Shape (num_rows,).
    """

    def __init__(self, prog: MathematicalProgram, bindings: Sequence[BindingBase[LinearConstraint]]):
        self._bindings = bindings
        blocks: list[Block] = []
        for b in bindings:
            e = b._evaluator
            row = e._row
            blocks.append(row[0] if row is not None else None if isinstance(e, BoundingBoxConstraint) else e._A)
        self._sizes = [b._evaluator._num_outputs for b in bindings]
        self.blocks, self.at = Blocks(blocks, self._sizes), parts_of(prog).bindings.places(*bindings)
        self._take_bounds()
        self.num_rows = len(self.lower)

    @functools.cached_property
    def entries(self) -> Triplets:
        """Rows, columns and values of the entries of A; those at one place add up."""
        rows, columns, values = self.blocks.entries()
        self.__dict__.pop("blocks", None)  # which nobody needs again
        return rows, self.at[columns], values

    def _take_bounds(self) -> None:
        lower: list[float] = []
        upper: list[float] = []
        for b in self._bindings:
            e = b._evaluator
            row = e._row
            if row is None:
                lower += e._lower.tolist()
                upper += e._upper.tolist()
            else:
                _, low, high = row
                lower.append(low)
                upper.append(high)
        self.lower, self.upper = np.array(lower, dtype=float), np.array(upper, dtype=float)

    @functools.cached_property
    def places(self) -> list[tuple[BindingBase[LinearConstraint], slice]]:
        """Each constraint and its rows."""
        ends = list(itertools.accumulate(self._sizes, initial=0))
        return [(b, slice(first, end)) for b, first, end in zip(self._bindings, ends, ends[1:])]

    def of_others(self, bindings: Sequence[BindingBase[LinearConstraint]]) -> LinearRows:
        """The same of other constraints with the same matrices, whose bounds `again` finds."""
        out = another(self)
        out._bindings = bindings
        out.__dict__.pop("places", None)
        return out

    def again(self) -> LinearRows:
        """The same with the bounds that the constraints have now; itself if these are the same."""
        out = another(self)
        out._take_bounds()
        is_same = out.lower.tobytes() == self.lower.tobytes() and out.upper.tobytes() == self.upper.tobytes()
        return self if is_same else out
