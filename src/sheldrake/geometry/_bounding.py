"""Bounding boxes and planes, and whether they overlap.

What `CalcObb`, `CalcAabb` and their users see; the search for contacts has its own bounds, in its kernels.
"""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import Mismatch, kind, overload, overloaded
from sheldrake.common._scalars import frozen
from sheldrake.geometry._meshes.triangle_mesh import TriangleSurfaceMesh
from sheldrake.geometry._meshes.volume_mesh import VolumeMesh
from sheldrake.geometry._numbers import as_numbers, lengths, plain
from sheldrake.geometry._shape_types import type_of
from sheldrake.geometry._shapes import HalfSpace, Shape
from sheldrake.math import RigidTransform, RotationMatrix

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sheldrake.common._types import Scalars

_PARALLEL = 1e-10  # added to cross products' projections: parallel edges separate nothing


def _vector(x: Scalars) -> np.ndarray:
    return as_numbers(x).reshape(3)


def _boxes_overlap(half_A: np.ndarray, half_B: np.ndarray, X_AB: RigidTransform) -> bool:
    """Separating axis test of two boxes whose centres and axes are frames A and B (Gottschalk 1996)."""
    R, p = X_AB.rotation().matrix(), X_AB.translation()
    R_abs = np.abs(R) + _PARALLEL
    if np.any(np.abs(p) > half_A + R_abs @ half_B) or np.any(np.abs(R.T @ p) > half_B + R_abs.T @ half_A):
        return False
    for i in range(3):
        for j in range(3):
            i1, i2, j1, j2 = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
            reach = half_A[i1] * R_abs[i2, j] + half_A[i2] * R_abs[i1, j]
            reach += half_B[j1] * R_abs[i, j2] + half_B[j2] * R_abs[i, j1]
            if abs(p[i2] * R[i1, j] - p[i1] * R[i2, j]) > reach:
                return False
    return True


@checked
class Plane:
    """A plane in a frame F.

    Args:
        normal: its normal in F, any length.
        point_on_plane: a point on it, in F [m].
        already_normalized: the normal has length one.

    Raises:
        RuntimeError: the normal is (nearly) zero, or not of length one though said to be.
    """

    def __init__(self, normal: Scalars, point_on_plane: Scalars, already_normalized: bool = False) -> None:
        n_F = _vector(normal)
        length = plain(lengths(n_F))
        if already_normalized:
            if abs(length - 1.0) > 1e-8:
                raise RuntimeError(f"Plane(): the normal was declared normalized, but its length is {length}.")
        elif not length >= 1e-10:
            raise RuntimeError(
                f"Cannot instantiate plane from normal n_F = {n_F.tolist()}; its magnitude is too small: {length}"
            )
        else:
            n_F = n_F / length
        self._normal, self._height = n_F, n_F @ _vector(point_on_plane)

    def unit_normal(self) -> np.ndarray:
        """Unit normal in F, shape (3,), read-only."""
        return frozen(self._normal.copy())

    def reference_point(self) -> np.ndarray:
        """The plane's point nearest to the origin of F [m], shape (3,), read-only."""
        return frozen(self._normal * self._height)

    def CalcHeight(self, point: Scalars) -> float:
        """Signed height of a point above the plane [m]."""
        return plain(self._normal @ _vector(point) - self._height)

    def BoxOverlaps(
        self, half_width: Scalars, box_center_in_plane: Scalars, box_orientation_in_plane: RotationMatrix
    ) -> bool:
        """True if a box, given by half sizes and pose in F, meets the plane."""
        reach = np.abs(box_orientation_in_plane.matrix().T @ self._normal) @ _vector(half_width)
        return bool(abs(self.CalcHeight(box_center_in_plane)) <= reach)

    def __copy__(self) -> Plane:
        return Plane(self._normal, self.reference_point(), True)

    def __deepcopy__(self, memo: dict) -> Plane:
        return copy.copy(self)


