"""What users give for vectors, matrices and variables, as arrays of one kind."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from sheldrake.autodiffutils import AutoDiffXd, ExtractGradient
from sheldrake.autodiffutils._matrices import alike, filled
from sheldrake.common._overloads import Mismatch, kind
from sheldrake.symbolic import Expression, Variable
from sheldrake.symbolic import _build as symbolic_build
from sheldrake.symbolic import _kinds as symbolic_kinds
from sheldrake.symbolic._arguments import expression

if TYPE_CHECKING:
    import scipy.sparse
    from numpy.typing import ArrayLike


Matrix: TypeAlias = "np.ndarray | scipy.sparse.spmatrix"
VariablesLike: TypeAlias = "Sequence[Variable] | np.ndarray"

_FLOAT = np.dtype(float)
_ONLY_VARIABLES = {Variable}
FLOATS, DUALS, SYMBOLS = "float", "AutoDiffXd", "Expression"


def is_sparse(A: ArrayLike) -> bool:
    """Whether a matrix is one of SciPy's sparse ones (asked without importing SciPy)."""
    return type(A).__module__.startswith("scipy.sparse")


def joined(arrays: Sequence[np.ndarray], kind: type) -> np.ndarray:
    """Vectors one after the other; of none an empty one of this kind."""
    return np.concatenate(arrays) if arrays else np.zeros(0, dtype=kind)


def joined_numbers(parts: Iterable[np.ndarray | list[float]]) -> np.ndarray:
    """The numbers of arrays and lists, one after the other; not to be changed."""
    arrays: list[np.ndarray] = []
    run: Any
    for cls, run in itertools.groupby(parts, type):
        if cls is list:
            arrays.append(np.array(list(itertools.chain.from_iterable(run)), dtype=float))
        else:
            arrays += [A.ravel() for A in run]
    return arrays[0] if len(arrays) == 1 else joined(arrays, float)


@kind("array of Variable")
def variable_vector(value: object) -> np.ndarray:
    """Variables as a vector, column after column of a matrix.

    Raises:
        Mismatch: something in it is no variable.
    """
    if isinstance(value, Variable):
        raise Mismatch
    try:
        array = np.asarray(value, dtype=object)
    except ValueError:
        raise Mismatch from None
    out = array.flatten(order="F")  # nobody else's: who changes the array later means another one
    items = out.tolist()
    if not _ONLY_VARIABLES.issuperset(map(type, items)):
        for i, v in enumerate(items):
            if not isinstance(v, Variable):
                found = _variable_of(v)
                if found is None:
                    raise Mismatch
                out[i] = found
    return out


def _variable_of(e: Expression) -> Variable | None:
    """The variable that an expression is, if it is one."""
    if isinstance(e, Expression) and e._kind == symbolic_kinds.VAR:
        found: Variable = e._made[0]
        return found
    return None


@kind("float array of shape (n,)", refuses=(float, int, np.float64))
def float_vector(value: Any) -> np.ndarray:
    """A vector of floats.

    Raises:
        Mismatch: it is none.
    """
    if type(value) is np.ndarray and value.dtype == _FLOAT and value.ndim == 1:
        return value.copy()  # what is given most often
    array = _array_of_floats(value)
    if array.ndim == 2 and 1 in array.shape:
        array = array.ravel()
    if array.ndim != 1:
        raise Mismatch
    return array


def _array_of_floats(value: Any) -> np.ndarray:
    """A new array of a sequence."""
    if (not isinstance(value, (list, tuple)) and np.ndim(value) == 0) or _is_object(value):
        raise Mismatch
    try:
        return np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise Mismatch from None


def _is_object(value: object) -> bool:
    """Whether an array holds anything but plain numbers."""
    return isinstance(value, np.ndarray) and value.dtype == object and not all(map(_is_number, value.flat))


def _is_number(value: object) -> bool:
    return isinstance(value, (float, int, np.floating, np.integer))


