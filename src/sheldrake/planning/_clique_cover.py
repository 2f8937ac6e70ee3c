"""Covers of the free configurations by regions around cliques of configurations that see each other.

P. Werner, A. Amice, T. Marcucci, D. Rus and R. Tedrake, "Approximating robot configuration spaces with few convex sets
using clique covers of visibility graphs", ICRA 2024.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common import Parallelism
from sheldrake.common._checked import checked
from sheldrake.common._options import Options
from sheldrake.geometry.optimization import AffineBall, HPolyhedron, Hyperellipsoid, Hyperrectangle, IrisNp, IrisOptions
from sheldrake.planning._cliques import (
    MaxCliqueSolverBase,
    MaxCliqueSolverViaGreedy,
    MinCliqueCoverSolverViaGreedy,
    VisibilityGraph,
)
from sheldrake.planning._iris_np2 import IrisNp2, IrisNp2Options
from sheldrake.planning._sampled_iris import IrisZo, IrisZoOptions

if TYPE_CHECKING:
    from sheldrake.common import RandomGenerator
    from sheldrake.planning import CollisionChecker

_log = logging.getLogger("drake")


class IrisFromCliqueCoverOptions(Options):
    """How a cover is searched.

    Attributes:
        iris_options: IrisOptions, IrisNp2Options or IrisZoOptions: how regions are grown.
        coverage_termination_threshold: Part of the domain at which to stop.
        iteration_limit: Most rounds.
        num_points_per_coverage_check: Samples for the covered part.
        minimum_clique_size: Least size of cliques.
        num_points_per_visibility_round: Configurations in each graph.
        parallelism: How many threads check edges for collisions.
        rank_tol_for_minimum_volume_circumscribed_ellipsoid: Of ellipsoids around cliques.
        point_in_set_tol: By how much points may be outside of regions that cover them.
    """

    iris_options: Any = IrisOptions(iteration_limit=1)
    coverage_termination_threshold: float = 0.7
    iteration_limit: int = 100
    num_points_per_coverage_check: int = 1000
    minimum_clique_size: int = 3
    num_points_per_visibility_round: int = 200
    parallelism: Parallelism = Parallelism.Max()
    rank_tol_for_minimum_volume_circumscribed_ellipsoid: float = 1e-6
    point_in_set_tol: float = 1e-6


@checked
def IrisInConfigurationSpaceFromCliqueCover(
    checker: CollisionChecker,
    options: IrisFromCliqueCoverOptions,
    generator: RandomGenerator,
    sets: list[HPolyhedron],
    max_clique_solver: MaxCliqueSolverBase | None = None,
) -> list[HPolyhedron]:
    """Returns regions that cover the free configurations, those given first.

    Args:
        checker: A collision checker.
        options: Of the search.
        generator: Of random numbers.
        sets: Regions to start with; new ones are appended.
        max_clique_solver: Finds cliques; None for the greedy one.

    Raises:
        RuntimeError: positions have no finite limits.
    """
    plant = checker.plant()
    domain = Hyperrectangle(plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits())
    least = max(options.minimum_clique_size, domain.ambient_dimension() + 1)
    count = max(options.num_points_per_visibility_round, 2 * least)
    cover = MinCliqueCoverSolverViaGreedy(max_clique_solver or MaxCliqueSolverViaGreedy(), least)
    tol = options.point_in_set_tol

    def sampled(number: int, new: bool) -> np.ndarray:
        """Free configurations, columns; new ones are in no region."""
        out: list[np.ndarray] = []
        trials = 0
        while len(out) < number and trials < 100 * number:
            trials += 1
            q = domain.UniformSample(generator)
            if new and any(s.PointInSet(q, tol) for s in sets):
                continue
            if checker.CheckConfigCollisionFree(q):
                out.append(q)
        return np.array(out).reshape(-1, domain.ambient_dimension()).T

    for _ in range(options.iteration_limit):
        points = sampled(options.num_points_per_coverage_check, False)
        covered = np.mean([any(s.PointInSet(q, tol) for s in sets) for q in points.T]) if points.size else 1.0
        _log.info("Current region coverage is %.3f.", covered)
        if covered >= options.coverage_termination_threshold:
            break
        points = sampled(count, True)
        cliques = (
            cover.SolveMinCliqueCover(VisibilityGraph(checker, points, options.parallelism)) if points.size else []
        )
        if not cliques:
            count *= 2
            continue
        for clique in cliques:
            region = _region(checker, options, domain, points[:, sorted(clique)])
            if region is not None:
                sets.append(region)
    return sets


def _region(
    checker: CollisionChecker, options: IrisFromCliqueCoverOptions, domain: Hyperrectangle, points: np.ndarray
) -> HPolyhedron | None:
    """A region around the ellipsoid of a clique; None where that fails."""
    tol = options.rank_tol_for_minimum_volume_circumscribed_ellipsoid
    ball = AffineBall.MinimumVolumeCircumscribedEllipsoid(points, tol)
    U, s, _ = np.linalg.svd(ball.B())
    ellipsoid = Hyperellipsoid(AffineBall(U * np.maximum(s, 1e-3), ball.center()))
    center = ellipsoid.center()
    if not checker.CheckConfigCollisionFree(center):
        center = points[:, int(np.linalg.norm(points - center[:, None], axis=0).argmin())]
        ellipsoid = Hyperellipsoid(ellipsoid.A(), center)
    how = options.iris_options
    try:
        if isinstance(how, IrisZoOptions):
            return IrisZo(checker, ellipsoid, domain.MakeHPolyhedron(), how)
        if isinstance(how, IrisNp2Options):
            return IrisNp2(checker, ellipsoid, domain.MakeHPolyhedron(), how)
        given = IrisOptions(**{name: getattr(how, name) for name in how._defaults})
        given.starting_ellipse = ellipsoid
        return IrisNp(checker.plant(), checker.UpdatePositions(center), given)
    except RuntimeError as error:
        _log.warning("A region of a clique was not found: %s", error)
        return None
