"""Queries of a plant: what they refuse, and that no write or change of a context is missed."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd, InitializeAutoDiff
from sheldrake.common.eigen_geometry import Quaternion
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialForce
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import (
    BallRpyJoint,
    FixedOffsetFrame,
    FrameIndex,
    JacobianWrtVariable,
    MultibodyForces,
    RevoluteJoint,
    SpatialInertia,
    UniversalJoint,
    WeldJoint,
)
from sheldrake.systems.framework import DiagramBuilder

pytestmark = pytest.mark.twin
V = JacobianWrtVariable.kV


def chain(dt=0.0, n=3):
    """A chain of n revolute joints; the last body is added first, so that bodies are not in the order of joints."""
    plant = MultibodyPlant(dt)
    M = SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.2, 0.3)
    bodies = {k: plant.AddRigidBody(f"b{k}", M) for k in reversed(range(n))}
    parent = plant.world_body()
    for k in range(n):
        X_PF = RigidTransform([0.1, 0.2, 0.3])
        axis = np.eye(3)[k % 3]
        plant.AddJoint(RevoluteJoint(f"j{k}", plant.AddFrame(FixedOffsetFrame(f"f{k}", parent.body_frame(), X_PF)),
                                     bodies[k].body_frame(), axis))  # fmt: skip
        parent = bodies[k]
    plant.Finalize()
    return plant


@pytest.fixture
def plant():
    return chain()


@pytest.fixture
def context(plant):
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, np.linspace(0.1, 1.0, 6))
    return context


def answers(plant, context):
    """Every fast query, as one list of numbers."""
    hand, world = plant.GetBodyByName("b2"), plant.world_frame()
    forces = MultibodyForces(plant)
    forces.mutable_generalized_forces()[:] = 1.0, 2.0, 3.0
    hand.AddInForceInWorld(context, SpatialForce([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]), forces)
    X = plant.EvalBodyPoseInWorld(context, hand)
    V_WB = plant.EvalBodySpatialVelocityInWorld(context, hand)
    return np.concatenate([np.ravel(a) for a in (
        plant.CalcMassMatrix(context), plant.CalcBiasTerm(context), plant.CalcGravityGeneralizedForces(context),
        X.GetAsMatrix34(), V_WB.get_coeffs(), plant.CalcCenterOfMassPositionInWorld(context),
        plant.CalcInverseDynamics(context, np.array([0.3, 0.2, 0.1]), forces),
        plant.CalcJacobianSpatialVelocity(context, V, hand.body_frame(), np.array([0.1, 0.0, 0.2]), world, world),
        plant.CalcRelativeTransform(context, world, hand.body_frame()).GetAsMatrix34(),
    )])  # fmt: skip


def test_forces_are_made_for_a_plant_or_for_numbers_of_bodies_and_velocities():
    for forces in (MultibodyForces(3, 4), MultibodyForces(nb=3, nv=4)):
        assert len(forces.body_forces()) == 3
        np.testing.assert_array_equal(forces.generalized_forces(), np.zeros(4))


def test_every_way_to_write_is_seen(plant, context):
    joint, body = plant.GetJointByName("j1"), plant.GetBodyByName("b1")
    state = context.get_continuous_state_vector() if not plant.is_discrete() else None
    writes = [
        lambda: plant.SetPositions(context, np.array([0.3, 0.2, 0.1])),
        lambda: plant.SetVelocities(context, [1.0, 2.0, 3.0]),
        lambda: plant.SetPositions(context, plant.GetModelInstanceByName("DefaultModelInstance"), np.ones(3)),
        lambda: plant.SetPositionsAndVelocities(context, q_v=np.arange(6.0)),
        lambda: plant.SetPositions(context, np.arange(6.0)[::2]),
        lambda: joint.set_angle(context, -0.4),
        lambda: joint.set_angular_rate(context, -0.4),
        lambda: state.SetAtIndex(2, 0.7),
        lambda: context.SetContinuousState(np.linspace(1.0, 2.0, 6)),
        lambda: body.SetMass(context, 3.0),
    ]
    seen = answers(plant, context)
    for write in writes:
        write()
        now = answers(plant, context)
        assert not np.array_equal(now, seen)
        fresh = plant.CreateDefaultContext()
        fresh.SetTimeStateAndParametersFrom(context)
        np.testing.assert_array_equal(answers(plant, fresh), now)
        seen = now


def test_answers_belong_to_the_caller(plant, context):
    for ask in (plant.CalcMassMatrix, plant.CalcBiasTerm, plant.CalcCenterOfMassPositionInWorld):
        first = ask(context)
        expected = first.copy()
        first[...] = 0.0
        np.testing.assert_array_equal(ask(context), expected)
    X = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName("b2"))
    before = X.GetAsMatrix34()
    plant.SetPositions(context, np.zeros(3))
    np.testing.assert_array_equal(X.GetAsMatrix34(), before)


def test_clones_and_parts_of_a_diagram_answer_alike(plant, context):
    expected = answers(plant, context)
    clone = context.Clone()
    plant.SetPositions(context, np.zeros(3))
    np.testing.assert_array_equal(answers(plant, clone), expected)
    other = chain()
    builder = DiagramBuilder()
    builder.AddSystem(other)
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    for _ in range(2):  # the second time the context of the plant is another object
        inner = other.GetMyMutableContextFromRoot(root)
        other.SetPositionsAndVelocities(inner, np.linspace(0.1, 1.0, 6))
        np.testing.assert_array_equal(answers(other, inner), expected)
        del inner


def test_memory_that_moved_is_followed():
    """Fixing a connected input port gives the context other memory."""
    from sheldrake.systems.primitives import ConstantVectorSource

    builder, plant = DiagramBuilder(), chain()
    source = builder.AddSystem(ConstantVectorSource(np.zeros(3)))
    builder.AddSystem(plant)
    port = plant.get_applied_generalized_force_input_port()
    builder.Connect(source.get_output_port(), port)
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    inner = plant.GetMyMutableContextFromRoot(root)
    plant.SetPositionsAndVelocities(inner, np.linspace(0.1, 1.0, 6))
    expected = answers(plant, inner)
    port.FixValue(inner, np.ones(3))
    np.testing.assert_array_equal(answers(plant, inner), expected)
    plant.SetPositions(inner, np.zeros(3))
    assert not np.array_equal(answers(plant, inner), expected)
    np.testing.assert_array_equal(inner.get_continuous_state_vector().CopyToVector()[:3], 0.0)


WRONG = [np.array([1.0, np.nan, 0.0]), np.array([1.0, np.inf, 0.0]), np.zeros(4), np.zeros(0), np.zeros((3, 2))]


@pytest.mark.parametrize("value", WRONG, ids=str)
def test_wrong_positions_are_refused_and_nothing_is_written(plant, context, value):
    before = answers(plant, context)
    for write in (plant.SetPositions, plant.SetVelocities):
        with pytest.raises(RuntimeError):
            write(context, value)
    np.testing.assert_array_equal(answers(plant, context), before)


def test_wrong_arguments_are_refused(plant, context):
    world, body = plant.world_frame(), plant.GetBodyByName("b0")
    other, forces = chain(n=2), MultibodyForces(plant)
    wrong = {
        RuntimeError: [
            lambda: other.CalcMassMatrix(context),
            lambda: other.SetPositions(context, np.zeros(2)),
            lambda: plant.EvalBodyPoseInWorld(context, other.GetBodyByName("b0")),
            lambda: plant.CalcInverseDynamics(context, np.zeros(3), MultibodyForces(other)),
            lambda: MultibodyPlant(0.0).CalcMassMatrix(context),
        ],
        TypeError: [
            lambda: plant.SetPositions(context),
            lambda: plant.SetPositions(context, np.zeros(3), np.zeros(3)),
            lambda: plant.SetPositions(context, positions=np.zeros(3)),
            lambda: plant.CalcInverseDynamics(context, np.zeros(2), forces),
            lambda: plant.CalcInverseDynamics(context, InitializeAutoDiff(np.zeros(3))[:, 0], forces),
            lambda: plant.CalcJacobianSpatialVelocity(context, V, body.body_frame(), np.zeros(2), world, world),
            lambda: plant.CalcJacobianSpatialVelocity(context, "v", body.body_frame(), np.zeros(3), world, world),
        ],
    }
    before = answers(plant, context)
    for error, calls in wrong.items():
        for call in calls:
            with pytest.raises(error):
                call()
    np.testing.assert_array_equal(answers(plant, context), before)


def test_a_hundred_frames_and_more_are_answered(plant, context):
    """Queries between frames are kept, but not without end."""
    hand, world = plant.GetBodyByName("b2").body_frame(), plant.world_frame()
    frames = [plant.get_frame(FrameIndex(i)) for i in range(plant.num_frames())]
    expected = {(a, b): plant.CalcRelativeTransform(context, a, b).GetAsMatrix34() for a in frames for b in frames}
    for E in frames * 60:
        plant.CalcJacobianSpatialVelocity(context, V, hand, np.zeros(3), world, E)
    for a in frames:
        for b in frames:
            for c in frames:
                plant.CalcJacobianSpatialVelocity(context, V, a, np.zeros(3), b, c)
    view = plant._parts.contexts.view(context)
    assert len(view.places) <= 256 < len(frames) ** 3
    for (a, b), X in expected.items():
        np.testing.assert_array_equal(plant.CalcRelativeTransform(context, a, b).GetAsMatrix34(), X)


def test_duals_give_what_numbers_give(plant, context):
    dual = plant.ToAutoDiffXd()
    c = dual.CreateDefaultContext()
    x = plant.GetPositionsAndVelocities(context)
    dual.SetPositionsAndVelocities(c, InitializeAutoDiff(x)[:, 0])
    M = dual.CalcMassMatrix(c)
    assert isinstance(M[0, 0], AutoDiffXd)
    np.testing.assert_allclose([[m.value() for m in row] for row in M], plant.CalcMassMatrix(context), atol=1e-15)
    X = dual.EvalBodyPoseInWorld(c, dual.GetBodyByName("b2"))
    expected = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName("b2")).translation()
    np.testing.assert_allclose([p.value() for p in X.translation()], expected, rtol=1e-13)


@pytest.mark.parametrize("dual", [False, True])
def test_contexts_that_were_asked_die_with_their_last_name(plant, dual):
    """No cycles: a loop over contexts does not wait for the garbage collector."""
    some = plant.ToAutoDiffXd() if dual else plant
    context = some.CreateDefaultContext()
    if dual:
        some.CalcMassMatrix(context)
        some.EvalBodyPoseInWorld(context, some.GetBodyByName("b2"))
    else:
        answers(some, context)
        some.SetPositions(context, np.zeros(3))
    slab = weakref.ref(context._store)
    gc.disable()
    try:
        del context
        assert slab() is None
    finally:
        gc.enable()


def test_momenta_of_instances_add_up_to_that_of_all_and_energies_are_plain_numbers():
    plant = MultibodyPlant(0.0)
    box = SpatialInertia.SolidBoxWithMass(1.5, 0.1, 0.2, 0.3)
    instances = [plant.AddModelInstance(name) for name in "ab"]
    for instance in instances:
        plant.AddRigidBody("body", instance, box)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetVelocities(context, np.arange(12.0))
    point = [0.1, 0.2, 0.3]
    whole = plant.CalcSpatialMomentumInWorldAboutPoint(context, point).get_coeffs()
    parts = [plant.CalcSpatialMomentumInWorldAboutPoint(context, [i], point).get_coeffs() for i in instances]
    np.testing.assert_allclose(whole, sum(parts), rtol=1e-15)
    np.testing.assert_array_equal(plant.CalcSpatialMomentumInWorldAboutPoint(context, [], point).get_coeffs(), 0.0)
    assert type(plant.CalcKineticEnergy(context)) is type(plant.CalcPotentialEnergy(context)) is float


def test_numbers_of_elements_are_plain_numbers():
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("body", SpatialInertia.SolidBoxWithMass(1.5, 0.1, 0.2, 0.3))
    joint = plant.AddJoint(RevoluteJoint("joint", plant.world_frame(), body.body_frame(), [0, 0, 1], 0.2))
    motor = plant.AddJointActuator("motor", joint)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    values = [joint.get_angle(context), joint.get_angular_rate(context), joint.GetOnePosition(context)]
    values += [joint.GetDamping(context), body.get_mass(context), motor.gear_ratio(context)]
    values += [motor.calc_reflected_inertia(context)]
    assert [type(value) for value in values] == [float] * 7


def mixed():
    """Free bodies, joints of one, two, three and no degrees of freedom, added in an order unlike the tree's."""
    plant = MultibodyPlant(0.0)
    M = SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.2, 0.3)
    a, b, c, d, e = (plant.AddRigidBody(name, M) for name in "abcde")
    plant.AddJoint(BallRpyJoint("ball", d.body_frame(), c.body_frame()))
    plant.AddJoint(UniversalJoint("universal", a.body_frame(), b.body_frame()))
    plant.AddJoint(WeldJoint("weld", c.body_frame(), e.body_frame(), RigidTransform([0.1, 0.2, 0.3])))
    plant.Finalize()
    context, rng = plant.CreateDefaultContext(), np.random.default_rng(5)
    plant.SetPositions(context, rng.uniform(0.2, 1.0, plant.num_positions()))
    plant.SetVelocities(context, rng.uniform(-1.0, 1.0, plant.num_velocities()))
    return plant, context


