"""Ellipsoids, by a quadratic form or as the image of a ball.

With the smallest one around points; a polyhedron makes the largest one inside itself (`_hpolyhedron`).
"""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common import quick
from sheldrake.common._checked import checked
from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import Ways, dispatch, overload
from sheldrake.common._scalars import frozen
from sheldrake.geometry._shapes import Ellipsoid, Sphere
from sheldrake.geometry.optimization import _polyhedron_programs as programs
from sheldrake.geometry.optimization._affine import Affine, Rows
from sheldrake.geometry.optimization._affine_subspace import column_space
from sheldrake.geometry.optimization._convex_set import ConvexSet
from sheldrake.geometry.optimization._from_geometry import Placed, geometry_overload, unsupported
from sheldrake.math import RigidTransform, RotationMatrix
from sheldrake.solvers import MathematicalProgram, _arrays
from sheldrake.solvers._kernels.inside import inside_ellipsoid

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.geometry import Shape
    from sheldrake.geometry._ids import FrameId, GeometryId
    from sheldrake.geometry._query.query_object import QueryObject


_TOUCHES = 1e-7  # By how much sets may be apart, of the size of one, and touch: as programs with cones tell.
_INVERTED = 1e-9
_FLAT = 1e-24  # Squares of axes that are nothing beside the largest.
_MOST_ROUNDS = 60
_ROUND = 1e6  # Ratio of axes up to which the inverse of a matrix is as good as its factors.
_ROUNDING = 1e-12


def _volume_of_unit_ball(n: int) -> float:
    return math.pi ** (n / 2.0) / math.gamma(n / 2.0 + 1.0)


def _orthonormal(first: np.ndarray) -> np.ndarray:
    """An orthonormal basis: a unit vector, and unit vectors along the coordinates as far as they are square to it."""
    basis = first.reshape(-1, 1)
    for e in np.eye(first.size):
        rest = e - basis @ (basis.T @ e)
        if basis.shape[1] < first.size and np.linalg.norm(rest) > 1e-6:
            basis = np.column_stack((basis, rest / np.linalg.norm(rest)))
    return basis


def _check_square(call: str, M: np.ndarray, center: np.ndarray) -> None:
    if M.shape[1] != center.size:
        raise RuntimeError(f"{call}(): the matrix has {M.shape[1]} columns, the center {center.size} coordinates.")
    if not (np.isfinite(M).all() and np.isfinite(center).all()):
        raise RuntimeError(f"{call}(): matrix and center must be finite.")


