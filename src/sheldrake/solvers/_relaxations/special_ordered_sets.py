"""Which interval a number is in, by binary variables."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._enums import BoundEnum
from sheldrake.solvers import _arrays
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.symbolic import Expression
from sheldrake.symbolic import _build as build

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import ArrayLike

    from sheldrake.solvers._arrays import VariablesLike
    from sheldrake.symbolic import Variable


class IntervalBinning(BoundEnum):
    """How binary variables say which interval is meant: by a Gray code, or one variable for each interval."""

    kLogarithmic = 0
    kLinear = 1


def _sum(items: Iterable[Expression | Variable]) -> Expression:
    return build.sum_of([_arrays.expression(e) for e in items])


def gray_code(digits: int) -> np.ndarray:
    """The reflected Gray code, shape (2^digits, digits): neighbouring rows differ in one place."""
    codes = np.zeros((1, 0), dtype=int)
    for _ in range(digits):
        n = len(codes)
        codes = np.vstack((np.hstack((np.zeros((n, 1), int), codes)), np.hstack((np.ones((n, 1), int), codes[::-1]))))
    return codes


def AddSos2Constraint(prog: MathematicalProgram, lambdas: VariablesLike, y: ArrayLike) -> None:
    """Adds that at most two neighbours among weights that sum to one are positive, as y(i) = 1 says for i and i + 1.

    Raises:
        RuntimeError: there is not one y fewer than weights.
    """
    weights = _arrays.expression_array(np.asarray(lambdas, dtype=object).ravel())
    y = _arrays.expression_array(np.asarray(y, dtype=object).ravel())
    n = len(weights)
    if len(y) != n - 1:
        raise RuntimeError("The size of y and lambda do not match when adding the SOS2 constraint.")
    prog.AddLinearConstraint(_sum(weights) == 1)
    prog.AddLinearConstraint(_sum(y) == 1)
    for i in range(n):
        near = y[max(i - 1, 0) : i + 1]
        rows = np.array([weights[i], weights[i] - _sum(near)], dtype=object)
        prog.AddLinearConstraint(rows, [0.0, -np.inf], [np.inf, 0.0])


@checked
def AddLogarithmicSos1Constraint(prog: MathematicalProgram, num_lambda: int) -> tuple[np.ndarray, np.ndarray]:
    """Adds new weights of which one is one and the others zero, with few binary variables (Vielma and Nemhauser, 2011).

    Returns:
        The weights, shape (num_lambda,), and the binary variables: the Gray code of the weight that is one.
    """
    digits = int(np.ceil(np.log2(num_lambda))) if num_lambda > 1 else 0
    weights = prog.NewContinuousVariables(num_lambda)
    y = prog.NewBinaryVariables(digits)
    codes = gray_code(digits)[:num_lambda]
    prog.AddLinearConstraint(_sum(weights) == 1)
    for v in weights:
        prog.AddLinearConstraint(v >= 0)
    for j in range(digits):
        prog.AddLinearConstraint(_sum(weights[codes[:, j] == 1]) - y[j] <= 0)
        prog.AddLinearConstraint(_sum(weights[codes[:, j] == 0]) + y[j] <= 1)
    return weights, y


def AddLogarithmicSos2Constraint(
    prog: MathematicalProgram, lambdas: VariablesLike, binary_variable_name: str = "y"
) -> np.ndarray:
    """Adds that at most two neighbours among weights that sum to one are positive, with few binary variables.

    Returns:
        The binary variables: the Gray code of the interval between the two.
    """
    weights = _arrays.expression_array(np.asarray(lambdas, dtype=object).ravel())
    digits = int(np.ceil(np.log2(len(weights) - 1))) if len(weights) > 2 else 0
    y = prog.NewBinaryVariables(digits, binary_variable_name)
    _logarithmic_sos2(prog, weights, y)
    return y


def _logarithmic_sos2(prog: MathematicalProgram, weights: np.ndarray, y: np.ndarray) -> None:
    intervals = len(weights) - 1
    codes = gray_code(len(y))[:intervals]
    prog.AddLinearConstraint(_sum(weights) == 1)
    for e in weights:
        prog.AddLinearConstraint(e >= 0)
        prog.AddLinearConstraint(e <= 1)
    for j in range(len(y)):
        near = [codes[max(i - 1, 0) : i + 1, j] for i in range(intervals + 1)]
        ones = _sum([w for w, c in zip(weights, near) if c.all()])
        zeros = _sum([w for w, c in zip(weights, near) if not c.any()])
        prog.AddLinearConstraint(ones - y[j] <= 0)
        prog.AddLinearConstraint(zeros + y[j] <= 1)


def AddBilinearProductMcCormickEnvelopeSos2(
    prog: MathematicalProgram,
    x: Variable,
    y: Variable,
    w: Variable | Expression,
    phi_x: ArrayLike,
    phi_y: ArrayLike,
    Bx: np.ndarray,
    By: np.ndarray,
    binning: IntervalBinning,
) -> np.ndarray:
    """Adds that w is in the convex hull of x y over the rectangle of a grid that (x, y) is in.

    Args:
        prog: The program.
        x: A variable.
        y: A variable.
        w: What is to be near x y.
        phi_x: Ends of the intervals of x, ascending, shape (m + 1,).
        phi_y: Ends of the intervals of y, ascending, shape (n + 1,).
        Bx: Binary variables for the interval of x.
        By: Binary variables for the interval of y.
        binning: How they say so.

    Returns:
        The weights of the corners, shape (m + 1, n + 1).
    """
    phi_x, phi_y = (np.asarray(p, dtype=float).ravel() for p in (phi_x, phi_y))
    Bx, By = (_arrays.expression_array(np.asarray(B, dtype=object).ravel()) for B in (Bx, By))
    corners = prog.NewContinuousVariables(len(phi_x), len(phi_y), "lambda")
    prog.AddBoundingBoxConstraint(0.0, 1.0, corners)
    pairs = [(corners[i, j], phi_x[i], phi_y[j]) for j in range(len(phi_y)) for i in range(len(phi_x))]
    prog.AddLinearConstraint(x - _sum([c * a for c, a, _ in pairs]) == 0)
    prog.AddLinearConstraint(y - _sum([c * b for c, _, b in pairs]) == 0)
    prog.AddLinearConstraint(w - _sum([c * (a * b) for c, a, b in pairs]) == 0)
    for weights, B in (
        (np.array([_sum(row) for row in corners], dtype=object), Bx),
        (np.array([_sum(column) for column in corners.T], dtype=object), By),
    ):
        if binning is IntervalBinning.kLinear:
            AddSos2Constraint(prog, weights, B)
        else:
            _logarithmic_sos2(prog, weights, B)
    return corners