def test_the_map_of_velocities_is_what_it_makes_of_each_unit():
    plant, context = mixed()
    whole = plant.MakeQDotToVelocityMap(context).toarray()
    units = [plant.MapQDotToVelocity(context, unit) for unit in np.eye(plant.num_positions())]
    np.testing.assert_array_equal(whole, np.array(units).T)
    assert not np.array_equal(whole, np.eye(*whole.shape))
    hand, world = plant.GetBodyByName("e").body_frame(), plant.world_frame()
    J = [
        plant.CalcJacobianSpatialVelocity(context, what, hand, [0.1, 0, 0], world, world)
        for what in (V, JacobianWrtVariable.kQDot)
    ]
    np.testing.assert_allclose(J[1], J[0] @ whole, rtol=1e-14, atol=1e-15)  # the same sums, maybe in another order


def test_a_free_body_is_where_its_positions_say_and_the_pose_is_the_callers():
    plant, context = mixed()
    body = plant.GetBodyByName("a")
    X = plant.GetFreeBodyPose(context, body)
    wxyz = plant.GetPositions(context)[:4]
    assert X.rotation().IsValid() and body.is_floating_base_body()
    expected = RigidTransform(Quaternion(wxyz / np.sqrt(wxyz @ wxyz)), plant.GetPositions(context)[4:7])
    as_asked = plant.EvalBodyPoseInWorld(context, body).GetAsMatrix34()  # kernels contract products
    np.testing.assert_array_equal(X.GetAsMatrix34(), as_asked)
    np.testing.assert_allclose(as_asked, expected.GetAsMatrix34(), rtol=0, atol=4 * np.finfo(float).eps)
    plant.SetFreeBodyPose(context, body, RigidTransform([9.0, 9.0, 9.0]))
    np.testing.assert_array_equal(X.GetAsMatrix34(), as_asked)
    plant.SetPositions(context, np.zeros(plant.num_positions()))
    with pytest.raises(RuntimeError, match="all elements of a quaternion are zero"):
        plant.GetFreeBodyPose(context, body)


