"""Ten boxes on top of each other: each bears the weight of all above it.

Run it: python examples/stack.py [--headless]
"""

import sys

import numpy as np

from sheldrake.all import (
    AddMultibodyPlantSceneGraph,
    Box,
    CoulombFriction,
    DiagramBuilder,
    HalfSpace,
    MeshcatVisualizer,
    RigidTransform,
    RollPitchYaw,
    Simulator,
    SpatialInertia,
    StartMeshcat,
)

NUMBER, SIDE, MASS = 10, 0.1, 0.5
"""Boxes, their side [m] and mass [kg]."""


def add_scene(plant):
    """Adds the ground and the boxes, each turned a little and 1 mm above the one below."""
    friction = CoulombFriction(0.6, 0.5)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", friction)
    plant.RegisterVisualGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", [0.6, 0.65, 0.7, 1.0])
    for i in range(NUMBER):
        box = plant.AddRigidBody(f"box{i}", SpatialInertia.SolidBoxWithMass(MASS, SIDE, SIDE, SIDE))
        plant.RegisterCollisionGeometry(box, RigidTransform(), Box(SIDE, SIDE, SIDE), "box", friction)
        color = [0.9 - 0.07 * i, 0.4, 0.2 + 0.07 * i, 1.0]
        plant.RegisterVisualGeometry(box, RigidTransform(), Box(SIDE, SIDE, SIDE), "box", color)
        X_WB = RigidTransform(RollPitchYaw(0.0, 0.0, 0.1 * i), [0.0, 0.0, (i + 0.5) * SIDE + (i + 1) * 1e-3])
        plant.SetDefaultFloatingBaseBodyPose(box, X_WB)


def main(meshcat=None, seconds=2.0):
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=2e-3)
    add_scene(plant)
    plant.Finalize()
    if meshcat is not None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    simulator = Simulator(builder.Build())
    simulator.set_target_realtime_rate(1.0 if meshcat is not None else 0.0)
    simulator.AdvanceTo(seconds)

    plant_context = plant.GetMyContextFromRoot(simulator.get_context())
    contacts = plant.get_contact_results_output_port().Eval(plant_context)
    load = np.zeros(NUMBER)  # what presses on each box from below [N]
    for i in range(contacts.num_point_pair_contacts()):
        info = contacts.point_pair_contact_info(i)
        upper = max(int(info.bodyA_index()), int(info.bodyB_index()))
        load[upper - 1] += abs(info.contact_force()[2])  # body 0 is the world, body 1 the lowest box
    expected = MASS * 9.81 * np.arange(NUMBER, 0, -1)
    off = abs(load - expected).max()
    speed = abs(plant.GetVelocities(plant_context)).max()
    print(
        f"each box bears what is above it within {off:.1e} N of {expected[0]:.2f} N; fastest {speed:.1e} (rad/s or m/s)"
    )
    return off, speed


if __name__ == "__main__":
    main(None if "--headless" in sys.argv else StartMeshcat())
