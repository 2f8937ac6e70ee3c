"""A program as min f(x), lower <= g(x) <= upper with sparse derivatives, for solvers that see only functions."""

from __future__ import annotations

import functools
import itertools
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.solvers import _arrays
from sheldrake.solvers._engines.highs import Boxes
from sheldrake.solvers._engines.terms import AllTerms, LearnedTerms, LinearTerms, grouped, without_nan
from sheldrake.solvers._functions.bindings import BindingBase
from sheldrake.solvers._functions.cone_constraints import LorentzConeConstraint, RotatedLorentzConeConstraint
from sheldrake.solvers._functions.constraints import LinearConstraint, LinearEqualityConstraint, QuadraticConstraint
from sheldrake.solvers._functions.evaluators import Constraint, EvaluatorBase
from sheldrake.solvers._program.bindings import ProgramBindings
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.program import MathematicalProgram

if TYPE_CHECKING:
    from collections.abc import Callable

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

    Attributes:
        rows: The constraints, and where their rows are.
        boxes: Bounds of the variables.
        learns: Whether second derivatives of some constraints are learned.
        J_rows, J_cols: Where the entries of the Jacobian are; those at one place add up.
    """

    def __init__(self, prog: MathematicalProgram):
        self.prog, self.num_vars = prog, prog.num_vars()
        self.scale, scaling = np.ones(self.num_vars), prog.GetVariableScaling()
        self._is_scaled = bool(scaling)
        for place, s in scaling.items():
            self.scale[place] = s
        bindings, self.boxes = parts_of(prog).bindings, Boxes(prog)
        low, high = self.boxes.bounds
        self._costs = AllTerms(grouped(_placed(bindings, [(b._evaluator, b) for b in bindings.all_costs()]), True))
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
        self._constraints = AllTerms(grouped(_placed(bindings, found)))
        self.lower, self.upper = _arrays.joined(lower, float), _arrays.joined(upper, float)
        self._leave_out_empty_rows()
        self.x_lower, self.x_upper = low / self.scale, high / self.scale
        self._callbacks = [(b._evaluator, bindings.places(b)) for b in prog.visualization_callbacks()]
        self.learns = any(isinstance(terms, LearnedTerms) for terms in self._constraints.parts)
        self.J_rows, self.J_cols = self._constraints.J_rows, self._constraints.J_cols
        self._values = _Last(self._values_at)
        self._cost_slopes = _Last(self._cost_slopes_at)
        self._row_slopes = _Last(self._row_slopes_at)

    @functools.cached_property
    def _where_hessian(self) -> tuple[np.ndarray, np.ndarray]:
        of_costs, of_rows = self._costs.where_hessian(), self._constraints.where_hessian()
        return np.concatenate((of_costs[0], of_rows[0])), np.concatenate((of_costs[1], of_rows[1]))

    @property
    def H_rows(self) -> np.ndarray:
        """Rows of the entries of the Hessian, both halves of it; those at one place add up."""
        return self._where_hessian[0]

    @property
    def H_cols(self) -> np.ndarray:
        """Columns of these entries."""
        return self._where_hessian[1]

    def _leave_out_empty_rows(self) -> None:
        """Linear rows that have no coefficient and hold anyway have no bounds: these only confuse solvers."""
        for terms in self._constraints.parts:
            if isinstance(terms, LinearTerms):
                empty = terms.empty()
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
        cost, rows = self._cost_slopes.known(y), self._row_slopes.known(y)
        return self._values(y) if cost is None or rows is None else (cost[0], rows[0])

    def _values_at(self, y: np.ndarray) -> tuple[float, np.ndarray]:
        x = self._unscaled(y)
        return _sum(self._costs.values(x)), self._constraints.values(x)

    def _unscaled(self, y: np.ndarray) -> np.ndarray:
        return y * self.scale if self._is_scaled else y

    def cost(self, y: np.ndarray) -> tuple[float, np.ndarray]:
        """The cost and its gradient."""
        return self._cost_slopes(y)

    def _cost_slopes_at(self, y: np.ndarray) -> tuple[float, np.ndarray]:
        values, J = self._costs.slopes(self._unscaled(y))
        gradient = _summed(self._costs.J_cols, without_nan(J), self.num_vars)
        return _sum(values), gradient * self.scale if self._is_scaled else gradient

    def constraints(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The values of all rows, shape `(num_rows,)`, and the entries of their Jacobian, as long as `J_rows`."""
        return self._row_slopes(y)

    def _row_slopes_at(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rows, J = self._constraints.slopes(self._unscaled(y))
        J = without_nan(J)
        return rows, J * self.scale[self.J_cols] if self._is_scaled else J

    def dense_constraints(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The values of all rows and their Jacobian, shape `(num_rows, num_vars)`."""
        values, entries = self.constraints(y)
        J = _summed(self._J_places, entries, self.num_rows * self.num_vars)
        return values, J.reshape(self.num_rows, self.num_vars)

    @functools.cached_property
    def _J_places(self) -> np.ndarray:
        """Where the entries of the Jacobian are in it as a dense matrix, row after row."""
        return self.J_rows * self.num_vars + self.J_cols

    def hessian(self, y: np.ndarray, cost_weight: float, weights: np.ndarray) -> np.ndarray:
        """Entries of the Hessian of cost_weight * cost + weights' rows, as long as `H_rows`."""
        x = self._unscaled(y)
        costs = self._costs.hessian(x, np.full(len(self._costs.places), cost_weight))
        entries = without_nan(np.concatenate((costs, self._constraints.hessian(x, weights))))
        return entries * self.scale[self.H_rows] * self.scale[self.H_cols] if self._is_scaled else entries

    def cost_hessian(self, y: np.ndarray) -> np.ndarray:
        """The Hessian of the cost, roughly, shape `(num_vars, num_vars)`."""
        n, costs = self.num_vars, self._costs
        entries = without_nan(costs.rough_hessian(self._unscaled(y), np.ones(len(costs.places))))
        rows, cols = costs.where_hessian()
        H = _summed(rows * n + cols, entries, n * n).reshape(n, n)
        return H * np.outer(self.scale, self.scale) if self._is_scaled else H

    def excess(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """By how much each row is beyond its bounds, with sign, and the derivatives of that."""
        values, J = self.dense_constraints(y)
        below, above = values < self.lower, values > self.upper
        r = np.where(below, values - self.lower, 0.0) + np.where(above, values - self.upper, 0.0)
        return r, np.where((below | above)[:, None], J, 0.0)

    def violation(self, y: np.ndarray) -> float:
        """The largest violation of a constraint, relative to the size of its bound if that is above one."""
        values = self.values(y)[1]
        low, high = (np.where(np.isfinite(b), b, 0.0) for b in (self.lower, self.upper))
        over = np.concatenate(
            (
                (self.lower - values) / np.maximum(1.0, np.abs(low)),
                (values - self.upper) / np.maximum(1.0, np.abs(high)),
                self.x_lower - y,
                y - self.x_upper,
            )
        )
        if np.isnan(over).any():
            return np.inf
        return float(over.max(initial=0.0))

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


def _placed(
    bindings: ProgramBindings, found: list[tuple[EvaluatorBase, BindingBase]]
) -> list[tuple[EvaluatorBase, np.ndarray, np.ndarray]]:
    """Evaluators with the columns of the variables they are bound to, and the rows of their values, in turn."""
    columns = bindings.places(*[b for _, b in found])
    rows = np.arange(sum([evaluator._num_outputs for evaluator, _ in found]))
    out, row, column = [], 0, 0
    for evaluator, b in found:
        next_row, next_column = row + evaluator._num_outputs, column + len(b._variables)
        out.append((evaluator, columns[column:next_column], rows[row:next_row]))
        row, column = next_row, next_column
    return out


def _summed(places: np.ndarray, entries: np.ndarray, size: int) -> np.ndarray:
    """A vector with entries at places, those at one place added; `bincount` of nothing would be of integers."""
    return np.bincount(places, entries, size) if len(entries) else np.zeros(size)


def _sum(values: np.ndarray) -> float:
    return values.item() if len(values) == 1 else float(np.add.reduce(values))  # `sum()` without its detour


class _Last:
    """A function that remembers its last value."""

    def __init__(self, function: Callable[[np.ndarray], Any]):
        self._function = function
        self._key: bytes | None = None
        self._found: Any = None

    def known(self, y: np.ndarray) -> Any:
        """The last value, if it was at this point; otherwise None."""
        return self._found if y.tobytes() == self._key else None

    def __call__(self, y: np.ndarray) -> Any:
        key = y.tobytes()
        if key != self._key:
            self._found = self._function(y)
            self._key = key
        return self._found
