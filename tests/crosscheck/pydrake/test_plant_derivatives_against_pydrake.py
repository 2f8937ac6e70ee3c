"""Gradients of model quantities on AutoDiffXd equal pydrake's."""

import importlib

import numpy as np
import pytest

pytest.importorskip("pydrake")

from random_plants import build, pydrake, random_state, sheldrake
from test_plant_against_pydrake import close

from sheldrake.autodiffutils import _complex_step
from sheldrake.multibody.plant._context import dual_calls

pytestmark = pytest.mark.peer


def gradients(lib, seed):
    """Names and derivatives with respect to (q, v) of everything a plant can be asked for."""
    ad = importlib.import_module(f"{lib.library}.autodiffutils")
    plant = build(lib, seed, num_bodies=5).ToAutoDiffXd()
    assert isinstance(plant, lib.MultibodyPlant_[ad.AutoDiffXd])
    context = plant.CreateDefaultContext()
    q, v, _ = random_state(plant, seed)
    plant.SetPositionsAndVelocities(context, ad.InitializeAutoDiff(np.concatenate([q, v])).ravel())
    plant.get_actuation_input_port().FixValue(context, np.array([ad.AutoDiffXd(1.5)] * plant.num_actuators()))
    body, world = plant.get_body(lib.BodyIndex(2)), plant.world_frame()
    kV = lib.JacobianWrtVariable.kV
    forces = lib.MultibodyForces_[ad.AutoDiffXd](plant)
    plant.CalcForceElementsContribution(context, forces)
    v = plant.GetVelocities(context)
    values = {
        "mass matrix": plant.CalcMassMatrix(context),
        "bias": plant.CalcBiasTerm(context),
        "gravity": plant.CalcGravityGeneralizedForces(context),
        "centre of mass": plant.CalcCenterOfMassPositionInWorld(context),
        "pose": plant.EvalBodyPoseInWorld(context, body).GetAsMatrix34(),
        "velocity": plant.EvalBodySpatialVelocityInWorld(context, body).get_coeffs(),
        "Jacobian": plant.CalcJacobianSpatialVelocity(context, kV, body.body_frame(), [0.1, 0.2, 0.3], world, world),
        "potential energy": np.array([plant.CalcPotentialEnergy(context)]),
        "kinetic energy": np.array([plant.CalcKineticEnergy(context)]),
        "qdot": plant.MapVelocityToQDot(context, v),
        "inverse dynamics": plant.CalcInverseDynamics(context, v, forces),
        "points": plant.CalcPointsPositions(context, body.body_frame(), np.arange(6.0).reshape(3, 2), world),
        "velocity of the centre of mass": plant.CalcCenterOfMassTranslationalVelocityInWorld(context),
        "Jacobian of the centre of mass": plant.CalcJacobianCenterOfMassTranslationalVelocity(
            context, kV, world, world
        ),
        "momentum": plant.CalcSpatialMomentumInWorldAboutPoint(context, [0.1, 0.2, 0.3]).get_coeffs(),
        "Jacobian by qdot": plant.CalcJacobianTranslationalVelocity(
            context, lib.JacobianWrtVariable.kQDot, body.body_frame(), [0.1, 0.2, 0.3], world, body.body_frame()
        ),
        "bias acceleration": plant.CalcBiasSpatialAcceleration(
            context, kV, body.body_frame(), [0.1, 0.2, 0.3], world, world
        ).get_coeffs(),
        "relative velocity": body.body_frame()
        .CalcSpatialVelocity(context, plant.get_body(lib.BodyIndex(1)).body_frame(), world)
        .get_coeffs(),
        "relative acceleration": body.body_frame()
        .CalcSpatialAcceleration(context, plant.get_body(lib.BodyIndex(1)).body_frame(), body.body_frame())
        .get_coeffs(),
        "velocities of points": plant.CalcPointsVelocities(
            context,
            body.body_frame(),
            np.arange(6.0).reshape(3, 2),
            plant.get_body(lib.BodyIndex(1)).body_frame(),
            world,
        ),
        "acceleration of the centre of mass": plant.CalcCenterOfMassTranslationalAccelerationInWorld(context),
        "acceleration of a body's centre": body.CalcCenterOfMassTranslationalAccelerationInWorld(context),
        "inertia of two bodies": plant.CalcSpatialInertia(
            context, body.body_frame(), [body.index(), lib.BodyIndex(1)]
        ).CopyToFullMatrix6(),
        "acceleration": plant.EvalBodySpatialAccelerationInWorld(context, body).get_coeffs(),
        "accelerations": np.array([A.get_coeffs() for A in plant.CalcSpatialAccelerationsFromVdot(context, v)]),
        "generalized forces": plant.CalcGeneralizedForces(context, forces),
        "forces of elements": forces.generalized_forces(),
        "spatial inertia": plant.CalcSpatialInertia(context, world, [body.index()]).CopyToFullMatrix6(),
        "mass matrix from inverse dynamics": plant.CalcMassMatrixViaInverseDynamics(context),
        "derivatives": np.array(plant.EvalTimeDerivatives(context).CopyToVector()),
    }
    return {name: ad.ExtractGradient(np.reshape(value, (-1, 1))) for name, value in values.items()}


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_gradients(monkeypatch, seed, compiled):
    for module, patience in ((_complex_step, "PATIENCE"), (dual_calls, "_NUMBERS")):
        monkeypatch.setattr(module, patience, 0 if compiled else 10**9)
    if not compiled:
        monkeypatch.setattr(dual_calls.kernel_store, "is_ready", lambda kernel: False)
    ours, theirs = gradients(sheldrake(), seed), gradients(pydrake(), seed)
    for name in theirs:
        close(ours[name], theirs[name], tolerance=1e-11)
