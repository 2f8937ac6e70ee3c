"""A program as min 1/2 x' P x + q' x, A x + s = b, s in a product of cones; and its duals from those of that form."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from sheldrake.common._bound_calls import LARGEST, BoundCalls, room
from sheldrake.solvers import _arrays
from sheldrake.solvers._engines.columns import Columns
from sheldrake.solvers._engines.linear_rows import Blocks, LinearRows, another
from sheldrake.solvers._functions.bindings import BindingBase
from sheldrake.solvers._functions.cone_constraints import (
    ExponentialConeConstraint,
    LinearMatrixInequalityConstraint,
    LorentzConeConstraint,
    PositiveSemidefiniteConstraint,
    RotatedLorentzConeConstraint,
)
from sheldrake.solvers._functions.constraints import (
    BoundingBoxConstraint,
    LinearConstraint,
    LinearEqualityConstraint,
)
from sheldrake.solvers._functions.costs import LinearCost, QuadraticCost
from sheldrake.solvers._functions.norm_costs import L2NormCost
from sheldrake.solvers._kernels.rows import conic_rows
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.program import MathematicalProgram

ROOT2 = float(np.sqrt(2.0))
_SMALL = 4000  # entries up to which a form is worth keeping after its program


class Cone(NamedTuple):
    """A kind of cone and its number of rows (of the matrix, for `psd`)."""

    kind: str  # "zero", "nonnegative", "second_order", "psd" (upper triangle by columns, scaled), "exponential"
    size: int


class ConicForm:
    """The arrays of the form, and where each constraint went.

    Variables beyond those of the program are slacks of norm costs.
    """

    def __init__(self, prog: MathematicalProgram):
        objective = LinearObjective(prog)
        self._make(prog, objective, objective.matrices(), LinearRows(prog, _linear_constraints(prog)))

    def _make(self, prog: MathematicalProgram, objective: LinearObjective, costs: Blocks, table: LinearRows) -> None:
        self._bindings = parts_of(prog).bindings
        self._rows: list[np.ndarray] = []  # of the entries of A beyond linear constraints, as their columns and values
        self._cols: list[np.ndarray] = []
        self._values: list[np.ndarray] = []
        self._b: list[np.ndarray] = []
        self.cones: list[Cone] = []
        self._duals: list[tuple[BindingBase, Callable[[np.ndarray], np.ndarray]]] = []
        self._objective(objective, costs, parts_of(prog).variables.num_vars())
        self._linear(table)
        self._norms_and_lorentz()
        self._rotated()
        self._matrices()
        self._exponential()
        self.b = np.concatenate(self._b) if len(self._b) > 1 else self._b[0]
        del self._bindings  # whose program keeps its form: no need to wait for the collector of cycles
        self.idle: list[Any] = []  # what a solver keeps for the next program with these matrices

    @classmethod
    def of(cls, prog: MathematicalProgram) -> ConicForm:
        """The form of a program, made of that of one before it which had the same matrices, where both are small.

        So it is in predictive control that writes its program anew for each state.
        """
        linear = _linear_constraints(prog)
        objective, table = LinearObjective(prog), LinearRows(prog, linear)
        costs = objective.matrices()
        matrices = _matrices(prog, objective, costs, table)
        known = [] if matrices is None else _forms_of(matrices)
        found = known[0]._with(objective, linear).moved(prog) if known else None
        if found is None:
            found = cls.__new__(cls)
            found._make(prog, objective, costs, table)
            known[:] = [] if matrices is None else [found._without_program()]
        return found

    def _with(self, objective: LinearObjective, linear: list[BindingBase[LinearConstraint]]) -> ConicForm:
        """The same for costs and constraints of the same matrices; their other numbers are found by `moved`."""
        out = another(self)
        out._table, out._linear_objective = self._table.of_others(linear), objective
        return out

    def _without_program(self) -> ConicForm:
        """The same with nothing of the program but numbers."""
        out = another(self)
        out._table = self._table.of_others([])
        del out._linear_objective
        return out

    @functools.cached_property
    def lists(self) -> tuple[Columns, Columns]:
        """`upper_P` and `A` with lists, which solvers outside of Python read in less time than arrays."""
        return self.upper_P.as_lists(), self.A.as_lists()

    def is_linear(self) -> bool:
        """Whether there are linear constraints alone, and costs no more than quadratic."""
        return self.num_vars == self._first_slack and all([c.kind in ("zero", "nonnegative") for c in self.cones])

    @functools.cached_property
    def A(self) -> Columns:
        """The constraints as a sparse matrix."""
        linear, shape = self._conic.columns, (self.num_rows, self.num_vars)
        if not self._rows:
            return linear
        rows, values = np.concatenate((linear.indices, *self._rows)), np.concatenate((linear.data, *self._values))
        return Columns.of_triplets(rows, np.concatenate((linear.cols(), *self._cols)), values, shape)

    def _objective(self, objective: LinearObjective, costs: Blocks, num_vars: int) -> None:
        self._linear_objective = objective
        self._first_slack = num_vars
        self.num_vars = num_vars + len(self._bindings.of(L2NormCost))
        at = objective.at  # where quadratic costs are the first
        self.upper_P = Columns.upper(*costs.entries(), at, self.num_vars)
        self.q, self.constant = self._linear_now()

    def _linear_now(self) -> tuple[np.ndarray, float]:
        """q and the constant as the costs have them now."""
        q, constant = self._linear_objective.now()
        slacks = self.num_vars - self._first_slack
        return np.concatenate((q, np.ones(slacks))) if slacks else q, constant

    # Rows

    def _add(self, A: np.ndarray, cols: np.ndarray, b: np.ndarray) -> slice:
        """Rows A x[cols] + s = b; returns where they are."""
        i, j = A.nonzero()
        return self._add_entries(i, cols[j], A[i, j], np.asarray(b, dtype=float))

    def _add_entries(self, rows: np.ndarray, cols: np.ndarray, values: np.ndarray, b: np.ndarray) -> slice:
        """As many rows as b has, of these entries; returns where they are."""
        start = self.num_rows
        self._rows.append(rows + start)
        self._cols.append(cols)
        self._values.append(values)
        self._b.append(b)
        self.num_rows += len(b)
        return slice(start, self.num_rows)

    def add_empty_row(self) -> None:
        """Adds a row that always holds, 0 <= 1, before `A` is asked for."""
        self._add(np.zeros((1, 0)), np.zeros(0, int), np.ones(1))
        self._cone("nonnegative", 1)
        self.b = np.concatenate(self._b)

    def _cone(self, kind: str, size: int) -> None:
        if size:
            self.cones.append(Cone(kind, size))

    def _linear(self, table: LinearRows) -> None:
        """Linear constraints: first equations, then upper bounds, then lower bounds."""
        self._table = table
        found = self._conic = ConicRows.of(table, self.num_vars)
        self._b.append(found.b)
        self.num_rows = len(found.b)
        if found.never:
            self._add(np.zeros((found.never, 0)), np.zeros(0, int), -np.ones(found.never))  # no x is there: 0 <= -1
        self._cone("zero", found.equations)
        self._cone("nonnegative", self.num_rows - found.equations)

    def moved(self, prog: MathematicalProgram) -> ConicForm | None:
        """The form of the program with other bounds, linear costs and constants.

        None where the form has other rows then.
        """
        table = self._table.again()
        out = another(self)
        q, out.constant = self._linear_now()
        out.q = self.q if (q == self.q).all() else q
        if table is self._table:
            return out
        b = self._conic.right_sides(table)
        if b is None:
            return None
        out._table = table
        others = self.b[len(b) :]  # of rows that no number satisfies, and of cones: they stay
        out.b = np.concatenate((b, others)) if len(others) else b
        return out

    def _norms_and_lorentz(self) -> None:
        for k, b in enumerate(self._bindings.of(L2NormCost)):
            A = np.asarray(b._evaluator.GetDenseA())
            M = np.zeros((A.shape[0] + 1, A.shape[1] + 1))
            M[0, 0], M[1:, 1:] = 1.0, A
            cols = np.concatenate(([self._first_slack + k], self._bindings.places(b)))
            self._add(-M, cols, np.concatenate(([0.0], b._evaluator._b)))
            self._cone("second_order", M.shape[0])
        for cone in self._bindings.of(LorentzConeConstraint):
            c = cone.evaluator()
            rows = self._add(-c._A, self._bindings.places(cone), c._b)
            self._cone("second_order", c._A.shape[0])
            self._duals.append((cone, _part(rows)))

    def _rotated(self) -> None:
        """z_0 z_1 >= |r|^2 is (z_0 + z_1) / 2 >= |((z_0 - z_1) / 2, r)|."""
        for b in self._bindings.of(RotatedLorentzConeConstraint):
            n = b._evaluator._A.shape[0]
            T = np.eye(n)
            T[:2, :2] = [[0.5, 0.5], [0.5, -0.5]]
            rows = self._add(-(T @ b._evaluator._A), self._bindings.places(b), T @ b._evaluator._b)
            self._cone("second_order", n)
            self._duals.append((b, _part(rows, T.T)))

    def _matrices(self) -> None:
        for b in self._bindings.of(PositiveSemidefiniteConstraint):
            n = b._evaluator.matrix_rows()
            i, j, scale = upper_triangle(n)
            cols = self._bindings.places(b)[i * n + j]  # of variables that may differ, the lower triangle's, as Drake
            self._psd(b, n, self._add_entries(np.arange(len(i)), cols, -scale, np.zeros(len(i))))
        for inequality in self._bindings.of(LinearMatrixInequalityConstraint):
            n = inequality.evaluator().matrix_rows()
            i, j, scale = upper_triangle(n)
            F = [f[i, j] * scale for f in inequality.evaluator()._F]
            M = np.stack(F[1:], axis=1) if len(F) > 1 else np.zeros((len(i), 0))
            self._psd(inequality, n, self._add(-M, self._bindings.places(inequality), F[0]))

    def _psd(self, b: BindingBase, n: int, rows: slice) -> None:
        self._cone("psd", n)

        def dual(z: np.ndarray) -> np.ndarray:
            i, j, scale = upper_triangle(n)
            order = np.lexsort((j, i))  # Upper triangle by rows is the lower one by columns.
            return (z[rows] / scale)[order]

        self._duals.append((b, dual))

    def _exponential(self) -> None:
        """Ours is z_0 >= z_1 exp(z_2 / z_1); that of solvers has (z_2, z_1, z_0)."""
        for b in self._bindings.of(ExponentialConeConstraint):
            A, c = b._evaluator._A[::-1], b._evaluator._b[::-1]
            rows = self._add(-A, self._bindings.places(b), c)
            self._cone("exponential", 3)
            self._duals.append((b, _part(rows, np.eye(3)[::-1])))

    # Answers

    def x(self, found: np.ndarray) -> np.ndarray:
        """The decision variables from all variables."""
        return found[: self._first_slack]

    def cost(self, found: np.ndarray) -> float:
        """The cost of the program at a point."""
        P = self.upper_P
        rows, cols = P.indices, P.cols()
        halves = np.where(rows == cols, 0.5, 1.0)
        return float((halves * P.data * found[rows]) @ found[cols] + self.q @ found + self.constant)

    def duals(self, z: np.ndarray) -> list[tuple[BindingBase, np.ndarray]]:
        """Duals of the constraints from those of the rows (of A x + s = b, s in K, as z in the dual cone)."""
        prices = self._conic.prices(z)
        linear: list[tuple[BindingBase, np.ndarray]] = [(b, prices[rows]) for b, rows in self._table.places]
        return linear + [(b, dual(z)) for b, dual in self._duals]


def _linear_constraints(prog: MathematicalProgram) -> list[BindingBase[LinearConstraint]]:
    of = parts_of(prog).bindings.of
    return [*of(LinearConstraint), *of(LinearEqualityConstraint), *of(BoundingBoxConstraint)]


def _matrices(
    prog: MathematicalProgram, objective: LinearObjective, costs: Blocks, table: LinearRows
) -> tuple[Any, ...] | None:
    """Sizes, entries and columns of the matrices of linear constraints and quadratic costs, bit by bit.

    None where there is anything else, they are large, or sparse.
    """
    if not parts_of(prog).bindings.are_at_most_quadratic():
        return None
    of_costs, of_rows = costs.identity(_SMALL), table.blocks.identity(_SMALL)
    if of_costs is None or of_rows is None:
        return None
    return parts_of(prog).variables.num_vars(), of_costs, of_rows, objective.at.tobytes(), table.at.tobytes()


@functools.lru_cache(maxsize=8)
def _forms_of(matrices: tuple[Any, ...]) -> list[ConicForm]:
    """At most one form that has these `_matrices`."""
    return []


def _part(rows: slice, T: np.ndarray | None = None) -> Callable[[np.ndarray], np.ndarray]:
    """The dual that some rows are, T times them."""

    def dual(z: np.ndarray) -> np.ndarray:
        return z[rows] if T is None else T @ z[rows]

    return dual


@functools.lru_cache(maxsize=64)
def upper_triangle(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows, columns and scales (sqrt 2 off the diagonal) of the upper triangle, column after column; not to change."""
    j, i = np.tril_indices(n)
    return i, j, np.where(i == j, 1.0, ROOT2)


