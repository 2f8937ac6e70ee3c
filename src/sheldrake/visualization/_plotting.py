"""Sub-level sets in a matplotlib plot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from sheldrake.symbolic._expression import Expression


def plot_sublevelset_quadratic(
    ax: Axes, A: Any, b: Any = (0, 0), c: float = 0, vertices: int = 51, **kwargs: Any
) -> Any:
    """Fills the ellipse of all x with x'Ax + b'x + c <= 1 and returns what matplotlib's fill() returns.

    Args:
        ax: The matplotlib axes.
        A: Positive definite matrix, shape (2, 2).
        b: Shape (2,).
        c: Number.
        vertices: Number of points on the boundary.
        **kwargs: Passed to fill().

    Raises:
        ValueError: when the set is not an ellipse, or empty.
    """
    A = np.asarray(A, dtype=float)
    A = (A + A.T) / 2
    b = np.broadcast_to(np.ravel(np.asarray(b, dtype=float)), (2,))
    if np.linalg.eigvalsh(A)[0] <= 0:
        raise ValueError("plot_sublevelset_quadratic(): A must be positive definite.")
    center = -0.5 * np.linalg.solve(A, b)
    level = 1.0 - c + center @ A @ center
    if level < 0:
        raise ValueError("plot_sublevelset_quadratic(): the set is empty.")
    angle = np.linspace(0, 2 * np.pi, vertices)
    # With A = L L', x = center + sqrt(level) inv(L') (cos, sin) lies on the boundary.
    unit = np.stack([np.cos(angle), np.sin(angle)])
    points = center[:, None] + np.sqrt(level) * np.linalg.solve(np.linalg.cholesky(A).T, unit)
    return ax.fill(points[0], points[1], **kwargs)


def plot_sublevelset_expression(ax: Axes, e: Expression, vertices: int = 51, **kwargs: Any) -> Any:
    """Fills the set of all points with e(x) <= 1 around the origin and returns what matplotlib's fill() returns.

    What is drawn is the part that is seen from the origin.

    Args:
        ax: The matplotlib axes.
        e: A symbolic Expression in two variables.
        vertices: Number of points on the boundary.
        **kwargs: Passed to fill().

    Raises:
        ValueError: when there are not two variables, the origin is not in the set, or the set has no end.
    """
    from sheldrake.symbolic import DecomposeQuadraticPolynomial, Polynomial

    variables = sorted(e.GetVariables(), key=lambda v: v.get_id())
    if len(variables) != 2:
        raise ValueError(
            f"plot_sublevelset_expression(): e must be an expression in two variables, got {len(variables)}: {e}."
        )
    if e.is_polynomial():
        polynomial = Polynomial(e)
        if polynomial.TotalDegree() == 2:
            order = {v.get_id(): i for i, v in enumerate(variables)}
            Q, b, c = DecomposeQuadraticPolynomial(polynomial, order)
            return plot_sublevelset_quadratic(ax, Q / 2, b, c, vertices, **kwargs)  # Q is the Hessian

    def excess(point: np.ndarray) -> float:
        return float(e.Evaluate(dict(zip(variables, point)))) - 1.0

    if excess(np.zeros(2)) > 0:
        raise ValueError("plot_sublevelset_expression(): the set e <= 1 does not contain the origin.")
    angle = np.linspace(0, 2 * np.pi, vertices)
    points = [_first_root(excess, np.array([np.cos(a), np.sin(a)])) for a in angle]
    return ax.fill(*np.array(points).T, **kwargs)


def _first_root(excess: Any, direction: np.ndarray) -> np.ndarray:
    """Returns the point where a ray from the origin first leaves the set where a function is negative."""
    near, far = 0.0, 1e-3
    while excess(far * direction) <= 0:
        near, far = far, 1.1 * far
        if far > 1e6:
            raise ValueError(f"plot_sublevelset_expression(): the set has no end in the direction {direction}.")
    while far - near > 1e-12 * far:
        middle = (near + far) / 2
        near, far = (middle, far) if excess(middle * direction) <= 0 else (near, middle)
    return near * direction
