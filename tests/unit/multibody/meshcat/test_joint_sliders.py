"""JointSliders: names, limits and steps of the sliders, and what they say."""

import threading

import numpy as np
import pytest

from sheldrake.geometry import Meshcat
from sheldrake.multibody.meshcat import JointSliders
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from sheldrake.systems.framework import DiagramBuilder, LeafSystem

ARM = """<robot name='arm'><link name='base'/><link name='a'/><link name='b'/>
<joint name='turn' type='revolute'><axis xyz='0 0 1'/><parent link='base'/><child link='a'/>
<limit lower='-1' upper='2' effort='1'/></joint>
<joint name='slide' type='prismatic'><axis xyz='0 0 1'/><parent link='a'/><child link='b'/></joint>
<joint name='weld' type='fixed'><parent link='world'/><child link='base'/></joint></robot>"""


def plant_of(*models):
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    for i, model in enumerate(models):
        parser = Parser(plant, model_name_prefix=f"m{i}") if len(models) > 1 else Parser(plant)
        parser.AddModelsFromString(model, "urdf")
    plant.Finalize()
    return builder, plant


def fixed(name):
    return ARM.replace("'turn'", f"'turn{name}'")


def test_names_limits_and_initial_values():
    _, plant = plant_of(fixed(""))
    meshcat = Meshcat(port=0)
    sliders = JointSliders(meshcat, plant)
    assert meshcat.GetSliderNames() == ["slide", "turn"]
    assert (meshcat.SetSliderValue("turn", -99), meshcat.SetSliderValue("turn", 99)) == (-1.0, 2.0)
    assert (meshcat.SetSliderValue("slide", -99), meshcat.SetSliderValue("slide", 99)) == (-10.0, 10.0)
    port = sliders.get_output_port()
    assert port.get_name() == "positions"
    context = sliders.CreateDefaultContext()
    assert np.array_equal(port.Eval(context), [2.0, 10.0])
    meshcat.SetSliderValue("turn", 0.5)
    assert np.array_equal(port.Eval(context), [0.5, 10.0]), "never a value kept from before"


def test_models_are_named_only_where_names_clash():
    _, plant = plant_of(fixed("0"), fixed("1"))
    meshcat = Meshcat(port=0)
    JointSliders(meshcat, plant)
    assert meshcat.GetSliderNames() == ["slide/m0::arm", "slide/m1::arm", "turn0/m0::arm", "turn1/m1::arm"]


def test_the_narrower_limit_counts():
    _, plant = plant_of(fixed(""))
    meshcat = Meshcat(port=0)
    JointSliders(meshcat, plant, lower_limit=-0.5, upper_limit=[3.0, 0.25], step=0.25)
    assert (meshcat.SetSliderValue("turn", -99), meshcat.SetSliderValue("turn", 99)) == (-0.5, 2.0)
    assert (meshcat.SetSliderValue("slide", -99), meshcat.SetSliderValue("slide", 99)) == (-0.5, 0.25)
    assert meshcat.SetSliderValue("turn", 0.3) == 0.25


def test_keys_move_the_sliders():
    _, plant = plant_of(fixed(""))
    meshcat = Meshcat(port=0)
    sliders = JointSliders(meshcat, plant, decrement_keycodes=["KeyA", "KeyS"], increment_keycodes=["KeyD", "KeyW"])
    for key in ("KeyD", "KeyD", "KeyS"):
        meshcat._hub.controls.receive({"type": "key", "code": key})
    assert sliders.get_output_port().Eval(sliders.CreateDefaultContext()) == pytest.approx([0.02, -0.01])


def test_set_positions_moves_sliders_and_outlives_them():
    _, plant = plant_of(fixed(""))
    meshcat = Meshcat(port=0)
    sliders = JointSliders(meshcat, plant, initial_value=[0.1, 0.2])
    sliders.SetPositions([0.3, 0.4])
    assert meshcat.GetSliderValue("slide") == pytest.approx(0.4)
    sliders.Delete()
    sliders.Delete()
    assert meshcat.GetSliderNames() == []
    assert np.array_equal(sliders.get_output_port().Eval(sliders.CreateDefaultContext()), [0.3, 0.4])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"initial_value": [1]}, "Expected initial_value of size 2, but got size 1"),
        ({"lower_limit": [1, 2, 3]}, "Expected lower_limit of size 2, but got size 3"),
        ({"upper_limit": [1]}, "Expected upper_limit of size 2, but got size 1"),
        ({"step": [1]}, "Expected step of size 2, but got size 1"),
        ({"decrement_keycodes": ["a"]}, "Expected decrement_keycodes of size zero or 2, but got size 1"),
        ({"increment_keycodes": ["a"]}, "Expected increment_keycodes of size zero or 2, but got size 1"),
    ],
)
def test_wrong_sizes_add_no_slider(arguments, message):
    _, plant = plant_of(fixed(""))
    meshcat = Meshcat(port=0)
    with pytest.raises(RuntimeError, match=message):
        JointSliders(meshcat, plant, **arguments)
    assert meshcat.GetSliderNames() == []


def test_run_ends_by_time_and_returns_the_positions():
    builder, plant = plant_of(fixed(""))
    meshcat = Meshcat(port=0)
    sliders = builder.AddSystem(JointSliders(meshcat, plant, initial_value=[0.5, 1.5]))
    diagram = builder.Build()
    assert np.array_equal(sliders.Run(diagram, timeout=0.0), [0.5, 1.5])
    assert meshcat.GetButtonNames() == []


def test_run_follows_the_sliders_until_the_button_is_pressed():
    builder, plant = plant_of(fixed(""))
    meshcat = Meshcat(port=0)
    published = []

    class Watch(LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareVectorInputPort("q", 2)
            self.DeclareForcedPublishEvent(self.publish)

        def publish(self, context):
            published.append(self.get_input_port().Eval(context).tolist())
            if len(published) == 1:
                threading.Thread(target=act).start()

    def act():
        meshcat.SetSliderValue("turn", 1.0)
        meshcat._hub.controls.receive({"type": "key", "code": "KeyQ"})

    sliders = builder.AddSystem(JointSliders(meshcat, plant))
    watch = builder.AddSystem(Watch())
    builder.Connect(sliders.get_output_port(), watch.get_input_port())
    q = sliders.Run(builder.Build(), timeout=60.0, stop_button_keycode="KeyQ")
    assert published[0] == [0, 0]
    assert q.tolist() == published[-1]
    assert meshcat.GetButtonNames() == []


def test_errors_of_run_and_of_plants_in_the_making():
    with pytest.raises(RuntimeError, match=r"Finalize\(\)"):
        JointSliders(Meshcat(port=0), MultibodyPlant(0.0))
    _, plant = plant_of(fixed(""))
    sliders = JointSliders(Meshcat(port=0), plant)
    other = plant_of(fixed(""))[0].Build()
    with pytest.raises(RuntimeError):
        sliders.Run(other, timeout=0.0)
