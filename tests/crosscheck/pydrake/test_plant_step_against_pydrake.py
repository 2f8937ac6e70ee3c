"""One discrete step of random plants without contact equals pydrake's: forces, limits, locks, constraints, control."""

import numpy as np
import pytest

pytest.importorskip("pydrake")

from random_plants import build, pydrake, random_inertia, random_pose, set_state, sheldrake
from test_plant_against_pydrake import Pair as ContinuousPair
from test_plant_against_pydrake import close

pytestmark = pytest.mark.peer
seeds = pytest.mark.parametrize("seed", range(8))
JOINTS = ("revolute", "prismatic", "weld", "screw", "planar", "universal", "ball", "quaternion")


def simulator(lib, plant, context):
    import importlib

    return importlib.import_module(f"{lib.library}.systems.analysis").Simulator(plant, context)


def step(lib, plant, context, time=0.0):
    """Takes the plant's updates up to `time` (one at 0) and gives its state."""
    s = simulator(lib, plant, context)
    s.Initialize()
    s.AdvanceTo(time)
    return plant.GetPositionsAndVelocities(context)


class Pair:
    """A discrete plant of each library in the same state, with the same inputs."""

    def __init__(self, seed, build=build, **options):
        self.libraries = sheldrake(), pydrake()
        self.plants = [build(lib, seed, time_step=2e-3, **options) for lib in self.libraries]
        self.contexts = [plant.CreateDefaultContext() for plant in self.plants]
        for plant, context in zip(self.plants, self.contexts):
            self.rng = set_state(plant, context, seed)[2]

    def each(self, function):
        return [function(*both) for both in zip(self.libraries, self.plants, self.contexts)]

    def check(self, function, tolerance=1e-12):
        close(*self.each(function), tolerance=tolerance)


@seeds
def test_a_step_with_forces_and_actuation(seed):
    p = Pair(seed, joints=JOINTS)
    plant = p.plants[1]
    u, tau = p.rng.normal(size=plant.num_actuators()) * 20, p.rng.normal(size=plant.num_velocities())
    instance = p.rng.normal(size=plant.num_actuated_dofs(p.libraries[1].ModelInstanceIndex(2)))

    def inputs(lib, plant, context):
        plant.get_actuation_input_port().FixValue(context, u)
        plant.get_actuation_input_port(lib.ModelInstanceIndex(2)).FixValue(context, instance)
        plant.get_applied_generalized_force_input_port().FixValue(context, tau)

    p.each(inputs)
    condition = np.linalg.cond(plant.CalcMassMatrix(p.contexts[1]))
    p.check(step, max(1e-11, 1e-15 * condition))
    p.check(lambda L, m, c: m.get_net_actuation_output_port().Eval(c), 1e-11)
    p.check(lambda L, m, c: m.get_generalized_acceleration_output_port().Eval(c), max(1e-9, 1e-13 * condition))

    def accelerations(lib, plant, context):
        return [A.get_coeffs() for A in plant.get_body_spatial_accelerations_output_port().Eval(context)]

    p.check(accelerations, max(1e-9, 1e-13 * condition))


@seeds
def test_applied_spatial_forces(seed):
    p = Pair(seed, joints=JOINTS)
    numbers = p.rng.normal(size=(3, 9))

    def inputs(lib, plant, context):
        forces = []
        for i, row in enumerate(numbers):
            force = lib.ExternallyAppliedSpatialForce()
            force.body_index, force.p_BoBq_B = lib.BodyIndex(1 + i), row[:3]
            force.F_Bq_W = lib.SpatialForce(row[3:])
            forces.append(force)
        plant.get_applied_spatial_force_input_port().FixValue(context, forces)
        return step(lib, plant, context, 0.02)

    p.check(inputs, 1e-9)


@seeds
def test_applied_spatial_forces_of_a_continuous_plant(seed):
    p = ContinuousPair(seed)
    row = p.rng.normal(size=9)

    def derivatives(L, m, c):
        force = L.ExternallyAppliedSpatialForce()
        force.body_index, force.p_BoBq_B, force.F_Bq_W = L.BodyIndex(2), row[:3], L.SpatialForce(row[3:])
        m.get_applied_spatial_force_input_port().FixValue(c, [force])
        return m.EvalTimeDerivatives(c).CopyToVector()

    condition = np.linalg.cond(p.d.CalcMassMatrix(p.cd))
    p.check(derivatives, max(1e-11, 1e-14 * condition))


