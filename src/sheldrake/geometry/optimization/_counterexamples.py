"""Configurations in collision near a center, by nonlinear programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.geometry.optimization._ellipsoids import Hyperellipsoid
from sheldrake.geometry.optimization._hpolyhedron import HPolyhedron
from sheldrake.solvers import Constraint, MathematicalProgram, SolverInterface
from sheldrake.solvers._engines.quadratic import solve_quadratic_program
from sheldrake.solvers._functions.evaluators import EvaluatorBase

if TYPE_CHECKING:
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.solvers import SolverOptions
    from sheldrake.systems.framework import Context


class PairDistance(Constraint):
    """The signed distance of two geometries is not positive; variables q.

    Args:
        plant: A plant of floats, connected to a SceneGraph.
        context: Its context, part of that of the diagram; where the positions are put.
        pair: The geometries.
    """

    _thread_safe = False

    def __init__(self, plant: MultibodyPlant, context: Context, pair: tuple):
        self._plant, self._context, self._pair = plant, context, pair
        self._set_sizes(1, plant.num_positions())
        self._set_bounds(np.array([-np.inf]), np.zeros(1))

    def _found(self, q: np.ndarray) -> tuple[Any, Any]:
        self._plant.SetPositions(self._context, q)
        query = self._plant.get_geometry_query_input_port().Eval(self._context)
        return query.inspector(), query.ComputeSignedDistancePairClosestPoints(*self._pair)

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return np.array([self._found(x)[1].distance])

    def _eval_with_jacobian(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        from sheldrake.multibody.tree import JacobianWrtVariable

        inspector, found = self._found(x)
        W, wrt = self._plant.world_frame(), JacobianWrtVariable.kQDot
        total = np.zeros(x.size)
        for sign, geometry, p_GC in ((1.0, found.id_A, found.p_ACa), (-1.0, found.id_B, found.p_BCb)):
            body = self._plant.GetBodyFromFrameId(inspector.GetFrameId(geometry))
            assert body is not None  # pairs are of bodies of the plant
            frame = body.body_frame()
            p_BC = inspector.GetPoseInFrame(geometry) @ np.asarray(p_GC)
            J = self._plant.CalcJacobianTranslationalVelocity(self._context, wrt, frame, p_BC.reshape(3, 1), W, W)
            total += sign * found.nhat_BA_W @ J
        return np.array([found.distance]), total.reshape(1, -1)

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        return self._eval_with_jacobian(x)[1]

    def _eval_symbols(self, x: np.ndarray) -> np.ndarray:
        raise RuntimeError("The distance of geometries is no function of symbols.")

    _display = EvaluatorBase._display
    _latex = EvaluatorBase._latex


class Violated(Constraint):
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

    _display = EvaluatorBase._display
    _latex = EvaluatorBase._latex


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

    def at(x: np.ndarray) -> tuple[float, np.ndarray, float]:
        y, J = collision._eval_with_jacobian(x[places])
        missed, slope = sign * (float(y[0]) - bound), np.zeros(x.size)
        slope[places] = sign * J[0]
        return missed, slope, 0.5 * (x - center) @ metric @ (x - center) + _PENALTY * max(missed, 0.0)

    x, radius = guess, 1.0
    missed, slope, merit = at(x)
    for _ in range(_STEPS):
        new = _step(metric, center, region, x, missed, slope, radius)
        if new is None or np.abs(new - x).max() < 1e-7:
            break
        there = at(new)
        if there[2] < merit:
            x, (missed, slope, merit), radius = new, there, 2.0 * radius
        else:
            radius = 0.3 * np.abs(new - x).max()
    return x if missed <= _REACHED else None


def _step(
    metric: np.ndarray,
    center: np.ndarray,
    region: HPolyhedron,
    x: np.ndarray,
    missed: float,
    slope: np.ndarray,
    radius: float,
) -> np.ndarray | None:
    """The best point of a region within a radius of x if the collision were linear."""
    n, each = x.size, np.eye(x.size + 1)
    A = np.vstack(
        (each, np.hstack((region.A(), np.zeros((region.b().size, 1)))), np.append(slope, -1.0))
    )  # q and slack
    lower = np.concatenate((x - radius, [0.0], np.full(region.b().size + 1, -np.inf)))
    upper = np.concatenate((x + radius, [np.inf], region.b(), [slope @ x - missed]))
    Q = np.zeros((n + 1, n + 1))
    Q[:n, :n] = metric
    # Regions depend on last digits, by factors of ten in volume: those of Clarabel are the ones that were compared.
    found = solve_quadratic_program(Q, np.append(-metric @ center, _PENALTY), A, lower, upper, dense=False)
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
