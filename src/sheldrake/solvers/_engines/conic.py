"""A program as min 1/2 x' P x + q' x, A x + s = b, s in a product of cones; and its duals from those of that form."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sheldrake.solvers._engines.linear_rows import LinearRows, compressed
from sheldrake.solvers._functions.bindings import BindingBase
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.program import MathematicalProgram

if TYPE_CHECKING:
    import scipy.sparse

ROOT2 = float(np.sqrt(2.0))


class Cone(NamedTuple):
    """A kind of cone and its number of rows (of the matrix, for `psd`)."""

    kind: str  # "zero", "nonnegative", "second_order", "psd" (upper triangle by columns, scaled), "exponential"
    size: int


class ConicForm:
    """The arrays of the form, dense triplets of A, and where each constraint went.

    Variables beyond those of the program are slacks of norm costs.
    """

    def __init__(self, prog: MathematicalProgram):
        self.prog, self.num_vars = prog, prog.num_vars()
        self._rows: list[np.ndarray] = []
        self._cols: list[np.ndarray] = []
        self._values: list[np.ndarray] = []
        self._b: list[np.ndarray] = []
        self.cones: list[Cone] = []
        self.num_rows = 0
        self._duals: list[tuple[BindingBase, Callable[[np.ndarray], np.ndarray]]] = []
        self._objective()
        self._linear()
        self._norms_and_lorentz()
        self._rotated()
        self._matrices()
        self._exponential()
        self.b = np.concatenate(self._b) if self._b else np.zeros(0)

    def upper_P(self) -> scipy.sparse.csc_matrix:
        """The upper triangle of the quadratic cost as a sparse matrix."""
        rows, cols, values = self._triplets_P
        upper = rows <= cols
        return compressed(rows[upper], cols[upper], values[upper], (self.num_vars, self.num_vars))

    def A(self) -> scipy.sparse.csc_matrix:
        """The constraints as a sparse matrix."""
        shape = self.num_rows, self.num_vars
        if not self._rows:
            return compressed(np.zeros(0, int), np.zeros(0, int), np.zeros(0), shape)
        return compressed(np.concatenate(self._rows), np.concatenate(self._cols), np.concatenate(self._values), shape)

    def _objective(self) -> None:
        prog = self.prog
        rows, cols, values = [np.zeros(0, dtype=int)], [np.zeros(0, dtype=int)], [np.zeros(0)]
        q, self.constant = np.zeros(prog.num_vars()), 0.0
        quadratic = prog.quadratic_costs()
        places = parts_of(prog).variables.places
        at_all, n = places(np.concatenate([b._variables for b in quadratic])) if quadratic else rows[0], 0
        for b in quadratic:
            cost, n = b._evaluator, n + len(b._variables)
            at = at_all[n - len(b._variables) : n]
            i, j = cost._Q.nonzero()
            rows.append(at[i])
            cols.append(at[j])
            values.append(cost._Q[i, j])
            self.constant += cost._c
        if quadratic:
            np.add.at(q, at_all, np.concatenate([b._evaluator._b for b in quadratic]))
        for linear in prog.linear_costs():
            np.add.at(q, parts_of(prog).bindings.places(linear), linear.evaluator()._a)
            self.constant += linear.evaluator()._b
        slacks = len(prog.l2norm_costs())
        self._first_slack = prog.num_vars()
        self.num_vars += slacks
        self.q = np.concatenate((q, np.ones(slacks)))
        self._triplets_P = np.concatenate(rows), np.concatenate(cols), np.concatenate(values)

    # Rows

    def _add(self, A: np.ndarray, cols: np.ndarray, b: np.ndarray) -> slice:
        """Rows A x[cols] + s = b; returns where they are."""
        i, j = np.nonzero(A)
        self._rows.append(i + self.num_rows)
        self._cols.append(cols[j])
        self._values.append(A[i, j])
        self._b.append(np.asarray(b, dtype=float))
        start = self.num_rows
        self.num_rows += A.shape[0]
        return slice(start, self.num_rows)

    def _cone(self, kind: str, size: int) -> None:
        if size:
            self.cones.append(Cone(kind, size))

    def _linear(self) -> None:
        """Equations first; then, by constraint, upper bounds, lower bounds, and bounds that no number satisfies."""
        prog = self.prog
        kinds = prog.linear_constraints(), prog.linear_equality_constraints(), prog.bounding_box_constraints()
        table = LinearRows(prog, [b for kind in kinds for b in kind])
        lower, upper = table.lower, table.upper
        equal = lower == upper
        never = np.flatnonzero((lower == np.inf) | (upper == -np.inf))
        equal_rows = np.flatnonzero(equal)
        below = np.flatnonzero(~equal & np.isfinite(upper))
        above = np.flatnonzero(~equal & np.isfinite(lower))
        start = self.num_rows
        self._signs: list[tuple[float, np.ndarray, np.ndarray]] = []  # of duals: sign, rows of the table, of the form
        self._add_rows(table, 1.0, equal_rows, start + np.arange(len(equal_rows)))
        self._b.append(upper[equal_rows])
        self._cone("zero", len(equal_rows))
        start += len(equal_rows)
        owner = np.repeat(np.arange(len(table.places)), [rows.stop - rows.start for _, rows in table.places])
        found = np.concatenate((below, above, never))
        sort = np.repeat((0, 1, 2), (len(below), len(above), len(never)))
        order = np.lexsort((found, sort, owner[found]))
        at = np.empty(len(found), int)
        at[order] = start + np.arange(len(found))
        self._add_rows(table, 1.0, below, at[: len(below)])
        self._add_rows(table, -1.0, above, at[len(below) : len(below) + len(above)])
        bounds = np.concatenate((upper[below], -lower[above], np.full(len(never), -1.0)))  # never: 0 x <= -1
        self._b.append(bounds[order])
        self._cone("nonnegative", len(found))
        self.num_rows = start + len(found)
        self._table = table

    def _add_rows(self, table: LinearRows, sign: float, rows: np.ndarray, at: np.ndarray) -> None:
        """Puts `sign` times rows of the table where they shall be in the form."""
        place = np.full(len(table.lower), -1)
        place[rows] = at
        row = place[table.row]
        taken = row >= 0
        self._rows.append(row[taken])
        self._cols.append(table.col[taken])
        self._values.append(sign * table.value[taken])
        self._signs.append((-sign, rows, at))

    def _linear_duals(self, z: np.ndarray) -> list[tuple[BindingBase, np.ndarray]]:
        """Shadow prices: raising an upper bound by one changes the cost by -z, a lower bound by +z."""
        out = np.zeros(len(self._table.lower))
        for sign, rows, at in self._signs:
            out[rows] += sign * z[at]
        return [(b, out[rows]) for b, rows in self._table.places]

    def _norms_and_lorentz(self) -> None:
        for k, b in enumerate(self.prog.l2norm_costs()):
            A = np.asarray(b._evaluator.GetDenseA())
            M = np.zeros((A.shape[0] + 1, A.shape[1] + 1))
            M[0, 0], M[1:, 1:] = 1.0, A
            cols = np.concatenate(([self._first_slack + k], parts_of(self.prog).bindings.places(b)))
            self._add(-M, cols, np.concatenate(([0.0], b._evaluator._b)))
            self._cone("second_order", M.shape[0])
        for cone in self.prog.lorentz_cone_constraints():
            c = cone.evaluator()
            rows = self._add(-c._A, parts_of(self.prog).bindings.places(cone), c._b)
            self._cone("second_order", c._A.shape[0])
            self._duals.append((cone, _part(rows)))

    def _rotated(self) -> None:
        """z_0 z_1 >= |r|^2 is (z_0 + z_1) / 2 >= |((z_0 - z_1) / 2, r)|."""
        for b in self.prog.rotated_lorentz_cone_constraints():
            n = b._evaluator._A.shape[0]
            T = np.eye(n)
            T[:2, :2] = [[0.5, 0.5], [0.5, -0.5]]
            rows = self._add(-(T @ b._evaluator._A), parts_of(self.prog).bindings.places(b), T @ b._evaluator._b)
            self._cone("second_order", n)
            self._duals.append((b, _part(rows, T.T)))

    def _matrices(self) -> None:
        for b in self.prog.positive_semidefinite_constraints():
            n = b._evaluator.matrix_rows()
            i, j, scale = upper_triangle(n)
            select = np.zeros((len(i), n * n))
            select[np.arange(len(i)), i * n + j] = scale  # of variables that may differ, the lower triangle's, as Drake
            rows = self._add(-select, parts_of(self.prog).bindings.places(b), np.zeros(len(i)))
            self._psd(b, n, rows)
        for inequality in self.prog.linear_matrix_inequality_constraints():
            n = inequality.evaluator().matrix_rows()
            i, j, scale = upper_triangle(n)
            F = [f[i, j] * scale for f in inequality.evaluator()._F]
            M = np.stack(F[1:], axis=1) if len(F) > 1 else np.zeros((len(i), 0))
            self._psd(inequality, n, self._add(-M, parts_of(self.prog).bindings.places(inequality), F[0]))

    def _psd(self, b: BindingBase, n: int, rows: slice) -> None:
        self._cone("psd", n)
        i, j, scale = upper_triangle(n)
        order = np.lexsort((j, i))  # Upper triangle by rows is the lower one by columns.

        def dual(z: np.ndarray) -> np.ndarray:
            return (z[rows] / scale)[order]

        self._duals.append((b, dual))

    def _exponential(self) -> None:
        """Ours is z_0 >= z_1 exp(z_2 / z_1); that of solvers has (z_2, z_1, z_0)."""
        for b in self.prog.exponential_cone_constraints():
            A, c = b._evaluator._A[::-1], b._evaluator._b[::-1]
            rows = self._add(-A, parts_of(self.prog).bindings.places(b), c)
            self._cone("exponential", 3)
            self._duals.append((b, _part(rows, np.eye(3)[::-1])))

    # Answers

    def x(self, found: np.ndarray) -> np.ndarray:
        """The decision variables from all variables."""
        return found[: self.prog.num_vars()]

    def cost(self, found: np.ndarray) -> float:
        """The cost of the program at a point."""
        rows, cols, values = self._triplets_P
        return float(0.5 * (values * found[rows]) @ found[cols] + self.q @ found + self.constant)

    def duals(self, z: np.ndarray) -> list[tuple[BindingBase, np.ndarray]]:
        """Duals of the constraints from those of the rows (of A x + s = b, s in K, as z in the dual cone)."""
        return [*self._linear_duals(z), *((b, dual(z)) for b, dual in self._duals)]


def _part(rows: slice, T: np.ndarray | None = None) -> Callable[[np.ndarray], np.ndarray]:
    """The dual that some rows are, T times them."""

    def dual(z: np.ndarray) -> np.ndarray:
        return z[rows] if T is None else T @ z[rows]

    return dual


def upper_triangle(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows, columns and scales (sqrt 2 off the diagonal) of the upper triangle, column after column."""
    j, i = np.tril_indices(n)
    return i, j, np.where(i == j, 1.0, ROOT2)
