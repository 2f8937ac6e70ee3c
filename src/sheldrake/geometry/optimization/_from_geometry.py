"""Shapes of a SceneGraph as arguments of sets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import Mismatch, Overload, overload
from sheldrake.geometry._ids import FrameId, GeometryId
from sheldrake.geometry._shapes import Box, Convex, Mesh

if TYPE_CHECKING:
    from sheldrake.geometry import Shape
    from sheldrake.geometry._query.query_object import QueryObject


class Placed(NamedTuple):
    """A shape, its rotation and its place in a frame F."""

    shape: Any
    R_FG: np.ndarray
    p_FG: np.ndarray


def placed(query_object: QueryObject, geometry_id: GeometryId, reference_frame: FrameId | None) -> Placed:
    """A geometry's shape and pose in a frame; in the world if there is none."""
    X_FG = query_object.GetPoseInWorld(geometry_id)
    if reference_frame is not None:
        X_FG = query_object.GetPoseInWorld(reference_frame).inverse() @ X_FG
    return Placed(query_object.inspector().GetShape(geometry_id), X_FG.rotation().matrix(), X_FG.translation())


def _query(value: Any) -> QueryObject:
    if not hasattr(value, "inspector"):
        raise Mismatch
    return value


def _frame(value: object) -> FrameId | None:
    if value is not None and not isinstance(value, FrameId):
        raise Mismatch
    return value


def geometry_overload(function: Any, **more: Any) -> Overload:
    """The way to make a set of a geometry: `(query_object, geometry_id, reference_frame=None)`."""

    def make(
        self: Any, query_object: QueryObject, geometry_id: GeometryId, reference_frame: FrameId | None, *rest: Any
    ) -> None:
        function(self, placed(query_object, geometry_id, reference_frame), *rest)

    kinds = {"query_object": _query, "geometry_id": instance_of(GeometryId), "reference_frame": (_frame, None)}
    return overload(make, **kinds, **more)


def unsupported(cls: type, shape: Shape) -> RuntimeError:
    """The error for a shape that is no set of a kind."""
    return RuntimeError(f"{cls.__name__} does not support {type(shape).__name__}.")


def corners(cls: type, at: Placed) -> np.ndarray:
    """Vertices in F of a box or of a convex hull, shape (3, n).

    Raises:
        RuntimeError: the shape has none.
    """
    if isinstance(at.shape, Box):
        p_GV = box_vertices(-0.5 * at.shape.size(), 0.5 * at.shape.size())
    elif isinstance(at.shape, (Convex, Mesh)):
        hull = at.shape.GetConvexHull()
        p_GV = np.column_stack([hull.vertex(i) for i in range(hull.num_vertices())])
    else:
        raise unsupported(cls, at.shape)
    return at.R_FG @ p_GV + at.p_FG[:, None]


def box_vertices(lb: np.ndarray, ub: np.ndarray) -> np.ndarray:
    """Corners of a box, the first coordinate changing fastest; shape (n, 2^n)."""
    n = lb.size
    bits = (np.arange(2**n)[None, :] >> np.arange(n)[:, None]) & 1
    return np.where(bits == 1, ub[:, None], lb[:, None])
