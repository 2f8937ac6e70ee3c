"""Differential inverse kinematics of an arm by its Jacobian."""

import _robots as robots
import numpy as np
from pydrake.all import (
    DifferentialInverseKinematicsParameters,
    DoDifferentialInverseKinematics,
    JacobianWrtVariable,
    MultibodyPlant,
    Parser,
    RigidTransform,
    RotationMatrix,
)

plant = MultibodyPlant(0.0)
Parser(plant).AddModelsFromString(robots.arm(), "urdf")
plant.Finalize()


def program():
    context = plant.CreateDefaultContext()
    frame = plant.GetFrameByName("link7")
    W = plant.world_frame()
    q = np.full(7, 0.3)
    plant.SetPositions(context, q)
    X_goal = plant.CalcRelativeTransform(context, W, frame) @ RigidTransform(
        RotationMatrix.MakeZRotation(0.3), [0.05, 0.02, 0.03]
    )
    for _ in range(300):
        plant.SetPositions(context, q)
        X = plant.CalcRelativeTransform(context, W, frame)
        J = plant.CalcJacobianSpatialVelocity(context, JacobianWrtVariable.kV, frame, [0, 0, 0], W, W)
        dp = X_goal.translation() - X.translation()
        R = X_goal.rotation().multiply(X.rotation().transpose())
        aa = R.ToAngleAxis()
        V = np.hstack([aa.axis() * aa.angle(), dp])
        v = np.linalg.pinv(J) @ V
        q = q + 0.05 * v
        q = np.clip(q, plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits())
        plant.MapVelocityToQDot(context, v)
    prm = DifferentialInverseKinematicsParameters(7, 7)
    prm.set_time_step(0.01)
    prm.set_joint_velocity_limits((-np.ones(7), np.ones(7)))
    for _ in range(50):
        plant.SetPositions(context, q)
        J = plant.CalcJacobianSpatialVelocity(context, JacobianWrtVariable.kV, frame, [0, 0, 0], W, W)
        r = DoDifferentialInverseKinematics(q, np.zeros(7), np.array([0, 0, 0.01, 0.1, 0, 0]), J, prm)
        assert r.joint_velocities is not None
        q = q + 0.01 * r.joint_velocities
    return q


for _ in range(3):
    program()
