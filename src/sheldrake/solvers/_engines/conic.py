"""A program as min 1/2 x' P x + q' x, A x + s = b, s in a product of cones; and its duals from those of that form."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sheldrake.solvers._functions.bindings import BindingBase
from sheldrake.solvers._functions.constraints import LinearConstraint
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
        self._equalities()
        self._inequalities()
        self._norms_and_lorentz()
        self._rotated()
        self._matrices()
        self._exponential()
        self.b = np.concatenate(self._b) if self._b else np.zeros(0)

    def upper_P(self) -> scipy.sparse.csc_matrix:
        """The upper triangle of the quadratic cost as a sparse matrix."""
        rows, cols, values = self._triplets_P
        upper = rows <= cols
        return _compressed(rows[upper], cols[upper], values[upper], (self.num_vars, self.num_vars))

    def A(self) -> scipy.sparse.csc_matrix:
        """The constraints as a sparse matrix."""
        shape = self.num_rows, self.num_vars
        if not self._rows:
            return _compressed(np.zeros(0, int), np.zeros(0, int), np.zeros(0), shape)
        return _compressed(np.concatenate(self._rows), np.concatenate(self._cols), np.concatenate(self._values), shape)

    def _objective(self) -> None:
        prog = self.prog
        rows, cols, values = [np.zeros(0, dtype=int)], [np.zeros(0, dtype=int)], [np.zeros(0)]
        q, self.constant = np.zeros(prog.num_vars()), 0.0
        for b in prog.quadratic_costs():
            at, cost = parts_of(prog).bindings.places(b), b._evaluator
            i, j = np.nonzero(cost._Q)
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

    def _linear(self) -> Iterator[tuple[BindingBase[LinearConstraint], np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
        """Each linear constraint, its matrix, the places of its variables, and its bounds."""
        prog = self.prog
        rows = (*prog.linear_constraints(), *prog.linear_equality_constraints(), *prog.bounding_box_constraints())
        for b in rows:
            c = b.evaluator()
            A = c._jacobian(np.zeros(len(b._variables)))
            yield b, A, parts_of(self.prog).bindings.places(b), c._lower, c._upper

    def _equalities(self) -> None:
        start = self.num_rows
        self._kept_equal: dict[int, tuple[np.ndarray, slice]] = {}
        for b, A, cols, lower, upper in self._linear():
            equal = np.flatnonzero(lower == upper)
            if equal.size:
                self._kept_equal[id(b)] = (equal, self._add(A[equal], cols, upper[equal]))
        self._cone("zero", self.num_rows - start)

    def _inequalities(self) -> None:
        start = self.num_rows
        for b, A, cols, lower, upper in self._linear():
            below = np.flatnonzero((lower != upper) & np.isfinite(upper))
            above = np.flatnonzero((lower != upper) & np.isfinite(lower))
            parts = [(-1.0, *self._kept_equal[id(b)])] if id(b) in self._kept_equal else []
            if below.size:
                parts.append((-1.0, below, self._add(A[below], cols, upper[below])))
            if above.size:
                parts.append((1.0, above, self._add(-A[above], cols, -lower[above])))
            self._duals.append((b, _linear_dual(len(lower), parts)))
            for _ in range(np.count_nonzero((lower == np.inf) | (upper == -np.inf))):
                self._add(np.zeros((1, len(cols))), cols, np.array([-1.0]))  # No number is there: 0 x <= -1.
        self._cone("nonnegative", self.num_rows - start)

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
        return [(b, dual(z)) for b, dual in self._duals]


def _compressed(
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


def _part(rows: slice, T: np.ndarray | None = None) -> Callable[[np.ndarray], np.ndarray]:
    """The dual that some rows are, T times them."""

    def dual(z: np.ndarray) -> np.ndarray:
        return z[rows] if T is None else T @ z[rows]

    return dual


def _linear_dual(count: int, parts: list[tuple[float, np.ndarray, slice]]) -> Callable[[np.ndarray], np.ndarray]:
    """Shadow prices: raising an upper bound by one changes the cost by -z, a lower bound by +z."""

    def dual(z: np.ndarray) -> np.ndarray:
        out = np.zeros(count)
        for sign, at, rows in parts:
            out[at] += sign * z[rows]
        return out

    return dual


def upper_triangle(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows, columns and scales (sqrt 2 off the diagonal) of the upper triangle, column after column."""
    j, i = np.tril_indices(n)
    return i, j, np.where(i == j, 1.0, ROOT2)
