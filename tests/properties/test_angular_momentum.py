"""Angular momentum of free bodies of any inertia: what they do to one another keeps it, and so does the step."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.unit.multibody.plant.free_bodies import FreeBodies, box_inertia, random_quaternion

import sheldrake.geometry as g

STEPS = 300
MASSES = (1.0, 0.4, 2.0)
SIZES = ((0.1, 0.06, 0.03), (0.08, 0.08, 0.02), (0.05, 0.12, 0.07))
CENTRES = ((0.0, 0.0, 0.0), (0.02, -0.01, 0.005), (-0.01, 0.0, 0.02))
"""Centres of mass, of which two are not the origin of their body [m]."""

seeds = st.integers(0, 2**32 - 1)
examples = settings(max_examples=15, deadline=None)


def scene(approximation: str, **options) -> FreeBodies:
    bodies = [(g.Box(*size), m, c, box_inertia(m, size)) for m, size, c in zip(MASSES, SIZES, CENTRES)]
    return FreeBodies(bodies, approximation=approximation, ground=False, **options)


def toss(scene: FreeBodies, seed: int) -> np.ndarray:
    """Bodies one above the other that near one another and spin; the states, that of the start first."""
    rng = np.random.default_rng(seed)
    scene.x[:] = 0.0
    for k in range(3):
        scene.q[k] = [*random_quaternion(rng), *rng.uniform(-0.03, 0.03, 2), 0.13 * k]
    scene.v[:] = rng.normal(size=(3, 6)) * [*[8.0] * 3, *[0.2] * 3]
    scene.v[:, 5] += [1.5, 0.0, -1.5]
    start = scene.x.copy()
    return np.vstack([start, scene.step(STEPS)])


def angular_momentum(states: np.ndarray) -> np.ndarray:
    """About the centre of mass of all bodies, in W [kg m²/s], shape (n, 3)."""
    masses = np.array(MASSES)[:, None]
    q, v = states[:, :21].reshape(-1, 3, 7), states[:, 21:].reshape(-1, 3, 6)
    unit = q[..., :4] / np.linalg.norm(q[..., :4], axis=-1, keepdims=True)
    cross = np.cross(np.eye(3), unit[..., None, 1:])
    R_WB = np.eye(3) + 2.0 * unit[..., :1, None] * cross + 2.0 * cross @ cross
    c = np.einsum("nkij,kj->nki", R_WB, CENTRES)
    flows = masses * (v[..., 3:] + np.cross(v[..., :3], c))
    I_B = np.array([box_inertia(m, size) for m, size in zip(MASSES, SIZES)])
    spins = np.einsum("nkij,kjl,nkml,nkm->nki", R_WB, I_B, R_WB, v[..., :3])
    centres = q[..., 4:] + c
    middle = (masses * centres).sum(axis=1, keepdims=True) / masses.sum()
    return (np.cross(centres - middle, flows) + spins).sum(axis=1)


def worst_step(states: np.ndarray) -> float:
    """The largest change of angular momentum in a step [kg m²/s]."""
    return np.abs(np.diff(angular_momentum(states), axis=0)).max()


@pytest.fixture(scope="module")
def scenes():
    return {approximation: scene(approximation) for approximation in ("lagged", "similar", "sap", "tamsi")}


@pytest.mark.parametrize("approximation", ["lagged", "similar", "sap", "tamsi"])
@examples
@given(seed=seeds)
def test_a_step_with_or_without_contact_keeps_it(scenes, approximation, seed):
    assert worst_step(toss(scenes[approximation], seed)) < 1e-14


def test_these_bodies_hit_one_another_and_the_momentum_is_not_zero(scenes):
    for seed in range(5):
        states = toss(scenes["lagged"], seed)
        assert np.abs(np.diff(states[:, 21:], axis=0)).max() > 1.0
        assert np.abs(angular_momentum(states[:1])).max() > 1e-3


def test_with_drakes_numbers_a_step_is_off_by_the_square_of_its_length():
    """Single points: the gyroscopic torque is that of the start, and impacts add to the first power."""
    errors = []
    for dt in (1e-3, 5e-4):
        bodies = scene("lagged", algorithm="single_point", dt=dt)
        bodies.q[:, 6] = 1.0, 2.0, 3.0
        bodies.v[:, :3] = 1.0, 2.0, 3.0
        errors.append(worst_step(np.vstack([bodies.x.copy(), bodies.step(20)])))
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("rate", [30.0, 3000.0])
def test_what_spins_however_fast_keeps_it(rate):
    """Also where a body turns by three radians a step."""
    bodies = scene("lagged")
    bodies.q[:, 6] = 1.0, 2.0, 3.0
    bodies.v[:, :3] = rate * np.array([0.5, -0.3, 0.8])
    states = np.vstack([bodies.x.copy(), bodies.step(1000)])
    start, end = angular_momentum(states[[0, -1]])
    assert np.abs(end - start).max() < 1e-10 * np.abs(start).max()
