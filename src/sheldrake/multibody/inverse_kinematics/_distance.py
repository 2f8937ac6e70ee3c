"""Constraints on signed distances between geometries."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.multibody.inverse_kinematics._kernels.forms import distance_slope
from sheldrake.multibody.inverse_kinematics._kinematic import KinematicFunction
from sheldrake.multibody.plant._parts import parts_of
from sheldrake.planning._kernels.distances import Bound
from sheldrake.planning._native_distances import NativeDistances
from sheldrake.solvers import Constraint
from sheldrake.solvers._functions.minimum_value import _MinimumValueConstraint, quadratically_smoothed_hinge

if TYPE_CHECKING:
    from sheldrake.geometry import GeometryId, QueryObject
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.planning._collision_checker import CollisionChecker, CollisionCheckerContext
    from sheldrake.systems.framework import Context


class _Distances(KinematicFunction):
    """Signed distances of pairs of geometries and their derivatives."""

    _pair: tuple[GeometryId, ...] | None = None
    """The only geometries that matter; None for all that may touch."""
    _kept: NativeDistances | None = None

    def _native(self, x: np.ndarray) -> NativeDistances | None:
        """What finds distances without Python, positions being put into the context; None where others move bodies."""
        self._place(x)
        if self._kept is None or not self._kept.is_current():
            self._kept = NativeDistances.of(self._plant, self._context, self._pair)
        return self._kept

    def _check_geometry(self, plant: MultibodyPlant | None, context: Context | None) -> None:
        if plant is None:
            raise ValueError(f"{type(self).__name__}: plant is None.")
        if not plant.geometry_source_is_registered():
            raise ValueError(
                "Kinematic constraint: MultibodyPlant has not registered its geometry source with SceneGraph yet. "
                "Please refer to AddMultibodyPlantSceneGraph on connecting MultibodyPlant to SceneGraph."
            )
        if context is None or not plant.get_geometry_query_input_port().HasValue(context):
            raise ValueError(
                "Kinematic constraint: Cannot get a valid geometry::QueryObject. Either the plant's geometry query "
                "input port is not properly connected to the SceneGraph's geometry query output port, or the "
                "plant_context is incorrect. Please refer to AddMultibodyPlantSceneGraph on connecting MultibodyPlant "
                "to SceneGraph."
            )

    def _query(self) -> QueryObject:
        return self._plant.get_geometry_query_input_port().Eval(self._context)

    def _pair_slope(self, query: QueryObject, pair: Any) -> np.ndarray:
        """Derivative of a signed distance by q, shape (nq,): its normal times the velocities of the nearest points."""
        parts = parts_of(self._plant)
        view, inspector = parts.contexts.view(self._context), query.inspector()
        rows, room = parts.kernel_models.rows_of_frames(), view.integers("nearest bodies", 2)
        room[:] = [rows[inspector.GetFrameId(geometry)] for geometry in (pair.id_A, pair.id_B)]
        nhat_W, p_WCa = pair.nhat_BA_W, query.GetPoseInWorld(pair.id_A) @ pair.p_ACa
        p_WCb = p_WCa - pair.distance * nhat_W
        slope = view.buffer("distance slope", view.nv)
        arguments = view.queries.model, view.queries.work, room, view.buffer("nearest", 9), slope
        ask = view.query(distance_slope, *arguments, given=("nearest",), needs=view.POSES, answer=slope)
        return self._by_q(ask(np.concatenate((p_WCa, p_WCb, nhat_W))))


@checked
class DistanceConstraint(_Distances, Constraint):
    """The signed distance of two geometries is bounded [m].

    Args:
        plant: The plant, connected to a SceneGraph.
        geometry_pair: The two geometries.
        plant_context: Its context, part of that of the diagram; where the positions are put.
        distance_lower: Least distance [m].
        distance_upper: Greatest distance [m].

    Raises:
        ValueError: the plant is None, or not connected to a SceneGraph.
    """

    def __init__(
        self,
        plant: MultibodyPlant | None,
        geometry_pair: tuple[GeometryId, GeometryId],
        plant_context: Context,
        distance_lower: float,
        distance_upper: float,
    ):
        self._check_geometry(plant, plant_context)
        self._pair = tuple(sorted(geometry_pair))
        if len(self._pair) != 2:
            raise TypeError(
                f"DistanceConstraint(): incompatible constructor arguments. geometry_pair has {len(self._pair)} "
                "elements, expected two GeometryIds."
            )
        self._set_plant(plant, plant_context, 1)
        self._set_bounds(np.array([float(distance_lower)]), np.array([float(distance_upper)]))

    def _value(self, more: np.ndarray) -> np.ndarray:
        assert self._pair is not None
        return np.array([self._query().ComputeSignedDistancePairClosestPoints(*self._pair).distance])

    def _eval(self, x: np.ndarray) -> np.ndarray:
        native = self._native(x) if self._is_float else None
        return super()._eval(x) if native is None else native.distances(math.inf, x)

    def _eval_with_jacobian(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if not self._is_float:
            return super()._eval_with_jacobian(x)
        native = self._native(x)
        if native is not None:
            return native.distances(math.inf, x), native.slopes()
        query = self._query()
        assert self._pair is not None
        pair = query.ComputeSignedDistancePairClosestPoints(*self._pair)
        return np.array([pair.distance]), self._pair_slope(query, pair).reshape(1, -1)


class _MinimumDistance(_Distances, _MinimumValueConstraint):
    """A smooth bound on the least of the signed distances of all pairs that may collide."""

    _jacobian = _MinimumValueConstraint._jacobian
    _display = _MinimumValueConstraint._display
    _latex = _MinimumValueConstraint._latex

    # A CollisionChecker, when distances are its business; planning is above this package.
    _checker: Any = None

    def _set_distances(self, robot: Any, bound: float, context: Any, offset: float, penalty: Callable | None) -> None:
        name = type(self).__name__
        if not math.isfinite(bound + offset):
            raise ValueError(f"{name}: influence_distance must be finite.")
        if offset <= 0.0:
            raise ValueError(
                f"{name}: influence_distance={bound + offset:g}, must be larger than bound={bound:g}; equivalently, "
                f"influence_distance_offset={offset:g}, but it needs to be positive."
            )
        if hasattr(robot, "CalcContextRobotClearance"):
            self._checker, self._checker_context, plant = robot, context, robot.plant()
            self._set_plant(plant, context.plant_context(), 1)
            pairs = robot.MaxContextNumDistances(context)
        else:
            plant = robot
            self._check_geometry(plant, context)
            self._set_plant(plant, context, 1)
            pairs = len(self._query().inspector().GetCollisionCandidates())
        self._set_up(plant.num_positions(), bound, offset, pairs, self._no_duals, self._distances, penalty)

    def _no_duals(self, x: np.ndarray, influence: float) -> np.ndarray:
        raise RuntimeError(f"{type(self).__name__}: distances of geometries are not computed for AutoDiffXd.")

    def _pairs(self, x: np.ndarray) -> tuple[Any, list]:
        self._place(x)
        query = self._query()
        return query, query.ComputeSignedDistancePairwiseClosestPoints(self._influence)

    def _clearance(self, x: np.ndarray) -> Any:
        return self._checker.CalcContextRobotClearance(self._checker_context, x, self._influence)

    def _distances(self, x: np.ndarray, influence: float) -> np.ndarray:
        if self._checker is not None:
            return self._clearance(x).distances()
        native = self._native(x)
        if native is not None:
            return native.distances(self._influence, x)
        return np.array([pair.distance for pair in self._pairs(x)[1]])

    def _values_with_jacobian(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if self._checker is not None:
            clearance = self._clearance(x)
            return clearance.distances(), clearance.jacobians()
        native = self._native(x)
        if native is not None:
            return native.distances(self._influence, x), native.slopes()
        query, pairs = self._pairs(x)
        J = [self._pair_slope(query, pair) for pair in pairs]
        return np.array([p.distance for p in pairs]), np.array(J).reshape(len(pairs), len(x))

    def _scale_to_penalty(self) -> None:
        super()._scale_to_penalty()
        self._least = Bound.of(
            bound=self._bound, influence=self._influence, scale=self._factor, alpha=self._alpha,
            pairs=self._max_num_values, is_over=self._lower_kind,
        )  # fmt: skip

    def _for_kernels(self, x: np.ndarray) -> NativeDistances | None:
        """What computes all of it without Python; None where distances or the penalty are somebody else's."""
        is_ours = self._checker is None and self._penalty is quadratically_smoothed_hinge
        return self._native(x) if is_ours else None

    def _eval(self, x: np.ndarray) -> np.ndarray:
        native = self._for_kernels(x)
        if native is None:
            return _MinimumValueConstraint._eval(self, x)
        return np.array([native.bound(self._influence, x, self._least, False)[0]])

    def _eval_with_jacobian(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        native = self._for_kernels(x)
        if native is None:
            return _MinimumValueConstraint._eval_with_jacobian(self, x)
        value, slope = native.bound(self._influence, x, self._least, True)
        return np.array([value]), slope.reshape(1, -1)

    def distance_bound(self) -> float:
        """Returns the bound [m]."""
        return self._bound

    def influence_distance(self) -> float:
        """Returns the distance from which on pairs do not count [m]."""
        return self._influence


@checked
class MinimumDistanceLowerBoundConstraint(_MinimumDistance):
    """All pairs of geometries that may collide are at least this far from each other.

    Args:
        plant: The plant, connected to a SceneGraph; or a CollisionChecker (by name: `collision_checker`).
        bound: Least signed distance [m].
        plant_context: Its context, part of that of the diagram; where the positions are put. For a checker, its
            context (by name: `collision_checker_context`).
        penalty_function: `(x, compute_grad) -> (value, slope)`, zero for x >= 0; a quadratic hinge if absent.
        influence_distance_offset: Pairs farther from each other than bound + this do not count [m].

    Raises:
        ValueError: the offset is not positive and finite, or the plant is None or not connected to a SceneGraph.
    """

    def __init__(
        self,
        plant: MultibodyPlant | CollisionChecker | None = None,
        bound: Any = None,
        plant_context: Context | CollisionCheckerContext | None = None,
        penalty_function: Callable | None = None,
        influence_distance_offset: float = 0.01,
        *,
        collision_checker: CollisionChecker | None = None,
        collision_checker_context: CollisionCheckerContext | None = None,
    ):
        robot = plant if collision_checker is None else collision_checker
        context = plant_context if collision_checker_context is None else collision_checker_context
        self._set_distances(robot, bound, context, influence_distance_offset, penalty_function)


@checked
class MinimumDistanceUpperBoundConstraint(_MinimumDistance):
    """Some pair of geometries that may collide is at most this far apart.

    Args:
        plant: The plant, connected to a SceneGraph; or a CollisionChecker (by name: `collision_checker`).
        bound: Greatest signed distance of the nearest pair [m].
        plant_context: Its context, part of that of the diagram; where the positions are put. For a checker, its
            context (by name: `collision_checker_context`).
        influence_distance_offset: Pairs farther from each other than bound + this do not count [m].
        penalty_function: `(x, compute_grad) -> (value, slope)`, zero for x >= 0; a quadratic hinge if absent.

    Raises:
        ValueError: the offset is not positive and finite, or the plant is None or not connected to a SceneGraph.
    """

    _lower_kind = False

    def __init__(
        self,
        plant: MultibodyPlant | CollisionChecker | None = None,
        bound: Any = None,
        plant_context: Context | CollisionCheckerContext | None = None,
        influence_distance_offset: Any = None,
        penalty_function: Callable | None = None,
        *,
        collision_checker: CollisionChecker | None = None,
        collision_checker_context: CollisionCheckerContext | None = None,
    ):
        robot = plant if collision_checker is None else collision_checker
        context = plant_context if collision_checker_context is None else collision_checker_context
        self._set_distances(robot, bound, context, influence_distance_offset, penalty_function)