@kind("Aabb | Obb")
def _box(value: Any) -> _Bounds:
    if not isinstance(value, _Bounds):
        raise Mismatch
    return value


@kind("Aabb | Obb | HalfSpace | Plane")
def _obstacle(value: Any) -> Any:
    if not isinstance(value, (_Bounds, HalfSpace, Plane)):
        raise Mismatch
    return value


# Names of the arguments of `HasOverlap`.
_OVERLAPS = tuple(
    overload(**dict(zip(names, (_box, _obstacle, instance_of(RigidTransform)))))
    for names in (
        ("a_G", "b_H", "X_GH"),
        ("aabb_G", "obb_H", "X_GH"),
        ("obb_G", "aabb_H", "X_GH"),
        ("bv_H", "hs_C", "X_CH"),
        ("bv_H", "plane_P", "X_PH"),
    )
)


@checked
class _Bounds:
    """What both kinds of boxes share; B is the box's frame, H the hierarchy's."""

    _half_width: np.ndarray

    def pose(self) -> RigidTransform:
        """The box's pose X_HB."""
        raise NotImplementedError

    def center(self) -> np.ndarray:
        """Centre in H [m], shape (3,), read-only."""
        return frozen(self.pose().translation().copy())

    def half_width(self) -> np.ndarray:
        """Half sizes along the box's axes [m], shape (3,), read-only."""
        return frozen(self._half_width.copy())

    def CalcVolume(self) -> float:
        """Volume [m^3]."""
        return float(8.0 * np.prod(self._half_width))

    @staticmethod
    @overloaded(*_OVERLAPS)
    def HasOverlap(a: Aabb | Obb, b: Aabb | Obb, X: RigidTransform) -> bool:
        """True if a bounding box and another one, a HalfSpace or a Plane overlap.

        Called as `(a_G, b_H, X_GH)` for two boxes, `(bv_H, hs_C, X_CH)` for a half space, `(bv_H, plane_P, X_PH)`;
        by name, boxes of different kinds are `aabb_G`, `obb_G`, `aabb_H`, `obb_H`.
        """
        if isinstance(b, (HalfSpace, Plane)):
            X_FB = X @ a.pose()
            if isinstance(b, Plane):
                return b.BoxOverlaps(a._half_width, X_FB.translation(), X_FB.rotation())
            reach = np.abs(X_FB.rotation().matrix()[2]) @ a._half_width
            return bool(X_FB.translation()[2] <= reach)
        X_AB = a.pose().inverse() @ X @ b.pose()
        return _boxes_overlap(a._half_width, b._half_width, X_AB)


@checked
class Aabb(_Bounds):
    """A box along the axes of its hierarchy's frame H."""

    def __init__(self, p_HoBo: Scalars, half_width: Scalars) -> None:
        self._center, self._half_width = _vector(p_HoBo), _vector(half_width)
        _check_half_width("Aabb", self._half_width)

    def pose(self) -> RigidTransform:
        """The box's pose X_HB, a translation."""
        return RigidTransform(self._center)

    def lower(self) -> np.ndarray:
        """Smallest coordinates in H [m], shape (3,)."""
        return self._center - self._half_width

    def upper(self) -> np.ndarray:
        """Largest coordinates in H [m], shape (3,)."""
        return self._center + self._half_width

    def Equal(self, other: Aabb) -> bool:
        """True if both boxes are the same, bit for bit."""
        return bool(np.all(self._center == other._center) and np.all(self._half_width == other._half_width))

    def __copy__(self) -> Aabb:
        return Aabb(self._center, self._half_width)

    def __deepcopy__(self, memo: dict) -> Aabb:
        return copy.copy(self)


