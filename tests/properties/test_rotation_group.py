"""Rotations and poses form groups, and all their representations are one rotation."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sheldrake.common.eigen_geometry import AngleAxis, Quaternion
from sheldrake.math import RigidTransform, RollPitchYaw, RotationMatrix

TIGHT = 1e-13  # a few hundred roundings of numbers up to ten
angles = st.floats(-math.pi, math.pi)
coordinates = st.floats(-10, 10)
vectors = st.tuples(coordinates, coordinates, coordinates).map(np.array)
numbers = st.floats(-1, 1)
quaternions = (
    st.tuples(numbers, numbers, numbers, numbers)
    .filter(lambda q: np.linalg.norm(q) > 1e-3)
    .map(lambda q: Quaternion(np.array(q) / np.linalg.norm(q)))
)
rotations = quaternions.map(RotationMatrix)
poses = st.builds(RigidTransform, rotations, vectors)


def assert_same(a, b, tolerance=TIGHT):
    assert a.IsNearlyEqualTo(b, tolerance), (a, b)


@given(poses, poses, poses)
def test_poses_are_a_group(a, b, c):
    assert_same((a @ b) @ c, a @ (b @ c))
    assert_same(a @ RigidTransform(), a, 0)
    assert_same(a @ a.inverse(), RigidTransform())
    assert_same(a.InvertAndCompose(b), a.inverse() @ b)
    assert (a @ b).rotation().IsValid()


@given(poses, poses, vectors)
def test_products_act_in_order(a, b, p):
    np.testing.assert_allclose((a @ b) @ p, a @ (b @ p), atol=TIGHT * 10)
    np.testing.assert_allclose(a @ np.array([p, -p]).T, np.array([a @ p, a @ -p]).T, atol=1e-15)


@given(rotations)
def test_every_representation_is_the_same_rotation(R):
    q = R.ToQuaternion()
    assert q.w() >= 0.0
    for twin in (
        RotationMatrix(q),
        RotationMatrix(R.ToAngleAxis()),
        RotationMatrix(R.ToRollPitchYaw()),
        RotationMatrix(R.ToRollPitchYaw().ToQuaternion()),
        RotationMatrix(q.rotation()),
        RotationMatrix.ProjectToRotationMatrix(R.matrix()),
    ):
        np.testing.assert_allclose(twin.matrix(), R.matrix(), atol=TIGHT)


@given(angles, st.floats(-1.5, 1.5), angles)
def test_roll_pitch_yaw_round_trip(roll, pitch, yaw):
    back = RollPitchYaw(RollPitchYaw(roll, pitch, yaw).ToRotationMatrix()).vector()
    difference = (back - [roll, pitch, yaw] + math.pi) % (2 * math.pi) - math.pi
    np.testing.assert_allclose(difference, 0.0, atol=1e-12)


@given(st.floats(-20, 20), vectors.filter(lambda v: np.linalg.norm(v) > 1e-3))
def test_rotation_about_an_axis_keeps_it(angle, axis):
    axis = axis / np.linalg.norm(axis)
    R = RotationMatrix(AngleAxis(angle, axis))
    np.testing.assert_allclose(R @ axis, axis, atol=TIGHT)
    assert R.IsValid()


@given(vectors.filter(lambda v: np.linalg.norm(v) > 1e-6), st.integers(0, 2))
def test_frame_from_one_vector_is_right_handed(b, k):
    R = RotationMatrix.MakeFromOneVector(b, k)
    assert R.IsValid()
    np.testing.assert_allclose(R.col(k) * np.linalg.norm(b), b, atol=TIGHT * 10)


@given(quaternions, quaternions, vectors)
def test_quaternion_product_is_the_rotation_product(a, b, v):
    np.testing.assert_allclose((a @ b).rotation(), a.rotation() @ b.rotation(), atol=TIGHT)
    np.testing.assert_allclose(a @ v, a.rotation() @ v, atol=TIGHT * 10)
    np.testing.assert_allclose((a @ a.inverse()).wxyz(), [1, 0, 0, 0], atol=TIGHT)
