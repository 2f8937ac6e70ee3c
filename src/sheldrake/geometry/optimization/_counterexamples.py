"""Configurations in collision near a center, by nonlinear programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.geometry.optimization._ellipsoids import Hyperellipsoid
from sheldrake.geometry.optimization._hpolyhedron import HPolyhedron
from sheldrake.solvers import Constraint, MathematicalProgram, SolverInterface
from sheldrake.solvers._engines.quadratic import solve_rows
from sheldrake.solvers._functions.evaluators import Opaque

if TYPE_CHECKING:
    from sheldrake.solvers import SolverOptions


class Violated(Opaque, Constraint):
    """One value of a constraint is beyond one of its bounds by a little.

    Args:
        constraint: The constraint.
        row: Which value.
        upper: Which bound.
    """

    _thread_safe = False
    _MARGIN = 1e-5

    def __init__(self, constraint: Any, row: int, upper: bool):
        self._of, self._row = constraint, row
        self._set_sizes(1, constraint.num_vars())
        low, high = np.array([-np.inf]), np.array([np.inf])
        if upper:
            low = np.array([constraint.upper_bound()[row] + self._MARGIN])
        else:
            high = np.array([constraint.lower_bound()[row] - self._MARGIN])
        self._set_bounds(low, high)

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return self._of._eval(x)[self._row : self._row + 1]

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        return self._of._jacobian(x)[self._row : self._row + 1]


def violations(prog: MathematicalProgram | None) -> list[tuple[Constraint, np.ndarray]]:
    """Ways to violate the constraints of a program, each with the places of its variables."""
    out: list[tuple[Constraint, np.ndarray]] = []
    if prog is None:
        return out
    for binding in prog.GetAllConstraints():
        c, places = binding.evaluator(), np.array(prog.FindDecisionVariableIndices(binding.variables()))
        for row, (low, high) in enumerate(zip(c.lower_bound(), c.upper_bound())):
            out += [(Violated(c, row, True), places)] if np.isfinite(high) else []
            out += [(Violated(c, row, False), places)] if np.isfinite(low) else []
    return out


_STEPS = 25  # Of a search; those that succeed take about ten.
_PENALTY = 1e3  # Of a collision that is still missed, against the square of the distance from the center.
_REACHED = 1e-6  # A collision that is missed by less is one.


def closest(
    collision: Constraint,
    places: np.ndarray,
    ellipsoid: Hyperellipsoid,
    region: HPolyhedron,
    guess: np.ndarray,
    solver: SolverInterface | None = None,
    options: Any = None,
) -> np.ndarray | None:
    """A point of a region in collision as near to the center of an ellipsoid, in its metric, as found from a guess.

    Without a solver it is found by quadratic programs with a linear collision, in steps that shrink where that is wrong
    (Fletcher's Sl1QP): it gives up much sooner than solvers that have to be sure.
    """
    if solver is not None:
        return _by_solver(collision, places, ellipsoid, region, guess, solver, options)
    low, high = collision.lower_bound()[0], collision.upper_bound()[0]
    sign, bound = (1.0, high) if np.isfinite(high) else (-1.0, low)
    metric, center = ellipsoid.A().T @ ellipsoid.A(), ellipsoid.center()
    metric = metric / np.trace(metric) * len(metric)
    steps = _Steps(metric, center, region)

    def at(x: np.ndarray) -> tuple[float, np.ndarray, float]:
        y, J = collision._eval_with_jacobian(x[places])
        missed, slope = sign * (float(y[0]) - bound), np.zeros(x.size)
        slope[places] = sign * J[0]
        away = x - center
        return missed, slope, 0.5 * float(away @ metric @ away) + _PENALTY * max(missed, 0.0)

    x, radius = guess, 1.0
    missed, slope, merit = at(x)
    for _ in range(_STEPS):
        new = steps.best(x, missed, slope, radius)
        length = 0.0 if new is None else float(np.abs(new - x).max())
        if new is None or length < 1e-7:
            break
        there = at(new)
        if there[2] < merit:
            x, (missed, slope, merit), radius = new, there, 2.0 * radius
        else:
            radius = 0.3 * length
    return x if missed <= _REACHED else None


class _Steps:
    """The quadratic programs of a search: their rows are the slack, steps to either side, the region, the collision.

    Args:
        metric: Of the distance from the center, shape (n, n).
        center: Shape (n,).
        region: Where the search stays.
    """

    def __init__(self, metric: np.ndarray, center: np.ndarray, region: HPolyhedron):
        n, faces = center.size, region.b().size
        self._n, self._Q, self._q = n, np.zeros((n + 1, n + 1)), np.append(-metric @ center, _PENALTY)
        self._A, self._b = np.zeros((2 * n + 2 + faces, n + 1)), np.zeros(2 * n + 2 + faces)
        self._Q[:n, :n] = metric
        self._A[0, n] = self._A[-1, n] = -1.0
        self._A[1 : n + 1, :n], self._A[n + 1 : 2 * n + 1, :n] = np.eye(n), -np.eye(n)
        self._A[2 * n + 1 : -1, :n], self._b[2 * n + 1 : -1] = region.A(), region.b()

    def best(self, x: np.ndarray, missed: float, slope: np.ndarray, radius: float) -> np.ndarray | None:
        """The best point of the region within a radius of x if the collision were linear."""
        n, b = self._n, self._b
        b[1 : n + 1], b[n + 1 : 2 * n + 1], b[-1] = x + radius, radius - x, slope @ x - missed
        self._A[-1, :n] = slope
        found = solve_rows(self._Q, self._q, self._A, b, 0)
        return None if found is None else found[:n]


def _by_solver(
    collision: Constraint,
    places: np.ndarray,
    ellipsoid: Hyperellipsoid,
    region: HPolyhedron,
    guess: np.ndarray,
    solver: Any,
    options: SolverOptions | None,
) -> np.ndarray | None:
    prog = MathematicalProgram()
    q = prog.NewContinuousVariables(guess.size, "q")
    prog.AddQuadraticErrorCost(ellipsoid.A().T @ ellipsoid.A(), ellipsoid.center(), q)
    prog.AddLinearConstraint(region.A(), np.full(region.b().size, -np.inf), region.b(), q)
    prog.AddConstraint(collision, q[places])
    result = SolverInterface.Solve(solver, prog, guess, options)
    return result.GetSolution(q) if result.is_success() else None
