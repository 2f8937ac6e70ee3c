"""Play, pause and reset of a ModelVisualizer, without a page."""

import time

import numpy as np
import pytest
from tests.unit.visualization.test_posture_sliders import WALKER

from sheldrake.multibody.meshcat import MeshcatMouseSpring
from sheldrake.visualization import ApplyVisualizationConfig, ModelVisualizer, VisualizationConfig
from sheldrake.visualization._playback import PLAY_BUTTON, PLAY_KEY, RESET_BUTTON


def shown(tmp_path, text=WALKER.format(look="collision"), **options):
    file = tmp_path / "model.urdf"
    file.write_text(text)
    visualizer = ModelVisualizer(publish_contacts=False, simulate=True, **options)
    visualizer.AddModels(file)
    visualizer.Finalize()
    visualizer._playback.add_buttons()
    visualizer._shown = visualizer._get_slider_values()
    return visualizer


def press(visualizer, name):
    visualizer.meshcat()._hub.controls.receive({"type": "button", "name": name})
    visualizer._answer_playback()


def look(visualizer):
    """One look at the controls, as Run() has."""
    visualizer._answer_postures()
    visualizer._answer_playback()
    before, visualizer._shown = visualizer._shown, visualizer._get_slider_values()
    if before != visualizer._shown:
        visualizer._follow_sliders(before, visualizer._shown)


def play_for(visualizer, seconds):
    until = visualizer._context.get_time() + seconds
    while visualizer._context.get_time() < until:
        look(visualizer)
        time.sleep(0.005)


def state(visualizer):
    return visualizer._plant.GetPositionsAndVelocities(visualizer._plant_context)


def test_what_floats_falls_on_the_ground_pauses_and_goes_back(tmp_path):
    visualizer = shown(tmp_path)
    meshcat = visualizer.meshcat()
    meshcat.SetSliderValue("hip", 0.5)  # upright it would stand on its leg for long
    look(visualizer)
    start = state(visualizer)
    assert start[6] == pytest.approx(0.3, abs=1e-3) and not meshcat._grabs.bodies()
    press(visualizer, PLAY_BUTTON)
    assert meshcat._grabs.bodies() == ["walker/leg", "walker/trunk"]
    play_for(visualizer, 1.0)
    press(visualizer, PLAY_BUTTON)
    fallen = state(visualizer)
    assert 0.04 < fallen[6] < 0.2, "it lies on the ground"
    assert meshcat.GetSliderValue("trunk_z") == pytest.approx(fallen[6], abs=1e-3), "the sliders know"
    for _ in range(3):
        look(visualizer)
    np.testing.assert_array_equal(state(visualizer), fallen, "what is paused stays where it is")
    press(visualizer, PLAY_BUTTON)
    play_for(visualizer, 0.05)
    assert np.abs(state(visualizer) - fallen).max() < 0.3, "it goes on"
    press(visualizer, RESET_BUTTON)
    look(visualizer)
    assert visualizer._context.get_time() == 0.0
    assert state(visualizer) == pytest.approx(start, abs=1e-3), "sliders have steps of 1e-3"
    assert not visualizer._playback.is_playing and not meshcat._grabs.bodies()


def test_a_slider_moved_while_it_plays_takes_its_joint_along(tmp_path):
    visualizer = shown(tmp_path, weld_base=True)
    press(visualizer, PLAY_BUTTON)
    play_for(visualizer, 0.1)
    visualizer.meshcat().SetSliderValue("hip", 0.75)
    before, visualizer._shown = visualizer._shown, visualizer._get_slider_values()
    visualizer._follow_sliders(before, visualizer._shown)
    assert state(visualizer).tolist() == [0.75, 0.0]
    press(visualizer, PLAY_BUTTON)
    visualizer.meshcat().SetSliderValue("hip", 0.5)
    look(visualizer)
    press(visualizer, PLAY_BUTTON)
    assert state(visualizer)[0] == pytest.approx(0.5, abs=1e-3), "a posture set while paused is where it starts"


