"""Elements, poses and numbers of plants of duals and symbols are of the plant's scalar."""

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.math import RigidTransform, RigidTransform_, RollPitchYaw_, RotationMatrix_
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.plant import MultibodyPlant, MultibodyPlant_, Wing_
from sheldrake.multibody.tree import (
    BallRpyJoint,
    FixedOffsetFrame,
    ModelInstanceIndex,
    MultibodyForces,
    PlanarJoint,
    PrismaticJoint,
    QuaternionFloatingJoint,
    RevoluteJoint,
    RpyFloatingJoint,
    ScrewJoint,
    UniversalJoint,
    WeldJoint,
)
from sheldrake.symbolic import Expression, Variable
from sheldrake.systems.framework import DiagramBuilder_

Z = [0.0, 0.0, 1.0]
X_FM = RigidTransform([1.0, 2.0, 3.0])
JOINTS = {
    "revolute": lambda F, M: RevoluteJoint("joint", F, M, Z),
    "prismatic": lambda F, M: PrismaticJoint("joint", F, M, Z),
    "screw": lambda F, M: ScrewJoint("joint", F, M, Z, 0.2, 0.0),
    "universal": lambda F, M: UniversalJoint("joint", F, M),
    "ball": lambda F, M: BallRpyJoint("joint", F, M),
    "planar": lambda F, M: PlanarJoint("joint", F, M),
    "rpy": lambda F, M: RpyFloatingJoint("joint", F, M),
    "quaternion": lambda F, M: QuaternionFloatingJoint("joint", F, M),
    "weld": lambda F, M: WeldJoint("joint", F, M, X_FM),
}


