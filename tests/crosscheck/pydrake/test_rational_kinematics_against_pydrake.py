"""Rational poses of a chain: the same polynomials, coefficient by coefficient."""

import numpy as np
import pytest
from tests.libraries import names_of

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")

# Positions are in the order of s: pydrake takes q* of sliding joints by the index of s.
CHAIN = (("RevoluteJoint", [0, 0, 1]), ("PrismaticJoint", [0, 0.6, 0.8]), ("RevoluteJoint", [0.6, 0, 0.8]))
Q_STAR, Q = np.array([0.1, 0.2, 0.3]), np.array([0.5, -0.6, 0.7])


def library(name):
    return names_of(name, "math", "multibody.plant", "multibody.rational", "multibody.tree")


OURS, THEIRS = library("sheldrake"), library("pydrake")


def chain(L, slip=0.0):
    plant = L.MultibodyPlant(0.0)
    parent = plant.world_body()
    for i, (kind, axis) in enumerate(CHAIN):
        body = plant.AddRigidBody(f"b{i}", L.SpatialInertia.SolidCubeWithDensity(1000, 0.1))
        X = [L.RigidTransform(L.RollPitchYaw(0.1 * i, a, 0.3), [1 + slip, 2, a]) for a in (0.2, -0.4)]
        F = plant.AddFrame(L.FixedOffsetFrame(f"F{i}", parent.body_frame(), X[0]))
        M = plant.AddFrame(L.FixedOffsetFrame(f"M{i}", body.body_frame(), X[1]))
        plant.AddJoint(getattr(L, kind)(f"j{i}", F, M, axis))
        parent = body
    plant.Finalize()
    return L.RationalForwardKinematics(plant)


def coefficients(polynomial):
    return {
        tuple(sorted((v.get_name(), p) for v, p in m.get_powers().items())): c.Evaluate()
        for m, c in polynomial.monomial_to_coefficient_map().items()
    }


def tables(L, B, A, slip=0.0):
    """Coefficients of the polynomials of a pose, and of the rational functions they become."""
    kinematics = chain(L, slip)
    found = kinematics.CalcBodyPoseAsMultilinearPolynomial(Q_STAR, L.BodyIndex(B), L.BodyIndex(A))
    out = []
    for p in [*found.rotation().ravel(), *found.position()]:
        r = kinematics.ConvertMultilinearPolynomialToRationalFunction(p)
        out += [coefficients(p), coefficients(r.numerator()), coefficients(r.denominator())]
    return out


def differ(ours, theirs):
    keys = [set(a) | set(b) for a, b in zip(ours, theirs)]
    return max(abs(a.get(k, 0.0) - b.get(k, 0.0)) for a, b, ks in zip(ours, theirs, keys) for k in ks)


@pytest.mark.parametrize(("B", "A"), [(3, 0), (0, 3), (3, 1), (1, 2), (0, 1)])
def test_polynomials_are_pydrakes(B, A):
    assert differ(tables(OURS, B, A), tables(THEIRS, B, A)) < 1e-13


def test_a_planted_fault_is_caught():
    assert differ(tables(OURS, 3, 0, slip=1e-9), tables(THEIRS, 3, 0)) > 1e-10


@pytest.mark.parametrize("wrap", [False, True])
def test_values_are_pydrakes(wrap):
    for q in (Q, Q + np.array([3.0, 1.0, -2.0]), Q - [4.0, 0.0, 4.0]):
        ours, theirs = (chain(L).ComputeSValue(q, Q_STAR, wrap) for L in (OURS, THEIRS))
        np.testing.assert_allclose(ours, theirs, rtol=1e-13)
        if np.all(np.isfinite(ours)):
            back = (chain(L).ComputeQValue(ours, Q_STAR) for L in (OURS, THEIRS))
            np.testing.assert_allclose(*back, rtol=1e-13)
