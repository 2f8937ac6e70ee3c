"""Plants with answers known from mechanics."""

import numpy as np
import pytest

from sheldrake.common import RandomGenerator
from sheldrake.geometry import (
    HalfSpace,
    Sphere,
)
from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.multibody.math import SpatialInertia, SpatialVelocity
from sheldrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ContactModel,
    CoulombFriction,
    MultibodyPlant,
)
from sheldrake.multibody.tree import (
    BodyIndex,
    PrismaticJoint,
    PrismaticSpring,
    QuaternionFloatingJoint,
    RevoluteJoint,
    ScrewJoint,
)
from sheldrake.symbolic import Expression, Variable
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder

INERTIA = SpatialInertia.SolidBoxWithMass(2.0, 0.1, 0.2, 0.3)


def advance(system, context, time):
    simulator = Simulator(system, context)
    if context.num_continuous_states():
        simulator.get_mutable_integrator().set_target_accuracy(1e-8)
    simulator.Initialize()
    simulator.AdvanceTo(time)


def test_period_of_a_pendulum():
    """Small swings of a compound pendulum: 2 pi sqrt(I / (m g l))."""
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("rod", INERTIA.Shift([0.0, 0.0, 0.5]))
    hinge = plant.AddJoint(RevoluteJoint("hinge", plant.world_frame(), body.body_frame(), [0, 1, 0]))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    inertia = body.default_rotational_inertia().CopyToFullMatrix3()[1, 1]
    period = 2 * np.pi * np.sqrt(inertia / (2.0 * 9.81 * 0.5))
    hinge.set_angle(context, 1e-3)
    advance(plant, context, period)
    assert hinge.get_angle(context) == pytest.approx(1e-3, rel=1e-4)
    assert abs(hinge.get_angular_rate(context)) < 1e-5


def test_frequency_of_a_spring():
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("mass", INERTIA)
    slider = plant.AddJoint(PrismaticJoint("x", plant.world_frame(), body.body_frame(), [1, 0, 0]))
    plant.AddForceElement(PrismaticSpring(slider, 0.25, 200.0))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    advance(plant, context, np.pi / np.sqrt(200.0 / 2.0))
    assert slider.get_translation(context) == pytest.approx(0.5, abs=2e-4)


def test_screw_advances_with_its_pitch():
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("nut", INERTIA)
    screw = plant.AddJoint(ScrewJoint("screw", plant.world_frame(), body.body_frame(), [0, 0, 1], 0.02, 0.0))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    screw.set_translation(context, 0.01)
    X_WB = plant.EvalBodyPoseInWorld(context, body)
    np.testing.assert_allclose(X_WB.translation(), [0, 0, 0.01], atol=1e-15)
    np.testing.assert_allclose(X_WB.rotation().matrix(), np.diag([-1.0, -1.0, 1.0]), atol=1e-15)


def test_a_tumbling_chain_keeps_its_momentum():
    """No gravity: linear and angular momentum of a floating chain stay, whatever its joints do."""
    plant = MultibodyPlant(0.0)
    base = plant.AddRigidBody("base", INERTIA)
    parent = base
    for i in range(3):
        link = plant.AddRigidBody(f"link{i}", INERTIA.Shift([0.1, 0.2, -0.1]))
        plant.AddJoint(RevoluteJoint(f"j{i}", parent.body_frame(), link.body_frame(), [1, i, -1]))
        parent = link
    plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetVelocities(context, np.random.default_rng(0).normal(size=9))

    def momentum():
        return plant.CalcSpatialMomentumInWorldAboutPoint(context, [0, 0, 0]).get_coeffs()

    before, energy = momentum(), plant.CalcKineticEnergy(context)
    advance(plant, context, 0.5)
    np.testing.assert_allclose(momentum(), before, atol=1e-6)
    assert plant.CalcKineticEnergy(context) == pytest.approx(energy, rel=1e-6)


