import copy
import math
import pickle
import sys

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.common.cpp_param import List
from sheldrake.common.eigen_geometry import AngleAxis, Isometry3, Quaternion
from sheldrake.common.kernel import jit_enabled
from sheldrake.common.quick import FEW
from sheldrake.common.value import Value
from sheldrake.math import RigidTransform, RigidTransform_, RollPitchYaw, RollPitchYaw_, RotationMatrix, RotationMatrix_

QUARTER_X = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]
Q = Quaternion(math.sqrt(0.5), math.sqrt(0.5), 0, 0)
A = AngleAxis(math.pi / 2, [1, 0, 0])
RPY = RollPitchYaw(math.pi / 2, 0, 0)
R = RotationMatrix(QUARTER_X)


@pytest.mark.parametrize(
    "make",
    [
        lambda: RotationMatrix(R=QUARTER_X),
        lambda: RotationMatrix(quaternion=Q),
        lambda: RotationMatrix(theta_lambda=A),
        lambda: RotationMatrix(rpy=RPY),
        lambda: RotationMatrix(other=R),
        lambda: RotationMatrix.MakeXRotation(theta=math.pi / 2),
        lambda: RotationMatrix.MakeUnchecked(R=QUARTER_X),
        lambda: RotationMatrix.ProjectToRotationMatrix(M=np.multiply(QUARTER_X, 3.0)),
        lambda: RPY.ToRotationMatrix(),
        lambda: RigidTransform(pose=Isometry3(QUARTER_X, [1, 2, 3])).rotation(),
    ],
)
def test_rotation_constructors_agree(make):
    np.testing.assert_allclose(make().matrix(), QUARTER_X, atol=1e-15)


def test_quarter_turn_from_a_quaternion_is_exact():
    """The block of the demo lands flat only if z goes to y with no rounding at all."""
    turned = RotationMatrix(RotationMatrix.MakeXRotation(math.pi / 2).ToQuaternion())
    assert (turned.inverse() @ [0.0, 0.0, 1.0]).tolist() == [0.0, 1.0, 0.0]


@pytest.mark.parametrize("bad", [-np.eye(3), 2 * np.eye(3), np.full((3, 3), np.nan), np.zeros((3, 3))])
def test_a_matrix_that_is_no_rotation_is_refused(bad):
    with pytest.raises(RuntimeError, match="not a rotation matrix"):
        RotationMatrix(bad)
    with pytest.raises(RuntimeError):
        RotationMatrix().set(bad)
    with pytest.raises(RuntimeError):
        RigidTransform(np.hstack([bad, np.zeros((3, 1))]))
    assert RotationMatrix.MakeUnchecked(bad).matrix().shape == (3, 3)


def test_a_rounded_rotation_is_taken_as_it_is():
    rounded = [[0.707, -0.707, 0], [0.707, 0.707, 0], [0, 0, 1]]
    assert RotationMatrix(rounded).matrix().tolist() == rounded
    assert not RotationMatrix(rounded).IsValid() and R.IsValid()


@pytest.mark.parametrize(
    "make",
    [
        lambda: RotationMatrix([1, 2, 3]),
        lambda: RotationMatrix(3),
        lambda: RotationMatrix(None),
        lambda: R @ 3,
        lambda: R @ np.ones(4),
        lambda: R @ np.ones((1, 3)),
        lambda: R @ RigidTransform(),
        lambda: R @ R.cast[AutoDiffXd](),
        lambda: R.cast[AutoDiffXd]() @ R,
        lambda: RollPitchYaw(),
        lambda: RollPitchYaw([1, 2]),
        lambda: RollPitchYaw(A),
        lambda: RigidTransform(RPY),
        lambda: RigidTransform([1, 2, 3], [1, 2, 3]),
        lambda: RigidTransform(p=[AutoDiffXd(1), 2, 3]),
        lambda: RigidTransform() @ np.ones((4, 2)),
        lambda: RigidTransform() @ R,
        lambda: RigidTransform().set_rotation(np.eye(3)),
        lambda: RigidTransform().set_translation([1, 2]),
        lambda: RigidTransform_[AutoDiffXd](R, [1, 2, 3]),
        lambda: RigidTransform_[AutoDiffXd](RigidTransform()),
        lambda: RigidTransform().IsNearlyIdentity(None),
    ],
)
def test_wrong_types(make):
    with pytest.raises(TypeError, match=r"incompatible (constructor|function) arguments"):
        make()


@pytest.mark.parametrize("bad", [np.eye(3), np.ones((1, 3)), np.ones((4, 1)), [1, 2]])
def test_pose_array_of_wrong_shape(bad):
    with pytest.raises(RuntimeError, match="neither a position"):
        RigidTransform(bad)


