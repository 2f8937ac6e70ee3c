"""Balls, boxes, cans and capsules fall into a bin, which in the end weighs what it should.

Run it: python examples/clutter.py [--headless]
"""

import sys

import numpy as np

from sheldrake.all import (
    AddMultibodyPlantSceneGraph,
    Box,
    CalcSpatialInertia,
    Capsule,
    CoulombFriction,
    Cylinder,
    DiagramBuilder,
    MeshcatVisualizer,
    RigidTransform,
    RollPitchYaw,
    Simulator,
    Sphere,
    StartMeshcat,
)

BIN, WALL, HEIGHT, DENSITY = 0.5, 0.02, 0.25, 700.0
"""Inner width of the bin, thickness and height of its walls [m]; density of the things [kg/m^3]."""
SHAPES = (Sphere(0.04), Box(0.1, 0.06, 0.05), Cylinder(0.03, 0.1), Capsule(0.025, 0.08))
COLORS = ([0.85, 0.3, 0.25, 1.0], [0.95, 0.7, 0.2, 1.0], [0.3, 0.6, 0.4, 1.0], [0.2, 0.45, 0.8, 1.0])
FRICTION = CoulombFriction(0.5, 0.4)


def add_bin(plant):
    half, outer = (BIN + WALL) / 2, BIN + 2 * WALL
    parts = [([outer, outer, WALL], [0, 0, -WALL / 2])]
    parts += [([WALL, BIN, HEIGHT], [x, 0, HEIGHT / 2]) for x in (-half, half)]
    parts += [([outer, WALL, HEIGHT], [0, y, HEIGHT / 2]) for y in (-half, half)]
    for i, (sides, p_WG) in enumerate(parts):
        wall = plant.world_body(), RigidTransform(p_WG), Box(*sides), f"bin{i}"
        plant.RegisterCollisionGeometry(*wall, FRICTION)
        plant.RegisterVisualGeometry(*wall, [0.6, 0.6, 0.65, 0.4])


def add_things(plant, number):
    random = np.random.default_rng(0)  # with 1 a can rocks on balls for long: nothing resists rolling
    for i in range(number):
        body = plant.AddRigidBody(f"thing{i}", CalcSpatialInertia(SHAPES[i % 4], DENSITY))
        plant.RegisterCollisionGeometry(body, RigidTransform(), SHAPES[i % 4], "thing", FRICTION)
        plant.RegisterVisualGeometry(body, RigidTransform(), SHAPES[i % 4], "thing", COLORS[i % 4])
        x, y = 0.12 * np.array([i % 3 - 1, i // 3 % 3 - 1]) + random.uniform(-0.01, 0.01, 2)
        X_WB = RigidTransform(RollPitchYaw(random.uniform(-np.pi, np.pi, 3)), [x, y, 0.15 + 0.13 * (i // 9)])
        plant.SetDefaultFloatingBaseBodyPose(body, X_WB)


def main(meshcat=None, seconds=2.5, number=27):
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=2e-3)
    add_bin(plant)
    add_things(plant, number)
    plant.Finalize()
    if meshcat is not None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    simulator = Simulator(builder.Build())
    simulator.set_target_realtime_rate(1.0 if meshcat is not None else 0.0)
    simulator.AdvanceTo(seconds)

    plant_context = plant.GetMyContextFromRoot(simulator.get_context())
    contacts = plant.get_contact_results_output_port().Eval(plant_context)
    load = 0.0  # of the bin [N]: it is part of the world, body 0, always A of a pair
    for i in range(contacts.num_point_pair_contacts()):
        info = contacts.point_pair_contact_info(i)
        load += info.contact_force()[2] if info.bodyA_index() == 0 else 0.0  # the force on body B
    weight, energy = plant.CalcTotalMass(plant_context) * 9.81, plant.EvalKineticEnergy(plant_context)
    print(f"the bin bears {load:.3f} N of {weight:.3f} N; the things' kinetic energy is {energy:.1e} J")
    return load / weight, energy


if __name__ == "__main__":
    main(None if "--headless" in sys.argv else StartMeshcat())
