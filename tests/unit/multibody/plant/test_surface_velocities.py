"""Belts: which bodies have one, how speeds come, what is told, and which parts of the library know them."""

import numpy as np
import pytest
from tests.analytic.test_belts import SPEED, Conveyor

from sheldrake.autodiffutils import InitializeAutoDiff
from sheldrake.common.value import AbstractValue
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import BusValue, DiagramBuilder, LeafSystem

NAME = "DefaultModelInstance::belt"


def plant_with_belt(time_step=0.01, axis=(0.0, 2.0, 0.0)):
    plant = MultibodyPlant(time_step)
    belt = plant.AddRigidBody("belt", SpatialInertia.SolidBoxWithMass(1.0, 1.0, 1.0, 1.0))
    plant.AddRigidBody("other", SpatialInertia.SolidBoxWithMass(1.0, 1.0, 1.0, 1.0))
    plant.SetSurfaceVelocityAxis(belt, axis)
    return plant, belt


def bus_of(**speeds):
    bus = BusValue()
    for name, speed in speeds.items():
        bus.Set(f"DefaultModelInstance::{name}", AbstractValue.Make(speed))
    return bus


def test_an_axis_is_kept_as_a_unit_vector_until_it_is_taken_back():
    plant, belt = plant_with_belt()
    np.testing.assert_array_equal(plant.GetSurfaceVelocityAxis(belt), [0.0, 1.0, 0.0])
    assert plant.GetSurfaceVelocityAxis(plant.GetBodyByName("other")) is None
    plant.SetSurfaceVelocityAxis(belt, [0.0, 0.0, -5.0])
    np.testing.assert_array_equal(plant.GetSurfaceVelocityAxis(belt), [0.0, 0.0, -1.0])
    plant.SetSurfaceVelocityAxis(body=belt, axis_B=None)
    assert plant.GetSurfaceVelocityAxis(belt) is None


@pytest.mark.parametrize("axis", [[0.0, 0.0, 0.0], [1.0, 0.0], [np.nan, 0.0, 0.0], [np.inf, 0.0, 0.0]])
def test_an_axis_must_tell_a_direction(axis):
    plant, belt = plant_with_belt()
    with pytest.raises(RuntimeError, match="DefaultModelInstance::belt must be three numbers that tell a direction"):
        plant.SetSurfaceVelocityAxis(belt, axis)


def test_the_world_has_no_surface_that_runs():
    plant, _ = plant_with_belt()
    plant.SetSurfaceVelocityAxis(plant.world_body(), None)
    with pytest.raises(RuntimeError, match="world body"):
        plant.SetSurfaceVelocityAxis(plant.world_body(), [1.0, 0.0, 0.0])


def test_axes_are_set_before_finalize_and_ports_are_there_after_it():
    plant, belt = plant_with_belt()
    for port in (plant.get_surface_speeds_input_port, plant.get_surface_displacements_output_port):
        with pytest.raises(RuntimeError, match="pre-finalize"):
            port()
    plant.Finalize()
    with pytest.raises(RuntimeError, match="post-finalize"):
        plant.SetSurfaceVelocityAxis(belt, None)
    assert plant.get_surface_speeds_input_port().get_name() == "surface_speeds"
    assert plant.get_surface_displacements_output_port().get_name() == "surface_displacements"


@pytest.mark.parametrize("time_step", [0.0, 0.01])
def test_displacements_are_behind_positions_and_velocities_or_abstract(time_step):
    plant, _ = plant_with_belt(time_step)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    misc = plant.num_misc_continuous_states()
    assert (misc, context.num_abstract_states()) == ((1, 0) if time_step == 0.0 else (0, 1))
    assert plant.num_multibody_states() == 26
    assert plant.get_state_output_port().size() == 26
    assert list(plant.get_surface_displacements_output_port().Eval(context)) == [NAME]


class Ramp(LeafSystem):
    """A bus with a speed that grows with time."""

    def __init__(self):
        super().__init__()
        self.DeclareAbstractOutputPort("speeds", lambda: AbstractValue.Make(BusValue()), self.calc)

    def calc(self, context, value):
        value.set_value(bus_of(belt=1.0 + context.get_time() ** 2))


@pytest.mark.parametrize("time_step", [0.0, 0.01])
def test_displacements_are_integrated_as_the_plant_is(time_step):
    builder = DiagramBuilder()
    plant, _ = plant_with_belt(time_step)
    plant.Finalize()
    builder.AddSystem(plant)
    ramp = builder.AddSystem(Ramp())
    builder.Connect(ramp.get_output_port(), plant.get_surface_speeds_input_port())
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.095)
    context = plant.GetMyContextFromRoot(simulator.get_context())
    run = plant.get_surface_displacements_output_port().Eval(context).Find(NAME)
    euler = sum(0.01 * (1.0 + (0.01 * k) ** 2) for k in range(10))  # what Drake 1.58 gives, too
    np.testing.assert_allclose(run, euler if time_step else 0.095 + 0.095**3 / 3.0, rtol=1e-12)