@pytest.mark.parametrize("k", [0, 1, 2])
def test_from_one_vector(k):
    b = np.array([1.0, -2.0, 3.0])
    made = RotationMatrix.MakeFromOneVector(b_A=b, axis_index=k)
    assert made.IsValid()
    np.testing.assert_allclose(made.col(k), b / np.linalg.norm(b), atol=1e-15)
    assert made.col((k + 1) % 3)[0] == 0.0
    with pytest.raises(RuntimeError, match="cannot normalize"):
        RotationMatrix.MakeFromOneVector([0, 0, 1e-11], k)
    with pytest.raises(RuntimeError, match="cannot normalize"):
        RotationMatrix.MakeFromOneVector([0, 0, np.nan], k)
    with pytest.raises(RuntimeError, match="axis_index"):
        RotationMatrix.MakeFromOneVector(b, 3)


def test_projection_of_a_reflection_is_refused():
    with pytest.raises(RuntimeError, match="reflection"):
        RotationMatrix.ProjectToRotationMatrix(-np.eye(3))


def test_rows_and_columns():
    assert R.row(1).tolist() == [0.0, 0.0, -1.0] and R.col(index=1).tolist() == [0.0, 0.0, 1.0]
    assert not R.row(0).flags.writeable
    with pytest.raises(IndexError):
        R.row(3)
    numbers = R.matrix()
    numbers[0, 0] = 5.0
    assert R.matrix()[0, 0] == 1.0


def test_gimbal_lock_is_refused_for_rates_only():
    locked = RollPitchYaw(0.0, math.pi / 2, 0.0)
    locked.CalcRotationMatrixDt([1, 2, 3])
    locked.CalcAngularVelocityInParentFromRpyDt([1, 2, 3])
    for call in (locked.CalcRpyDtFromAngularVelocityInParent, locked.CalcRpyDtFromAngularVelocityInChild):
        with pytest.raises(RuntimeError, match=r"90 degrees is within 0\.458371 degrees of gimbal-lock"):
            call([1, 2, 3])
    np.testing.assert_allclose(RollPitchYaw(RotationMatrix(locked)).vector(), [0, math.pi / 2, 0])


def test_rates_are_derivatives_of_the_rotation():
    rpy0, rates, h = np.array([0.3, -0.7, 2.0]), np.array([0.4, 0.5, -0.6]), 1e-6
    rpy = RollPitchYaw(rpy0)
    plus, minus = (RollPitchYaw(rpy0 + s * h * rates).ToRotationMatrix().matrix() for s in (1, -1))
    Rdt = rpy.CalcRotationMatrixDt(rates)
    np.testing.assert_allclose(Rdt, (plus - minus) / (2 * h), atol=1e-9)
    cross = Rdt @ rpy.ToRotationMatrix().matrix().T
    w_A = np.array([cross[2, 1], cross[0, 2], cross[1, 0]])
    np.testing.assert_allclose(rpy.CalcAngularVelocityInParentFromRpyDt(rates), w_A, atol=1e-15)
    w_D = rpy.ToRotationMatrix().inverse() @ w_A
    np.testing.assert_allclose(rpy.CalcAngularVelocityInChildFromRpyDt(rates), w_D, atol=1e-15)
    np.testing.assert_allclose(rpy.CalcRpyDtFromAngularVelocityInParent(w_A), rates, atol=1e-15)
    np.testing.assert_allclose(rpy.CalcRpyDtFromAngularVelocityInChild(w_D), rates, atol=1e-15)


def test_second_derivatives_of_the_angles():
    rpy0, rates, accelerations, h = (
        np.array([0.3, -0.7, 2.0]),
        np.array([0.4, 0.5, -0.6]),
        np.array([1.0, 2.0, -3.0]),
        1e-6,
    )

    def w(t, frame):
        at = RollPitchYaw(rpy0 + rates * t + accelerations * t * t / 2)
        return getattr(at, f"CalcAngularVelocityIn{frame}FromRpyDt")(rates + accelerations * t)

    rpy = RollPitchYaw(rpy0)
    alpha_A, alpha_D = ((w(h, frame) - w(-h, frame)) / (2 * h) for frame in ("Parent", "Child"))
    got = rpy.CalcRpyDDtFromRpyDtAndAngularAccelInParent(rpyDt=rates, alpha_AD_A=alpha_A)
    np.testing.assert_allclose(got, accelerations, atol=1e-8)
    got = rpy.CalcRpyDDtFromAngularAccelInChild(rpyDt=rates, alpha_AD_D=alpha_D)
    np.testing.assert_allclose(got, accelerations, atol=1e-8)


