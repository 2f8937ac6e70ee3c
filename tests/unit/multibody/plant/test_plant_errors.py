"""What a plant refuses: each refusal says what was called, with what, and what would be right."""

import warnings

import numpy as np
import pytest

from sheldrake.common.deprecation import DrakeDeprecationWarning
from sheldrake.geometry import Sphere
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia, SpatialVelocity, UnitInertia
from sheldrake.multibody.plant import ApplyMultibodyPlantConfig as apply_config
from sheldrake.multibody.plant import (
    CoulombFriction,
    DiscreteContactApproximation,
    MultibodyPlant,
    MultibodyPlantConfig,
)
from sheldrake.multibody.tree import (
    BallRpyJoint,
    BodyIndex,
    JointIndex,
    ModelInstanceIndex,
    PlanarJoint,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    UniformGravityFieldElement,
)
from sheldrake.systems.analysis import Simulator

INERTIA = SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.2, 0.3)


def plant_with_arm(time_step=0.01, finalize=True):
    plant = MultibodyPlant(time_step)
    body = plant.AddRigidBody("link", INERTIA)
    joint = plant.AddJoint(RevoluteJoint("hinge", plant.world_frame(), body.body_frame(), [0, 0, 1]))
    plant.AddJointActuator("motor", joint)
    free = plant.AddRigidBody("free", INERTIA)
    if finalize:
        plant.Finalize()
    return plant, body, joint, free


@pytest.mark.parametrize("time_step", [-1e-3, np.nan, np.inf])
def test_bad_time_step(time_step):
    with pytest.raises(RuntimeError, match="time_step must be zero or positive"):
        MultibodyPlant(time_step)


def test_time_step_must_be_a_number():
    with pytest.raises(TypeError, match="incompatible constructor arguments"):
        MultibodyPlant("fast")


@pytest.mark.parametrize("call", ["num_positions", "get_state_output_port", "GetPositionNames", "MakeActuationMatrix"])
def test_calls_before_finalize(call):
    plant, *_ = plant_with_arm(finalize=False)
    with pytest.raises(RuntimeError, match=f"{call}\\(\\): this plant is pre-finalize"):
        getattr(plant, call)()


def test_context_before_finalize():
    plant, *_ = plant_with_arm(finalize=False)
    with pytest.raises(RuntimeError, match=r"has no context yet: call Finalize\(\) first"):
        plant.CreateDefaultContext()


def test_calls_after_finalize():
    plant, body, joint, _ = plant_with_arm()
    for call in (
        lambda: plant.AddRigidBody("more", INERTIA),
        lambda: plant.AddModelInstance("more"),
        lambda: plant.AddJointActuator("more", joint),
        lambda: plant.WeldFrames(plant.world_frame(), body.body_frame()),
        lambda: plant.set_gravity_enabled(ModelInstanceIndex(1), False),
    ):
        with pytest.raises(RuntimeError, match="this plant is post-finalize"):
            call()
    with pytest.raises(RuntimeError, match="repeated calls not allowed"):
        plant.Finalize()


def test_unknown_names_list_the_valid_ones():
    plant, *_ = plant_with_arm()
    with pytest.raises(RuntimeError, match=r"no RigidBody named 'lnik'.*free, link"):
        plant.GetBodyByName("lnik")
    with pytest.raises(RuntimeError, match=r"no Joint named 'elbow'.*hinge"):
        plant.GetJointByName("elbow")
    with pytest.raises(RuntimeError, match=r"no JointActuator named 'drive'.*motor"):
        plant.GetJointActuatorByName("drive")
    with pytest.raises(RuntimeError, match="'DefaultModelInstance', 'WorldModelInstance'"):
        plant.GetModelInstanceByName("robot")


def test_ambiguous_name_needs_a_model_instance():
    plant = MultibodyPlant(0.0)
    for name in ("a", "b"):
        plant.AddRigidBody("hand", plant.AddModelInstance(name), INERTIA)
    with pytest.raises(RuntimeError, match=r"more than one RigidBody named 'hand'.*'a', 'b'"):
        plant.GetBodyByName("hand")
    assert plant.GetBodyByName("hand", ModelInstanceIndex(3)).index() == 2
    assert plant.NumBodiesWithName("hand") == 2


