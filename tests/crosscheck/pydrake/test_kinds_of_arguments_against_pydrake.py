"""What calls make of numbers of other types, of arrays of objects, of wrong classes and of None is what Drake's make.

Each line is tried on a plant of its own, or between two others; its answer is the value with its type, or the kind of
the error.
"""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("pydrake")

from all_systems import Library

pytestmark = pytest.mark.peer
ANSWERS = """
L.CoulombFriction(0, 0).static_friction()
L.CoulombFriction(np.float32(1), True).dynamic_friction()
L.CoulombFriction([1.0], 0.5)
arm.set_default_angle(np.array(0.5)), arm.get_default_angle()
arm.set_default_angle(np.array([0.5]))
arm.set_default_angle([0.5])
arm.set_angle(context, np.array(0.5)) and arm.get_angle(context)
arm.set_angle(context, np.array([0.5]))
arm.set_angular_rate(context, np.array(1)) and arm.get_angular_rate(context)
arm.SetDamping(context, None)
arm.SetDamping(context, [0.5])
arm.SetDamping(context, 1j)
arm.SetDamping(context, 2), arm.GetDamping(context)
arm.set_random_angle_distribution("x")
arm.set_random_angle_distribution(None)
ball.set_default_angles(np.array([0.1, 0.2, 0.3], dtype=object)), ball.get_default_angles()
ball.set_default_angles(np.array([L.AutoDiffXd(0.1)] * 3))
ball.set_random_angles_distribution([0.1, 0.2])
ball.set_random_angles_distribution(None)
ball.set_random_angles_distribution("abc")
planar.set_default_rotation(None)
planar.set_default_pose([0.5, 0.5], "x"), planar.get_default_translation()
planar.get_default_translation()
planar.set_rotation(context, np.array(1)) and planar.get_rotation(context)
free.SetPose(context, np.eye(4))
free.SetPose(context, None)
free.SetOrientation(context, L.RollPitchYaw(0.1, 0.2, 0.3))
free.SetQuaternion(context, [1.0, 0.0, 0.0, 0.0])
free.set_default_quaternion(None)
plant.SetPositions(context, np.arange(1.0, 15.0)), free.get_quaternion(context).wxyz()
actuator.SetGearRatio(context, None)
actuator.SetRotorInertia(context, [0.5])
actuator.SetRotorInertia(context, 1), actuator.rotor_inertia(context)
actuator.set_effort_limit(3), actuator.effort_limit()
actuator.set_default_gear_ratio("x")
spring.SetStiffness(context, None)
hinge.CalcHingeTorque(np.float32(0.5), np.int64(1))
hinge.CalcHingeTorque(np.array([0.5]), 1)
link.SetMass(context, [0.5])
link.SetMass(context, None)
link.SetMass(context, 2), link.get_mass(context)
link.body_frame().CalcSpatialVelocity(context, None, plant.world_frame())
link.body_frame().CalcSpatialVelocity(context, link, plant.world_frame())
link.body_frame().CalcAngularVelocity(context, plant.world_frame(), "world")
link.body_frame().CalcOffsetPoseInBody(context, np.array([1.0, 2.0, 3.0]))
link.body_frame().GetFixedRotationMatrixInBody(np.eye(3))
offset.SetPoseInParentFrame(context, np.eye(4))
plant.EvalBodyPoseInWorld(context, link.body_frame())
plant.EvalBodySpatialVelocityInWorld(context, offset)
plant.EvalBodySpatialAccelerationInWorld(context, offset)
plant.GetBodiesWeldedTo(offset)
plant.GetDefaultFloatingBaseBodyPose(offset)
plant.GetBodyIndices(L.BodyIndex(2))
plant.GetBodyFrameIdIfExists(L.JointIndex(1))
plant.CalcInverseDynamics(context, np.full(13, 0.5).astype(object), L.MultibodyForces(plant)).dtype
plant.CalcJacobianSpatialVelocity(
    context, L.JacobianWrtVariable.kV, offset, np.zeros(3, dtype=object), offset, offset).shape
plant.GetPositionsFromArray(L.ModelInstanceIndex(2), np.arange(14).astype(object)).dtype
plant.SetPositionsInArray(L.ModelInstanceIndex(2), np.arange(14.0), column), column.ravel()
L.MultibodyPlant(0).AddRigidBody("")
L.MultibodyPlant(0).AddRigidBody("b", L.world_model_instance())
L.SpatialInertia(np.array(2), [0, 0, 0], L.UnitInertia(1, 1, 1)).get_mass()
L.UnitInertia.SolidSphere(np.array(0.5)).get_moments()
L.Quaternion(np.array(1), 0, 0, 0).w()
L.AutoDiffXd(np.array(0.5)).value()
L.BsplineBasis(3, np.array([0.0, 0, 0, 1, 2, 2, 2])).knots()
L.BsplineBasis(3, 5).EvaluateBasisFunctionI("x", 0.5)
L.BsplineBasis(3, 5).ComputeActiveBasisFunctionIndices(None)
L.RollPitchYaw(matrix=np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6], [0.7, 0.8, 0.9]])).vector()
L.RollPitchYaw(matrix=L.RotationMatrix.MakeXRotation(0.3).matrix().astype(np.float32)).vector()
L.PiecewisePolynomial.CubicWithContinuousSecondDerivatives([0, 1, 2], [[1, 2, 3.0]], 1).value(0.3)
L.PiecewisePolynomial.CubicWithContinuousSecondDerivatives([0, 1, 2], [[1, 2, 3.0]], None).value(0.3)
L.AddMultibodyPlant(L.MultibodyPlantConfig(discrete_contact_approximation=""), L.DiagramBuilder())[
    0].get_discrete_contact_approximation().name
L.Polynomial(L.Variable("x") + 1) ** 10**20
L.RotationMatrix.MakeXRotation(0.3).col(True)
L.RotationMatrix.MakeXRotation(0.3).row("x")
"""


