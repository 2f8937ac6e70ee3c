"""Whether configurations of a robot, and the ways between them, are free of collisions."""

from __future__ import annotations

import copy
import math
import weakref
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common import Parallelism
from sheldrake.common._checked import checked
from sheldrake.common._copies import Cloned
from sheldrake.common._kinds import anything, instance_of, text
from sheldrake.common._no_constructor import no_constructor
from sheldrake.common._options import Options
from sheldrake.common._overloads import Overload, overload, overloaded
from sheldrake.common._scalars import frozen
from sheldrake.common._thread_team import threads_of
from sheldrake.multibody.tree import BodyIndex, RigidBody
from sheldrake.planning._body_shapes import BodyShapeDescription
from sheldrake.planning._clearance import EdgeMeasure, RobotClearance, RobotCollisionType
from sheldrake.planning._configurations import (
    DistanceAndInterpolationProvider,
    FunctionProvider,
    LinearDistanceAndInterpolationProvider,
)
from sheldrake.solvers import _kinds as kinds

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.geometry import QueryObject, SceneGraphInspector, Shape
    from sheldrake.math import RigidTransform
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import Frame
    from sheldrake.planning import RobotDiagram
    from sheldrake.planning._native_distances import NativeDistances
    from sheldrake.systems.framework import Context


def _pair_and(**more: Any) -> tuple[Overload, Overload]:
    """How calls about a pair of bodies are made: with their indices, or themselves."""
    index, body = instance_of(BodyIndex, int), instance_of(RigidBody)
    return overload(bodyA_index=index, bodyB_index=index, **more), overload(bodyA=body, bodyB=body, **more)


def _finite(call: str, padding: float) -> float:
    if not np.isfinite(padding):
        raise RuntimeError(f"{call}(): the padding must be finite, got {padding}.")
    return float(padding)


class CollisionCheckerParams(Options):
    """What a collision checker is made of.

    Attributes:
        model: A RobotDiagram.
        distance_and_interpolation_provider: Distances of configurations, and what is between them.
        robot_model_instances: Which models are the robot.
        configuration_distance_function: Distances alone, instead of the provider.
        edge_step_size: Distance of the configurations that are looked at on an edge.
        env_collision_padding: Distance kept from the environment [m].
        self_collision_padding: Distance kept between bodies of the robot [m].
        implicit_context_parallelism: How many contexts there are.
    """

    model: Any = None
    distance_and_interpolation_provider: Any = None
    robot_model_instances: Any = []
    configuration_distance_function: Any = None
    edge_step_size: float = 0.0
    env_collision_padding: float = 0.0
    self_collision_padding: float = 0.0
    implicit_context_parallelism: Parallelism = Parallelism.Max()


class CollisionCheckerContext(Cloned):
    """A context of a checker's model.

    Args:
        model: The RobotDiagram.
    """

    _distances: NativeDistances | None = None
    """What finds distances in it, once they were asked for."""

    def __init__(self, model: Any):
        self._hold(model, model.CreateDefaultContext())

    def _hold(self, model: Any, context: Context) -> None:
        self._model, self._context = model, context
        self._of_plant = model.mutable_plant_context(context)
        self._of_scene_graph = model.mutable_scene_graph_context(context)

    def Clone(self) -> CollisionCheckerContext:
        """Returns a copy."""
        out = object.__new__(type(self))
        out._hold(self._model, self._context.Clone())
        return out

    def model_context(self) -> Context:
        """Returns the context of the diagram."""
        return self._context

    def plant_context(self) -> Context:
        """Returns the plant's part of it."""
        return self._of_plant

    def scene_graph_context(self) -> Context:
        """Returns the SceneGraph's part of it."""
        return self._of_scene_graph

    def GetQueryObject(self) -> QueryObject:
        """Returns what answers queries about the geometry where it is."""
        return self._model.scene_graph().get_query_output_port().Eval(self._of_scene_graph)