TOGETHER = """<robot name='together'>
<link name='a'><inertial><mass value='1'/><inertia ixx='.1' iyy='.1' izz='.1' ixy='0' ixz='0' iyz='0'/></inertial>
<collision><geometry><sphere radius='.2'/></geometry></collision></link>
<link name='b'><inertial><mass value='1'/><inertia ixx='.1' iyy='.1' izz='.1' ixy='0' ixz='0' iyz='0'/></inertial>
</link>
<link name='c'><inertial><mass value='1'/><inertia ixx='.1' iyy='.1' izz='.1' ixy='0' ixz='0' iyz='0'/></inertial>
<collision><geometry><sphere radius='.2'/></geometry></collision></link>
<joint name='ab' type='prismatic'><axis xyz='1 0 0'/><parent link='a'/><child link='b'/>
<limit lower='-9' upper='9' effort='1' velocity='1'/></joint>
<joint name='bc' type='prismatic'><axis xyz='1 0 0'/><parent link='b'/><child link='c'/><origin xyz='.1 0 0'/>
<limit lower='-9' upper='9' effort='1' velocity='1'/></joint></robot>"""


def test_what_overlaps_when_it_starts_is_not_thrown_apart(tmp_path):
    visualizer = shown(tmp_path, TOGETHER, weld_base=True)
    press(visualizer, PLAY_BUTTON)
    play_for(visualizer, 0.2)
    assert np.abs(state(visualizer)).max() < 1e-9
    press(visualizer, RESET_BUTTON)
    query = visualizer._scene_graph.get_query_output_port().Eval(
        visualizer._scene_graph.GetMyContextFromRoot(visualizer._context)
    )
    assert len(query.ComputePointPairPenetration()) == 1, "and is seen to overlap as before"


def test_a_model_that_cannot_be_simulated_is_shown_and_says_why(tmp_path, caplog):
    text = WALKER.format(look="visual").replace("<mass value='1'/>", "<mass value='0'/>").replace("'.1'", "'0'", 9)
    text = text.replace("<mass value='2'/>", "<mass value='0'/>")
    visualizer = shown(tmp_path, text, weld_base=True)
    start = state(visualizer)
    with caplog.at_level("ERROR", logger="drake"):
        press(visualizer, PLAY_BUTTON)
    assert "cannot be simulated" in caplog.text and "mass matrix" in caplog.text
    assert not visualizer._playback.is_playing
    np.testing.assert_array_equal(state(visualizer), start)


def test_without_simulate_nothing_is_added(tmp_path):
    file = tmp_path / "model.urdf"
    file.write_text(WALKER.format(look="collision"))
    visualizer = ModelVisualizer(publish_contacts=False)
    visualizer.AddModels(file)
    visualizer.Finalize()
    assert visualizer._playback is None and visualizer._scene_graph.model_inspector().num_geometries() == 4
    assert not visualizer._diagram.HasSubsystemNamed("meshcat_mouse_spring")


def test_the_configuration_adds_a_spring_where_the_port_is_free(tmp_path, caplog):
    from sheldrake.all import (
        AddMultibodyPlantSceneGraph,
        DiagramBuilder,
        ExternallyAppliedSpatialForceMultiplexer,
        Meshcat,
    )

    for taken in (False, True):
        builder = DiagramBuilder()
        plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
        plant.Finalize()
        if taken:
            joined = builder.AddSystem(ExternallyAppliedSpatialForceMultiplexer(0))
            builder.Connect(joined.get_output_port(), plant.get_applied_spatial_force_input_port())
        config = VisualizationConfig(mouse_interaction_stiffness=50.0)
        with caplog.at_level("WARNING", logger="drake"):
            ApplyVisualizationConfig(config, builder, meshcat=Meshcat(port=0))
        springs = [s for s in builder.GetSystems() if isinstance(s, MeshcatMouseSpring)]
        assert len(springs) == (not taken) and ("connected already" in caplog.text) == taken
    assert PLAY_KEY == "KeyP"
