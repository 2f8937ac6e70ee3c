"""Lines, planes and other flats as sets, and the flat that a set spans."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import Ways, dispatch, overload
from sheldrake.common._scalars import frozen
from sheldrake.geometry.optimization._affine import Affine, Rows
from sheldrake.geometry.optimization._convex_set import ConvexSet
from sheldrake.solvers import Solve, _arrays

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@checked
class AffineSubspace(ConvexSet):
    """Points translation + basis y for all y.

    Made as `()`; as `(basis, translation)` with independent columns; or as `(set, tol=1e-12)`, the least flat around a
    set: directions in which the set is thinner than tol do not count.

    Raises:
        RuntimeError: the columns of the basis are dependent, the set is empty, or tol is negative.
    """

    _has_volume = True
    _basis: np.ndarray
    _translation: np.ndarray

    def __init__(self, *args: Any, **kwargs: Any):
        dispatch("AffineSubspace", _WAYS, self, args, kwargs)

    def _set(self, basis: np.ndarray, translation: np.ndarray) -> None:
        if basis.shape[0] != translation.size:
            raise RuntimeError(
                f"AffineSubspace(): the basis has {basis.shape[0]} rows, the translation {translation.size}."
            )
        if basis.shape[1] > basis.shape[0] or np.linalg.matrix_rank(basis) < basis.shape[1]:
            raise RuntimeError("AffineSubspace(): the columns of the basis must be linearly independent.")
        self._basis, self._translation, self._dimension = basis, translation, translation.size

    def _set_of_set(self, set: ConvexSet, tol: float | None) -> None:
        if tol is not None and tol < 0.0:
            raise RuntimeError(f"AffineSubspace(): tol must not be negative, got {tol}.")
        self._set(*affine_hull(set, 1e-12 if tol is None else float(tol)))

    def basis(self) -> np.ndarray:
        """Returns the basis, shape (n, m), read-only."""
        return frozen(self._basis.copy())

    def translation(self) -> np.ndarray:
        """Returns a point of it, shape (n,), read-only."""
        return frozen(self._translation.copy())

    def AffineDimension(self) -> int:
        """Returns its own dimension."""
        return self._basis.shape[1]

    def _columns(self, call: str, x: ArrayLike, rows: int) -> tuple[np.ndarray, bool]:
        x = np.array(x, dtype=float)
        flat = x.ndim == 1
        x = x.reshape(-1, 1) if flat else x
        if x.shape[0] != rows:
            raise RuntimeError(f"{call}(): expected {rows} rows, got {x.shape[0]}.")
        return x, flat

    def ToLocalCoordinates(self, x: ArrayLike) -> np.ndarray:
        """Returns y of the nearest points translation + basis y, columns."""
        x, _ = self._columns("ToLocalCoordinates", x, self._dimension)
        return np.linalg.lstsq(self._basis, x - self._translation[:, None], rcond=None)[0]

    def ToGlobalCoordinates(self, y: ArrayLike) -> np.ndarray:
        """Returns translation + basis y, columns."""
        y, _ = self._columns("ToGlobalCoordinates", y, self.AffineDimension())
        return self._basis @ y + self._translation[:, None]

    def ContainedIn(self, other: AffineSubspace, tol: float = 1e-15) -> bool:
        """Tells whether it lies in another one, up to a tolerance."""
        if other.ambient_dimension() != self._dimension or self.AffineDimension() > other.AffineDimension():
            return False
        if not other.PointInSet(self._translation, tol):
            return False
        return all(other.PointInSet(b + other._translation, tol) for b in self._basis.T)

    def IsNearlyEqualTo(self, other: AffineSubspace, tol: float = 1e-15) -> bool:
        """Tells whether each lies in the other, up to a tolerance."""
        return self.ContainedIn(other, tol) and other.ContainedIn(self, tol)

    def OrthogonalComplementBasis(self) -> np.ndarray:
        """Returns an orthonormal basis of the directions across it, shape (n, n - m)."""
        return complement(self._basis)

    def _contain(self, into: Rows, x: Affine, scale: Affine) -> None:
        if self._basis.shape[1]:
            y = into.new(self._basis.shape[1], "a" if scale.is_one() else "y")
            into.equal(self._basis @ y - x + scale.times(self._translation))
        else:
            into.equal(x - scale.times(self._translation))
        into.nonnegative(scale)

    def _contains(self, x: np.ndarray, tol: float) -> bool:
        return bool(np.all(np.abs(self.ToGlobalCoordinates(self.ToLocalCoordinates(x))[:, 0] - x) <= tol))

    def _nearest(self, p: np.ndarray) -> np.ndarray:
        return self.ToGlobalCoordinates(self.ToLocalCoordinates(p))[:, 0]

    def _bounded(self) -> bool:
        return self.AffineDimension() == 0

    def _point(self) -> np.ndarray | None:
        return None if self.AffineDimension() else self._translation.copy()

    def _some_point(self) -> np.ndarray:
        return self._translation.copy()

    def _volume(self) -> float:
        return np.inf if self.AffineDimension() == self._dimension else 0.0


def _matrix(value: ArrayLike) -> np.ndarray:
    return np.array(_arrays.float_matrix(value))


_WAYS = Ways(
    [
        overload(lambda self: self._set(np.zeros((0, 0)), np.zeros(0))),
        overload(AffineSubspace._set, basis=_matrix, translation=_arrays.float_vector),
        overload(AffineSubspace._set_of_set, set=instance_of(ConvexSet), tol=(_arrays.number, 1e-12)),
    ]
)


def complement(basis: np.ndarray) -> np.ndarray:
    """An orthonormal basis of the directions across independent columns, shape (n, n - m)."""
    n, m = basis.shape
    return np.linalg.svd(basis, full_matrices=True)[0][:, m:] if 0 < m < n else np.eye(n, n - m)


def column_space(M: np.ndarray, tol: float) -> np.ndarray:
    """An orthonormal basis of what the columns span, as far as they are longer than tol."""
    U, s, _ = np.linalg.svd(M, full_matrices=False)
    return U[:, s > tol]


def affine_hull(set: ConvexSet, tol: float) -> tuple[np.ndarray, np.ndarray]:
    """Basis and a point of the least flat around a set.

    Raises:
        RuntimeError: the set is empty.
    """
    known = getattr(set, "_affine_hull", None)
    found = known(tol) if known is not None else None
    if found is not None:
        return found
    if isinstance(set, AffineSubspace):
        return set.basis(), set.translation()
    point = set.MaybeGetPoint()
    if point is not None:
        return np.zeros((point.size, 0)), point
    return _hull_by_programs(set, tol)


def _hull_by_programs(set: ConvexSet, tol: float) -> tuple[np.ndarray, np.ndarray]:
    """Looks for points as far from each other as possible, within one, in directions not yet covered."""
    start = set.MaybeGetFeasiblePoint()
    if start is None:
        raise RuntimeError("AffineSubspace: Cannot take the affine hull of an empty set!")
    n = set.ambient_dimension()
    basis = np.zeros((n, 0))
    grown = True
    while grown and basis.shape[1] < n:
        grown = False
        for direction in complement(basis).T:
            step = _longest_step(set, direction)
            if step is None or abs(direction @ step) <= tol:
                continue
            across = step - basis @ (basis.T @ step)
            basis = np.column_stack((basis, across / np.linalg.norm(across)))
            grown = True
            break
    return basis, start


def _longest_step(set: ConvexSet, direction: np.ndarray) -> np.ndarray | None:
    """The difference of two points of a set that goes farthest in a direction, at most one."""
    prog, x = set._program()
    y = prog.NewContinuousVariables(x.size, "y")
    set._contain(Rows(prog), Affine.of(y), Affine.constant(1.0))
    both, along = np.concatenate((x, y)), np.concatenate((direction, -direction))
    prog.AddLinearConstraint(along.reshape(1, -1), np.zeros(1), np.ones(1), both)
    prog.AddLinearCost(-along, 0.0, both)
    result = Solve(prog)
    return result.GetSolution(x) - result.GetSolution(y) if result.is_success() else None
