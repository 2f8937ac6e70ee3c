"""Samples of polyhedra by hit and run."""

import copy
import pickle

import numpy as np
import pytest

from sheldrake.common import RandomGenerator
from sheldrake.common._distributions import gaussian_pairs, sample_uniform
from sheldrake.geometry.optimization import HPolyhedron


def some_polyhedron(rng):
    n = int(rng.integers(1, 5))
    return HPolyhedron(np.vstack((rng.normal(size=(8, n)), np.eye(n), -np.eye(n))), np.ones(8 + 2 * n))


def walked(polyhedron, generator, x, steps, span):
    """Step by step, each chord from the quotients of all rows."""
    A, b, normals = polyhedron.A(), polyhedron.b(), gaussian_pairs(generator)
    for _ in range(steps):
        direction = span @ [next(normals) for _ in range(span.shape[1])]
        ends = (b - A @ x) / (A @ direction)
        ends = np.max(ends[A @ direction < 0.0]), np.min(ends[A @ direction > 0.0])
        x = x + sample_uniform(generator, *ends) * direction
    return x


@pytest.mark.parametrize("seed", range(20))
def test_walks_go_along_chords(seed):
    rng = np.random.default_rng(seed)
    P, steps = some_polyhedron(rng), int(rng.integers(1, 30))
    n = P.ambient_dimension()
    span = rng.normal(size=(n, int(rng.integers(1, n + 1))))
    ours, others = RandomGenerator(seed), RandomGenerator(seed)
    for _ in range(3):
        x, y = P.UniformSample(ours, np.zeros(n), steps), walked(P, others, np.zeros(n), steps, np.eye(n))
        np.testing.assert_allclose(x, y, atol=1e-10)
        assert np.all(P.A() @ x <= P.b() + 1e-12)
        x = P.UniformSample(ours, np.zeros(n), mixing_steps=steps, subspace=span)
        np.testing.assert_allclose(x, walked(P, others, np.zeros(n), steps, span), atol=1e-10)
    assert ours() == others()


def test_samples_of_a_box_fill_it_evenly():
    box, generator, x = HPolyhedron.MakeUnitBox(2), RandomGenerator(1), np.zeros(2)
    samples = []
    for _ in range(2000):
        x = box.UniformSample(generator, x)
        samples.append(x)
    counts = np.histogram2d(*np.array(samples).T, bins=4, range=[[-1, 1], [-1, 1]])[0]
    assert np.all(abs(counts - 125.0) < 6.0 * np.sqrt(125.0))


def test_what_cannot_be_walked():
    box, generator, kept = HPolyhedron.MakeUnitBox(2), RandomGenerator(0), np.array([0.5, 0.5])
    for outside in ([1.1, 0.0], [np.nan, 0.0], [np.inf, 0.0]):
        with pytest.raises(ValueError, match="failed to find a feasible point"):
            box.UniformSample(generator, outside)
    with pytest.raises(ValueError, match="1 entries, directions 2; expected 2"):
        box.UniformSample(generator, [0.0])
    with pytest.raises(ValueError, match="2 entries, directions 3; expected 2"):
        box.UniformSample(generator, kept, subspace=np.ones((3, 1)))
    with pytest.raises(ValueError, match="unbounded in a direction"):
        HPolyhedron([[1.0, 0.0]], [1.0]).UniformSample(generator, kept)
    box.UniformSample(generator, kept)
    np.testing.assert_array_equal(kept, [0.5, 0.5])
    np.testing.assert_array_equal(box.UniformSample(generator, kept, mixing_steps=0), kept)


def test_numbers_are_the_same_across_stretches_of_the_twister():
    # 624 integers are a stretch; after an odd one, a number takes its halves from two.
    for first in (0, 1):
        ours, others = RandomGenerator(3), RandomGenerator(3)
        for _ in range(first):
            ours(), others()
        for _ in range(1000):
            low, high = others(), others()
            assert ours._uniform() == (low + 2.0**32 * high) / 2.0**64


def test_generators_go_on_behind_a_walk_through_several_stretches():
    box, ours, others = HPolyhedron.MakeUnitBox(3), RandomGenerator(7), RandomGenerator(7)
    for _ in range(4):
        before = copy.copy(ours)
        x, y = box.UniformSample(ours, np.zeros(3), 200), walked(box, others, np.zeros(3), 200, np.eye(3))
        np.testing.assert_allclose(x, y, atol=1e-10)
        np.testing.assert_array_equal(box.UniformSample(before, np.zeros(3), 200), x)
        assert ours() == others() == before()
        assert pickle.loads(pickle.dumps(ours))() == copy.copy(others)()
