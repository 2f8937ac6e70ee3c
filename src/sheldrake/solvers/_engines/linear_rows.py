"""Linear constraints of a program as rows of one sparse matrix."""

from __future__ import annotations

import itertools
import operator
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

from sheldrake.solvers import _arrays
from sheldrake.solvers._functions.bindings import BindingBase
from sheldrake.solvers._functions.constraints import BoundingBoxConstraint, LinearConstraint
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.program import MathematicalProgram


def entries(blocks: Sequence[_arrays.Matrix | None], sizes: Sequence[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What is not zero in matrices that have rows and columns of their own each: rows, columns and values.

    Args:
        blocks: The matrices; None for the identity.
        sizes: How many rows they have.
    """
    found: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    row = col = 0
    for kind, run in itertools.groupby(zip(blocks, sizes), _kind_of):
        members: Any
        members, heights = zip(*run)
        height = width = sum(heights)
        if kind is None:
            i, j, values = np.arange(height), np.arange(height), np.ones(height)
        else:
            width = sum([A.shape[1] for A in members])
            i, j, values = _of_dense(members) if kind is np.ndarray else _of_sparse(members[0])
        found.append((i + row, j + col, values) if found else (i, j, values))
        row, col = row + height, col + width
    if len(found) == 1:
        return found[0]
    rows, cols = (_arrays.joined([part[k] for part in found], int) for k in (0, 1))
    return rows, cols, _arrays.joined([part[2] for part in found], float)


def _kind_of(block: tuple[_arrays.Matrix | None, int]) -> Any:
    """What is the same for matrices that are taken at once: those that are dense, and identities."""
    A = block[0]
    return None if A is None else id(A) if _arrays.is_sparse(A) else np.ndarray


def _of_sparse(A: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    triplets = A.tocoo()
    return triplets.row, triplets.col, triplets.data


def _of_dense(blocks: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    if len(blocks) == 1:
        i, j = blocks[0].nonzero()
        return i, j, blocks[0][i, j]
    sizes, widths = [len(A) for A in blocks], np.array([A.shape[1] for A in blocks])
    in_row = widths.repeat(sizes)
    before = in_row.cumsum() - in_row  # how many numbers are in the rows above
    first = (widths.cumsum() - widths).repeat(sizes)  # column of each row
    values = np.concatenate([A.ravel() for A in blocks])
    kept = values.nonzero()[0]
    rows = np.arange(len(in_row)).repeat(in_row)[kept]
    return rows, kept + (first - before)[rows], values[kept]


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
        rows, cols, values: The entries of A; those at one place add up.
        lower, upper: Shape (num_rows,).
        places: Each constraint and its rows.
    """

    def __init__(self, prog: MathematicalProgram, bindings: Sequence[BindingBase[LinearConstraint]]):
        self._evaluators = [b._evaluator for b in bindings]
        ends = list(itertools.accumulate([e._num_outputs for e in self._evaluators], initial=0))
        self.places = [(b, slice(first, end)) for b, first, end in zip(bindings, ends, ends[1:])]
        self.num_rows = ends[-1]
        self.rows, columns, self.values = entries(
            [None if isinstance(e, BoundingBoxConstraint) else e._A for e in self._evaluators],
            [e._num_outputs for e in self._evaluators],
        )
        self.cols = parts_of(prog).bindings.places(*bindings)[columns]
        self._take_bounds()

    def _take_bounds(self) -> None:
        self._bounds = [e._lower for e in self._evaluators] + [e._upper for e in self._evaluators]
        self.lower, self.upper = _arrays.joined(self._bounds, float).reshape(2, -1)

    def again(self) -> LinearRows:
        """The same with the bounds that the constraints have now; itself if these are the same."""
        out = another(self)
        out._take_bounds()
        return self if all(map(operator.is_, out._bounds, self._bounds)) else out

    def of(self, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The entries of some rows, which are numbered anew from zero in the order given."""
        number = np.full(self.num_rows, -1)
        number[chosen] = np.arange(len(chosen))
        rows = number[self.rows]
        kept = rows >= 0
        return rows[kept], self.cols[kept], self.values[kept]
