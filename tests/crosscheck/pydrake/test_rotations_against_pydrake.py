"""Rotations and poses give pydrake's numbers: the same bits where the operation order is fixed."""

import math

import numpy as np
import pytest

from sheldrake.common.eigen_geometry import AngleAxis, Quaternion
from sheldrake.math import RigidTransform, RollPitchYaw, RotationMatrix

pe = pytest.importorskip("pydrake.common.eigen_geometry")
pm = pytest.importorskip("pydrake.math")
pytestmark = pytest.mark.peer


def quaternions(count, seed=0):
    rng = np.random.default_rng(seed)
    yield np.array([math.cos(math.pi / 4), math.sin(math.pi / 4), 0, 0])
    yield np.array([math.cos(math.pi / 4), 0, math.sin(math.pi / 4), 0])
    for i in range(count):
        q = rng.normal(size=4)
        if i % 4 == 0:
            q[i % 16 // 4] = 0.0
        yield q / np.linalg.norm(q)


def exact(ours, theirs):
    assert np.asarray(ours).tolist() == np.asarray(theirs).tolist()


def close(ours, theirs, tolerance=2e-15):
    np.testing.assert_allclose(ours, theirs, rtol=tolerance, atol=tolerance)


@pytest.mark.parametrize("q", list(quaternions(60)))
def test_conversions(q):
    R, pR = RotationMatrix(Quaternion(q)), pm.RotationMatrix(pe.Quaternion(q))
    exact(R.matrix(), pR.matrix())
    exact(Quaternion(q).rotation(), pe.Quaternion(q).rotation())
    close(R.ToQuaternion().wxyz(), pR.ToQuaternion().wxyz(), 3e-16)
    close(R.ToAngleAxis().axis(), pR.ToAngleAxis().axis())
    close(R.ToAngleAxis().angle(), pR.ToAngleAxis().angle())
    close(R.ToRollPitchYaw().vector(), pR.ToRollPitchYaw().vector())
    exact(RollPitchYaw(Quaternion(q)).vector(), pm.RollPitchYaw(pe.Quaternion(q)).vector())
    close(Quaternion(R.matrix()).wxyz(), pe.Quaternion(R.matrix()).wxyz())
    axis = np.array([q[1], q[2], 0.5])
    axis /= np.linalg.norm(axis)
    exact(RotationMatrix(AngleAxis(q[0], axis)).matrix(), pm.RotationMatrix(pe.AngleAxis(q[0], axis)).matrix())
    for k in range(3):
        ours, theirs = RotationMatrix.MakeFromOneVector(q[1:], k), pm.RotationMatrix.MakeFromOneVector(q[1:], k)
        exact(ours.matrix(), theirs.matrix())
    M = R.matrix() + 0.1 * np.outer(q[1:], q[:3])
    ours, theirs = RotationMatrix.ProjectToRotationMatrix(M), pm.RotationMatrix.ProjectToRotationMatrix(M)
    close(ours.matrix(), theirs.matrix(), 1e-14)


def test_canonical_quaternion_has_drakes_bits():
    """One in a few hundred may differ where Eigen contracts a product and a sum."""
    pairs = [(RotationMatrix(Quaternion(q)), pm.RotationMatrix(pe.Quaternion(q))) for q in quaternions(300, 1)]
    same = sum(a.ToQuaternion().wxyz().tolist() == b.ToQuaternion().wxyz().tolist() for a, b in pairs)
    assert same >= 295


@pytest.mark.parametrize("seed", range(20))
def test_roll_pitch_yaw(seed):
    rng = np.random.default_rng(seed)
    rpy = rng.uniform([-6, -1.4, -6], [6, 1.4, 6])
    a, b = RollPitchYaw(rpy), pm.RollPitchYaw(rpy)
    rates, accelerations = rng.normal(size=3), rng.normal(size=3)
    exact(a.ToRotationMatrix().matrix(), b.ToRotationMatrix().matrix())
    exact(a.ToQuaternion().wxyz(), b.ToQuaternion().wxyz())
    for name in (
        "CalcRotationMatrixDt",
        "CalcAngularVelocityInParentFromRpyDt",
        "CalcAngularVelocityInChildFromRpyDt",
        "CalcRpyDtFromAngularVelocityInParent",
        "CalcRpyDtFromAngularVelocityInChild",
    ):
        close(getattr(a, name)(rates), getattr(b, name)(rates), 1e-14)
    for name in ("CalcRpyDDtFromRpyDtAndAngularAccelInParent", "CalcRpyDDtFromAngularAccelInChild"):
        close(getattr(a, name)(rates, accelerations), getattr(b, name)(rates, accelerations), 1e-12)


@pytest.mark.parametrize("q", list(quaternions(20, 2)))
def test_poses(q):
    X, pX = RigidTransform(Quaternion(q), q[1:] * 3), pm.RigidTransform(pe.Quaternion(q), q[1:] * 3)
    Y, pY = RigidTransform(RollPitchYaw(q[:3]), q[1:]), pm.RigidTransform(pm.RollPitchYaw(q[:3]), q[1:])
    close((X @ Y).GetAsMatrix34(), (pX @ pY).GetAsMatrix34())
    close(X.inverse().GetAsMatrix4(), pX.inverse().GetAsMatrix4())
    close(X.InvertAndCompose(Y).GetAsMatrix34(), pX.InvertAndCompose(pY).GetAsMatrix34())
    close(X @ np.outer(q[:3], q), pX @ np.outer(q[:3], q))
    close(X.GetMaximumAbsoluteDifference(Y), pX.GetMaximumAbsoluteDifference(pY))
    assert repr(X) == repr(pX) and repr(RollPitchYaw(q[:3])) == repr(pm.RollPitchYaw(q[:3]))
    a, b = Quaternion(q), Y.rotation().ToQuaternion()
    pa, pb = pe.Quaternion(q), pY.rotation().ToQuaternion()
    close((a @ b).wxyz(), (pa @ pb).wxyz())
    close(a.slerp(0.3, b).wxyz(), pa.slerp(0.3, pb).wxyz())


def test_the_comparison_notices_a_planted_fault():
    """The transposed rotation, or one rounding too many in the quaternion formula, must not pass."""
    q = np.array([0.5, 0.1, -0.7, 0.2])
    q /= np.linalg.norm(q)
    theirs = pm.RotationMatrix(pe.Quaternion(q)).matrix()
    with pytest.raises(AssertionError):
        exact(RotationMatrix(Quaternion(q)).inverse().matrix(), theirs)
    with pytest.raises(AssertionError):
        exact(RotationMatrix(Quaternion(q)).matrix() * (1 + 3e-16), theirs)
