"""A pendulum swings far: its period is an elliptic integral, not 2 pi sqrt(l/g).

Run it: python examples/pendulum.py [--headless]
"""

import sys

import numpy as np
from scipy.special import ellipk

from sheldrake.all import (
    AddMultibodyPlantSceneGraph,
    Cylinder,
    DiagramBuilder,
    LogVectorOutput,
    MeshcatVisualizer,
    RevoluteJoint,
    RigidTransform,
    Simulator,
    SpatialInertia,
    Sphere,
    StartMeshcat,
    UnitInertia,
)

MASS, LENGTH, RADIUS = 1.0, 0.5, 0.05
"""Of the bob: mass [kg], distance of its centre from the pivot [m], radius [m]."""
ANGLE = 2.5
"""Where it is let go [rad]."""


def add_pendulum(plant):
    p_BoBcm_B = np.array([0.0, 0.0, -LENGTH])
    G_BBo_B = UnitInertia.SolidSphere(RADIUS).ShiftFromCenterOfMass(p_BoBcm_B)
    bob = plant.AddRigidBody("bob", SpatialInertia(MASS, p_BoBcm_B, G_BBo_B))
    plant.RegisterVisualGeometry(bob, RigidTransform(p_BoBcm_B), Sphere(RADIUS), "bob", [0.8, 0.3, 0.2, 1.0])
    plant.RegisterVisualGeometry(
        bob, RigidTransform(p_BoBcm_B / 2), Cylinder(0.008, LENGTH), "rod", [0.5, 0.5, 0.5, 1.0]
    )
    return plant.AddJoint(RevoluteJoint("pivot", plant.world_frame(), bob.body_frame(), [0, 1, 0]))


def main(meshcat=None, seconds=6.0):
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
    pivot = add_pendulum(plant)
    plant.Finalize()
    logger = LogVectorOutput(plant.get_state_output_port(), builder, publish_period=0.01)
    if meshcat is not None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    diagram = builder.Build()

    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    pivot.set_angle(plant.GetMyMutableContextFromRoot(context), ANGLE)
    simulator.get_mutable_integrator().set_target_accuracy(1e-8)
    simulator.set_target_realtime_rate(1.0 if meshcat is not None else 0.0)
    simulator.AdvanceTo(seconds)

    times, (angles, rates) = logger.FindLog(context).sample_times(), logger.FindLog(context).data()
    falls = np.flatnonzero((angles[:-1] > 0) & (angles[1:] <= 0))  # it passes the bottom, once a period
    crossings = times[falls] - angles[falls] / rates[falls]
    period = np.diff(crossings).mean()
    inertia = MASS * (LENGTH**2 + 0.4 * RADIUS**2)  # about the pivot [kg m^2]
    expected = 4.0 * np.sqrt(inertia / (MASS * 9.81 * LENGTH)) * ellipk(np.sin(ANGLE / 2) ** 2)
    print(f"period {period:.5f} s; by the elliptic integral {expected:.5f} s")
    return period / expected


if __name__ == "__main__":
    main(None if "--headless" in sys.argv else StartMeshcat())
