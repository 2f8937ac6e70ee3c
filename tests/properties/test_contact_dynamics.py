"""What contact may not do, whatever touches: make energy, or momentum."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.unit.multibody.plant.free_bodies import FreeBodies, box_inertia

import sheldrake.geometry as g

G, STEPS = 9.81, 400
MASSES = np.array([1.0, 0.4, 2.0, 0.7])
SIZES = (0.1, 0.08, 0.12, 0.09)


def solids():
    """Two balls and two cubes: bodies whose angular momentum is along their angular velocity."""
    bodies = []
    for k, (mass, size) in enumerate(zip(MASSES, SIZES)):
        shape = g.Sphere(size / 2) if k % 2 else g.Box(size, size, size)
        inertia = np.eye(3) * 0.1 * mass * size**2 if k % 2 else box_inertia(mass, [size] * 3)
        bodies.append((shape, mass, [0.0, 0.0, 0.0], inertia))
    return bodies


INERTIAS = np.array([body[3][0, 0] for body in solids()])
seeds = st.integers(0, 2**32 - 1)
examples = settings(max_examples=25, deadline=None)


@pytest.fixture(scope="module")
def scenes():
    return {
        (approximation, ground): FreeBodies(solids(), approximation=approximation, ground=ground)
        for approximation in ("lagged", "similar", "sap", "tamsi")
        for ground in (True, False)
    }


def toss(scene, seed, spread):
    """Random poses and velocities, the bodies one above the other and nearing one another; states after each step."""
    rng = np.random.default_rng(seed)
    scene.x[:] = 0.0
    for k in range(4):
        q = rng.normal(size=4)
        scene.q[k] = [*(q / np.linalg.norm(q)), *rng.uniform(-0.03, 0.03, 2), 0.1 + 0.13 * k]
    scene.v[:] = rng.normal(size=(4, 6)) * [*[5.0] * 3, *[spread] * 3]
    scene.v[:, 5] += [1.5, 0.5, -0.5, -1.5]
    return scene.x.copy(), scene.step(STEPS)


def energy(x):
    """Kinetic and gravitational energy of states [J], shape (..., 52)."""
    q, v = x[..., :28].reshape(*x.shape[:-1], 4, 7), x[..., 28:].reshape(*x.shape[:-1], 4, 6)
    kinetic = 0.5 * (MASSES * (v[..., 3:] ** 2).sum(-1) + INERTIAS * (v[..., :3] ** 2).sum(-1))
    return (kinetic + MASSES * G * q[..., 6]).sum(-1)


@pytest.mark.parametrize("approximation", ["lagged", "similar", "sap", "tamsi"])
@examples
@given(seed=seeds)
def test_energy_is_never_more_than_at_the_start(scenes, approximation, seed):
    """A step of free fall loses m g² h² / 2; contact takes energy, and what its springs give back they have taken."""
    start, states = toss(scenes[approximation, True], seed, 0.5)
    above_ground = energy(states).max() - energy(start)
    assert above_ground < 1e-9 * energy(start)


@pytest.mark.parametrize("approximation", ["lagged", "similar", "sap"])
@examples
@given(seed=seeds)
def test_bodies_that_hit_one_another_keep_their_momentum(scenes, approximation, seed):
    """Without ground, only gravity changes it: linearly in time."""
    start, states = toss(scenes[approximation, False], seed, 0.2)
    momentum = (MASSES[:, None] * np.vstack([start, states])[:, 28:].reshape(-1, 4, 6)[:, :, 3:]).sum(axis=1)
    fall = -MASSES.sum() * G * scenes[approximation, False].dt * np.arange(STEPS + 1)
    scale = np.abs(MASSES[:, None] * scenes[approximation, False].v[:, 3:]).max() + abs(fall[-1])
    np.testing.assert_allclose(momentum[:, :2] - momentum[0, :2], 0.0, atol=1e-12 * scale)
    np.testing.assert_allclose(momentum[:, 2] - momentum[0, 2] - fall, 0.0, atol=1e-12 * scale)


def test_these_bodies_do_hit_one_another(scenes):
    for ground in (True, False):
        scene, touched = scenes["lagged", ground], 0
        for seed in range(5):
            _, states = toss(scene, seed, 0.2)
            spin = states[:, 28:].reshape(-1, 4, 6)[:, :, :3]
            touched += np.abs(np.diff(spin, axis=0)).max() > 1e-3  # without contact they keep their spin
        assert touched == 5