@checked
class AffineBall(ConvexSet):
    """B u + center for |u| <= 1; may be flat, but is bounded and not empty.

    Made as `()`, `(B, center)` with a square B, or `(ellipsoid)` of a bounded Hyperellipsoid.

    Raises:
        RuntimeError: B is not square, sizes differ, or the ellipsoid is unbounded.
    """

    _has_volume = True

    def __init__(self, *args: Any, **kwargs: Any):
        dispatch("AffineBall", _WAYS_OF_BALLS, self, args, kwargs)

    def _set(self, B: np.ndarray, center: np.ndarray) -> None:
        _check_square("AffineBall", B, center)
        if B.shape[0] != B.shape[1]:
            raise RuntimeError(f"AffineBall(): B is {B.shape[0]} x {B.shape[1]}, expected a square matrix.")
        self._B, self._center, self._dimension = np.array(B), np.array(center), center.size

    @functools.cached_property
    def _inverse(self) -> np.ndarray | None:
        """That of B, where it is as good as solving for B u."""
        return np.linalg.inv(self._B) if self._B.size and np.linalg.cond(self._B) < _ROUND else None

    def _set_of_form(self, ellipsoid: Hyperellipsoid) -> None:
        if not ellipsoid.IsBounded():
            raise RuntimeError("AffineBall(): the ellipsoid must be bounded.")
        A = ellipsoid.A()
        L = np.linalg.cholesky(A.T @ A) if A.size else A
        self._set(np.linalg.inv(L).T if A.size else A, ellipsoid.center())

    @staticmethod
    def MinimumVolumeCircumscribedEllipsoid(points: ArrayLike, rank_tol: float = 1e-6) -> AffineBall:
        """Returns the least ellipsoid around points, columns; flat if the points are.

        Args:
            points: Shape (n, number of points).
            rank_tol: Directions in which the points spread less, relative to the most, are flat.

        Raises:
            RuntimeError: the points are not finite, or the solver fails.
        """
        points = _arrays.float_matrix(points)
        if not points.size or not np.isfinite(points).all():
            raise RuntimeError("MinimumVolumeCircumscribedEllipsoid(): points must be finite, and at least one.")
        mean = points.mean(axis=1)
        U, s, _ = np.linalg.svd(points - mean[:, None], full_matrices=True)
        rank = int(np.count_nonzero(s > rank_tol * max(s.max(initial=0.0), 1e-300))) if s.max(initial=0.0) > 0.0 else 0
        n = points.shape[0]
        if rank == 0:
            return AffineBall(np.zeros((n, n)), mean)
        basis = U[:, :rank]
        B, center = _circumscribed(basis.T @ (points - mean[:, None]))
        whole = np.zeros((n, n))
        whole[:, :rank] = basis @ B
        return AffineBall(whole @ U.T, mean + basis @ center)

    @staticmethod
    def MakeAxisAligned(radius: ArrayLike, center: ArrayLike) -> AffineBall:
        """Returns an ellipsoid along the axes.

        Raises:
            RuntimeError: a radius is negative.
        """
        radius = _arrays.float_vector(radius)
        if np.any(radius < 0.0) or not np.isfinite(radius).all():
            raise RuntimeError(f"MakeAxisAligned(): radii must be finite and not negative, got {radius}.")
        return AffineBall(np.diag(radius), center)

    @staticmethod
    def MakeHypersphere(radius: float, center: ArrayLike) -> AffineBall:
        """Returns a ball."""
        return AffineBall.MakeAxisAligned(np.full(np.size(center), float(radius)), center)

    @staticmethod
    def MakeUnitBall(dim: int) -> AffineBall:
        """Returns the unit ball about the origin."""
        return AffineBall(np.eye(dim), np.zeros(dim))

    @staticmethod
    def MakeAffineBallFromLineSegment(x_1: ArrayLike, x_2: ArrayLike, epsilon: float = 1e-3) -> AffineBall:
        """Returns an ellipsoid whose longest axis is a line segment, and whose others have radius epsilon.

        Raises:
            RuntimeError: the segment is no longer than epsilon, or epsilon is negative.
        """
        x_1, x_2 = _arrays.float_vector(x_1), _arrays.float_vector(x_2)
        axis = x_1 - x_2
        length = float(np.linalg.norm(axis))
        if not 0.0 <= epsilon < length:
            raise RuntimeError(
                f"MakeAffineBallFromLineSegment(): epsilon {epsilon} must be from zero to the length {length}."
            )
        U = _orthonormal(axis / length)
        radii = np.full(axis.size, float(epsilon))
        radii[0] = 0.5 * length
        return AffineBall(U * radii, 0.5 * (x_1 + x_2))

    def B(self) -> np.ndarray:
        """Returns B, shape (n, n), read-only."""
        return frozen(self._B.copy())

    def center(self) -> np.ndarray:
        """Returns the center, shape (n,), read-only."""
        return frozen(self._center.copy())

    def _contain(self, into: Rows, x: Affine, scale: Affine) -> None:
        u = into.new(self._dimension, "y")
        into.equal(self._B @ u - x + scale.times(self._center))
        into.nonnegative(scale)
        into.lorentz(scale.stacked(u))

    def _contains(self, x: np.ndarray, tol: float) -> bool:
        d = x - self._center
        u = np.linalg.lstsq(self._B, d, rcond=None)[0] if self._inverse is None else self._inverse.dot(d)
        near = (np.abs(self._B.dot(u) - d) <= tol).all()
        return bool(near and u.dot(u) <= (1.0 + tol) ** 2)

    def _extent(self, direction: np.ndarray) -> float:
        return float(direction @ self._center + np.linalg.norm(self._B.T @ direction))

    def _bounded(self) -> bool:
        return True

    def _point(self) -> np.ndarray | None:
        return None if self._B.any() else self._center.copy()

    def _some_point(self) -> np.ndarray:
        return self._center.copy()

    def _affine_hull(self, tol: float) -> tuple[np.ndarray, np.ndarray]:
        return column_space(self._B, tol), self._center.copy()

    def _volume(self) -> float:
        return abs(np.linalg.det(self._B)) * _volume_of_unit_ball(self._dimension)

    def _shape(self) -> tuple[Shape, RigidTransform]:
        return Hyperellipsoid(self)._shape()