def ball_on_ground(time_step):
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step)
    ball = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    plant.RegisterCollisionGeometry(ball, RigidTransform(), Sphere(0.1), "ball", CoulombFriction(0.5, 0.5))
    ground = CoulombFriction(0.5, 0.5)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", ground)
    plant.Finalize()
    return builder.Build(), plant, ball


@pytest.mark.parametrize("time_step", [0.0, 1e-3])
def test_a_ball_comes_to_rest_where_weight_and_contact_balance(time_step):
    diagram, plant, ball = ball_on_ground(time_step)
    root = diagram.CreateDefaultContext()
    context = plant.GetMyContextFromRoot(root)
    plant.SetFreeBodyPose(context, ball, RigidTransform([0, 0, 0.11]))
    advance(diagram, root, 1.0)
    sink = 9.81 / 5e5
    assert plant.EvalBodyPoseInWorld(context, ball).translation()[2] == pytest.approx(0.1 - sink, abs=1e-6)
    results = plant.get_contact_results_output_port().Eval(context)
    assert results.num_point_pair_contacts() == 1
    info = results.point_pair_contact_info(0)
    sign = 1.0 if info.bodyB_index() == ball.index() else -1.0
    np.testing.assert_allclose(sign * info.contact_force(), [0, 0, 9.81], atol=0.02)


def test_a_step_outside_the_diagram_that_holds_the_geometry_is_refused():
    _, plant, _ = ball_on_ground(1e-3)
    with pytest.raises(RuntimeError, match=r"2 collision geometries, but its geometry_query input port is not conn"):
        advance(plant, plant.CreateDefaultContext(), 0.01)


def test_clone_and_step_both_gives_the_same_bits():
    diagram, plant, ball = ball_on_ground(1e-3)
    root = diagram.CreateDefaultContext()
    context = plant.GetMyContextFromRoot(root)
    plant.SetFreeBodyPose(context, ball, RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [0, 0, 0.15]))
    plant.SetFreeBodySpatialVelocity(context, ball, SpatialVelocity([1, 2, 3], [0.5, 0, 0]))
    advance(diagram, root, 0.2)
    other = root.Clone()
    for c in (root, other):
        advance(diagram, c, 0.4)
    states = [plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(c)) for c in (root, other)]
    np.testing.assert_array_equal(*states)


def test_parameters_belong_to_the_context():
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("free", INERTIA)
    plant.Finalize()
    heavy, light = plant.CreateDefaultContext(), plant.CreateDefaultContext()
    body.SetMass(heavy, 10.0)
    assert plant.CalcTotalMass(heavy) == 10.0 and plant.CalcTotalMass(light) == 2.0
    assert plant.CalcMassMatrix(heavy)[5, 5] == 10.0
    with pytest.raises(RuntimeError, match="mass of at least zero"):
        body.SetMass(heavy, -1.0)
    assert body.get_mass(heavy) == 10.0


