"""Whether configurations of a robot, and the ways between them, are free of collisions."""

from __future__ import annotations

import copy
import math
import weakref
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from sheldrake.common import Parallelism
from sheldrake.common._kinds import anything, instance_of, text
from sheldrake.common._options import Options
from sheldrake.common._overloads import overload, overloaded
from sheldrake.planning._body_shapes import BodyShapeDescription
from sheldrake.planning._checker_edges import CheckedEdges
from sheldrake.planning._checker_pairs import CheckedPairs
from sheldrake.planning._clearance import RobotClearance, RobotCollisionType
from sheldrake.planning._configurations import (
    DistanceAndInterpolationProvider,
    FunctionProvider,
    LinearDistanceAndInterpolationProvider,
)


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

    _fields = (
        ("model", Any, None),
        ("distance_and_interpolation_provider", Any, None),
        ("robot_model_instances", Any, []),
        ("configuration_distance_function", Any, None),
        ("edge_step_size", float, 0.0),
        ("env_collision_padding", float, 0.0),
        ("self_collision_padding", float, 0.0),
        ("implicit_context_parallelism", Any, None),
    )

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        if self.implicit_context_parallelism is None:
            self.implicit_context_parallelism = Parallelism.Max()


class CollisionCheckerContext:
    """A context of a checker's model.

    Args:
        model: The RobotDiagram.
    """

    def __init__(self, model: Any):
        self._model, self._context = model, model.CreateDefaultContext()

    def Clone(self) -> CollisionCheckerContext:
        """Returns a copy."""
        out = copy.copy(self)
        out._context = self._context.Clone()
        return out

    def model_context(self) -> Any:
        """Returns the context of the diagram."""
        return self._context

    def plant_context(self) -> Any:
        """Returns the plant's part of it."""
        return self._model.mutable_plant_context(self._context)

    def scene_graph_context(self) -> Any:
        """Returns the SceneGraph's part of it."""
        return self._model.mutable_scene_graph_context(self._context)

    def GetQueryObject(self) -> Any:
        """Returns what answers queries about the geometry where it is."""
        return self._model.scene_graph().get_query_output_port().Eval(self.scene_graph_context())


class CollisionChecker(CheckedPairs, CheckedEdges):
    """Checks configurations and edges for collisions; its kinds say how. Not made directly."""

    def __init__(self, *args: Any, **kwargs: Any):
        raise TypeError("pydrake.planning.CollisionChecker: No constructor defined!")

    def _set_up(self, params: CollisionCheckerParams, parallel: bool) -> None:
        name = type(self).__name__
        if params.model is None:
            raise RuntimeError(f"{name}(): params.model is missing.")
        instances = sorted(params.robot_model_instances)
        if not instances or any(int(i) == 0 for i in instances):
            raise RuntimeError(f"{name}(): robot_model_instances must not be empty, nor name the world.")
        self._model, self._instances = params.model, instances
        self._plant = params.model.plant()
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

    def _add_shape(self, body: Any, shape: Any, X_BG: Any) -> Any:
        """Adds a shape to a body in all contexts; returns its id, or None where shapes cannot be added."""
        raise NotImplementedError

    def _remove_shapes(self, ids: list) -> None:
        raise NotImplementedError

    # The model and its contexts

    def model(self) -> Any:
        """Returns the RobotDiagram."""
        return self._model

    def plant(self) -> Any:
        """Returns the plant."""
        return self._plant

    def get_body(self, body_index: Any) -> Any:
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

    def plant_context(self, context_number: int | None = None) -> Any:
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

    def _inspector(self) -> Any:
        return self._contexts[0].GetQueryObject().inspector()

    def Clone(self) -> CollisionChecker:
        """Returns a copy with contexts of its own."""
        out = copy.copy(self)
        out._contexts = [c.Clone() for c in self._contexts]
        out._standalone = weakref.WeakSet()
        out._padding = self._padding.copy()
        out._added = {name: list(shapes) for name, shapes in self._added.items()}
        return out

    def GetZeroConfiguration(self) -> np.ndarray:
        """Returns the configuration of zeros, shape (nq,)."""
        return np.zeros(self._plant.num_positions())

    def UpdatePositions(self, q: Any, context_number: int | None = None) -> Any:
        """Puts a configuration into one of its contexts, and returns the plant's part of it."""
        return self.UpdateContextPositions(self.model_context(context_number), q)

    def UpdateContextPositions(self, model_context: CollisionCheckerContext, q: Any) -> Any:
        """Puts a configuration into a context, and returns the plant's part of it.

        Raises:
            RuntimeError: it has another size, or is not finite.
        """
        q = np.array(q, dtype=float).ravel()
        if q.size != self._plant.num_positions() or not np.isfinite(q).all():
            raise RuntimeError(
                f"CollisionChecker: a configuration has {self._plant.num_positions()} finite values, got {q}."
            )
        context = model_context.plant_context()
        self._plant.SetPositions(context, q)
        return context

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

    def AddCollisionShapeToFrame(self, group_name: str, frameA: Any, shape: Any, X_AG: Any) -> bool:
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

    def CheckConfigCollisionFree(self, q: Any, context_number: int | None = None) -> bool:
        """Tells whether a configuration is free of collisions."""
        return self.CheckContextConfigCollisionFree(self.model_context(context_number), q)

    def CheckContextConfigCollisionFree(self, model_context: CollisionCheckerContext, q: Any) -> bool:
        """Tells whether a configuration is free of collisions, with a context of one's own."""
        self.UpdateContextPositions(model_context, q)
        return self._is_free(model_context)

    def CheckConfigsCollisionFree(self, configs: list, parallelize: Any = None) -> list[int]:
        """Returns for each configuration whether (1) or not (0) it is free of collisions."""
        return [int(self.CheckConfigCollisionFree(q)) for q in configs]

    def CalcRobotClearance(
        self, q: Any, influence_distance: float, context_number: int | None = None
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

    def CalcContextRobotClearance(
        self, model_context: CollisionCheckerContext, q: Any, influence_distance: float
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

    def ClassifyBodyCollisions(self, q: Any, context_number: int | None = None) -> list[RobotCollisionType]:
        """Returns for each body of the plant how it collides; those of the environment never do."""
        return self.ClassifyContextBodyCollisions(self.model_context(context_number), q)

    def ClassifyContextBodyCollisions(self, model_context: CollisionCheckerContext, q: Any) -> list[RobotCollisionType]:
        """Returns for each body of the plant how it collides, with a context of one's own."""
        self.UpdateContextPositions(model_context, q)
        return self._classify(model_context)
