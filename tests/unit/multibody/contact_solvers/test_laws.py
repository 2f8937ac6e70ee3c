"""Contact laws: the impulse is the slope of the cost, G the slope of the impulse, friction stays in its cone."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from sheldrake.multibody.contact_solvers._kernels.laws import (
    LAGGED,
    SAP,
    SIMILAR,
    contact_impulse,
    contact_slope,
    lagged_cost,
    lagged_impulse,
    row_cost,
    row_impulse,
    sap_cone_cost,
    sap_cone_impulse,
    similar_cost,
    similar_impulse,
)

DT, K, D, FE0, N0, EPS = 1e-3, 5e5, 20.0, 30.0, 0.02, 1e-3


def contact(mu, **numbers):
    """A law takes anything with the fields it reads."""
    return SimpleNamespace(
        **{"stiffness": K, "dissipation": D, "friction": mu, "fe0": FE0, "n0": N0, "eps": EPS, "back": 0.0} | numbers
    )


def of(cost, impulse, *dt, **numbers):
    return lambda mu, vc: cost(contact(mu, **numbers), *dt, vc), lambda mu, vc: impulse(contact(mu, **numbers), *dt, vc)


LAWS = {
    "lagged": of(lagged_cost, lagged_impulse, DT),
    "similar": of(similar_cost, similar_impulse, DT),
    "elastic, was in": of(lagged_cost, lagged_impulse, DT, dissipation=0.0, back=-0.3 * FE0),
    "elastic, was out": of(similar_cost, similar_impulse, DT, dissipation=0.0, back=-1.5 * FE0),
    "sap": of(sap_cone_cost, sap_cone_impulse, R_t=0.05, R_n=0.4, vhat_n=0.02),
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


@pytest.mark.parametrize("back", [0.0, -0.3 * FE0, -1.5 * FE0])
@pytest.mark.parametrize("law", [LAGGED, SIMILAR, SAP])
def test_slopes_along_a_line_are_those_of_impulse_and_G(law, back):
    """A few digits are lost where curvature along the slip is a difference: |u|² less what is along it."""
    cone = {"R_t": 0.05, "R_n": 0.4, "vhat_n": 0.02}
    model, at = SimpleNamespace(law=law, dt=DT), contact(0.7, back=back, **cone)
    for vc, u in zip(velocities(3), velocities(4)):
        gamma, G = contact_impulse(model, at, vc)
        slope, curvature = contact_slope(model, at, vc, u)
        size = np.linalg.norm(u)
        np.testing.assert_allclose(slope, -u @ gamma, rtol=1e-12, atol=1e-14 * size * np.linalg.norm(gamma))
        scale = size**2 * np.abs(matrix(G)).max()
        np.testing.assert_allclose(curvature, u @ matrix(G) @ u, rtol=1e-12, atol=1e-13 * scale)


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
    row = SimpleNamespace(resistance=2.0, push=0.2, lower=-0.3, upper=0.4)
    for vc in (-1.0, -0.1, 0.0, 0.02, 2.0):
        gamma, G = row_impulse(row, vc)
        assert gamma == np.clip((0.1 - vc) / 0.5, -0.3, 0.4)
        assert G == (2.0 if -0.3 < (0.1 - vc) / 0.5 < 0.4 else 0.0)
        h = 1e-6
        slope = (row_cost(row, vc + h) - row_cost(row, vc - h)) / (2 * h)
        np.testing.assert_allclose(slope, -gamma, atol=1e-6)
