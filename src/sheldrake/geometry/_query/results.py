"""What geometry queries report."""

from __future__ import annotations

import operator
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from sheldrake.common._overloads import Mismatch
from sheldrake.geometry._ids import GeometryId
from sheldrake.geometry._kernels.model import ContactPoint

if TYPE_CHECKING:
    from typing_extensions import Self


_new = object.__new__
_A, _B, _NHAT = ContactPoint.p_WCa.columns, ContactPoint.p_WCb.columns, ContactPoint.nhat_BA_W.columns
_DEPTH = operator.index(ContactPoint.depth)


class _Result:
    """Fields with defaults, given by keyword.

    What a query found has its row of a contact table as well, of which nobody else has a part, and vectors that are cut
    out of it when they are first asked for: most are not.
    """

    _fields: tuple[str, ...] = ()
    _columns: ClassVar[dict[str, slice]] = {}
    _measure: tuple[str, float] = ("distance", -1.0)
    """In which field the depth of a row goes, times what."""
    _of_whom: tuple[str, str] = ("id_A", "id_B")
    """In which fields the two geometries of a row go; "" for one that is no geometry."""

    def __init__(self, **kwargs: Any) -> None:
        unknown = set(kwargs) - set(self._fields)
        if unknown:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {sorted(unknown)[0]!r}")
        for name in self._fields:
            setattr(self, name, kwargs[name] if name in kwargs else self._default(name))

    @classmethod
    def _of(cls, *values: object) -> Self:
        """One with all of its fields given, in their order."""
        new = _new(cls)
        new.__dict__.update(zip(cls._fields, values))
        return new

    @classmethod
    def _each(cls, ids: list[GeometryId], pairs: list[list[int]], rows: np.ndarray) -> list[Self]:
        """One for each row of a contact table."""
        (measure, factor), (one, other), found = cls._measure, cls._of_whom, []
        for (a, b), row in zip(pairs, rows):
            new = _new(cls)
            fields = new.__dict__
            fields[one] = ids[a]
            if other:
                fields[other] = ids[b]
            fields[measure], fields["_row"] = factor * row.item(_DEPTH), row
            found.append(new)
        return found

    def __getattr__(self, name: str) -> Any:
        columns = type(self)._columns.get(name)
        if columns is None:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        fields = self.__dict__
        vector = fields[name] = fields["_row"][columns]
        return vector

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
    _columns: ClassVar[dict[str, slice]] = {"p_WCa": _A, "p_WCb": _B, "nhat_BA_W": _NHAT}
    _measure = ("depth", 1.0)
    id_A: GeometryId
    id_B: GeometryId
    p_WCa: np.ndarray
    p_WCb: np.ndarray
    nhat_BA_W: np.ndarray
    depth: float


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
    _columns: ClassVar[dict[str, slice]] = {"p_ACa": _A, "p_BCb": _B, "nhat_BA_W": _NHAT}
    id_A: GeometryId
    id_B: GeometryId
    p_ACa: np.ndarray
    p_BCb: np.ndarray
    distance: float
    nhat_BA_W: np.ndarray


class SignedDistanceToPoint(_Result):
    """Signed distance of a point Q to a geometry.

    Attributes:
        id_G: the geometry.
        p_GN: the nearest point of its surface, in its frame [m].
        distance: [m], negative inside.
        grad_W: gradient of the distance with respect to Q, in W.
    """

    _fields = ("id_G", "p_GN", "distance", "grad_W")
    _columns: ClassVar[dict[str, slice]] = {"p_GN": _A, "grad_W": _NHAT}
    _of_whom = ("id_G", "")
    id_G: GeometryId
    p_GN: np.ndarray
    distance: float
    grad_W: np.ndarray


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
