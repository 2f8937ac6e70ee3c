"""Sets made of sets.

Their members keep what they are; a program gets variables and constraints of each.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import dispatch, incompatible, overload
from sheldrake.geometry._shapes import Capsule, Cylinder
from sheldrake.geometry.optimization._affine import Affine, Rows
from sheldrake.geometry.optimization._convex_set import ConvexSet, require_one_space, sets_of
from sheldrake.geometry.optimization._ellipsoids import Hyperellipsoid
from sheldrake.geometry.optimization._from_geometry import Placed, geometry_overload, unsupported
from sheldrake.geometry.optimization._vpolytope import VPolytope
from sheldrake.solvers import _arrays

if TYPE_CHECKING:
    from sheldrake.geometry._shapes import Shape
    from sheldrake.math._rigid_transform import RigidTransform


@checked
class MinkowskiSum(ConvexSet):
    """Sums of points, one of each set.

    Made as `()`, `(sets)`, `(setA, setB)` or `(query_object, geometry_id, reference_frame=None)` of a capsule.

    Raises:
        RuntimeError: the sets are in spaces of different dimensions.
    """

    def __init__(self, *args: Any, **kwargs: Any):
        sets = sets_of(args, kwargs) if args or kwargs else []
        if sets is None:
            dispatch("MinkowskiSum", [geometry_overload(MinkowskiSum._set_of_capsule)], self, args, kwargs)
        else:
            self._set(sets)

    def _set(self, sets: list[ConvexSet]) -> None:
        self._sets, self._dimension = sets, require_one_space("MinkowskiSum", sets)

    def _set_of_capsule(self, at: Placed) -> None:
        if not isinstance(at.shape, Capsule):
            raise unsupported(MinkowskiSum, at.shape)
        ends = np.array([[0.0, 0.0, -0.5], [0.0, 0.0, 0.5]]).T * at.shape.length()
        ball = Hyperellipsoid.MakeHypersphere(at.shape.radius(), np.zeros(3))
        self._set([ball, VPolytope(at.R_FG @ ends + at.p_FG[:, None])])

    def num_terms(self) -> int:
        """Returns how many sets there are."""
        return len(self._sets)

    def term(self, index: int) -> ConvexSet:
        """Returns one of the sets."""
        return self._sets[index]

    def _contain(self, into: Rows, x: Affine, scale: Affine) -> None:
        terms = into.new_columns(self._dimension, len(self._sets), "x")
        _add_up(into, terms, x)
        for s, term in zip(self._sets, terms):
            into.contain(s, term, scale)
        into.nonnegative(scale)

    def _empty(self) -> bool:
        return any(s.IsEmpty() for s in self._sets)

    def _bounded(self) -> bool | None:
        return True if all(s.IsBounded() for s in self._sets) else None

    def _extent(self, direction: np.ndarray) -> float:
        return sum(s._extent(direction) for s in self._sets)

    def _point(self) -> np.ndarray | None:
        return _sum([s.MaybeGetPoint() for s in self._sets])

    def _some_point(self) -> np.ndarray | None:
        return _sum([s.MaybeGetFeasiblePoint() for s in self._sets])


def _add_up(into: Rows, parts: list[Affine], x: Affine) -> None:
    """Constrains points to have the sum x."""
    for i in range(len(x)):
        total = parts[0][i : i + 1]
        for part in parts[1:]:
            total = total + part[i : i + 1]
        into.equal(total - x[i : i + 1])


def _sum(points: list[np.ndarray | None]) -> np.ndarray | None:
    """The sum of points; None if one is missing."""
    known = [p for p in points if p is not None]
    return np.sum(known, axis=0) if len(known) == len(points) else None


@checked
class Intersection(ConvexSet):
    """Points that all sets have in common; made as `()`, `(sets)` or `(setA, setB)`.

    Raises:
        RuntimeError: the sets are in spaces of different dimensions.
    """

    def __init__(self, *args: Any, **kwargs: Any):
        sets = sets_of(args, kwargs) if args or kwargs else []
        if sets is None:
            raise incompatible("Intersection", ["(sets)", "(setA, setB)"], args, kwargs, constructor=True)
        self._sets, self._dimension = sets, require_one_space("Intersection", sets)

    def num_elements(self) -> int:
        """Returns how many sets there are."""
        return len(self._sets)

    def element(self, index: int) -> ConvexSet:
        """Returns one of the sets."""
        return self._sets[index]

    def _contain(self, into: Rows, x: Affine, scale: Affine) -> None:
        for s in self._sets:
            into.contain(s, x, scale)
        into.nonnegative(scale)

    def _contains(self, x: np.ndarray, tol: float) -> bool:
        return all(s.PointInSet(x, tol) for s in self._sets)

    def _empty(self) -> bool:
        return super()._empty() if self._dimension else any(s.IsEmpty() for s in self._sets)

    def _bounded(self) -> bool | None:
        return True if any(s.IsBounded() for s in self._sets) else None

    def _point(self) -> np.ndarray | None:
        for s in self._sets:
            point = s.MaybeGetPoint()
            if point is not None:
                return point if self._contains(point, 1e-8) else None
        return None


@checked
class CartesianProduct(ConvexSet):
    """Points put together of points of each set: the x with A x + b in the product of the sets.

    Made as `()`; `(sets)`; `(setA, setB)`; `(sets, A, b)` with independent columns of A; or `(query_object,
    geometry_id, reference_frame=None)` of a cylinder.

    Raises:
        RuntimeError: sizes do not fit, or the columns of A are dependent.
    """

    def __init__(self, *args: Any, **kwargs: Any):
        self._A: np.ndarray | None = None
        self._b: np.ndarray | None = None
        sets = sets_of(args, kwargs) if args or kwargs else []
        if sets is not None:
            self._set(sets)
            return
        ways = [
            overload(CartesianProduct._set, sets=_list_of_sets, A=_arrays.float_matrix, b=_arrays.float_vector),
            geometry_overload(CartesianProduct._set_of_cylinder),
        ]
        dispatch("CartesianProduct", ways, self, args, kwargs)

    def _set(self, sets: list[ConvexSet], A: np.ndarray | None = None, b: np.ndarray | None = None) -> None:
        self._sets = sets
        total = sum(s.ambient_dimension() for s in sets)
        if A is not None and b is not None:
            if A.shape[0] != total or b.size != total:
                raise RuntimeError(f"CartesianProduct(): A has {A.shape[0]} rows and b {b.size}, expected {total}.")
            if np.linalg.matrix_rank(A) < A.shape[1]:
                raise RuntimeError("CartesianProduct(): the columns of A must be linearly independent.")
            self._A, self._b = np.array(A), np.array(b)
        self._dimension = total if A is None else A.shape[1]

    def _set_of_cylinder(self, at: Placed) -> None:
        if not isinstance(at.shape, Cylinder):
            raise unsupported(CartesianProduct, at.shape)
        disk = Hyperellipsoid.MakeHypersphere(at.shape.radius(), np.zeros(2))
        half = 0.5 * at.shape.length()
        self._set([disk, VPolytope(np.array([[-half, half]]))], at.R_FG.T, -at.R_FG.T @ at.p_FG)

    def num_factors(self) -> int:
        """Returns how many sets there are."""
        return len(self._sets)

    def factor(self, index: int) -> ConvexSet:
        """Returns one of the sets."""
        return self._sets[index]

    def A(self) -> np.ndarray | None:
        """Returns A, or None."""
        return None if self._A is None else self._A.copy()

    def b(self) -> np.ndarray | None:
        """Returns b, or None."""
        return None if self._b is None else self._b.copy()

    @property
    def _has_volume(self) -> bool:  # type: ignore[override]
        return not self._is_slice() and all(s._has_volume for s in self._sets)

    def _slices(self) -> list[slice]:
        ends = np.cumsum([0, *(s.ambient_dimension() for s in self._sets)])
        return [slice(int(i), int(j)) for i, j in itertools.pairwise(ends)]

    def _contain(self, into: Rows, x: Affine, scale: Affine) -> None:
        y = x
        if self._A is not None and self._b is not None:
            y = into.new(len(self._b), "y")
            into.equal(y - self._A @ x - scale.times(self._b))
        for s, at in zip(self._sets, self._slices()):
            if s.ambient_dimension():
                into.contain(s, y[at], scale)
        into.nonnegative(scale)

    def _contains(self, x: np.ndarray, tol: float) -> bool:
        y = x if self._A is None else self._A @ x + self._b
        return all(s.PointInSet(y[at], tol) for s, at in zip(self._sets, self._slices()))

    def _is_slice(self) -> bool:
        return self._A is not None and self._A.shape[0] != self._A.shape[1]

    def _empty(self) -> bool:
        if self._dimension and self._is_slice():
            return super()._empty()
        return any(s.IsEmpty() for s in self._sets)

    def _bounded(self) -> bool | None:
        if all(s.IsBounded() for s in self._sets):
            return True
        return None if self._A is not None else self._empty()

    def _joined(self, parts: list) -> np.ndarray | None:
        if any(p is None for p in parts):
            return None
        y = np.concatenate([np.zeros(0), *parts])
        if self._A is None:
            return y
        x, *_ = np.linalg.lstsq(self._A, y - self._b, rcond=None)
        return x if np.allclose(self._A @ x + self._b, y, atol=1e-12) else None

    def _point(self) -> np.ndarray | None:
        return self._joined([s.MaybeGetPoint() for s in self._sets])

    def _some_point(self) -> np.ndarray | None:
        if self._is_slice():
            return super()._some_point()
        return self._joined([s.MaybeGetFeasiblePoint() for s in self._sets])

    def _volume(self) -> float:
        total = float(np.prod([s.CalcVolume() for s in self._sets if s.ambient_dimension()]))
        return total if self._A is None else total / abs(np.linalg.det(self._A))

    def _shape(self) -> tuple[Shape, RigidTransform]:
        from sheldrake.math import RigidTransform, RotationMatrix

        kinds = [type(s) for s in self._sets]
        if kinds != [Hyperellipsoid, VPolytope] or self._A is None or self._b is None:
            return super()._shape()
        disk: Any = self._sets[0]
        radius = 1.0 / np.linalg.norm(disk.A(), axis=0)[0]
        length = float(np.ptp(self._sets[1].vertices()))  # type: ignore[attr-defined]
        R = self._A.T
        return Cylinder(radius, length), RigidTransform(RotationMatrix(R), -R @ self._b)


def _list_of_sets(value: object) -> list[ConvexSet]:
    if not isinstance(value, (list, tuple)) or not all(isinstance(s, ConvexSet) for s in value):
        raise _arrays.Mismatch
    return [s.Clone() for s in value]


class ConvexHull(ConvexSet):
    """The convex hull of sets.

    Args:
        sets: In one space.
        remove_empty_sets: Whether those that are empty are left out; else an empty one makes the constraints wrong.

    Raises:
        RuntimeError: the sets are in spaces of different dimensions.
    """

    @checked
    def __init__(self, sets: list[ConvexSet], remove_empty_sets: bool = True):
        self._sets = [s.Clone() for s in sets]
        self._dimension = require_one_space("ConvexHull", self._sets)
        self._removed = bool(remove_empty_sets)
        self._taking_part = [s for s in self._sets if not (remove_empty_sets and s.IsEmpty())]

    def sets(self) -> list[ConvexSet]:
        """Returns the sets."""
        return list(self._sets)

    def participating_sets(self) -> list[ConvexSet]:
        """Returns the sets that take part: those that are not empty, if these are left out."""
        return list(self._taking_part)

    @checked
    def element(self, index: int) -> ConvexSet:
        """Returns one of the sets."""
        return self._sets[index]

    def num_elements(self) -> int:
        """Returns how many sets there are."""
        return len(self._sets)

    def empty_sets_removed(self) -> bool:
        """Tells whether empty sets are left out."""
        return self._removed

    def _contain(self, into: Rows, x: Affine, scale: Affine) -> None:
        if not self._taking_part:
            into.equal(np.zeros((len(x), len(x))) @ x + Affine.constant(np.ones(len(x))))
            return
        count = len(self._taking_part)
        parts = into.new_columns(self._dimension, count, "x_sets")
        weights = into.new(count, "alpha")
        into.between(np.zeros(count), weights, np.full(count, 1.0 if scale.is_one() else np.inf))
        _add_up(into, parts, x)
        into.equal(np.ones((1, count)) @ weights - scale)
        for k, (s, part) in enumerate(zip(self._taking_part, parts)):
            into.contain(s, part, weights[k : k + 1])
        into.nonnegative(scale)

    def _empty(self) -> bool:
        return all(s.IsEmpty() for s in self._taking_part)

    def _bounded(self) -> bool:
        return all(s.IsBounded() for s in self._taking_part)

    def _extent(self, direction: np.ndarray) -> float:
        if not self._taking_part:
            raise RuntimeError("ConvexHull: an empty set has no extent.")
        return max(s._extent(direction) for s in self._taking_part)

    def _some_point(self) -> np.ndarray | None:
        for s in self._taking_part:
            point = s.MaybeGetFeasiblePoint()
            if point is not None:
                return point
        return None
