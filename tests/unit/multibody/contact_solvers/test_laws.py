"""Contact laws: the impulse is the slope of the cost, G the slope of the impulse, friction stays in its cone."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.multibody.contact_solvers._kernels.lagged import lagged_cost, lagged_impulse
from sheldrake.multibody.contact_solvers._kernels.sap_cone import sap_cone_cost, sap_cone_impulse
from sheldrake.multibody.contact_solvers._kernels.scalar_row import row_cost, row_impulse
from sheldrake.multibody.contact_solvers._kernels.similar import similar_cost, similar_impulse

DT, K, D, FE0, N0, EPS = 1e-3, 5e5, 20.0, 30.0, 0.02, 1e-3
LAWS = {
    "lagged": (
        lambda mu, vc: lagged_cost(K, D, mu, FE0, 0.0, N0, EPS, DT, vc),
        lambda mu, vc: lagged_impulse(K, D, mu, FE0, 0.0, N0, EPS, DT, vc),
    ),
    "similar": (
        lambda mu, vc: similar_cost(K, D, mu, FE0, 0.0, EPS, DT, vc),
        lambda mu, vc: similar_impulse(K, D, mu, FE0, 0.0, EPS, DT, vc),
    ),
    "elastic, was in": (
        lambda mu, vc: lagged_cost(K, 0.0, mu, FE0, -0.3 * FE0, N0, EPS, DT, vc),
        lambda mu, vc: lagged_impulse(K, 0.0, mu, FE0, -0.3 * FE0, N0, EPS, DT, vc),
    ),
    "elastic, was out": (
        lambda mu, vc: similar_cost(K, 0.0, mu, FE0, -1.5 * FE0, EPS, DT, vc),
        lambda mu, vc: similar_impulse(K, 0.0, mu, FE0, -1.5 * FE0, EPS, DT, vc),
    ),
    "sap": (
        lambda mu, vc: sap_cone_cost(mu, 0.05, 0.4, 0.02, vc),
        lambda mu, vc: sap_cone_impulse(mu, 0.05, 0.4, 0.02, vc),
    ),
}


def matrix(G):
    xx, xy, yy, xz, yz, zz = G
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def velocities(seed=0):
    """Sticking, sliding, separating, pressing."""
    rng = np.random.default_rng(seed)
    for scale in (1e-4, 1e-2, 1.0):
        for _ in range(30):
            yield rng.normal(0, scale, 3)


def central(f, vc, h):
    return np.array([(np.asarray(f(vc + h * e)) - np.asarray(f(vc - h * e))) / (2 * h) for e in np.eye(3)]).T


@pytest.mark.parametrize("mu", [0.0, 0.5, 1.3])
@pytest.mark.parametrize("law", LAWS)
def test_impulse_is_the_slope_of_the_cost(law, mu):
    cost, impulse = LAWS[law]
    h, smooth = 1e-7, 0
    for vc in velocities():
        gamma, G = impulse(mu, vc)
        around = [impulse(mu, vc + s * h * e) for e in np.eye(3) for s in (-2.0, 2.0)]
        change = max(np.abs(np.subtract(g, gamma)).max() for g, _ in around)
        slope = central(lambda v: cost(mu, v), vc, h)
        np.testing.assert_allclose(slope, -np.array(gamma), rtol=1e-6, atol=1e-8 + change)
        if all(np.allclose(matrix(other), matrix(G), rtol=1e-2, atol=1e-9) for _, other in around):
            smooth += 1
            slope = -central(lambda v: impulse(mu, v)[0], vc, h)
            np.testing.assert_allclose(matrix(G), slope, rtol=0, atol=1e-3 * np.abs(slope).max() + 1e-7)
    assert smooth > 60


@pytest.mark.parametrize("law", LAWS)
def test_cost_is_convex(law):
    for vc in velocities(1):
        eigenvalues = np.linalg.eigvalsh(matrix(LAWS[law][1](0.7, vc)[1]))
        assert eigenvalues.min() >= -1e-9 * max(eigenvalues.max(), 1.0)


@pytest.mark.parametrize("law", LAWS)
def test_friction_opposes_slip_and_stays_in_its_cone(law):
    mu = 0.7
    for vc in velocities(2):
        gamma, _ = LAWS[law][1](mu, vc)
        normal = N0 if law in ("lagged", "elastic, was in") else gamma[2]  # lagged: the cone of the step's start
        assert gamma[2] >= 0.0
        assert np.hypot(gamma[0], gamma[1]) <= mu * normal * (1 + 1e-12) + 1e-15
        assert gamma[0] * vc[0] + gamma[1] * vc[1] <= 0.0


def test_a_scalar_row_is_clamped():
    for vc in (-1.0, -0.1, 0.0, 0.02, 2.0):
        gamma, G = row_impulse(0.5, 0.1, -0.3, 0.4, vc)
        assert gamma == np.clip((0.1 - vc) / 0.5, -0.3, 0.4)
        assert G == (2.0 if -0.3 < (0.1 - vc) / 0.5 < 0.4 else 0.0)
        h = 1e-6
        slope = (row_cost(0.5, 0.1, -0.3, 0.4, vc + h) - row_cost(0.5, 0.1, -0.3, 0.4, vc - h)) / (2 * h)
        np.testing.assert_allclose(slope, -gamma, atol=1e-6)
