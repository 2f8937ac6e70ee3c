"""A program as min f(x), lower <= g(x) <= upper with sparse derivatives, for solvers that see only functions."""

from __future__ import annotations

import functools
import itertools
import math
from typing import NamedTuple

import numpy as np

from sheldrake.solvers import _arrays
from sheldrake.solvers._engines.functions import Functions
from sheldrake.solvers._engines.highs import Boxes
from sheldrake.solvers._engines.terms import LearnedTerms, Placed
from sheldrake.solvers._functions.bindings import BindingBase
from sheldrake.solvers._functions.cone_constraints import LorentzConeConstraint, RotatedLorentzConeConstraint
from sheldrake.solvers._functions.constraints import LinearConstraint, LinearEqualityConstraint, QuadraticConstraint
from sheldrake.solvers._functions.evaluators import Constraint, EvaluatorBase
from sheldrake.solvers._program.bindings import ProgramBindings
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.program import MathematicalProgram

_ROWS: tuple[type[Constraint], ...] = (
    LinearEqualityConstraint,
    LinearConstraint,
    Constraint,
    QuadraticConstraint,
    LorentzConeConstraint,
    RotatedLorentzConeConstraint,
)


class Rows(NamedTuple):
    """A constraint and the places of its rows."""

    binding: BindingBase
    rows: slice


class _Complementarity(EvaluatorBase):
    """M x + q and x' (M x + q)."""

    def __init__(self, M: np.ndarray, q: np.ndarray):
        self._M, self._q = M, q
        self._set_sizes(len(q) + 1, len(q))

    def _eval(self, x: np.ndarray) -> np.ndarray:
        y = self._M @ x + self._q
        return np.append(y, x @ y)

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        return np.vstack((self._M, self._M @ x + self._q + self._M.T @ x))