class ConicRows(NamedTuple):
    """Rows lower <= A x <= upper as equations, then A x + s = upper, then -A x + s = -lower.

    Attributes:
        says: What each of the given rows is: bits of `_kernels.rows`.
        equations, never: How many equations there are, and rows that no x satisfies.
        chosen: The row that each new row is made of; from `first_lower` on of its lower bound.
        b: Right sides.
        columns: The matrix of the new rows.
    """

    says: np.ndarray
    equations: int
    first_lower: int
    never: int
    chosen: np.ndarray
    b: np.ndarray
    columns: Columns

    @classmethod
    def of(cls, table: LinearRows, width: int) -> ConicRows:
        """Those of linear constraints on so many variables."""
        m, n = table.num_rows, len(table.entries[2])
        found = _calls.of(room(m), room(n), room(width))
        call, lower, upper, rows, cols, values, says, sizes, chosen, b, starts, new_rows, new_values = found
        lower[:m], upper[:m], rows[:n], cols[:n], values[:n] = table.lower, table.upper, *table.entries
        call.set("count", m)
        call.set("entries", n)
        call.set("width", width)
        count = call()
        equations, below, above, never = sizes.tolist()
        first_lower = equations + below
        size = first_lower + above
        columns = Columns(new_values[:count].copy(), new_rows[:count].copy(), starts[: width + 1].copy(), (size, width))
        return cls(says[:m].copy(), equations, first_lower, never, chosen[:size].copy(), b[:size].copy(), columns)

    def right_sides(self, table: LinearRows) -> np.ndarray | None:
        """b for the bounds of a table of the same rows; None where these say something else."""
        m = table.num_rows
        width = self.columns.shape[1]
        call, lower, upper, _, _, _, says, _, _, b, *_ = _calls.of(room(m), room(len(table.entries[2])), room(width))
        lower[:m], upper[:m] = table.lower, table.upper
        call.set("count", m)
        call.set("entries", 0)
        call()
        return b[: len(self.b)].copy() if says[:m].tobytes() == self.says.tobytes() else None

    def prices(self, z: np.ndarray) -> np.ndarray:
        """Duals of the given rows from those of the new ones, which come first."""
        k = self.first_lower  # raising an upper bound by one changes the cost by -z, a lower by +z
        prices = np.zeros(len(self.says))
        prices[self.chosen[:k]] -= z[:k]
        prices[self.chosen[k:]] += z[k : len(self.chosen)]
        return prices