@checked
class Hyperellipsoid(ConvexSet):
    """(x - center)' A'A (x - center) <= 1; may be unbounded, but is not empty.

    Made as `()`; `(A, center)`; `(query_object, geometry_id, reference_frame=None)` of a sphere or an ellipsoid; or
    `(ellipsoid)` of an AffineBall that is not flat.

    Raises:
        RuntimeError: sizes differ, the shape is none of these, or the AffineBall is flat.
    """

    _has_volume = True

    @typing_overload
    def __init__(self) -> None: ...
    @typing_overload
    def __init__(self, A: ArrayLike, center: ArrayLike) -> None: ...
    @typing_overload
    def __init__(
        self, query_object: QueryObject, geometry_id: GeometryId, reference_frame: FrameId | None = None
    ) -> None: ...
    @typing_overload
    def __init__(self, ellipsoid: AffineBall) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any):
        dispatch("Hyperellipsoid", _WAYS, self, args, kwargs)

    def _set(self, A: np.ndarray, center: np.ndarray) -> None:
        _check_square("Hyperellipsoid", A, center)
        self._A, self._center, self._dimension = np.array(A), np.array(center), center.size

    def _set_of_geometry(self, at: Placed) -> None:
        if isinstance(at.shape, Sphere):
            radii = np.full(3, at.shape.radius())
        elif isinstance(at.shape, Ellipsoid):
            radii = np.array([at.shape.a(), at.shape.b(), at.shape.c()])
        else:
            raise unsupported(Hyperellipsoid, at.shape)
        self._set(np.diag(1.0 / radii) @ at.R_FG.T, at.p_FG)

    def _set_of_ball(self, ball: AffineBall) -> None:
        B = ball.B()
        if B.size and np.linalg.matrix_rank(B) < len(B):
            raise RuntimeError("Hyperellipsoid(): the AffineBall must not be flat: its B is not invertible.")
        self._set(np.linalg.inv(B) if B.size else B, ball.center())

    @staticmethod
    def MinimumVolumeCircumscribedEllipsoid(points: ArrayLike, rank_tol: float = 1e-6) -> Hyperellipsoid:
        """Returns the least ellipsoid around points, columns.

        Raises:
            RuntimeError: the points are in a plane, up to `rank_tol`, or not finite.
        """
        points = _arrays.float_matrix(points)
        s = np.linalg.svd(points - points.mean(axis=1)[:, None], compute_uv=False)
        if s.size < points.shape[0] or s[-1] <= rank_tol * s[0]:
            raise RuntimeError(
                "MinimumVolumeCircumscribedEllipsoid(): the points are in a plane; an AffineBall can be flat."
            )
        return Hyperellipsoid(AffineBall.MinimumVolumeCircumscribedEllipsoid(points, rank_tol))

    @staticmethod
    def MakeAxisAligned(radius: ArrayLike, center: ArrayLike) -> Hyperellipsoid:
        """Returns an ellipsoid along the axes.

        Raises:
            RuntimeError: a radius is not positive.
        """
        radius = _arrays.float_vector(radius)
        if np.any(radius <= 0.0):
            raise RuntimeError(f"MakeAxisAligned(): radii must be positive, got {radius}.")
        return Hyperellipsoid(np.diag(1.0 / radius), center)

    @staticmethod
    def MakeHypersphere(radius: float, center: ArrayLike) -> Hyperellipsoid:
        """Returns a ball."""
        return Hyperellipsoid.MakeAxisAligned(np.full(np.size(center), float(radius)), center)

    @staticmethod
    def MakeUnitBall(dim: int) -> Hyperellipsoid:
        """Returns the unit ball about the origin."""
        return Hyperellipsoid(np.eye(dim), np.zeros(dim))

    def A(self) -> np.ndarray:
        """Returns A, shape (m, n)."""
        return self._A.copy()

    def center(self) -> np.ndarray:
        """Returns the center, shape (n,)."""
        return self._center.copy()

    def MinimumUniformScalingToTouch(self, other: ConvexSet) -> tuple[float, np.ndarray]:
        """Returns by which factor it has to be scaled to just reach another set, and where.

        Raises:
            RuntimeError: the other set is empty, or in a space of another dimension or none.
        """
        self._require_dimensions("MinimumUniformScalingToTouch")
        self._same_space("MinimumUniformScalingToTouch", other)
        # The norm is as its square at its least; near zero the square is blunt, so that the norm is taken there.
        point = other._least_scaled(self._A, self._center)
        if point is None:
            prog, x = other._program()
            prog.AddQuadraticErrorCost(self._A.T @ self._A, self._center, x)
            point = programs.solved("MinimumUniformScalingToTouch", prog, " Is the other set empty?").GetSolution(x)
        return float(np.linalg.norm(self._A @ (point - self._center))), point

    def _contain(self, into: Rows, x: Affine, scale: Affine) -> None:
        into.nonnegative(scale)
        into.lorentz(scale.stacked(self._A @ (x - scale.times(self._center))))

    def _least_scaled(self, A: np.ndarray, center: np.ndarray) -> np.ndarray | None:
        if self._A.shape != (self._dimension, self._dimension):
            return None
        return _nearest_of_ellipsoid(self._A, self._center, A, center)

    def _meets(self, other: ConvexSet) -> bool | None:
        x = other._least_scaled(self._A, self._center)
        return None if x is None else bool(np.linalg.norm(self._A @ (x - self._center)) <= 1.0 + _TOUCHES)

    def _contains_quickly(self, x: ArrayLike, tol: float) -> bool | None:
        return _inside(self._A.ravel(), self._center, x, tol)

    def _contains(self, x: np.ndarray, tol: float) -> bool:
        e = self._A @ (x - self._center)
        return bool(e @ e <= 1.0 + tol)

    def _bounded(self) -> bool:
        return bool(np.linalg.matrix_rank(self._A) == self._A.shape[1])

    def _some_point(self) -> np.ndarray:
        return self._center.copy()

    def _affine_hull(self, tol: float) -> tuple[np.ndarray, np.ndarray]:
        return np.eye(self._dimension), self._center.copy()

    def _volume(self) -> float:
        if not self._bounded():
            return np.inf
        return _volume_of_unit_ball(self._dimension) / math.sqrt(np.linalg.det(self._A.T @ self._A))

    def _shape(self) -> tuple[Shape, RigidTransform]:
        squares, R = np.linalg.eigh(self._A.T @ self._A)
        if np.linalg.det(R) < 0.0:
            R[:, 0] = -R[:, 0]
        return Ellipsoid(*(1.0 / np.sqrt(squares))), RigidTransform(RotationMatrix(R), self._center)


