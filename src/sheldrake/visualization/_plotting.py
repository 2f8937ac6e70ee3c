"""Level sets in a matplotlib plot."""

from __future__ import annotations

from typing import Any

import numpy as np


def plot_sublevelset_quadratic(
    ax: Any, A: Any, b: Any = (0, 0), c: float = 0, vertices: int = 51, **kwargs: Any
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
