"""A ball bounces; each bounce gives back what Hunt and Crossley's law of contact says.

The force at depth x is k x (1 + d v), with v = dx/dt. The law has a first integral: with s = d v, the number
s - log(1 + s) is the same where the ball touches the ground (s > 0) and where it leaves (s < 0). That gives the speed
after a bounce, and the height (Hunt and Crossley 1975, "Coefficient of restitution interpreted as damping").

Run it: python examples/bouncing_ball.py [--headless]
"""

import sys

import numpy as np
from scipy.optimize import root_scalar

from sheldrake.all import (
    AddContactMaterial,
    AddMultibodyPlantSceneGraph,
    CoulombFriction,
    DiagramBuilder,
    HalfSpace,
    LogVectorOutput,
    MeshcatVisualizer,
    ProximityProperties,
    RigidTransform,
    Simulator,
    SpatialInertia,
    Sphere,
    StartMeshcat,
)

RADIUS, HEIGHT, DISSIPATION = 0.1, 1.0, 0.15
"""[m], of the ball's lowest point [m], d [s/m]."""


def add_scene(plant):
    ball = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(1.0, RADIUS))
    stiff = ProximityProperties()
    AddContactMaterial(DISSIPATION, 1e7, CoulombFriction(0.5, 0.5), stiff)
    rigid = ProximityProperties()
    AddContactMaterial(DISSIPATION, np.inf, CoulombFriction(0.5, 0.5), rigid)
    plant.RegisterCollisionGeometry(ball, RigidTransform(), Sphere(RADIUS), "ball", stiff)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", rigid)
    plant.RegisterVisualGeometry(ball, RigidTransform(), Sphere(RADIUS), "ball", [0.9, 0.4, 0.1, 1.0])
    plant.RegisterVisualGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", [0.6, 0.65, 0.7, 1.0])
    return ball


def main(meshcat=None, seconds=1.6):
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
    ball = add_scene(plant)
    plant.Finalize()
    logger = LogVectorOutput(plant.get_state_output_port(), builder, publish_period=1e-3)
    if meshcat is not None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    diagram = builder.Build()

    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    X_WB = RigidTransform([0.0, 0.0, HEIGHT + RADIUS])
    plant.SetFreeBodyPose(plant.GetMyMutableContextFromRoot(context), ball, X_WB)
    simulator.get_mutable_integrator().set_target_accuracy(1e-7)
    simulator.set_target_realtime_rate(1.0 if meshcat is not None else 0.0)
    simulator.AdvanceTo(seconds)

    log = logger.FindLog(context)
    heights, speeds = log.data()[6] - RADIUS, log.data()[12]
    rebound = np.argmax(speeds > 0.0)  # the first sample on the way up
    height = heights[rebound:].max()
    s = DISSIPATION * np.sqrt(2.0 * 9.81 * HEIGHT)
    first_integral = s - np.log1p(s)
    s_after = root_scalar(lambda r: r - np.log1p(r) - first_integral, bracket=(-1.0 + 1e-9, -1e-9)).root
    expected = (s_after / DISSIPATION) ** 2 / (2.0 * 9.81)
    print(f"bounces back to {height:.4f} m of {HEIGHT} m; by Hunt and Crossley's law {expected:.4f} m")
    return height / expected


if __name__ == "__main__":
    main(None if "--headless" in sys.argv else StartMeshcat(), seconds=6.0)
