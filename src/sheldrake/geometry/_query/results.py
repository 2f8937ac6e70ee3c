"""What geometry queries report."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._overloads import Mismatch
from sheldrake.geometry._ids import GeometryId

if TYPE_CHECKING:
    from typing_extensions import Self


_new = object.__new__


class _Result:
    """Fields with defaults, given by keyword."""

    _fields: tuple[str, ...] = ()

    def __init__(self, **kwargs: Any) -> None:
        unknown = set(kwargs) - set(self._fields)
        if unknown:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {sorted(unknown)[0]!r}")
        for name in self._fields:
            setattr(self, name, kwargs[name] if name in kwargs else self._default(name))

    @staticmethod
    def _default(name: str) -> float | np.ndarray | GeometryId:
        if name.startswith("id_"):
            return GeometryId._none()
        return {"depth": -1.0, "distance": 0.0}[name] if name in ("depth", "distance") else np.zeros(3)

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in self._fields:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        kind = type(self).__annotations__[name]
        if kind == "np.ndarray":
            value = np.array(value)
            value = value.astype(float) if value.dtype.kind in "iub" else value
            fits = value.ndim > 0 and value.dtype.kind in "fO"
        else:
            value = float(value) if isinstance(value, (int, np.number)) and kind == "float" else value
            fits = isinstance(value, GeometryId) if kind == "GeometryId" else True
            if kind == "float":  # or a dual
                fits = not isinstance(value, (np.ndarray, list, tuple, str, type(None)))
        if not fits:
            raise Mismatch(f"{type(self).__name__}.{name}: incompatible function arguments; expected {kind}.")
        object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{name}={getattr(self, name)!r}' for name in self._fields)})"


class PenetrationAsPointPair(_Result):
    """Two geometries that overlap, and one point of contact on each.

    Attributes:
        id_A, id_B: the geometries, id_A < id_B.
        p_WCa, p_WCb: the points on A and B that are deepest in the other, in W [m].
        nhat_BA_W: unit normal from B into A.
        depth: penetration [m], not negative.
    """

    _fields = ("id_A", "id_B", "p_WCa", "p_WCb", "nhat_BA_W", "depth")
    id_A: GeometryId
    id_B: GeometryId
    p_WCa: np.ndarray
    p_WCb: np.ndarray
    nhat_BA_W: np.ndarray
    depth: float

    @classmethod
    def _of(
        cls,
        id_A: GeometryId,
        id_B: GeometryId,
        p_WCa: np.ndarray,
        p_WCb: np.ndarray,
        nhat_BA_W: np.ndarray,
        depth: float,
    ) -> Self:
        """One of arrays that nobody else has."""
        new = _new(cls)
        fields = new.__dict__
        fields["id_A"], fields["id_B"], fields["p_WCa"] = id_A, id_B, p_WCa
        fields["p_WCb"], fields["nhat_BA_W"], fields["depth"] = p_WCb, nhat_BA_W, depth
        return new


class SignedDistancePair(_Result):
    """Signed distance between two geometries.

    Attributes:
        id_A, id_B: the geometries, id_A < id_B.
        p_ACa: the witness on A, in the frame of geometry A [m].
        p_BCb: the witness on B, in the frame of geometry B [m].
        distance: [m], negative when they overlap.
        nhat_BA_W: direction of fastest growth of the distance when A moves.
    """

    _fields = ("id_A", "id_B", "p_ACa", "p_BCb", "distance", "nhat_BA_W")
    id_A: GeometryId
    id_B: GeometryId
    p_ACa: np.ndarray
    p_BCb: np.ndarray
    distance: float
    nhat_BA_W: np.ndarray

    @classmethod
    def _of(
        cls,
        id_A: GeometryId,
        id_B: GeometryId,
        p_ACa: np.ndarray,
        p_BCb: np.ndarray,
        distance: float,
        nhat_BA_W: np.ndarray,
    ) -> Self:
        """One of arrays that nobody else has."""
        new = _new(cls)
        fields = new.__dict__
        fields["id_A"], fields["id_B"], fields["p_ACa"] = id_A, id_B, p_ACa
        fields["p_BCb"], fields["distance"], fields["nhat_BA_W"] = p_BCb, distance, nhat_BA_W
        return new


class SignedDistanceToPoint(_Result):
    """Signed distance of a point Q to a geometry.

    Attributes:
        id_G: the geometry.
        p_GN: the nearest point of its surface, in its frame [m].
        distance: [m], negative inside.
        grad_W: gradient of the distance with respect to Q, in W.
    """

    _fields = ("id_G", "p_GN", "distance", "grad_W")
    id_G: GeometryId
    p_GN: np.ndarray
    distance: float
    grad_W: np.ndarray

    @classmethod
    def _of(cls, id_G: GeometryId, p_GN: np.ndarray, distance: float, grad_W: np.ndarray) -> Self:
        """One of arrays that nobody else has."""
        new = _new(cls)
        fields = new.__dict__
        fields["id_G"], fields["p_GN"], fields["distance"] = id_G, p_GN, distance
        fields["grad_W"] = grad_W
        return new


class RayIntersections(_Result):
    """Where n rays first meet the surface of a geometry.

    Attributes:
        distance: along each ray [m], shape (n,); infinite where it meets nothing.
        id_G: the geometry it meets, None for nothing; n of them.
        p_WC: the points in W [m], shape (3, n); NaN for nothing.
        nhat_W: unit normals there, out of the geometry, in W, shape (3, n); NaN for nothing.
    """

    _fields = ("distance", "id_G", "p_WC", "nhat_W")
    distance: np.ndarray
    id_G: list[GeometryId | None]
    p_WC: np.ndarray
    nhat_W: np.ndarray
