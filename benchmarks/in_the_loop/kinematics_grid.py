"""Forward kinematics of a grid; lookups by name; Jacobians; values of poses."""

import _robots as robots
import numpy as np
from pydrake.all import JacobianWrtVariable, MultibodyPlant, Parser

plant = MultibodyPlant(0.0)
arm = Parser(plant).AddModelsFromString(robots.arm(), "urdf")[0]
plant.Finalize()
context = plant.CreateDefaultContext()


def program():
    s = 0
    for a in np.linspace(-1, 1, 20):
        for b in np.linspace(-1, 1, 20):
            q = np.zeros(7)
            q[1] = a
            q[3] = b
            plant.SetPositions(context, arm, q)
            X = plant.GetFrameByName("link7").CalcPoseInWorld(context)
            p = X.translation()
            rpy = X.rotation().ToRollPitchYaw()
            s += p[0] + rpy.yaw_angle()
            pt = plant.CalcPointsPositions(context, plant.GetFrameByName("link7"), [0, 0, 0.1], plant.world_frame())
            s += pt.sum()
            J = plant.CalcJacobianTranslationalVelocity(
                context,
                JacobianWrtVariable.kQDot,
                plant.GetFrameByName("link7"),
                [0, 0, 0],
                plant.world_frame(),
                plant.world_frame(),
            )
            s += np.sqrt(np.maximum(np.linalg.det(J @ J.T), 0))
            plant.CalcCenterOfMassPositionInWorld(context)
            plant.GetBodyByName("link7").EvalSpatialVelocityInWorld(context)
            for name in ["link1", "link2", "link3"]:
                Xi = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName(name))
                s += (Xi.InvertAndCompose(X)).translation()[0]
            for i in range(1, 8):
                jt = plant.GetJointByName(f"joint{i}")
                s += jt.get_angle(context)
    return s


for _ in range(3):
    program()
