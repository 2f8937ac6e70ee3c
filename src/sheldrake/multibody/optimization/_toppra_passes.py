"""The two passes of TOPPRA: which speeds along a path can still be slowed down, and the fastest of them.

H. Pham and Q.-C. Pham, "A new approach to time-optimal path parameterization based on reachability analysis", IEEE
Transactions on Robotics, 2018. Symbols are theirs: x is the square of the path's speed, u its acceleration; between
two gridpoints u is constant, so that x_next = x + 2 delta u.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

_PARALLEL = 1e-12  # Below this part of a row of length one, a coefficient is rounding.
_SLACK = 1e-9  # By how much, relative to the row, rounding may make an interval empty.
LARGEST_X = 1e16  # The path's speed is below 1e8 [1/s], so that the sets of the backward pass are bounded.


class Rows(NamedTuple):
    """lower <= a u + b x <= upper at each gridpoint, shape (gridpoints, rows) each."""

    a: np.ndarray
    b: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


def one_sided(a: np.ndarray, b: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Rows (p, r, c) of length one of p u + r x <= c, without those that bound nothing; shape (m, 3)."""
    rows = np.concatenate((np.column_stack((a, b, upper)), np.column_stack((-a, -b, -lower))))
    rows = rows[np.isfinite(rows[:, 2])]
    length = np.hypot(rows[:, 0], rows[:, 1])
    length[length < 1e-300] = 1.0
    return rows / length[:, None]


def _interval(r: np.ndarray, c: np.ndarray) -> tuple[float, float] | None:
    """Least and greatest z with r z <= c; None if there is none."""
    up, down, level = r > _PARALLEL, r < -_PARALLEL, np.abs(r) <= _PARALLEL
    if np.any(c[level] < -_SLACK * (1.0 + np.abs(c[level]))):
        return None
    low = np.max(c[down] / r[down], initial=-np.inf)
    high = np.min(c[up] / r[up], initial=np.inf)
    if low > high:
        if low - high > _SLACK * (1.0 + min(abs(low), abs(high))):
            return None
        low = high = 0.5 * (low + high)
    return float(low), float(high)


def range_of_x(rows: np.ndarray) -> tuple[float, float] | None:
    """Least and greatest x for which there is a u with p u + r x <= c: u is eliminated (Fourier and Motzkin)."""
    p = rows[:, 0]
    up, down, level = rows[p > _PARALLEL], rows[p < -_PARALLEL], rows[np.abs(p) <= _PARALLEL]
    above, below = up[:, 1:] / up[:, :1], down[:, 1:] / down[:, :1]  # u + r x <= c, and u + r x >= c.
    pairs = (above[:, None, :] - below[None, :, :]).reshape(-1, 2)
    size = np.maximum(np.abs(above[:, None, 0]), np.abs(below[None, :, 0])).reshape(-1, 1)
    pairs /= np.maximum(size, 1.0)
    both = np.concatenate((pairs, level[:, 1:]))
    return _interval(both[:, 0], both[:, 1])


def range_of_u(rows: np.ndarray, x: float) -> tuple[float, float] | None:
    """Least and greatest u with p u + r x <= c at a given x."""
    return _interval(rows[:, 0], rows[:, 2] - rows[:, 1] * x)


def grid_points(path, max_err: float, max_iter: int, max_seg_length: float, min_points: int) -> np.ndarray:
    """Halves segments while a path bends by more than `max_err` within one, or one is too long."""
    points = np.array([path.start_time(), path.end_time()])
    for _ in range(max_iter):
        middle, length = 0.5 * (points[1:] + points[:-1]), np.diff(points)
        bends = [np.abs(0.5 * h**2 * np.asarray(path.EvalDerivative(s, 2))).max() for s, h in zip(middle, length)]
        split = (np.array(bends) > max_err) | (length > max_seg_length)
        if not split.any():
            break
        points = np.sort(np.concatenate((points, middle[split])))
    while points.size < min_points:
        points = np.sort(np.concatenate((points, 0.5 * (points[1:] + points[:-1]))))
    return points