@checked
class Obb(_Bounds):
    """A box in any pose in its hierarchy's frame H."""

    def __init__(self, X_HB: RigidTransform, half_width: Scalars) -> None:
        self._pose, self._half_width = copy.copy(X_HB), _vector(half_width)
        _check_half_width("Obb", self._half_width)

    def pose(self) -> RigidTransform:
        return copy.copy(self._pose)

    def _moved(self, X_AH: RigidTransform) -> Obb:
        """The same box in another frame A."""
        new = object.__new__(Obb)
        new._pose, new._half_width = X_AH @ self._pose, self._half_width
        return new

    def Equal(self, other: Obb) -> bool:
        """True if both boxes are the same, bit for bit."""
        return bool(self._pose.IsExactlyEqualTo(other._pose) and np.all(self._half_width == other._half_width))

    def __copy__(self) -> Obb:
        new = object.__new__(Obb)
        new._pose, new._half_width = self._pose, self._half_width  # neither is given away, nor changes
        return new

    def __deepcopy__(self, memo: dict) -> Obb:
        return self.__copy__()


def _check_half_width(name: str, half_width: np.ndarray) -> None:
    if not np.all(half_width >= 0.0):
        raise RuntimeError(f"{name}(): half_width must not be negative, got {half_width.tolist()}.")


def bounding_box(shape: Shape) -> Obb | None:
    """`CalcObb` of a shape, which keeps its box as it does not change."""
    if shape._box is None:
        shape._box = CalcObb(shape)
    return shape._box


@checked
def CalcObb(shape: Shape) -> Obb | None:
    """A bounding box of a shape in its frame; None for a half space.

    Boxes of meshes have their axes along the principal directions of the hull's vertices.

    Raises:
        RuntimeError: a mesh file that can not be read.
    """
    if isinstance(shape, HalfSpace):
        return None
    row = type_of(shape)
    if row.hull is not None:
        return _obb_of_points(row.hull(shape)._vertices)
    if row.box is not None:
        return Obb(RigidTransform(np.array(row.middle(shape))), row.box(shape))
    raise NotImplementedError(f"CalcObb(): no bounding box for {shape!r}.")


def _obb_of_points(points: np.ndarray) -> Obb:
    """The smaller of the axis-aligned box and the box along the principal directions."""
    candidates = [np.eye(3)]
    if len(points) > 1:
        _, _, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=True)
        R = axes.T.copy()
        R[:, 2] = np.cross(R[:, 0], R[:, 1])
        candidates.append(R)
    boxes = []
    for R in candidates:
        local = points @ R
        low, high = local.min(axis=0), local.max(axis=0)
        boxes.append((float(np.prod(high - low)), R, (low + high) / 2.0, (high - low) / 2.0))
    _, R, centre, half = min(boxes, key=lambda box: box[0])
    return Obb(RigidTransform(RotationMatrix(R), R @ centre), half)


def _chosen(mesh: TriangleSurfaceMesh | VolumeMesh, vertices: Iterable[int]) -> np.ndarray:
    return mesh._vertices[sorted(vertices)]


@checked
def ComputeAabbForTriangleMesh(mesh_M: TriangleSurfaceMesh, vertices: Iterable[int]) -> Aabb:
    """The axis-aligned box of some vertices (a set of numbers) of a mesh."""
    points = _chosen(mesh_M, vertices)
    low, high = points.min(axis=0), points.max(axis=0)
    return Aabb((low + high) / 2.0, (high - low) / 2.0)


@checked
def ComputeAabbForVolumeMesh(mesh_M: VolumeMesh, vertices: Iterable[int]) -> Aabb:
    """The axis-aligned box of some vertices (a set of numbers) of a mesh."""
    return ComputeAabbForTriangleMesh(mesh_M, vertices)  # type: ignore[arg-type]


@checked
def ComputeObbForTriangleMesh(mesh_M: TriangleSurfaceMesh, vertices: Iterable[int]) -> Obb:
    """A box in any orientation about some vertices (a set of numbers) of a mesh."""
    return _obb_of_points(_chosen(mesh_M, vertices))


@checked
def ComputeObbForVolumeMesh(mesh_M: VolumeMesh, vertices: Iterable[int]) -> Obb:
    """A box in any orientation about some vertices (a set of numbers) of a mesh."""
    return _obb_of_points(_chosen(mesh_M, vertices))