class NonlinearForm:
    """Cost and constraints of all decision variables, each in the units of its variable scaling.

    Args:
        prog: The program.
        is_scaled: Whether to heed the scaling.

    Attributes:
        rows: The constraints, and where their rows are.
        boxes: Bounds of the variables.
        learns: Whether second derivatives of some constraints are learned.
        functions: Cost and rows.
    """

    def __init__(self, prog: MathematicalProgram, is_scaled: bool = True):
        self.prog, self.num_vars = prog, prog.num_vars()
        self.scale = np.ones(self.num_vars)
        for place, s in prog.GetVariableScaling().items() if is_scaled else ():
            self.scale[place] = s
        bindings, self.boxes = parts_of(prog).bindings, Boxes(prog)
        low, high = self.boxes.bounds
        costs: list[tuple[EvaluatorBase, BindingBase]] = [(b._evaluator, b) for b in bindings.all_costs()]
        constraints: list[BindingBase[Constraint]] = [b for kind in _ROWS for b in bindings.of(kind)]
        found: list[tuple[EvaluatorBase, BindingBase]] = [(b._evaluator, b) for b in constraints]
        lower, upper = [b._evaluator._lower for b in constraints], [b._evaluator._upper for b in constraints]
        for b in prog.linear_complementarity_constraints():
            n = len(b._variables)
            low = low.copy()
            low[bindings.places(b)] = np.maximum(low[bindings.places(b)], 0.0)
            found.append((_Complementarity(b._evaluator._M, b._evaluator._q), b))
            lower.append(np.append(np.zeros(n), -np.inf))
            upper.append(np.append(np.full(n, np.inf), 0.0))
        ends = list(itertools.accumulate([evaluator._num_outputs for evaluator, _ in found], initial=0))
        self.rows = [Rows(b, slice(first, end)) for b, first, end in zip(constraints, ends, ends[1:])]
        self.num_rows = ends[-1]
        placed = _placed(bindings, [*costs, *found], len(costs))
        self.functions = Functions(placed[: len(costs)], placed[len(costs) :], self.num_rows + 1, self.scale)
        self.lower, self.upper = _arrays.joined(lower, float), _arrays.joined(upper, float)
        self._leave_out_empty_rows()
        self.x_lower, self.x_upper = low / self.scale, high / self.scale
        self._callbacks = [(b._evaluator, bindings.places(b)) for b in prog.visualization_callbacks()]
        self.learns = any(isinstance(p, LearnedTerms) and not p.are_costs for p in self.functions.parts)

    @functools.cached_property
    def sides(self) -> tuple[np.ndarray, np.ndarray]:
        """Which bounds of rows there are: numbers plus 1 of the upper ones, then minus that; and of variables."""
        return _finite(self.lower, self.upper), _finite(self.x_lower, self.x_upper)

    @functools.cached_property
    def _of_rows(self) -> np.ndarray:
        """Which entries of derivatives are those of constraints."""
        return np.flatnonzero(self.functions.row)

    @functools.cached_property
    def J_rows(self) -> np.ndarray:
        """Rows of the entries of the Jacobian; those at one place add up."""
        return self.functions.row[self._of_rows] - 1

    @functools.cached_property
    def J_cols(self) -> np.ndarray:
        """Columns of these entries."""
        return self.functions.col[self._of_rows]

    @property
    def H_rows(self) -> np.ndarray:
        """Rows of the entries of the Hessian, both halves of it; those at one place add up."""
        return self.functions.where_hessian[0]

    @property
    def H_cols(self) -> np.ndarray:
        """Columns of these entries."""
        return self.functions.where_hessian[1]

    def _leave_out_empty_rows(self) -> None:
        """Linear rows that have no coefficient and hold anyway have no bounds: these only confuse solvers."""
        empty = self.functions.empty_rows() - 1
        empty = empty[empty >= 0]
        free = empty[(self.lower[empty] <= 0.0) & (self.upper[empty] >= 0.0)]
        self.lower[free], self.upper[free] = -np.inf, np.inf

    def start(self, guess: np.ndarray) -> np.ndarray:
        """The guess in scaled units, zero where there is none, inside the bounds."""
        return self.clip(np.where(np.isnan(guess), 0.0, guess) / self.scale)

    def clip(self, y: np.ndarray) -> np.ndarray:
        """The nearest point inside the bounds of the variables."""
        return np.minimum(np.maximum(y, self.x_lower), self.x_upper)

    def values(self, y: np.ndarray) -> tuple[float, np.ndarray]:
        """Cost and values of rows, without derivatives."""
        rows = self.functions.values(y)
        return rows.item(0), rows[1:].copy()

    def cost(self, y: np.ndarray) -> tuple[float, np.ndarray]:
        """The cost and its gradient."""
        rows, _, J = self.functions.slopes(y)
        return rows.item(0), J[0].copy()

    def constraints(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The values of all rows, shape `(num_rows,)`, and the entries of their Jacobian, as long as `J_rows`."""
        rows, entries, _ = self.functions.slopes(y)
        return rows[1:].copy(), entries[self._of_rows]

    def dense(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The cost and the values of all rows, and their derivatives, shape `(1 + num_rows, num_vars)`.

        In memory that the next evaluation overwrites.
        """
        rows, entries, J = self.functions.slopes(y)
        if not self.functions.is_dense:
            J = _summed(self._places, entries, len(rows) * self.num_vars).reshape(-1, self.num_vars)
        return rows, J

    def dense_constraints(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The values of all rows and their Jacobian, shape `(num_rows, num_vars)`."""
        rows, J = self.dense(y)
        return rows[1:].copy(), J[1:].copy()

    @functools.cached_property
    def _places(self) -> np.ndarray:
        """Where all entries are in a matrix, row after row."""
        return self.functions.row * self.num_vars + self.functions.col

    def hessian(self, y: np.ndarray, cost_weight: float, weights: np.ndarray) -> np.ndarray:
        """Entries of the Hessian of cost_weight * cost + weights' rows, as long as `H_rows`."""
        return self.functions.hessian(y, np.concatenate(([cost_weight], weights)))

    def cost_hessian(self, y: np.ndarray) -> np.ndarray:
        """The Hessian of the cost, roughly, shape `(num_vars, num_vars)`."""
        n, weights = self.num_vars, np.zeros(self.num_rows + 1)
        weights[0] = 1.0
        entries = self.functions.hessian(y, weights, is_rough=True)
        return _summed(self.H_rows * n + self.H_cols, entries, n * n).reshape(n, n)

    def excess(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """By how much each row is beyond its bounds, with sign, and the derivatives of that."""
        values, J = self.dense_constraints(y)
        below, above = values < self.lower, values > self.upper
        r = np.where(below, values - self.lower, 0.0) + np.where(above, values - self.upper, 0.0)
        return r, np.where((below | above)[:, None], J, 0.0)

    def violation(self, y: np.ndarray) -> float:
        """The largest violation of a constraint, relative to the size of its bound if that is above one."""
        values = self.values(y)[1]
        over = np.concatenate((self.lower - values, values - self.upper, self.x_lower - y, y - self.x_upper))
        most = (over / self._sizes).max(initial=0.0)
        return np.inf if np.isnan(most) else float(most)

    @functools.cached_property
    def _sizes(self) -> np.ndarray:
        """What violations of the bounds of rows, then of variables are relative to."""
        found = np.abs(np.concatenate((self.lower, self.upper, self.x_lower, self.x_upper)))
        found[2 * self.num_rows :] = 1.0
        return np.where(found < np.inf, np.maximum(1.0, found), 1.0)

    @property
    def has_callbacks(self) -> bool:
        """Whether there are visualization callbacks."""
        return bool(self._callbacks)

    def show(self, y: np.ndarray) -> None:
        """Calls the visualization callbacks."""
        for evaluator, at in self._callbacks:
            evaluator._eval((y * self.scale)[at])

    def slopes(self, y: np.ndarray) -> Slopes:
        """Derivatives at y."""
        return Slopes(y, self.cost(y)[1], *self.dense_constraints(y))

    def multipliers(self, at: Slopes, tol: float = 1e-5) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Derivatives of the cost by the active bounds: of rows, of lower and of upper bounds of x.

        Least squares of the condition that the cost's gradient is a combination of those of the active constraints.
        """

        def close(a: np.ndarray, bound: np.ndarray) -> np.ndarray:
            size = np.maximum(1.0, np.abs(np.where(np.isfinite(bound), bound, 0.0)))
            return np.isfinite(bound) & (np.abs(a - bound) <= tol * size)

        rows = np.flatnonzero(close(at.values, self.lower) | close(at.values, self.upper))
        fixed = np.flatnonzero(close(at.y, self.x_lower) | close(at.y, self.x_upper))
        stack = np.vstack((at.J[rows], np.eye(self.num_vars)[fixed]))
        found = np.linalg.lstsq(stack.T, at.gradient, rcond=None)[0] if len(stack) else np.zeros(0)
        dual = np.zeros(self.num_rows)
        dual[rows] = found[: len(rows)]
        box = np.zeros(self.num_vars)
        box[fixed] = found[len(rows) :] / self.scale[fixed]
        return dual, np.maximum(box, 0.0), np.minimum(box, 0.0)


class Slopes(NamedTuple):
    """A point, the cost's gradient, and the values of all rows and their Jacobian there."""

    y: np.ndarray
    gradient: np.ndarray
    values: np.ndarray
    J: np.ndarray


def _placed(bindings: ProgramBindings, found: list[tuple[EvaluatorBase, BindingBase]], num_costs: int) -> list[Placed]:
    """Evaluators with the columns of the variables they are bound to, and their rows: 0 for costs, which come first."""
    columns = bindings.places(*[b for _, b in found])
    rows = np.arange(1, 1 + sum([evaluator._num_outputs for evaluator, _ in found[num_costs:]]))
    cost, out, row, column = np.zeros(1, dtype=np.int64), [], 0, 0
    for k, (evaluator, b) in enumerate(found):
        next_column = column + len(b._variables)
        next_row = row + (evaluator._num_outputs if k >= num_costs else 0)
        out.append(Placed(evaluator, columns[column:next_column], rows[row:next_row] if k >= num_costs else cost))
        row, column = next_row, next_column
    return out


def _finite(lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    above = [k + 1 for k, bound in enumerate(upper.tolist()) if bound < math.inf]
    return np.array(above + [-k - 1 for k, bound in enumerate(lower.tolist()) if bound > -math.inf], dtype=np.int64)


def _summed(places: np.ndarray, entries: np.ndarray, size: int) -> np.ndarray:
    """A vector with entries at places, those at one place added; `bincount` of nothing would be of integers."""
    return np.bincount(places, entries, size) if len(entries) else np.zeros(size)
