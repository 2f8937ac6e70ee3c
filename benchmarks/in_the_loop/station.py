"""A station: arm, gripper and boxes on a table, with controllers, a state machine and waypoints written in Python."""

import _robots as robots
from _controllers import InverseDynamicsInPython, StateMachine, Waypoints
from pydrake.all import (
    AddMultibodyPlantSceneGraph,
    DiagramBuilder,
    LogVectorOutput,
    MultibodyPlant,
    Parser,
    RigidTransform,
    Simulator,
)


def program():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.002)
    parser = Parser(plant)
    (arm,) = parser.AddModelsFromString(robots.arm(), "urdf")
    (gripper,) = parser.AddModelsFromString(robots.gripper(), "urdf")
    parser.AddModelsFromString(robots.table(), "urdf")
    parser.AddModelsFromString(robots.box("one"), "urdf")
    parser.AddModelsFromString(robots.box("two"), "urdf")
    mount = RigidTransform([0, 0, 0.1])
    plant.WeldFrames(plant.GetFrameByName("link7"), plant.GetFrameByName("body", gripper), mount)
    plant.SetDefaultFloatingBaseBodyPose(plant.GetBodyByName("one"), RigidTransform([0.5, 0.0, 0.031]))
    plant.SetDefaultFloatingBaseBodyPose(plant.GetBodyByName("two"), RigidTransform([0.5, 0.3, 0.031]))
    plant.Finalize()
    controlled = MultibodyPlant(0.0)
    Parser(controlled).AddModelsFromString(robots.arm(False), "urdf")
    controlled.Finalize()
    controller = builder.AddSystem(InverseDynamicsInPython(controlled, 100.0, 20.0))
    waypoints = builder.AddSystem(Waypoints(7))
    machine = builder.AddSystem(StateMachine())
    builder.Connect(plant.get_state_output_port(arm), controller.get_input_port(0))
    builder.Connect(waypoints.get_output_port(), controller.get_input_port(1))
    builder.Connect(controller.get_output_port(), plant.get_actuation_input_port(arm))
    builder.Connect(machine.get_output_port(), plant.get_actuation_input_port(gripper))
    log = LogVectorOutput(plant.get_state_output_port(), builder, 0.01)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.Initialize()
    simulator.AdvanceTo(0.5)
    log.FindLog(simulator.get_context()).data()


for _ in range(3):
    program()