def test_bias_accelerations_in_the_world_are_those_turned_from_another_frame():
    plant, context = mixed()
    hand, turned, world = (plant.GetBodyByName(n).body_frame() for n in ("e", "b", "world"))
    R_WE = plant.CalcRelativeTransform(context, world, turned).rotation()
    arguments = context, V, hand, [0.1, 0.2, 0.3], world
    in_W, in_E = (plant.CalcBiasTranslationalAcceleration(*arguments, frame) for frame in (world, turned))
    np.testing.assert_allclose(in_W, R_WE @ in_E, atol=1e-12)  # a turn there and back
    in_W, in_E = (plant.CalcBiasSpatialAcceleration(*arguments, frame) for frame in (world, turned))
    np.testing.assert_allclose(in_W.rotational(), R_WE @ in_E.rotational(), atol=1e-12)
    np.testing.assert_allclose(in_W.translational(), R_WE @ in_E.translational(), atol=1e-12)


def test_bias_accelerations_are_those_of_steady_speeds_seen_from_what_moves_too():
    plant = chain(n=4)
    context, generator, h = plant.CreateDefaultContext(), np.random.default_rng(4), 1e-4
    q, v = generator.normal(size=(2, 4))
    A, B = plant.GetBodyByName("b1").body_frame(), plant.GetFrameByName("b3")
    point = np.array([0.1, -0.2, 0.3])

    def seen(t):
        plant.SetPositions(context, q + t * v)
        return plant.CalcPointsPositions(context, B, point, A)[:, 0], plant.CalcRelativeRotationMatrix(context, A, B)

    (before, _), (now, R_AB), (after, R_later) = seen(-h), seen(0.0), seen(h)
    plant.SetPositions(context, q)
    plant.SetVelocities(context, v)
    bias = plant.CalcBiasSpatialAcceleration(context, V, B, point, A, A)
    # The tolerance is that of differences of second order: h² times fourth derivatives, rounding over h².
    np.testing.assert_allclose(bias.translational(), (after - 2 * now + before) / h**2, atol=1e-5)
    points = plant.CalcBiasTranslationalAcceleration(context, V, B, np.stack([point, point], axis=1), A, A)
    np.testing.assert_array_equal(points, np.stack([bias.translational()] * 2, axis=1))
    J = plant.CalcJacobianAngularVelocity(context, V, B, A, A)
    plant.SetPositions(context, q + h * v)
    J_later = plant.CalcJacobianAngularVelocity(context, V, B, A, A)
    plant.SetPositions(context, q - h * v)
    J_before = plant.CalcJacobianAngularVelocity(context, V, B, A, A)
    np.testing.assert_allclose(bias.rotational(), (J_later - J_before) @ v / (2 * h), atol=1e-6)
    assert J.shape == (3, 4) and not R_AB.IsNearlyEqualTo(R_later, 1e-9)