def test_duplicate_names():
    plant, body, *_ = plant_with_arm(finalize=False)
    with pytest.raises(RuntimeError, match="already contains a body named 'link'"):
        plant.AddRigidBody("link", INERTIA)
    with pytest.raises(RuntimeError, match="already contains a model instance named"):
        plant.AddModelInstance("DefaultModelInstance")
    with pytest.raises(RuntimeError, match="already has a joint 'hinge' connecting 'world' to 'link'"):
        plant.WeldFrames(plant.world_frame(), body.body_frame())
    assert plant.num_bodies() == 3 and plant.num_joints() == 1


def test_bad_bodies():
    plant = MultibodyPlant(0.0)
    with pytest.raises(RuntimeError, match="mass"):
        plant.AddRigidBody("bad", SpatialInertia(-1.0, [0, 0, 0], UnitInertia(1, 1, 1)))
    with pytest.raises(RuntimeError, match="Invalid model instance"):
        plant.AddRigidBody("bad", ModelInstanceIndex(7), INERTIA)
    with pytest.raises(TypeError, match="incompatible function arguments"):
        plant.AddRigidBody("bad", 3)
    assert plant.num_bodies() == 1


def test_axis_needs_a_direction_but_no_unit_length():
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("link", INERTIA)
    frames = plant.world_frame(), body.body_frame()
    np.testing.assert_allclose(RevoluteJoint("j", *frames, [0, 0, 2]).revolute_axis(), [0, 0, 1])
    for kind, words in ((RevoluteJoint, "Revolute"), (PrismaticJoint, "Prismatic")):
        with pytest.raises(RuntimeError, match=f"{words} joint axis vector must have nonzero length"):
            kind("j", *frames, [0, 0, 0])
    with pytest.raises(RuntimeError, match="damping must be nonnegative"):
        RevoluteJoint("j", *frames, [0, 0, 1], -1.0)
    with pytest.raises(RuntimeError, match="lower limit exceeds its upper limit"):
        RevoluteJoint("j", *frames, [0, 0, 1], 1.0, -1.0)


def test_joint_to_itself_and_foreign_frames():
    plant, other = MultibodyPlant(0.0), MultibodyPlant(0.0)
    body = plant.AddRigidBody("link", INERTIA)
    with pytest.raises(RuntimeError, match="would connect body link to itself"):
        plant.AddJoint(BallRpyJoint("j", body.body_frame(), body.body_frame()))
    with pytest.raises(RuntimeError, match="not part of this MultibodyPlant"):
        plant.AddJoint(BallRpyJoint("j", other.world_frame(), body.body_frame()))


def test_actuators_act_on_one_degree_of_freedom():
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("link", INERTIA)
    joint = plant.AddJoint(PlanarJoint("plane", plant.world_frame(), body.body_frame()))
    with pytest.raises(RuntimeError, match="has 3 degrees of freedom"):
        plant.AddJointActuator("motor", joint)


def test_loop_leaves_the_plant_as_it_was():
    plant = MultibodyPlant(0.0)
    a, b = (plant.AddRigidBody(n, INERTIA) for n in "ab")
    plant.AddRigidBody("floating", INERTIA)
    frames = [plant.world_frame(), a.body_frame(), b.body_frame()]
    for i in range(3):
        plant.AddJoint(RevoluteJoint(f"j{i}", frames[i], frames[(i + 1) % 3], [0, 0, 1]))
    with pytest.raises(RuntimeError, match="form a loop, closed by joint 'j"):
        plant.Finalize()
    assert not plant.is_finalized() and plant.num_joints() == 3


def test_joint_that_cannot_be_reversed():
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("link", INERTIA)
    plant.AddJoint(PlanarJoint("plane", body.body_frame(), plant.world_frame()))
    with pytest.raises(RuntimeError, match=r"planar joint plane .* would have to be reversed"):
        plant.Finalize()


def test_state_of_wrong_size_or_not_finite_changes_nothing():
    plant, *_ = plant_with_arm()
    context = plant.CreateDefaultContext()
    before = plant.GetPositionsAndVelocities(context)
    with pytest.raises(RuntimeError, match=r"the plant has 8 positions, but the given array has shape \(2,\)"):
        plant.SetPositions(context, [1, 2])
    with pytest.raises(RuntimeError, match="must be finite"):
        plant.SetPositions(context, [np.nan] * 8)
    with pytest.raises(RuntimeError, match="model instance 'DefaultModelInstance' has 7 velocities"):
        plant.SetVelocities(context, ModelInstanceIndex(1), [0.0])
    np.testing.assert_array_equal(plant.GetPositionsAndVelocities(context), before)


