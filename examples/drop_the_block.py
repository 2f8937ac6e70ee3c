"""A block falls on the ground and comes to rest: watch it, log it, plot it.

    python examples/drop_the_block.py [file.urdf] [--headless]

Prints the address of the page, takes 15 s of real time, and saves block.png where it was started. Without the page,
`--headless`, it takes as long as it needs.
"""

import sys

import numpy as np

from sheldrake import model_path
from sheldrake.all import (
    AddMultibodyPlantSceneGraph,
    CoulombFriction,
    DiagramBuilder,
    HalfSpace,
    LogVectorOutput,
    MeshcatVisualizer,
    Parser,
    RigidTransform,
    RollPitchYaw,
    Simulator,
    SpatialVelocity,
    StartMeshcat,
)
from sheldrake.visualization import PlotLog


def add_ground(plant):
    X_WG = HalfSpace.MakePose([0, 0, 1], [0, 0, 0])
    friction = CoulombFriction(static_friction=0.7, dynamic_friction=0.5)
    plant.RegisterCollisionGeometry(plant.world_body(), X_WG, HalfSpace(), "ground_collision", friction)
    plant.RegisterVisualGeometry(plant.world_body(), X_WG, HalfSpace(), "ground_visual", [0.6, 0.65, 0.7, 1.0])


def main(meshcat=None, seconds=15.0, urdf=None):
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
    (block,) = Parser(plant).AddModels(urdf or model_path("two_hole_block/two_hole_block.urdf"))
    add_ground(plant)
    plant.Finalize()
    logger = LogVectorOutput(plant.get_state_output_port(block), builder)
    logger.set_name("state logger")
    if meshcat is not None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    diagram = builder.Build()

    context = diagram.CreateDefaultContext()
    plant_context = plant.GetMyContextFromRoot(context)
    body = plant.GetBodyByName("body", block)
    plant.SetFreeBodyPose(plant_context, body, RigidTransform(RollPitchYaw(0.3, 0.2, 0.1), [0, 0, 0.1]))
    plant.SetFreeBodySpatialVelocity(plant_context, body, SpatialVelocity.Zero())

    simulator = Simulator(diagram, context)
    simulator.set_target_realtime_rate(1.0 if meshcat is not None else 0.0)
    simulator.Initialize()
    simulator.AdvanceTo(seconds)

    log = logger.FindLog(context)
    times, states = log.sample_times(), log.data()
    print(f"{len(times)} samples; the block rests at {np.round(states[4:7, -1], 4)} m")
    PlotLog(log, state_names=plant.GetStateNames(block)).savefig("block.png")
    return abs(states[7:, -1]).max()


if __name__ == "__main__":
    files = [argument for argument in sys.argv[1:] if argument != "--headless"]
    main(None if "--headless" in sys.argv else StartMeshcat(), urdf=files[0] if files else None)
