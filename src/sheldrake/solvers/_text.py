"""Bounds and matrices as text and LaTeX."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.symbolic import Expression, ToLatex, Variable

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


def latex_number(x: Expression | Variable | float, precision: int) -> str:
    """LaTeX for an expression or a number, infinity included."""
    if isinstance(x, (Expression, Variable)):
        return ToLatex(x, precision)
    if np.isinf(x):
        return r"\infty" if x > 0 else r"-\infty"
    return ToLatex(float(x), precision)


def latex_matrix(M: ArrayLike, precision: int) -> str:
    """LaTeX for a vector or matrix; one element stands without brackets."""
    M = np.asarray(M)
    M = M.reshape(-1, 1) if M.ndim == 1 else M
    if M.size == 1:
        return latex_number(M.flat[0], precision)
    rows = [" & ".join(latex_number(x, precision) for x in row) for row in M]
    return r"\begin{bmatrix} " + r" \\ ".join(rows) + r" \end{bmatrix}"


def latex_bounds(middle: str, lower: np.ndarray, upper: np.ndarray, precision: int) -> str:
    """LaTeX for lower <= middle <= upper; sides that are infinite are left out."""
    if np.array_equal(lower, upper):
        return f"{middle} = {latex_matrix(lower, precision)}"
    left = "" if np.all(np.isneginf(lower)) else rf"{latex_matrix(lower, precision)} \le "
    right = "" if np.all(np.isposinf(upper)) else rf" \le {latex_matrix(upper, precision)}"
    return left + middle + right