@no_constructor()
@checked
class CollisionChecker:
    """Checks configurations and edges for collisions; its kinds say how. Not made directly."""

    def _set_up(self, params: CollisionCheckerParams, parallel: bool) -> None:
        name = type(self).__name__
        if params.model is None:
            raise RuntimeError(f"{name}(): params.model is missing.")
        instances = sorted(params.robot_model_instances)
        if not instances or any(int(i) == 0 for i in instances):
            raise RuntimeError(f"{name}(): robot_model_instances must not be empty, nor name the world.")
        self._model, self._instances = params.model, instances
        self._plant = params.model.plant()
        self._num_positions = self._plant.num_positions()
        self._parallel = parallel
        self.set_edge_step_size(params.edge_step_size)
        self._set_provider(params)
        count = params.implicit_context_parallelism.num_threads() if parallel else 1
        self._contexts = [CollisionCheckerContext(params.model) for _ in range(count)]
        self._standalone: weakref.WeakSet[CollisionCheckerContext] = weakref.WeakSet()
        self._added: dict[str, list[tuple[Any, int, BodyShapeDescription]]] = {}
        self._set_up_pairs(self._plant, instances, params.env_collision_padding, params.self_collision_padding)

    def _set_provider(self, params: CollisionCheckerParams) -> None:
        provider, distance = params.distance_and_interpolation_provider, params.configuration_distance_function
        if provider is not None and distance is not None:
            raise RuntimeError(
                f"{type(self).__name__}(): give a distance_and_interpolation_provider or a "
                "configuration_distance_function, not both."
            )
        linear = LinearDistanceAndInterpolationProvider(self._plant)
        if distance is not None:
            provider = FunctionProvider(distance, linear.DoInterpolateBetweenConfigurations)
        self._provider: DistanceAndInterpolationProvider = provider if provider is not None else linear

    # What a kind of checker says

    def _is_free(self, context: CollisionCheckerContext) -> bool:
        raise NotImplementedError

    def _clearance(self, context: CollisionCheckerContext, influence_distance: float) -> RobotClearance:
        raise NotImplementedError

    def _classify(self, context: CollisionCheckerContext) -> list[RobotCollisionType]:
        raise NotImplementedError

    def _max_num_distances(self, context: CollisionCheckerContext) -> int:
        raise NotImplementedError

    def _add_shape(self, body: RigidBody, shape: Shape, X_BG: RigidTransform) -> Any:
        """Adds a shape to a body in all contexts; returns its id, or None where shapes cannot be added."""
        raise NotImplementedError

    def _remove_shapes(self, ids: list) -> None:
        raise NotImplementedError

    # The model and its contexts

    def model(self) -> RobotDiagram:
        """Returns the RobotDiagram."""
        return self._model

    def plant(self) -> MultibodyPlant:
        """Returns the plant."""
        return self._plant

    def get_body(self, body_index: BodyIndex) -> RigidBody:
        """Returns a body of the plant."""
        return self._plant.get_body(body_index)

    def robot_model_instances(self) -> list:
        """Returns which models are the robot."""
        return list(self._instances)

    def num_allocated_contexts(self) -> int:
        """Returns how many contexts it has of its own."""
        return len(self._contexts)

    def SupportsParallelChecking(self) -> bool:
        """Tells whether several threads could check at once."""
        return self._parallel

    def model_context(self, context_number: int | None = None) -> CollisionCheckerContext:
        """Returns one of its contexts."""
        return self._contexts[context_number or 0]

    def plant_context(self, context_number: int | None = None) -> Context:
        """Returns the plant's part of one of its contexts."""
        return self.model_context(context_number).plant_context()

    def MakeStandaloneModelContext(self) -> CollisionCheckerContext:
        """Returns a new context, which follows what is added to and filtered in the checker."""
        context = self._contexts[0].Clone()
        self._standalone.add(context)
        return context

    def _all_contexts(self) -> list[CollisionCheckerContext]:
        return [*self._contexts, *self._standalone]

    def PerformOperationAgainstAllModelContexts(
        self, operation: Callable[[Any, CollisionCheckerContext], None]
    ) -> None:
        """Calls a function with the model and each context."""
        for context in self._all_contexts():
            operation(self._model, context)

    def _inspector(self) -> SceneGraphInspector:
        return self._contexts[0].GetQueryObject().inspector()

    def Clone(self) -> CollisionChecker:
        """Returns a copy with contexts of its own."""
        out = copy.copy(self)
        out._contexts = [c.Clone() for c in self._contexts]
        out._standalone = weakref.WeakSet()
        out._padding = self._padding.copy()
        out._added = {name: list(shapes) for name, shapes in self._added.items()}
        return out

    def __deepcopy__(self, memo: dict) -> CollisionChecker:
        return self.Clone()

    def GetZeroConfiguration(self) -> np.ndarray:
        """Returns the configuration of zeros, shape (nq,)."""
        return np.zeros(self._plant.num_positions())

    def UpdatePositions(self, q: ArrayLike, context_number: int | None = None) -> Context:
        """Puts a configuration into one of its contexts, and returns the plant's part of it."""
        return self.UpdateContextPositions(self.model_context(context_number), q)

    def UpdateContextPositions(self, model_context: CollisionCheckerContext, q: ArrayLike) -> Context:
        """Puts a configuration into a context, and returns the plant's part of it.

        Raises:
            RuntimeError: it has another size, or is not finite.
        """
        q = np.array(q, dtype=float).ravel()
        if q.size != self._num_positions or not all(map(math.isfinite, q.tolist())):
            self._check_configurations(q[None])
        context = model_context.plant_context()
        self._plant.SetPositions(context, q)
        return context

    def _check_configurations(self, qs: np.ndarray) -> None:
        """Refuses rows that are no configurations."""
        if qs.shape[1] != self._plant.num_positions() or not np.isfinite(qs).all():
            bad = qs[int(np.argmin(np.isfinite(qs).all(axis=1)))]
            raise RuntimeError(
                f"CollisionChecker: a configuration has {self._plant.num_positions()} finite values, got {bad}."
            )

    # More shapes

    def AddCollisionShape(self, group_name: str, description: BodyShapeDescription) -> bool:
        """Adds a shape to the body that a description names, as part of a group; tells whether it could.

        Raises:
            RuntimeError: there is no such body.
        """
        plant = self._plant
        instance = plant.GetModelInstanceByName(description.model_instance_name())
        body = plant.GetBodyByName(description.body_name(), instance)
        return self.AddCollisionShapeToBody(group_name, body, description.shape(), description.pose_in_body())

    @overloaded(overload(group_name=text, descriptions=anything), overload(geometry_groups=instance_of(Mapping)))
    def AddCollisionShapes(self, group: Any, descriptions: Any = None) -> Any:
        """Adds shapes, returns how many: `(group_name, descriptions)`, or `(geometry_groups)`, a dict by group."""
        if descriptions is None:
            return {name: self.AddCollisionShapes(name, shapes) for name, shapes in group.items()}
        return sum(self.AddCollisionShape(group, description) for description in descriptions)

    def AddCollisionShapeToFrame(self, group_name: str, frameA: Frame, shape: Any, X_AG: Any) -> bool:
        """Adds a shape at a pose in a frame to the frame's body; tells whether it could."""
        X_BA = frameA.GetFixedPoseInBodyFrame()
        return self.AddCollisionShapeToBody(group_name, frameA.body(), shape, X_BA @ X_AG)

    def AddCollisionShapeToBody(self, group_name: str, bodyA: Any, shape: Any, X_AG: Any) -> bool:
        """Adds a shape at a pose in a body; tells whether it could."""
        added = self._add_shape(bodyA, shape, X_AG)
        if added is None:
            return False
        names = self._plant.GetModelInstanceName(bodyA.model_instance()), bodyA.name()
        description = BodyShapeDescription(shape, X_AG, *names)
        self._added.setdefault(group_name, []).append((added, int(bodyA.index()), description))
        return True

    def GetAllAddedCollisionShapes(self) -> dict[str, list[BodyShapeDescription]]:
        """Returns the shapes that were added, by group."""
        return {name: [s[2] for s in shapes] for name, shapes in self._added.items()}

    def RemoveAllAddedCollisionShapes(self, group_name: str | None = None) -> None:
        """Removes the shapes of a group, or of all groups."""
        for name in [*self._added] if group_name is None else [group_name]:
            self._remove_shapes([s[0] for s in self._added.pop(name, [])])

    # Configurations

    def CheckConfigCollisionFree(self, q: ArrayLike, context_number: int | None = None) -> bool:
        """Tells whether a configuration is free of collisions."""
        return self.CheckContextConfigCollisionFree(self.model_context(context_number), q)

    def CheckContextConfigCollisionFree(self, model_context: CollisionCheckerContext, q: ArrayLike) -> bool:
        """Tells whether a configuration is free of collisions, with a context of one's own."""
        self.UpdateContextPositions(model_context, q)
        return self._is_free(model_context)

    def CheckConfigsCollisionFree(self, configs: list, parallelize: Any = None) -> list[int]:
        """Returns for each configuration whether (1) or not (0) it is free of collisions.

        Args:
            configs: Configurations, shape (nq,) each.
            parallelize: How many threads, of as many as there are contexts: a number, a Parallelism, or True for as
                many as this process may use; these if not given. Answers do not depend on it.

        Raises:
            RuntimeError: one has another size, or is not finite.
        """
        ways = [np.array(q, dtype=float).reshape(1, -1) for q in configs]
        return self._first_collisions(ways, self._threads(parallelize))

    def _threads(self, parallelize: Parallelism | int | bool) -> int:
        return min(threads_of(parallelize, True), len(self._contexts))

    def _first_collisions(self, ways: list[np.ndarray], threads: int) -> list[int]:
        """Of each way of configurations, rows, the number of the first that collides; how many it has, if none does."""
        found = []
        for way in ways:
            free = (self.CheckConfigCollisionFree(q) for q in way)
            found.append(next((k for k, is_free in enumerate(free) if not is_free), len(way)))
        return found

    def CalcRobotClearance(
        self, q: ArrayLike, influence_distance: float, context_number: int | None = None
    ) -> RobotClearance:
        """Returns distances of the robot to its environment and itself, and their derivatives.

        Args:
            q: The configuration, shape (nq,).
            influence_distance: Up to this distance, less padding [m].
            context_number: Which context to use.

        Raises:
            RuntimeError: the distance is negative or not finite.
        """
        return self.CalcContextRobotClearance(self.model_context(context_number), q, influence_distance)

    def CalcRobotClearances(
        self, configs: Sequence[Any], influence_distance: float, parallelize: Parallelism | int | bool | None = None
    ) -> list[RobotClearance]:
        """Returns what `CalcRobotClearance` says of each of some configurations, shape (nq,) each.

        Args:
            configs: The configurations.
            influence_distance: Up to this distance, less padding [m].
            parallelize: Accepted for Drake's sake; they are computed one after the other.

        Raises:
            RuntimeError: the distance is negative or not finite, or a configuration has a number that is not.
        """
        rows = [np.asarray(q, dtype=float) for q in configs]
        for i, q in enumerate(rows):
            if not np.isfinite(q).all():
                raise RuntimeError(f"CalcRobotClearances(): configuration {i} has numbers that are not finite: {q}.")
        if not 0.0 <= influence_distance < math.inf:
            raise RuntimeError(
                f"CalcRobotClearances(): influence_distance must be finite, >= 0; got {influence_distance}."
            )
        return [self.CalcRobotClearance(q, influence_distance) for q in rows]

    def CalcContextRobotClearance(
        self, model_context: CollisionCheckerContext, q: ArrayLike, influence_distance: float
    ) -> RobotClearance:
        """Returns distances of the robot, with a context of one's own; see `CalcRobotClearance`."""
        if not 0.0 <= influence_distance < math.inf:
            raise RuntimeError(
                f"CalcRobotClearance(): influence_distance must be finite, >= 0; got {influence_distance}."
            )
        self.UpdateContextPositions(model_context, q)
        return self._clearance(model_context, influence_distance)

    def MaxNumDistances(self, context_number: int | None = None) -> int:
        """Returns the most rows that `CalcRobotClearance` can have."""
        return self.MaxContextNumDistances(self.model_context(context_number))

    def MaxContextNumDistances(self, model_context: CollisionCheckerContext) -> int:
        """Returns the most rows that `CalcContextRobotClearance` can have."""
        return self._max_num_distances(model_context)

    def ClassifyBodyCollisions(self, q: ArrayLike, context_number: int | None = None) -> list[RobotCollisionType]:
        """Returns for each body of the plant how it collides; those of the environment never do."""
        return self.ClassifyContextBodyCollisions(self.model_context(context_number), q)

    def ClassifyContextBodyCollisions(
        self, model_context: CollisionCheckerContext, q: ArrayLike
    ) -> list[RobotCollisionType]:
        """Returns for each body of the plant how it collides, with a context of one's own."""
        self.UpdateContextPositions(model_context, q)
        return self._classify(model_context)

    # ---- which pairs of bodies it looks at, and how far it keeps them apart

    def _set_up_pairs(self, plant: MultibodyPlant, robot_instances: list, environment: float, own: float) -> None:
        instances = {int(i) for i in robot_instances}
        bodies = [plant.get_body(BodyIndex(i)) for i in range(plant.num_bodies())]
        self._robot = np.array([int(b.model_instance()) in instances for b in bodies])
        count = len(bodies)
        self._padding = np.zeros((count, count))
        self._pairs_with_robot = self._robot_pairs(True) | self._robot_pairs(False)
        self.SetPaddingAllRobotEnvironmentPairs(environment)
        self.SetPaddingAllRobotRobotPairs(own)
        self._nominal = self._filter = self._filters_of_the_model(plant, bodies)

    def _filters_of_the_model(self, plant: MultibodyPlant, bodies: list) -> np.ndarray:
        count = len(bodies)
        out = np.zeros((count, count), dtype=np.int32)
        inspector = self._inspector()  # type: ignore[attr-defined]
        welded = {i: {int(b.index()) for b in plant.GetBodiesWeldedTo(bodies[i])} for i in range(count)}
        geometries = [plant.GetCollisionGeometriesForBody(b) for b in bodies]
        for i in range(count):
            for j in range(i, count):
                if i == j or not (self._robot[i] or self._robot[j]):
                    out[i, j] = out[j, i] = -1
                    continue
                states = {inspector.CollisionFiltered(a, b) for a in geometries[i] for b in geometries[j]}
                if len(states) > 1:
                    raise RuntimeError(
                        f"CollisionChecker: some pairs of geometries of bodies {bodies[i].scoped_name()} and "
                        f"{bodies[j].scoped_name()} are filtered, others are not."
                    )
                out[i, j] = out[j, i] = int(j in welded[i] or states == {True})
        return out

    def _index(self, call: str, body: Any) -> int:
        index = int(body.index()) if hasattr(body, "body_frame") else int(body)
        if not 0 <= index < len(self._robot):
            raise RuntimeError(f"CollisionChecker.{call}(): body index {index} is out of range.")
        return index

    def IsPartOfRobot(self, body: Any = None, *, body_index: Any = None) -> bool:
        """Tells whether a body, given itself or by index, is part of the robot."""
        return bool(self._robot[self._index("IsPartOfRobot", body if body_index is None else body_index)])

    def _pair(self, call: str, bodies: tuple) -> tuple[int, int]:
        i, j = (self._index(call, b) for b in bodies)
        if i == j:
            raise RuntimeError(f"CollisionChecker::{call}(): both bodies are {i}.")
        if not (self._robot[i] or self._robot[j]):
            where = f"({i}, {j})"
            raise RuntimeError(f"CollisionChecker::{call}(): cannot be used on pairs of environment bodies: {where}")
        return i, j

    # Padding

    @overloaded(*_pair_and())
    def GetPaddingBetween(self, bodyA: Any, bodyB: Any) -> float:
        """Returns the padding of a pair of bodies, given themselves or by indices [m]."""
        i, j = (self._index("GetPaddingBetween", b) for b in (bodyA, bodyB))
        return float(self._padding[i, j])

    @overloaded(*_pair_and(padding=kinds.number))
    def SetPaddingBetween(self, a: ArrayLike, b: ArrayLike, padding: float) -> None:
        """Sets the padding of a pair [m]: `(bodyA, bodyB, padding)` with bodies or their indices.

        Raises:
            RuntimeError: they are one body, both of the environment, or the padding is not finite.
        """
        i, j = self._pair("SetPaddingBetween", (a, b))
        self._padding[i, j] = self._padding[j, i] = _finite("SetPaddingBetween", padding)

    def GetPaddingMatrix(self) -> np.ndarray:
        """Returns the paddings of all pairs [m], read-only."""
        return frozen(self._padding.copy())

    def SetPaddingMatrix(self, collision_padding: ArrayLike) -> None:
        """Sets the paddings of all pairs [m].

        Raises:
            RuntimeError: the matrix has another size, is not symmetric or finite, or says something of one body, or of
                two of the environment.
        """
        M, n = np.array(collision_padding, dtype=float), len(self._robot)
        call = "CollisionChecker::SetPaddingMatrix()"
        if M.shape != (n, n):
            found = "x".join(map(str, M.shape))
            raise RuntimeError(
                f"{call}: The padding matrix must be {n}x{n}. The given padding matrix is the wrong size: {found}."
            )
        for i in range(n):
            if M[i, i] != 0.0:
                raise RuntimeError(
                    f"{call}: The collision padding matrix has invalid values on the diagonal ({i}, {i}) = {M[i, i]:g};"
                    " the values on the diagonal must always be 0."
                )
            for j in range(i + 1, n):
                where = f"({i}, {j}) = {M[i, j]:g}"
                if not np.isfinite(M[i, j]) or M[i, j] != M[j, i]:
                    raise RuntimeError(f"{call}: The collision padding matrix must be finite and symmetric: {where}.")
                if M[i, j] != 0.0 and not (self._robot[i] or self._robot[j]):
                    raise RuntimeError(f"{call}: Padding of two environment bodies must be zero: {where}.")
        self._padding = M

    def _robot_pairs(self, own: bool) -> np.ndarray:
        """Where pairs of robot bodies are, or pairs of a robot body and one of the environment."""
        robot = self._robot
        if own:
            return np.logical_and.outer(robot, robot) & ~np.eye(len(robot), dtype=bool)
        return np.logical_xor.outer(robot, robot)

    def SetPaddingAllRobotEnvironmentPairs(self, padding: float) -> None:
        """Sets the padding between the robot and its environment [m]."""
        self._padding[self._robot_pairs(False)] = _finite("SetPaddingAllRobotEnvironmentPairs", padding)

    def SetPaddingAllRobotRobotPairs(self, padding: float) -> None:
        """Sets the padding between bodies of the robot [m]."""
        self._padding[self._robot_pairs(True)] = _finite("SetPaddingAllRobotRobotPairs", padding)

    def SetPaddingOneRobotBodyAllEnvironmentPairs(self, body_index: BodyIndex, padding: float) -> None:
        """Sets the padding between one body of the robot and the environment [m].

        Raises:
            RuntimeError: the body is of the environment.
        """
        i = self._index("SetPaddingOneRobotBodyAllEnvironmentPairs", body_index)
        if not self._robot[i]:
            raise RuntimeError(f"SetPaddingOneRobotBodyAllEnvironmentPairs(): body {i} is no part of the robot.")
        self._padding[i, ~self._robot] = self._padding[~self._robot, i] = _finite("SetPaddingOneRobotBody...", padding)

    def GetLargestPadding(self) -> float:
        """Returns the largest padding of pairs with the robot [m]."""
        paddings = self._padding[self._pairs_with_robot]
        return float(paddings.max()) if paddings.size else 0.0

    def _uniform(self, own: bool) -> float | None:
        values = np.unique(self._padding[self._robot_pairs(own)])
        return float(values[0]) if values.size == 1 else (None if values.size else 0.0)

    def MaybeGetUniformRobotEnvironmentPadding(self) -> float | None:
        """Returns the padding between robot and environment if it is the same everywhere, else None."""
        return self._uniform(False)

    def MaybeGetUniformRobotRobotPadding(self) -> float | None:
        """Returns the padding between bodies of the robot if it is the same everywhere, else None."""
        return self._uniform(True)

    # Filters

    def GetFilteredCollisionMatrix(self) -> np.ndarray:
        """Returns which pairs are not looked at: 1; 0 for those that are, -1 for those that never are."""
        return frozen(self._filter.copy())

    def GetNominalFilteredCollisionMatrix(self) -> np.ndarray:
        """Returns the filters of the model itself, read-only."""
        return frozen(self._nominal.copy())

    @overloaded(*_pair_and())
    def IsCollisionFilteredBetween(self, bodyA: Any, bodyB: Any) -> bool:
        """Tells whether a pair, given as bodies or by indices, is not looked at."""
        i, j = (self._index("IsCollisionFilteredBetween", b) for b in (bodyA, bodyB))
        return bool(self._filter[i, j] != 0)

    @overloaded(*_pair_and(filter_collision=anything))
    def SetCollisionFilteredBetween(self, a: ArrayLike, b: ArrayLike, filtered: bool) -> None:
        """Sets whether a pair is left out: `(bodyA, bodyB, filter_collision)` with bodies or their indices.

        Raises:
            RuntimeError: they are one body, or both of the environment.
        """
        i, j = self._pair("SetCollisionFilteredBetween", (a, b))
        matrix = self._filter.copy()
        matrix[i, j] = matrix[j, i] = int(bool(filtered))
        self._set_filter(matrix)

    def SetCollisionFilteredWithAllBodies(self, body: Any = None, *, body_index: Any = None) -> None:
        """Leaves out all pairs with a body of the robot.

        Raises:
            RuntimeError: it is of the environment.
        """
        i = self._index("SetCollisionFilteredWithAllBodies", body if body_index is None else body_index)
        if not self._robot[i]:
            raise RuntimeError(f"SetCollisionFilteredWithAllBodies(): body {i} is no part of the robot.")
        matrix = self._filter.copy()
        matrix[i, :] = matrix[:, i] = 1
        matrix[i, i] = -1
        self._set_filter(matrix)

    def SetCollisionFilterMatrix(self, filter_matrix: ArrayLike) -> None:
        """Sets which pairs are not looked at.

        Raises:
            RuntimeError: the matrix has another size, is not symmetric, or has other values than 0 and 1 where these
                belong, and -1 on the diagonal and for pairs of the environment.
        """
        M, n = np.array(filter_matrix, dtype=np.int32), len(self._robot)
        call = "CollisionChecker::SetCollisionFilterMatrix()"
        if M.shape != (n, n):
            found = "x".join(map(str, M.shape))
            raise RuntimeError(f"{call}: The filter matrix must be {n}x{n}; the given one is {found}.")
        for i in range(n):
            if M[i, i] != -1:
                raise RuntimeError(
                    f"{call}: The filtered collision matrix has invalid values on the diagonal ({i}, {i}) = {M[i, i]}; "
                    "the values on the diagonal must always be -1."
                )
            for j in range(i + 1, n):
                allowed = (0, 1) if self._robot[i] or self._robot[j] else (-1,)
                if M[i, j] != M[j, i] or M[i, j] not in allowed:
                    raise RuntimeError(
                        f"{call}: ({i}, {j}) = {M[i, j]} and ({j}, {i}) = {M[j, i]}; allowed: {allowed}."
                    )
        self._set_filter(M)

    def _set_filter(self, matrix: np.ndarray) -> None:
        before, self._filter = self._filter, matrix
        for i, j in np.argwhere(np.triu(before != matrix)):
            self._filter_pair(int(i), int(j), bool(matrix[i, j]))

    def _filter_pair(self, i: int, j: int, filtered: bool) -> None:
        """Tells whatever computes collisions."""

    # ---- ways between configurations

    def distance_and_interpolation_provider(self) -> DistanceAndInterpolationProvider:
        """Returns what tells distances of configurations, and what is between them."""
        return self._provider

    def SetDistanceAndInterpolationProvider(self, provider: DistanceAndInterpolationProvider) -> None:
        """Sets what tells distances of configurations, and what is between them."""
        self._provider = provider

    def _functions(self, call: str) -> FunctionProvider:
        if not isinstance(self._provider, FunctionProvider):
            raise RuntimeError(
                f"CollisionChecker::{call}() is not supported after a DistanceAndInterpolationProvider has already "
                "been set."
            )
        return FunctionProvider(self._provider.distance, self._provider.interpolation)

    def SetConfigurationDistanceFunction(self, distance_function: Callable) -> None:
        """Sets what tells distances, if the checker was made with such a function.

        Raises:
            RuntimeError: it has a provider.
        """
        provider = self._functions("SetConfigurationDistanceFunction")
        provider.distance = distance_function
        self._provider = provider

    def SetConfigurationInterpolationFunction(self, interpolation_function: Callable | None) -> None:
        """Sets what is between configurations, None for straight lines; if the checker was made with functions.

        Raises:
            RuntimeError: it has a provider.
        """
        provider = self._functions("SetConfigurationInterpolationFunction")
        straight = LinearDistanceAndInterpolationProvider(self._plant).DoInterpolateBetweenConfigurations
        provider.interpolation = straight if interpolation_function is None else interpolation_function
        self._provider = provider

    def ComputeConfigurationDistance(self, q1: ArrayLike, q2: ArrayLike) -> float:
        """Returns how far two configurations are apart."""
        return self._provider.ComputeConfigurationDistance(q1, q2)

    def InterpolateBetweenConfigurations(self, q1: ArrayLike, q2: ArrayLike, ratio: float) -> np.ndarray:
        """Returns the configuration at a ratio from 0 to 1 between two."""
        return self._provider.InterpolateBetweenConfigurations(q1, q2, ratio)

    def MakeStandaloneConfigurationDistanceFunction(self) -> Callable:
        """Returns a function of two configurations that tells their distance."""
        return self._provider.ComputeConfigurationDistance

    def MakeStandaloneConfigurationInterpolationFunction(self) -> Callable:
        """Returns a function of two configurations and a ratio that gives one between them."""
        return self._provider.InterpolateBetweenConfigurations

    def edge_step_size(self) -> float:
        """Returns the distance of the configurations that are looked at on an edge."""
        return self._step

    def set_edge_step_size(self, edge_step_size: float) -> None:
        """Sets the distance of the configurations that are looked at on an edge.

        Raises:
            RuntimeError: it is not positive.
        """
        if not edge_step_size > 0.0:
            raise RuntimeError(f"set_edge_step_size(): the step must be positive, got {edge_step_size}.")
        self._step = float(edge_step_size)

    def CheckEdgeCollisionFree(self, q1: ArrayLike, q2: ArrayLike, context_number: int | None = None) -> bool:
        """Tells whether the way from one configuration to another is free of collisions."""
        if context_number is None:
            return bool(self.CheckEdgesCollisionFree([(q1, q2)], False)[0])
        return self.CheckContextEdgeCollisionFree(self.model_context(context_number), q1, q2)

    def CheckContextEdgeCollisionFree(
        self, model_context: CollisionCheckerContext, q1: ArrayLike, q2: ArrayLike
    ) -> bool:
        """Tells whether the way from one configuration to another is free, with a context of one's own."""
        if not self.CheckContextConfigCollisionFree(model_context, q2):
            return False
        return self.MeasureContextEdgeCollisionFree(model_context, q1, q2).completely_free()

    def CheckEdgeCollisionFreeParallel(self, q1: Any, q2: Any, parallelize: Any = None) -> bool:
        """Tells whether the way from one configuration to another is free; threads share its configurations."""
        way = self._path(q1, q2)[1][:, None]
        return all(self._first_collisions([*way[-1:], *way[:-1]], self._threads(parallelize)))

    def CheckEdgesCollisionFree(self, edges: list, parallelize: Any = None) -> list[int]:
        """Returns for each pair of configurations whether (1) or not (0) the way is free.

        Args:
            edges: Pairs of configurations.
            parallelize: See `CheckConfigsCollisionFree`.
        """
        ways = [np.concatenate([way[-1:], way[:-1]]) for _, way in (self._path(*edge) for edge in edges)]
        found = self._first_collisions(ways, self._threads(parallelize))
        return [int(first == len(way)) for first, way in zip(found, ways)]

    def _path(self, q1: ArrayLike, q2: ArrayLike) -> tuple[float, np.ndarray]:
        """The distance of two configurations, and those that are looked at between them, rows."""
        distance = self.ComputeConfigurationDistance(q1, q2)
        steps = max(1, math.ceil(distance / self._step))
        return distance, self._provider._path(q1, q2, steps)

    def MeasureEdgeCollisionFree(self, q1: ArrayLike, q2: ArrayLike, context_number: int | None = None) -> EdgeMeasure:
        """Returns how much of the way from one configuration to another is free."""
        if context_number is None:
            return self.MeasureEdgesCollisionFree([(q1, q2)], False)[0]
        return self.MeasureContextEdgeCollisionFree(self.model_context(context_number), q1, q2)

    def MeasureContextEdgeCollisionFree(
        self, model_context: CollisionCheckerContext, q1: ArrayLike, q2: ArrayLike
    ) -> EdgeMeasure:
        """Returns how much of the way is free, with a context of one's own."""
        distance = self.ComputeConfigurationDistance(q1, q2)
        steps = max(1, math.ceil(distance / self._step))
        for k in range(steps + 1):
            q = self.InterpolateBetweenConfigurations(q1, q2, k / steps)
            if not self.CheckContextConfigCollisionFree(model_context, q):
                return _measure(distance, k, steps)
        return _measure(distance, steps + 1, steps)

    def MeasureEdgeCollisionFreeParallel(self, q1: Any, q2: Any, parallelize: Any = None) -> EdgeMeasure:
        """Returns how much of the way from one configuration to another is free; threads share its configurations."""
        distance, way = self._path(q1, q2)
        free = self._first_collisions(list(way[:, None]), self._threads(parallelize))
        return _measure(distance, free.index(0) if 0 in free else len(way), len(way) - 1)

    def MeasureEdgesCollisionFree(self, edges: list, parallelize: Any = None) -> list[EdgeMeasure]:
        """Returns for each pair of configurations how much of the way is free.

        Args:
            edges: Pairs of configurations.
            parallelize: See `CheckConfigsCollisionFree`.
        """
        ways = [self._path(*edge) for edge in edges]
        found = self._first_collisions([way for _, way in ways], self._threads(parallelize))
        return [_measure(distance, first, len(way) - 1) for (distance, way), first in zip(ways, found)]


def _measure(distance: float, first: int, steps: int) -> EdgeMeasure:
    """The measure of an edge whose first collision is so many steps from its beginning; behind its end if none."""
    if first > steps:
        return EdgeMeasure(distance, 1.0)
    return EdgeMeasure(distance, (first - 1) / steps if first else -1.0)
