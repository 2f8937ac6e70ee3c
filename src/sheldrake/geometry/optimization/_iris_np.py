"""Regions of configurations without collisions, by nonlinear programs that look for collisions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common import RandomGenerator
from sheldrake.common._checked import checked
from sheldrake.geometry.optimization._counterexamples import closest, violations
from sheldrake.geometry.optimization._ellipsoids import Hyperellipsoid
from sheldrake.geometry.optimization._hpolyhedron import HPolyhedron
from sheldrake.geometry.optimization._iris import (
    IrisOptions,
    bounded_domain,
    first_ellipsoid,
    inflate,
    tangent,
)

if TYPE_CHECKING:
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.solvers import Constraint
    from sheldrake.systems.framework import Context


@checked
def IrisNp(plant: MultibodyPlant, context: Context, options: IrisOptions | None = None) -> HPolyhedron:
    """Returns a large region of configurations without collisions, around that in a context.

    In turns, each pair of geometries, the nearest first, is cut off by faces through the configurations in collision
    that are nearest to the center of an ellipsoid, until none is found; and the largest ellipsoid within is found.

    Args:
        plant: Connected to a SceneGraph; its positions have finite limits.
        context: Its context, part of that of the diagram.
        options: Of the search.

    Raises:
        RuntimeError: the domain is unbounded, or the configuration collides or violates a constraint.
    """
    return _Search(plant, context, IrisOptions() if options is None else options).grow()


class _Search:
    def __init__(self, plant: MultibodyPlant, context: Context, options: IrisOptions):
        from sheldrake.multibody.inverse_kinematics._distance import DistanceConstraint

        self._plant, self._context, self._options = plant, context, options
        self._seed = np.array(plant.GetPositions(context))
        limits = HPolyhedron.MakeBox(plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits())
        self._domain = bounded_domain("IrisNp", options, limits)
        if not self._domain.PointInSet(self._seed, 1e-12):
            raise RuntimeError("IrisNp(): the seed is outside of the domain.")
        self._generator = RandomGenerator(options.random_seed)
        query = plant.get_geometry_query_input_port().Eval(context)
        distance = {}
        for pair in query.inspector().GetCollisionCandidates():
            distance[tuple(pair)] = query.ComputeSignedDistancePairClosestPoints(*pair).distance
        if any(d <= 0.0 for d in distance.values()):
            raise RuntimeError("The seed point is in collision; the plant's positions in the context must be free.")
        all_of_q = np.arange(self._seed.size)
        pairs = sorted(distance, key=lambda pair: distance[pair])
        self._collisions = [(DistanceConstraint(plant, pair, context, -np.inf, 0.0), all_of_q) for pair in pairs]
        self._violations = violations(options.prog_with_additional_constraints)
        for constraint, places in self._violations:
            if constraint.CheckSatisfied(self._seed[places], 0.0):
                raise RuntimeError("IrisNp(): the seed violates an additional constraint.")
        self._examples: dict[int, np.ndarray] = {}  # The last one found of each kind.

    def grow(self) -> HPolyhedron:
        region = inflate(self._domain, first_ellipsoid(self._options, self._seed), self._options, self._separated)
        self._plant.SetPositions(self._context, self._seed)
        return region

    def _separated(self, ellipsoid: Hyperellipsoid) -> HPolyhedron | None:
        """The domain behind faces; None if the seed would have to be left, but must not."""
        o = self._options
        region: HPolyhedron | None = self._domain
        points = [ellipsoid.MinimumUniformScalingToTouch(s) for s in o.configuration_obstacles]
        for i in sorted(range(len(points)), key=lambda i: points[i][0]):
            if region is not None and region.IntersectsWith(o.configuration_obstacles[i]):
                region = self._behind(region, ellipsoid, points[i][1])
        kinds: list[tuple[tuple[Constraint, np.ndarray], int]]
        kinds = [(c, o.num_collision_infeasible_samples) for c in self._collisions]
        kinds += [(c, o.num_additional_constraint_infeasible_samples) for c in self._violations]
        for (collision, places), failures in kinds:
            if region is None:
                return None
            region = self._without(region, ellipsoid, collision, places, failures)
        return region

    def _without(
        self, region: HPolyhedron, ellipsoid: Hyperellipsoid, collision: Any, places: np.ndarray, failures: int
    ) -> HPolyhedron | None:
        """The region without the collisions of a kind, as far as they are found in so many trials in a row."""
        failed, guess = 0, self._examples.get(id(collision), ellipsoid.center())
        while failed < failures:
            found = closest(collision, places, ellipsoid, region, guess)
            if found is None:
                failed += 1
            else:
                failed = 0
                self._examples[id(collision)] = found
                behind = self._behind(region, ellipsoid, found)
                if behind is None:
                    return None
                region = behind
            inside = region.PointInSet(ellipsoid.center(), 0.0)
            start = ellipsoid.center() if inside else region.ChebyshevCenter()
            guess = region.UniformSample(self._generator, start, self._options.mixing_steps)
        return region

    def _behind(self, region: HPolyhedron, ellipsoid: Hyperellipsoid, point: np.ndarray) -> HPolyhedron | None:
        a, b = tangent(ellipsoid, point)
        b -= self._options.configuration_space_margin
        if self._options.require_sample_point_is_contained and a @ self._seed >= b:
            return None
        return HPolyhedron(np.vstack((region.A(), a)), np.append(region.b(), b))
