"""Plants, diagrams and simulators made in a loop, each for a few steps: as in searches over designs and in tests."""

import _robots as robots
import numpy as np
from pydrake.all import (
    AddMultibodyPlantSceneGraph,
    BodyIndex,
    Box,
    CoulombFriction,
    DiagramBuilder,
    LogVectorOutput,
    MultibodyPlant,
    Parser,
    RigidTransform,
    Simulator,
    SpatialInertia,
)


def simulate(time_step, urdf):
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step)
    parser = Parser(plant)
    parser.AddModelsFromString(urdf, "urdf")
    plant.Finalize()
    LogVectorOutput(plant.get_state_output_port(), builder, 0.01)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    simulator = Simulator(diagram, context)
    plant_context = plant.GetMyContextFromRoot(context)
    plant.get_actuation_input_port().FixValue(plant_context, np.zeros(plant.num_actuators()))
    plant.SetPositions(plant_context, np.full(plant.num_positions(), 0.1))
    simulator.Initialize()
    simulator.AdvanceTo(0.02)
    return plant.GetPositionsAndVelocities(plant_context)


def ask(urdf):
    plant = MultibodyPlant(0.0)
    parser = Parser(plant)
    parser.AddModelsFromString(urdf, "urdf")
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, np.full(plant.num_positions(), 0.1))
    plant.CalcMassMatrix(context)
    tip = plant.get_body(BodyIndex(plant.num_bodies() - 1)).body_frame()
    return plant.CalcPointsPositions(context, tip, [0, 0, 0], plant.world_frame())


def stack():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.001)
    for k in range(3):
        body = plant.AddRigidBody(f"b{k}", SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 0.1))
        friction = CoulombFriction(0.5, 0.5)
        plant.RegisterCollisionGeometry(body, RigidTransform(), Box(0.1, 0.1, 0.1), f"c{k}", friction)
        plant.RegisterVisualGeometry(body, RigidTransform(), Box(0.1, 0.1, 0.1), f"v{k}", [1, 0, 0, 1])
    plant.Finalize()
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyContextFromRoot(simulator.get_mutable_context())
    for k in range(3):
        plant.SetFreeBodyPose(context, plant.GetBodyByName(f"b{k}"), RigidTransform([0, 0, 0.05 + 0.1 * k]))
    simulator.AdvanceTo(0.003)


def program():
    for _ in range(10):
        simulate(0.001, robots.cart_pole())
        simulate(0.0, robots.cart_pole())
        simulate(0.001, robots.arm())
        ask(robots.arm())
        stack()


for _ in range(3):
    program()