_WAYS = Ways(
    [
        overload(lambda self: self._set(np.zeros((0, 0)), np.zeros(0))),
        overload(Hyperellipsoid._set, A=_arrays.float_matrix, center=_arrays.float_vector),
        geometry_overload(Hyperellipsoid._set_of_geometry),
        overload(Hyperellipsoid._set_of_ball, ellipsoid=instance_of(AffineBall)),
    ]
)
_WAYS_OF_BALLS = Ways(
    [
        overload(lambda self: self._set(np.zeros((0, 0)), np.zeros(0))),
        overload(AffineBall._set, B=_arrays.float_matrix, center=_arrays.float_vector),
        overload(AffineBall._set_of_form, ellipsoid=instance_of(Hyperellipsoid)),
    ]
)


def _nearest_of_ellipsoid(A: np.ndarray, center: np.ndarray, S: np.ndarray, from_: np.ndarray) -> np.ndarray | None:
    """The x with |A (x - center)| <= 1 and the least |S (x - from_)|; None where A is not invertible.

    With z = A (x - center), |M z - g| is to be least in the unit ball, M = S A^-1 and g = S (from_ - center): in
    singular vectors of M, z_i = s_i g_i / (s_i^2 + l) for the l >= 0 at which |z| = 1, or l = 0 if |z| <= 1 there. The
    root of 1 / |z(l)| - 1 is found by Newton's method from below, where it does not overshoot (J. J. More and D. C.
    Sorensen, "Computing a trust region step", 1983).
    """
    try:
        inverse = np.linalg.inv(A)
    except np.linalg.LinAlgError:
        return None
    if not np.linalg.norm(A @ inverse - np.eye(len(A))) <= _INVERTED:
        return None
    U, s, Vt = np.linalg.svd(S @ inverse, full_matrices=False)
    along, squares = s * (U.T @ (S @ (from_ - center))), s * s
    multiplier, moved = 0.0, squares > _FLAT * squares.max(initial=0.0)
    along, squares, Vt = along[moved], squares[moved], Vt[moved]
    for _ in range(_MOST_ROUNDS):
        z = along / (squares + multiplier)
        length = math.sqrt(z @ z)
        if length <= 1.0 + _ROUNDING:
            return center + inverse @ (Vt.T @ z)
        slope = z @ (z / (squares + multiplier))
        multiplier += (length - 1.0) * length * length / slope
    return None


def _circumscribed(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """B and center of the least B u + center, |u| <= 1, around points: max log det A, |A p + b| <= 1.

    S. Boyd and L. Vandenberghe, "Convex Optimization", 2004, section 8.4.1.
    """
    n = points.shape[0]
    size = max(np.abs(points).max(), 1e-300)
    prog = MathematicalProgram()
    A = prog.NewSymmetricContinuousVariables(n, "A")
    b = prog.NewContinuousVariables(n, "b")
    prog.AddMaximizeLogDeterminantCost(A)
    into = Rows(prog)
    for p in points.T / size:
        moved = Affine([(np.kron(np.eye(n), p), A.ravel())], np.zeros(n)) + Affine.of(b)
        into.lorentz(Affine.constant(1.0).stacked(moved))
    result = programs.solved("MinimumVolumeCircumscribedEllipsoid", prog)
    B = np.linalg.inv(np.array(result.GetSolution(A), dtype=float))
    return size * B, -size * (B @ result.GetSolution(b))


_inside = quick.short_way(globals(), "_inside", inside_ellipsoid, quick.ANY, quick.ANY, quick.ANY, float, gives=bool)