def built(kind, cls=MultibodyPlant, time_step=0.0):
    plant = cls(time_step)
    body = plant.AddRigidBody("body", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    frame = plant.AddFrame(FixedOffsetFrame("frame", body.body_frame(), RigidTransform([0.0, 0.0, 0.5])))
    joint = plant.AddJoint(JOINTS[kind](plant.world_frame(), frame))
    if joint.num_velocities() == 1:
        plant.AddJointActuator("motor", joint)
    plant.Finalize()
    return plant


def made(kind, T, way):
    return built(kind, MultibodyPlant_[T]) if way == "built" else built(kind).ToScalarType[T]()


def is_of(T, numbers):
    return all(type(x) is T for x in np.ravel(numbers))


@pytest.mark.parametrize("way", ["built", "converted"])
@pytest.mark.parametrize("T", [AutoDiffXd, Expression])
@pytest.mark.parametrize("kind", sorted(JOINTS))
def test_numbers_and_poses_are_of_the_scalar(kind, T, way):
    plant = made(kind, T, way)
    context, joint, frame = plant.CreateDefaultContext(), plant.GetJointByName("joint"), plant.GetFrameByName("frame")
    assert is_of(T, plant.GetPositions(context)) and is_of(T, plant.GetDefaultPositions())
    assert is_of(T, [group for i in range(2) for group in context.get_numeric_parameter(i).CopyToVector()])
    assert type(joint.GetPose(context)) is RigidTransform_[T]
    for X in (frame.CalcPoseInBodyFrame(context), frame.GetFixedPoseInBodyFrame()):
        assert type(X) is RigidTransform_[T]
    one = RigidTransform_[T]()
    assert type(frame.CalcOffsetPoseInBody(context, one)) is RigidTransform_[T]
    assert type(plant.world_frame().GetFixedOffsetPoseInBody(one)) is RigidTransform_[T]
    assert type(frame.CalcOffsetRotationMatrixInBody(context, one.rotation())) is RotationMatrix_[T]
    forces = MultibodyForces(plant)
    assert is_of(T, forces.generalized_forces()) and is_of(T, forces.SetZero().generalized_forces())
    joint.SetPositions(context, np.full(joint.num_positions(), 0.5))
    assert is_of(T, plant.GetPositions(context))


@pytest.mark.parametrize("T", [AutoDiffXd, Expression])
@pytest.mark.parametrize("kind", ["ball", "quaternion", "rpy"])
def test_poses_are_set_and_got_on_every_scalar(kind, T):
    plant = made(kind, T, "converted")
    context, joint = plant.CreateDefaultContext(), plant.GetJointByName("joint")
    p = np.zeros(3) if kind == "ball" else np.array([1.0, 2.0, 3.0])
    X = RigidTransform_[T](RollPitchYaw_[T](T(0.1), T(0.2), T(0.3)), p * T(1.0))
    joint.SetPose(context, X)
    near = joint.GetPose(context).IsNearlyEqualTo(X, 1e-12)
    assert near if T is AutoDiffXd else near.Evaluate()


@pytest.mark.parametrize("way", ["built", "converted"])
def test_joints_of_duals_lock(way):
    plant = built("revolute", MultibodyPlant_[AutoDiffXd], 0.01) if way == "built" else None
    plant = plant or built("revolute", time_step=0.01).ToAutoDiffXd()
    context, joint = plant.CreateDefaultContext(), plant.GetJointByName("joint")
    assert not joint.is_locked(context) and not plant.GetBodyByName("body").is_locked(context)
    joint.Lock(context)
    assert joint.is_locked(context)


def test_elements_belong_to_their_plant():
    plant = built("revolute")
    dual = plant.ToAutoDiffXd()
    for mine, theirs in (
        (plant.GetBodyByName("body"), dual.GetBodyByName("body")),
        (plant.GetJointByName("joint"), dual.GetJointByName("joint")),
        (plant.GetFrameByName("frame"), dual.GetFrameByName("frame")),
        (plant.GetJointActuatorByName("motor"), dual.GetJointActuatorByName("motor")),
        (plant.gravity_field(), dual.gravity_field()),
    ):
        assert mine.GetParentPlant() is plant and theirs.GetParentPlant() is dual
        name = type(mine).__name__
        assert repr(theirs) == repr(mine).replace(name, f"{name}_[AutoDiffXd]", 1)
    assert dual.GetJointByName("joint").frame_on_child() is dual.GetFrameByName("frame")
    assert dual.GetJointByName("joint").child_body() is dual.GetBodyByName("body")
    assert plant.Clone().GetBodyByName("body").GetParentPlant() is not plant


def test_wing_is_added_on_the_scalar_of_the_builder():
    builder = DiagramBuilder_[AutoDiffXd]()
    plant = builder.AddSystem(built("quaternion", MultibodyPlant_[AutoDiffXd]))
    wing = Wing_[AutoDiffXd].AddToBuilder(builder, plant, plant.GetBodyByName("body").index(), 1.0)
    assert type(wing) is Wing_[AutoDiffXd] and type(builder.Build()).__name__.endswith("AutoDiffXd𝓤")


def test_parts_of_vectors_have_the_sizes_they_should():
    plant = built("revolute")
    one, wrong = ModelInstanceIndex(1), np.zeros(3)
    calls = [
        lambda: plant.GetPositionsFromArray(one, wrong),
        lambda: plant.GetVelocitiesFromArray(one, wrong),
        lambda: plant.GetActuationFromArray(one, wrong),
        lambda: plant.SetPositionsInArray(one, np.zeros(1), wrong),
        lambda: plant.SetVelocitiesInArray(one, wrong, np.zeros(1)),
        lambda: plant.SetActuationInArray(one, wrong, np.zeros(1)),
    ]
    for call in calls:
        with pytest.raises(RuntimeError, match=r"not properly sized.* 3 numbers, not 1"):
            call()
    joint = plant.GetJointByName("joint").index()
    with pytest.raises(RuntimeError, match="'joint' is repeated"):
        plant.MakeStateSelectorMatrix([joint, joint])


def test_bodies_name_their_instance_where_there_are_several():
    plant = MultibodyPlant(0.0)
    plant.AddRigidBody("before")
    instance = plant.AddModelInstance("robot")
    with pytest.raises(RuntimeError, match="explicit model instance"):
        plant.AddRigidBody("after")
    assert plant.AddRigidBody("after", instance).model_instance() == instance


@pytest.mark.parametrize("T", [AutoDiffXd, Expression])
def test_answers_are_of_the_scalar_throughout(T):
    plant = made("planar", T, "converted")
    context = plant.CreateDefaultContext()
    for answer in (
        plant.CalcMassMatrix(context),
        plant.CalcBiasTerm(context),
        plant.CalcGravityGeneralizedForces(context),
    ):
        assert is_of(T, answer)


def test_positions_and_velocities_become_numbers_of_the_scalar():
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("body", SpatialInertia.SolidCubeWithDensity(1000.0, 0.1))
    plant.AddJoint(RevoluteJoint("joint", plant.world_frame(), body.body_frame(), Z))
    plant.Finalize()
    q, v = Variable("q"), Variable("v")
    for copy_, scalar, given in (
        (plant.ToSymbolic(), Expression, [[q, v], np.array([q, v]), [1, 2]]),
        (plant.ToAutoDiffXd(), AutoDiffXd, [[1, 2], np.array([1, AutoDiffXd(2.0, [1.0])])]),
    ):
        context = copy_.CreateDefaultContext()
        for values in given:
            copy_.SetPositions(context, values[:1])
            copy_.SetVelocities(context, values[1:])
            apart = copy_.GetPositionsAndVelocities(context)
            copy_.SetPositionsAndVelocities(context, values)
            for found in (apart, copy_.get_state_output_port().Eval(context)):
                assert [type(x) for x in found] == [scalar, scalar]
                assert [str(x) for x in found] == [str(x if isinstance(x, scalar) else scalar(x)) for x in values]


@pytest.mark.parametrize("T", [float, AutoDiffXd, Expression])
def test_a_fixed_pose_is_the_callers_own(T):
    plant = MultibodyPlant(0.0)
    plant.AddFrame(FixedOffsetFrame("frame", plant.world_frame(), X_FM))
    plant.GetFrameByName("frame").GetFixedPoseInBodyFrame()  # of floats, before it is converted
    plant.Finalize()
    if T is not float:
        plant = plant.ToAutoDiffXd() if T is AutoDiffXd else plant.ToSymbolic()
    frame, moved = plant.GetFrameByName("frame"), RigidTransform_[T]([7.0, 8.0, 9.0])
    X = frame.GetFixedPoseInBodyFrame()
    assert type(X) is RigidTransform_[T] and type(X.rotation()) is RotationMatrix_[T]
    X.set_translation(moved.translation())
    X.set_rotation(RollPitchYaw_[T]([1.0, 0.0, 0.0]))
    again = frame.GetFixedPoseInBodyFrame().GetAsMatrix34()
    numbers = (
        again if T is float else [[float(x.value() if T is AutoDiffXd else x.Evaluate()) for x in r] for r in again]
    )
    assert np.array_equal(numbers, X_FM.GetAsMatrix34())


@pytest.mark.parametrize("T", [float, AutoDiffXd])
def test_allocated_outputs_are_the_callers_own(T):
    plant = built("revolute") if T is float else made("revolute", T, "converted")
    port = plant.get_body_poses_output_port()
    first = port.Allocate()
    first.get_value()[0] = RigidTransform_[T]([1.0, 0.0, 0.0])  # a list of its own, in Drake too
    (X, *_) = port.Allocate().get_value()
    assert type(X) is RigidTransform_[T] and X.IsExactlyEqualTo(RigidTransform_[T]())
