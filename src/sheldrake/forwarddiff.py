"""Derivatives of Python functions, exact to round-off, by calling them once with AutoDiffXd numbers."""

from __future__ import annotations

import numpy as np

from sheldrake.autodiffutils import AutoDiffXd

__all__ = ["cos", "derivative", "gradient", "jacobian", "sin"]


def derivative(function, x):
    """Returns the derivative at the number `x` of a function from a number to a number."""
    return function(AutoDiffXd(x, 1, 0)).derivatives()[0]


def gradient(function, x):
    """Returns the gradient at `x`, shape `(n,)`, of a function from a vector to a number.

    Args:
        function: Takes an array of AutoDiffXd, shape `(n,)`; returns an AutoDiffXd or an array with just one.
        x: Where, shape `(n,)`.

    Raises:
        AssertionError: if `x` is not a vector or the function gives more than one number.
    """
    y = np.asarray(function(_variables("gradient", x)))
    if y.size != 1 or y.ndim > 1:
        raise AssertionError(f"gradient(): the function must return one number, it returned shape {y.shape}.")
    return y.reshape(()).item().derivatives()


def jacobian(function, x):
    """Returns the partial derivatives at `x` of a function from a vector to an array.

    Args:
        function: Takes an array of AutoDiffXd, shape `(n,)`; returns an array of AutoDiffXd of any shape.
        x: Where, shape `(n,)`.

    Returns:
        An array of the shape of the function's value with one more axis of length `n`.

    Raises:
        AssertionError: if `x` is not a vector.
    """
    variables = _variables("jacobian", x)
    y = np.asarray(function(variables))
    out = np.zeros((y.size, variables.size))
    for i, element in enumerate(y.flat):
        d = element.derivatives()
        if d.size:  # A constant has none: its row stays zero.
            out[i] = d
    return out.reshape((*y.shape, -1))


def _variables(call: str, x):
    x = np.asarray(x)
    if x.ndim != 1:
        raise AssertionError(f"{call}(): x must be a vector, got an array of shape {x.shape}.")
    out = np.empty(x.shape, dtype=object)
    for i, value in enumerate(x):
        out[i] = AutoDiffXd(value, x.size, i)
    return out


def sin(x):
    """Returns the sine of a number or an AutoDiffXd."""
    return x.sin() if isinstance(x, AutoDiffXd) else np.sin(x)


def cos(x):
    """Returns the cosine of a number or an AutoDiffXd."""
    return x.cos() if isinstance(x, AutoDiffXd) else np.cos(x)
