"""Collisions as the SceneGraph of a model finds them."""

from __future__ import annotations

import copy
import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.geometry import (
    CollisionFilterDeclaration,
    GeometryInstance,
    GeometrySet,
    ProximityProperties,
)
from sheldrake.multibody.plant._parts import parts_of
from sheldrake.multibody.tree import BodyIndex, JacobianWrtVariable
from sheldrake.planning._clearance import RobotClearance, RobotCollisionType
from sheldrake.planning._collision_checker import CollisionChecker, CollisionCheckerContext, CollisionCheckerParams
from sheldrake.planning._native_checks import NativeChecks
from sheldrake.planning._native_distances import NativeDistances

if TYPE_CHECKING:
    from sheldrake.geometry import GeometryId, SceneGraphInspector, Shape
    from sheldrake.geometry._ids import FrameId
    from sheldrake.geometry._query.results import SignedDistancePair
    from sheldrake.math import RigidTransform
    from sheldrake.multibody.tree import RigidBody

_Kind = RobotCollisionType
_FEW = 64  # configurations that are checked in a tenth of the time that it takes to bind a call or to start threads


class NearPairs(NamedTuple):
    """Pairs of geometries that are near each other.

    Attributes:
        bodies: Their bodies, shape (n, 2).
        left: Their distances less padding [m], shape (n,).
        slopes: Gives the derivatives of distances by the configuration, shape (n, nq), until the next search.
        numbers: The geometries, by their places in `ids`, shape (n, 2).
        ids: Geometries.
    """

    bodies: np.ndarray
    left: np.ndarray
    slopes: Callable[[], np.ndarray]
    numbers: np.ndarray
    ids: list[GeometryId]


def _settings(checker: CollisionChecker, params: CollisionCheckerParams | None, kwargs: dict) -> CollisionCheckerParams:
    """What a checker is made of, given as one or by name."""
    if params is not None and kwargs:
        raise TypeError(f"{type(checker).__name__}(): params come with {', '.join(kwargs)}; give one or the other.")
    return CollisionCheckerParams(**kwargs) if params is None else params