def test_free_body_pose():
    plant, body, _, free = plant_with_arm()
    context = plant.CreateDefaultContext()
    with pytest.raises(RuntimeError, match="Body 'link' is not a free body"):
        plant.SetFreeBodyPose(context, body, RigidTransform())
    with pytest.raises(RuntimeError, match="must be finite"):
        plant.SetFreeBodyPose(context, free, RigidTransform([np.nan, 0, 0]))
    with pytest.raises(RuntimeError, match="must be finite"):
        free_joint = plant.GetJointByName("free")
        free_joint.SetTranslation(context, [0, np.inf, 0])


def test_free_body_velocity_in_both_orders_of_arguments():
    plant, *_, free = plant_with_arm()
    context, V = plant.CreateDefaultContext(), SpatialVelocity([1, 2, 3], [4, 5, 6])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plant.SetFreeBodySpatialVelocity(context, free, V)
    np.testing.assert_array_equal(plant.GetVelocities(context)[1:], [1, 2, 3, 4, 5, 6])
    with pytest.warns(DrakeDeprecationWarning, match="context, body, V_JpJc"):
        plant.SetFreeBodySpatialVelocity(free, SpatialVelocity(np.zeros(6)), context)
    np.testing.assert_array_equal(plant.GetVelocities(context), np.zeros(7))


def test_context_of_another_system():
    plant, *_ = plant_with_arm()
    other, *_ = plant_with_arm()
    with pytest.raises(RuntimeError, match="was passed the Context of a system named"):
        plant.CalcMassMatrix(other.CreateDefaultContext())


def test_geometry_needs_a_scene_graph():
    plant, body, *_ = plant_with_arm(finalize=False)
    with pytest.raises(RuntimeError, match="geometry_source_is_registered"):
        plant.RegisterCollisionGeometry(body, RigidTransform(), Sphere(0.1), "ball", CoulombFriction(1, 1))


def test_numbers_out_of_range():
    plant, *_ = plant_with_arm()
    with pytest.raises(RuntimeError, match=r"BodyIndex\(9\) is out of bounds \(must be less than 3\)"):
        plant.get_body(BodyIndex(9))
    with pytest.raises(RuntimeError, match=r"JointIndex\(-1\)|JointIndex"):
        plant.get_joint(JointIndex(7))


def test_elements_without_a_plant():
    body = RigidBody("alone", INERTIA)
    assert not body.index().is_valid()
    with pytest.raises(RuntimeError, match="not part of a MultibodyPlant yet"):
        body.GetParentPlant()


def test_second_gravity():
    with pytest.raises(RuntimeError, match="mutable_gravity_field"):
        MultibodyPlant(0.0).AddForceElement(UniformGravityFieldElement())


def test_configuration():
    config = MultibodyPlantConfig(time_step=0.0)
    with pytest.raises(RuntimeError, match=r"time_step is 0\.01"):
        apply_config(config, MultibodyPlant(0.01))
    config.contact_model = "magic"
    with pytest.raises(RuntimeError, match="Unknown contact_model: 'magic'; it is one of 'point'"):
        apply_config(config, MultibodyPlant(0.0))


def two_joints(dt):
    plant = MultibodyPlant(dt)
    M = SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.2, 0.3)
    a, b = plant.AddRigidBody("a", M), plant.AddRigidBody("b", M)
    ja = plant.AddJoint(RevoluteJoint("ja", plant.world_frame(), a.body_frame(), [1.0, 0.0, 0.0]))
    jb = plant.AddJoint(RevoluteJoint("jb", a.body_frame(), b.body_frame(), [0.0, 1.0, 0.0]))
    return plant, ja, jb


def test_constraints_of_a_continuous_plant_are_refused_when_it_is_to_move():
    plant, ja, jb = two_joints(0.0)
    constraint = plant.AddCouplerConstraint(ja, jb, 2.0)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    assert plant.num_constraints() == 1 and plant.GetConstraintActiveStatus(context, constraint)
    assert plant.CalcMassMatrix(context).shape == (2, 2)
    with pytest.raises(RuntimeError, match="continuous time does not support constraints"):
        plant.EvalTimeDerivatives(context)
    with pytest.raises(RuntimeError, match="continuous time does not support constraints"):
        Simulator(plant, context).AdvanceTo(0.1)


