"""Minimum-distance constraints on an arm beside boxes: made, evaluated with derivatives, and used in a posture."""

import _robots as robots
import numpy as np
from pydrake.all import (
    AddMultibodyPlantSceneGraph,
    DiagramBuilder,
    InitializeAutoDiff,
    MinimumDistanceLowerBoundConstraint,
    Parser,
    RigidTransform,
)


def program():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    parser = Parser(plant)
    parser.AddModelsFromString(robots.arm(), "urdf")
    parser.AddModelsFromString(robots.table(), "urdf")
    generator = np.random.default_rng(5)
    for i in range(6):
        parser.AddModelsFromString(robots.box(f"box{i}", 0.1), "urdf")
        place = RigidTransform([*generator.uniform(-0.6, 0.6, 2), generator.uniform(0.2, 0.8)])
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName(f"box{i}"), place)
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plant_context = plant.GetMyMutableContextFromRoot(context)
    for _ in range(3):
        constraint = MinimumDistanceLowerBoundConstraint(
            plant=plant, bound=0.01, plant_context=plant_context, influence_distance_offset=0.1
        )
        for q in generator.uniform(-1.5, 1.5, (40, 7)):
            constraint.Eval(q)
        for q in generator.uniform(-1.5, 1.5, (40, 7)):
            constraint.Eval(InitializeAutoDiff(q))
    for q in generator.uniform(-1.5, 1.5, (60, 7)):
        plant.SetPositions(plant_context, q)
        query = plant.get_geometry_query_input_port().Eval(plant_context)
        query.ComputeSignedDistancePairwiseClosestPoints(0.1)
        query.HasCollisions()
        query.ComputePointPairPenetration()


for _ in range(3):
    program()
