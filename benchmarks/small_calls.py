"""Small calls as programs make them many times, against Drake: CPU time of one, in microseconds.

    python benchmarks/small_calls.py [FAMILY ...] [--rounds 5] [--slower]

Families: values, duals, motions, regulators, contexts, plant, python, present, questions, postures, curves, programs,
symbols, once, solving, sets, setting_up.

Each line is a call, or the few that belong together, on objects that exist. Both libraries take turns in one process.
`--slower` prints those lines only in which Drake is faster. What Drake keeps in its cache costs it a look in lines that
write nothing in between.
"""

from __future__ import annotations

import argparse
import functools
import importlib
import itertools
import pathlib
import statistics
import sys
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from benchmarks.robots import arm_urdf  # noqa: E402
from benchmarks.turns import machine, repeated_time, take_turns  # noqa: E402

Calls = dict[str, Callable[[], Any]]
FAMILIES: dict[str, Callable[[Any], Calls]] = {}
SECONDS_A_TURN = 0.02
KEPT: list[Any] = []


def family(make: Callable[[Any], Calls]) -> Callable[[Any], Calls]:
    """Adds a function of the library that makes calls, by title."""
    FAMILIES[make.__name__] = make
    return make


@family
def values(lib: Any) -> Calls:
    """Poses, rotations and spatial vectors."""
    R, S = lib.RotationMatrix(lib.RollPitchYaw(0.1, 0.2, 0.3)), lib.RotationMatrix.MakeZRotation(0.3)
    p, points = np.array([0.1, 0.2, 0.3]), np.ones((3, 10))
    X, Y, rpy = lib.RigidTransform(R, p), lib.RigidTransform(S, p), lib.RollPitchYaw(0.1, 0.2, 0.3)
    q, matrix, pose = R.ToQuaternion(), R.matrix(), X.GetAsMatrix4()
    V, W, F = (kind(p, p) for kind in (lib.SpatialVelocity, lib.SpatialVelocity, lib.SpatialForce))
    turned = lib.AngleAxis(0.3, [0.0, 0.0, 1.0])
    inertia = lib.SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.2, 0.3)
    return {
        "RigidTransform()": lambda: lib.RigidTransform(),
        "RigidTransform(p)": lambda: lib.RigidTransform(p),
        "RigidTransform([x, y, z])": lambda: lib.RigidTransform([0.1, 0.2, 0.3]),
        "RigidTransform(R, p)": lambda: lib.RigidTransform(R, p),
        "RigidTransform(R, [x, y, z])": lambda: lib.RigidTransform(R, [0.1, 0.2, 0.3]),
        "RigidTransform(rpy, p)": lambda: lib.RigidTransform(rpy, p),
        "RigidTransform(quaternion, p)": lambda: lib.RigidTransform(q, p),
        "RigidTransform(matrix)": lambda: lib.RigidTransform(pose),
        "X @ Y": lambda: X @ Y,
        "X.multiply(Y)": lambda: X.multiply(Y),
        "X @ p": lambda: X @ p,
        "X @ points": lambda: X @ points,
        "X.inverse()": lambda: X.inverse(),
        "X.InvertAndCompose(Y)": lambda: X.InvertAndCompose(Y),
        "X.translation()": lambda: X.translation(),
        "X.rotation()": lambda: X.rotation(),
        "X.rotation().matrix()": lambda: X.rotation().matrix(),
        "X.GetAsMatrix4()": lambda: X.GetAsMatrix4(),
        "X.GetAsMatrix34()": lambda: X.GetAsMatrix34(),
        "X.set_translation(p)": lambda: X.set_translation(p),
        "X.IsNearlyEqualTo(Y, 1e-6)": lambda: X.IsNearlyEqualTo(Y, 1e-6),
        "RotationMatrix()": lambda: lib.RotationMatrix(),
        "RotationMatrix(R)": lambda: lib.RotationMatrix(matrix),
        "RotationMatrix(rpy)": lambda: lib.RotationMatrix(rpy),
        "RotationMatrix(quaternion)": lambda: lib.RotationMatrix(q),
        "RotationMatrix(AngleAxis)": lambda: lib.RotationMatrix(turned),
        "MakeXRotation(a)": lambda: lib.RotationMatrix.MakeXRotation(0.3),
        "R @ S": lambda: R @ S,
        "R @ p": lambda: R @ p,
        "R.multiply(p)": lambda: R.multiply(p),
        "R.inverse()": lambda: R.inverse(),
        "R.transpose()": lambda: R.transpose(),
        "R.matrix()": lambda: R.matrix(),
        "R.ToQuaternion()": lambda: R.ToQuaternion(),
        "R.ToRollPitchYaw()": lambda: R.ToRollPitchYaw(),
        "R.ToAngleAxis()": lambda: R.ToAngleAxis(),
        "R.col(2)": lambda: R.col(2),
        "RollPitchYaw(r, p, y)": lambda: lib.RollPitchYaw(0.1, 0.2, 0.3),
        "RollPitchYaw([r, p, y])": lambda: lib.RollPitchYaw(p),
        "RollPitchYaw(R)": lambda: lib.RollPitchYaw(R),
        "RollPitchYaw(quaternion)": lambda: lib.RollPitchYaw(q),
        "rpy.vector()": lambda: rpy.vector(),
        "rpy.ToRotationMatrix()": lambda: rpy.ToRotationMatrix(),
        "rpy.ToQuaternion()": lambda: rpy.ToQuaternion(),
        "rpy.yaw_angle()": lambda: rpy.yaw_angle(),
        "Quaternion(w, x, y, z)": lambda: lib.Quaternion(1.0, 0.0, 0.0, 0.0),
        "Quaternion([w, x, y, z])": lambda: lib.Quaternion([1.0, 0.0, 0.0, 0.0]),
        "q.wxyz()": lambda: q.wxyz(),
        "q.rotation()": lambda: q.rotation(),
        "q.multiply(q)": lambda: q.multiply(q),
        "q.inverse()": lambda: q.inverse(),
        "AngleAxis(a, axis)": lambda: lib.AngleAxis(0.3, [0.0, 0.0, 1.0]),
        "SpatialVelocity(w, v)": lambda: lib.SpatialVelocity(p, p),
        "SpatialVelocity.Zero()": lambda: lib.SpatialVelocity.Zero(),
        "V + W": lambda: V + W,
        "V.rotational()": lambda: V.rotational(),
        "V.translational()": lambda: V.translational(),
        "V.get_coeffs()": lambda: V.get_coeffs(),
        "V.Shift(p)": lambda: V.Shift(p),
        "V.ComposeWithMovingFrameVelocity": lambda: V.ComposeWithMovingFrameVelocity(p, W),
        "V.Rotate(R)": lambda: V.Rotate(R),
        "SpatialForce(tau, f)": lambda: lib.SpatialForce(p, p),
        "F.Shift(p)": lambda: F.Shift(p),
        "F.dot(V)": lambda: F.dot(V),
        "UnitInertia.SolidBox": lambda: lib.UnitInertia.SolidBox(0.1, 0.2, 0.3),
        "SpatialInertia(m, p, G)": lambda: lib.SpatialInertia(1.0, p, lib.UnitInertia(1.0, 1.0, 1.0)),
        "M.ReExpress(R)": lambda: inertia.ReExpress(R),
        "M.Shift(p)": lambda: inertia.Shift(p),
        "X.IsExactlyEqualTo(Y)": lambda: X.IsExactlyEqualTo(Y),
        "X.IsNearlyIdentity(1e-6)": lambda: X.IsNearlyIdentity(1e-6),
        "X.GetMaximumAbsoluteDifference(Y)": lambda: X.GetMaximumAbsoluteDifference(Y),
        "R.IsValid()": lambda: R.IsValid(),
        "R.InvertAndCompose(S)": lambda: R.InvertAndCompose(S),
        "M.CopyToFullMatrix6()": lambda: inertia.CopyToFullMatrix6(),
        "M.IsPhysicallyValid()": lambda: inertia.IsPhysicallyValid(),
        "SpatialInertia.Zero()": lambda: lib.SpatialInertia.Zero(),
    }


