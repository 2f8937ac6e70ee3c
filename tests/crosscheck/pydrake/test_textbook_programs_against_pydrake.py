"""Programs as in textbooks, run in both libraries: the same numbers."""

import importlib

import numpy as np
import pytest

pytest.importorskip("pydrake")
pytestmark = pytest.mark.peer

INERTIA = '<inertia ixx=".1" ixy="0" ixz="0" iyy=".1" iyz="0" izz=".01"/>'
LINK = f'<link name="{{}}"><inertial><origin xyz="0 0 .2"/><mass value="2"/>{INERTIA}</inertial></link>'
JOINT = (
    '<joint name="{0}" type="revolute"><origin xyz="0 0 {1}"/><parent link="{2}"/><child link="{3}"/><axis xyz="{4}"/>'
    '<limit lower="-2" upper="2" effort="50" velocity="3"/></joint><transmission><type>transmission_interface/'
    'SimpleTransmission</type><joint name="{0}"/><actuator name="a_{0}"/></transmission>'
)
ARM = (
    '<robot name="arm"><link name="base"/>'
    + "".join(map(LINK.format, ("l1", "l2", "l3")))
    + JOINT.format("j1", 0, "base", "l1", "0 1 0")
    + JOINT.format("j2", 0.4, "l1", "l2", "0 1 0")
    + JOINT.format("j3", 0.4, "l2", "l3", "1 0 0")
    + "</robot>"
)


MODULES = """
math geometry multibody.tree multibody.plant multibody.parsing multibody.inverse_kinematics systems.analysis
systems.controllers systems.framework systems.primitives trajectories solvers
""".split()


def names_of(library):
    out = {}
    for module in MODULES:
        out.update(vars(importlib.import_module(f"{library}.{module}")))
    return type("Names", (), out)


def add_arm(m, plant):
    m.Parser(plant).AddModelsFromString(ARM, "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    plant.Finalize()
    return plant


def arm_follows_a_path(m):
    builder = m.DiagramBuilder()
    plant, _ = m.AddMultibodyPlantSceneGraph(builder, 0.001)
    add_arm(m, plant)
    model = add_arm(m, m.MultibodyPlant(0.001))
    control = builder.AddSystem(m.InverseDynamicsController(model, [100.0] * 3, [1.0] * 3, [20.0] * 3, False))
    knots = np.array([[0, 0, 0], [0.5, 0.3, -0.2], [1, 0.2, 0.4]]).T
    path = m.PiecewisePolynomial.CubicShapePreserving([0.0, 1.0, 2.0], knots, True)
    wanted = builder.AddSystem(m.TrajectorySource(path, output_derivative_order=1))
    builder.Connect(plant.get_state_output_port(), control.get_input_port_estimated_state())
    builder.Connect(wanted.get_output_port(), control.get_input_port_desired_state())
    builder.Connect(control.get_output_port_control(), plant.get_actuation_input_port())
    log = m.LogVectorOutput(plant.get_state_output_port(), builder, 0.1)
    simulator = m.Simulator(builder.Build())
    simulator.AdvanceTo(1.0)
    return log.FindLog(simulator.get_context()).data()


def hand_is_led(m):
    plant = add_arm(m, m.MultibodyPlant(0.0))
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, [0.3, 0.4, 0.2])
    parameters = m.DifferentialInverseKinematicsParameters(3, 3)
    parameters.set_time_step(0.01)
    parameters.set_joint_velocity_limits((-np.ones(3), np.ones(3)))
    frame = plant.GetFrameByName("l3")
    world, velocities = plant.world_frame(), m.JacobianWrtVariable.kV
    J = plant.CalcJacobianSpatialVelocity(context, velocities, frame, [0, 0, 0], world, world)
    result = m.DoDifferentialInverseKinematics(plant, context, J @ [0.3, -0.2, 0.1], frame, parameters)
    return np.asarray(result.joint_velocities).round(6)


def ball_falls_and_bounces(m):
    class Ball(m.LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareContinuousState(1, 1, 0)
            self.hit = self.MakeWitnessFunction(
                "hit",
                m.WitnessFunctionDirection.kPositiveThenNonPositive,
                lambda context: context.get_continuous_state_vector()[0],
                m.UnrestrictedUpdateEvent(self.bounce),
            )

        def DoCalcTimeDerivatives(self, context, derivatives):
            derivatives.SetFromVector([context.get_continuous_state_vector()[1], -9.81])

        def bounce(self, context, event, state):
            vector = state.get_mutable_continuous_state().get_mutable_vector()
            vector.SetFromVector([0.0, -0.8 * vector.CopyToVector()[1]])

        def DoGetWitnessFunctions(self, context):
            return [self.hit]

    simulator = m.Simulator(Ball())
    context = simulator.get_mutable_context()
    context.SetContinuousState([1.0, 0.0])
    context.SetAccuracy(1e-8)
    simulator.AdvanceTo(2.0)
    return [*context.get_continuous_state_vector().CopyToVector(), simulator.get_num_unrestricted_updates()]


def states_are_one_object_each(m):
    context = m.Integrator(2).CreateDefaultContext()
    delay = m.DiscreteTimeDelay(0.1, 2, 1).CreateDefaultContext()
    return [
        context.get_continuous_state() is context.get_continuous_state(),
        context.get_continuous_state_vector() is context.get_continuous_state_vector(),
        delay.get_discrete_state() is delay.get_discrete_state(),
        delay.get_discrete_state_vector() is delay.get_discrete_state_vector(),
        context.get_state() is context.get_mutable_state(),
    ]


def odd_xml_is_read(m):
    found = []
    for text in (
        'hello <robot name="r"><link name="l"/></robot>',
        '<?xml version="1.0"?>\n<?xml version="1.0"?><robot name="r"><link name="l"/></robot>',
        '<?xml version=1.0?><robot name="r"><link name="l"/></robot></robot><robot name="q"/>',
    ):
        plant = m.MultibodyPlant(0.0)
        found.append(len(m.Parser(plant).AddModelsFromString(text, "urdf")) + plant.num_bodies())
    return found


PROGRAMS = (arm_follows_a_path, hand_is_led, ball_falls_and_bounces, states_are_one_object_each, odd_xml_is_read)


@pytest.mark.parametrize("program", PROGRAMS, ids=[p.__name__ for p in PROGRAMS])
def test_programs_give_the_same(program):
    ours, theirs = (np.asarray(program(names_of(library)), float) for library in ("sheldrake", "pydrake"))
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-6)


def test_another_number_is_noticed(monkeypatch):
    from sheldrake.systems.controllers import InverseDynamicsController

    init = InverseDynamicsController.__init__
    monkeypatch.setattr(
        InverseDynamicsController, "__init__", lambda self, robot, kp, *more: init(self, robot, [101.0] * 3, *more)
    )
    with pytest.raises(AssertionError):
        test_programs_give_the_same(arm_follows_a_path)
