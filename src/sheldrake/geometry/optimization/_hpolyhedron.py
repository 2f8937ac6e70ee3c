"""Polyhedra by half-spaces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common import quick
from sheldrake.common._bound_calls import BoundCalls
from sheldrake.common._checked import checked
from sheldrake.common._kernels.twister import SIZE
from sheldrake.common._kinds import count, instance_of
from sheldrake.common._overloads import Ways, dispatch, overload
from sheldrake.geometry._kernels.hit_and_run import OUTSIDE, UNBOUNDED, walk
from sheldrake.geometry._shapes import Box, HalfSpace
from sheldrake.geometry.optimization import _face_translation
from sheldrake.geometry.optimization import _polyhedron_programs as programs
from sheldrake.geometry.optimization._affine import Affine, Rows
from sheldrake.geometry.optimization._convex_set import ConvexSet, checked_box
from sheldrake.geometry.optimization._ellipsoids import Hyperellipsoid
from sheldrake.geometry.optimization._from_geometry import Placed, geometry_overload, unsupported
from sheldrake.geometry.optimization._hulls import half_spaces
from sheldrake.geometry.optimization._vpolytope import VPolytope
from sheldrake.solvers import MathematicalProgram, _arrays
from sheldrake.solvers._kernels.inside import inside_halfspaces

if TYPE_CHECKING:
    import scipy.sparse
    from numpy.typing import ArrayLike

    from sheldrake.common import RandomGenerator
    from sheldrake.geometry._ids import FrameId, GeometryId
    from sheldrake.geometry._query.query_object import QueryObject
    from sheldrake.geometry._shapes import Shape
    from sheldrake.math._rigid_transform import RigidTransform


_DEEP = 1e-6  # How deep inside a point must be, relative to how far it is from the origin.


@checked
class HPolyhedron(ConvexSet):
    """A x <= b.

    Made as `()`; `(A, b)`; `(query_object, geometry_id, reference_frame=None)` of a box or a half space;
    `(vpoly, tol=1e-9)`; or `(prog)`, the points that satisfy a program of linear constraints.

    Raises:
        RuntimeError: A and b have different numbers of rows, the shape is none of these, or a constraint is not linear.
    """

    @typing_overload
    @checked
    def __init__(self) -> None: ...
    @typing_overload
    @checked
    def __init__(self, A: ArrayLike | scipy.sparse.spmatrix, b: ArrayLike) -> None: ...
    @typing_overload
    @checked
    def __init__(
        self, query_object: QueryObject, geometry_id: GeometryId, reference_frame: FrameId | None = None
    ) -> None: ...
    @typing_overload
    @checked
    def __init__(self, vpoly: VPolytope, tol: float = 1e-9) -> None: ...
    @typing_overload
    @checked
    def __init__(self, prog: MathematicalProgram) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any):
        dispatch("HPolyhedron", _WAYS, self, args, kwargs)

    def _set(self, A: np.ndarray, b: np.ndarray) -> None:
        if A.shape[0] != b.size:
            raise RuntimeError(f"HPolyhedron(): A has {A.shape[0]} rows, b {b.size}.")
        if not np.isfinite(A).all() or np.isnan(b).any():
            raise RuntimeError("HPolyhedron(): A must be finite, and b no nan.")
        self._own(np.array(A), np.array(b))

    def _own(self, A: np.ndarray, b: np.ndarray) -> None:
        self._A, self._b, self._dimension = A, b, A.shape[1]

    def _set_of_geometry(self, at: Placed) -> None:
        if isinstance(at.shape, HalfSpace):
            A, b = np.array([[0.0, 0.0, 1.0]]), np.zeros(1)
        elif isinstance(at.shape, Box):
            A, b = programs.box_rows(-0.5 * at.shape.size(), 0.5 * at.shape.size())
        else:
            raise unsupported(HPolyhedron, at.shape)
        A = A @ at.R_FG.T
        self._set(A, b + A @ at.p_FG)

    def _set_of_vertices(self, vpoly: VPolytope, tol: float) -> None:
        if vpoly.IsEmpty():
            if vpoly.ambient_dimension() == 0:
                raise RuntimeError("HPolyhedron(): an empty VPolytope without dimensions is no HPolyhedron.")
            n = vpoly.ambient_dimension()
            self._set(np.vstack((np.eye(1, n), -np.eye(1, n))), np.array([-1.0, 0.0]))
            return
        self._set(*half_spaces(vpoly.vertices(), tol))

    @staticmethod
    def MakeBox(lb: ArrayLike, ub: ArrayLike) -> HPolyhedron:
        """Returns lb <= x <= ub.

        Raises:
            RuntimeError: a lower bound is above its upper bound.
        """
        return HPolyhedron(*programs.box_rows(*checked_box("MakeBox", lb, ub)))

    @staticmethod
    def MakeUnitBox(dim: int) -> HPolyhedron:
        """Returns -1 <= x <= 1."""
        return HPolyhedron.MakeBox(-np.ones(dim), np.ones(dim))

    @staticmethod
    def MakeL1Ball(dim: int) -> HPolyhedron:
        """Returns the points whose absolute coordinates sum to at most one."""
        bits = (np.arange(2**dim)[:, None] >> np.arange(dim)[None, :]) & 1
        return HPolyhedron(1.0 - 2.0 * bits, np.ones(2**dim))

    def A(self) -> np.ndarray:
        """Returns A, shape (m, n)."""
        return self._A.copy()

    def b(self) -> np.ndarray:
        """Returns b, shape (m,)."""
        return self._b.copy()

    # Redundancy

    def ContainedIn(self, other: HPolyhedron, tol: float = 1e-9) -> bool:
        """Tells whether each of its points satisfies the inequalities of another one, up to a tolerance."""
        self._same_space("ContainedIn", other)
        if self.IsEmpty():
            return True
        return all(programs.largest(self._A, self._b, a) <= b + tol for a, b in zip(other._A, other._b))

    def Intersection(self, other: HPolyhedron, check_for_redundancy: bool = False, tol: float = 1e-9) -> HPolyhedron:
        """Returns what it has in common with another one.

        Args:
            other: The other one.
            check_for_redundancy: Whether inequalities of the other one that are implied are left out.
            tol: By how much they may be violated and still count as implied.
        """
        self._same_space("Intersection", other)
        A, b, rows = self._A, self._b, len(self._b)
        A, b = np.concatenate((A, other._A)), np.concatenate((b, other._b))
        if check_for_redundancy:
            kept = list(range(rows))
            for k in range(rows, len(b)):
                if programs.largest(A[kept], b[kept], A[k]) > b[k] + tol:
                    kept.append(k)
            A, b = A[kept], b[kept]
        out = HPolyhedron.__new__(HPolyhedron)
        out._own(A, b)
        return out

    def FindRedundant(self, tol: float = 1e-9) -> set[int]:
        """Returns the rows that those before and after them imply, up to a tolerance."""
        return set(programs.redundant(self._A, self._b, tol))

    def ReduceInequalities(self, tol: float = 1e-9) -> HPolyhedron:
        """Returns it without rows that the others imply, up to a tolerance."""
        keep = np.setdiff1d(np.arange(self._b.size), programs.redundant(self._A, self._b, tol))
        return HPolyhedron(self._A[keep], self._b[keep])

    # Inner and other bodies

    def ChebyshevCenter(self) -> np.ndarray:
        """Returns the center of a largest ball inside, shape (n,).

        Raises:
            RuntimeError: it is empty or unbounded.
        """
        return programs.chebyshev_center(self._A, self._b)

    def MaximumVolumeInscribedEllipsoid(self) -> Hyperellipsoid:
        """Returns the largest ellipsoid inside.

        Raises:
            RuntimeError: it is empty, unbounded or flat.
        """
        B, center = programs.inscribed_ellipsoid(self._A, self._b)
        return Hyperellipsoid(np.linalg.inv(B), center)

    def MaximumVolumeInscribedAffineTransformation(
        self, circumbody: HPolyhedron, check_bounded: bool = True
    ) -> HPolyhedron:
        """Returns the largest affine image of it (by a positive semidefinite matrix) inside another one.

        Raises:
            RuntimeError: it is empty, or one of them is unbounded.
        """
        self._same_space("MaximumVolumeInscribedAffineTransformation", circumbody)
        if check_bounded and not (self.IsBounded() and circumbody.IsBounded()):
            raise RuntimeError("MaximumVolumeInscribedAffineTransformation(): both sets must be bounded.")
        T, t = programs.inscribed_image(self._A, self._b, circumbody._A, circumbody._b)
        A = self._A @ np.linalg.inv(T)
        return HPolyhedron(A, self._b + A @ t)

    def SimplifyByIncrementalFaceTranslation(
        self,
        min_volume_ratio: float = 0.1,
        do_affine_transformation: bool = True,
        max_iterations: int = 10,
        points_to_contain: ArrayLike | None = None,
        intersecting_polytopes: list[HPolyhedron] | None = None,
        keep_whole_intersection: bool = False,
        intersection_padding: float = 1e-4,
        random_seed: int = 0,
    ) -> HPolyhedron:
        """Returns a polyhedron inside this one with fewer faces: faces move inwards until others are redundant.

        Args:
            min_volume_ratio: The least part of the volume that is left.
            do_affine_transformation: Whether the result is stretched at the end to the largest volume inside this one.
            max_iterations: How often all faces are looked at.
            points_to_contain: Points that stay inside, as columns.
            intersecting_polytopes: Polyhedra that the result still meets.
            keep_whole_intersection: Whether moving faces leaves the intersections with them as they are.
            intersection_padding: Radius of a ball in the result about a point of each of them.
            random_seed: For the order of faces.

        Raises:
            RuntimeError: a number is out of its range, a point is outside, a polyhedron does not meet this one, or this
                one is unbounded.
        """
        n = self.ambient_dimension()
        points = np.zeros((n, 0)) if points_to_contain is None else np.asarray(points_to_contain, float).reshape(n, -1)
        settings = _face_translation.Settings(
            min_volume_ratio, max_iterations, points, list(intersecting_polytopes or []), keep_whole_intersection,
            intersection_padding, random_seed,
        )  # fmt: skip
        _face_translation.check(self, settings)
        out = HPolyhedron(*_face_translation.with_fewer_faces(self.ReduceInequalities(), settings))
        if not do_affine_transformation:
            return out
        stretched = out.MaximumVolumeInscribedAffineTransformation(self)
        return stretched if _face_translation.keeps(stretched, settings) else out

    def Scale(self, scale: float, center: ArrayLike | None = None) -> HPolyhedron:
        """Returns it scaled about a center (by default the Chebyshev center) to `scale` times its volume.

        Raises:
            RuntimeError: the scale is negative.
        """
        if scale < 0.0:
            raise RuntimeError(f"Scale(): the scale must not be negative, got {scale}.")
        center = self.ChebyshevCenter() if center is None else _arrays.float_vector(center)
        at_center = self._A @ center
        return HPolyhedron(self._A, at_center + (self._b - at_center) * scale ** (1.0 / self._dimension))

    def CartesianProduct(self, other: HPolyhedron) -> HPolyhedron:
        """Returns the pairs of its points with those of another one."""
        (m1, n1), (m2, n2) = self._A.shape, other._A.shape
        A = np.zeros((m1 + m2, n1 + n2))
        A[:m1, :n1], A[m1:, n1:] = self._A, other._A
        return HPolyhedron(A, np.concatenate((self._b, other._b)))

    def CartesianPower(self, n: int) -> HPolyhedron:
        """Returns the lists of n of its points."""
        return HPolyhedron(np.kron(np.eye(n), self._A), np.tile(self._b, n))

    def PontryaginDifference(self, other: HPolyhedron) -> HPolyhedron:
        """Returns the points to which every point of another one can be added without leaving it."""
        self._same_space("PontryaginDifference", other)
        return HPolyhedron(self._A, self._b - [programs.largest(other._A, other._b, a) for a in self._A])

    # Samples

    @typing_overload
    def UniformSample(
        self, generator: RandomGenerator, mixing_steps: int = 10, subspace: ArrayLike | None = None, tol: float = 1e-8
    ) -> np.ndarray: ...
    @typing_overload
    def UniformSample(
        self,
        generator: RandomGenerator,
        previous_sample: ArrayLike,
        mixing_steps: int = 10,
        subspace: ArrayLike | None = None,
        tol: float = 1e-8,
    ) -> np.ndarray: ...
    def UniformSample(self, *args: Any, **kwargs: Any) -> np.ndarray:
        """Returns a random point, by hit and run: called as `(generator, [previous_sample,] mixing_steps=10,
        subspace=None, tol=1e-8)`.

        Each step goes to a random point of the chord in a random direction (of the span of the subspace's columns).
        Without a previous sample the Chebyshev center is the first.

        Raises:
            ValueError: the previous sample is outside or of another size, or a chord has no end.
        """  # fmt: skip
        return dispatch("UniformSample", _SAMPLE, self, args, kwargs)

    def _walk_from_center(self, generator: RandomGenerator, *rest: Any) -> np.ndarray:
        return self._walk(generator, self.ChebyshevCenter(), *rest)

    def _walk(
        self, generator: RandomGenerator, start: np.ndarray, steps: int, subspace: np.ndarray | None, tol: float
    ) -> np.ndarray:
        n = self._dimension
        rows, d = (n, n) if subspace is None else subspace.shape
        if start.shape != (n,) or rows != n:
            raise ValueError(
                f"UniformSample(): the sample before has {start.size} entries, directions {rows}; expected {n}."
            )
        walked = _walks.of(self._b.size, n, d, int(subspace is not None))
        if walked.polyhedron is not self:
            walked.A[:], walked.b[:], walked.polyhedron = self._A, self._b, self
        if subspace is not None:
            walked.span[:] = subspace
        call = walked.call
        walked.x[:] = start
        call.set("steps", steps)
        call.set("tol", tol)
        outcome = generator._draw(walked.key, walked.place, call)
        if outcome == OUTSIDE:
            raise ValueError("The Hit and Run algorithm failed to find a feasible point in the set.")
        if outcome == UNBOUNDED:
            raise ValueError("UniformSample(): the HPolyhedron is unbounded in a direction of the walk.")
        return walked.x.copy()

    # As a convex set

    def _contain(self, into: Rows, x: Affine, scale: Affine) -> None:
        least = np.full(self._b.size, -np.inf)
        if scale.is_one():
            into.linear(least, self._A @ x, self._b)
        else:
            into.linear(least, self._A @ x - scale.times(self._b), np.zeros(self._b.size))
        into.nonnegative(scale)

    def _contains_quickly(self, x: ArrayLike, tol: float) -> bool | None:
        return _inside(self._A.ravel(), self._b, x, tol)

    def _contains(self, x: np.ndarray, tol: float) -> bool:
        return bool((self._A.dot(x) <= self._b + tol).all())

    def _bounded(self) -> bool:
        return programs.is_bounded(self._A, self._b)

    def _extent(self, direction: np.ndarray) -> float:
        return programs.largest(self._A, self._b, direction)

    def _bounding_box(self) -> tuple[np.ndarray, np.ndarray] | None:
        box = programs.box_of(self._A, self._b)
        if box is None:
            return super()._bounding_box()
        low, high = box
        return box if np.all(low <= high) and np.isfinite(box).all() else None

    def _faces(self) -> tuple[np.ndarray, np.ndarray]:
        return self._A, self._b

    def _some_point(self) -> np.ndarray | None:
        return programs.point(self._A, self._b)

    def _inside(self, tol: float) -> np.ndarray | None:
        """A point deeper inside than a tolerance, beyond doubt; None where there is none, or none is found."""
        lengths = np.linalg.norm(self._A, axis=1)
        if not (self._dimension and lengths.all()):
            return None
        try:
            center = self.ChebyshevCenter()
        except RuntimeError:
            return None
        depth = ((self._b - self._A @ center) / lengths).min(initial=np.inf)
        return center if depth > max(tol, _DEEP * np.abs(center).max()) else None

    def _affine_hull(self, tol: float) -> tuple[np.ndarray, np.ndarray] | None:
        start = None if self._inside(tol) is None else self._some_point()
        return None if start is None else (np.eye(self._dimension), start)

    def _shape(self) -> tuple[Shape, RigidTransform]:
        return VPolytope(self).ToShapeWithPose()


class _Walked:
    """A bound walk through polyhedra of one size, in all directions unless in a subspace's, and its arrays."""

    def __init__(self, m: int, n: int, d: int, in_subspace: int):
        self.polyhedron: HPolyhedron | None = None  # whose A and b are here
        self.A, self.b, self.x = np.zeros((m, n)), np.zeros(m), np.zeros(n)
        self.key, self.place = np.zeros(SIZE, np.int64), np.zeros(2, np.int64)
        self.span = np.zeros((n, d)) if in_subspace else np.eye(n)
        work = np.zeros(n + d + 1)
        self.call = walk.bind(self.A, self.b, self.span, 0, 0.0, self.key, self.place, work, self.x)


_walks = BoundCalls(_Walked)


def _generator(value: object) -> Any:
    """Converter: a generator of random numbers."""
    if not callable(value):
        raise _arrays.Mismatch
    return value


def _matrix_or_none(value: ArrayLike | None) -> np.ndarray | None:
    return None if value is None else _arrays.float_matrix(value)


_WALK: dict[str, Any] = {
    "mixing_steps": (count, 10),
    "subspace": (_matrix_or_none, None),
    "tol": (_arrays.number, 1e-8),
}
_SAMPLE = Ways(
    [
        overload(HPolyhedron._walk, generator=_generator, previous_sample=_arrays.float_vector, **_WALK),
        overload(HPolyhedron._walk_from_center, generator=_generator, **_WALK),
    ]
)


def _rows_of(prog: MathematicalProgram) -> tuple[np.ndarray, np.ndarray]:
    """The linear constraints of a program as A x <= b.

    Raises:
        RuntimeError: it has other constraints.
    """
    linear = [*prog.GetLinearConstraints(), *prog.bounding_box_constraints()]
    if len(linear) != len(prog.GetAllConstraints()):
        raise RuntimeError("HPolyhedron(): the program has constraints that are not linear.")
    rows, bounds = [np.zeros((0, prog.num_vars()))], [np.zeros(0)]
    for binding in linear:
        c = binding.evaluator()
        full = np.zeros((c.num_constraints(), prog.num_vars()))
        np.add.at(full.T, prog.FindDecisionVariableIndices(binding.variables()), c._jacobian(np.zeros(c.num_vars())).T)
        for row, lower, upper in zip(full, c.lower_bound(), c.upper_bound()):
            for sign, bound in ((1.0, upper), (-1.0, lower)):
                if np.isfinite(bound):
                    rows.append(sign * row.reshape(1, -1))
                    bounds.append(np.array([sign * bound]))
    return np.vstack(rows), np.concatenate(bounds)


_WAYS = Ways(
    [
        overload(lambda self: self._set(np.zeros((0, 0)), np.zeros(0))),
        overload(HPolyhedron._set, A=_arrays.float_matrix, b=_arrays.float_vector),
        geometry_overload(HPolyhedron._set_of_geometry),
        overload(HPolyhedron._set_of_vertices, vpoly=instance_of(VPolytope), tol=(_arrays.number, 1e-9)),
        overload(lambda self, prog: self._set(*_rows_of(prog)), prog=instance_of(MathematicalProgram)),
    ]
)

_inside = quick.short_way(globals(), "_inside", inside_halfspaces, quick.ANY, quick.ANY, quick.ANY, float, gives=bool)