@seeds
def test_reaction_forces_of_a_step(seed):
    p = Pair(seed, joints=("revolute", "prismatic", "weld", "ball"))
    condition = np.linalg.cond(p.plants[1].CalcMassMatrix(p.contexts[1]))

    def reactions(lib, plant, context):
        step(lib, plant, context)
        return [F.get_coeffs() for F in plant.get_reaction_forces_output_port().Eval(context)][: plant.num_joints()]

    p.check(reactions, max(1e-9, 1e-12 * condition))


@seeds
def test_accelerations_asked_for_are_those_of_the_present_state(seed):
    p = Pair(seed, joints=JOINTS)
    condition = np.linalg.cond(p.plants[1].CalcMassMatrix(p.contexts[1]))

    def accelerations(lib, plant, context):
        bodies = [plant.get_body(lib.BodyIndex(i)) for i in range(plant.num_bodies())]
        return [
            *(plant.EvalBodySpatialAccelerationInWorld(context, b).get_coeffs() for b in bodies),
            *(b.body_frame().CalcSpatialAccelerationInWorld(context).get_coeffs() for b in bodies),
        ]

    def center(lib, plant, context):
        return plant.CalcCenterOfMassTranslationalAccelerationInWorld(context)

    for query in (accelerations, center):
        p.check(query, max(1e-9, 1e-13 * condition))
    p.each(lambda L, m, c: step(L, m, c, 0.01))
    for query in (accelerations, center):
        p.check(query, max(1e-9, 1e-12 * condition))


def test_ports_before_the_first_step_are_zero():
    p = Pair(0, joints=JOINTS)

    def outputs(lib, plant, context):
        ports = (plant.get_generalized_acceleration_output_port(), plant.get_net_actuation_output_port())
        reactions = [F.get_coeffs() for F in plant.get_reaction_forces_output_port().Eval(context)]
        return np.concatenate([*(port.Eval(context) for port in ports), *reactions])

    assert not np.any(p.each(outputs)[0])


@seeds
def test_locked_joints(seed):
    p = Pair(seed, joints=JOINTS)
    chosen = p.rng.permutation(p.plants[0].num_joints())[:3]

    def lock(lib, plant, context):
        for i in chosen:
            plant.get_joint(lib.JointIndex(int(i))).Lock(context)
        return step(lib, plant, context, 0.01)

    p.check(lock, 1e-9)
    for lib, plant, context in zip(p.libraries, p.plants, p.contexts):
        joint = plant.get_joint(lib.JointIndex(int(chosen[0])))
        assert joint.is_locked(context)
        joint.Unlock(context)
        assert not joint.is_locked(context)


def chain(lib, seed, time_step, gains=False):
    """Three links with limits near the state, and actuators with or without gains."""
    rng = np.random.default_rng(seed)
    plant = lib.MultibodyPlant(time_step)
    parent = plant.world_frame()
    for i in range(3):
        body = plant.AddRigidBody(f"link{i}", random_inertia(lib, rng))
        joint = plant.AddJoint(
            lib.RevoluteJoint(f"j{i}", parent, body.body_frame(), rng.normal(size=3), -0.3, 0.4, 0.1)
        )
        actuator = plant.AddJointActuator(f"m{i}", joint, 5.0)
        if gains and i != 1:
            g = lib.PdControllerGains()
            g.p, g.d = 100.0 * (i + 1), 3.0
            actuator.set_controller_gains(g)
        parent = plant.AddFrame(lib.FixedOffsetFrame(f"F{i}", body.body_frame(), random_pose(lib, rng)))
    plant.Finalize()
    return plant


@seeds
def test_joint_limits(seed):
    p = Pair(seed, build=chain)
    q = p.rng.uniform(-0.32, 0.42, 3)
    p.each(lambda L, m, c: m.SetPositions(c, q))
    p.check(lambda L, m, c: step(L, m, c, 0.05), 1e-8)