def test_default_filters_of_neighbours_and_welds():
    """Neighbours may not touch unless one is the world; what is welded together never may."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    bodies, ids = [plant.world_body()], []
    for i in range(4):
        bodies.append(plant.AddRigidBody(f"b{i}", INERTIA))
    for body in bodies:
        friction = CoulombFriction(1, 1)
        ids.append(plant.RegisterCollisionGeometry(body, RigidTransform(), Sphere(0.1), "s", friction))
    frames = [b.body_frame() for b in bodies]
    plant.AddJoint(RevoluteJoint("j0", frames[0], frames[1], [0, 0, 1]))
    plant.AddJoint(RevoluteJoint("j1", frames[1], frames[2], [0, 0, 1]))
    plant.WeldFrames(frames[2], frames[3])
    plant.AddJoint(QuaternionFloatingJoint("j3", frames[3], frames[4]))
    plant.Finalize()
    candidates = scene_graph.model_inspector().GetCollisionCandidates()
    pairs = {tuple(sorted((ids.index(a), ids.index(b)))) for a, b in candidates}
    assert pairs == {(0, 1), (0, 2), (0, 3), (0, 4), (1, 3), (1, 4), (2, 4), (3, 4)}


def test_gravity_can_be_switched_off_for_a_model_instance():
    plant = MultibodyPlant(1e-3)
    plant.AddRigidBody("stone", INERTIA)
    instance = plant.AddModelInstance("balloon")
    plant.AddRigidBody("balloon", instance, INERTIA)
    plant.set_gravity_enabled(instance, False)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    advance(plant, context, 0.1)
    falling = [plant.EvalBodyPoseInWorld(context, plant.get_body(BodyIndex(i))).translation()[2] for i in (1, 2)]
    assert falling[0] == pytest.approx(-0.5 * 9.81 * 0.1 * 0.101) and falling[1] == 0.0


def test_state_port_of_a_model_instance_among_others():
    plant = MultibodyPlant(1e-3)
    instances = [plant.AddModelInstance(n) for n in "ab"]
    for instance in instances:
        body = plant.AddRigidBody("mass", instance, INERTIA)
        plant.AddJoint(PrismaticJoint("x", plant.world_frame(), body.body_frame(), [1, 0, 0]))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, np.array([1.0, 2.0, 3.0, 4.0]))
    np.testing.assert_array_equal(plant.get_state_output_port(instances[1]).Eval(context), [2.0, 4.0])
    np.testing.assert_array_equal(plant.get_state_output_port().Eval(context), [1.0, 2.0, 3.0, 4.0])


def test_contact_model_has_its_old_names():
    assert ContactModel.kPoint is ContactModel.kPointContactOnly
    assert ContactModel.kHydroelasticsOnly is ContactModel.kHydroelastic


def test_random_positions_come_from_the_joints_distributions():
    plant = MultibodyPlant(0.0)
    bodies = [plant.AddRigidBody(n, INERTIA) for n in ("swings", "slides", "floats")]
    hinge = plant.AddJoint(RevoluteJoint("hinge", plant.world_frame(), bodies[0].body_frame(), [0, 0, 1]))
    plant.AddJoint(PrismaticJoint("x", plant.world_frame(), bodies[1].body_frame(), [1, 0, 0]))
    floating = plant.AddJoint(QuaternionFloatingJoint("free", plant.world_frame(), bodies[2].body_frame()))
    hinge.set_random_angle_distribution(Expression(Variable("a", Variable.Type.RANDOM_UNIFORM)) + 5.0)
    floating.set_random_quaternion_distribution_to_uniform()
    plant.Finalize()
    context, generator = plant.CreateDefaultContext(), RandomGenerator(7)
    angles, quaternions = [], []
    for _ in range(30):
        plant.SetRandomContext(context, generator)
        q = plant.GetPositions(context)
        angles.append(q[0])
        quaternions.append(q[2:6])
        assert q[1] == 0.0
    assert 5.0 <= min(angles) < max(angles) <= 6.0
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1.0)
    assert np.ptp(quaternions, axis=0).min() > 0.5


@pytest.mark.parametrize("speed, count", [(0.005, 1), (0.03, 0)])
def test_contacts_of_continuous_plants_are_those_that_push(speed, count):
    """What separates faster than 1 / d = 0.02 m/s feels no force of Hunt and Crossley's; Drake reports nothing then."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    ball, friction = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(1.0, 0.1)), CoulombFriction(1.0, 1.0)
    plant.RegisterCollisionGeometry(ball, RigidTransform(), Sphere(0.1), "ball", friction)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", friction)
    plant.Finalize()
    context = plant.GetMyContextFromRoot(builder.Build().CreateDefaultContext())
    plant.SetPositions(context, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.099])
    plant.SetVelocities(context, [0.0, 0.0, 0.0, 0.1, 0.0, speed])
    assert plant.get_contact_results_output_port().Eval(context).num_point_pair_contacts() == count
