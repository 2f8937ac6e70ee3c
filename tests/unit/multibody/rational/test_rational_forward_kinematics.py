"""Poses as rational functions against the kinematics of the plant."""

import math

import numpy as np
import pytest

from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.rational import RationalForwardKinematics
from sheldrake.multibody.tree import BodyIndex, FixedOffsetFrame, PrismaticJoint, RevoluteJoint, SpatialInertia
from sheldrake.symbolic import Expression, Polynomial, Variable

CUBE = SpatialInertia.SolidCubeWithDensity(1000, 0.1)
Q_STAR, Q = np.array([0.1, 0.2, 0.3, 0.4]), np.array([0.5, -0.6, 0.7, 0.2])


def pose(*numbers):
    return RigidTransform(RollPitchYaw(*numbers[:3]), numbers[3:])


def tree():
    """Two branches: a turns, b turns on it, a welded piece, e slides on that; c slides on the world."""
    plant, bodies = MultibodyPlant(0.0), {}
    for i, (name, parent, kind, axis) in enumerate(
        (
            ("a", None, RevoluteJoint, [0, 0, 1]),
            ("c", None, PrismaticJoint, [0, 0.6, 0.8]),
            ("b", "a", RevoluteJoint, [0, 0.6, 0.8]),
            ("d", "b", None, None),
            ("e", "d", PrismaticJoint, [1, 0, 0]),
        )
    ):
        body = bodies[name] = plant.AddRigidBody(name, CUBE)
        P = bodies[parent] if parent else plant.world_body()
        F = plant.AddFrame(FixedOffsetFrame(f"{name}F", P.body_frame(), pose(0.1 * i, 0.2, 0.3, 1, 2, 3)))
        M = plant.AddFrame(FixedOffsetFrame(f"{name}M", body.body_frame(), pose(0.3, 0.1 * i, 0, 0.1, 0.2, 0.3)))
        if kind is None:
            plant.WeldFrames(F, M, pose(0.1, 0.2, 0.3, 0.4, 0.5, 0.6))
        else:
            plant.AddJoint(kind(f"{name}j", F, M, axis))
    plant.Finalize()
    return plant


@pytest.fixture
def kinematics():
    return RationalForwardKinematics(tree())


@pytest.mark.parametrize(("B", "A"), [(5, 0), (0, 5), (2, 1), (5, 2), (1, 5), (4, 3), (3, 3)])
def test_rational_poses_are_the_plants(kinematics, B, A):
    plant = kinematics.plant()
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, Q)
    X_AB = plant.CalcRelativeTransform(
        context, plant.get_body(BodyIndex(A)).body_frame(), plant.get_body(BodyIndex(B)).body_frame()
    )
    found = kinematics.CalcBodyPoseAsMultilinearPolynomial(Q_STAR, BodyIndex(B), BodyIndex(A))
    at = dict(zip(kinematics.s(), kinematics.ComputeSValue(Q, Q_STAR)))
    convert = kinematics.ConvertMultilinearPolynomialToRationalFunction
    elements = np.hstack((found.rotation(), found.position()[:, None]))
    values = np.array([convert(p).Evaluate(at) for p in elements.ravel()]).reshape(3, 4)
    assert values == pytest.approx(X_AB.GetAsMatrix34(), abs=1e-14)
    assert all(p.Degree(v) <= 1 for p in elements.ravel() for v in p.indeterminates())


def test_positions_and_s_belong_together(kinematics):
    s = kinematics.ComputeSValue(Q, Q_STAR)
    assert kinematics.ComputeQValue(s, Q_STAR) == pytest.approx(Q, abs=1e-15)
    assert sorted(s) == pytest.approx(sorted([math.tan(0.2), math.tan(-0.4), 0.4, -0.2]))
    names = [v.get_name() for v in kinematics.s()]
    assert names == ["s[0]", "s[1]", "s[2]", "s[3]"]


def test_half_turns_may_be_infinite(kinematics):
    far = Q_STAR + np.array([math.pi, -3.5, 1.0, 2.0])
    assert np.sum(np.isinf(kinematics.ComputeSValue(far, Q_STAR, angles_wrap_to_inf=True))) == 2
    assert np.all(np.isfinite(kinematics.ComputeSValue(far, Q_STAR)))


def test_expressions_become_expressions(kinematics):
    x = [Variable(f"x{i}") for i in range(4)]
    expressions = np.array([Expression(v) for v in x])
    at = dict(zip(x, Q))
    s = [e.Evaluate(at) for e in kinematics.ComputeSValue(expressions, Q_STAR)]
    assert s == pytest.approx(kinematics.ComputeSValue(Q, Q_STAR))
    q = [e.Evaluate(dict(zip(x, s))) for e in kinematics.ComputeQValue(expressions, Q_STAR)]
    assert q == pytest.approx(Q)


def test_what_is_refused(kinematics):
    cos_delta = next(
        iter(kinematics.CalcBodyPoseAsMultilinearPolynomial(Q_STAR, 1, 0).rotation()[0, 0].indeterminates())
    )
    for call, message in (
        (lambda: kinematics.ComputeSValue(Q[:2], Q_STAR), "has 2 values, expected 4"),
        (lambda: kinematics.CalcBodyPoseAsMultilinearPolynomial(Q_STAR, BodyIndex(9), BodyIndex(0)), "no body 9"),
        (
            lambda: kinematics.ConvertMultilinearPolynomialToRationalFunction(Polynomial(Expression(cos_delta) ** 2)),
            "not multilinear",
        ),
        (lambda: RationalForwardKinematics(MultibodyPlant(0.0)), "not finalized"),
    ):
        with pytest.raises(RuntimeError, match=message):
            call()
    plant = MultibodyPlant(0.0)
    plant.AddRigidBody("free", CUBE)
    plant.Finalize()
    with pytest.raises(RuntimeError, match="only weld, revolute and prismatic"):
        RationalForwardKinematics(plant)
