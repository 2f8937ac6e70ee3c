"""Torques that hold an arm still at many postures: bias, gravity, Jacobians and least squares, call by call."""

import _robots as robots
import numpy as np
from pydrake.all import AddMultibodyPlantSceneGraph, DiagramBuilder, JacobianWrtVariable, MultibodyForces, Parser


def program():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    parser = Parser(plant)
    (arm,) = parser.AddModelsFromString(robots.arm(), "urdf")
    (hand,) = parser.AddModelsFromString(robots.hand(), "urdf")
    plant.WeldFrames(plant.GetFrameByName("link7"), plant.GetFrameByName("palm"))
    plant.Finalize()
    diagram = builder.Build()
    context = plant.GetMyMutableContextFromRoot(diagram.CreateDefaultContext())
    tips = [plant.GetFrameByName(f"finger{f}_3") for f in range(4)]
    W, generator = plant.world_frame(), np.random.default_rng(2)
    forces = MultibodyForces(plant)
    for q in generator.uniform(-1.0, 1.0, (200, plant.num_positions())):
        plant.SetPositions(context, q)
        plant.SetVelocities(context, 0.1 * q)
        tau = -plant.CalcGravityGeneralizedForces(context)
        for tip in tips:
            J = plant.CalcJacobianSpatialVelocity(context, JacobianWrtVariable.kV, tip, [0, 0, 0.04], W, W)
            X = plant.CalcRelativeTransform(context, W, tip)
            p = plant.CalcPointsPositions(context, tip, [0, 0, 0.04], W)
            tau = tau + J[3:].T @ (X.rotation().matrix() @ [0, 0, 1.0] + 0.0 * p.ravel())
            tip.CalcPoseInWorld(context)
            tip.CalcSpatialVelocityInWorld(context)
        forces.SetZero()
        plant.CalcForceElementsContribution(context, forces)
        plant.CalcInverseDynamics(context, np.zeros(plant.num_velocities()), forces)
        plant.CalcMassMatrixViaInverseDynamics(context)
        plant.CalcMassMatrix(context)
        plant.CalcBiasTerm(context)
        plant.CalcSpatialMomentumInWorldAboutPoint(context, [0, 0, 0])
        plant.GetPositions(context, arm)
        plant.GetVelocities(context, hand)
        plant.CalcKineticEnergy(context)
        plant.CalcPotentialEnergy(context)
        for joint in plant.GetJointIndices(hand):
            plant.get_joint(joint).name()
        plant.CalcBiasSpatialAcceleration(context, JacobianWrtVariable.kV, tips[0], [0, 0, 0], W, W)
        plant.CalcJacobianCenterOfMassTranslationalVelocity(context, JacobianWrtVariable.kV, W, W)
        plant.CalcCenterOfMassPositionInWorld(context)
        plant.CalcJacobianTranslationalVelocity(context, JacobianWrtVariable.kQDot, tips[0], [0, 0, 0], W, W)


for _ in range(3):
    program()