def test_speeds_that_nobody_gives_are_zero_and_others_must_be_finite():
    plant, _ = plant_with_belt()
    plant.Finalize()
    simulator = Simulator(plant)
    context = simulator.get_mutable_context()
    simulator.AdvanceTo(0.015)
    assert plant.get_surface_displacements_output_port().Eval(context).Find(NAME) == 0.0
    plant.get_surface_speeds_input_port().FixValue(context, bus_of(other=1.0))
    simulator.AdvanceTo(0.025)
    assert plant.get_surface_displacements_output_port().Eval(context).Find(NAME) == 0.0
    for wrong in (np.inf, np.nan, "fast"):
        plant.get_surface_speeds_input_port().FixValue(context, bus_of(belt=wrong))
        with pytest.raises(RuntimeError, match=f"'{NAME}' the speed .*finite number"):
            simulator.AdvanceTo(context.get_time() + 0.01)


INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
URDF = f'<robot name="r"><link name="%s">{INERTIAL}<drake:surface_velocity_axis%s/></link><link name="a"/></robot>'
SDF = """<sdf version="1.9"><model name="r"><link name="belt">
<drake:surface_velocity_axis>%s</drake:surface_velocity_axis></link></model></sdf>"""


@pytest.mark.parametrize("text, kind", [(URDF % ("belt", ' axis="0 3 0"'), "urdf"), (SDF % "0 3 0", "sdf")])
def test_files_say_which_surfaces_run(text, kind):
    plant = MultibodyPlant(0.01)
    Parser(plant).AddModelsFromString(text, kind)
    np.testing.assert_array_equal(plant.GetSurfaceVelocityAxis(plant.GetBodyByName("belt")), [0.0, 1.0, 0.0])


@pytest.mark.parametrize(
    "text, kind, message",
    [
        (URDF % ("belt", ""), "urdf", "missing the attribute 'axis'"),
        (URDF % ("belt", ' axis="0 3"'), "urdf", "expected 3 numbers"),
        (URDF % ("belt", ' axis="0 0 0"'), "urdf", "tell a direction"),
        (SDF % "a b c", "sdf", "expected one finite number"),
        (SDF % "0 0 0", "sdf", "tell a direction"),
    ],
)
def test_files_with_an_axis_that_is_none_are_refused_where_it_is(text, kind, message):
    with pytest.raises(RuntimeError, match=rf"{kind}:\d.*{message}"):
        Parser(MultibodyPlant(0.01)).AddModelsFromString(text, kind)


def test_the_world_of_a_urdf_gets_none(caplog):
    Parser(MultibodyPlant(0.01)).AddModelsFromString(URDF % ("world", ' axis="0 3 0"'), "urdf")
    assert "<drake:surface_velocity_axis> is ignored" in caplog.text


@pytest.mark.parametrize("approximation", ["kLagged", "kSimilar", "kSap", "kTamsi"])
def test_derivatives_of_a_step_know_that_an_axis_turns_with_its_body(approximation):
    scene = Conveyor(approximation=approximation, block_axis=[0.3, 0.4, 1.0])
    plant, context = scene.plant, scene.context
    scene.velocity_after(0.15)
    x0 = plant.GetPositionsAndVelocities(context)
    diagram = scene.simulator.get_system()
    dual = diagram.ToAutoDiffXd()

    def step(x):
        system = dual if x.dtype == object else diagram
        root = system.CreateDefaultContext()
        there = system.GetSubsystemByName(plant.get_name())
        own = there.GetMyMutableContextFromRoot(root)
        there.SetPositionsAndVelocities(own, x)
        there.get_surface_speeds_input_port().FixValue(own, bus_of(belt=SPEED, block=-0.2))
        return system.EvalUniquePeriodicDiscreteUpdate(root).get_vector(0).CopyToVector()

    gradients = np.array([xi.derivatives() for xi in step(InitializeAutoDiff(x0).ravel())])
    rng = np.random.default_rng(3)
    for _ in range(4):
        direction = rng.normal(size=len(x0))
        h = 1e-7
        difference = (step(x0 + h * direction) - step(x0 - h * direction)) / (2.0 * h)
        np.testing.assert_allclose(gradients @ direction, difference, rtol=1e-4, atol=1e-4)
