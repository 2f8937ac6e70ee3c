"""Limits along a path as rows for the passes of TOPPRA, and the gridpoints where they hold."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sheldrake.multibody.optimization._kernels.toppra import OWN

LARGEST_X = 1e16  # The path's speed is below 1e8 [1/s], so that the sets of the backward pass are bounded.


class Rows(NamedTuple):
    """lower <= a u + b x <= upper at each gridpoint, shape (gridpoints, rows) each."""

    a: np.ndarray
    b: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


def one_sided(limits: Sequence[Rows], points: int, wider: float) -> np.ndarray:
    """Rows (p, r, c) of length one of p u + r x <= c for the kernels, shape (points * rows, 3).

    Args:
        limits: All limits.
        points: Number of gridpoints.
        wider: Added to upper limits and taken from lower ones.
    """
    parts = [np.stack((m.a, m.b, m.upper + wider), axis=2) for m in limits]
    parts += [np.stack((-m.a, -m.b, wider - m.lower), axis=2) for m in limits]
    rows = np.concatenate([*parts, np.zeros((points, OWN, 3))], axis=1)
    rows[~np.isfinite(rows[:, :, 2])] = 0.0, 0.0, np.inf  # bounds nothing
    length = np.hypot(rows[:, :, 0], rows[:, :, 1])
    length[length < 1e-300] = 1.0
    rows /= length[:, :, None]
    return rows.reshape(-1, 3)


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
