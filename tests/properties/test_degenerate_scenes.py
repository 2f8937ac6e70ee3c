"""Needles, plates, flat hulls, coincident centres, bodies deep in the ground or far away: numbers, or one status."""

from __future__ import annotations

import numpy as np
import pytest
from tests.unit.multibody.plant.free_bodies import FreeBodies

import sheldrake.geometry as g
from sheldrake.multibody.contact_solvers._kernels import problem as statuses

CUBE = 0.05 * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
GRID = 0.05 * np.array([[x, y, z] for x in np.linspace(-1, 1, 4) for y in np.linspace(-1, 1, 4) for z in (-1, 1)])
SHAPES = {
    "needle": g.Box(1.0, 1e-4, 1e-4),
    "plate": g.Box(1.0, 1.0, 1e-4),
    "box": g.Box(0.1, 0.1, 0.1),
    "ball": g.Sphere(0.05),
    "grain": g.Sphere(1e-5),
    "wire": g.Cylinder(1e-4, 1.0),
    "coin": g.Cylinder(0.5, 1e-4),
    "hair": g.Capsule(1e-4, 1.0),
    "thorn": g.Ellipsoid(1.0, 1e-4, 1e-4),
    "lens": g.Ellipsoid(0.1, 0.05, 1e-4),
    "hull": g.Convex(CUBE.T, "hull"),
    "coplanar": g.Convex(GRID.T, "coplanar"),  # 16 points on each of two sides
    "splinter": g.Convex((CUBE * [10.0, 1e-3, 1e-3]).T, "splinter"),
}
KNOWN = {value for name, value in vars(statuses).items() if name.isupper()}


def put(scene: FreeBodies, how: str, rng: np.random.Generator) -> None:
    places = {
        "coincident": np.zeros((3, 3)),
        "buried": rng.normal(0.0, 1e-3, (3, 3)) - np.array([0.0, 0.0, 0.7]),
        "far": rng.normal(0.0, 0.05, (3, 3)) + np.array([1e6, -1e6, 0.0]),
        "close": rng.normal(0.0, 0.1, (3, 3)),
    }
    for k in range(3):
        q = rng.normal(size=4) if rng.random() < 0.5 else np.eye(4)[0]
        scene.q[k] = [*(q / np.linalg.norm(q)), *places[how][k]]
    scene.v[:] = rng.normal(size=(3, 6))


@pytest.mark.parametrize("how", ["coincident", "buried", "far", "close"])
@pytest.mark.parametrize("algorithm", ["multi_point", "single_point"])
@pytest.mark.parametrize("approximation", ["lagged", "similar", "sap", "tamsi"])
def test_scenes_of_odd_shapes_give_numbers(approximation, algorithm, how):
    """Masses from 10 g to 10 kg. A step may give up, within its iterations and saying so, but seldom."""
    rng, gave_up = np.random.default_rng([ord(c) for c in approximation + algorithm + how]), 0
    for _ in range(8):
        names, masses = rng.choice(list(SHAPES), 3), 10.0 ** rng.uniform(-2.0, 1.0, 3)
        bodies = [(SHAPES[n], m, [0.0, 0.0, 0.0], 0.01 * m * np.eye(3)) for n, m in zip(names, masses)]
        scene = FreeBodies(bodies, approximation=approximation, algorithm=algorithm)
        put(scene, how, rng)
        try:
            states = scene.step(20)
        except AssertionError as error:
            assert int(str(error).split()[1]) in KNOWN
            gave_up += 1
        else:
            assert np.isfinite(states).all()
    assert gave_up <= 2