@checked
class SceneGraphCollisionChecker(CollisionChecker):
    """Checks collisions by the distances of a SceneGraph.

    Args:
        params: Model, robot, paddings and step size.

    Raises:
        RuntimeError: the model or the robot is missing, or the step size is not positive.
    """

    def __init__(self, params: CollisionCheckerParams | None = None, **kwargs: Any):
        self._set_up(_settings(self, params, kwargs), True)
        self._bodies: dict[Any, int] = {}
        self._checks: NativeChecks | None = None
        self._rows: tuple[list[GeometryId], np.ndarray] = [], np.zeros(0, np.int64)

    def _body_of(self, inspector: SceneGraphInspector, geometry: GeometryId) -> int:
        found = self._bodies.get(geometry)
        if found is None:
            found = int(self._plant.GetBodyFromFrameId(inspector.GetFrameId(geometry)).index())
            self._bodies[geometry] = found
        return found

    def _near(self, context: CollisionCheckerContext, distance: float) -> NearPairs:
        """Pairs with the robot that are looked at and, less padding, no farther apart than a distance [m]."""
        reach = max(0.0, distance + self.GetLargestPadding())
        native = self._distances_of(context)
        if native is not None:
            found = native.distances(reach, self._plant.GetPositions(context.plant_context()))
            pair, order = native.pairs()
            ids, slopes = native.ids(), native.slopes
            bodies = self._bodies_of(ids)[pair]
        else:
            query = context.GetQueryObject()
            pairs = query.ComputeSignedDistancePairwiseClosestPoints(reach)
            found, order = np.array([pair.distance for pair in pairs], float), np.arange(len(pairs))
            ids = [geometry for pair in pairs for geometry in (pair.id_A, pair.id_B)]
            pair = np.arange(len(ids)).reshape(-1, 2)
            bodies = np.array([self._body_of(query.inspector(), geometry) for geometry in ids], np.int64)[pair]
            slopes = functools.partial(self._slopes, context, pairs)
        bodies = bodies[order]
        at = bodies[:, 0], bodies[:, 1]
        left = found[order] - self._padding[at]
        looked_at = (self._filter[at] == 0) & (left <= distance)
        rows = order[looked_at]
        return NearPairs(bodies[looked_at], left[looked_at], lambda: slopes()[rows], pair[rows], ids)

    def _bodies_of(self, ids: list[GeometryId]) -> np.ndarray:
        """The bodies of a scene's geometries."""
        of, bodies = self._rows
        if of is not ids:
            inspector = self._inspector()
            bodies = np.array([self._body_of(inspector, geometry) for geometry in ids], np.int64)
            self._rows = ids, bodies
        return bodies

    def _distances_of(self, context: CollisionCheckerContext) -> NativeDistances | None:
        """What finds distances in a context without Python; None where something is not of kernels."""
        kept = context._distances
        if kept is None or not kept.is_current():
            kept = context._distances = NativeDistances.of(self._plant, context.plant_context())
        return kept

    def _is_free(self, context: CollisionCheckerContext) -> bool:
        checks = self._native_checks() if context is self._contexts[0] else None
        if checks is not None:
            q = checks.view.q[None]
            return checks.first_collision(q, self._filter, self._padding) == 1
        if not self._padding.any():
            query = context.GetQueryObject()
            if not query.HasCollisions():
                return True
            inspector = query.inspector()
            pairs = query.ComputePointPairPenetration()
            bodies = ((self._body_of(inspector, p.id_A), self._body_of(inspector, p.id_B)) for p in pairs)
            return all(self._filter[a, b] != 0 for a, b in bodies)
        return not len(self._near(context, 0.0).left)

    def _first_collisions(self, ways: list[np.ndarray], threads: int) -> list[int]:
        own = getattr(self._is_free, "__func__", None) is SceneGraphCollisionChecker._is_free
        checks = self._native_checks() if own else None
        if checks is None or not ways:
            return super()._first_collisions(ways, threads)
        for way in ways:
            self._check_configurations(way)
        if len(ways) == 1 or sum(map(len, ways)) <= _FEW:  # the kept call is quicker than one made for all
            return [checks.first_collision(way, self._filter, self._padding) for way in ways]
        return checks.first_collisions(ways, self._filter, self._padding, threads).tolist()

    def _native_checks(self) -> NativeChecks | None:
        """What checks configurations without Python; None where something is not of kernels."""
        context = self._contexts[0]
        query = context.GetQueryObject()
        scene, state = query._scene(), query._state
        view = parts_of(self._plant).contexts.view(context.plant_context())
        kept = self._checks
        if kept is not None and kept.scene is scene and kept.view is view:
            return kept
        if not NativeChecks.can(scene, state, self._plant, view):
            return None
        inspector = query.inspector()
        bodies = [self._body_of(inspector, geometry) for geometry in scene.ids]
        self._checks = NativeChecks(scene, self._plant, view, bodies)
        return self._checks

    def _classify(self, context: CollisionCheckerContext) -> list[RobotCollisionType]:
        out = [_Kind.kNoCollision] * len(self._robot)
        for a, b in self._near(context, 0.0).bodies.tolist():
            own = bool(self._robot[a] and self._robot[b])
            for body in (a, b):
                if self._robot[body]:
                    found = {"in_self_collision": True} if own else {"in_environment_collision": True}
                    out[body] = out[body].MakeUpdated(**found)
        return out

    def _max_num_distances(self, context: CollisionCheckerContext) -> int:
        inspector = context.GetQueryObject().inspector()
        bodies = [[self._body_of(inspector, g) for g in pair] for pair in inspector.GetCollisionCandidates()]
        return int(sum(self._filter[a, b] == 0 for a, b in bodies))

    def _clearance(self, context: CollisionCheckerContext, influence_distance: float) -> RobotClearance:
        near = self._near(context, influence_distance)
        a, b = near.bodies[:, 0], near.bodies[:, 1]
        first = self._robot[a]
        own = first & self._robot[b]
        return RobotClearance._of(np.where(first, a, b), np.where(first, b, a), own, near.left, near.slopes())

    def _slopes(self, context: CollisionCheckerContext, pairs: list[SignedDistancePair]) -> np.ndarray:
        """Derivatives of distances by the configuration, rows."""
        inspector = context.GetQueryObject().inspector()
        rows = [self._slope(context, inspector, pair) for pair in pairs]
        return np.array(rows).reshape(len(pairs), self._plant.num_positions())

    def _slope(
        self, context: CollisionCheckerContext, inspector: SceneGraphInspector, pair: SignedDistancePair
    ) -> np.ndarray:
        """Derivative of a signed distance by the configuration: its normal times the velocities of nearest points."""
        plant, plant_context = self._plant, context.plant_context()
        W, wrt = plant.world_frame(), JacobianWrtVariable.kQDot
        total = np.zeros(plant.num_positions())
        for sign, geometry, p_GC in ((1.0, pair.id_A, pair.p_ACa), (-1.0, pair.id_B, pair.p_BCb)):
            frame = plant.get_body(BodyIndex(self._body_of(inspector, geometry))).body_frame()
            p_BC = inspector.GetPoseInFrame(geometry) @ np.asarray(p_GC)
            J = plant.CalcJacobianTranslationalVelocity(plant_context, wrt, frame, p_BC.reshape(3, 1), W, W)
            total += sign * pair.nhat_BA_W @ J
        return total

    # More shapes and other filters

    def _frame_id(self, body: int) -> FrameId:
        return self._plant.GetBodyFrameIdOrThrow(BodyIndex(body))

    def _filter_pair(self, i: int, j: int, filtered: bool) -> None:
        sets = GeometrySet(self._frame_id(i)), GeometrySet(self._frame_id(j))
        declaration = CollisionFilterDeclaration()
        declaration = declaration.ExcludeBetween(*sets) if filtered else declaration.AllowBetween(*sets)
        for context in self._all_contexts():
            manager = self._model.scene_graph().collision_filter_manager(context.scene_graph_context())
            manager.Apply(declaration)

    def _add_shape(self, body: RigidBody, shape: Shape, X_BG: RigidTransform) -> GeometryId:
        scene_graph, source = self._model.scene_graph(), self._plant.get_source_id()
        index = int(body.index())
        instance = GeometryInstance(X_BG, shape, f"added to {body.name()}")
        instance.set_proximity_properties(ProximityProperties())
        instance.set_name(f"added to {body.name()} as {instance.id().get_value()}")
        for context in self._all_contexts():
            mine = context.scene_graph_context()
            scene_graph.RegisterGeometry(mine, source, self._frame_id(index), copy.copy(instance))
        self._bodies[instance.id()] = index
        for other in np.flatnonzero(self._filter[index] == 1):
            self._filter_pair(index, int(other), True)
        return instance.id()

    def _remove_shapes(self, ids: list) -> None:
        scene_graph, source = self._model.scene_graph(), self._plant.get_source_id()
        for context in self._all_contexts():
            for geometry in ids:
                scene_graph.RemoveGeometry(context.scene_graph_context(), source, geometry)


@checked
class UnimplementedCollisionChecker(CollisionChecker):
    """A checker that refuses each check; for classes that are given one and do not use it.

    Args:
        params: Model, robot, paddings and step size; or these by name.
        supports_parallel_checking: Whether it says that it supports several threads.

    Raises:
        TypeError: both or neither of `params` and names are given.
        RuntimeError: the model or the robot is missing, or the step size is not positive.
    """

    def __init__(
        self,
        params: CollisionCheckerParams | None = None,
        supports_parallel_checking: bool | None = None,
        **kwargs: Any,
    ):
        if supports_parallel_checking is None or (params is None) == ("model" not in kwargs):
            raise TypeError("UnimplementedCollisionChecker(): give supports_parallel_checking, and params or a model.")
        self._set_up(_settings(self, params, kwargs), bool(supports_parallel_checking))

    def _refuse(self, *args: object) -> NoReturn:
        raise RuntimeError(f"{type(self).__name__} does not implement this check.")

    _is_free = _clearance = _classify = _max_num_distances = _refuse  # type: ignore[assignment]
    _add_shape = _remove_shapes = _filter_pair = _refuse  # type: ignore[assignment]
