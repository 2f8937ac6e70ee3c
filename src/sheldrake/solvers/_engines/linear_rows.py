"""All linear constraints of a program as rows of one table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.solvers._functions.bindings import BindingBase
from sheldrake.solvers._functions.constraints import BoundingBoxConstraint, LinearConstraint
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.program import MathematicalProgram

if TYPE_CHECKING:
    import scipy.sparse


class LinearRows:
    """Constraints one below the other, lower <= A x <= upper. Programs may have thousands of a row or two each.

    Attributes:
        lower: Shape (m,).
        upper: Shape (m,).
        row: Rows of the entries of A that are not zero, shape (n,).
        col: Their columns, places among the decision variables.
        value: The entries.
        places: Each constraint and its rows.
    """

    def __init__(self, prog: MathematicalProgram, bindings: Sequence[BindingBase[LinearConstraint]]):
        variables = [b._variables for b in bindings]
        none = np.zeros(0)
        at = parts_of(prog).variables.places(np.concatenate(variables)) if variables else none.astype(int)
        rows, cols, values = [none.astype(int)], [none.astype(int)], [none]
        self.places: list[tuple[BindingBase[LinearConstraint], slice]] = []
        m = n = 0
        for b, mine in zip(bindings, variables):
            constraint, size = b._evaluator, len(mine)
            if type(constraint) is BoundingBoxConstraint:
                i = j = np.arange(size)
                values.append(np.ones(size))
            else:
                A = constraint._jacobian(np.zeros(size))
                i, j = A.nonzero()
                values.append(A[i, j])
            rows.append(i + m)
            cols.append(at[j + n])
            height = len(constraint._lower)
            self.places.append((b, slice(m, m + height)))
            m += height
            n += size
        self.row, self.col, self.value = np.concatenate(rows), np.concatenate(cols), np.concatenate(values)
        self.lower = np.concatenate([none, *(b._evaluator._lower for b in bindings)])
        self.upper = np.concatenate([none, *(b._evaluator._upper for b in bindings)])


def compressed(
    rows: np.ndarray, cols: np.ndarray, values: np.ndarray, shape: tuple[int, int]
) -> scipy.sparse.csc_matrix:
    """A sparse matrix of triplets; SciPy's own way through two other formats takes three times as long for few."""
    from scipy.sparse import csc_matrix

    order = np.lexsort((rows, cols))
    rows, cols, values = rows[order], cols[order], values[order]
    differs = np.ones(len(rows), bool)
    differs[1:] = (rows[1:] != rows[:-1]) | (cols[1:] != cols[:-1])
    if not differs.all():
        values = np.add.reduceat(values, np.flatnonzero(differs))
        rows, cols = rows[differs], cols[differs]
    starts = np.searchsorted(cols, np.arange(shape[1] + 1))
    return csc_matrix((values, rows.astype(np.int32), starts.astype(np.int32)), shape=shape)
