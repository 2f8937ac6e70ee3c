"""Nonnegative least squares."""

from __future__ import annotations

import numpy as np


def nonnegative_least_squares(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The x >= 0 with the least |A x - b|, to rounding.

    C. L. Lawson and R. J. Hanson, "Solving Least Squares Problems", 1974, chapter 23. SciPy's takes ten times as long
    to load as the problems of polynomials and of meshes do to be solved.

    Args:
        A: Shape (m, n).
        b: Shape (m,).

    Returns:
        Shape (n,).
    """
    n = A.shape[1]
    if not n:
        return np.zeros(0)
    x, taken = np.zeros(n), np.zeros(n, dtype=bool)
    rounding = 10.0 * max(A.shape) * np.finfo(float).eps * np.abs(A).max() * np.abs(b).max()
    for _ in range(3 * n + 10):
        gains = np.where(taken, -np.inf, A.T @ (b - A @ x))
        best = int(np.argmax(gains))
        if gains[best] <= rounding:
            break
        taken[best] = True
        while True:
            wanted = np.zeros(n)
            wanted[taken] = np.linalg.lstsq(A[:, taken], b, rcond=None)[0]
            low = taken & (wanted <= 0.0)
            if not low.any():
                break
            # As far as all stay nonnegative; what is zero there goes.
            part = (x[low] / np.maximum(x[low] - wanted[low], 1e-300)).min()
            x += part * (wanted - x)
            taken &= x > 1e-12 * np.abs(x).max()
            x[~taken] = 0.0
        x = wanted
    return x
