"""Operations on arrays of any scalar: element-wise comparison, product, inverse."""

from __future__ import annotations

import importlib
import operator
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._scalars import any_array, autodiff_class, home_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["eq", "ge", "gt", "inv", "le", "lt", "matmul", "ne"]


def _elementwise(function: Callable[[Any, Any], Any], sign: str) -> np.vectorize:
    doc = f"`a {sign} b` element by element, with broadcasting; an array of formulas where an operand is symbolic."
    return np.vectorize(function, doc=doc)


lt = _elementwise(operator.lt, "<")
le = _elementwise(operator.le, "<=")
eq = _elementwise(operator.eq, "==")
ne = _elementwise(operator.ne, "!=")
ge = _elementwise(operator.ge, ">=")
gt = _elementwise(operator.gt, ">")


def _as_matrix(value: ArrayLike) -> np.ndarray:
    array = np.asarray(value)
    if array.dtype != object:
        array = array.astype(float, copy=False)
    return array[:, None] if array.ndim == 1 else array


@checked
def matmul(a: ArrayLike, b: ArrayLike) -> np.ndarray:
    """Matrix product of arrays of any scalars; a vector counts as a column.

    Raises:
        ValueError: the inner sizes differ.
    """
    a, b = _as_matrix(a), _as_matrix(b)
    if a.ndim != 2 or b.ndim != 2 or a.shape[1] != b.shape[0]:
        raise ValueError(f"matmul(): shapes {a.shape} and {b.shape} have no product; the inner sizes must be equal.")
    return home_of("AutoDiffXd")._matrices.product(a, b) if _are_duals(a) and _are_duals(b) else a.dot(b)


def _are_duals(array: np.ndarray) -> bool:
    AutoDiffXd = autodiff_class()
    return array.dtype == object and all([type(x) is AutoDiffXd for x in array.ravel().tolist()])


def inv(a: ArrayLike) -> np.ndarray:
    """Inverse of a square matrix of any scalars.

    Raises:
        ValueError: it is not square.
    """
    a = _as_matrix(a)
    if a.ndim != 2 or a.shape[0] != a.shape[1]:
        raise ValueError(f"inv(): an array of shape {a.shape} is not a square matrix.")
    if a.dtype != object:
        try:
            return np.linalg.inv(a)
        except np.linalg.LinAlgError:
            return np.full(a.shape, np.nan)
    if any(type(x).__module__.startswith("sheldrake.symbolic") for x in a.flat):
        return importlib.import_module("sheldrake.symbolic").inv(a)
    return home_of("AutoDiffXd")._matrices.inverse(any_array(autodiff_class(), a))
