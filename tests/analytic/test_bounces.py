"""What neither damps nor rubs bounces for ever, whatever the step and the stiffness."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks.engines import DrakeLike, Scene, Solid

from sheldrake.multibody.contact_solvers._kernels.laws import elastic_impulse, elastic_integral

G, GROUND = 9.81, Solid(("half_space",))
APPROXIMATIONS = ("lagged", "similar")
STEPS = [(1e-3, 1e4), (1e-3, 1e6), (5e-3, 1e6)]  # [s], [N/m]: omega h is 0.1, 1, 5


def ball(z, mass=1.0, radius=0.05, **more):
    return Solid(("sphere", radius), mass, p=(0.0, 0.0, z), **more)


def started(solids, step, stiffness, approximation="lagged", algorithm=None, **more):
    engine = DrakeLike("sheldrake", approximation, algorithm)
    engine.start(Scene(solids, step, stiffness=stiffness, dissipation=0.0, relaxation_time=0.0, friction=0.0, **more))
    return engine


def motion(engine, step, steps):
    """Heights half a step back, and velocities, of each body after every step, shape (steps, n) and (steps, n, 6)."""
    heights, velocities = [], []
    for _ in range(steps):
        engine.advance(step)
        velocities.append(engine.velocities())
        heights.append(engine.positions()[:, 2] - 0.5 * step * velocities[-1][:, 5])
    return np.array(heights), np.array(velocities)


@pytest.mark.parametrize(("step", "stiffness"), STEPS)
@pytest.mark.parametrize("approximation", APPROXIMATIONS)
def test_a_ball_keeps_its_energy(approximation, step, stiffness):
    """Also while it touches: motion, height and spring, half a step back."""
    engine = started([GROUND, ball(0.55)], step, stiffness, approximation)
    z, v = motion(engine, step, 3000)
    depth = np.maximum(0.05 - z[:, 0], 0.0)
    energy = 0.5 * (v[:, 0, 3:] ** 2).sum(axis=1) + G * (z[:, 0] - 0.05) + 0.5 * stiffness * depth**2
    np.testing.assert_allclose(energy, 0.5 * G, rtol=1e-8)
    assert (np.diff(np.sign(v[:, 0, 5])) > 0).sum() >= 4  # bounces
    assert (depth > 0.0).any()


@pytest.mark.parametrize("approximation", APPROXIMATIONS)
def test_a_box_that_falls_flat_rises_as_high(approximation):
    box = Solid(("box", 0.1, 0.2, 0.1), 1.0, p=(0.0, 0.0, 0.25))
    engine = started([GROUND, box], 1e-3, 1e5, approximation)
    z, v = motion(engine, 1e-3, 1500)
    free = z[:, 0] > 0.05
    np.testing.assert_allclose(0.5 * v[free, 0, 5] ** 2 + G * (z[free, 0] - 0.05), 0.2 * G, rtol=1e-8)
    assert (np.diff(np.sign(v[:, 0, 5])) > 0).sum() >= 3


@pytest.mark.parametrize("masses", [(1.0, 1.0), (1.0, 3.0)])
def test_two_balls_part_as_elastic_bodies_do(masses):
    """Without gravity: momentum and energy decide."""
    v = np.array([1.0, -0.5])
    solids = [ball(0.0, masses[0], v=(0.0, 0.0, v[0])), ball(0.3, masses[1], v=(0.0, 0.0, v[1]))]
    engine = started(solids, 2e-3, 1e5, gravity=(0.0, 0.0, 0.0))
    engine.advance(1.0)
    common = np.dot(masses, v) / sum(masses)
    np.testing.assert_allclose(engine.velocities()[:, 5], 2.0 * common - v, rtol=1e-9)


def test_what_is_too_fast_to_be_seen_coming_gains_nothing():
    step = 1e-3
    engine = started([GROUND, ball(0.2, v=(0.0, 0.0, -60.0))], step, 1e6)
    _z, v = motion(engine, step, 50)
    assert 0.0 < v[-1, 0, 5] <= 60.0


def test_single_points_and_dissipation_are_not_elastic():
    """The first has Drake's numbers, the second damps the whole of its contact."""
    for algorithm, dissipation in (("single_point", 0.0), (None, 1e-9)):
        engine = DrakeLike("sheldrake", "lagged", algorithm)
        engine.start(Scene([GROUND, ball(0.55)], 1e-3, stiffness=1e4, dissipation=dissipation))
        z, v = motion(engine, 1e-3, 500)
        assert (0.5 * v[-1, 0, 5] ** 2 + G * (z[-1, 0] - 0.05)) / (0.5 * G) < 0.8


@pytest.mark.parametrize("back", [-40.0, 25.0])
def test_the_work_of_the_force_is_what_the_spring_has_lost(back):
    """E(s1) - E(s0) = -n (v0 + v1) / 2; and the impulse is the slope of the cost."""
    k, fe0, dt = 1e4, 30.0, 1e-3
    v0 = 2.0 * back / (dt * k)
    for v1 in np.linspace(-20.0, 20.0, 41):
        n, slope = elastic_impulse(k, fe0, back, dt, v1)
        f0, f1 = fe0 + back, fe0 - 0.5 * dt * k * v1
        released = (max(f0, 0.0) ** 2 - max(f1, 0.0) ** 2) / (2.0 * k)
        assert n * 0.5 * (v0 + v1) == pytest.approx(released, abs=1e-15, rel=1e-12)
        e = 1e-6
        change = elastic_integral(k, fe0, back, dt, v1 + e) - elastic_integral(k, fe0, back, dt, v1 - e)
        assert change / (2.0 * e) == pytest.approx(n, rel=1e-6, abs=1e-9)
        change = elastic_impulse(k, fe0, back, dt, v1 + e)[0] - elastic_impulse(k, fe0, back, dt, v1 - e)[0]
        assert change / (2.0 * e) == pytest.approx(slope, rel=1e-4, abs=1e-9)
        assert slope <= 0.0 <= n