@kind("float array of shape (m, n)")
def float_matrix(value: Any) -> Matrix:
    """A matrix of floats, dense or sparse; a vector counts as a column.

    Raises:
        Mismatch: it is none.
    """
    if type(value) is np.ndarray and value.dtype == _FLOAT and value.ndim == 2:
        return value.copy("K")
    if is_sparse(value):
        return value
    array = _array_of_floats(value)
    if array.ndim == 1:
        array = array.reshape(-1, 1)
    if array.ndim != 2:
        raise Mismatch
    return array


@kind("float array of shape (1, n)")
def float_row(value: object) -> Matrix:
    """The coefficients of one row, shape `(1, n)`.

    Raises:
        Mismatch: they are none.
    """
    A = float_matrix(value)
    if A.shape[0] != 1 and A.shape[1] != 1:
        raise Mismatch
    return A.reshape(1, -1)


@kind("float", takes=(float,))
def number(value: Any) -> float:
    """A float.

    Raises:
        Mismatch: it is none.
    """
    if isinstance(value, np.ndarray) and value.size == 1 and not _is_object(value):
        return float(value.reshape(()))
    if _is_number(value):
        return float(value)
    raise Mismatch


@kind("array of Expression")
def expression_array(value: Any) -> np.ndarray:
    """An array of expressions of the given shape.

    Raises:
        Mismatch: something in it is none.
    """
    if np.ndim(value) == 0:
        raise Mismatch
    array = np.asarray(value, dtype=object)
    out = np.empty(array.shape, dtype=object)
    out.ravel()[:] = [expression(e) for e in array.ravel().tolist()]
    return out


def kind_of(x: object) -> tuple[np.ndarray, str]:
    """A vector, and which scalar it is made of.

    Raises:
        TypeError: it is no vector of numbers, AutoDiffXd or expressions.
    """
    if type(x) is np.ndarray and x.dtype == _FLOAT and x.ndim == 1:
        return x.copy(), FLOATS  # what is given most often
    array = np.asarray(x)
    if array.ndim == 2 and 1 in array.shape:
        array = array.ravel()
    if array.ndim != 1:
        raise Mismatch(f"Eval(): incompatible function arguments; expected a vector, got shape {array.shape}.")
    if array.dtype != object:
        try:
            return array.astype(float), FLOATS
        except (TypeError, ValueError):
            raise Mismatch(f"Eval(): incompatible function arguments; expected numbers, got {x!r}.") from None
    for item in array:
        if isinstance(item, AutoDiffXd):
            return array, DUALS
        if isinstance(item, (Expression, Variable)):
            return array, SYMBOLS
    return array.astype(float), FLOATS


def symbols(x: np.ndarray) -> np.ndarray:
    """A vector of expressions."""
    return expression_array(x)


def affine(A: Any, x: np.ndarray, b: Any) -> np.ndarray:
    """A x + b for objects; terms with coefficient zero are left out."""
    dense = A.toarray() if is_sparse(A) else np.asarray(A)
    out = np.empty(dense.shape[0], dtype=object)
    for i, row in enumerate(dense):
        terms = [x[j] if row[j] == 1.0 else row[j] * x[j] for j in np.flatnonzero(row)]
        total = symbolic_build.constant(b[i]) if not terms else terms[0]
        for term in terms[1:]:
            total = total + term
        out[i] = total + b[i] if terms else total
    return out


def values_and_gradient(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values of a vector of AutoDiffXd and numbers, shape `(n,)`, and their derivatives, shape `(n, d)`."""
    found = alike(x.tolist())
    if found is not None:
        return np.array(found[0]), found[1]
    values = np.array([v._v if isinstance(v, AutoDiffXd) else float(v) for v in x])
    return values, ExtractGradient(x)


def duals(values: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """AutoDiffXd of given values and derivatives, whose rows they keep."""
    return filled(np.asarray(values, float), np.asarray(gradient, float))


def variables_at(x: np.ndarray) -> np.ndarray:
    """AutoDiffXd at x, each the variable of one derivative."""
    return duals(x, np.eye(len(x)))
