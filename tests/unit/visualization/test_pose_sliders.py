"""MeshcatPoseSliders: six sliders and the pose they stand for."""

import numpy as np
import pytest

from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.systems.analysis import Simulator
from sheldrake.visualization import MeshcatPoseSliders

POSE = RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [0.4, 0.5, 0.6])


def pose_of(sliders, context=None):
    return sliders.get_output_port().Eval(context or sliders.CreateDefaultContext())


def test_the_pose_follows_the_sliders(meshcat):
    sliders = MeshcatPoseSliders(meshcat, POSE)
    assert meshcat.GetSliderNames() == ["pitch", "roll", "x", "y", "yaw", "z"]
    context = sliders.CreateDefaultContext()
    assert pose_of(sliders, context).IsNearlyEqualTo(POSE, 1e-12)
    meshcat.SetSliderValue("x", -9)
    assert pose_of(sliders, context).translation() == pytest.approx([-1, 0.5, 0.6])
    meshcat._hub.controls.receive({"type": "key", "code": "KeyO"})
    assert pose_of(sliders, context).translation() == pytest.approx([-1, 0.5, 0.61])


def test_set_pose_outlives_the_sliders(meshcat):
    sliders = MeshcatPoseSliders(meshcat, prefix="hand")
    assert meshcat.GetSliderNames()[0] == "hand_pitch"
    sliders.SetPose(POSE)
    assert meshcat.GetSliderValue("hand_yaw") == pytest.approx(0.3)
    sliders.Delete()
    assert meshcat.GetSliderNames() == [] and pose_of(sliders).IsNearlyEqualTo(POSE, 1e-12)


def test_hidden_sliders_keep_the_initial_pose(meshcat):
    sliders = MeshcatPoseSliders(meshcat, POSE, visible=[False, False, True, True, True, False])
    assert meshcat.GetSliderNames() == ["x", "y", "yaw"]
    meshcat.SetSliderValue("yaw", 1.0)
    expected = RigidTransform(RollPitchYaw(0.1, 0.2, 1.0), [0.4, 0.5, 0.6])
    assert pose_of(sliders).IsNearlyEqualTo(expected, 1e-12)


def test_the_input_counts_at_initialization_only(meshcat):
    sliders = MeshcatPoseSliders(meshcat)
    context = sliders.CreateDefaultContext()
    sliders.get_input_port().FixValue(context, POSE)
    assert pose_of(sliders, context).IsNearlyEqualTo(RigidTransform(), 1e-12)
    Simulator(sliders, context).Initialize()
    assert pose_of(sliders, context).IsNearlyEqualTo(POSE, 1e-12)
    assert meshcat.GetSliderValue("z") == pytest.approx(0.6)


def test_run_returns_the_pose_and_takes_its_button_away(meshcat):
    sliders = MeshcatPoseSliders(meshcat, POSE)
    assert sliders.Run(sliders, sliders.CreateDefaultContext(), timeout=0.0).IsNearlyEqualTo(POSE, 1e-12)
    assert meshcat.GetButtonNames() == []


@pytest.mark.parametrize(("arguments", "error"), [
    ({"lower_limit": [1]}, TypeError), ({"visible": [True]}, TypeError), ({"step": 0.1}, TypeError),
    ({"decrement_keycodes": ["a"]}, RuntimeError), ({"increment_keycodes": []}, RuntimeError),
])  # fmt: skip
def test_wrong_sizes_add_no_slider(meshcat, arguments, error):
    with pytest.raises(error, match=next(iter(arguments))):
        MeshcatPoseSliders(meshcat, **arguments)
    assert meshcat.GetSliderNames() == []


def test_there_is_one_for_derivatives():
    from sheldrake.autodiffutils import AutoDiffXd
    from sheldrake.visualization import MeshcatPoseSliders_

    assert MeshcatPoseSliders_[float] is MeshcatPoseSliders
    assert issubclass(MeshcatPoseSliders_[AutoDiffXd], MeshcatPoseSliders)
    assert np.shape(POSE.translation()) == (3,)
