"""A camera looks at things on a table: the ball is found by its label, its place and radius by depth alone.

Run it: python examples/camera.py [--headless]
"""

import sys

import numpy as np

from sheldrake.all import (
    AddMultibodyPlantSceneGraph,
    ApplyCameraConfig,
    Box,
    CameraConfig,
    CoulombFriction,
    Cylinder,
    DiagramBuilder,
    MeshcatVisualizer,
    RigidTransform,
    RotationMatrix,
    Simulator,
    SpatialInertia,
    Sphere,
    StartMeshcat,
    Transform,
)

RADIUS = 0.06  # of the ball [m]
X_WC = RigidTransform(RotationMatrix.MakeXRotation(-np.pi + 0.7), [0.0, -0.55, 0.65])  # looks down, and ahead
THINGS = {
    "table": (Box(0.9, 0.6, 0.04), [0.0, 0.0, -0.02], [0.75, 0.7, 0.6, 1.0]),
    "ball": (Sphere(RADIUS), [0.02, -0.05, RADIUS], [0.85, 0.25, 0.2, 1.0]),
    "can": (Cylinder(0.05, 0.14), [-0.16, 0.08, 0.07], [0.3, 0.6, 0.35, 1.0]),
    "block": (Box(0.1, 0.14, 0.08), [0.17, 0.1, 0.04], [0.25, 0.4, 0.75, 1.0]),
}
"""Shape, place [m] and colour of the table and what is on it."""


def add_scene(plant):
    for name, (shape, place, color) in THINGS.items():
        body, X_BG = plant.world_body(), RigidTransform(place)
        if name != "table":
            body, X_BG = plant.AddRigidBody(name, SpatialInertia.SolidSphereWithMass(0.3, 0.05)), RigidTransform()
            plant.SetDefaultFloatingBaseBodyPose(body, RigidTransform(np.add(place, [0.0, 0.0, 1e-3])))
        plant.RegisterCollisionGeometry(body, X_BG, shape, name, CoulombFriction(0.6, 0.5))
        plant.RegisterVisualGeometry(body, X_BG, shape, name, color)


def main(meshcat=None, seconds=1.0, look=None):
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=2e-3)
    add_scene(plant)
    plant.Finalize()
    config = CameraConfig(name="eye", X_PB=Transform(X_WC), depth=True, label=True, z_far=2.0)
    ApplyCameraConfig(config, builder, plant=plant, scene_graph=scene_graph)
    if meshcat is not None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(seconds)

    camera = simulator.get_system().GetSubsystemByName("rgbd_sensor_eye")
    context = camera.GetMyContextFromRoot(simulator.get_context())
    if look is not None:
        look(camera, context)
    label, depth = (camera.GetOutputPort(p).Eval(context).data[..., 0] for p in ("label_image", "depth_image_32f"))
    v, u = np.nonzero(label == int(plant.GetBodyByName("ball").index()))
    z, (cx, cy) = depth[v, u].astype(float), config.principal_point()
    p_C = z * [(u + 0.5 - cx) / config.focal_x(), (v + 0.5 - cy) / config.focal_y(), np.ones(len(z))]
    p_W = X_WC @ p_C  # |p - c|^2 = r^2 is linear in c and r^2 - |c|^2:
    *c, d = np.linalg.lstsq(np.vstack([2.0 * p_W, np.ones(len(z))]).T, (p_W**2).sum(axis=0), rcond=None)[0]
    radius = np.sqrt(d + np.dot(c, c))
    plant_context = plant.GetMyContextFromRoot(simulator.get_context())
    off = np.linalg.norm(c - plant.EvalBodyPoseInWorld(plant_context, plant.GetBodyByName("ball")).translation())
    print(f"{len(z)} pixels see the ball: centre within {off:.1e} m, radius {radius:.6f} of {RADIUS} m")
    return off, radius / RADIUS


if __name__ == "__main__":
    main(None if "--headless" in sys.argv else StartMeshcat())
