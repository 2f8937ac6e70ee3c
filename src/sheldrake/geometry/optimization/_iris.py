"""Large convex regions without obstacles, grown around a point.

R. Deits and R. Tedrake, "Computing large convex regions of obstacle-free space through semidefinite programming",
Algorithmic Foundations of Robotics XI, 2015.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._options import Options
from sheldrake.geometry._ids import GeometryId
from sheldrake.geometry._roles import Role
from sheldrake.geometry._shapes import Box, Capsule, Convex, Cylinder, Ellipsoid, HalfSpace, Mesh, Sphere
from sheldrake.geometry.optimization._composed_sets import CartesianProduct, MinkowskiSum
from sheldrake.geometry.optimization._convex_set import ConvexSet
from sheldrake.geometry.optimization._ellipsoids import Hyperellipsoid
from sheldrake.geometry.optimization._hpolyhedron import HPolyhedron
from sheldrake.geometry.optimization._vpolytope import VPolytope
from sheldrake.solvers import MathematicalProgram, SolverOptions, _arrays

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.geometry._query.query_object import QueryObject
    from sheldrake.multibody.tree import Frame

_FIRST_RADIUS = 1e-2  # Of the ball that the search starts with.


class IrisOptions(Options):
    """How regions are grown.

    Attributes:
        require_sample_point_is_contained: Whether to stop before the region leaves the point.
        iteration_limit: Most iterations.
        termination_threshold: Growth of the ellipsoid's volume at which to stop.
        relative_termination_threshold: Growth relative to the volume at which to stop.
        configuration_space_margin: Distance kept from obstacles in configuration space.
        num_collision_infeasible_samples: Consecutive failures to find a collision that count as there being none.
        configuration_obstacles: More obstacles, in configuration space.
        starting_ellipse: The first ellipsoid; None for a small ball around the point.
        bounding_region: Where the region is to stay; None for the domain.
        verify_domain_boundedness: Whether to check that the domain is bounded.
        prog_with_additional_constraints: Constraints on configurations; None for none.
        num_additional_constraint_infeasible_samples: As for collisions, for these constraints.
        random_seed: Of samples.
        mixing_steps: Steps between samples.
        solver_options: Options of nonlinear programs.
    """

    require_sample_point_is_contained: bool = False
    iteration_limit: int = 100
    termination_threshold: float = 2e-2
    relative_termination_threshold: float = 1e-3
    configuration_space_margin: float = 1e-2
    num_collision_infeasible_samples: int = 5
    configuration_obstacles: Any = []
    starting_ellipse: Hyperellipsoid | None = None
    bounding_region: HPolyhedron | None = None
    verify_domain_boundedness: bool = True
    prog_with_additional_constraints: MathematicalProgram | None = None
    num_additional_constraint_infeasible_samples: int = 5
    random_seed: int = 1234
    mixing_steps: int = 10
    solver_options: SolverOptions | None = None


def first_ellipsoid(options: IrisOptions, sample: np.ndarray) -> Hyperellipsoid:
    """Where the search starts."""
    if options.starting_ellipse is not None:
        return options.starting_ellipse
    return Hyperellipsoid.MakeHypersphere(_FIRST_RADIUS, sample)


def bounded_domain(call: str, options: IrisOptions, domain: HPolyhedron) -> HPolyhedron:
    """The domain within the bounding region.

    Raises:
        RuntimeError: it is unbounded.
    """
    if options.bounding_region is not None:
        domain = domain.Intersection(options.bounding_region)
    if options.verify_domain_boundedness and not domain.IsBounded():
        raise RuntimeError(f"{call}(): the domain must be bounded.")
    return domain


def inflate(
    region: HPolyhedron,
    ellipsoid: Hyperellipsoid,
    options: IrisOptions,
    separated: Callable[[Hyperellipsoid], HPolyhedron | None],
) -> HPolyhedron:
    """The last region of faces around an ellipsoid and the largest ellipsoid within, in turns, while that one grows.

    Deits and Tedrake, Computing large convex regions of obstacle-free space through semidefinite programming (2014),
    algorithm 1.

    Args:
        region: What there is where `separated` gives nothing.
        ellipsoid: The first one.
        options: Limits.
        separated: The region behind faces for an ellipsoid; None where it would not do.
    """
    best = ellipsoid.CalcVolume()
    for iteration in range(1, options.iteration_limit + 1):
        found = separated(ellipsoid)
        if found is None:
            break
        region = found
        if iteration == options.iteration_limit:
            break
        ellipsoid = region.MaximumVolumeInscribedEllipsoid()
        volume = ellipsoid.CalcVolume()
        gain = volume - best
        if gain <= options.termination_threshold or gain / best <= options.relative_termination_threshold:
            break
        best = volume
    return region


def tangent(ellipsoid: Hyperellipsoid, point: np.ndarray) -> tuple[np.ndarray, float]:
    """Unit normal and offset of the plane through a point that touches the ellipsoid scaled to reach it."""
    a = ellipsoid.A().T @ (ellipsoid.A() @ (point - ellipsoid.center()))
    a = a / np.linalg.norm(a)
    return a, float(a @ point)


@checked
def Iris(
    obstacles: list[ConvexSet], sample: ArrayLike, domain: HPolyhedron, options: IrisOptions | None = None
) -> HPolyhedron:
    """Returns a large convex region of a domain without obstacles, around a point.

    In turns, planes are put between an ellipsoid and the obstacles, the nearest first, and the largest ellipsoid within
    the planes is found.

    Args:
        obstacles: Convex sets.
        sample: The point, shape (n,).
        domain: Bounded.
        options: Limits.

    Raises:
        RuntimeError: the domain is unbounded, or dimensions differ.
    """
    options = IrisOptions() if options is None else options
    sample = _arrays.float_vector(sample)
    for s in (domain, *obstacles):
        if s.ambient_dimension() != sample.size:
            raise RuntimeError(f"Iris(): a set has dimension {s.ambient_dimension()}, the sample {sample.size}.")
    domain = bounded_domain("Iris", options, domain)

    def separated(ellipsoid: Hyperellipsoid) -> HPolyhedron | None:
        region = _separated(domain, ellipsoid, obstacles)
        return None if options.require_sample_point_is_contained and not region.PointInSet(sample, 0.0) else region

    return inflate(domain, first_ellipsoid(options, sample), options, separated)


def _separated(domain: HPolyhedron, ellipsoid: Hyperellipsoid, obstacles: list[ConvexSet]) -> HPolyhedron:
    """The domain behind planes between an ellipsoid and the obstacles that are still in it, the nearest first."""
    touching = [ellipsoid.MinimumUniformScalingToTouch(s) for s in obstacles]
    region = domain
    for i in sorted(range(len(obstacles)), key=lambda i: touching[i][0]):
        if region.IntersectsWith(obstacles[i]):
            a, b = tangent(ellipsoid, touching[i][1])
            region = HPolyhedron(np.vstack((region.A(), a)), np.append(region.b(), b))
    return region


def set_of_shape(query_object: QueryObject, geometry: GeometryId, frame: Frame) -> ConvexSet:
    """A geometry as a convex set, of the kind that programs are smallest with."""
    shape = query_object.inspector().GetShape(geometry)
    kinds: list[tuple[tuple[type, ...], Callable[..., ConvexSet]]] = [
        ((HalfSpace, Box), HPolyhedron),
        ((Sphere, Ellipsoid), Hyperellipsoid),
        ((Cylinder,), CartesianProduct),
        ((Capsule,), MinkowskiSum),
        ((Convex, Mesh), VPolytope),
    ]
    for shapes, kind in kinds:
        if isinstance(shape, shapes):
            return kind(query_object, geometry, frame)
    raise RuntimeError(f"MakeIrisObstacles(): {type(shape).__name__} is not supported.")


@checked
def MakeIrisObstacles(query_object: QueryObject, reference_frame: Any = None) -> list[ConvexSet]:
    """Returns all geometries with a proximity role, where they are, as convex sets.

    Args:
        query_object: Of a SceneGraph.
        reference_frame: In which the sets are; None for the world.

    Raises:
        RuntimeError: a shape is no convex set.
    """
    ids = query_object.inspector().GetAllGeometryIds(Role.kProximity)
    return [set_of_shape(query_object, geometry, reference_frame) for geometry in ids]
