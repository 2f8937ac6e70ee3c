"""What goes wrong is said: which call, which object, what was found, what is valid. Nothing is half changed."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.math import RigidTransform
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from sheldrake.multibody.tree import RevoluteJoint, SpatialInertia, UnitInertia
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder, LeafSystem
from sheldrake.systems.primitives import Adder, ConstantVectorSource, Gain

LINK = """<robot name="r"><link name="body"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>{}</link>{}</robot>"""
MESH = '<collision><geometry><mesh filename="/nowhere/nope.obj"/></geometry></collision>'


def build(mass=1.0, finalize=True):
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    body = plant.AddRigidBody("crate", SpatialInertia(mass, [0, 0, 0], UnitInertia(*[0.1 if mass else 0.0] * 3)))
    if finalize:
        plant.Finalize()
    return builder, plant, body


@pytest.fixture
def scene():
    builder, plant, body = build()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    return plant, body, context, plant.GetMyContextFromRoot(context)


def test_files_that_are_not_there():
    _, plant, _ = build(finalize=False)
    with pytest.raises(RuntimeError, match=r"/nowhere/x\.urdf"):
        Parser(plant).AddModels("/nowhere/x.urdf")
    with pytest.raises(RuntimeError, match=r"nope\.obj"):
        Parser(plant).AddModelsFromString(LINK.format(MESH, ""), "urdf")
    assert plant.num_bodies() == 2 and not plant.HasModelInstanceNamed("r"), "a bad file leaves the plant as it was"


def test_an_unknown_tag_is_said(caplog):
    _, plant, _ = build(finalize=False)
    Parser(plant).AddModelsFromString(LINK.format("<flavour/>", ""), "urdf")
    assert "flavour" in caplog.text


@pytest.mark.parametrize("step", [-1.0, float("nan"), float("inf")])
def test_time_steps(step):
    with pytest.raises(RuntimeError, match=r"time_step must be zero or positive and finite, not (-1|nan|inf)"):
        MultibodyPlant(step)


def test_a_body_without_mass_stops_the_step_and_keeps_the_state():
    builder, plant, _ = build(mass=0.0)
    simulator = Simulator(builder.Build())
    before = plant.GetPositions(plant.GetMyContextFromRoot(simulator.get_context())).copy()
    with pytest.raises(RuntimeError, match=r"plant.* at time 0.*mass matrix is not positive definite"):
        simulator.AdvanceTo(0.1)
    np.testing.assert_array_equal(plant.GetPositions(plant.GetMyContextFromRoot(simulator.get_context())), before)


def test_poses_that_are_not_numbers(scene):
    plant, body, _, context = scene
    before = plant.GetPositionsAndVelocities(context).copy()
    with pytest.raises(RuntimeError, match="must be finite"):
        plant.SetFreeBodyPose(context, body, RigidTransform([np.nan, 0, 0]))
    with pytest.raises(RuntimeError, match=r"SetPositions\(\): the values must be finite"):
        plant.SetPositions(context, [np.nan] * 7)
    np.testing.assert_array_equal(plant.GetPositionsAndVelocities(context), before)


def test_names_and_axes(scene):
    plant, body, *_ = scene
    with pytest.raises(RuntimeError, match=r"'creat'.*valid names.*crate"):
        plant.GetBodyByName("creat")
    with pytest.raises(RuntimeError, match="nonzero length"):
        RevoluteJoint("j", plant.world_frame(), body.body_frame(), [0, 0, 0])


def test_calls_out_of_their_time(scene):
    _, unfinished, _ = build(finalize=False)
    with pytest.raises(RuntimeError, match="Finalize"):
        unfinished.CreateDefaultContext()
    with pytest.raises(RuntimeError, match=r"AddRigidBody.*Finalize"):
        scene[0].AddRigidBody("late", SpatialInertia(1.0, [0, 0, 0], UnitInertia(1, 1, 1)))
    builder, *_ = build()
    builder.Build()
    for late in (builder.Build, lambda: builder.AddSystem(Adder(2, 1))):
        with pytest.raises(RuntimeError, match="already been called"):
            late()


def test_wires():
    builder = DiagramBuilder()
    adder, gain, other = (builder.AddSystem(s) for s in (Adder(2, 3), Gain(1.0, 2), Gain(1.0, 2)))
    with pytest.raises(RuntimeError, match=r"'sum'.*size 3.*'u0'.*size 2"):
        builder.Connect(adder.get_output_port(), gain.get_input_port())
    builder.Connect(gain.get_output_port(), other.get_input_port())
    builder.Connect(other.get_output_port(), gain.get_input_port())
    with pytest.raises(RuntimeError, match=r"(?s)algebraic loop.*u0.*y0.*u0.*y0"):
        builder.Build()
    alone = Gain(1.0, 2)
    with pytest.raises(RuntimeError, match=r"u0.*not connected"):
        alone.get_output_port().Eval(alone.CreateDefaultContext())


def test_times():
    simulator = Simulator(ConstantVectorSource([1.0]))
    simulator.AdvanceTo(1.0)
    for time in (0.5, float("nan")):
        with pytest.raises(RuntimeError, match=rf"boundary_time {time} lies before the current time 1\.0"):
            simulator.AdvanceTo(time)
    assert simulator.get_context().get_time() == 1.0


def test_an_exception_of_a_callback_says_where_and_when():
    class Moody(LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareDiscreteState([0.0])
            self.DeclarePeriodicDiscreteUpdateEvent(0.01, 0.0, self.Update)

        def Update(self, context, x):
            if context.get_time() > 0.045:
                raise ValueError("no more")
            x[0] = x[0] + 1.0

    builder = DiagramBuilder()
    moody = builder.AddNamedSystem("moody", Moody())
    simulator = Simulator(builder.Build())
    with pytest.raises(ValueError, match="no more") as caught:
        simulator.AdvanceTo(1.0)
    said = str(caught.value) + " ".join(getattr(caught.value, "__notes__", ()))
    assert "moody" in said and "0.05" in said
    context = moody.GetMyContextFromRoot(simulator.get_context())
    assert context.get_discrete_state_vector().value()[0] == 5.0, "the last good state is kept"
