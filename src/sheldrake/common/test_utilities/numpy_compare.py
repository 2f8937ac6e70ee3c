"""Assertions about numbers and arrays of float, AutoDiffXd, and of what `symbolic` has.

`np.testing` asks whether `a == b`, which is a formula where `a` is an expression, and leaves the derivatives of an
AutoDiffXd out. These assertions compare structure and derivatives too.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from sheldrake.common._scalars import scalar_types

__all__ = [
    "assert_allclose",
    "assert_equal",
    "assert_float_allclose",
    "assert_float_equal",
    "assert_float_not_equal",
    "assert_not_equal",
    "check_all_types",
    "check_nonsymbolic_types",
    "resolve_type",
    "to_float",
]


def resolve_type(a: Any) -> type:
    """The one type of all elements of `a`, an array or a single thing; float for NumPy's floating point numbers.

    Raises:
        AssertionError: the elements are of several types, or there are none.
    """
    types = {_type_of(x) for x in np.asarray(a).ravel()}
    assert len(types) == 1, f"{len(types)} types of elements, not one: {sorted(t.__name__ for t in types)}"
    return types.pop()


def to_float(a: Any) -> float:
    """The values of `a` as floats: an array of its shape, or a float for a single number.

    Raises:
        RuntimeError: an expression has variables in it.
    """
    values: Any = np.vectorize(_value, otypes=[float])(a) if np.size(a) else np.zeros(np.shape(a))
    return values if np.ndim(a) else float(values)


def assert_equal(a: Any, b: Any) -> None:
    """Asserts that shapes are the same, and all elements: values, derivatives, structure of expressions.

    A derivative is compared only where both sides are AutoDiffXd. Against a str, elements are compared by what `str`
    makes of them.

    Raises:
        AssertionError: which element differs, and both.
    """
    a, b = np.asarray(a), np.asarray(b)
    if a.dtype != object and b.dtype != object and a.dtype.kind != "U" and b.dtype.kind != "U":
        assert a.shape == b.shape, f"shapes differ: {a.shape} and {b.shape}"
        np.testing.assert_equal(a, b)
        return
    for at, x, y in _pairs(a, b):
        assert _same(x, y), f"{_where(at)}{x!r} is not equal to {y!r}"


def assert_not_equal(a: Any, b: Any) -> None:
    """Asserts that at least one element differs, of arrays of the same shape."""
    pairs = list(_pairs(np.asarray(a), np.asarray(b)))
    assert any(not _same(x, y) for _, x, y in pairs), f"all elements are equal:\n{a!r}\n{b!r}"


def assert_allclose(a: Any, b: Any, atol: float = 1e-15, rtol: float = 0.0) -> None:
    """Asserts |a - b| <= atol + rtol |b| for values, and for derivatives where both sides are AutoDiffXd."""
    np.testing.assert_allclose(to_float(a), to_float(b), atol=atol, rtol=rtol)
    _, T, _ = _types()
    for at, x, y in _pairs(np.asarray(a), np.asarray(b)):
        if isinstance(x, T) and isinstance(y, T):
            message = f"{_where(at)}derivatives differ"
            np.testing.assert_allclose(x.derivatives(), y.derivatives(), atol=atol, rtol=rtol, err_msg=message)


def assert_float_equal(a: Any, bf: Any) -> None:
    """Asserts that the values of `a` are the floats `bf`."""
    assert_equal(to_float(a), _floats(bf))


def assert_float_not_equal(a: Any, bf: Any) -> None:
    """Asserts that at least one value of `a` is not the float in `bf`."""
    assert_not_equal(to_float(a), _floats(bf))


def assert_float_allclose(a: Any, bf: Any, atol: float = 1e-15, rtol: float = 0.0) -> None:
    """Asserts |a - bf| <= atol + rtol |bf| for the values of `a` and the floats `bf`."""
    assert_allclose(to_float(a), _floats(bf), atol=atol, rtol=rtol)


def check_all_types(check_func: Callable) -> Callable:
    """Decorator: calls a function with `T=float`, `T=AutoDiffXd` and `T=Expression` in turn."""
    return _with_types(check_func, 3)


def check_nonsymbolic_types(check_func: Callable) -> Callable:
    """Decorator: calls a function with `T=float` and `T=AutoDiffXd` in turn."""
    return _with_types(check_func, 2)


def _types() -> Any:
    """float, AutoDiffXd, Expression: their modules load when this is first asked."""
    return scalar_types()


def _with_types(check_func: Callable, number: int) -> Callable:
    @functools.wraps(check_func)
    def check(*args: Any, **kwargs: Any) -> None:
        for T in _types()[:number]:
            check_func(*args, T=T, **kwargs)

    del check.__wrapped__  # type: ignore[attr-defined]  # test runners would ask for a fixture `T`
    return check


def _type_of(x: Any) -> type:
    return float if isinstance(x, (float, np.floating)) else type(x)


def _value(x: Any) -> float:
    _, AutoDiffXd, Expression = _types()
    if isinstance(x, AutoDiffXd):
        return x.value()
    if isinstance(x, Expression):
        return x.Evaluate()
    return float(x)


def _floats(bf: Any) -> np.ndarray | float:
    assert np.asarray(bf).dtype != object, f"floats are expected here, not {bf!r}"
    return np.asarray(bf, dtype=float) if np.ndim(bf) else float(bf)


def _pairs(a: np.ndarray, b: np.ndarray) -> list[Any]:
    """(index, element of a, element of b) of arrays of the same shape."""
    assert a.shape == b.shape, f"shapes differ: {a.shape} and {b.shape}"
    return [(at, a[at], b[at]) for at in np.ndindex(a.shape)]


def _same(x: Any, y: Any) -> bool:
    if isinstance(y, str) or isinstance(x, str):
        return str(x) == str(y)
    _, T, Expression = _types()
    if isinstance(x, T) or isinstance(y, T):
        if _value(x) != _value(y):
            return False
        return not (isinstance(x, T) and isinstance(y, T)) or np.array_equal(x.derivatives(), y.derivatives())
    if isinstance(y, Expression) and isinstance(x, (int, float)):
        x, y = y, x
    if hasattr(x, "EqualTo"):
        return bool(x.EqualTo(y))
    return bool(x == y)


def _where(at: tuple) -> str:
    return f"element {at}: " if at else ""
