"""A run whose state is NaN or infinite ends with the time and the joint, in contact or not."""

import numpy as np
import pytest

from sheldrake.autodiffutils import InitializeAutoDiff
from sheldrake.geometry import Sphere
from sheldrake.math import RigidTransform
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction, DiscreteContactApproximation
from sheldrake.multibody.tree import JacobianWrtVariable, MultibodyForces, RevoluteJoint, SpatialInertia
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder

APPROXIMATIONS = [None, *DiscreteContactApproximation.__members__.values()]


def scene(approximation):
    """Two free bodies and a pendulum; None: in continuous time."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0 if approximation is None else 1e-3)
    if approximation is not None:
        plant.set_discrete_contact_approximation(approximation)
    for name in ("ball", "stone", "rod"):
        plant.AddRigidBody(name, SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    rod = plant.GetBodyByName("rod")
    plant.AddJoint(RevoluteJoint("hinge", plant.world_frame(), rod.body_frame(), [0.0, 1.0, 0.0]))
    plant.Finalize()
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.05)
    return simulator, plant, plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())


@pytest.mark.parametrize("approximation", APPROXIMATIONS, ids=str)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize(("joint", "k"), [("ball", 0), ("ball", 5), ("stone", 6), ("hinge", 0)])
def test_positions(approximation, value, joint, k):
    simulator, plant, context = scene(approximation)
    joint = plant.GetJointByName(joint)
    context._store.S[slice(*(context._place.xc if approximation is None else context._place.xd))][
        joint.position_start() + k
    ] = value
    context.SetAllCacheEntriesOutOfDate()
    with pytest.raises(RuntimeError, match=rf"at time 0\.05.*infinite or NaN.* joints '{joint.name()}'"):
        simulator.AdvanceTo(0.2)


@pytest.mark.parametrize("approximation", APPROXIMATIONS[1:], ids=str)
def test_velocities(approximation):
    simulator, plant, context = scene(approximation)
    joint = plant.GetJointByName("stone")
    at = context._place.xd[0] + plant.num_positions() + joint.velocity_start()
    context._store.S[at] = np.nan
    context.SetAllCacheEntriesOutOfDate()
    with pytest.raises(RuntimeError, match=r"at time 0\.05.*infinite or NaN.* joints 'stone'"):
        simulator.AdvanceTo(0.2)


@pytest.mark.parametrize("approximation", APPROXIMATIONS, ids=str)
def test_a_quaternion_of_zeros(approximation):
    simulator, plant, context = scene(approximation)
    plant.SetPositions(context, np.zeros(plant.num_positions()))
    before = plant.GetPositionsAndVelocities(context)
    with pytest.raises(RuntimeError, match=r"all elements of a quaternion are zero.*'ball', 'stone'; .*\(1, 0, 0, 0\)"):
        simulator.AdvanceTo(0.1)
    np.testing.assert_array_equal(plant.GetPositionsAndVelocities(context), before)


def queries(plant, context):
    """What needs poses."""
    ball, world = plant.GetBodyByName("ball"), plant.world_frame()
    frame = ball.body_frame()
    return {
        "pose of a body": lambda: plant.EvalBodyPoseInWorld(context, ball),
        "pose of a frame": lambda: plant.CalcRelativeTransform(context, frame, world),
        "pose of the joint": lambda: plant.GetJointByName("ball").GetPose(context),
        "points": lambda: plant.CalcPointsPositions(context, frame, np.zeros(3), world),
        "velocity": lambda: plant.EvalBodySpatialVelocityInWorld(context, ball),
        "jacobian": lambda: plant.CalcJacobianSpatialVelocity(
            context, JacobianWrtVariable.kV, frame, np.zeros(3), world, world
        ),
        "mass matrix": lambda: plant.CalcMassMatrix(context),
        "gravity": lambda: plant.CalcGravityGeneralizedForces(context),
        "energy": lambda: plant.CalcPotentialEnergy(context),
        "centre of mass": lambda: plant.CalcCenterOfMassPositionInWorld(context),
        "forces": lambda: plant.CalcForceElementsContribution(context, MultibodyForces(plant)),
        "port": lambda: plant.get_body_poses_output_port().Eval(context),
    }


@pytest.mark.parametrize("jit", ["1", "0"], ids=["compiled", "interpreted"])
def test_queries_of_a_quaternion_of_zeros(monkeypatch, jit):
    monkeypatch.setenv("SHELDRAKE_JIT", jit)
    _, plant, context = scene(None)
    asked = queries(plant, context)
    for ask in asked.values():
        ask()
    at_place = plant.GetPositions(context)
    plant.SetPositions(context, np.zeros(plant.num_positions()))
    for name, ask in asked.items():
        with pytest.raises(RuntimeError, match="all elements of a quaternion are zero"):
            pytest.fail(f"{name}: {ask()}")
    with pytest.raises(RuntimeError, match=r"joints 'ball', 'stone'; .*\(1, 0, 0, 0\)"):
        plant.CalcMassMatrix(context)
    plant.SetPositions(context, at_place)
    for ask in asked.values():
        ask()


def test_geometry_of_a_quaternion_of_zeros():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    for name in ("ball", "stone"):
        body = plant.AddRigidBody(name, SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        plant.RegisterCollisionGeometry(body, RigidTransform(), Sphere(0.1), name, CoulombFriction(0.5, 0.5))
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plant.SetPositions(plant.GetMyMutableContextFromRoot(context), np.zeros(14))
    query = scene_graph.get_query_output_port().Eval(scene_graph.GetMyContextFromRoot(context))
    with pytest.raises(RuntimeError, match="all elements of a quaternion are zero"):
        query.ComputeSignedDistancePairwiseClosestPoints()


def test_duals_of_a_quaternion_of_zeros():
    _, plant, _ = scene(None)
    plant = plant.ToAutoDiffXd()
    context = plant.CreateDefaultContext()
    zeros = InitializeAutoDiff(np.zeros(plant.num_positions())).ravel()
    for _ in range(60):  # as Python first, then as machine code
        plant.SetPositions(context, zeros)
        with pytest.raises(RuntimeError, match="all elements of a quaternion are zero"):
            plant.CalcMassMatrix(context)
