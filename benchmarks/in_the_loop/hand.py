"""A hand of sixteen joints holds a ball: a scene with many pairs, its first tenth of a second and a second more."""

import _robots as robots
import numpy as np
from pydrake.all import AddMultibodyPlantSceneGraph, DiagramBuilder, Parser, PidController, RigidTransform, Simulator


def program():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.002)
    parser = Parser(plant)
    (hand,) = parser.AddModelsFromString(robots.hand(), "urdf")
    parser.AddModelsFromString(robots.box("thing", 0.05, 0.1), "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("palm"))
    plant.SetDefaultFloatingBaseBodyPose(plant.GetBodyByName("thing"), RigidTransform([0, 0.0, 0.05]))
    plant.Finalize()
    n = plant.num_actuators()
    pid = builder.AddSystem(PidController(np.full(n, 1.0), np.zeros(n), np.full(n, 0.05)))
    builder.Connect(plant.get_state_output_port(hand), pid.get_input_port_estimated_state())
    builder.Connect(pid.get_output_port_control(), plant.get_actuation_input_port(hand))
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = pid.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    desired = np.zeros(2 * n)
    desired[:n] = np.tile([0.0, -0.5, -0.5, -0.5], 4)
    pid.get_input_port_desired_state().FixValue(context, desired)
    simulator.AdvanceTo(0.1)
    simulator.AdvanceTo(0.6)


for _ in range(3):
    program()