def arm(lib: Any, time_step: float) -> tuple[Any, Any, Any]:
    """A seven-joint arm in a diagram: builder, plant, SceneGraph."""
    builder = lib.DiagramBuilder()
    plant, scene_graph = lib.AddMultibodyPlantSceneGraph(builder, time_step)
    lib.Parser(plant).AddModelsFromString(arm_urdf(), "urdf")
    body = plant.AddRigidBody("ball", plant.AddModelInstance("ball"), lib.SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    friction = lib.CoulombFriction(0.5, 0.5)
    for owner, height, name in ((body, 0.0, "ball"), (plant.world_body(), -0.1, "ground")):
        pose = lib.RigidTransform([0.0, 0.0, height])
        shape = lib.Sphere(0.1) if name == "ball" else lib.Box(9.0, 9.0, 0.2)
        plant.RegisterCollisionGeometry(owner, pose, shape, name, friction)
    plant.Finalize()
    return builder, plant, scene_graph


@family
def duals(lib: Any) -> Calls:
    """Poses, rotations and spatial vectors of AutoDiffXd with seven derivatives, and a plant of it at one state."""
    AD, rng = lib.AutoDiffXd, np.random.default_rng(0)

    def some(*shape: int) -> np.ndarray:
        size = int(np.prod(shape))
        return lib.InitializeAutoDiff(rng.normal(size=size), rng.normal(size=(size, 7))).reshape(shape)

    rpy, p, points, square = lib.RollPitchYaw_[AD](some(3)), some(3), some(3, 10), some(7, 7)
    R = lib.RotationMatrix_[AD](rpy)
    X, Y = lib.RigidTransform_[AD](R, p), lib.RigidTransform_[AD](R, some(3))
    plain, q = lib.RigidTransform(lib.RollPitchYaw(0.1, 0.2, 0.3), [1.0, 2.0, 3.0]), R.ToQuaternion()
    fixed = plain.cast[AD]()
    V, F = lib.SpatialVelocity_[AD](p, p), lib.SpatialForce_[AD](p, some(3))
    _, robot, _ = arm(lib, 0.0)
    robot = robot.ToAutoDiffXd()
    context, body = robot.CreateDefaultContext(), robot.get_body(lib.BodyIndex(7))
    states = itertools.cycle([some(robot.num_positions()), some(robot.num_positions())])

    def moved(ask: Callable[[], Any]) -> Any:
        robot.SetPositions(context, next(states))
        return ask()

    asked = {
        "EvalBodyPoseInWorld": lambda: robot.EvalBodyPoseInWorld(context, body),
        "CalcRelativeTransform": lambda: robot.CalcRelativeTransform(
            context, robot.get_body(lib.BodyIndex(3)).body_frame(), body.body_frame()
        ),
        "CalcMassMatrix": lambda: robot.CalcMassMatrix(context),
        "EvalKineticEnergy": lambda: robot.EvalKineticEnergy(context),
    }
    return {
        "X @ Y": lambda: X @ Y,
        "X @ constant": lambda: X @ fixed,
        "X @ p": lambda: X @ p,
        "X @ points": lambda: X @ points,
        "X.inverse()": lambda: X.inverse(),
        "X.InvertAndCompose(Y)": lambda: X.InvertAndCompose(Y),
        "RigidTransform_(R, p)": lambda: lib.RigidTransform_[AD](R, p),
        "RotationMatrix_(rpy)": lambda: lib.RotationMatrix_[AD](rpy),
        "RotationMatrix_.MakeZRotation": lambda: lib.RotationMatrix_[AD].MakeZRotation(p[0]),
        "X.cast[AutoDiffXd]()": lambda: plain.cast[AD](),
        "R.ToQuaternion()": lambda: R.ToQuaternion(),
        "R.ToRollPitchYaw()": lambda: R.ToRollPitchYaw(),
        "quaternion.multiply": lambda: q.multiply(q),
        "V.Shift(p)": lambda: V.Shift(p),
        "F.dot(V)": lambda: F.dot(V),
        "V + V": lambda: V + V,
        "matmul": lambda: lib.matmul(square, square),
        "inv": lambda: lib.inv(square),
        **asked,
        **{f"SetPositions, {name}": functools.partial(moved, ask) for name, ask in asked.items()},
    }


@family
def motions(lib: Any) -> Calls:
    """Frames, centres of mass and groups of bodies of a plant, at one state."""
    builder, plant, _ = arm(lib, 0.001)
    hand, elbow, world = plant.GetBodyByName("link7"), plant.GetBodyByName("link4"), plant.world_frame()
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    context = plant.GetMyContextFromRoot(root)
    plant.get_actuation_input_port().FixValue(context, np.zeros(plant.num_actuators()))
    KEPT.append((diagram, root))  # whose context the calls hold, which alone keeps nothing alive in Drake
    plant.SetVelocities(context, np.linspace(0.1, 0.2, plant.num_velocities()))
    frame, other, point = hand.body_frame(), elbow.body_frame(), np.array([0.01, 0.02, 0.03])
    instances, bodies = [plant.GetModelInstanceByName("arm")], [hand.index(), elbow.index()]
    kV = lib.JacobianWrtVariable.kV
    return {
        "frame.CalcSpatialVelocityInWorld": lambda: frame.CalcSpatialVelocityInWorld(context),
        "frame.CalcSpatialVelocity": lambda: frame.CalcSpatialVelocity(context, other, other),
        "frame.CalcAngularVelocity": lambda: frame.CalcAngularVelocity(context, other, world),
        "frame.CalcRelativeSpatialVelocity": lambda: frame.CalcRelativeSpatialVelocity(context, other, world, other),
        "frame.CalcSpatialAccelerationInWorld": lambda: frame.CalcSpatialAccelerationInWorld(context),
        "frame.CalcSpatialAcceleration": lambda: frame.CalcSpatialAcceleration(context, other, other),
        "EvalBodySpatialAccelerationInWorld": lambda: plant.EvalBodySpatialAccelerationInWorld(context, hand),
        "CalcPointsVelocities": lambda: plant.CalcPointsVelocities(context, frame, point, other, world),
        "CalcCenterOfMassPositionInWorld(instances)": lambda: plant.CalcCenterOfMassPositionInWorld(context, instances),
        "CalcCenterOfMassTranslationalVelocityInWorld": lambda: plant.CalcCenterOfMassTranslationalVelocityInWorld(
            context
        ),
        "CalcJacobianCenterOfMass(instances)": lambda: plant.CalcJacobianCenterOfMassTranslationalVelocity(
            context, instances, kV, world, world
        ),
        "body.CalcCenterOfMassTranslationalVelocity": lambda: hand.CalcCenterOfMassTranslationalVelocityInWorld(
            context
        ),
        "body.CalcSpatialInertiaInBodyFrame": lambda: hand.CalcSpatialInertiaInBodyFrame(context),
        "CalcTotalMass(instances)": lambda: plant.CalcTotalMass(context, instances),
        "CalcSpatialInertia": lambda: plant.CalcSpatialInertia(context, other, bodies),
        "MakeVelocityToQDotMap": lambda: plant.MakeVelocityToQDotMap(context),
        "MakeQDotToVelocityMap": lambda: plant.MakeQDotToVelocityMap(context),
        "GetBodiesWeldedTo": lambda: plant.GetBodiesWeldedTo(hand),
        "IsAnchored": lambda: plant.IsAnchored(hand),
        "num_actuators": lambda: plant.num_actuators(),
    }


@family
def regulators(lib: Any) -> Calls:
    """Riccati equations and regulators of matrices."""
    generator = np.random.default_rng(0)
    calls: Calls = {}
    for n, m in ((2, 1), (4, 1), (12, 4)):
        given = generator.normal(size=(n, n)), generator.normal(size=(n, m)), np.eye(n), np.eye(m)
        for name in ("LinearQuadraticRegulator", "DiscreteTimeLinearQuadraticRegulator"):
            calls[f"{name}, {n} states"] = functools.partial(getattr(lib, name), *given)
        for name in ("ContinuousAlgebraicRiccatiEquation", "DiscreteAlgebraicRiccatiEquation"):
            calls[f"{name}, {n} states"] = functools.partial(getattr(lib, name), *given)
    return calls


@family
def plant(lib: Any) -> Calls:
    """A plant asked at one state that does not change, and at one that does."""
    builder, plant, scene_graph = arm(lib, 0.001)
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    context, geometry = plant.GetMyContextFromRoot(root), scene_graph.GetMyContextFromRoot(root)
    plant.get_actuation_input_port().FixValue(context, np.zeros(plant.num_actuators()))
    hand, ball, world = plant.GetBodyByName("link7"), plant.GetBodyByName("ball"), plant.world_frame()
    joint = next(j for j in map(plant.get_joint, plant.GetJointIndices()) if isinstance(j, lib.RevoluteJoint))
    plant.SetFreeBodyPose(context, ball, lib.RigidTransform([0.5, 0.5, 0.099]))
    frame, kV, kQ = hand.body_frame(), lib.JacobianWrtVariable.kV, lib.JacobianWrtVariable.kQDot
    q, v, x = plant.GetPositions(context), plant.GetVelocities(context), plant.GetPositionsAndVelocities(context)
    point, vdot, forces = np.array([0.01, 0.02, 0.03]), np.ones(plant.num_velocities()), lib.MultibodyForces(plant)
    X, instance = lib.RigidTransform([0.5, 0.5, 0.5]), plant.GetModelInstanceByName("arm")
    query_port, contacts = scene_graph.get_query_output_port(), plant.get_contact_results_output_port()
    state = plant.get_state_output_port()
    alone = lib.MultibodyPlant(0.001)
    lib.Parser(alone).AddModelsFromString(arm_urdf(), "urdf")
    alone.SetUseSampledOutputPorts(False)  # or its step is no discrete update
    alone.Finalize()
    own = alone.CreateDefaultContext()
    inspector = scene_graph.model_inspector()
    ids = inspector.GetAllGeometryIds()
    ball_id, ground_id = plant.GetCollisionGeometriesForBody(ball)[0], ids[-1]

    def after_write(ask: Callable[[], Any]) -> Callable[[], Any]:
        def call() -> Any:
            plant.SetPositions(context, q)
            return ask()

        return call

    return {
        "SetPositions": lambda: plant.SetPositions(context, q),
        "SetPositions(instance)": lambda: plant.SetPositions(context, instance, q[:7]),
        "SetVelocities": lambda: plant.SetVelocities(context, v),
        "SetPositionsAndVelocities": lambda: plant.SetPositionsAndVelocities(context, x),
        "GetPositions": lambda: plant.GetPositions(context),
        "GetPositions(instance)": lambda: plant.GetPositions(context, instance),
        "GetVelocities": lambda: plant.GetVelocities(context),
        "GetPositionsAndVelocities": lambda: plant.GetPositionsAndVelocities(context),
        "CalcMassMatrix": lambda: plant.CalcMassMatrix(context),
        "CalcMassMatrixViaInverseDynamics": lambda: plant.CalcMassMatrixViaInverseDynamics(context),
        "CalcBiasTerm": lambda: plant.CalcBiasTerm(context),
        "CalcGravityGeneralizedForces": lambda: plant.CalcGravityGeneralizedForces(context),
        "CalcInverseDynamics": lambda: plant.CalcInverseDynamics(context, vdot, forces),
        "CalcForceElementsContribution": lambda: plant.CalcForceElementsContribution(context, forces),
        "CalcJacobianSpatialVelocity": lambda: plant.CalcJacobianSpatialVelocity(
            context, kV, frame, point, world, world
        ),
        "CalcJacobianTranslationalVelocity": lambda: plant.CalcJacobianTranslationalVelocity(
            context, kQ, frame, [0.0, 0.0, 0.0], world, world
        ),
        "CalcJacobianAngularVelocity": lambda: plant.CalcJacobianAngularVelocity(context, kV, frame, world, world),
        "CalcBiasSpatialAcceleration": lambda: plant.CalcBiasSpatialAcceleration(
            context, kV, frame, point, world, world
        ),
        "CalcJacobianCenterOfMass": lambda: plant.CalcJacobianCenterOfMassTranslationalVelocity(
            context, kV, world, world
        ),
        "CalcCenterOfMassPositionInWorld": lambda: plant.CalcCenterOfMassPositionInWorld(context),
        "CalcTotalMass": lambda: plant.CalcTotalMass(context),
        "CalcRelativeTransform": lambda: plant.CalcRelativeTransform(context, world, frame),
        "CalcPointsPositions": lambda: plant.CalcPointsPositions(context, frame, point, world),
        "CalcPotentialEnergy": lambda: plant.CalcPotentialEnergy(context),
        "CalcKineticEnergy": lambda: plant.CalcKineticEnergy(context),
        "EvalBodyPoseInWorld": lambda: plant.EvalBodyPoseInWorld(context, hand),
        "EvalBodySpatialVelocityInWorld": lambda: plant.EvalBodySpatialVelocityInWorld(context, hand),
        "frame.CalcPoseInWorld": lambda: frame.CalcPoseInWorld(context),
        "frame.CalcPose": lambda: frame.CalcPose(context, world),
        "SetFreeBodyPose": lambda: plant.SetFreeBodyPose(context, ball, X),
        "GetFreeBodyPose": lambda: plant.GetFreeBodyPose(context, ball),
        "SetFreeBodySpatialVelocity": lambda: plant.SetFreeBodySpatialVelocity(
            context, ball, lib.SpatialVelocity.Zero()
        ),
        "joint.set_angle": lambda: joint.set_angle(context, 0.1),
        "joint.get_angle": lambda: joint.get_angle(context),
        "joint.position_lower_limits": lambda: joint.position_lower_limits(),
        "MapVelocityToQDot": lambda: plant.MapVelocityToQDot(context, v),
        "MapQDotToVelocity": lambda: plant.MapQDotToVelocity(context, np.zeros(len(q))),
        "MakeActuationMatrix": lambda: plant.MakeActuationMatrix(),
        "GetPositionNames": lambda: plant.GetPositionNames(),
        "GetStateNames": lambda: plant.GetStateNames(),
        "GetPositionLowerLimits": lambda: plant.GetPositionLowerLimits(),
        "GetBodyByName": lambda: plant.GetBodyByName("link7"),
        "GetBodyByName(instance)": lambda: plant.GetBodyByName("link7", instance),
        "GetFrameByName": lambda: plant.GetFrameByName("link7"),
        "GetJointByName": lambda: plant.GetJointByName(joint.name()),
        "GetModelInstanceByName": lambda: plant.GetModelInstanceByName("arm"),
        "GetJointIndices": lambda: plant.GetJointIndices(instance),
        "num_positions": lambda: plant.num_positions(),
        "body.body_frame": lambda: hand.body_frame(),
        "world_frame": lambda: plant.world_frame(),
        "body.name": lambda: hand.name(),
        "body.index": lambda: hand.index(),
        "MultibodyForces": lambda: lib.MultibodyForces(plant),
        "get_state_output_port().Eval": lambda: plant.get_state_output_port().Eval(context),
        "state.Eval after a write": after_write(lambda: state.Eval(context)),
        "get_actuation_input_port().FixValue": lambda: plant.get_actuation_input_port().FixValue(context, v[:7]),
        "get_actuation_input_port().Eval": lambda: plant.get_actuation_input_port().Eval(context),
        "body_poses.Eval after a write": after_write(lambda: plant.get_body_poses_output_port().Eval(context)),
        "contact_results.Eval": lambda: contacts.Eval(context),
        "contact_results.Eval after a write": after_write(lambda: contacts.Eval(context)),
        "generalized_acceleration after a write": after_write(
            lambda: plant.get_generalized_acceleration_output_port().Eval(context)
        ),
        "net_actuation after a write": after_write(lambda: plant.get_net_actuation_output_port().Eval(context)),
        "reaction_forces after a write": after_write(lambda: plant.get_reaction_forces_output_port().Eval(context)),
        "query_object.Eval after a write": after_write(lambda: query_port.Eval(geometry)),
        "ComputePointPairPenetration": after_write(lambda: query_port.Eval(geometry).ComputePointPairPenetration()),
        "HasCollisions": after_write(lambda: query_port.Eval(geometry).HasCollisions()),
        "signed distances of all pairs": after_write(
            lambda: query_port.Eval(geometry).ComputeSignedDistancePairwiseClosestPoints()
        ),
        "signed distance of a pair": after_write(
            lambda: query_port.Eval(geometry).ComputeSignedDistancePairClosestPoints(ball_id, ground_id)
        ),
        "signed distance to a point": after_write(
            lambda: query_port.Eval(geometry).ComputeSignedDistanceToPoint(point, 1.0)
        ),
        "GetPoseInWorld(geometry)": after_write(lambda: query_port.Eval(geometry).GetPoseInWorld(ball_id)),
        "inspector.GetName": lambda: inspector.GetName(ball_id),
        "inspector.GetShape": lambda: inspector.GetShape(ball_id),
        "inspector.GetAllGeometryIds": lambda: inspector.GetAllGeometryIds(),
        "EvalUniquePeriodicDiscreteUpdate": lambda: alone.EvalUniquePeriodicDiscreteUpdate(own),
        "forces.SetZero": lambda: forces.SetZero(),
    }


@family
def contexts(lib: Any) -> Calls:
    """Contexts, vectors and simulators of a diagram."""
    builder, plant, _ = arm(lib, 0.001)
    log = lib.LogVectorOutput(plant.get_state_output_port(), builder, 0.01)
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    context = plant.GetMyContextFromRoot(root)
    gain = lib.Gain(2.0, 3)
    small, port = gain.CreateDefaultContext(), gain.get_output_port()
    u, vector = np.ones(3), lib.BasicVector([1.0, 2.0, 3.0])
    integrator = lib.Integrator(3)
    continuous = integrator.CreateDefaultContext()
    integrator.get_input_port().FixValue(continuous, u)
    linear = lib.LinearSystem(-np.eye(2), np.ones((2, 1)), np.eye(2), np.zeros((2, 1)))
    state = linear.CreateDefaultContext()
    linear.get_input_port().FixValue(state, [0.0])
    step_builder = lib.DiagramBuilder()
    step_builder.AddSystem(lib.Integrator(1))
    idle = step_builder.Build()
    idle_context = idle.CreateDefaultContext()
    idle.GetSystems()[0].get_input_port().FixValue(idle.GetSystems()[0].GetMyContextFromRoot(idle_context), [1.0])
    idler = lib.Simulator(idle, idle_context)
    idler.Initialize()
    alone = lib.MultibodyPlant(0.001)
    lib.Parser(alone).AddModelsFromString(arm_urdf(), "urdf")
    alone.Finalize()
    simulator = lib.Simulator(alone)
    alone.get_actuation_input_port().FixValue(simulator.get_mutable_context(), np.zeros(7))
    simulator.Initialize()
    abstract = lib.AbstractValue.Make(3)
    gain.get_input_port().FixValue(small, u)
    x2 = np.ones(2)
    return {
        "FixValue(array)": lambda: gain.get_input_port().FixValue(small, u),
        "FixValue(list)": lambda: gain.get_input_port().FixValue(small, [1.0, 2.0, 3.0]),
        "FixValue, Eval": lambda: (gain.get_input_port().FixValue(small, u), port.Eval(small)),
        "Eval of what is known": lambda: port.Eval(small),
        "EvalBasicVector": lambda: gain.get_input_port().Eval(small),
        "GetOutputPort(name)": lambda: plant.GetOutputPort("state"),
        "get_output_port(0)": lambda: gain.get_output_port(0),
        "GetMyContextFromRoot": lambda: plant.GetMyContextFromRoot(root),
        "GetMyMutableContextFromRoot": lambda: plant.GetMyMutableContextFromRoot(root),
        "GetSubsystemContext": lambda: diagram.GetSubsystemContext(plant, root),
        "GetSubsystemByName": lambda: diagram.GetSubsystemByName("plant"),
        "SetTime": lambda: state.SetTime(0.5),
        "get_time": lambda: state.get_time(),
        "SetContinuousState": lambda: state.SetContinuousState(x2),
        "SetTimeAndContinuousState": lambda: state.SetTimeAndContinuousState(0.1, x2),
        "get_continuous_state_vector().CopyToVector": lambda: state.get_continuous_state_vector().CopyToVector(),
        "get_mutable_continuous_state_vector().SetFromVector": lambda: (
            state.get_mutable_continuous_state_vector().SetFromVector(x2)
        ),
        "get_discrete_state_vector().value()": lambda: context.get_discrete_state_vector().value(),
        "get_discrete_state(0).value()": lambda: context.get_discrete_state(0).value(),
        "SetDiscreteState": lambda: context.SetDiscreteState(context.get_discrete_state_vector().value()),
        "EvalTimeDerivatives": lambda: (
            state.SetContinuousState(x2),
            linear.EvalTimeDerivatives(state).CopyToVector(),
        ),
        "context.Clone() of a block": lambda: state.Clone(),
        "context.Clone() of a scene": lambda: root.Clone(),
        "CreateDefaultContext of a block": lambda: linear.CreateDefaultContext(),
        "CreateDefaultContext of a scene": lambda: diagram.CreateDefaultContext(),
        "CreateDefaultContext of a plant": lambda: alone.CreateDefaultContext(),
        "SetDefaultContext of a plant": lambda: alone.SetDefaultContext(simulator.get_mutable_context()),
        "SetTimeStateAndParametersFrom": lambda: root.SetTimeStateAndParametersFrom(root),
        "BasicVector(list)": lambda: lib.BasicVector([1.0, 2.0, 3.0]),
        "vector.CopyToVector": lambda: vector.CopyToVector(),
        "vector.SetFromVector": lambda: vector.SetFromVector(u),
        "vector.get_value": lambda: vector.get_value(),
        "vector.SetAtIndex": lambda: vector.SetAtIndex(1, 2.0),
        "vector[1]": lambda: vector[1],
        "AbstractValue.Make": lambda: lib.AbstractValue.Make(3),
        "value.get_value": lambda: abstract.get_value(),
        "AdvanceTo of no step": lambda: idler.AdvanceTo(idle_context.get_time()),
        "AdvanceTo of one step (integrator)": lambda: idler.AdvanceTo(idle_context.get_time() + 0.01),
        "AdvanceTo of one step (arm)": lambda: simulator.AdvanceTo(simulator.get_context().get_time() + 0.001),
        "simulator.get_context": lambda: simulator.get_context(),
        "simulator.Initialize": lambda: simulator.Initialize(),
        "Simulator of a context": lambda: lib.Simulator(alone, simulator.get_mutable_context().Clone()),
        "FindLog": lambda: log.FindLog(root),
        "log.data()": lambda: log.FindLog(root).data(),
    }


@family
def python(lib: Any) -> Calls:
    """Systems written in Python, per event."""

    class Feedback(lib.LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.DeclareVectorInputPort("x", 2)
            self.DeclareVectorOutputPort("u", 1, self.output)

        def output(self, context: Any, output: Any) -> None:
            x = self.get_input_port().Eval(context)
            output.SetFromVector([-x[0] - x[1]])

    class Empty(lib.LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.DeclareVectorOutputPort("u", 1, self.output)

        def output(self, context: Any, output: Any) -> None:
            pass

    class Periodic(lib.LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.DeclareDiscreteState(2)
            self.DeclarePeriodicDiscreteUpdateEvent(0.01, 0.0, self.update)
            self.DeclareStateOutputPort("x", lib.DiscreteStateIndex(0))

        def update(self, context: Any, state: Any) -> None:
            x = context.get_discrete_state_vector().value()
            state.set_value(0, 0.9 * x)

    class Continuous(lib.LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.DeclareContinuousState(2)
            self.DeclareVectorOutputPort("y", 2, self.output)

        def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
            x = context.get_continuous_state_vector().CopyToVector()
            derivatives.get_mutable_vector().SetFromVector([x[1], -x[0]])

        def output(self, context: Any, output: Any) -> None:
            output.SetFromVector(context.get_continuous_state_vector().CopyToVector())

    empty, periodic, continuous = Empty(), Periodic(), Continuous()
    contexts = {system: system.CreateDefaultContext() for system in (empty, periodic, continuous)}
    advance = {}
    for system in (periodic, continuous):
        builder = lib.DiagramBuilder()
        builder.AddSystem(system_copy := type(system)())
        lib.LogVectorOutput(system_copy.get_output_port(), builder, 0.01)
        advance[system] = lib.Simulator(builder.Build())
        advance[system].get_mutable_integrator().set_maximum_step_size(0.01)
        lib.ResetIntegratorFromFlags(advance[system], "runge_kutta3", 0.01)
        advance[system].get_mutable_integrator().set_fixed_step_mode(True)
        advance[system].Initialize()
    builder = lib.DiagramBuilder()
    plant = builder.AddSystem(lib.LinearSystem(np.zeros((2, 2)), [[0.0], [1.0]], np.eye(2), np.zeros((2, 1)), 0.01))
    feedback = builder.AddSystem(Feedback())
    builder.Connect(plant.get_output_port(), feedback.get_input_port())
    builder.Connect(feedback.get_output_port(), plant.get_input_port())
    loop = lib.Simulator(builder.Build())
    loop.Initialize()
    port, time = empty.get_output_port(), [0.0]

    def evaluate_anew() -> Any:
        time[0] += 1.0
        contexts[empty].SetTime(time[0])
        return port.Eval(contexts[empty])

    def ten(simulator: Any) -> Callable[[], Any]:
        def call() -> None:
            simulator.AdvanceTo(simulator.get_context().get_time() + 0.1)

        return call

    return {
        "SetTime, Eval of an empty vector port": evaluate_anew,
        "EvalUniquePeriodicDiscreteUpdate": lambda: periodic.EvalUniquePeriodicDiscreteUpdate(contexts[periodic]),
        "EvalTimeDerivatives": lambda: (
            contexts[continuous].SetContinuousState([1.0, 0.0]),
            continuous.EvalTimeDerivatives(contexts[continuous]).CopyToVector(),
        ),
        "10 periodic updates with a log": ten(advance[periodic]),
        "10 steps of RK3 with a log": ten(advance[continuous]),
        "10 steps of a loop with feedback": ten(loop),
        "a LeafSystem": lambda: Feedback(),
        "a LeafSystem with state": lambda: Periodic(),
    }


@family
def present(lib: Any) -> Calls:
    """Ports of a continuous plant, and what a discrete one is asked between steps, each after a write."""
    builder, plant, _ = arm(lib, 0.0)
    diagram = builder.Build()
    context = plant.GetMyContextFromRoot(diagram.CreateDefaultContext())
    plant.get_actuation_input_port().FixValue(context, np.zeros(plant.num_actuators()))
    plant.SetFreeBodyPose(context, plant.GetBodyByName("ball"), lib.RigidTransform([0.5, 0.5, 0.099]))
    hand, q = plant.GetBodyByName("link7"), plant.GetPositions(context)
    names = ("contact_results", "net_actuation", "generalized_acceleration", "body_spatial_accelerations")
    ports = {f"{name} of a continuous plant": plant.GetOutputPort(name) for name in names}

    def after_write(ask: Callable[[], Any]) -> Callable[[], Any]:
        return lambda: (plant.SetPositions(context, q), ask())

    calls = {title: after_write(functools.partial(port.Eval, context)) for title, port in ports.items()}
    of_hand = after_write(lambda: plant.EvalBodySpatialAccelerationInWorld(context, hand))
    return {**calls, "EvalBodySpatialAccelerationInWorld": of_hand}


@family
def questions(lib: Any) -> Calls:
    """Contact surfaces."""
    builder = lib.DiagramBuilder()
    plant, scene_graph = lib.AddMultibodyPlantSceneGraph(builder, 0.001)
    for name in ("a", "b"):
        body = plant.AddRigidBody(name, lib.SpatialInertia.SolidBoxWithMass(1.0, 0.2, 0.2, 0.2))
        properties = lib.ProximityProperties()
        lib.AddContactMaterial(None, None, lib.CoulombFriction(0.5, 0.5), properties)
        lib.AddCompliantHydroelasticProperties(0.1, 1e7, properties)
        plant.RegisterCollisionGeometry(body, lib.RigidTransform(), lib.Box(0.2, 0.2, 0.2), name, properties)
    plant.Finalize()
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    context, geometry = plant.GetMyContextFromRoot(root), scene_graph.GetMyContextFromRoot(root)
    plant.SetFreeBodyPose(context, plant.GetBodyByName("b"), lib.RigidTransform([0.01, 0.02, 0.19]))
    q, polygons = plant.GetPositions(context), lib.HydroelasticContactRepresentation.kPolygon

    def surfaces() -> Any:
        plant.SetPositions(context, q)
        return scene_graph.get_query_output_port().Eval(geometry).ComputeContactSurfaces(polygons)

    return {"ComputeContactSurfaces": surfaces}


def reached(robot: Any, context: Any, postures: list[np.ndarray]) -> list[Any]:
    """Where the tip of an arm is."""
    out = []
    for q in postures:
        robot.SetPositions(context, q)
        out.append(robot.EvalBodyPoseInWorld(context, robot.GetBodyByName("link7")))
    return out


@family
def postures(lib: Any) -> Calls:
    """Inverse kinematics of an arm: programs, constraints at postures that change, and whole solves."""
    builder, robot, _ = arm(lib, 0.001)
    diagram = builder.Build()
    context = robot.GetMyContextFromRoot(diagram.CreateDefaultContext())
    alone = lib.MultibodyPlant(0.0)
    lib.Parser(alone).AddModelsFromString(arm_urdf(), "urdf")
    alone.Finalize()
    own = alone.CreateDefaultContext()
    ik, zero, one = lib.InverseKinematics(robot, context), np.zeros(3), np.ones(3)
    tip, link, world = robot.GetFrameByName("link7"), robot.GetFrameByName("link4"), robot.world_frame()
    R, axis = lib.RotationMatrix(), np.array([0.0, 0.0, 1.0])
    q = robot.GetPositions(context)
    asked = itertools.cycle([q + 1e-3 * k for k in range(8)])
    x, targets = np.full(7, 0.3), itertools.cycle(reached(alone, own, [np.full(7, 0.1 * k) for k in range(1, 7)]))
    constraints = {
        "Position": ik.AddPositionConstraint(tip, zero, world, -one, one),
        "Orientation": ik.AddOrientationConstraint(world, R, tip, R, 0.5),
        "GazeTarget": ik.AddGazeTargetConstraint(tip, zero, axis, world, one, 0.5),
        "AngleBetweenVectors": ik.AddAngleBetweenVectorsConstraint(tip, axis, world, axis, 0.0, 1.0),
        "PointToPointDistance": ik.AddPointToPointDistanceConstraint(tip, zero, link, zero, 0.1, 2.0),
        "MinimumDistance": ik.AddMinimumDistanceLowerBoundConstraint(0.01),
    }

    def program(of: Any, *given: Any) -> Any:
        out, X = lib.InverseKinematics(of, *given), next(targets)
        hand, ground, goal = of.GetFrameByName("link7"), of.world_frame(), X.translation()
        out.AddPositionConstraint(hand, zero, ground, goal - 0.01, goal + 0.01)
        out.AddOrientationConstraint(ground, X.rotation(), hand, R, 0.2)
        out.AddGazeTargetConstraint(hand, zero, axis, ground, X @ [0.1, 0.1, 1.0], 0.3)
        out.prog().AddQuadraticErrorCost(np.eye(7), x, out.q())
        out.prog().SetInitialGuess(out.q(), x)
        return out

    calls: Calls = {
        "InverseKinematics(plant, context)": lambda: lib.InverseKinematics(robot, context),
        "InverseKinematics(plant)": lambda: lib.InverseKinematics(alone),
        "position, orientation, gaze, cost": lambda: program(alone, own),
        "..., solved": lambda: lib.Solve(program(alone, own).prog()),
    }
    for name, binding in constraints.items():
        function = binding.evaluator()
        calls[f"{name}.Eval"] = lambda function=function: function.Eval(next(asked))
        calls[f"{name}.Eval, AutoDiff"] = lambda function=function: function.Eval(lib.InitializeAutoDiff(next(asked)))
    return calls


@family
def curves(lib: Any) -> Calls:
    """Trajectories and their derivatives, at one time and at many."""
    times, values = np.linspace(0.0, 1.0, 11), np.random.default_rng(0).normal(size=(7, 11))
    spline, one = lib.BsplineTrajectory(lib.BsplineBasis(4, 8), values[:3, :8]), np.float64(0.33)
    scaling = lib.PiecewisePolynomial.FirstOrderHold([0.0, 1.0], [[0.0, 1.0]])
    curves = {
        "PiecewisePolynomial": lib.PiecewisePolynomial.CubicShapePreserving(times, values),
        "BsplineTrajectory": spline,
        "BezierCurve": lib.BezierCurve(0.0, 1.0, values[:3, :6]),
        "CompositeTrajectory": lib.CompositeTrajectory(
            [lib.BezierCurve(0.25 * k, 0.25 * (k + 1), values[:3, k : k + 5]) for k in range(4)]
        ),
        "PathParameterizedTrajectory": lib.PathParameterizedTrajectory(spline, scaling),
    }
    calls: Calls = {}
    for name, curve in curves.items():
        calls[f"{name}.value"] = functools.partial(curve.value, 0.33)
        calls[f"{name}.value(np.float64)"] = functools.partial(curve.value, one)
        calls[f"{name}.EvalDerivative"] = functools.partial(curve.EvalDerivative, 0.33, 1)
        calls[f"{name}.vector_values"] = functools.partial(curve.vector_values, times)
    poses = [lib.RigidTransform(lib.RollPitchYaw(t, 2.0 * t, -t), [t, 1.0, t * t]) for t in times.tolist()]
    motion = lib.PiecewisePose.MakeLinear(times, poses)
    slerp = motion.get_orientation_trajectory().Clone()
    return calls | {
        "PiecewisePose.MakeLinear": lambda: lib.PiecewisePose.MakeLinear(times, poses),
        "PiecewisePose.GetPose": functools.partial(lib.PiecewisePose.MakeLinear(times, poses).GetPose, 0.33),
        "PiecewisePose.GetVelocity": functools.partial(lib.PiecewisePose.MakeLinear(times, poses).GetVelocity, 0.33),
        "PiecewiseQuaternionSlerp.orientation": functools.partial(slerp.orientation, 0.33),
    }


@family
def programs(lib: Any) -> Calls:
    """Mathematical programs being written, and symbolic formulas."""
    prog = lib.MathematicalProgram()
    x = prog.NewContinuousVariables(10, "x")
    a, b = lib.Variable("a"), lib.Variable("b")
    e, f, A, c = a * b + 2 * a, (a + b) ** 2, np.ones((3, 10)), np.ones(3)
    cost = prog.AddQuadraticCost(np.eye(10), np.zeros(10), x)
    bound = prog.AddLinearConstraint(A, -c, c, x)
    guess = np.ones(10)
    evaluator, values = bound.evaluator(), {a: 1.0, b: 2.0}
    numbers = np.linspace(0.0, 1.0, 10)

    def anew(add: Callable[[Any, Any], Any]) -> Callable[[], Any]:
        """With a program of its own, or programs would grow and grow."""

        def call() -> None:
            own = lib.MathematicalProgram()
            y = own.NewContinuousVariables(10, "y")
            for _ in range(20):
                add(own, y)

        return call

    def square(z: Any) -> Any:
        return z.dot(z)

    def small_qp() -> Any:
        own = lib.MathematicalProgram()
        y = own.NewContinuousVariables(2)
        own.AddQuadraticCost(y.dot(y))
        own.AddLinearConstraint(y[0] + y[1] == 1)
        return own

    return {
        "MathematicalProgram()": lambda: lib.MathematicalProgram(),
        "a small program in symbols": small_qp,
        "NewContinuousVariables(10)": anew(lambda own, y: own.NewContinuousVariables(10, "z")),
        "AddLinearConstraint(A, lb, ub, x)": anew(lambda own, y: own.AddLinearConstraint(A, -c, c, y)),
        "AddLinearConstraint(expression)": anew(lambda own, y: own.AddLinearConstraint(y[0] + 2 * y[1] <= 1)),
        "AddLinearConstraint(formulas)": anew(lambda own, y: own.AddLinearConstraint(lib.le(y, numbers))),
        "AddConstraint(expression)": anew(lambda own, y: own.AddConstraint(y[0] ** 2 + y[1] ** 2 <= 1)),
        "AddConstraint(function)": anew(lambda own, y: own.AddConstraint(lambda z: [square(z)], [0.0], [1.0], y)),
        "AddBoundingBoxConstraint(0, 1, x)": anew(lambda own, y: own.AddBoundingBoxConstraint(0, 1, y)),
        "AddLinearEqualityConstraint(A, b, x)": anew(lambda own, y: own.AddLinearEqualityConstraint(A, c, y)),
        "AddQuadraticCost(Q, b, x)": anew(lambda own, y: own.AddQuadraticCost(np.eye(10), guess, y)),
        "AddQuadraticCost(expression)": anew(lambda own, y: own.AddQuadraticCost(y[0] ** 2 + y[1] * y[2])),
        "AddQuadraticErrorCost": anew(lambda own, y: own.AddQuadraticErrorCost(np.eye(10), guess, y)),
        "AddCost(function)": anew(lambda own, y: own.AddCost(square, y)),
        "AddCost(expression)": anew(lambda own, y: own.AddCost(y[0] ** 2)),
        "AddLinearCost(expression)": anew(lambda own, y: own.AddLinearCost(y[0] + y[1])),
        "SetInitialGuess": lambda: prog.SetInitialGuess(x, guess),
        "GetInitialGuess": lambda: prog.GetInitialGuess(x),
        "binding.evaluator().Eval": lambda: evaluator.Eval(guess),
        "prog.EvalBinding": lambda: prog.EvalBinding(cost, guess),
        "binding.variables()": lambda: bound.variables(),
        "bindings of a program": lambda: prog.GetAllConstraints(),
        "decision_variables": lambda: prog.decision_variables(),
        "FindDecisionVariableIndex": lambda: prog.FindDecisionVariableIndex(x[5]),
        "Variable(name)": lambda: lib.Variable("a"),
        "a + b": lambda: a + b,
        "2 * a": lambda: 2 * a,
        "a * b + 2 * a": lambda: a * b + 2 * a,
        "e * f": lambda: e * f,
        "f.Expand()": lambda: f.Expand(),
        "a ** 2": lambda: a**2,
        "sin(e)": lambda: lib.sin(e) if hasattr(lib, "sin") else np.sin(e),
        "a <= b": lambda: a <= b,
        "e.Evaluate": lambda: e.Evaluate(values),
        "e.Differentiate": lambda: f.Differentiate(a),
        "e.Jacobian": lambda: e.Jacobian([a, b]),
        "e.Substitute": lambda: e.Substitute(a, 1.0 + b),
        "e.GetVariables": lambda: e.GetVariables(),
        "str(e)": lambda: str(e),
        "Polynomial(e)": lambda: lib.Polynomial(e),
        "x.dot(x)": lambda: x.dot(x),
        "A @ x": lambda: A @ x,
        "x.T @ Q @ x": lambda: x @ np.eye(10) @ x,
        "DecomposeLinearExpressions": lambda: lib.DecomposeAffineExpressions([x[0] + 2 * x[1]], x[:2]),
    }


def cart_pole(lib: Any, x: Any) -> np.ndarray:
    """Time derivatives of a cart-pole without friction, in the plainest words."""
    sin, cos = (getattr(lib, "sin", np.sin), getattr(lib, "cos", np.cos))
    s, c = sin(x[1]), cos(x[1])
    across = (x[4] + s * (0.5 * x[3] ** 2 + 9.81 * c)) / (10.0 + s**2)
    about = (-x[4] * c - 0.5 * x[3] ** 2 * c * s - 11.0 * 9.81 * s) / (0.5 * (10.0 + s**2))
    return np.array([x[2], x[3], across, about])


def acrobot(lib: Any, x: Any) -> np.ndarray:
    """M vdot + C of an acrobot, as manipulator equations are written."""
    sin, cos = (getattr(lib, "sin", np.sin), getattr(lib, "cos", np.cos))
    c2, s2 = cos(x[1]), sin(x[1])
    M = np.array([[1.33 + 0.33 + 2.0 * 0.5 * c2, 0.33 + 0.5 * c2], [0.33 + 0.5 * c2, 0.33 + 0.0 * c2]])
    C = np.array([[-2.0 * 0.5 * s2 * x[3], -0.5 * s2 * x[3]], [0.5 * s2 * x[2], 0.0 * s2]])
    tau = np.array([-9.81 * (1.5 * sin(x[0]) + 0.5 * sin(x[0] + x[1])), -9.81 * 0.5 * sin(x[0] + x[1])])
    return M @ x[4:6] + C @ x[2:4] - tau


@family
def symbols(lib: Any) -> Calls:
    """Expressions as users write them: dynamics, quadratic forms, polynomials, and what is asked of them."""
    x = lib.MakeVectorVariable(6, "x")
    z = lib.MakeVectorVariable(20, "z")
    a, b, c = lib.MakeVectorVariable(3, "a")
    rng = np.random.default_rng(0)
    A, Q = rng.normal(size=(10, 20)), np.eye(20) + 0.1 * np.ones((20, 20))
    f, g, form = cart_pole(lib, x), acrobot(lib, x), z @ Q @ z
    point, at = dict(zip(x, np.linspace(0.1, 0.6, 6))), dict(zip(z, np.linspace(0.0, 1.0, 20)))
    cubic = (a + 2.0 * b - c) ** 3 + a * b * (a - c) ** 2 - 3.0 * a
    sextic = (a * b + c**2 - 0.5 * a) ** 3
    p, q = lib.Polynomial(cubic), lib.Polynomial(a**2 + b * c - 1.0)
    affine = np.array([0.5 * z[i] - 2.0 * z[i + 1] + z[i + 2] - 1.0 for i in range(10)])
    parametric = lib.Polynomial(z[0] * a**2 + (z[1] - 2.0 * z[2]) * a * b + z[3], lib.Variables([a, b]))
    points = np.array([np.linspace(0.0, 1.0, 50), np.linspace(1.0, 2.0, 50)])
    angles = {x[0]: x[0] + 0.1 * x[2], x[1]: x[1] + 0.1 * x[3]}
    return {
        "MakeVectorVariable(10)": lambda: lib.MakeVectorVariable(10, "y"),
        "dynamics of a cart-pole": lambda: cart_pole(lib, x),
        "dynamics of an acrobot": lambda: acrobot(lib, x),
        "A @ z, 10 x 20": lambda: A @ z,
        "z.dot(z), 20": lambda: z.dot(z),
        "z.dot(Q @ z), 20": lambda: z.dot(Q @ z),
        "A @ z <= b, elementwise": lambda: lib.le(A @ z, np.ones(10)),
        "2 * z + 1": lambda: 2.0 * z + 1.0,
        "polynomial of degree 6, written": lambda: (a * b + c**2 - 0.5 * a) ** 3,
        "pendulum: Evaluate": lambda: f[3].Evaluate(point),
        "acrobot: Evaluate of an array": lambda: lib.Evaluate(g, point),
        "quadratic form of 20: Evaluate": lambda: form.Evaluate(at),
        "cart-pole: Differentiate": lambda: f[3].Differentiate(x[1]),
        "cart-pole: Jacobian": lambda: lib.Jacobian(f, x[:5]),
        "acrobot: Jacobian": lambda: lib.Jacobian(g, x),
        "quadratic form of 20: Jacobian": lambda: form.Jacobian(z),
        "cubic: Jacobian": lambda: cubic.Jacobian([a, b, c]),
        "cart-pole: Substitute a number": lambda: f[3].Substitute({x[1]: 0.3}),
        "cart-pole: Substitute expressions": lambda: f[3].Substitute(angles),
        "acrobot: Substitute in an array": lambda: lib.Substitute(g, angles),
        "quadratic form of 20: Substitute": lambda: form.Substitute({z[0]: z[1] + 1.0}),
        "cubic: Substitute": lambda: cubic.Substitute({a: b + c}),
        "cart-pole: EvaluatePartial": lambda: f[3].EvaluatePartial({x[1]: 0.3}),
        "cubic: Expand": cubic.Expand,
        "degree 6: Expand": sextic.Expand,
        "quadratic form of 20: Expand": form.Expand,
        "Polynomial(cubic)": lambda: lib.Polynomial(cubic),
        "Polynomial(degree 6)": lambda: lib.Polynomial(sextic),
        "Polynomial(quadratic form of 20)": lambda: lib.Polynomial(form),
        "p + q": lambda: p + q,
        "p * q": lambda: p * q,
        "p.Jacobian": lambda: p.Jacobian([a, b, c]),
        "p.ToExpression": p.ToExpression,
        "p.Evaluate": lambda: p.Evaluate({a: 1.0, b: 2.0, c: 3.0}),
        "EvaluateWithAffineCoefficients": lambda: parametric.EvaluateWithAffineCoefficients([a, b], points),
        "DecomposeAffineExpressions, 10": lambda: lib.DecomposeAffineExpressions(affine, z),
        "DecomposeLinearExpressions, 10 x 20": lambda: lib.DecomposeLinearExpressions(A @ z, z),
        "ExtractVariablesFromExpression": lambda: lib.ExtractVariablesFromExpression(f[3]),
        "GetVariables of a form of 20": form.GetVariables,
        "MonomialBasis(3, 4)": lambda: lib.MonomialBasis([a, b, c], 4),
        "str of a cart-pole": lambda: str(f[3]),
        "EqualTo": lambda: f[3].EqualTo(f[2]),
    }


@family
def once(lib: Any) -> Calls:
    """Expressions written and asked one thing, as most scripts do: what is kept with an expression is of no use."""
    x, z = lib.MakeVectorVariable(6, "x"), lib.MakeVectorVariable(20, "z")
    a, b, c = lib.MakeVectorVariable(3, "a")
    Q = np.eye(20) + 0.1 * np.ones((20, 20))
    angles = {x[0]: x[0] + 0.1 * x[2], x[1]: x[1] + 0.1 * x[3]}
    expressions: dict[str, Callable[[], Any]] = {
        "small": lambda: a * b + 2 * a,
        "square": lambda: (a + b) ** 2,
        "cubic": lambda: (a + 2.0 * b - c) ** 3 + a * b * (a - c) ** 2 - 3.0 * a,
        "degree 6": lambda: (a * b + c**2 - 0.5 * a) ** 3,
        "quadratic form of 20": lambda: z @ Q @ z,
    }
    calls: Calls = {}
    for name, write in expressions.items():
        variables = list(z) if name.startswith("quadratic") else [a, b, c]
        first, second = variables[:2]
        asked: dict[str, Callable[[Any, list, Any, Any], Any]] = {
            "written": lambda e, variables, v, w: e,
            "Jacobian": lambda e, variables, v, w: e.Jacobian(variables),
            "Differentiate": lambda e, variables, v, w: e.Differentiate(v),
            "Expand": lambda e, variables, v, w: e.Expand(),
            "Polynomial": lambda e, variables, v, w: lib.Polynomial(e),
            "Substitute": lambda e, variables, v, w: e.Substitute({v: w + 1.0}),
            "Evaluate": lambda e, variables, v, w: e.Evaluate(dict.fromkeys(variables, 0.5)),
            "GetVariables": lambda e, variables, v, w: e.GetVariables(),
            "str": lambda e, variables, v, w: str(e),
        }
        for question, ask in asked.items():
            calls[f"{name}: {question}"] = functools.partial(
                lambda write, ask, *given: ask(write(), *given), write, ask, variables, first, second
            )
    calls["cart-pole: Jacobian"] = lambda: lib.Jacobian(cart_pole(lib, x), x[:5])
    calls["acrobot: Jacobian"] = lambda: lib.Jacobian(acrobot(lib, x), x)
    calls["cart-pole: Substitute"] = lambda: lib.Substitute(cart_pole(lib, x), angles)
    calls["cart-pole: EvaluatePartial"] = lambda: cart_pole(lib, x)[3].EvaluatePartial({x[1]: 0.3})
    calls["cart-pole: str"] = lambda: str(cart_pole(lib, x)[3])
    return calls


@family
def solving(lib: Any) -> Calls:
    """Small programs that are solved again and again, and what is read from their results."""
    rng = np.random.default_rng(2)

    def linear() -> Any:
        prog = lib.MathematicalProgram()
        x = prog.NewContinuousVariables(2, "x")
        prog.AddLinearConstraint(np.array([[1.0, 1.0], [1.0, -1.0]]), np.full(2, -np.inf), np.array([1.0, 0.5]), x)
        prog.AddBoundingBoxConstraint(0.0, 1.0, x)
        prog.AddLinearCost(np.array([-1.0, -0.5]), 0.0, x)
        return prog

    def quadratic() -> Any:
        prog = lib.MathematicalProgram()
        x = prog.NewContinuousVariables(3, "x")
        prog.AddQuadraticCost(np.eye(3), np.ones(3), x)
        prog.AddLinearConstraint(np.array([[1.0, 1.0, 1.0]]), np.array([-1.0]), np.array([1.0]), x)
        prog.AddBoundingBoxConstraint(-0.5, 1.0, x)
        return prog

    def predictive() -> Any:
        prog = lib.MathematicalProgram()
        x, u = prog.NewContinuousVariables(2, 17, "x"), prog.NewContinuousVariables(1, 16, "u")
        step = np.array([[1.0, 0.1, 0.005, -1.0, 0.0], [0.0, 1.0, 0.1, 0.0, -1.0]])
        prog.AddBoundingBoxConstraint([-2.0, 0.3], [-2.0, 0.3], x[:, 0])
        prog.AddBoundingBoxConstraint(-1.0, 1.0, u)
        for k in range(16):
            prog.AddLinearEqualityConstraint(step, np.zeros(2), np.concatenate((x[:, k], u[:, k], x[:, k + 1])))
            prog.AddQuadraticCost(np.eye(2), np.zeros(2), x[:, k], True)
            prog.AddQuadraticCost(np.eye(1), np.zeros(1), u[:, k], True)
        prog.AddQuadraticCost(10.0 * np.eye(2), np.zeros(2), x[:, 16], True)
        return prog

    def least_squares(rows: int) -> Any:
        prog = lib.MathematicalProgram()
        x = prog.NewContinuousVariables(8, "x")
        prog.AddQuadraticCost(np.eye(8), np.ones(8), x)
        if rows:
            prog.AddLinearEqualityConstraint(rng.normal(size=(rows, 8)), np.ones(rows), x)
        return prog

    def equations() -> Any:
        prog = lib.MathematicalProgram()
        x = prog.NewContinuousVariables(5, "x")
        prog.AddLinearEqualityConstraint(np.eye(5) + 0.1, np.ones(5), x)
        return prog

    lp, qp, mpc, free, equal, system = (
        linear(),
        quadratic(),
        predictive(),
        least_squares(0),
        least_squares(3),
        equations(),
    )
    result, x, cost = lib.Solve(qp), qp.decision_variables(), qp.quadratic_costs()[0].evaluator()
    row, start = qp.linear_constraints()[0], mpc.bounding_box_constraints()[0].evaluator()
    solver = lib.ClarabelSolver()
    targets = itertools.cycle(np.linspace(0.5, 1.5, 7))

    def moved_cost() -> Any:
        cost.UpdateCoefficients(np.eye(3), np.full(3, next(targets)))
        return lib.Solve(qp)

    def moved_start() -> Any:
        where = np.array([-next(targets), 0.3])
        start.UpdateLowerBound(where)
        start.UpdateUpperBound(where)
        return lib.Solve(mpc)

    return {
        "a linear program of 2 variables": lambda: lib.Solve(lp),
        "a quadratic program of 3": lambda: lib.Solve(qp),
        "..., with another cost each time": moved_cost,
        "predictive control, 50 variables": lambda: lib.Solve(mpc),
        "..., from another state each time": moved_start,
        "a quadratic cost of 8, nothing else": lambda: lib.Solve(free),
        "..., with 3 equations": lambda: lib.Solve(equal),
        "5 equations": lambda: lib.Solve(system),
        "ChooseBestSolver": lambda: lib.ChooseBestSolver(qp),
        "ClarabelSolver().Solve": lambda: solver.Solve(qp, None, None),
        "GetSolution(x)": lambda: result.GetSolution(x),
        "GetSolution(x[0])": lambda: result.GetSolution(x[0]),
        "GetSolution(expressions)": lambda: result.GetSolution(2.0 * x + 1.0),
        "get_optimal_cost": result.get_optimal_cost,
        "is_success": result.is_success,
        "GetDualSolution": lambda: result.GetDualSolution(row),
        "EvalBinding": lambda: result.EvalBinding(row),
        "UpdateCoefficients": lambda: cost.UpdateCoefficients(np.eye(3), np.ones(3)),
    }


@family
def sets(lib: Any) -> Calls:
    """Questions of polyhedra that small linear programs answer."""
    rng = np.random.default_rng(1)
    A, b = np.vstack((rng.normal(size=(12, 3)), np.eye(3), -np.eye(3))), np.ones(18)
    P, loose = lib.HPolyhedron(A, b), lib.HPolyhedron(rng.normal(size=(10, 3)), np.full(10, 2.0))
    empty = lib.HPolyhedron(np.vstack((A, A[:1], -A[:1])), np.append(b, [-2.0, 1.0]))
    V, generator, x = lib.VPolytope(rng.normal(size=(3, 12))), lib.RandomGenerator(0), np.full(3, 0.1)
    prog = lib.MathematicalProgram()
    vars = prog.NewContinuousVariables(3)
    prog.AddLinearConstraint(A, np.full(18, -np.inf), b, vars)
    prog.AddLinearCost(np.ones(3), 0.0, vars)
    return {
        "HPolyhedron: IsEmpty": P.IsEmpty,
        "HPolyhedron without points: IsEmpty": empty.IsEmpty,
        "HPolyhedron: IsBounded": P.IsBounded,
        "HPolyhedron: ChebyshevCenter": P.ChebyshevCenter,
        "HPolyhedron: ContainedIn": lambda: P.ContainedIn(loose),
        "HPolyhedron: Intersection, without what is redundant": lambda: P.Intersection(loose, True),
        "HPolyhedron: ReduceInequalities": P.ReduceInequalities,
        "HPolyhedron: UniformSample": lambda: P.UniformSample(generator, x),
        "HPolyhedron: PointInSet": lambda: P.PointInSet(x),
        "two HPolyhedra: IntersectsWith": lambda: P.IntersectsWith(loose),
        "VPolytope: PointInSet": lambda: V.PointInSet(x),
        "VPolytope: IntersectsWith an HPolyhedron": lambda: V.IntersectsWith(P),
        "VPolytope: GetMinimalRepresentation": V.GetMinimalRepresentation,
        "VPolytope of an HPolyhedron": lambda: lib.VPolytope(P),
        "HPolyhedron of a VPolytope": lambda: lib.HPolyhedron(V),
        "Solve: a linear program": lambda: lib.Solve(prog),
    }


@family
def setting_up(lib: Any) -> Calls:
    """Plants, diagrams and simulators made again and again: each line is what comes after the lines before it."""
    urdf = arm_urdf()

    def parsed(time_step: float = 0.001) -> Any:
        plant = lib.MultibodyPlant(time_step)
        lib.Parser(plant).AddModelsFromString(urdf, "urdf")
        return plant

    def finalized() -> Any:
        plant = parsed()
        plant.Finalize()
        return plant

    def with_context() -> Any:
        plant = finalized()
        return plant, plant.CreateDefaultContext()

    def asked() -> Any:
        plant, context = with_context()
        plant.SetPositions(context, np.full(7, 0.1))
        return plant.CalcMassMatrix(context)

    def simulated(time_step: float, until: float) -> Any:
        builder = lib.DiagramBuilder()
        plant, _ = lib.AddMultibodyPlantSceneGraph(builder, time_step)
        lib.Parser(plant).AddModelsFromString(urdf, "urdf")
        plant.Finalize()
        diagram = builder.Build()
        simulator = lib.Simulator(diagram)
        plant.get_actuation_input_port().FixValue(
            plant.GetMyContextFromRoot(simulator.get_mutable_context()), np.zeros(7)
        )
        simulator.AdvanceTo(until)
        return simulator

    def blocks() -> Any:
        builder = lib.DiagramBuilder()
        last = builder.AddSystem(lib.ConstantVectorSource([1.0]))
        for _ in range(49):
            system = builder.AddSystem(lib.Gain(0.9, 1))
            builder.Connect(last.get_output_port(), system.get_input_port())
            last = system
        return builder

    def pendulum(time_step: float) -> Any:
        plant = lib.MultibodyPlant(time_step)
        body = plant.AddRigidBody("link", lib.SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 1.0))
        hinge = lib.RevoluteJoint("hinge", plant.world_frame(), body.body_frame(), [0.0, 1.0, 0.0])
        plant.AddJointActuator("motor", plant.AddJoint(hinge))
        plant.Finalize()
        return plant

    def linearized() -> Any:
        plant = pendulum(0.0)
        context = plant.CreateDefaultContext()
        plant.get_actuation_input_port().FixValue(context, [0.0])
        return lib.Linearize(
            plant,
            context,
            plant.get_actuation_input_port().get_index(),
            plant.get_state_output_port().get_index(),
        )

    linear_plant = pendulum(0.0)
    linear_context = linear_plant.CreateDefaultContext()
    linear_plant.get_actuation_input_port().FixValue(linear_context, [0.0])
    ports = (linear_plant.get_actuation_input_port().get_index(), linear_plant.get_state_output_port().get_index())
    return {
        "a plant of an arm, parsed": parsed,
        "..., finalized": finalized,
        "..., with a context": with_context,
        "..., with a mass matrix": asked,
        "in a diagram, simulator, no step": lambda: simulated(0.001, 0.0),
        "in a diagram, 10 steps": lambda: simulated(0.001, 0.01),
        "in a diagram, continuous, 1 ms": lambda: simulated(0.0, 0.001),
        "a pendulum": lambda: pendulum(0.001),
        "Linearize a new pendulum": linearized,
        "ToAutoDiffXd of a plant": lambda: linear_plant.ToAutoDiffXd(),
        "Linearize": lambda: lib.Linearize(linear_plant, linear_context, *ports),
        "50 blocks": blocks,
        "50 blocks, built": lambda: blocks().Build(),
        "50 blocks, with a context": lambda: blocks().Build().CreateDefaultContext(),
        "50 blocks, one step": lambda: lib.Simulator(blocks().Build()).AdvanceTo(0.1),
    }


def enough(call: Callable[[], Any]) -> int:
    """So many calls that a turn takes long enough to be measured; some that make ready come before."""
    for _ in range(10):
        call()
    once = max(repeated_time(call, 3), 0.05)
    return max(3, int(SECONDS_A_TURN * 1e6 / once))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("families", nargs="*", default=list(FAMILIES))
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--slower", action="store_true")
    parser.add_argument("--only", default="", help="lines whose title contains this")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    print(machine())
    libraries = {name: importlib.import_module(f"{name}.all") for name in ("sheldrake", "pydrake")}
    for title in options.families:
        calls = {name: FAMILIES[title](lib) for name, lib in libraries.items()}
        print(f"\n{title:52s}{'ours':>10s}{'Drake':>10s}{'ours/Drake':>12s}")
        for line in calls["sheldrake"]:
            if options.only in line:
                report(line, {name: calls[name][line] for name in libraries}, options.rounds, options.slower)


def report(line: str, calls: Calls, rounds: int, slower: bool) -> None:
    """Prints a line: medians, and the median of the ratios turn by turn."""
    turns: dict[str, Callable[[], float]] = {}
    for name, call in calls.items():
        turns[name] = functools.partial(repeated_time, call, enough(call))
    times = take_turns(turns, rounds)
    ours, drakes = times["sheldrake"], times["pydrake"]
    ratio = statistics.median(a / b for a, b in zip(ours, drakes))
    if ratio > 1.0 or not slower:
        print(f"{line:52s}{statistics.median(ours):10.2f}{statistics.median(drakes):10.2f}{ratio:12.2f}", flush=True)


if __name__ == "__main__":
    main()
