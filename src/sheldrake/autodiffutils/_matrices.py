"""Arrays of AutoDiffXd from arrays of floats, and back."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.autodiffutils._autodiffxd import _REAL, AutoDiffXd, _make, _new, sizes_differ
from sheldrake.common._checked import checked


@checked
def InitializeAutoDiff(value, num_derivatives=None, deriv_num_start=None, *, gradient=None):
    """Returns the matrix `value` as AutoDiffXd, each element the variable of one partial derivative.

    Elements are numbered column by column. A one-dimensional `value` gives a column, shape `(n, 1)`.

    Args:
        value: Floats, shape `(m, n)` or `(n,)`.
        num_derivatives: Number of partial derivatives every element carries; by default the number of elements.
        deriv_num_start: Index of the partial derivative of the first element; by default 0.
        gradient: Instead of the two above: the partial derivatives, one row an element, shape `(m*n, d)`.

    Raises:
        TypeError: if `value` is not a vector or matrix of numbers.
        RuntimeError: if `gradient` has another number of rows than `value` has elements.
    """
    value = _float_matrix("InitializeAutoDiff", "value", value)
    if gradient is None and num_derivatives is not None and np.ndim(num_derivatives) > 0:
        gradient, num_derivatives = num_derivatives, None
    if gradient is not None:
        return _with_gradient(value, _float_matrix("InitializeAutoDiff", "gradient", gradient))
    size = value.size if num_derivatives is None else _count("num_derivatives", num_derivatives)
    start = 0 if deriv_num_start is None else _count("deriv_num_start", deriv_num_start)
    return filled(value.T, np.eye(value.size, size, start)).T


def _with_gradient(value, gradient):
    if gradient.shape[0] != value.size:
        raise RuntimeError(
            f"InitializeAutoDiff(): gradient has {gradient.shape[0]} rows but value has {value.size} elements; "
            "it needs one row for each element."
        )
    return filled(value.T, gradient.copy()).T


def filled(value: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Duals of these values, and of these derivatives, one row each, which they keep; of the shape of the values."""
    duals = []
    for x, row in zip(value.ravel().tolist(), gradient if gradient.shape[1] else [None] * len(gradient)):
        dual = _new(AutoDiffXd)
        dual._v, dual._d = x, row
        duals.append(dual)
    out = np.empty(value.size, dtype=object)
    out[:] = duals
    return out.reshape(value.shape)


def constants(values: np.ndarray) -> np.ndarray:
    """Duals of these values without derivatives, in an array of the same shape."""
    out = np.empty(values.size, dtype=object)
    out[:] = [_make(x, None) for x in values.ravel().tolist()]
    return out.reshape(values.shape)


def alike(found: list) -> tuple[list[float], np.ndarray] | None:
    """Values of AutoDiffXd, and their derivatives, one row each; None unless all have as many derivatives, and some."""
    try:
        values, rows = [x._v for x in found], [x._d for x in found]
        sizes = set(map(len, rows))
    except (AttributeError, TypeError):  # some are numbers, or have no derivatives
        return None
    return (values, np.concatenate(rows).reshape(len(rows), -1)) if len(sizes) == 1 else None


def _parts(found: list[AutoDiffXd]) -> tuple[np.ndarray, np.ndarray, bool]:
    """Values of duals and their derivatives, one row each, and whether some that have none stand beside others.

    Raises:
        RuntimeError: they carry different, non-zero numbers of derivatives.
    """
    rows: list[Any] = [x._d for x in found]
    sizes = {0 if d is None else len(d) for d in rows}
    size = max(sizes, default=0)
    if len(sizes) > 1:
        if len(sizes) > 2 or 0 not in sizes:
            raise sizes_differ(*sorted(sizes)[-2:])
        none = np.zeros(size)
        rows = [none if d is None else d for d in rows]
    slopes = np.concatenate(rows).reshape(len(rows), size) if size else np.zeros((len(rows), 0))
    return np.array([x._v for x in found]), slopes, len(sizes) > 1


def product(A: np.ndarray, B: np.ndarray, c: np.ndarray | None = None) -> np.ndarray:
    """A @ B of matrices of AutoDiffXd, plus a column if one is given, by products of floats.

    Raises:
        RuntimeError: elements carry different, non-zero numbers of derivatives.
    """
    (m, k), n = A.shape, B.shape[1]
    found = [*A.ravel().tolist(), *B.ravel().tolist(), *([] if c is None else c.tolist())]
    numbers, slopes, mixed = _parts(found)
    size, i, j = slopes.shape[1], m * k, m * k + k * n
    a, b = numbers[:i].reshape(m, k), numbers[i:j].reshape(k, n)
    with np.errstate(all="ignore"):
        values = a.dot(b) if c is None else a.dot(b) + numbers[j:, None]
        if not size:
            return constants(values)
        da, db, dc = slopes[:i].reshape(m, k, size), slopes[i:j].reshape(k, n * size), slopes[j:, None]
        slopes = a.dot(db).reshape(m, n, size) + b.T @ da
        if c is not None:
            slopes += dc
    out = filled(values, slopes.reshape(m * n, size))
    if mixed:
        is_constant = np.array([x._d is None for x in found])
        rows, columns = is_constant[:i].reshape(m, k).all(axis=1), is_constant[i:j].reshape(k, n).all(axis=0)
        rows = rows if c is None else rows & is_constant[j:]
        for x in out[np.logical_and.outer(rows, columns)]:
            x._d = None
    return out


