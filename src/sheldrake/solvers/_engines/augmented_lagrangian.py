"""Augmented Lagrangians of programs (Nocedal and Wright, Numerical Optimization, 17.4)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.solvers._engines.highs import variable_bounds
from sheldrake.solvers._program.program import MathematicalProgram

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@checked
class _AugmentedLagrangian:
    def __init__(self, prog: MathematicalProgram, include_x_bounds: bool):
        self._prog, self._include = prog, bool(include_x_bounds)
        self._x_lo, self._x_up = variable_bounds(prog)
        boxes = set(prog.bounding_box_constraints())
        self._constraints = [b for b in prog.GetAllConstraints() if b not in boxes]
        self._equal: list[bool] = []
        for b in self._constraints:
            self._equal += _kinds(b._evaluator._lower, b._evaluator._upper)
        if self._include:
            self._equal += _kinds(self._x_lo, self._x_up)

    def prog(self) -> MathematicalProgram:
        """Returns the program."""
        return self._prog

    def include_x_bounds(self) -> bool:
        """Tells whether bounds of variables count as constraints."""
        return self._include

    def is_equality(self) -> list[bool]:
        """Tells of each constraint whether it is an equation; inequalities with two bounds are two."""
        return list(self._equal)

    def lagrangian_size(self) -> int:
        """Returns the number of multipliers."""
        return len(self._equal)

    def x_lo(self) -> np.ndarray:
        """Returns the lower bounds of all variables."""
        return self._x_lo.copy()

    def x_up(self) -> np.ndarray:
        """Returns the upper bounds of all variables."""
        return self._x_up.copy()

    def _parts(self, x: np.ndarray) -> tuple[Any, list]:
        """The cost, and h of equations and c >= 0 of inequalities in order."""
        prog = self._prog
        cost: Any = 0.0
        for added in prog.GetAllCosts():
            cost = cost + prog.EvalBinding(added, x)[0]
        found: list = []
        for b in self._constraints:
            found += _residues(prog.EvalBinding(b, x), b._evaluator._lower, b._evaluator._upper)
        if self._include:
            found += _residues(x, self._x_lo, self._x_up)
        return cost, found

    def _sum(self, cost: Any, residues: list, lambda_val: ArrayLike, mu: float) -> Any:
        total = cost
        for r, multiplier in zip(residues, np.asarray(lambda_val, dtype=float)):
            total = total - multiplier * r + (0.5 * mu) * r * r
        return total


def _kinds(lower: np.ndarray, upper: np.ndarray) -> list[bool]:
    out: list[bool] = []
    for a, b in zip(lower, upper):
        out += [True] if a == b else [False] * (int(np.isfinite(a)) + int(np.isfinite(b)))
    return out


def _residues(y: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> list:
    out: list = []
    for value, a, b in zip(y, lower, upper):
        if a == b:
            out.append(value - a)
            continue
        out += [value - a] if np.isfinite(a) else []
        out += [b - value] if np.isfinite(b) else []
    return out


def _plain(value: Any) -> float:
    return float(value) if isinstance(value, np.floating) else value


def _vector(items: list) -> np.ndarray:
    out = np.empty(len(items), dtype=object)
    out[:] = items
    return out if any(not isinstance(i, (float, np.floating)) for i in items) else out.astype(float)


@checked
class AugmentedLagrangianNonsmooth(_AugmentedLagrangian):
    """The augmented Lagrangian in x alone, slacks being s = max(c(x) - lambda / mu, 0).

    Args:
        prog: The program.
        include_x_bounds: Whether bounds of variables count as constraints.
    """

    def Eval(self, x: ArrayLike, lambda_val: ArrayLike, mu: float) -> tuple[Any, np.ndarray, Any]:
        """Returns the augmented Lagrangian, the residues of the constraints, and the cost.

        Args:
            x: Values of all variables.
            lambda_val: Multipliers.
            mu: Penalty.
        """
        cost, found = self._parts(np.asarray(x))
        inner = []
        for r, is_equality, multiplier in zip(found, self._equal, np.asarray(lambda_val, dtype=float)):
            slack = r - multiplier / mu
            inner.append(r if is_equality else (multiplier / mu + 0.0 * r if slack > 0.0 else r))
        return _plain(self._sum(cost, inner, lambda_val, mu)), _vector(found), _plain(cost)


@checked
class AugmentedLagrangianSmooth(_AugmentedLagrangian):
    """The augmented Lagrangian in x and slacks s >= 0 of the inequalities, c(x) - s = 0.

    Args:
        prog: The program.
        include_x_bounds: Whether bounds of variables count as constraints.
    """

    def s_size(self) -> int:
        """Returns the number of slacks."""
        return self._equal.count(False)

    def Eval(self, x: ArrayLike, s: ArrayLike, lambda_val: ArrayLike, mu: float) -> tuple[Any, np.ndarray, Any]:
        """Returns the augmented Lagrangian, the residues of the constraints with slacks, and the cost.

        Args:
            x: Values of all variables.
            s: Slacks.
            lambda_val: Multipliers.
            mu: Penalty.
        """
        cost, found = self._parts(np.asarray(x))
        slacks = iter(np.asarray(s))
        residues = [r if is_equality else r - next(slacks) for r, is_equality in zip(found, self._equal)]
        return _plain(self._sum(cost, residues, lambda_val, mu)), _vector(residues), _plain(cost)
