"""The step's Python twin on dual numbers, contact solve included, against finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from free_bodies import FreeBodies, box_inertia

from sheldrake import geometry as g
from sheldrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff
from sheldrake.multibody.plant._step.arrays import make_step_work

CUBE = (g.Box(0.1, 0.1, 0.1), 1.0, [0.01, 0.0, 0.0], box_inertia(1.0, [0.1, 0.1, 0.1]))


def scene_in_contact(approximation, **options):
    """Sliding on one edge, or sticking."""
    scene = FreeBodies([CUBE], approximation=approximation, relative_tolerance=1e-12, **options)
    half = 0.5 * 0.1
    scene.q[0] = [np.cos(half), np.sin(half), 0.0, 0.0, 0.3, 0.2, 0.0]
    corner = 0.05 * np.cos(0.1) + 0.05 * np.sin(0.1)
    scene.q[0, 6] = corner - 2e-4
    scene.v[0] = [0.1, -0.2, 0.3, 0.4, 0.1, -0.05]
    return scene


@pytest.mark.parametrize("approximation", ["lagged", "similar", "sap", "tamsi"])
def test_jacobian_of_a_step(approximation):
    scene = scene_in_contact(approximation)
    n = len(scene.x)
    x0 = scene.x.copy()
    assert scene.step(1).shape == (1, n)
    assert scene.work.problem.num_contacts >= 1

    x = InitializeAutoDiff(x0).ravel()
    work = make_step_work(scene.tree, scene.solver, scene.plant, scene.table, dtype=object)
    out = np.full(n, 0.0, dtype=object)
    assert scene.chain(**scene.arguments() | work._asdict() | {"xd": x, "out": out}) == 0
    np.testing.assert_allclose(ExtractValue(out).ravel(), scene.next, rtol=0, atol=1e-7)

    J = np.empty((n, n))
    for k in range(n):
        h = 1e-7
        sides = []
        for sign in (1.0, -1.0):
            scene.x[:] = x0
            scene.x[k] += sign * h
            sides.append(scene.step()[0])
        J[:, k] = (sides[0] - sides[1]) / (2 * h)
    gradient = ExtractGradient(out)
    assert np.abs(J).max() > 10.0
    np.testing.assert_allclose(gradient, J, rtol=1e-5, atol=1e-5 * np.abs(J).max())
