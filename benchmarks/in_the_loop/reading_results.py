"""An arm and a ball on the ground; after every step a script reads contacts, reactions, accelerations and a log."""

import _robots as robots
import numpy as np
from pydrake.all import (
    AddMultibodyPlantSceneGraph,
    Box,
    CoulombFriction,
    DiagramBuilder,
    LogVectorOutput,
    Parser,
    RigidTransform,
    Simulator,
    SpatialInertia,
    Sphere,
)


def program():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.001)
    arm = Parser(plant).AddModelsFromString(robots.arm(False), "urdf")[0]
    ball = plant.AddRigidBody("ball", plant.AddModelInstance("ball"), SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    friction = CoulombFriction(0.5, 0.5)
    plant.RegisterCollisionGeometry(ball, RigidTransform(), Sphere(0.1), "ball", friction)
    below = RigidTransform([0.0, 0.0, -2.0])
    plant.RegisterCollisionGeometry(plant.world_body(), below, Box(9.0, 9.0, 2.0), "ground", friction)
    plant.Finalize()
    log = LogVectorOutput(plant.get_state_output_port(), builder)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    root = simulator.get_mutable_context()
    context = plant.GetMyContextFromRoot(root)
    plant.SetFreeBodyPose(context, ball, RigidTransform([2.0, 2.0, -0.901]))
    plant.SetPositions(context, arm, np.full(plant.num_positions(arm), 0.3))
    plant.get_actuation_input_port().FixValue(context, np.zeros(plant.num_actuators()))
    contacts, reactions = plant.get_contact_results_output_port(), plant.get_reaction_forces_output_port()
    accelerations, poses = plant.get_generalized_acceleration_output_port(), plant.get_body_poses_output_port()
    simulator.Initialize()
    found = []
    for k in range(1, 101):
        simulator.AdvanceTo(0.001 * k)
        results = contacts.Eval(context)
        for i in range(results.num_point_pair_contacts()):
            info = results.point_pair_contact_info(i)
            found.append([info.contact_force()[2], info.point_pair().depth, info.slip_speed()])
        torque = [force.rotational() for force in reactions.Eval(context)]
        X_WB = poses.Eval(context)[int(ball.index())]
        found.append([torque[0][2], accelerations.Eval(context)[0], X_WB.translation()[2]])
        log.FindLog(root).data()[:, -1]
    return np.array(found)


for _ in range(3):
    program()
