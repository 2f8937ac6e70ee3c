"""A program as min 1/2 x' P x + q' x, A x + s = b, s in a product of cones; and its duals from those of that form."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sheldrake.solvers._engines.columns import Columns
from sheldrake.solvers._engines.linear_rows import LinearRows
from sheldrake.solvers._functions.bindings import BindingBase
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.program import MathematicalProgram

ROOT2 = float(np.sqrt(2.0))


class Cone(NamedTuple):
    """A kind of cone and its number of rows (of the matrix, for `psd`)."""

    kind: str  # "zero", "nonnegative", "second_order", "psd" (upper triangle by columns, scaled), "exponential"
    size: int


class ConicForm:
    """The arrays of the form, triplets of A, and where each constraint went.

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
        self.b = np.concatenate(self._b)

    def upper_P(self) -> Columns:
        """The upper triangle of the quadratic cost as a sparse matrix."""
        rows, cols, values = self._triplets_P
        upper = rows <= cols
        return Columns.of_triplets(rows[upper], cols[upper], values[upper], (self.num_vars, self.num_vars))

    def A(self) -> Columns:
        """The constraints as a sparse matrix."""
        rows, cols, values = (np.concatenate(parts) for parts in (self._rows, self._cols, self._values))
        return Columns.of_triplets(rows, cols, values, (self.num_rows, self.num_vars))

    def _objective(self) -> None:
        prog = self.prog
        rows, cols, values = [np.zeros(0, dtype=int)], [np.zeros(0, dtype=int)], [np.zeros(0)]
        q, self.constant = np.zeros(prog.num_vars()), 0.0
        for b in prog.quadratic_costs():
            at, cost = parts_of(prog).bindings.places(b), b._evaluator
            i, j = cost._Q.nonzero()
            rows.append(at[i])
            cols.append(at[j])
            values.append(cost._Q[i, j])
            np.add.at(q, at, cost._b)
            self.constant += cost._c
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
        """Linear constraints: first equations, then upper bounds, then lower bounds."""
        prog = self.prog
        linear = prog.linear_constraints(), prog.linear_equality_constraints(), prog.bounding_box_constraints()
        all_rows = LinearRows(prog, [b for kind in linear for b in kind])
        lower, upper = all_rows.lower, all_rows.upper
        equal = lower == upper
        never = np.flatnonzero((lower == np.inf) | (upper == -np.inf))
        equations = np.flatnonzero(equal)
        parts = [(equations, 1.0, self._add_rows(all_rows, equations, upper, 1.0))]
        self._cone("zero", self.num_rows)
        start = self.num_rows
        for sign, bound in ((1.0, upper), (-1.0, lower)):
            chosen = np.flatnonzero(~equal & np.isfinite(bound))
            parts.append((chosen, sign, self._add_rows(all_rows, chosen, bound, sign)))
        self._add(np.zeros((len(never), 0)), np.zeros(0, int), -np.ones(len(never)))  # No number is there: 0 <= -1.
        self._cone("nonnegative", self.num_rows - start)

        def shadow_prices(z: np.ndarray) -> np.ndarray:
            """Raising an upper bound by one changes the cost by -z, a lower bound by +z."""
            out = np.zeros(all_rows.num_rows)
            for chosen, sign, rows in parts:
                out[chosen] -= sign * z[rows]
            return out

        self._linear_places, self._shadow_prices = all_rows.places, shadow_prices

    def _add_rows(self, source: LinearRows, chosen: np.ndarray, bound: np.ndarray, sign: float) -> slice:
        """Adds rows sign A x + s = sign bound; returns where they are."""
        rows, cols, values = source.of(chosen)
        self._rows.append(rows + self.num_rows)
        self._cols.append(cols)
        self._values.append(sign * values)
        self._b.append(sign * bound[chosen])
        start = self.num_rows
        self.num_rows += len(chosen)
        return slice(start, self.num_rows)

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
        prices = self._shadow_prices(z)
        linear: list[tuple[BindingBase, np.ndarray]] = [(b, prices[rows]) for b, rows in self._linear_places]
        return linear + [(b, dual(z)) for b, dual in self._duals]


def _part(rows: slice, T: np.ndarray | None = None) -> Callable[[np.ndarray], np.ndarray]:
    """The dual that some rows are, T times them."""

    def dual(z: np.ndarray) -> np.ndarray:
        return z[rows] if T is None else T @ z[rows]

    return dual


def upper_triangle(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows, columns and scales (sqrt 2 off the diagonal) of the upper triangle, column after column."""
    j, i = np.tril_indices(n)
    return i, j, np.where(i == j, 1.0, ROOT2)