def test_forces_of_elements_belong_to_their_bodies_whatever_the_order_of_joints():
    """The order of joints is not its own inverse here: a body's row is not the row's body."""
    plant = MultibodyPlant(0.0)
    masses = 1.0, 2.0, 3.0, 4.0
    bodies = [plant.AddRigidBody(f"b{m}", SpatialInertia.SolidBoxWithMass(m, 0.1, 0.2, 0.3)) for m in masses]
    parent = plant.world_frame()
    for k in (2, 0, 3, 1):
        X_PF = RigidTransform([0.1, 0.2, 0.3])
        parent = FixedOffsetFrame(f"on{k}", parent, X_PF)
        plant.AddFrame(parent)
        plant.AddJoint(RevoluteJoint(f"j{k}", parent, bodies[k].body_frame(), [0.0, 1.0, 0.0]))
        parent = bodies[k].body_frame()
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, [0.3, -0.2, 0.5, 0.1])
    forces = MultibodyForces(plant)
    plant.CalcForceElementsContribution(context, forces)
    for body, mass in zip(bodies, masses):
        force = body.GetForceInWorld(context, forces)
        np.testing.assert_allclose(force.translational(), [0.0, 0.0, -9.81 * mass], rtol=1e-12)
    gravity = plant.CalcGravityGeneralizedForces(context)
    np.testing.assert_allclose(plant.CalcGeneralizedForces(context, forces), gravity, rtol=1e-12, atol=1e-12)