def one_hinge(lib, lower, upper):
    """A pendulum with an actuator."""
    plant = lib.MultibodyPlant(1e-3)
    inertia = lib.SpatialInertia.SolidSphereWithMass(1.0, 0.5)
    body, offset = plant.AddRigidBody("a", inertia), lib.RigidTransform([0.3, 0.0, 0.0])
    frame = plant.AddFrame(lib.FixedOffsetFrame("f", body, offset))
    joint = plant.AddJoint(lib.RevoluteJoint("j", plant.world_frame(), frame, [0, 1, 0], lower, upper))
    plant.AddJointActuator("u", joint)
    plant.Finalize()
    return plant


@pytest.mark.parametrize("torque", [0.0, 1e5, -1e5])
@pytest.mark.parametrize("lower, upper", [(-0.101, 0.0505), (-0.3, -0.1), (0.1, 0.3), (-0.2, np.inf), (-np.inf, 0.2)])
def test_limits_that_are_crossed_within_a_step(lower, upper, torque):
    """Both limits count, with the velocity v0 or v*; also where the one limit would hold what the torque moves away."""
    for v in (0.0, 50.0, 200.0, 400.0, -50.0, -200.0, -400.0):
        results = []
        for lib in (sheldrake(), pydrake()):
            plant = one_hinge(lib, lower, upper)
            context = plant.CreateDefaultContext()
            plant.SetVelocities(context, [v])
            plant.get_actuation_input_port().FixValue(context, [torque])
            results.append(step(lib, plant, context))
        np.testing.assert_allclose(*results, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("desired", [True, False])
@seeds
def test_position_control(seed, desired):
    p = Pair(seed, build=chain, gains=True)
    q, target, u = p.rng.uniform(-0.2, 0.2, 3), p.rng.normal(size=6) * 0.1, p.rng.normal(size=3)

    def run(lib, plant, context):
        plant.SetPositions(context, q)
        plant.get_actuation_input_port().FixValue(context, u)
        if desired:
            plant.get_desired_state_input_port(lib.ModelInstanceIndex(1)).FixValue(context, target)
        return step(lib, plant, context, 0.02)

    p.check(run, 1e-8)
    p.check(lambda L, m, c: m.get_net_actuation_output_port().Eval(c), 1e-6)


def constrained(lib, seed, time_step, kind):
    """Two free bodies and two sliders, with one constraint that is nearly satisfied by default."""
    rng = np.random.default_rng(seed)
    plant = lib.MultibodyPlant(time_step)
    A, B = (plant.AddRigidBody(n, random_inertia(lib, rng)) for n in "AB")
    sliders = []
    for i in range(2):
        body = plant.AddRigidBody(f"slider{i}", random_inertia(lib, rng))
        joint = lib.PrismaticJoint(f"x{i}", plant.world_frame(), body.body_frame(), rng.normal(size=3))
        sliders.append(plant.AddJoint(joint))
    p, q = rng.normal(size=(2, 3))
    if kind == "coupler":
        plant.AddCouplerConstraint(sliders[0], sliders[1], 1.5, 0.01)
    elif kind == "distance":
        plant.AddDistanceConstraint(A, p, B, q, 1.0, 500.0, 3.0)
    elif kind == "ball":
        plant.AddBallConstraint(A, p, B)
    else:
        plant.AddWeldConstraint(A, lib.RigidTransform(p), B, lib.RigidTransform(p + 1e-3))
    plant.Finalize()
    return plant


@pytest.mark.parametrize("kind", ["coupler", "distance", "ball", "weld"])
@seeds
def test_constraints(seed, kind):
    p = Pair(seed, build=lambda lib, seed, time_step: constrained(lib, seed, time_step, kind))
    v = p.rng.normal(size=14) * 0.1

    def run(lib, plant, context):
        plant.SetPositions(context, plant.GetPositions(plant.CreateDefaultContext()))
        plant.SetVelocities(context, v)
        return step(lib, plant, context, 0.01)

    p.check(run, 1e-7)

    def inactive(lib, plant, context):
        plant.SetPositions(context, plant.GetPositions(plant.CreateDefaultContext()))
        plant.SetVelocities(context, v)
        (id,) = plant.GetConstraintIds()
        assert plant.GetConstraintActiveStatus(context, id)
        plant.SetConstraintActiveStatus(context, id, False)
        return step(lib, plant, context, context.get_time())

    p.check(inactive, 1e-9)