class Scene:
    """A plant with joints of several types, its context, and names for what is asked of it."""

    def __init__(self, L):
        inertia = L.SpatialInertia(1.0, [0.1, 0.0, 0.0], L.UnitInertia(0.3, 0.4, 0.5))
        plant = L.MultibodyPlant(1e-3)
        model = plant.AddModelInstance("m")
        world, bodies = plant.world_frame(), [plant.AddRigidBody(n, model, inertia) for n in "abcd"]
        a, b, c, d = (body.body_frame() for body in bodies)
        arm = plant.AddJoint(L.RevoluteJoint("arm", world, a, [0, 0, 1]))
        joints = {
            "arm": arm,
            "ball": plant.AddJoint(L.BallRpyJoint("ball", a, b)),
            "planar": plant.AddJoint(L.PlanarJoint("planar", world, c)),
            "free": plant.AddJoint(L.QuaternionFloatingJoint("free", world, d)),
        }
        config = L.DoorHingeConfig()
        config.spring_constant = 1.0
        others = {
            "actuator": plant.AddJointActuator("motor", arm),
            "spring": plant.AddForceElement(L.RevoluteSpring(arm, 0.1, 2.0)),
            "hinge": plant.AddForceElement(L.DoorHinge(arm, config)),
            "offset": plant.AddFrame(L.FixedOffsetFrame("offset", a, L.RigidTransform([0.1, 0.2, 0.3]), model)),
        }
        self.scene_graph = L.SceneGraph()
        plant.RegisterAsSourceForSceneGraph(self.scene_graph)
        plant.Finalize()
        self.names = joints | others | {"L": L, "np": np, "plant": plant, "link": bodies[0]}
        self.names |= {"context": plant.CreateDefaultContext(), "column": np.zeros((14, 1))}

    def answer(self, line):
        """Its value, by type and number, or the kind of the error."""
        try:
            return described(eval(line, self.names))
        except Exception as error:
            return type(error).__name__


def described(value):
    if isinstance(value, tuple):
        return [described(item) for item in value if item is not None]
    if isinstance(value, np.ndarray):
        return str(value.dtype), value.shape, value.ravel().tolist()
    return type(value).__name__, value if isinstance(value, float | int | str | list) else None


def lines():
    return ANSWERS.replace("\n    ", " ").strip().split("\n")


def same(a, b):
    if isinstance(a, float) and isinstance(b, float):
        return a == pytest.approx(b, rel=1e-14, abs=1e-15)  # round-off of one product or root
    if isinstance(a, list | tuple) and isinstance(b, list | tuple):
        return len(a) == len(b) and all(map(same, a, b))
    return a == b


@pytest.mark.parametrize("line", lines())
def test_line(line):
    mine, drakes = (Scene(Library(package)).answer(line) for package in ("sheldrake", "pydrake"))
    assert same(mine, drakes), (mine, drakes)
