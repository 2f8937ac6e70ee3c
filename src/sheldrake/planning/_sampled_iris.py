"""Regions of configurations that are, with high probability, almost free of collisions.

P. Werner, T. Cohn, R. Jiang, T. Seyde, M. Simchowitz, R. Tedrake and D. Rus, "Faster algorithms for growing
collision-free convex polytopes in robot configuration space", 2024. Symbols are theirs: with probability 1 - delta at
most the part epsilon of a region collides; tau trades samples for power of the test.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common import Parallelism
from sheldrake.common._checked import checked
from sheldrake.common._kinds import count, instance_of
from sheldrake.common._options import Options
from sheldrake.common._overloads import overload, overloaded
from sheldrake.geometry.optimization import HPolyhedron, Hyperellipsoid
from sheldrake.geometry.optimization._iris import tangent
from sheldrake.multibody.rational import RationalForwardKinematics
from sheldrake.planning._kernels.walks import walk_all
from sheldrake.solvers import MathematicalProgram, _arrays
from sheldrake.solvers import _kinds as kinds

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sheldrake.planning import CollisionChecker

_LOOKED_AT = 1000  # Samples that are checked at once beyond the least number.
_MOST_BISECTED = 100  # Of the samples in collision, the nearest: more would cost checks, and make faces hardly better.


class CommonSampledIrisOptions(Options):
    """What the searches by samples have in common.

    Attributes:
        num_particles: Least number of samples of each round.
        tau: Threshold of the test.
        delta: Probability that more than epsilon of the region collides.
        epsilon: Part of the region that may collide.
        containment_points: Configurations that the region is to contain, columns; or None.
        max_iterations: Most ellipsoids.
        max_iterations_separating_planes: Most rounds of new faces for each ellipsoid.
        max_separating_planes_per_iteration: Most new faces of each round; -1 for any number.
        parallelism: How many threads check samples for collisions; regions do not depend on it.
        verbose: Accepted, without effect.
        require_sample_point_is_contained: Whether to stop before the region leaves its first center.
        configuration_space_margin: Distance kept from collisions.
        relax_margin: Whether the distance may be halved where it would cut off the center.
        termination_threshold: Growth of the ellipsoid's volume at which to stop.
        relative_termination_threshold: Growth relative to the volume at which to stop.
        remove_all_collisions_possible: Whether samples in collision are cut off even where there are few enough.
        random_seed: Of samples.
        mixing_steps: Steps between samples.
        sample_particles_in_parallel: Accepted, without effect: samples walk all at once.
        prog_with_additional_constraints: Constraints on configurations; None for none.
    """

    num_particles: int = 1000
    tau: float = 0.5
    delta: float = 0.05
    epsilon: float = 0.01
    containment_points: Any = None
    max_iterations: int = 3
    max_iterations_separating_planes: int = 20
    max_separating_planes_per_iteration: int = 10
    parallelism: Parallelism = Parallelism.Max()
    verbose: bool = False
    require_sample_point_is_contained: bool = True
    configuration_space_margin: float = 0.01
    relax_margin: bool = False
    termination_threshold: float = 0.02
    relative_termination_threshold: float = 1e-3
    remove_all_collisions_possible: bool = True
    random_seed: int = 1234
    mixing_steps: int = 50
    sample_particles_in_parallel: bool = False
    prog_with_additional_constraints: MathematicalProgram | None = None


class IrisParameterizationFunction:
    """A function from the space in which a region is grown to configurations.

    Made as `()`, the identity; `(parameterization, dimension)` with a Python function; `(expression_parameterization,
    variables)`; or `(kin, q_star_val)` with a RationalForwardKinematics.
    """

    @overloaded(
        overload(lambda self: self._set(lambda x: x, None)),
        overload(
            lambda self, *given: self._set(*given, is_threadsafe=False),
            parameterization=kinds.function,
            dimension=count,
        ),
        overload(
            lambda self, kin, q_star: self._set(lambda s: kin.ComputeQValue(s, q_star), len(kin.s())),
            kin=instance_of(RationalForwardKinematics),
            q_star_val=kinds.vector,
        ),
        overload(expression_parameterization=kinds.expressions, variables=kinds.vars),
    )
    def __init__(self, expressions: np.ndarray, variables: np.ndarray):

        def evaluate(x: np.ndarray) -> np.ndarray:
            x = np.asarray(x)
            values, gradient = _arrays.values_and_gradient(x) if x.dtype == object else (x, None)
            at = dict(zip(variables, map(float, values)))
            q = np.array([e.Evaluate(at) for e in expressions])
            if gradient is None:
                return q
            J = np.array([[e.Differentiate(v).Evaluate(at) for v in variables] for e in expressions])
            return _arrays.duals(q, J @ gradient)

        self._set(evaluate, len(variables))

    def _set(
        self, function: Callable[[np.ndarray], np.ndarray], dimension: int | None, is_threadsafe: bool = True
    ) -> None:
        self._function, self._dimension, self._is_threadsafe = function, dimension, is_threadsafe

    def get_parameterization_double(self) -> Callable[[np.ndarray], np.ndarray]:
        """Returns the function of floats."""
        return lambda x: np.asarray(self._function(np.asarray(x, dtype=float)), dtype=float)

    def get_parameterization_autodiff(self) -> Callable[[np.ndarray], np.ndarray]:
        """Returns the function of AutoDiffXd."""
        return self._function

    def get_parameterization_dimension(self) -> int | None:
        """Returns the dimension of its argument; None where it is that of configurations."""
        return self._dimension

    def get_parameterization_is_threadsafe(self) -> bool:
        """Returns whether it may be called by several threads at once: not if it is a Python function of yours."""
        return self._is_threadsafe


def nearest_first(points: list[np.ndarray], ellipsoid: Hyperellipsoid) -> list[np.ndarray]:
    """Points by their distance from the center of an ellipsoid, in its metric."""
    return sorted(points, key=lambda p: float(np.linalg.norm(ellipsoid.A() @ (p - ellipsoid.center()))))


def samples_of_test(delta: float, epsilon: float, tau: float) -> int:
    """How many samples the test takes (theorem 1)."""
    return math.ceil(2.0 * math.log(1.0 / delta) / (epsilon * tau * tau))


def hit_and_run(
    region: HPolyhedron, start: np.ndarray, count: int, steps: int, random: np.random.Generator
) -> np.ndarray:
    """Points of a bounded region, rows: as many walks of random chords from a point in it, all at once."""
    n, b = start.size, region.b()
    directions, reaches = np.empty((steps * n, count)), np.empty((steps, count))
    for k in range(steps):
        directions[k * n : (k + 1) * n] = random.normal(size=(n, count))
        reaches[k] = random.random(count)
    points = np.repeat(start.reshape(1, -1), count, axis=0)
    faces, scratch = np.ascontiguousarray(region.A().T), (np.zeros(len(b)), np.zeros(len(b)))
    walk_all.native(faces, b, directions, reaches, *scratch, points)
    return points


class SampledRegion:
    """Grows a region around an ellipsoid by cutting off samples in collision.

    Args:
        call: Name of the search, for errors.
        options: Its options.
        is_free: Tells whether a point is free, and which of many are.
        nearest: From samples in collision, the ellipsoid and the region: points in collision near the center.
    """

    def __init__(
        self,
        call: str,
        options: CommonSampledIrisOptions,
        is_free: FreeTest,
        nearest: Callable[[list[np.ndarray], Hyperellipsoid, HPolyhedron], list[np.ndarray]],
    ):
        self._call, self._options, self._is_free, self._nearest = call, options, is_free, nearest
        self._random = np.random.default_rng(options.random_seed)

    def grow(self, start: Hyperellipsoid, domain: HPolyhedron) -> HPolyhedron:
        """The region.

        Raises:
            RuntimeError: dimensions differ, the domain is unbounded, or the center or a point to contain collides.
        """
        center = start.center()
        if domain.ambient_dimension() != center.size or not domain.IsBounded():
            raise RuntimeError(f"{self._call}(): the domain must be bounded, of dimension {center.size}.")
        if not domain.PointInSet(center) or not self._is_free(center):
            raise RuntimeError(f"{self._call}(): Starting ellipsoid center {center} is in collision.")
        self._kept = self._points_to_keep(domain, center)
        region, ellipsoid, best = domain, start, start.CalcVolume()
        for _ in range(self._options.max_iterations):
            grown = self._separated(domain, ellipsoid)
            if self._options.require_sample_point_is_contained and not grown.PointInSet(center, 0.0):
                return region
            region = grown
            ellipsoid = region.MaximumVolumeInscribedEllipsoid()
            gain = ellipsoid.CalcVolume() - best
            if gain <= self._options.termination_threshold:
                break
            if gain / best <= self._options.relative_termination_threshold:
                break
            best += gain
        return region

    def _points_to_keep(self, domain: HPolyhedron, center: np.ndarray) -> np.ndarray:
        """What no face may cut off, columns."""
        given = self._options.containment_points
        if given is None:
            return np.zeros((center.size, 0))
        points = np.array(given, dtype=float).reshape(center.size, -1)
        for p in points.T:
            if not domain.PointInSet(p) or not self._is_free(p):
                raise RuntimeError(f"{self._call}(): containment point {p} is in collision, or outside of the domain.")
        return points

    def _separated(self, domain: HPolyhedron, ellipsoid: Hyperellipsoid) -> HPolyhedron:
        """The domain behind faces that cut off collisions, until the test is passed."""
        o = self._options
        region = domain
        for k in range(o.max_iterations_separating_planes):
            delta = o.delta * 6.0 / (math.pi * (k + 1)) ** 2
            tested = samples_of_test(delta, o.epsilon, o.tau)
            count = max(tested, o.num_particles)
            particles = hit_and_run(region, ellipsoid.center(), count, o.mixing_steps, self._random)
            colliding, passed = self._test(particles, tested)
            if passed and not (o.remove_all_collisions_possible and colliding):
                return region
            region = self._cut(region, ellipsoid, colliding)
            if passed or not region.PointInSet(ellipsoid.center(), 0.0):
                return region
        return region

    def _test(self, particles: np.ndarray, tested: int) -> tuple[list[np.ndarray], bool]:
        """Samples in collision, and whether few enough are; where it is plain that too many are, it stops early."""
        o = self._options
        allowed = (1.0 - o.tau) * o.epsilon * tested
        colliding: list[np.ndarray] = []
        begin, end = 0, o.num_particles
        while begin < len(particles):
            for i, free in enumerate(self._is_free.each(particles[begin:end]), begin):
                if i >= o.num_particles and len(colliding) > allowed:
                    return colliding, False
                if not free:
                    colliding.append(particles[i])
            begin, end = end, end + _LOOKED_AT
        return colliding, len(colliding) <= allowed

    def _cut(self, region: HPolyhedron, ellipsoid: Hyperellipsoid, colliding: list[np.ndarray]) -> HPolyhedron:
        """The region behind faces tangent to the ellipsoid at collisions, the nearest first."""
        o = self._options
        points = nearest_first(self._nearest(colliding, ellipsoid, region), ellipsoid)
        A, b, added = region.A(), region.b(), 0
        for p in points:
            if 0 <= o.max_separating_planes_per_iteration <= added:
                break
            if np.any(A @ p > b):
                continue  # Cut off already.
            a, offset = self._face(ellipsoid, p)
            A, b = np.vstack((A, a)), np.append(b, offset)
            added += 1
        return HPolyhedron(A, b)

    def _face(self, ellipsoid: Hyperellipsoid, point: np.ndarray) -> tuple[np.ndarray, float]:
        o = self._options
        a, b = tangent(ellipsoid, point)
        if self._kept.shape[1]:
            return a, max(b - o.configuration_space_margin, float((a @ self._kept).max()))
        margin, at_center = o.configuration_space_margin, float(a @ ellipsoid.center())
        if b - margin < at_center:
            if not o.relax_margin:
                raise RuntimeError(
                    f"{self._call}(): the seed point is within configuration_space_margin of being in collision. "
                    "Reduce the margin, or set relax_margin."
                )
            while b - margin < at_center and margin > 1e-12:
                margin *= 0.5
        return a, b - margin


class FreeTest:
    """Tells whether configurations of points are free, and satisfy additional constraints.

    Args:
        checker: A collision checker.
        options: Of the search: constraints, and how many threads may check.
        function: From points to configurations.
    """

    def __init__(
        self, checker: CollisionChecker, options: CommonSampledIrisOptions, function: IrisParameterizationFunction
    ):
        prog = options.prog_with_additional_constraints or MathematicalProgram()
        self._constraints = [
            (c.evaluator(), prog.FindDecisionVariableIndices(c.variables())) for c in prog.GetAllConstraints()
        ]
        self._checker, self._threads = checker, options.parallelism
        self._to_q = function.get_parameterization_double()

    def __call__(self, x: np.ndarray) -> bool:
        return bool(self._checker.CheckConfigCollisionFree(self._to_q(x))) and self._satisfied(x)

    def each(self, points: Sequence[np.ndarray] | np.ndarray) -> list[bool]:
        """The same of many points, which threads check."""
        free = self._checker.CheckConfigsCollisionFree([self._to_q(x) for x in points], self._threads)
        return [bool(is_free) and self._satisfied(x) for x, is_free in zip(points, free)]

    def _satisfied(self, x: np.ndarray) -> bool:
        return all(evaluator.CheckSatisfied(x[place], 1e-6) for evaluator, place in self._constraints)


class IrisZoOptions(Options):
    """How `IrisZo` searches.

    Attributes:
        bisection_steps: Steps from a collision towards the center.
        sampled_iris_options: What the searches by samples have in common.
        parameterization: The space in which the region is grown.
    """

    bisection_steps: int = 10
    sampled_iris_options: CommonSampledIrisOptions = CommonSampledIrisOptions()
    parameterization: IrisParameterizationFunction = IrisParameterizationFunction()


@checked
def IrisZo(
    checker: CollisionChecker,
    starting_ellipsoid: Hyperellipsoid,
    domain: HPolyhedron,
    options: IrisZoOptions | None = None,
) -> HPolyhedron:
    """Returns a region that is, with high probability, almost free of collisions; it asks only whether points are free.

    Args:
        checker: A collision checker.
        starting_ellipsoid: Around which the region is grown; its center is free.
        domain: Bounded.
        options: Of the search.

    Raises:
        RuntimeError: dimensions differ, the domain is unbounded, or the center collides.
    """
    options = IrisZoOptions() if options is None else options
    is_free = FreeTest(checker, options.sampled_iris_options, options.parameterization)

    def nearest(colliding: list, ellipsoid: Hyperellipsoid, region: HPolyhedron) -> list[np.ndarray]:
        points, center = nearest_first(colliding, ellipsoid)[:_MOST_BISECTED], ellipsoid.center()
        low, high = np.zeros(len(points)), np.ones(len(points))  # Along the ways from the center, which is free.
        for _ in range(options.bisection_steps):
            middle = 0.5 * (low + high)
            free = is_free.each([center + m * (p - center) for m, p in zip(middle, points)])
            low, high = np.where(free, middle, low), np.where(free, high, middle)
        return [center + h * (p - center) for h, p in zip(high, points)]

    return SampledRegion("IrisZo", options.sampled_iris_options, is_free, nearest).grow(starting_ellipsoid, domain)
