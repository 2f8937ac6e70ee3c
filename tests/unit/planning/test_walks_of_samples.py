"""Walks of samples in regions: along random chords, as many at once as there are samples."""

import numpy as np
import pytest

from sheldrake.geometry.optimization import HPolyhedron
from sheldrake.planning._sampled_iris import hit_and_run


def some_region(rng: np.random.Generator) -> HPolyhedron:
    n = int(rng.integers(1, 5))
    return HPolyhedron(np.vstack((rng.normal(size=(8, n)), np.eye(n), -np.eye(n))), np.ones(8 + 2 * n))


def walked(region: HPolyhedron, start: np.ndarray, count: int, steps: int, random: np.random.Generator) -> np.ndarray:
    """The ends of all chords from the quotients of all rows."""
    x = np.repeat(start.reshape(-1, 1), count, axis=1)
    for _ in range(steps):
        direction = random.normal(size=x.shape)
        room, slope = region.b()[:, None] - region.A() @ x, region.A() @ direction
        low = np.where(slope < 0.0, room / slope, -np.inf).max(axis=0)
        high = np.where(slope > 0.0, room / slope, np.inf).min(axis=0)
        x = x + random.uniform(low, high) * direction
    return x.T


@pytest.mark.parametrize("seed", range(10))
def test_walks_go_along_chords(seed):
    rng = np.random.default_rng(seed)
    region, steps = some_region(rng), int(rng.integers(1, 30))
    start = rng.uniform(-0.05, 0.05, region.ambient_dimension())
    found = hit_and_run(region, start, 40, steps, np.random.default_rng(seed))
    np.testing.assert_allclose(found, walked(region, start, 40, steps, np.random.default_rng(seed)), atol=1e-10)
    assert np.all(region.A() @ found.T <= region.b()[:, None] + 1e-12)
    assert np.unique(found, axis=0).shape == found.shape


def test_a_walk_that_begins_on_faces_stays_inside():
    box = HPolyhedron.MakeUnitBox(2)
    for start in ([1.0, 0.0], [1.0, -1.0]):
        found = hit_and_run(box, np.array(start), 200, 20, np.random.default_rng(1))
        assert np.abs(found).max() <= 1.0 + 1e-12
        assert np.ptp(found[:, 1]) > 0.5  # out of the corner some chord leads, sooner or later


def test_samples_of_a_box_fill_it_evenly():
    found = hit_and_run(HPolyhedron.MakeUnitBox(2), np.array([0.9, 0.9]), 4000, 30, np.random.default_rng(2))
    counts = np.histogram2d(*found.T, bins=4, range=[[-1, 1], [-1, 1]])[0]
    assert np.all(abs(counts - 250.0) < 5.0 * np.sqrt(250.0))
