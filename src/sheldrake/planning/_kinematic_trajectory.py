"""Trajectories of positions as B-splines whose control points and duration are decision variables."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import anything, count, instance_of
from sheldrake.common._overloads import overload, overloaded
from sheldrake.math import BsplineBasis, KnotVectorType
from sheldrake.planning._path_constraints import (
    DerivativeConstraint,
    EffortConstraint,
    PathConstraint,
    WrappedVelocityConstraint,
)
from sheldrake.solvers import Constraint, Cost, MathematicalProgram
from sheldrake.solvers import _kinds as kinds
from sheldrake.solvers._functions.bindings import BindingBase, as_kind
from sheldrake.symbolic import Variable
from sheldrake.symbolic import _traverse as traverse
from sheldrake.trajectories import BsplineTrajectory

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.solvers import Binding, MathematicalProgramResult
    from sheldrake.solvers._functions.constraints import LinearConstraint
    from sheldrake.systems.framework import Context


@checked
class KinematicTrajectoryOptimization:
    """Optimizes q(t) = r(t / T) for a B-spline r on [0, 1] and a duration T.

    Called as `(num_positions, num_control_points, spline_order=4, duration=1.0)`; or `(trajectory)`, which takes order,
    number of control points and initial guess from a BsplineTrajectory.
    """

    @overloaded(
        overload(num_positions=count, num_control_points=count, spline_order=(count, 4), duration=(kinds.number, 1.0)),
        overload(lambda self, trajectory: self._set_up_like(trajectory), trajectory=instance_of(BsplineTrajectory)),
    )
    def __init__(self, num_positions: int, num_control_points: int, order: int, duration: float):
        self._nq, self._n = num_positions, num_control_points
        self._basis = BsplineBasis(order, self._n, KnotVectorType.kClampedUniform, 0.0, 1.0)
        self._prog = MathematicalProgram()
        self._points = self._prog.NewContinuousVariables(self._nq, self._n, "control_point").reshape(self._nq, self._n)
        self._T = self._prog.NewContinuousVariables(1, "duration")[0]
        self._q, self._qdot, self._qddot = (
            traverse.object_array([Variable(f"{name}({i})") for i in range(self._nq)])
            for name in ("q", "qdot", "qddot")
        )
        positive = self._prog.AddBoundingBoxConstraint(0.0, np.inf, self._T)
        positive.evaluator().set_description("positive duration constraint")
        self._prog.SetInitialGuess(self._points, np.zeros((self._nq, self._n)))
        self._prog.SetInitialGuess(self._T, duration)
        self._units = BsplineTrajectory(self._basis, list(np.eye(self._n)[:, :, None]))  # the weights of control points

    def _set_up_like(self, trajectory: BsplineTrajectory) -> None:
        self.__init__(trajectory.rows(), trajectory.num_control_points(), trajectory.basis().order())  # type: ignore[misc]
        self.SetInitialGuess(trajectory)

    # What there is

    def num_positions(self) -> int:
        """Returns the number of positions."""
        return self._nq

    def num_control_points(self) -> int:
        """Returns the number of control points."""
        return self._n

    def basis(self) -> BsplineBasis:
        """Returns the basis of the path, on [0, 1]."""
        return self._basis

    def control_points(self) -> np.ndarray:
        """Returns the control points as columns, shape (num_positions, num_control_points)."""
        return self._points.copy()

    def duration(self) -> Variable:
        """Returns the variable of the duration [s]."""
        return self._T

    def q(self) -> np.ndarray:
        """Returns placeholders of positions, shape (num_positions,)."""
        return self._q.copy()

    def qdot(self) -> np.ndarray:
        """Returns placeholders of velocities, shape (num_positions,)."""
        return self._qdot.copy()

    def qddot(self) -> np.ndarray:
        """Returns placeholders of accelerations, shape (num_positions,)."""
        return self._qddot.copy()

    def prog(self) -> MathematicalProgram:
        """Returns the program."""
        return self._prog

    def get_mutable_prog(self) -> MathematicalProgram:
        """Returns the program."""
        return self._prog

    # Guess and result

    def SetInitialGuess(self, trajectory: BsplineTrajectory) -> None:
        """Sets the guess of control points and duration to those of a BsplineTrajectory.

        Raises:
            RuntimeError: its shape or the number of its control points is another.
        """
        points = np.stack([np.asarray(p, dtype=float).ravel() for p in trajectory.control_points()], axis=1)
        if points.shape != self._points.shape or trajectory.cols() != 1:
            raise RuntimeError(
                f"SetInitialGuess(): expected control points of shape {self._points.shape}, got {points.shape}."
            )
        self._prog.SetInitialGuess(self._points, points)
        self._prog.SetInitialGuess(self._T, float(trajectory.end_time() - trajectory.start_time()))

    def ReconstructTrajectory(self, result: MathematicalProgramResult) -> BsplineTrajectory:
        """Returns the trajectory q(t) on [0, T]."""
        T = result.GetSolution(self._T)
        basis = BsplineBasis(self._basis.order(), [k * T for k in self._basis.knots()])
        points = result.GetSolution(self._points)
        return BsplineTrajectory(basis, [points[:, k : k + 1] for k in range(self._n)])

    # The path

    def _weights(self, call: str, s: float, derivative: int) -> tuple[np.ndarray, np.ndarray]:
        """Which control points r(s), or a derivative, depends on, and their weights.

        Raises:
            RuntimeError: s is not in [0, 1].
        """
        if not 0.0 <= s <= 1.0:
            raise RuntimeError(f"{call}(): s must be from 0 to 1, got {s}.")
        weights = self._units.EvalDerivative(float(s), derivative)[:, 0]
        active = np.flatnonzero(weights)
        return active, weights[active]

    def _add_linear(
        self, call: str, lb: ArrayLike, ub: ArrayLike, s: float, derivative: int, what: str
    ) -> BindingBase[LinearConstraint]:
        lower, upper = self._sized(call, lb), self._sized(call, ub)
        active, weights = self._weights(call, s, derivative)
        A = np.kron(np.eye(self._nq), weights.reshape(1, -1))
        vars = np.concatenate([self._points[i, active] for i in range(self._nq)])
        binding = self._prog.AddLinearConstraint(A, lower, upper, vars)
        binding.evaluator().set_description(f"path {what} constraint at s={s:g}")
        return binding

    def _sized(self, call: str, value: ArrayLike) -> np.ndarray:
        v = np.atleast_1d(np.array(value, dtype=float)).ravel()
        if v.size != self._nq:
            raise RuntimeError(f"{call}(): expected {self._nq} values, got {v.size}.")
        return v

    @overloaded(
        overload(
            lambda self, lb, ub, s: self._add_linear("AddPathPositionConstraint", lb, ub, s, 0, "position"),
            lb=anything,
            ub=anything,
            s=kinds.number,
        ),
        overload(constraint=instance_of(Constraint), s=kinds.number),
    )
    def AddPathPositionConstraint(self, constraint: Constraint, s: float) -> Binding[Constraint]:
        """Adds lb <= r(s) <= ub, called as `(lb, ub, s)`; or a constraint of positions, called as `(constraint, s)`.

        Raises:
            RuntimeError: s is not in [0, 1], or sizes differ.
        """
        call = "AddPathPositionConstraint"
        if constraint.num_vars() != self._nq:
            raise RuntimeError(f"{call}(): the constraint has {constraint.num_vars()} variables, not {self._nq}.")
        active, weights = self._weights(call, s, 0)
        new = PathConstraint(constraint, weights)
        new.set_description(f"path position constraint at s={s:g}")
        return self._prog.AddConstraint(new, self._points[:, active].ravel(order="F"))

    def AddPathVelocityConstraint(self, lb: ArrayLike, ub: ArrayLike, s: float) -> Binding[Constraint]:
        """Adds lb <= rdot(s) <= ub for the derivative by s."""
        return self._add_linear("AddPathVelocityConstraint", lb, ub, s, 1, "velocity")

    def AddPathAccelerationConstraint(self, lb: ArrayLike, ub: ArrayLike, s: float) -> Binding[Constraint]:
        """Adds lb <= rddot(s) <= ub for the second derivative by s."""
        return self._add_linear("AddPathAccelerationConstraint", lb, ub, s, 2, "acceleration")

    @overloaded(
        overload(lambda self, binding, s: self._linear_velocity(binding, s), binding=kinds.binding, s=kinds.number),
        overload(constraint=instance_of(Constraint), s=kinds.number),
    )
    def AddVelocityConstraintAtNormalizedTime(self, constraint: Constraint, s: float) -> Binding[Constraint]:
        """Adds a constraint on (q, qdot) at t = s T, called as `(constraint, s)`; or linear bounds on placeholders
        qdot, called as `(binding, s)`, which returns a list.

        Raises:
            RuntimeError: s is not in [0, 1], sizes differ, or the binding has other variables.
        """
        call = "AddVelocityConstraintAtNormalizedTime"
        if constraint.num_vars() != 2 * self._nq:
            raise RuntimeError(f"{call}(): the constraint has {constraint.num_vars()} variables, not {2 * self._nq}.")
        new = WrappedVelocityConstraint(constraint, *(self._path_matrix(call, s, d) for d in (0, 1)))
        new.set_description(f"velocity constraint at s={s:g}")
        return self._prog.AddConstraint(new, self._all())

    def _all(self) -> np.ndarray:
        return np.concatenate(([self._T], self._points.ravel(order="F")))

    def _path_matrix(self, call: str, s: float, derivative: int) -> np.ndarray:
        """M with M c the derivative of r(s), for all control points c column after column."""
        active, weights = self._weights(call, s, derivative)
        row = np.zeros(self._n)
        row[active] = weights
        return np.kron(row.reshape(1, -1), np.eye(self._nq))

    def _linear_velocity(self, binding: BindingBase, s: float) -> list:
        call = "AddVelocityConstraintAtNormalizedTime"
        places = {v: i for i, v in enumerate(self._qdot)}
        columns = []
        for v in binding._variables:
            if v not in places:
                raise RuntimeError(f"{call}(): {v} is none of the placeholders qdot().")
            columns.append(places[v])
        c = binding._evaluator
        A = np.zeros((c.num_constraints(), self._nq))
        np.add.at(A.T, columns, c.GetDenseA().T)
        active, weights = self._weights(call, s, 1)
        path = np.hstack([A[:, i : i + 1] * weights for i in range(self._nq)])
        lower, upper = c.lower_bound(), c.upper_bound()
        low, high = np.isfinite(lower), np.isfinite(upper)
        M = np.vstack((np.hstack((path[low], -lower[low][:, None])), np.hstack((path[high], -upper[high][:, None]))))
        lb = np.concatenate((np.zeros(low.sum()), np.full(high.sum(), -np.inf)))
        ub = np.concatenate((np.full(low.sum(), np.inf), np.zeros(high.sum())))
        vars = np.concatenate((*(self._points[i, active] for i in range(self._nq)), [self._T]))
        new = self._prog.AddLinearConstraint(M, lb, ub, vars)
        new.evaluator().set_description(f"velocity constraint at s={s:g}")
        return [new]

    # Bounds at all times, by the convex hull of control points

    def AddPositionBounds(self, lb: ArrayLike, ub: ArrayLike) -> list:
        """Adds bounds on q at all times; one constraint for each control point."""
        lower, upper = self._sized("AddPositionBounds", lb), self._sized("AddPositionBounds", ub)
        out = []
        for k in range(self._n):
            out.append(self._prog.AddBoundingBoxConstraint(lower, upper, self._points[:, k]))
            out[-1].evaluator().set_description(f"position bound {k}")
        return out

    def _by_control_points(self, derivative: int) -> np.ndarray:
        """M with M c the control points of a derivative of a path in one position with control points c."""
        return self._units._linear_in_control_points(derivative).T

    def AddVelocityBounds(self, lb: ArrayLike, ub: ArrayLike) -> list:
        """Adds bounds on qdot at all times; a lower and an upper one for each position."""
        lower, upper = self._sized("AddVelocityBounds", lb), self._sized("AddVelocityBounds", ub)
        M = self._by_control_points(1)
        m, out = len(M), []
        for i in range(self._nq):
            vars = np.concatenate(([self._T], self._points[i]))
            for end, bound, least, most in (("lower", lower[i], 0.0, np.inf), ("upper", upper[i], -np.inf, 0.0)):
                rows = np.hstack((np.full((m, 1), -bound), M))
                out.append(self._prog.AddLinearConstraint(rows, np.full(m, least), np.full(m, most), vars))
                out[-1].evaluator().set_description(f"velocity {end} bound for position {i}")
        return out

    def _derivative_bounds(self, call: str, lb: ArrayLike, ub: ArrayLike, order: int, what: str) -> list:
        lower, upper = self._sized(call, lb), self._sized(call, ub)
        M, out = self._by_control_points(order), []
        for i in range(self._nq):
            new = DerivativeConstraint(M, order, lower[i], upper[i])
            new.set_description(f"{what} bound for position {i}")
            out.append(self._prog.AddConstraint(new, np.concatenate(([self._T], self._points[i]))))
        return out

    def AddAccelerationBounds(self, lb: ArrayLike, ub: ArrayLike) -> list:
        """Adds bounds on the second derivative of q at all times; one constraint for each position."""
        return self._derivative_bounds("AddAccelerationBounds", lb, ub, 2, "acceleration")

    def AddJerkBounds(self, lb: ArrayLike, ub: ArrayLike) -> list:
        """Adds bounds on the third derivative of q at all times; one constraint for each position."""
        return self._derivative_bounds("AddJerkBounds", lb, ub, 3, "jerk")

    def AddEffortBoundsAtNormalizedTimes(
        self, plant: MultibodyPlant, s: Any, lb: Any = None, ub: Any = None, plant_context: Context | None = None
    ) -> list:
        """Adds bounds on the efforts of actuators at some times s T; one constraint for each.

        Args:
            plant: The plant, whose qdot is v.
            s: From 0 to 1.
            lb: Least efforts, shape (num_actuators,); those of the plant if absent.
            ub: Greatest efforts, shape (num_actuators,); those of the plant if absent.
            plant_context: Its parameters.

        Raises:
            RuntimeError: sizes differ, or the plant has quaternions.
        """
        call = "AddEffortBoundsAtNormalizedTimes"
        if plant.num_positions() != self._nq or not plant.IsVelocityEqualToQDot():
            raise RuntimeError(f"{call}(): the plant must have {self._nq} positions with qdot = v.")
        B = plant.MakeActuationMatrix()
        efforts = [
            np.array(given if given is not None else limit, dtype=float)
            for given, limit in ((lb, plant.GetEffortLowerLimits()), (ub, plant.GetEffortUpperLimits()))
        ]
        lower, upper = (_product(B, e) for e in efforts)
        duals = plant.ToAutoDiffXd()
        context = duals.CreateDefaultContext()
        if plant_context is not None:
            context.SetTimeStateAndParametersFrom(plant_context)
        out = []
        for one in np.atleast_1d(np.asarray(s, dtype=float)):
            matrices = tuple(self._path_matrix(call, float(one), d) for d in (0, 1, 2))
            new = EffortConstraint(duals, context, matrices, lower, upper)
            new.set_description(f"effort bound at s={one:g}")
            out.append(self._prog.AddConstraint(new, self._all()))
        return out

    # Duration and costs

    def AddDurationConstraint(self, lb: float | None, ub: float | None) -> Binding[Constraint]:
        """Adds bounds on the duration [s]; None for none."""
        box = self._prog.AddBoundingBoxConstraint(0.0 if lb is None else lb, np.inf if ub is None else ub, self._T)
        box.evaluator().set_description("duration constraint")
        return box

    def AddDurationCost(self, weight: float = 1.0) -> Binding[Cost]:
        """Adds the cost weight T."""
        cost = self._prog.AddLinearCost(np.array([float(weight)]), 0.0, np.array([self._T], dtype=object))
        cost.evaluator().set_description("duration cost")
        return cost

    def _segment(self, k: int) -> np.ndarray:
        return np.concatenate((self._points[:, k], self._points[:, k - 1]))

    def AddPathLengthCost(self, weight: float = 1.0, use_conic_constraint: bool = False) -> list:
        """Adds weight times the length of the polygon of control points, which is at least that of the path."""
        A = weight * np.hstack((np.eye(self._nq), -np.eye(self._nq)))
        out = []
        cost: BindingBase[Cost]
        for k in range(1, self._n):
            if use_conic_constraint:
                _, cost, cone = self._prog.AddL2NormCostUsingConicConstraint(A, np.zeros(self._nq), self._segment(k))
                cone.evaluator().set_description(f"path length cost {k} conic constraint")
            else:
                cost = self._prog.AddL2NormCost(A, np.zeros(self._nq), self._segment(k))
            cost.evaluator().set_description(f"path length cost {k}")
            out.append(as_kind(Cost, cost))
        return out

    def AddPathEnergyCost(self, weight: float = 1.0) -> list:
        """Adds weight times the sum of squared distances of neighbouring control points."""
        A = np.hstack((np.eye(self._nq), -np.eye(self._nq)))
        out = []
        for k in range(1, self._n):
            cost = self._prog.AddQuadraticCost(2.0 * weight * A.T @ A, np.zeros(2 * self._nq), self._segment(k), True)
            cost.evaluator().set_description(f"path energy cost {k}")
            out.append(as_kind(Cost, cost))
        return out


def _product(B: np.ndarray, effort: np.ndarray) -> np.ndarray:
    """B e, where efforts may be infinite."""
    out = np.zeros(len(B))
    for i, j in zip(*np.nonzero(B)):
        out[i] += B[i, j] * effort[j]
    return out
