"""A quadrotor with propellers hovers under a linear-quadratic regulator, from several disturbed starts."""

import _robots as robots
import numpy as np
from _controllers import HoverController
from pydrake.all import (
    AddMultibodyPlantSceneGraph,
    DiagramBuilder,
    LogVectorOutput,
    Parser,
    Propeller,
    PropellerInfo,
    RigidTransform,
    Simulator,
)


def make():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    Parser(plant).AddModelsFromString(robots.quadrotor(), "urdf")
    plant.Finalize()
    body = plant.GetBodyByName("body").index()
    places = [(0.15, 0.0, 1.0), (0.0, 0.15, -1.0), (-0.15, 0.0, 1.0), (0.0, -0.15, -1.0)]
    info = [PropellerInfo(body, RigidTransform([x, y, 0]), 1.0, 0.0245 * sign) for x, y, sign in places]
    propellers = builder.AddSystem(Propeller(info))
    builder.Connect(propellers.get_output_port(), plant.get_applied_spatial_force_input_port())
    builder.Connect(plant.get_body_poses_output_port(), propellers.get_body_poses_input_port())
    builder.ExportInput(propellers.get_command_input_port(), "u")
    builder.ExportOutput(plant.get_state_output_port(), "x")
    return builder.Build(), plant


def program():
    diagram, plant = make()
    builder = DiagramBuilder()
    vehicle = builder.AddSystem(diagram)
    controller = builder.AddSystem(HoverController(0.775 * 9.81))
    builder.Connect(vehicle.get_output_port(), controller.get_input_port())
    builder.Connect(controller.get_output_port(), vehicle.get_input_port())
    log = LogVectorOutput(vehicle.get_output_port(), builder, 0.02)
    whole = builder.Build()
    simulator = Simulator(whole)
    generator = np.random.default_rng(3)
    for _ in range(3):
        context = simulator.get_mutable_context()
        context.SetTime(0.0)
        plant_context = plant.GetMyMutableContextFromRoot(context)
        plant.SetPositions(plant_context, [1, 0, 0, 0, *generator.uniform(-0.5, 0.5, 3)])
        plant.SetVelocities(plant_context, generator.uniform(-0.3, 0.3, 6))
        simulator.Initialize()
        simulator.AdvanceTo(2.0)
    log.FindLog(simulator.get_context()).data()


for _ in range(3):
    program()
