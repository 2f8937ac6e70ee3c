"""Small AdvanceTo in a while loop, reading poses, contacts, energies."""

import _robots as robots
import numpy as np
from pydrake.all import (
    AddMultibodyPlantSceneGraph,
    Box,
    CoulombFriction,
    DiagramBuilder,
    Parser,
    RigidTransform,
    RollPitchYaw,
    Simulator,
    SpatialInertia,
    UnitInertia,
)


def program():
    builder = DiagramBuilder()
    plant, _sg = AddMultibodyPlantSceneGraph(builder, 0.001)
    Parser(plant).AddModelsFromString(robots.arm(), "urdf")
    box = plant.AddRigidBody(
        "box",
        plant.AddModelInstance("box"),
        SpatialInertia(mass=1.0, p_PScm_E=np.zeros(3), G_SP_E=UnitInertia.SolidBox(0.1, 0.1, 0.1)),
    )
    plant.RegisterCollisionGeometry(box, RigidTransform(), Box(0.1, 0.1, 0.1), "box", CoulombFriction(0.5, 0.5))
    plant.RegisterCollisionGeometry(
        plant.world_body(), RigidTransform([0, 0, -0.5]), Box(10, 10, 1), "ground", CoulombFriction(0.5, 0.5)
    )
    plant.Finalize()
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    pc = plant.GetMyMutableContextFromRoot(context)
    plant.SetFreeBodyPose(pc, box, RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [1, 0, 0.3]))
    plant.get_actuation_input_port().FixValue(pc, np.zeros(7))
    simulator.set_target_realtime_rate(0)
    simulator.Initialize()
    t = 0.0
    dt = 0.001
    traj = []
    tip = plant.GetBodyByName("link7")
    while t < 0.5:
        q = plant.GetPositions(pc, plant.GetModelInstanceByName("arm"))
        v = plant.GetVelocities(pc, plant.GetModelInstanceByName("arm"))
        plant.get_actuation_input_port().FixValue(pc, -5 * q - 2 * v)
        t += dt
        simulator.AdvanceTo(t)
        X = plant.EvalBodyPoseInWorld(pc, tip)
        X_box = plant.GetFreeBodyPose(pc, box)
        rpy = RollPitchYaw(X.rotation()).vector()
        rel = X.inverse() @ X_box
        V = plant.EvalBodySpatialVelocityInWorld(pc, tip)
        contacts = plant.get_contact_results_output_port().Eval(pc)
        f = np.zeros(3)
        for i in range(contacts.num_point_pair_contacts()):
            info = contacts.point_pair_contact_info(i)
            f += info.contact_force()
        e = plant.EvalKineticEnergy(pc) + plant.EvalPotentialEnergy(pc)
        traj.append(
            np.concatenate(
                [
                    X.translation(),
                    rpy,
                    rel.translation(),
                    V.translational(),
                    f,
                    [e],
                    X_box.rotation().ToQuaternion().wxyz(),
                ]
            )
        )
    return np.array(traj)


for _ in range(3):
    program()