@pytest.mark.parametrize(
    "make",
    [
        lambda: RigidTransform(R=R, p=[1, 2, 3]),
        lambda: RigidTransform(R, np.array([1.0, 2.0, 3.0])),
        lambda: RigidTransform(rpy=RPY, p=[1, 2, 3]),
        lambda: RigidTransform(quaternion=Q, p=[[1], [2], [3]]),
        lambda: RigidTransform(theta_lambda=A, p=(1, 2, 3)),
        lambda: RigidTransform(Isometry3(QUARTER_X, [1, 2, 3])),
        lambda: RigidTransform(pose=np.hstack([QUARTER_X, [[1], [2], [3]]])),
        lambda: RigidTransform(Isometry3(QUARTER_X, [1, 2, 3]).matrix()),
        lambda: RigidTransform(other=RigidTransform(R, [1, 2, 3])),
        lambda: RigidTransform.MakeUnchecked(pose=np.hstack([QUARTER_X, [[1], [2], [3]]])),
    ],
)
def test_pose_constructors_agree(make):
    X = make()
    np.testing.assert_allclose(X.rotation().matrix(), QUARTER_X, atol=1e-15)
    assert X.translation().tolist() == [1.0, 2.0, 3.0]
    np.testing.assert_allclose(X.GetAsIsometry3().matrix(), X.GetAsMatrix4())
    assert X.GetAsMatrix4()[3].tolist() == [0.0, 0.0, 0.0, 1.0]


def test_pose_products():
    X = RigidTransform(R, [1, 2, 3])
    assert (X @ [0, 0, 1]).tolist() == X.multiply(p_BoQ_B=[0, 0, 1]).tolist() == [1.0, 1.0, 3.0]
    assert (X @ np.zeros((3, 2))).tolist() == [[1, 1], [2, 2], [3, 3]]
    assert (X @ np.ones((3, 1))).shape == (3, 1)
    assert X.multiply(vec_B=[0, 0, 1, 1]).tolist() == [1.0, 1.0, 3.0, 1.0]
    assert X.multiply([0, 0, 1, 0]).tolist() == [0.0, -1.0, 0.0, 0.0]
    with pytest.raises(RuntimeError, match="neither 0"):
        X @ [1, 2, 3, 4]
    np.testing.assert_allclose((X @ X).GetAsMatrix4(), X.GetAsMatrix4() @ X.GetAsMatrix4(), atol=1e-15)
    np.testing.assert_allclose(X.inverse().GetAsMatrix4(), np.linalg.inv(X.GetAsMatrix4()), atol=1e-15)


def test_setters_change_the_rotation_in_place():
    source = RotationMatrix(QUARTER_X)
    X = RigidTransform(source, [1, 2, 3])
    kept = X.rotation()
    assert kept is X.rotation()
    X.set_rotation(RollPitchYaw(0, 0, 0))
    assert kept.IsExactlyIdentity() and source.matrix().tolist() == QUARTER_X
    kept.set(QUARTER_X)
    assert X.rotation().matrix().tolist() == QUARTER_X
    X.set_translation(p=[4, 5, 6])
    assert X.translation().tolist() == [4, 5, 6]
    X.set(R=RotationMatrix(), p=[0, 0, 0])
    assert X.IsExactlyIdentity()
    X.set_rotation(theta_lambda=A)
    assert not X.IsNearlyIdentity(1.0)
    assert X.SetIdentity() is X and X.IsNearlyIdentity(translation_tolerance=0)
    X.SetFromIsometry3(pose=Isometry3(QUARTER_X, [1, 2, 3]))
    assert X.translation().tolist() == [1, 2, 3]


def test_a_pose_does_not_follow_the_array_it_was_made_from():
    p = np.array([1.0, 2.0, 3.0])
    X = RigidTransform(RotationMatrix(), p)
    p[:] = 0.0
    assert X.translation().tolist() == [1.0, 2.0, 3.0]
    with pytest.raises(ValueError):
        X.translation()[0] = 9.0


def test_comparisons():
    X, Y = RigidTransform([1, 2, 3]), RigidTransform([1, 2, 3.5])
    assert X.IsExactlyEqualTo(RigidTransform([1, 2, 3])) and not X.IsExactlyEqualTo(Y)
    assert X.GetMaximumAbsoluteDifference(other=Y) == 0.5
    assert X.GetMaximumAbsoluteTranslationDifference(other=Y) == 0.5
    assert X.IsNearlyEqualTo(other=Y, tolerance=0.5) and not X.IsNearlyEqualTo(Y, 0.4)
    assert RotationMatrix.MakeXRotation(1e-14).IsNearlyIdentity()
    assert not RotationMatrix.MakeXRotation(1e-13).IsNearlyIdentity()
    assert RotationMatrix.MakeXRotation(1e-13).IsNearlyIdentity(tolerance=1e-12)


