"""Sliders for a posture: what floats has a place and three angles, and a model stands on the ground."""

import numpy as np
import pytest

from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.visualization import ModelVisualizer

WALKER = """<robot name='walker'><link name='trunk'><inertial><mass value='2'/>
<inertia ixx='.1' iyy='.1' izz='.1' ixy='0' ixz='0' iyz='0'/></inertial>
<{look}><geometry><box size='.4 .2 .1'/></geometry></{look}></link>
<link name='leg'><inertial><mass value='1'/><inertia ixx='.1' iyy='.1' izz='.1' ixy='0' ixz='0' iyz='0'/></inertial>
<{look}><origin xyz='0 0 -.15'/><geometry><cylinder radius='.02' length='.3'/></geometry></{look}></link>
<joint name='hip' type='revolute'><axis xyz='0 1 0'/><parent link='trunk'/><child link='leg'/>
<limit lower='-.5' upper='1' effort='1' velocity='1'/></joint></robot>"""


def shown(tmp_path, look="visual", position=None, **options):
    file = tmp_path / "walker.urdf"
    file.write_text(WALKER.format(look=look))
    visualizer = ModelVisualizer(publish_contacts=False, **options)
    visualizer.AddModels(file)
    visualizer.Finalize(position)
    return visualizer


def pose_of(visualizer, body):
    plant = visualizer._plant
    return plant.EvalBodyPoseInWorld(visualizer._plant_context, plant.GetBodyByName(body))


def press(visualizer, button):
    visualizer.meshcat().AddButton(button)
    visualizer.meshcat()._hub.controls.receive({"type": "button", "name": button})
    visualizer._answer_postures()
    visualizer._publish()


def test_a_body_that_floats_has_a_place_and_three_angles(tmp_path):
    visualizer = shown(tmp_path)
    meshcat = visualizer.meshcat()
    names = [name for name in meshcat.GetSliderNames() if "α" not in name]
    assert names == ["hip", "trunk_pitch", "trunk_roll", "trunk_x", "trunk_y", "trunk_yaw", "trunk_z"]
    rpy, p = (0.1, 0.2, -0.3), (0.4, 0.5, 0.6)
    for name, value in zip(("roll", "pitch", "yaw", "x", "y", "z"), (*rpy, *p)):
        meshcat.SetSliderValue(f"trunk_{name}", value)
    visualizer._publish()
    assert pose_of(visualizer, "trunk").IsNearlyEqualTo(RigidTransform(RollPitchYaw(rpy), p), 1e-14)


def test_positions_given_are_what_the_sliders_stand_for(tmp_path):
    X = RigidTransform(RollPitchYaw(0.125, 0.25, -0.375), [0.5, 0.25, 0.75])
    q = [*X.rotation().ToQuaternion().wxyz(), *X.translation(), 0.25]
    visualizer = shown(tmp_path, position=q)
    assert visualizer._sliders.positions() == pytest.approx(q, abs=1e-3), "sliders have steps of 1e-3"
    assert pose_of(visualizer, "trunk").translation()[2] == pytest.approx(0.75), "and it is not put on the ground"


@pytest.mark.parametrize("look", ["visual", "collision"])
def test_what_floats_stands_on_the_ground_and_comes_home(tmp_path, look):
    visualizer = shown(tmp_path, look)
    assert pose_of(visualizer, "trunk").translation() == pytest.approx([0, 0, 0.3], abs=1e-3)
    meshcat = visualizer.meshcat()
    assert (meshcat._hub.tree.get("/drake/proximity").properties["visible"] is True) == (look == "collision")
    press(visualizer, "Random Posture")
    angle = meshcat.GetSliderValue("hip")
    assert angle != 0.0 and -0.5 <= angle <= 1.0 and meshcat.GetSliderValue("trunk_x") == 0.0
    meshcat.SetSliderValue("trunk_x", 0.5)
    press(visualizer, "Home")
    assert pose_of(visualizer, "trunk").translation() == pytest.approx([0, 0, 0.3], abs=1e-3)
    assert meshcat.GetSliderValue("hip") == 0.0


def test_a_welded_base_has_no_sliders(tmp_path):
    visualizer = shown(tmp_path, weld_base=True)
    assert [name for name in visualizer.meshcat().GetSliderNames() if "α" not in name] == ["hip"]
    visualizer._reload()
    assert visualizer._plant.num_positions() == 1 and np.array_equal(visualizer._sliders.positions(), [0.0])