def _bound(rows: int, entries: int, width: int) -> tuple[Any, ...]:
    """A bound call of `conic_rows`; the bounds and entries of A; what it fills."""
    (lower, upper), b = np.zeros((2, rows)), np.zeros(2 * rows)
    says, number = np.zeros((2, rows), dtype=np.int64)
    sizes, chosen = np.zeros(4, dtype=np.int64), np.zeros(2 * rows, dtype=np.int64)
    (at, cols), values = np.zeros((2, entries), dtype=np.int64), np.zeros(entries)
    signed_rows, signed_cols, by_row, order, new_rows = np.zeros((5, 2 * entries), dtype=np.int64)
    signed_values, new_values = np.zeros((2, 2 * entries))
    first, starts = np.zeros(max(2 * rows, width) + 1, dtype=np.int64), np.zeros(width + 1, dtype=np.int64)
    given, scratch = (lower, upper, at, cols, values), (signed_rows, signed_cols, signed_values, by_row, order, first)
    filled = starts, new_rows, new_values
    bound = conic_rows.bind(0, 0, 0, *given, says, sizes, number, chosen, b, *scratch, *filled)
    return bound, *given, says, sizes, chosen, b, *filled


_calls = BoundCalls(_bound, largest=LARGEST)


class LinearObjective:
    """c' x + constant, which linear and quadratic costs are beside quadratic terms.

    Args:
        prog: The program.

    Attributes:
        quadratic: Its quadratic costs.
        at: Places of the variables of its quadratic costs, then of its linear ones.
    """

    def __init__(self, prog: MathematicalProgram) -> None:
        parts = parts_of(prog)
        quadratic, linear = parts.bindings.of(QuadraticCost), parts.bindings.of(LinearCost)
        self.quadratic, self._linear = [b._evaluator for b in quadratic], [b._evaluator for b in linear]
        self.at, self._n = parts.bindings.places(*quadratic, *linear), parts.variables.num_vars()
        self._last: tuple[list[Any], np.ndarray] | None = None

    def matrices(self) -> Blocks:
        """The matrices of the quadratic costs."""
        return Blocks(*QuadraticCost.matrices(self.quadratic))

    def now(self) -> tuple[np.ndarray, float]:
        """c and constant as the costs have them now; the very same c while these are the same."""
        slopes = [*QuadraticCost.slopes(self.quadratic), *[e._a for e in self._linear]]
        constant = float(sum([e._c for e in self.quadratic]) + sum([e._b for e in self._linear]))
        last = self._last
        if last is None or not all(map(operator.is_, last[0], slopes)):
            c = np.bincount(self.at, _arrays.joined_numbers(slopes), self._n).astype(float, copy=False)
            self._last = last = slopes, c
        return last[1], constant
