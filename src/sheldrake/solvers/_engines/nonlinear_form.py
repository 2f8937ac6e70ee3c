"""A program as min f(x), lower <= g(x) <= upper with derivatives, for solvers that see only functions."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from sheldrake.solvers._engines.highs import variable_bounds
from sheldrake.solvers._functions.bindings import BindingBase
from sheldrake.solvers._functions.evaluators import EvaluatorBase
from sheldrake.solvers._program.program import MathematicalProgram

_COSTS = ("generic_costs", "linear_costs", "quadratic_costs", "l2norm_costs")
_ROWS = (
    "linear_equality_constraints",
    "linear_constraints",
    "generic_constraints",
    "quadratic_constraints",
    "lorentz_cone_constraints",
    "rotated_lorentz_cone_constraints",
)


class Rows(NamedTuple):
    """A constraint, the places of its variables and of its rows."""

    binding: BindingBase | None
    evaluator: EvaluatorBase
    at: np.ndarray
    rows: slice
    distinct: bool


def _without_nan(J: np.ndarray) -> np.ndarray:
    """Derivatives, those that are nan (of a length at zero, say) taken as zero."""
    return np.where(np.isnan(J), 0.0, J) if np.isnan(J.sum()) else J


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
    """

    def __init__(self, prog: MathematicalProgram):
        self.prog, self.num_vars = prog, prog.num_vars()
        self.scale = np.ones(self.num_vars)
        for place, s in prog.GetVariableScaling().items():
            self.scale[place] = s
        low, high = variable_bounds(prog)
        self._costs = [(b._evaluator, prog._indices(b)) for name in _COSTS for b in prog._lists[name]]
        self.rows: list[Rows] = []
        lower: list[np.ndarray] = []
        upper: list[np.ndarray] = []
        at = 0
        for name in _ROWS:
            for b in prog._lists[name]:
                c = b._evaluator
                places = prog._indices(b)
                distinct = len(set(places)) == len(places)
                self.rows.append(Rows(b, c, places, slice(at, at + c.num_constraints()), distinct))
                lower.append(c._lower)
                upper.append(c._upper)
                at += c.num_constraints()
        for b in prog._lists["linear_complementarity_constraints"]:
            n = len(b._variables)
            places = prog._indices(b)
            low[places] = np.maximum(low[places], 0.0)
            self.rows.append(
                Rows(None, _Complementarity(b._evaluator._M, b._evaluator._q), places, slice(at, at + n + 1))
            )
            lower.append(np.append(np.zeros(n), -np.inf))
            upper.append(np.append(np.full(n, np.inf), 0.0))
            at += n + 1
        self.num_rows = at
        self.lower = np.concatenate(lower) if lower else np.zeros(0)
        self.upper = np.concatenate(upper) if upper else np.zeros(0)
        self.x_lower, self.x_upper = low / self.scale, high / self.scale
        self._callbacks = [(b._evaluator, prog._indices(b)) for b in prog._lists["visualization_callbacks"]]
        self._last_cost: tuple[bytes, Any] | None = None
        self._last_rows: tuple[bytes, Any] | None = None
        self.evaluations = 0

    def start(self, guess: np.ndarray) -> np.ndarray:
        """The guess in scaled units, zero where there is none, inside the bounds."""
        x = np.where(np.isnan(guess), 0.0, guess) / self.scale
        return np.minimum(np.maximum(x, self.x_lower), self.x_upper)

    def clip(self, y: np.ndarray) -> np.ndarray:
        """The nearest point inside the bounds of the variables."""
        return np.minimum(np.maximum(y, self.x_lower), self.x_upper)

    def cost(self, y: np.ndarray) -> tuple[float, np.ndarray]:
        """The cost and its gradient."""
        key = y.tobytes()
        if self._last_cost is None or self._last_cost[0] != key:
            self._last_cost = (key, self._cost(y * self.scale))
        return self._last_cost[1]

    def _cost(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        self.evaluations += 1
        total, gradient = 0.0, np.zeros(self.num_vars)
        self.cost_blocks = []
        for evaluator, at in self._costs:
            value, J = evaluator._eval_with_jacobian(x[at])
            total += float(value[0])
            block = _without_nan(J) * self.scale[at]
            self.cost_blocks.append(block)
            np.add.at(gradient, at, block[0])
        return total, gradient

    def constraints(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The values of all rows, shape `(num_rows,)`, and their derivatives, shape `(num_rows, num_vars)`."""
        key = y.tobytes()
        if self._last_rows is None or self._last_rows[0] != key:
            self._last_rows = (key, self._rows(y * self.scale))
        return self._last_rows[1]

    def _rows(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values, J = np.zeros(self.num_rows), np.zeros((self.num_rows, self.num_vars))
        self.row_blocks = []
        for row in self.rows:
            values[row.rows], block = row.evaluator._eval_with_jacobian(x[row.at])
            block = _without_nan(block) * self.scale[row.at]
            self.row_blocks.append(block)
            target = J[row.rows]
            if row.distinct:
                target[:, row.at] = block
            else:
                for j, place in enumerate(row.at):
                    target[:, place] += block[:, j]
        return values, J

    def values(self, y: np.ndarray) -> tuple[float, np.ndarray]:
        """Cost and values of rows, without derivatives."""
        key = y.tobytes()
        known, rows = self._last_cost, self._last_rows
        if known is not None and rows is not None and known[0] == rows[0] == key:
            return known[1][0], rows[1][0]
        x = y * self.scale
        cost = sum(float(evaluator._eval(x[at])[0]) for evaluator, at in self._costs)
        out = np.zeros(self.num_rows)
        for row in self.rows:
            out[row.rows] = row.evaluator._eval(x[row.at])
        return cost, out

    def excess(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """By how much each row is beyond its bounds, with sign, and the derivatives of that."""
        values, J = self.constraints(y)
        below, above = values < self.lower, values > self.upper
        r = np.where(below, values - self.lower, 0.0) + np.where(above, values - self.upper, 0.0)
        return r, np.where((below | above)[:, None], J, 0.0)

    def violation(self, y: np.ndarray) -> float:
        """The largest violation of a constraint, relative to the size of its bound if that is above one."""
        values = self.constraints(y)[0]
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
        x = y * self.scale
        for evaluator, at in self._callbacks:
            evaluator._eval(x[at])

    def multipliers(self, y: np.ndarray, tol: float = 1e-5) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Derivatives of the cost by the active bounds: of rows, of lower and of upper bounds of x.

        Least squares of the condition that the cost's gradient is a combination of those of the active constraints.
        """
        gradient = self.cost(y)[1]
        values, J = self.constraints(y)

        def close(a: np.ndarray, bound: np.ndarray) -> np.ndarray:
            size = np.maximum(1.0, np.abs(np.where(np.isfinite(bound), bound, 0.0)))
            return np.isfinite(bound) & (np.abs(a - bound) <= tol * size)

        rows = np.flatnonzero(close(values, self.lower) | close(values, self.upper))
        fixed = np.flatnonzero(close(y, self.x_lower) | close(y, self.x_upper))
        stack = np.vstack((J[rows], np.eye(self.num_vars)[fixed]))
        found = np.linalg.lstsq(stack.T, gradient, rcond=None)[0] if len(stack) else np.zeros(0)
        dual = np.zeros(self.num_rows)
        dual[rows] = found[: len(rows)]
        box = np.zeros(self.num_vars)
        box[fixed] = found[len(rows) :] / self.scale[fixed]
        return dual, np.maximum(box, 0.0), np.minimum(box, 0.0)
