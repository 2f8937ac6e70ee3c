"""Polytopes by vertices."""

from __future__ import annotations

import pathlib
from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Ways, dispatch, overload
from sheldrake.geometry._shapes import Convex
from sheldrake.geometry.optimization import _polyhedron_programs as programs
from sheldrake.geometry.optimization._affine import Affine, Rows
from sheldrake.geometry.optimization._affine_subspace import AffineSubspace, column_space
from sheldrake.geometry.optimization._convex_set import ConvexSet, checked_box
from sheldrake.geometry.optimization._from_geometry import box_vertices, corners, geometry_overload
from sheldrake.geometry.optimization._hulls import extreme_points, vertices_of, volume
from sheldrake.math import RigidTransform
from sheldrake.solvers import _arrays

if TYPE_CHECKING:
    from os import PathLike

    from numpy.typing import ArrayLike

    from sheldrake.geometry._ids import FrameId, GeometryId
    from sheldrake.geometry._query.query_object import QueryObject
    from sheldrake.geometry._shapes import Shape
    from sheldrake.geometry.optimization import HPolyhedron


def _polyhedron(value: Any) -> HPolyhedron:
    if type(value).__name__ != "HPolyhedron":
        raise _arrays.Mismatch
    return value


class VPolytope(ConvexSet):
    """The convex hull of points.

    Made as `()`, which is empty; `(vertices)`, columns; `(H, tol=1e-9)` of a bounded HPolyhedron, which may be flat; or
    `(query_object, geometry_id, reference_frame=None)` of a box or a convex hull.

    Raises:
        RuntimeError: the HPolyhedron is unbounded, or the shape is none of these.
    """

    _has_volume = True

    @typing_overload
    @checked
    def __init__(self) -> None: ...
    @typing_overload
    @checked
    def __init__(self, vertices: ArrayLike) -> None: ...
    @typing_overload
    @checked
    def __init__(self, H: HPolyhedron, tol: float = 1e-9) -> None: ...
    @typing_overload
    @checked
    def __init__(
        self, query_object: QueryObject, geometry_id: GeometryId, reference_frame: FrameId | None = None
    ) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any):
        dispatch("VPolytope", _WAYS, self, args, kwargs)

    def _set(self, vertices: np.ndarray) -> None:
        self._vertices, self._dimension = np.array(vertices), vertices.shape[0]

    def _set_of_half_spaces(self, H: HPolyhedron, tol: float) -> None:
        if not H.IsBounded():
            raise RuntimeError("VPolytope(): the HPolyhedron is not bounded.")
        n = H.ambient_dimension()
        center = H._inside(tol)
        if center is not None:
            self._set(vertices_of(H._A, H._b, center))  # it has an inside: no need to look for its affine hull
            return
        if n == 0 or H.IsEmpty():
            self._set(np.zeros((n, 0)))
            return
        flat = AffineSubspace(H, tol)
        basis, start = flat.basis(), flat.translation()
        if not basis.shape[1]:
            self._set(start.reshape(-1, 1))
            return
        A, b = H._A @ basis, H._b - H._A @ start
        bounds = np.linalg.norm(A, axis=1) > 1e-9 * np.maximum(1.0, np.linalg.norm(H._A, axis=1))
        A, b = A[bounds], b[bounds]
        local = type(H)(A, b)
        self._set(basis @ vertices_of(A, b, local.ChebyshevCenter()) + start[:, None])

    @staticmethod
    @checked
    def MakeBox(lb: ArrayLike, ub: ArrayLike) -> VPolytope:
        """Returns the corners of lb <= x <= ub.

        Raises:
            RuntimeError: a lower bound is above its upper bound.
        """
        return VPolytope(box_vertices(*checked_box("MakeBox", lb, ub)))

    @staticmethod
    def MakeUnitBox(dim: int) -> VPolytope:
        """Returns the corners of -1 <= x <= 1."""
        return VPolytope.MakeBox(-np.ones(dim), np.ones(dim))

    def vertices(self) -> np.ndarray:
        """Returns the vertices, shape (n, number of them)."""
        return self._vertices.copy()

    @checked
    def GetMinimalRepresentation(self, tol: float = 1e-9) -> VPolytope:
        """Returns it without points that are no corners; in the plane, corners go counter-clockwise.

        Args:
            tol: How thin it may be and still count as flat.
        """
        return VPolytope(extreme_points(self._vertices, tol))

    @checked
    def ToShapeConvex(self, convex_label: str = "convex_from_vpolytope") -> Convex:
        """Returns it as a shape.

        Raises:
            RuntimeError: it is not in space.
        """
        if self._dimension != 3:
            raise RuntimeError(f"ToShapeConvex(): the polytope is in {self._dimension} dimensions, expected 3.")
        return Convex(points=self._vertices, label=convex_label)

    @checked
    def WriteObj(self, filename: PathLike | str) -> None:
        """Writes it as an OBJ mesh.

        Raises:
            RuntimeError: it is not in space.
        """
        from sheldrake.geometry._meshes.convex_hull import make_convex_hull

        if self._dimension != 3:
            raise RuntimeError(f"WriteObj(): the polytope is in {self._dimension} dimensions, expected 3.")
        hull = make_convex_hull(self._vertices.T)
        lines = ["v {} {} {}".format(*hull.vertex(i)) for i in range(hull.num_vertices())]
        for e in range(hull.num_elements()):
            face = hull.element(e)
            lines.append("f " + " ".join(str(face.vertex(i) + 1) for i in range(face.num_vertices())))
        pathlib.Path(filename).write_text("\n".join(lines) + "\n", encoding="utf-8")

    def _contain(self, into: Rows, x: Affine, scale: Affine) -> None:
        count = self._vertices.shape[1]
        if not count:
            into.equal(np.zeros((len(x), len(x))) @ x + Affine.constant(np.ones(len(x))))
            return
        weights = into.new(count, "a")
        into.equal(self._vertices @ weights - x)
        into.equal(np.ones((1, count)) @ weights - scale)
        into.between(np.zeros(count), weights, np.full(count, 1.0 if scale.is_one() else np.inf))
        into.nonnegative(scale)

    def _contains(self, x: np.ndarray, tol: float) -> bool | None:
        if self._empty():
            return False
        if not (np.isfinite(x).all() and np.isfinite(self._vertices).all()):
            return None
        distance = programs.distance_to_hull(self._vertices, x)
        return None if np.isnan(distance) else distance <= tol

    def _corners(self) -> np.ndarray | None:
        known = not self._empty() and np.isfinite(self._vertices).all()
        return self._vertices if known else None

    def _least_scaled(self, A: np.ndarray, center: np.ndarray) -> np.ndarray | None:
        return programs.nearest_of_hull(self._vertices, A, center)

    def _empty(self) -> bool:
        return self._vertices.shape[1] == 0

    def _bounded(self) -> bool:
        return True

    def _extent(self, direction: np.ndarray) -> float:
        if self._empty():
            raise RuntimeError("VPolytope: an empty set has no extent.")
        return float((direction @ self._vertices).max())

    def _point(self) -> np.ndarray | None:
        if self._empty() or np.any(self._vertices != self._vertices[:, :1]):
            return None
        return self._vertices[:, 0].copy()

    def _some_point(self) -> np.ndarray | None:
        return None if self._empty() else self._vertices[:, 0].copy()

    def _affine_hull(self, tol: float) -> tuple[np.ndarray, np.ndarray] | None:
        if self._empty():
            return None
        start = self._vertices[:, 0]
        return column_space(self._vertices - start[:, None], tol), start

    def _volume(self) -> float:
        return volume(self._vertices, 1e-12)

    def _shape(self) -> tuple[Shape, RigidTransform]:
        return self.ToShapeConvex(), RigidTransform()


_WAYS = Ways(
    [
        overload(lambda self: self._set(np.zeros((0, 0)))),
        overload(VPolytope._set, vertices=_arrays.float_matrix),
        overload(VPolytope._set_of_half_spaces, H=_polyhedron, tol=(_arrays.number, 1e-9)),
        geometry_overload(lambda self, at: self._set(corners(VPolytope, at))),
    ]
)
