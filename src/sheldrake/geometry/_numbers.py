"""Numbers that may be floats or duals: geometry whose poses carry derivatives."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.autodiffutils import AutoDiffXd

if TYPE_CHECKING:
    from numpy.typing import DTypeLike

    from sheldrake.common._types import Scalars


def plain(x: Any) -> Any:
    """A float, or a dual as it is."""
    return float(x) if isinstance(x, (float, int, np.floating, np.integer)) else x


def as_numbers(a: Scalars) -> np.ndarray:
    """An array of floats, or of duals where there are some."""
    array = np.array(a)
    return array if array.dtype.char in "dO" else array.astype(float)


def lengths(a: np.ndarray) -> np.ndarray:
    """Euclidean norms along the last axis; of one vector a number."""
    if a.dtype == object:
        return (a * a).sum(axis=-1) ** 0.5
    return np.linalg.norm(a, axis=-1)


def values_of(a: np.ndarray) -> np.ndarray:
    """The values of an array of floats, duals and expressions.

    Raises:
        RuntimeError: an expression has variables.
    """
    if a.dtype != object:
        return a
    return np.array([_value_of(x) for x in a.ravel()], dtype=float).reshape(a.shape)


def _value_of(x: Any) -> float:
    if hasattr(x, "value"):
        return float(x.value())
    return float(x.Evaluate() if hasattr(x, "Evaluate") else x)


def like(a: np.ndarray, dtype: DTypeLike) -> np.ndarray:
    """The array for numbers of a type; integers stay what they are."""
    return a if a.dtype == np.int64 or a.dtype == dtype else a.astype(dtype)


def all_duals(a: np.ndarray) -> np.ndarray:
    """The array, its plain numbers made duals without derivatives where it has any dual."""
    if a.dtype != object or not any(isinstance(x, AutoDiffXd) for x in a.flat):
        return a
    duals = np.empty(a.size, dtype=object)
    duals[:] = [x if isinstance(x, AutoDiffXd) else AutoDiffXd(float(x)) for x in a.flat]
    return duals.reshape(a.shape)
