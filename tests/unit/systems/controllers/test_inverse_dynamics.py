import numpy as np
import pytest

from sheldrake.math import RigidTransform
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.controllers import InverseDynamics, InverseDynamicsController, JointStiffnessController
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import ConstantVectorSource

LINK = """<link name="{name}"><inertial><origin xyz="0.1 0 -0.4"/><mass value="{mass}"/>
  <inertia ixx="0.1" iyy="0.12" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="{name}" type="continuous"><parent link="{parent}"/><child link="{child}"/>
  <origin xyz="0 0 {z}"/><axis xyz="0 1 0"/><dynamics damping="{damping}"/></joint>
<transmission><type>transmission_interface/SimpleTransmission</type><joint name="{name}">
  <hardwareInterface>EffortJointInterface</hardwareInterface></joint><actuator name="m{name}"/></transmission>"""
ARM = (
    '<robot name="arm"><link name="base"/>'
    + LINK.format(name="a", mass=2.0)
    + LINK.format(name="b", mass=1.0)
    + JOINT.format(name="j1", parent="base", child="a", z=0.0, damping=0.1)
    + JOINT.format(name="j2", parent="a", child="b", z=-1.0, damping=0.2)
    + "</robot>"
)


def arm(welded=True):
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(ARM, "urdf")
    if welded:
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"), RigidTransform())
    plant.Finalize()
    return plant


X = np.array([0.3, 0.4, 0.5, 0.6])


def test_inverse_dynamics_gives_the_accelerations_asked_for():
    plant = arm()
    system = InverseDynamics(plant)
    context = system.CreateDefaultContext()
    system.get_input_port_estimated_state().FixValue(context, X)
    system.get_input_port_desired_acceleration().FixValue(context, [1.0, 2.0])
    tau = system.get_output_port_generalized_force().Eval(context)
    plant_context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(plant_context, X)
    plant.get_actuation_input_port().FixValue(plant_context, tau)
    vdot = plant.EvalTimeDerivatives(plant_context).CopyToVector()[2:]
    np.testing.assert_allclose(vdot, [1.0, 2.0], rtol=1e-10)


def test_gravity_compensation_holds_still():
    plant = arm()
    builder = DiagramBuilder()
    builder.AddSystem(plant)
    system = builder.AddSystem(InverseDynamics(plant, InverseDynamics.kGravityCompensation))
    builder.Connect(plant.get_state_output_port(), system.get_input_port_estimated_state())
    builder.Connect(system.get_output_port(), plant.get_actuation_input_port())
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetPositions(context, [0.7, -0.9])
    simulator.AdvanceTo(0.5)
    np.testing.assert_allclose(plant.GetPositionsAndVelocities(context), [0.7, -0.9, 0.0, 0.0], atol=1e-9)
    assert system.is_pure_gravity_compensation()
    with pytest.raises(RuntimeError, match="no input"):
        system.get_input_port_desired_acceleration()


@pytest.mark.parametrize("kind", ["inverse dynamics", "stiffness"])
def test_controllers_reach_a_desired_state(kind):
    plant = arm()
    builder = DiagramBuilder()
    builder.AddSystem(plant)
    gains = np.array([40.0, 40.0])
    if kind == "stiffness":
        controller = builder.AddSystem(JointStiffnessController(plant, gains, gains))
        output = controller.get_output_port_actuation()
    else:
        controller = builder.AddSystem(InverseDynamicsController(plant, gains, 0 * gains, 0.4 * gains, False))
        output = controller.get_output_port_control()
    goal = builder.AddSystem(ConstantVectorSource([0.5, -0.3, 0.0, 0.0]))
    builder.Connect(plant.get_state_output_port(), controller.get_input_port_estimated_state())
    builder.Connect(goal.get_output_port(), controller.get_input_port_desired_state())
    builder.Connect(output, plant.get_actuation_input_port())
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(8.0)
    context = plant.GetMyContextFromRoot(simulator.get_context())
    np.testing.assert_allclose(plant.GetPositionsAndVelocities(context), [0.5, -0.3, 0.0, 0.0], atol=1e-3)


def test_the_integral_and_the_reference_acceleration_count():
    plant = arm()
    system = InverseDynamicsController(
        robot=plant, kp=[1.0, 2.0], ki=[0.1, 0.2], kd=[3.0, 4.0], has_reference_acceleration=True
    )
    context = system.CreateDefaultContext()
    system.get_input_port_estimated_state().FixValue(context, X)
    system.get_input_port_desired_state().FixValue(context, X)
    system.get_input_port_desired_acceleration().FixValue(context, [1.0, 2.0])
    system.set_integral_value(context, [1.0, -2.0])
    plain = InverseDynamics(plant)
    other = plain.CreateDefaultContext()
    plain.get_input_port_estimated_state().FixValue(other, X)
    plain.get_input_port_desired_acceleration().FixValue(other, [1.0 + 0.1, 2.0 - 0.4])
    expected = plain.get_output_port().Eval(other)
    np.testing.assert_allclose(system.get_output_port_generalized_force().Eval(context), expected)
    np.testing.assert_allclose(system.get_output_port_control().Eval(context), expected)
    assert system.get_multibody_plant_for_control() is plant


def test_errors():
    free = arm(welded=False)
    for wrong in (
        lambda: InverseDynamicsController(free, np.ones(8), np.ones(8), np.ones(8), False),
        lambda: JointStiffnessController(free, np.ones(8), np.ones(8)),
        lambda: JointStiffnessController(arm(), [1.0], [1.0]),
        lambda: InverseDynamics(MultibodyPlant(0.0)),
    ):
        with pytest.raises(RuntimeError):
            wrong()
