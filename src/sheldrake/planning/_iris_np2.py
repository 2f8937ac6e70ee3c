"""Regions of configurations without collisions, by samples and nonlinear programs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._options import Options
from sheldrake.common._overloads import expect
from sheldrake.geometry.optimization import HPolyhedron, Hyperellipsoid
from sheldrake.geometry.optimization._counterexamples import closest
from sheldrake.geometry.optimization._iris import tangent
from sheldrake.planning._sampled_iris import (
    CommonSampledIrisOptions,
    FreeTest,
    IrisParameterizationFunction,
    SampledRegion,
    nearest_first,
)
from sheldrake.planning._scene_graph_checker import SceneGraphCollisionChecker
from sheldrake.solvers import Constraint, SolverInterface, SolverOptions, _arrays
from sheldrake.solvers._functions.evaluators import Opaque

if TYPE_CHECKING:
    from sheldrake.planning._collision_checker import CollisionChecker


class RaySamplerOptions(Options):
    """How samples are moved towards the center before collisions are looked for.

    Attributes:
        only_walk_toward_collisions: Whether only samples in collision are moved.
        ray_search_num_steps: Steps from the center to a sample.
        num_particles_to_walk_towards: How many samples are moved, where not only those in collision are.
    """

    only_walk_toward_collisions: bool = False
    ray_search_num_steps: int = 10
    num_particles_to_walk_towards: int = 200


class IrisNp2Options(Options):
    """How `IrisNp2` searches.

    Attributes:
        sampled_iris_options: What the searches by samples have in common.
        sampling_strategy: "greedy", from samples in collision; or "ray", from the first collisions towards them.
        ray_sampler_options: For "ray".
        add_hyperplane_if_solve_fails: Whether a sample is cut off where nothing nearer is found.
        parameterization: The space in which the region is grown.
        solver: For the nonlinear programs; None for the best.
        solver_options: Of the solver.
    """

    sampled_iris_options: CommonSampledIrisOptions = CommonSampledIrisOptions()
    sampling_strategy: str = "greedy"
    ray_sampler_options: RaySamplerOptions = RaySamplerOptions()
    add_hyperplane_if_solve_fails: bool = False
    parameterization: IrisParameterizationFunction = IrisParameterizationFunction()
    solver: SolverInterface | None = None
    solver_options: SolverOptions = SolverOptions()


class _Composed(Opaque, Constraint):
    """A constraint on configurations as one on what a function takes them from."""

    _thread_safe = False

    def __init__(self, of: Constraint, function: IrisParameterizationFunction, dimension: int):
        self._of, self._map = of, function
        self._set_sizes(of.num_outputs(), dimension)
        self._set_bounds(of.lower_bound(), of.upper_bound())

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return self._of._eval(self._map.get_parameterization_double()(x))

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        duals = self._map.get_parameterization_autodiff()(_arrays.variables_at(x))
        q, slope = _arrays.values_and_gradient(np.asarray(duals, dtype=object))
        return self._of._jacobian(q) @ slope


@checked
def IrisNp2(
    checker: CollisionChecker,
    starting_ellipsoid: Hyperellipsoid,
    domain: HPolyhedron,
    options: IrisNp2Options | None = None,
) -> HPolyhedron:
    """Returns a region that is, with high probability, almost free of collisions.

    From samples in collision, nonlinear programs look for the nearest collisions of the same geometries.

    Args:
        checker: A SceneGraphCollisionChecker.
        starting_ellipsoid: Around which the region is grown; its center is free.
        domain: Bounded.
        options: Of the search.

    Raises:
        RuntimeError: dimensions differ, the domain is unbounded, the center collides, or the strategy is unknown.
        TypeError: the checker is no SceneGraphCollisionChecker.
    """
    pairs_of: SceneGraphCollisionChecker = expect("IrisNp2", checker, SceneGraphCollisionChecker)
    options = IrisNp2Options() if options is None else options
    if options.sampling_strategy not in ("greedy", "ray"):
        raise RuntimeError(f"IrisNp2(): sampling_strategy is {options.sampling_strategy!r}; valid: 'greedy', 'ray'.")
    search = _Nearest(pairs_of, options, domain.ambient_dimension())
    common = options.sampled_iris_options
    return SampledRegion("IrisNp2", common, search.is_free, search.nearest).grow(starting_ellipsoid, domain)


class _Nearest:
    """Finds collisions near a center from samples in collision."""

    def __init__(self, checker: SceneGraphCollisionChecker, options: IrisNp2Options, dimension: int):
        self._checker, self._options, self._dimension = checker, options, dimension
        self.is_free = FreeTest(checker, options.sampled_iris_options, options.parameterization)
        self._to_q = options.parameterization.get_parameterization_double()
        self._constraints: dict[tuple, Constraint] = {}

    def _pair_at(self, x: np.ndarray) -> tuple | None:
        """The geometries that are deepest in collision."""
        context = self._checker.model_context()
        self._checker.UpdateContextPositions(context, self._to_q(x))
        near = self._checker._near(context, 0.0)
        if not len(near.left):
            return None
        a, b = near.numbers[near.left.argmin()]
        return near.ids[a], near.ids[b]

    def _constraint(self, pair: tuple) -> Constraint:
        from sheldrake.multibody.inverse_kinematics._distance import DistanceConstraint

        if pair not in self._constraints:
            plant, context = self._checker.plant(), self._checker.plant_context()
            found: Constraint = DistanceConstraint(plant, pair, context, -np.inf, 0.0)
            if self._options.parameterization.get_parameterization_dimension() is not None:
                found = _Composed(found, self._options.parameterization, self._dimension)
            self._constraints[pair] = found
        return self._constraints[pair]

    def _on_ray(self, center: np.ndarray, x: np.ndarray) -> np.ndarray:
        """The first of some steps from the center to a collision that collides."""
        steps = self._options.ray_sampler_options.ray_search_num_steps
        for k in range(1, steps):
            y = center + k / steps * (x - center)
            if not self.is_free(y):
                return y
        return x

    def nearest(self, colliding: list, ellipsoid: Hyperellipsoid, region: HPolyhedron) -> list[np.ndarray]:
        o = self._options
        out: list[np.ndarray] = []
        limit = o.sampled_iris_options.max_separating_planes_per_iteration
        faces: list[tuple[np.ndarray, float]] = []
        for x in nearest_first(colliding, ellipsoid):
            if len(out) == limit:
                break
            if any(a @ x > b for a, b in faces):
                continue  # What is found nearer cuts it off.
            start = self._on_ray(ellipsoid.center(), x) if o.sampling_strategy == "ray" else x
            pair = self._pair_at(start)
            found = None
            if pair is not None:
                everything = np.arange(self._dimension)
                found = closest(
                    self._constraint(pair), everything, ellipsoid, region, start, o.solver, o.solver_options
                )
            if found is None and (o.add_hyperplane_if_solve_fails or pair is None):
                found = start
            if found is not None:
                out.append(found)
                faces.append(tangent(ellipsoid, found))
        return out