def inverse(A: np.ndarray) -> np.ndarray:
    """The inverse of a square matrix of AutoDiffXd, by products of floats; all NaN where there is none.

    Raises:
        RuntimeError: elements carry different, non-zero numbers of derivatives.
    """
    n = len(A)
    numbers, slopes, _ = _parts(A.ravel().tolist())
    size = slopes.shape[1]
    try:
        inverse = np.linalg.inv(numbers.reshape(n, n))
    except np.linalg.LinAlgError:
        inverse = np.full((n, n), np.nan)
    with np.errstate(all="ignore"):
        half = inverse.dot(slopes.reshape(n, n * size)).reshape(n, n, size)
        return filled(inverse, (-inverse.T @ half).reshape(n * n, size))


def InitializeAutoDiffTuple(*args):
    """Returns each argument as a matrix of AutoDiffXd, the partial derivatives numbered across all of them."""
    total = sum(np.asarray(arg).size for arg in args)
    matrices, start = [], 0
    for arg in args:
        matrices.append(InitializeAutoDiff(arg, total, start))
        start += np.asarray(arg).size
    return tuple(matrices)


def ExtractValue(auto_diff_matrix):
    """Returns the values of a matrix of AutoDiffXd as floats, shape `(m, n)`; `(n, 1)` for a vector.

    Raises:
        TypeError: if the argument is not a vector or matrix of AutoDiffXd or numbers.
    """
    matrix = _autodiff_matrix("ExtractValue", auto_diff_matrix)
    out = np.empty(matrix.shape)
    for i, x in enumerate(matrix.flat):
        out.flat[i] = x._v if x.__class__ is AutoDiffXd else x
    return out


def ExtractGradient(auto_diff_matrix):
    """Returns the partial derivatives of a matrix of AutoDiffXd, one row an element, shape `(m*n, d)`.

    Elements are numbered column by column. Those without derivatives count as constants; if none has any, `d` is 0.

    Raises:
        TypeError: if the argument is not a vector or matrix of AutoDiffXd or numbers.
        RuntimeError: if elements carry different, non-zero numbers of derivatives.
    """
    matrix = _autodiff_matrix("ExtractGradient", auto_diff_matrix).T
    found = alike(matrix.ravel().tolist())
    if found is not None:
        return found[1]
    rows = [x._d if x.__class__ is AutoDiffXd else None for x in matrix.flat]
    sizes = list(dict.fromkeys(d.size for d in rows if d is not None))
    if len(sizes) > 1:
        raise RuntimeError(
            "ExtractGradient(): Input matrix has elements with inconsistent, non-zero numbers of derivatives "
            f"({sizes[0]} and {sizes[1]})."
        )
    out = np.zeros((len(rows), sizes[0] if sizes else 0))
    for i, d in enumerate(rows):
        if d is not None:
            out[i] = d
    return out


@np.vectorize
def autodiff_equal_to(a, b, *, semantic=False):
    """Tells, element by element, whether values and derivatives are the same.

    Args:
        a: Array of AutoDiffXd.
        b: Array of AutoDiffXd.
        semantic: If true, no derivatives at all and derivatives that are all zero count as the same.
    """
    for x in (a, b):
        if not isinstance(x, AutoDiffXd):
            raise TypeError(f"autodiff_equal_to(): expected AutoDiffXd elements, got {x!r}.")
    if a.value() != b.value():
        return False
    da, db = a.derivatives(), b.derivatives()
    if da.shape == db.shape:
        return bool((da == db).all())
    return bool(semantic and 0 in (da.size, db.size) and not da.any() and not db.any())


def _count(name: str, n) -> int:
    if isinstance(n, bool) or not isinstance(n, (int, np.integer)) or n < 0:
        raise TypeError(f"InitializeAutoDiff(): {name} must be a whole number >= 0, got {n!r}.")
    return int(n)


def _as_matrix(call: str, name: str, array):
    if array.ndim == 1:
        array = array.reshape(-1, 1)
    if array.ndim != 2:
        raise TypeError(f"{call}(): {name} must be a vector or a matrix, got an array of shape {array.shape}.")
    return array


def _float_matrix(call: str, name: str, value):
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise TypeError(f"{call}(): {name} must hold numbers, got {value!r}.") from None
    return _as_matrix(call, name, array)


def _autodiff_matrix(call: str, value):
    matrix = _as_matrix(call, "auto_diff_matrix", np.asarray(value, dtype=object))
    for x in matrix.ravel().tolist():
        if x.__class__ is not AutoDiffXd and not isinstance(x, _REAL):
            raise TypeError(f"{call}(): expected AutoDiffXd elements, got {x!r} of type {type(x).__name__}.")
    return matrix