def test_positions_of_a_model_instance_are_set_whole_or_not_at_all():
    plant = MultibodyPlant(0.0)
    for name in ("first", "second"):
        body = plant.AddRigidBody("body", plant.AddModelInstance(name), SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        plant.AddJoint(RevoluteJoint(name, plant.world_frame(), body.body_frame(), [0.0, 0.0, 1.0]))
    plant.Finalize()
    context, second = plant.CreateDefaultContext(), plant.GetModelInstanceByName("second")
    joint = plant.GetJointByName("second")
    plant.SetPositions(context, second, np.array([0.3]))
    assert plant.GetPositions(context).tolist() == [0.0, 0.3] and joint.get_angle(context) == 0.3
    plant.SetVelocities(context, second, np.array([0.4]))
    assert plant.GetVelocities(context).tolist() == [0.0, 0.4] and joint.get_angular_rate(context) == 0.4
    for wrong in (np.array([np.nan]), np.array([1.0, 2.0])):
        with pytest.raises(RuntimeError):
            plant.SetPositions(context, second, wrong)
    assert plant.GetPositions(context).tolist() == [0.0, 0.3]


def with_a_free_body():
    """A revolute joint on the world, and a body that floats."""
    plant, M = MultibodyPlant(0.0), SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.2, 0.3)
    arm, free = (plant.AddRigidBody(name, M) for name in ("arm", "free"))
    joint = plant.AddJoint(RevoluteJoint("j", plant.world_frame(), arm.body_frame(), [0.0, 0.6, 0.8]))
    plant.Finalize()
    return plant, plant.CreateDefaultContext(), joint, free


