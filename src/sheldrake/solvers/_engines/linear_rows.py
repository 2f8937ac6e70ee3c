"""Linear constraints of a program as rows of one sparse matrix."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sheldrake.solvers import _arrays
from sheldrake.solvers._functions.bindings import BindingBase
from sheldrake.solvers._functions.constraints import BoundingBoxConstraint, LinearConstraint
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.program import MathematicalProgram


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
        self.places: list[tuple[BindingBase[LinearConstraint], slice]] = []
        rows, columns, values = [], [], []
        at = first = 0  # of the rows, and of all columns of all constraints
        for b in bindings:
            evaluator = b._evaluator
            count = evaluator._num_outputs
            if isinstance(evaluator, BoundingBoxConstraint):
                i = j = np.arange(count)
                entries = np.ones(count)
            elif _arrays.is_sparse(evaluator._A):
                triplets = evaluator._A.tocoo()
                i, j, entries = triplets.row, triplets.col, triplets.data
            else:
                i, j = evaluator._A.nonzero()
                entries = evaluator._A[i, j]
            rows.append(i + at)
            columns.append(j + first)
            values.append(entries)
            self.places.append((b, slice(at, at + count)))
            at += count
            first += len(b._variables)
        self.num_rows = at
        self.rows, self.values = _arrays.joined(rows, int), _arrays.joined(values, float)
        variables = np.concatenate([b._variables for b in bindings]) if bindings else np.zeros(0, dtype=object)
        self.cols = parts_of(prog).variables.places(variables)[_arrays.joined(columns, int)]
        self.lower = _arrays.joined([b._evaluator._lower for b in bindings], float)
        self.upper = _arrays.joined([b._evaluator._upper for b in bindings], float)

    def of(self, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The entries of some rows, which are numbered anew from zero in the order given."""
        number = np.full(self.num_rows, -1)
        number[chosen] = np.arange(len(chosen))
        rows = number[self.rows]
        kept = rows >= 0
        return rows[kept], self.cols[kept], self.values[kept]
