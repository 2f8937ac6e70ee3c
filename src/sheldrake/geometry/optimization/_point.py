"""One point as a set."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common import quick
from sheldrake.common._checked import checked
from sheldrake.common._overloads import Ways, dispatch, overload
from sheldrake.geometry._shapes import Sphere
from sheldrake.geometry.optimization import _polyhedron_programs as programs
from sheldrake.geometry.optimization._affine import Affine, Rows
from sheldrake.geometry.optimization._convex_set import ConvexSet
from sheldrake.geometry.optimization._from_geometry import Placed, geometry_overload, unsupported
from sheldrake.math import RigidTransform
from sheldrake.solvers import _arrays
from sheldrake.solvers._kernels.inside import inside_box

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.geometry._ids import FrameId, GeometryId
    from sheldrake.geometry._query.query_object import QueryObject
    from sheldrake.geometry._shapes import Shape


@checked
class Point(ConvexSet):
    """A single point.

    Made as `()`, a point without coordinates; `(x)`; or `(query_object, geometry_id, reference_frame=None,
    maximum_allowable_radius=0)` from a sphere no larger than that.
    """

    _has_volume = True

    @typing_overload
    @checked
    def __init__(self) -> None: ...
    @typing_overload
    @checked
    def __init__(self, x: ArrayLike) -> None: ...
    @typing_overload
    @checked
    def __init__(
        self,
        query_object: QueryObject,
        geometry_id: GeometryId,
        reference_frame: FrameId | None = None,
        maximum_allowable_radius: float = 0.0,
    ) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any):
        dispatch("Point", _WAYS, self, args, kwargs)

    def _set_of_sphere(self, at: Placed, maximum: float) -> None:
        if not isinstance(at.shape, Sphere):
            raise unsupported(Point, at.shape)
        if at.shape.radius() > maximum:
            raise RuntimeError(
                f"Point: the sphere's radius {at.shape.radius()} is larger than the maximum_allowable_radius {maximum}."
            )
        self.set_point(at.p_FG)

    def set_point(self, x: np.ndarray) -> None:
        self._x, self._dimension = x, x.size

    def x(self) -> np.ndarray:
        """Returns the point, shape (n,)."""
        return self._x.copy()

    def set_x(self, x: ArrayLike) -> None:
        """Moves the point.

        Raises:
            RuntimeError: the new one has another dimension.
        """
        x = _arrays.float_vector(x)
        if x.size != self._dimension:
            raise RuntimeError(f"set_x(): the point has {x.size} coordinates, expected {self._dimension}.")
        self._x = x

    def _contain(self, into: Rows, x: Affine, scale: Affine) -> None:
        if scale.is_one():
            into.between(self._x, x, self._x)
        else:
            into.equal(x - scale.times(self._x))
            into.nonnegative(scale)

    def _contains_quickly(self, x: ArrayLike, tol: float) -> bool | None:
        return _inside(self._x, self._x, x, tol)

    def _contains(self, x: np.ndarray, tol: float) -> bool:
        return bool((np.abs(x - self._x) <= tol).all())

    def _bounded(self) -> bool:
        return True

    def _point(self) -> np.ndarray:
        return self._x.copy()

    _some_point = _point

    def _faces(self) -> tuple[np.ndarray, np.ndarray]:
        return programs.box_rows(self._x, self._x)

    def _extent(self, direction: np.ndarray) -> float:
        return float(direction @ self._x)

    def _volume(self) -> float:
        return 0.0

    def _shape(self) -> tuple[Shape, RigidTransform]:
        return Sphere(0.0), RigidTransform(self._x)


_WAYS = Ways(
    [
        overload(lambda self: self.set_point(np.zeros(0))),
        overload(Point.set_point, x=_arrays.float_vector),
        geometry_overload(Point._set_of_sphere, maximum_allowable_radius=(_arrays.number, 0.0)),
    ]
)

_inside = quick.short_way(globals(), "_inside", inside_box, quick.ANY, quick.ANY, quick.ANY, float, gives=bool)
