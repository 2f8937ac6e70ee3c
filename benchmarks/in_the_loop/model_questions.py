"""Questions to models in loops: manipulator equations, derivatives, linearizations, gradients of a step."""

import _robots as robots
import numpy as np
from pydrake.all import (
    AddMultibodyPlantSceneGraph,
    DiagramBuilder,
    ExtractGradient,
    ExtractValue,
    FirstOrderTaylorApproximation,
    InitializeAutoDiff,
    JacobianWrtVariable,
    MakeVectorVariable,
    MultibodyForces,
    MultibodyPlant,
    Parser,
    RigidTransform,
)


def manipulator_equations(plant, context, q, v):
    plant.SetPositions(context, q)
    plant.SetVelocities(context, v)
    M, Cv = plant.CalcMassMatrixViaInverseDynamics(context), plant.CalcBiasTerm(context)
    tau_g, B = plant.CalcGravityGeneralizedForces(context), plant.MakeActuationMatrix()
    forces = MultibodyForces(plant)
    plant.CalcForceElementsContribution(context, forces)
    return np.linalg.solve(M, tau_g - Cv + B @ np.ones(B.shape[1]) + forces.generalized_forces())


def program():
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(robots.arm(), "urdf")
    plant.Finalize()
    context, generator = plant.CreateDefaultContext(), np.random.default_rng(2)
    n, hand = plant.num_positions(), plant.GetFrameByName("link7")
    actuation = plant.get_actuation_input_port()
    found = []
    for _ in range(100):
        q, v = generator.uniform(-1.0, 1.0, (2, n))
        found.append(manipulator_equations(plant, context, q, v))
        J = plant.CalcJacobianSpatialVelocity(
            context, JacobianWrtVariable.kV, hand, [0.0, 0.0, 0.1], plant.world_frame(), plant.world_frame()
        )
        bias = plant.CalcBiasSpatialAcceleration(
            context, JacobianWrtVariable.kV, hand, [0.0, 0.0, 0.1], plant.world_frame(), plant.world_frame()
        )
        found[-1] = found[-1] + np.linalg.pinv(J) @ bias.get_coeffs()
        found.append(plant.CalcCenterOfMassPositionInWorld(context)[:1] + plant.CalcTotalMass(context))
        X = hand.CalcPose(context, plant.GetFrameByName("link3")) @ RigidTransform([0.1, 0.0, 0.0])
        found.append(X.inverse().translation())
    for _ in range(30):  # a simulation by hand
        actuation.FixValue(context, np.zeros(n))
        x = plant.GetPositionsAndVelocities(context)
        dx = plant.EvalTimeDerivatives(context).CopyToVector()
        plant.SetPositionsAndVelocities(context, x + 0.001 * dx)
    for _ in range(5):
        output = plant.get_state_output_port().get_index()
        found.append(FirstOrderTaylorApproximation(plant, context, actuation.get_index(), output).A()[-1])
    return np.concatenate(found)


def gradient():
    plant = MultibodyPlant(0.01)
    Parser(plant).AddModelsFromString(robots.cart_pole(), "urdf")
    plant.SetUseSampledOutputPorts(False)
    plant.Finalize()
    duals = plant.ToAutoDiffXd()
    context = duals.CreateDefaultContext()
    found = []
    for k in range(20):
        z = InitializeAutoDiff([0.0, 0.1 * k, 0.0, 0.2, 1.0])
        context.SetDiscreteState(z[:4, 0])
        duals.get_actuation_input_port().FixValue(context, z[4:, 0])
        state = duals.EvalUniquePeriodicDiscreteUpdate(context).value()
        found += [ExtractGradient(state).ravel(), ExtractValue(state).ravel()]
    return np.concatenate(found)


def symbols():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    Parser(plant).AddModelsFromString(robots.cart_pole(), "urdf")
    plant.Finalize()
    other = plant.ToSymbolic()
    context = other.CreateDefaultContext()
    q = MakeVectorVariable(other.num_positions(), "q")
    other.SetPositions(context, q)
    other.SetVelocities(context, MakeVectorVariable(other.num_velocities(), "v"))
    M, Cv = other.CalcMassMatrixViaInverseDynamics(context), other.CalcBiasTerm(context)
    return len(str(M[0, 0])) + len(str(Cv[0]))


for _ in range(3):
    program()
    gradient()
    symbols()