def test_tamsi_and_constraints_exclude_each_other_in_either_order():
    plant, ja, jb = two_joints(0.01)
    plant.AddCouplerConstraint(ja, jb, 2.0)
    with pytest.raises(RuntimeError, match="has 1 constraints"):
        plant.set_discrete_contact_approximation(DiscreteContactApproximation.kTamsi)
    plant, ja, jb = two_joints(0.01)
    plant.set_discrete_contact_approximation(DiscreteContactApproximation.kTamsi)
    with pytest.raises(RuntimeError, match="TAMSI"):
        plant.AddCouplerConstraint(ja, jb, 2.0)


def test_a_name_is_no_body():
    plant, *_ = plant_with_arm()
    with pytest.raises(TypeError, match=r"EvalBodyPoseInWorld\(\): incompatible.*'link'"):
        plant.EvalBodyPoseInWorld(plant.CreateDefaultContext(), "link")


@pytest.mark.parametrize("x", [np.nan, np.inf, None])
def test_numbers_that_are_none_are_refused_where_they_are_given(x):
    plant, ja, jb = two_joints(0.01)
    world, body = plant.world_body(), ja.child_body()
    for give in (
        lambda: plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, x]),
        lambda: RevoluteJoint("j", plant.world_frame(), body.body_frame(), [0.0, 0.0, x]),
        lambda: plant.AddJointActuator("motor", ja).set_default_gear_ratio(x),
        lambda: plant.AddBallConstraint(body, [x, 0.0, 0.0], world),
        lambda: plant.AddCouplerConstraint(ja, jb, x),
        lambda: plant.AddCouplerConstraint(ja, jb, 1.0, x),
    ):
        with pytest.raises((RuntimeError, TypeError), match=r"finite|must be (float|Scalars|ArrayLike)|NoneType"):
            give()


def test_a_state_that_leaves_all_numbers_within_a_continuous_step():
    plant, *_ = two_joints(0.0)
    plant.Finalize()
    simulator = Simulator(plant)
    simulator.get_mutable_context().SetContinuousState(np.full(4, 1e300))
    with pytest.raises(RuntimeError, match="positions become infinite or NaN within a step of the integrator"):
        simulator.AdvanceTo(0.1)


def test_bodies_in_the_place_of_frames_and_numbers_in_that_of_velocities_are_type_errors():
    plant = plant_with_arm()[0]
    body, free = plant.GetBodyByName("link"), plant.GetBodyByName("free")
    context, W = plant.CreateDefaultContext(), plant.world_frame()
    with pytest.raises(TypeError, match=r"no frame; a body has body_frame\(\)"):
        plant.CalcRelativeTransform(context, W, body)
    with pytest.raises(TypeError, match="no frame"):
        plant.CalcPointsPositions(context, body, [0.0, 0.0, 0.0], W)
    with pytest.raises(TypeError, match="V_JpJc"):
        plant.SetFreeBodySpatialVelocity(context, free, np.zeros(6))


@pytest.mark.parametrize("idle", ["locked", "no desired state"])
def test_nan_in_an_actuation_port_is_an_error_where_it_has_no_effect(idle):
    """As in Drake; a limit that clamps infinity is none."""
    from sheldrake.multibody.tree import PdControllerGains

    plant = MultibodyPlant(0.01)
    link = plant.AddRigidBody("link", SpatialInertia(1.0, np.zeros(3), UnitInertia(1.0, 1.0, 1.0)))
    joint = plant.AddJoint(RevoluteJoint("joint", plant.world_frame(), link.body_frame(), [0, 0, 1]))
    motor = plant.AddJointActuator("motor", joint, 2.0)
    if idle == "no desired state":
        motor.set_controller_gains(PdControllerGains(p=1.0, d=1.0))
    plant.Finalize()
    simulator = Simulator(plant)
    context = simulator.get_mutable_context()
    if idle == "locked":
        joint.Lock(context)
    for effort in (1.0, np.inf):
        plant.get_actuation_input_port().FixValue(context, [effort])
        simulator.AdvanceTo(context.get_time() + 0.02)
    plant.get_actuation_input_port().FixValue(context, [np.nan])
    with pytest.raises(RuntimeError, match="Detected NaN in the actuation input port"):
        simulator.AdvanceTo(context.get_time() + 0.02)
