"""Ways between configurations: how long they are, and whether they are free of collisions."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from sheldrake.planning._clearance import EdgeMeasure
from sheldrake.planning._configurations import (
    DistanceAndInterpolationProvider,
    FunctionProvider,
    LinearDistanceAndInterpolationProvider,
)


class CheckedEdges:
    """The part of a collision checker about ways between configurations."""

    _provider: Any
    _step: float
    _plant: Any

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

    def ComputeConfigurationDistance(self, q1: Any, q2: Any) -> float:
        """Returns how far two configurations are apart."""
        return self._provider.ComputeConfigurationDistance(q1, q2)

    def InterpolateBetweenConfigurations(self, q1: Any, q2: Any, ratio: float) -> np.ndarray:
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

    def CheckEdgeCollisionFree(self, q1: Any, q2: Any, context_number: int | None = None) -> bool:
        """Tells whether the way from one configuration to another is free of collisions."""
        return self.CheckContextEdgeCollisionFree(self.model_context(context_number), q1, q2)

    def CheckContextEdgeCollisionFree(self, model_context: Any, q1: Any, q2: Any) -> bool:
        """Tells whether the way from one configuration to another is free, with a context of one's own."""
        if not self.CheckContextConfigCollisionFree(model_context, q2):
            return False
        return self.MeasureContextEdgeCollisionFree(model_context, q1, q2).completely_free()

    def CheckEdgeCollisionFreeParallel(self, q1: Any, q2: Any, parallelize: Any = None) -> bool:
        """Tells whether the way from one configuration to another is free of collisions."""
        return self.CheckEdgeCollisionFree(q1, q2)

    def CheckEdgesCollisionFree(self, edges: list, parallelize: Any = None) -> list[int]:
        """Returns for each pair of configurations whether (1) or not (0) the way is free."""
        return [int(self.CheckEdgeCollisionFree(*edge)) for edge in edges]

    def MeasureEdgeCollisionFree(self, q1: Any, q2: Any, context_number: int | None = None) -> EdgeMeasure:
        """Returns how much of the way from one configuration to another is free."""
        return self.MeasureContextEdgeCollisionFree(self.model_context(context_number), q1, q2)

    def MeasureContextEdgeCollisionFree(self, model_context: Any, q1: Any, q2: Any) -> EdgeMeasure:
        """Returns how much of the way is free, with a context of one's own."""
        distance = self.ComputeConfigurationDistance(q1, q2)
        steps = max(1, math.ceil(distance / self._step))
        for k in range(steps + 1):
            q = self.InterpolateBetweenConfigurations(q1, q2, k / steps)
            if not self.CheckContextConfigCollisionFree(model_context, q):
                return EdgeMeasure(distance, (k - 1) / steps if k else -1.0)
        return EdgeMeasure(distance, 1.0)

    def MeasureEdgeCollisionFreeParallel(self, q1: Any, q2: Any, parallelize: Any = None) -> EdgeMeasure:
        """Returns how much of the way from one configuration to another is free."""
        return self.MeasureEdgeCollisionFree(q1, q2)

    def MeasureEdgesCollisionFree(self, edges: list, parallelize: Any = None) -> list[EdgeMeasure]:
        """Returns for each pair of configurations how much of the way is free."""
        return [self.MeasureEdgeCollisionFree(*edge) for edge in edges]
