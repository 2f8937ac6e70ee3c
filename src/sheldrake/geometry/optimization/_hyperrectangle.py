"""Boxes along the axes as sets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common import quick
from sheldrake.common._checked import checked
from sheldrake.common._distributions import sample_uniform
from sheldrake.common._overloads import Ways, dispatch, overload
from sheldrake.geometry._shapes import Box
from sheldrake.geometry.optimization import _polyhedron_programs as programs
from sheldrake.geometry.optimization._affine import Affine, Rows
from sheldrake.geometry.optimization._convex_set import ConvexSet, checked_box
from sheldrake.math import RigidTransform
from sheldrake.solvers import _arrays
from sheldrake.solvers._kernels.inside import inside_box

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.common import RandomGenerator
    from sheldrake.geometry._shapes import Shape
    from sheldrake.geometry.optimization._hpolyhedron import HPolyhedron


@checked
class Hyperrectangle(ConvexSet):
    """lb <= x <= ub with finite bounds; made as `()` or `(lb, ub)`.

    Raises:
        RuntimeError: a lower bound is above its upper bound, or one is not finite.
    """

    _has_volume = True
    _lb: np.ndarray
    _ub: np.ndarray

    @typing_overload
    @checked
    def __init__(self) -> None: ...
    @typing_overload
    @checked
    def __init__(self, lb: ArrayLike, ub: ArrayLike) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any):
        dispatch("Hyperrectangle", _WAYS, self, args, kwargs)

    def _set(self, lb: np.ndarray, ub: np.ndarray) -> None:
        self._lb, self._ub = checked_box("Hyperrectangle", lb, ub)
        if not np.isfinite((self._lb, self._ub)).all():
            raise RuntimeError("Hyperrectangle(): bounds must be finite.")
        self._dimension = lb.size

    def lb(self) -> np.ndarray:
        """Returns the lower bounds, shape (n,)."""
        return self._lb.copy()

    def ub(self) -> np.ndarray:
        """Returns the upper bounds, shape (n,)."""
        return self._ub.copy()

    def Center(self) -> np.ndarray:
        """Returns the center, shape (n,)."""
        return 0.5 * (self._lb + self._ub)

    def UniformSample(self, generator: RandomGenerator) -> np.ndarray:
        """Returns a random point, shape (n,)."""
        return np.array([sample_uniform(generator, lo, hi) for lo, hi in zip(self._lb, self._ub)])

    def MakeHPolyhedron(self) -> HPolyhedron:
        """Returns it as an HPolyhedron."""
        from sheldrake.geometry.optimization._hpolyhedron import HPolyhedron

        return HPolyhedron.MakeBox(self._lb, self._ub)

    def MaybeGetIntersection(self, other: Hyperrectangle) -> Hyperrectangle | None:
        """Returns what it has in common with another one, or None if nothing.

        Raises:
            RuntimeError: they are in spaces of different dimensions.
        """
        self._same_space("MaybeGetIntersection", other)
        lb, ub = np.maximum(self._lb, other._lb), np.minimum(self._ub, other._ub)
        return None if np.any(lb > ub) else Hyperrectangle(lb, ub)

    @staticmethod
    def MaybeCalcAxisAlignedBoundingBox(set: ConvexSet) -> Hyperrectangle | None:
        """Returns the smallest box around a set; None if the set is empty or unbounded."""
        bounds = set._bounding_box()
        return None if bounds is None else Hyperrectangle(*bounds)

    def _bounding_box(self) -> tuple[np.ndarray, np.ndarray] | None:
        return self._lb, self._ub

    def _faces(self) -> tuple[np.ndarray, np.ndarray]:
        return programs.box_rows(self._lb, self._ub)

    def _contain(self, into: Rows, x: Affine, scale: Affine) -> None:
        into.within(self._lb, x, self._ub, scale)
        into.nonnegative(scale)

    def _contains_quickly(self, x: ArrayLike, tol: float) -> bool | None:
        return _inside(self._lb, self._ub, x, tol)

    def _contains(self, x: np.ndarray, tol: float) -> bool:
        return bool((x >= self._lb - tol).all() and (x <= self._ub + tol).all())

    def _bounded(self) -> bool:
        return True

    def _point(self) -> np.ndarray | None:
        return self._lb.copy() if np.array_equal(self._lb, self._ub) else None

    def _some_point(self) -> np.ndarray:
        return self.Center()

    def _volume(self) -> float:
        return float(np.prod(self._ub - self._lb))

    def _shape(self) -> tuple[Shape, RigidTransform]:
        return Box(*(self._ub - self._lb)), RigidTransform(self.Center())


_WAYS = Ways(
    [
        overload(lambda self: self._set(np.zeros(0), np.zeros(0))),
        overload(Hyperrectangle._set, lb=_arrays.float_vector, ub=_arrays.float_vector),
    ]
)

_inside = quick.short_way(globals(), "_inside", inside_box, quick.ANY, quick.ANY, quick.ANY, float, gives=bool)