def test_one_body_and_one_joint_are_set_with_the_bits_of_setting_all_positions():
    plant, context, joint, free = with_a_free_body()
    at, j = free.floating_positions_start(), joint.position_start()
    rng = np.random.default_rng(3)
    for angle in rng.normal(size=10):
        wxyz = rng.normal(size=4)
        X = RigidTransform(Quaternion(wxyz / np.linalg.norm(wxyz)), rng.normal(size=3))
        expected = plant.GetPositions(context)
        plant.SetFreeBodyPose(context, free, X)
        expected[at : at + 4], expected[at + 4 : at + 7] = X.rotation().ToQuaternion().wxyz(), X.translation()
        np.testing.assert_array_equal(plant.GetPositions(context), expected)
        np.testing.assert_allclose(plant.GetFreeBodyPose(context, free).GetAsMatrix34(), X.GetAsMatrix34(), atol=1e-15)
        for value in (float(angle), np.float64(angle), 2):
            X_WB = plant.EvalBodyPoseInWorld(context, joint.child_body())  # out of date by what follows
            joint.set_angle(context, value)
            expected[j] = value
            np.testing.assert_array_equal(plant.GetPositions(context), expected)
            same = X_WB.IsExactlyEqualTo(plant.EvalBodyPoseInWorld(context, joint.child_body()))
            assert same == (type(value) is np.float64)


def test_one_body_or_joint_is_not_set_to_what_is_no_finite_number():
    plant, context, joint, free = with_a_free_body()
    before = plant.GetPositionsAndVelocities(context)
    for wrong in (np.nan, -np.inf):
        with pytest.raises(RuntimeError, match="the positions must be finite"):
            plant.SetFreeBodyPose(context, free, RigidTransform([0.0, 0.0, wrong]))
        with pytest.raises(RuntimeError, match="the positions must be finite"):
            joint.set_angle(context, wrong)
        with pytest.raises(RuntimeError, match="the velocities must be finite"):
            joint.set_angular_rate(context, wrong)
    for not_one in ("1", None, [1.0]):
        with pytest.raises(TypeError, match="Takes a number"):
            joint.set_angle(context, not_one)
    np.testing.assert_array_equal(plant.GetPositionsAndVelocities(context), before)


def test_names_that_were_asked_before_are_lists_of_their_own():
    plant = chain()
    first = plant.GetPositionNames()
    first[0] = "mine"
    assert plant.GetPositionNames()[0] != "mine"
    instance = plant.get_joint(plant.GetJointIndices()[0]).model_instance()
    assert instance == int(True)  # a flag and an instance must not be taken for each other
    assert plant.GetPositionNames(instance) == plant.GetPositionNames(False)
    assert plant.GetPositionNames(True) != plant.GetPositionNames(instance)


def test_limits_that_change_are_seen_by_whoever_asked_before():
    plant = chain()
    before = plant.GetPositionUpperLimits()
    assert np.isinf(before).all()
    before[:] = 0.0
    assert np.isinf(plant.GetPositionUpperLimits()).all()
    plant.get_joint(plant.GetJointIndices()[0]).set_position_limits([-1.0], [2.0])
    assert sorted(plant.GetPositionUpperLimits())[0] == 2.0
    assert sorted(plant.GetPositionLowerLimits())[0] == -np.inf
    assert max(plant.GetPositionLowerLimits()) == -1.0