@pytest.mark.parametrize("value", [R, RPY, RigidTransform(R, [1, 2, 3])])
def test_copies_and_pickles(value):
    for twin in (copy.copy(value), copy.deepcopy(value), pickle.loads(pickle.dumps(value))):
        assert type(twin) is type(value) and twin is not value and repr(twin) == repr(value)
    if not isinstance(value, RollPitchYaw):
        dual = value.cast[AutoDiffXd]()
        assert repr(pickle.loads(pickle.dumps(dual))) == repr(dual)


def test_copy_has_its_own_rotation():
    X = RigidTransform(R, [1, 2, 3])
    Y = copy.copy(X)
    Y.rotation().set(np.eye(3))
    assert X.rotation().matrix().tolist() == QUARTER_X


def test_users_subclass():
    class Named(RigidTransform):
        pass

    X = Named([1, 2, 3])
    assert type(X @ X) is RigidTransform and type(X.inverse()) is RigidTransform
    assert type(RigidTransform() @ X) is RigidTransform


def test_autodiff_derivatives():
    theta = AutoDiffXd(0.3, [1.0])
    X = RigidTransform_[AutoDiffXd](RotationMatrix_[AutoDiffXd].MakeZRotation(theta), [theta, 2, 3])
    q = (X @ [1.0, 0.0, 0.0]).tolist()
    np.testing.assert_allclose(q[0].derivatives(), [1 - math.sin(0.3)])
    np.testing.assert_allclose(q[1].derivatives(), [math.cos(0.3)])
    assert type(X @ X.inverse()) is RigidTransform_[AutoDiffXd]
    assert (X @ X.inverse()).IsNearlyIdentity(1e-15)
    assert type(RigidTransform_(p=[theta, 2, 3])) is RigidTransform_[AutoDiffXd]
    assert type(RigidTransform_(p=[1, 2, 3])) is RigidTransform
    yaw = X.rotation().ToRollPitchYaw().yaw_angle()
    assert yaw.value() == pytest.approx(0.3) and yaw.derivatives() == pytest.approx([1.0])
    assert type(RollPitchYaw_[AutoDiffXd]([theta, 0, 0])) is RollPitchYaw_[AutoDiffXd]


def test_values_hold_poses_by_copy():
    X = RigidTransform([1, 2, 3])
    value = Value(X)
    assert type(value) is Value[RigidTransform]
    kept = value.get_value()
    X.set_translation([0, 0, 0])
    assert kept.translation().tolist() == [1, 2, 3]
    value.set_value(RigidTransform([4, 5, 6]))
    assert kept.translation().tolist() == [4, 5, 6]
    assert Value[RigidTransform]([7, 8, 9]).get_value().translation().tolist() == [7, 8, 9]
    assert type(Value([X])) is Value[List[RigidTransform]]
    assert type(Value(X.cast[AutoDiffXd]())) is Value[RigidTransform_[AutoDiffXd]]
    with pytest.raises(TypeError):
        value.set_value([1, 2, 3])


def test_names():
    assert repr(RigidTransform([1, 2, 3])) == (
        "RigidTransform(\n  R=RotationMatrix([\n    [1.0, 0.0, 0.0],\n    [0.0, 1.0, 0.0],\n"
        "    [0.0, 0.0, 1.0],\n  ]),\n  p=[1.0, 2.0, 3.0],\n)"
    )
    assert repr(RollPitchYaw(1, 2, 3)) == "RollPitchYaw(roll=1.0, pitch=2.0, yaw=3.0)"
    assert RigidTransform.__module__ == "sheldrake.math"
    assert str(RotationMatrix_) == "<TemplateClass sheldrake.math.RotationMatrix_>"


def test_construction_and_composition_are_cheap():
    """In calls, Python's and NumPy's, which do not depend on how busy the machine is."""
    p = np.array([1.0, 2.0, 3.0])
    X = RigidTransform(R, p)
    for _ in range(FEW + 1):  # short ways are there now
        X @ RigidTransform(R, p)
    calls = []
    sys.setprofile(lambda frame, event, arg: calls.append(event) if event in ("call", "c_call") else None)
    try:
        X @ RigidTransform(R, p)
    finally:
        sys.setprofile(None)
    assert len(calls) <= (10 if jit_enabled() else 17)  # without native code there is one call for each short way


def test_rotations_are_compared_number_by_number():
    R, other = RotationMatrix.MakeXRotation(0.1), RotationMatrix()
    assert R.IsExactlyEqualTo(R) and not R.IsExactlyEqualTo(other)
    assert R.IsNearlyEqualTo(other, tolerance=0.1) and not R.IsNearlyEqualTo(other, 0.09)
    rpy = RollPitchYaw(1.0, 2.0, 3.0)
    assert rpy.IsNearlyEqualTo(RollPitchYaw(1.0, 2.0, 3.1), 0.11)
    assert not rpy.IsNearlyEqualTo(RollPitchYaw(1.0, 2.0, 3.1), tolerance=0.09)
