"""Nearest neighbours of points against all distances."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.geometry._point_cloud import nearest_neighbours

CLOUDS = {
    "a cube": lambda rng: rng.uniform(-1.0, 1.0, (300, 3)),
    "a sheet, and a point far away": lambda rng: np.vstack([rng.uniform(0, 1, (200, 3)) * [1, 1, 0], [1e6, 0, 0]]),
    "a grid, many distances alike": lambda rng: np.argwhere(np.ones((5, 6, 7))).astype(float),
    "some points twice, and all in one place": lambda rng: np.vstack([np.repeat(rng.normal(size=(40, 3)), 2, 0)] * 2),
    "one place": lambda rng: np.ones((50, 3)),
    "a line": lambda rng: np.outer(rng.permutation(100) / 7.0, [0.0, 1.0, 0.0]),
    "two": lambda rng: np.array([[0.0, 0, 0], [0.1, 0, 0]]),
    "one": lambda rng: np.zeros((1, 3)),
}


@pytest.mark.parametrize("name", CLOUDS)
@pytest.mark.parametrize("radius, most", [(0.45, 12), (np.inf, 5), (1e-3, 3), (2.0, 400)])
def test_neighbours_are_those_of_all_distances(name, radius, most):
    """Which of several at the same distance come is open; their distances are not."""
    points = np.ascontiguousarray(CLOUDS[name](np.random.default_rng(5)))
    n = len(points)
    near = nearest_neighbours(points, radius, most)
    assert near.shape == (n, most)
    squares = (points[:, None] - points[None]) ** 2
    squares = squares[..., 0] + squares[..., 1] + squares[..., 2]
    for i in range(n):
        there = near[i][near[i] < n]
        expected = np.sort(squares[i][squares[i] < radius * radius])[:most]
        assert len(set(there.tolist())) == len(there) == len(expected)
        np.testing.assert_allclose(squares[i][there], expected, rtol=1e-14)  # products and sums may be fused
        assert (near[i][len(there) :] == n).all()
