"""Two fingers close on a box and lift it: friction carries its weight, as long as the grip is firm.

Run it: python examples/gripper.py [--headless]
"""

import sys

from sheldrake.all import (
    AddMultibodyPlantSceneGraph,
    Box,
    CoulombFriction,
    DiagramBuilder,
    FixedOffsetFrame,
    MeshcatVisualizer,
    PdControllerGains,
    PiecewisePolynomial,
    PrismaticJoint,
    RigidTransform,
    Simulator,
    SpatialInertia,
    StartMeshcat,
    TrajectorySource,
)

SIDE, MASS, LIFT, FRICTION = 0.06, 0.5, 0.12, CoulombFriction(0.6, 0.5)  # [m], [kg], [m]


def add_block(plant, instance, name, mass, sides, color=(0.5, 0.5, 0.55, 1.0)):
    body = plant.AddRigidBody(name, instance, SpatialInertia.SolidBoxWithMass(mass, *sides))
    plant.RegisterVisualGeometry(body, RigidTransform(), Box(*sides), name, color)
    plant.RegisterCollisionGeometry(body, RigidTransform(), Box(*sides), name, FRICTION)
    return body


def add_slide(plant, name, parent, p_PJ, child, axis, gains):
    frame = plant.AddFrame(FixedOffsetFrame(f"{name}_frame", parent.body_frame(), RigidTransform(p_PJ)))
    joint = plant.AddJoint(PrismaticJoint(name, frame, child.body_frame(), axis))
    plant.AddJointActuator(name, joint).set_controller_gains(PdControllerGains(p=gains[0], d=gains[1]))


def add_scene(plant):
    gripper = plant.AddModelInstance("gripper")
    hand = add_block(plant, gripper, "hand", 1.0, [0.24, 0.06, 0.03])
    add_slide(plant, "lift", plant.world_body(), [0, 0, 0.15], hand, [0, 0, 1], (2e4, 400.0))
    for name, side in (("left", -1), ("right", 1)):
        finger = add_block(plant, gripper, name, 0.1, [0.02, 0.05, 0.12])
        add_slide(plant, name, hand, [0.07 * side, 0, -0.08], finger, [-side, 0, 0], (4e3, 80.0))
    box = add_block(plant, plant.AddModelInstance("box"), "box", MASS, [SIDE] * 3, [0.9, 0.6, 0.2, 1.0])
    plant.SetDefaultFloatingBaseBodyPose(box, RigidTransform([0, 0, SIDE / 2]))
    table, X_WG = Box(0.5, 0.3, 0.04), RigidTransform([0, 0, -0.02])
    plant.RegisterCollisionGeometry(plant.world_body(), X_WG, table, "table", FRICTION)
    plant.RegisterVisualGeometry(plant.world_body(), X_WG, table, "table", [0.7, 0.7, 0.65, 1.0])
    return gripper, box


def main(meshcat=None, seconds=2.0):
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
    gripper, box = add_scene(plant)
    plant.Finalize()
    way = [[0.0, 0.0, LIFT], [0.0, 0.035, 0.035], [0.0, 0.035, 0.035]]  # lift, left, right; 20 N from 30 mm on
    path = PiecewisePolynomial.CubicShapePreserving([0.0, 0.5, 1.5], way, zero_end_point_derivatives=True)
    wanted = builder.AddSystem(TrajectorySource(path, output_derivative_order=1))
    builder.Connect(wanted.get_output_port(), plant.get_desired_state_input_port(gripper))
    if meshcat is not None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    simulator = Simulator(builder.Build())
    simulator.set_target_realtime_rate(1.0 if meshcat is not None else 0.0)
    simulator.AdvanceTo(seconds)
    plant_context = plant.GetMyContextFromRoot(simulator.get_context())
    contacts = plant.get_contact_results_output_port().Eval(plant_context)
    up = sum(contacts.point_pair_contact_info(i).contact_force()[2] for i in range(contacts.num_point_pair_contacts()))
    lifted = plant.EvalBodyPoseInWorld(plant_context, box).translation()[2] - SIDE / 2
    print(f"the box is lifted by {lifted:.4f} m; friction carries {up:.4f} N of its weight, {MASS * 9.81:.4f} N")
    return up / (MASS * 9.81), lifted


if __name__ == "__main__":
    main(None if "--headless" in sys.argv else StartMeshcat())
