"""Random plants: names, order and every model quantity equal pydrake's."""

import numpy as np
import pytest

pytest.importorskip("pydrake")

from random_plants import build, pydrake, set_state, sheldrake

pytestmark = pytest.mark.peer
seeds = pytest.mark.parametrize("seed", range(16))
TOLERANCE = 1e-12


def close(ours, theirs, scale=None, tolerance=TOLERANCE):
    ours, theirs = np.asarray(ours, float), np.asarray(theirs, float)
    size = np.abs(theirs).max(initial=1.0) if scale is None else scale
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=tolerance * size)


class Pair:
    """A plant of each library in the same state."""

    def __init__(self, seed, **options):
        self.S, self.D = sheldrake(), pydrake()
        self.s, self.d = build(self.S, seed, **options), build(self.D, seed, **options)
        self.cs, self.cd = self.s.CreateDefaultContext(), self.d.CreateDefaultContext()
        set_state(self.s, self.cs, seed)
        self.rng = set_state(self.d, self.cd, seed)[2]
        self.nv = self.d.num_velocities()

    def both(self, query):
        """query(lib, plant, context) of both."""
        return query(self.S, self.s, self.cs), query(self.D, self.d, self.cd)

    def check(self, query, tolerance=TOLERANCE):
        close(*self.both(query), tolerance=tolerance)

    def frames(self):
        """Two random frame numbers of the plant."""
        return [int(i) for i in self.rng.integers(self.s.num_frames(), size=3)]


@seeds
def test_counts_names_and_order(seed):
    p = Pair(seed)

    def describe(lib, plant, context):
        joints = [plant.get_joint(lib.JointIndex(i)) for i in range(plant.num_joints())]
        return {
            "names": (plant.GetPositionNames(), plant.GetVelocityNames(), plant.GetStateNames(False)),
            "short": plant.GetPositionNames(False, False),
            "efforts": plant.GetActuatorNames(False),
            "joints": [(j.name(), j.type_name(), j.position_start(), j.velocity_start()) for j in joints],
            "instances": [int(j.model_instance()) for j in joints],
            "actuators": plant.GetActuatorNames(),
            "counts": (plant.num_positions(), plant.num_velocities(), plant.num_bodies()),
            "floating": sorted(int(i) for i in plant.GetFloatingBaseBodies()),
            "inputs": [(plant.get_input_port(i).get_name(), plant.get_input_port(i).size()) for i in range(10)],
            "outputs": [(plant.get_output_port(i).get_name(), plant.get_output_port(i).size()) for i in range(18)],
            "welded": [[b.name() for b in plant.GetBodiesWeldedTo(plant.get_body(lib.BodyIndex(1)))]],
            "frames": [plant.get_frame(lib.FrameIndex(i)).name() for i in range(plant.num_frames())],
            "limits": (plant.GetPositionLowerLimits().tolist(), plant.GetEffortUpperLimits().tolist()),
        }

    ours, theirs = p.both(describe)
    assert ours == theirs


@seeds
def test_default_context(seed):
    p = Pair(seed)
    p.check(lambda lib, plant, c: plant.GetPositionsAndVelocities(plant.CreateDefaultContext()))


@seeds
def test_mass_matrix_bias_and_gravity(seed):
    p = Pair(seed)
    p.check(lambda lib, plant, c: plant.CalcMassMatrix(c))
    p.check(lambda lib, plant, c: plant.CalcMassMatrixViaInverseDynamics(c))
    p.check(lambda lib, plant, c: plant.CalcBiasTerm(c))
    p.check(lambda lib, plant, c: plant.CalcGravityGeneralizedForces(c))


def test_a_fault_of_1e_8_in_the_mass_matrix_is_seen():
    p = Pair(0)
    ours, theirs = p.both(lambda lib, plant, c: plant.CalcMassMatrix(c))
    ours[np.unravel_index(np.abs(theirs).argmax(), theirs.shape)] *= 1 + 1e-8
    with pytest.raises(AssertionError):
        close(ours, theirs)


@seeds
def test_inverse_dynamics_and_forces(seed):
    p = Pair(seed)
    vdot, tau, F = p.rng.normal(size=p.nv), p.rng.normal(size=p.nv), p.rng.normal(size=6)

    def forces(lib, plant, context):
        forces = lib.MultibodyForces(plant)
        plant.CalcForceElementsContribution(context, forces)
        body, frame = plant.get_body(lib.BodyIndex(3)), plant.get_frame(lib.FrameIndex(4))
        body.AddInForce(context, [0.1, 0.2, 0.3], lib.SpatialForce(F), frame, forces)
        forces.mutable_generalized_forces()[:] += tau
        return forces

    def spatial(lib, plant, c):
        f = forces(lib, plant, c)
        bodies = [plant.get_body(lib.BodyIndex(i)) for i in range(1, plant.num_bodies())]
        return [b.GetForceInWorld(c, f).get_coeffs() for b in bodies]

    p.check(spatial)
    p.check(lambda lib, plant, c: forces(lib, plant, c).generalized_forces())
    p.check(lambda lib, plant, c: plant.CalcGeneralizedForces(c, forces(lib, plant, c)))
    p.check(lambda lib, plant, c: plant.CalcInverseDynamics(c, vdot, forces(lib, plant, c)))


@seeds
def test_poses_and_velocities_of_bodies_and_frames(seed):
    p = Pair(seed)
    a, b, e = p.frames()

    def frame(lib, plant, i):
        return plant.get_frame(lib.FrameIndex(i))

    points = p.rng.normal(size=(3, 4))
    for i in range(p.d.num_bodies()):
        p.check(lambda lib, plant, c, i=i: plant.get_body(lib.BodyIndex(i)).EvalPoseInWorld(c).GetAsMatrix34())
        p.check(lambda lib, plant, c, i=i: plant.get_body(lib.BodyIndex(i)).EvalSpatialVelocityInWorld(c).get_coeffs())
    p.check(lambda L, m, c: m.CalcRelativeTransform(c, frame(L, m, a), frame(L, m, b)).GetAsMatrix34())
    p.check(lambda L, m, c: m.CalcRelativeRotationMatrix(c, frame(L, m, a), frame(L, m, b)).matrix())
    p.check(lambda L, m, c: m.CalcPointsPositions(c, frame(L, m, a), points, frame(L, m, b)))
    p.check(lambda L, m, c: m.CalcPointsVelocities(c, frame(L, m, a), points, frame(L, m, b), frame(L, m, e)), 1e-11)
    p.check(lambda L, m, c: frame(L, m, a).CalcSpatialVelocityInWorld(c).get_coeffs())
    p.check(lambda L, m, c: frame(L, m, a).CalcSpatialVelocity(c, frame(L, m, b), frame(L, m, e)).get_coeffs(), 1e-11)
    p.check(
        lambda L, m, c: (
            frame(L, m, a).CalcRelativeSpatialVelocity(c, frame(L, m, e), frame(L, m, b), frame(L, m, e)).get_coeffs()
        ),
        1e-11,
    )


@seeds
def test_jacobians_and_bias_accelerations(seed):
    p = Pair(seed)
    a, b, e = p.frames()
    points = np.asfortranarray(p.rng.normal(size=(3, 2)))

    def frames(L, m):
        return [m.get_frame(L.FrameIndex(i)) for i in (a, b, e)]

    for name in ("kV", "kQDot"):

        def wrt(L, name=name):
            return getattr(L.JacobianWrtVariable, name)

        def spatial(L, m, c, wrt=wrt):
            B, A, E = frames(L, m)
            return m.CalcJacobianSpatialVelocity(c, wrt(L), B, points[:, 0], A, E)

        def angular(L, m, c, wrt=wrt):
            return m.CalcJacobianAngularVelocity(c, wrt(L), *frames(L, m))

        def translational(L, m, c, wrt=wrt):
            B, A, E = frames(L, m)
            return m.CalcJacobianTranslationalVelocity(c, wrt(L), B, points, A, E)

        def com(L, m, c, wrt=wrt):
            return m.CalcJacobianCenterOfMassTranslationalVelocity(c, wrt(L), m.world_frame(), frames(L, m)[2])

        for query in (spatial, angular, translational, com):
            p.check(query, 1e-11)

    def position(L, m, c):
        B, A, E = frames(L, m)
        return m.CalcJacobianPositionVector(c, B, points, A, E)

    def bias(L, m, c):
        B, A, E = frames(L, m)
        return m.CalcBiasSpatialAcceleration(c, L.JacobianWrtVariable.kV, B, points[:, 0], A, E).get_coeffs()

    def bias_points(L, m, c):
        B, A, E = frames(L, m)
        return m.CalcBiasTranslationalAcceleration(c, L.JacobianWrtVariable.kV, B, points, A, E)

    def bias_com(L, m, c):
        return m.CalcBiasCenterOfMassTranslationalAcceleration(
            c, L.JacobianWrtVariable.kV, m.world_frame(), frames(L, m)[2]
        )

    def bias_com_in_a_frame(L, m, c):
        _, A, E = frames(L, m)
        instances = [L.ModelInstanceIndex(2)]
        return m.CalcBiasCenterOfMassTranslationalAcceleration(c, instances, L.JacobianWrtVariable.kV, A, E)

    for query in (position, bias, bias_points, bias_com, bias_com_in_a_frame):
        p.check(query, 1e-11)


@seeds
def test_accelerations_of_frames_and_centres_of_mass(seed):
    p = Pair(seed)
    a, b, e = p.frames()

    def frames(L, m):
        return [m.get_frame(L.FrameIndex(i)) for i in (a, b, e)]

    def in_world(L, m, c):
        return frames(L, m)[0].CalcSpatialAccelerationInWorld(c).get_coeffs()

    def in_a_frame(L, m, c):
        B, A, E = frames(L, m)
        return B.CalcSpatialAcceleration(c, A, E).get_coeffs()

    def of_body(L, m, c):
        body = frames(L, m)[0].body()
        if int(body.index()) == 0:  # its centre of mass is NaN
            body = m.get_body(L.BodyIndex(1))
        return [
            *body.EvalSpatialAccelerationInWorld(c).get_coeffs(),
            *body.CalcCenterOfMassTranslationalVelocityInWorld(c),
            *body.CalcCenterOfMassTranslationalAccelerationInWorld(c),
        ]

    def of_instance(L, m, c):
        instances = [L.ModelInstanceIndex(2)]
        return [
            *m.CalcCenterOfMassPositionInWorld(c, instances),
            *m.CalcCenterOfMassTranslationalVelocityInWorld(c, instances),
            *m.CalcCenterOfMassTranslationalAccelerationInWorld(c, instances),
            *m.CalcCenterOfMassTranslationalAccelerationInWorld(c),
            *m.CalcSpatialMomentumInWorldAboutPoint(c, instances, [0.1, 0.2, 0.3]).get_coeffs(),
        ]

    def jacobian(L, m, c):
        _, A, E = frames(L, m)
        kV, instances = L.JacobianWrtVariable.kV, [L.ModelInstanceIndex(2)]
        return m.CalcJacobianCenterOfMassTranslationalVelocity(c, instances, kV, A, E)

    def of_a_point(L, m, c):
        B, A, E = frames(L, m)
        return m.CalcPointsVelocities(c, B, np.array([0.1, 0.2, 0.3]), A, E)

    queries = [in_world, in_a_frame, of_body, of_instance, of_a_point]
    for query in [*queries, *([] if jacobian_refused(p, b) else [jacobian]), *queries]:  # again, after the others
        p.check(query, 1e-9)  # accelerations of these plants are up to 1e3


def jacobian_refused(p, b):
    """Drake has the Jacobian of a centre of mass in the world only."""
    return not p.d.get_frame(p.D.FrameIndex(b)).is_world_frame()


@seeds
def test_mass_momentum_and_energy(seed):
    p = Pair(seed)
    about = p.rng.normal(size=3)
    p.check(lambda L, m, c: m.CalcTotalMass(c))
    p.check(lambda L, m, c: m.CalcTotalMass(c, [L.ModelInstanceIndex(2)]))
    p.check(lambda L, m, c: m.CalcCenterOfMassPositionInWorld(c))
    p.check(lambda L, m, c: m.CalcCenterOfMassTranslationalVelocityInWorld(c))
    p.check(lambda L, m, c: m.CalcSpatialMomentumInWorldAboutPoint(c, about).get_coeffs())
    p.check(lambda L, m, c: m.CalcPotentialEnergy(c))
    p.check(lambda L, m, c: m.CalcKineticEnergy(c))
    p.check(lambda L, m, c: m.CalcConservativePower(c))
    p.check(lambda L, m, c: m.CalcNonConservativePower(c))
    bodies = [1, 3, 4]

    def inertia(L, m, c):
        M = m.CalcSpatialInertia(c, m.get_frame(L.FrameIndex(5)), [L.BodyIndex(i) for i in bodies])
        return M.CopyToFullMatrix6()

    p.check(inertia)


@seeds
def test_maps_between_velocities_and_qdot(seed):
    p = Pair(seed)
    v, qdot = p.rng.normal(size=p.nv), p.rng.normal(size=p.d.num_positions())
    p.check(lambda L, m, c: m.MapVelocityToQDot(c, v))
    p.check(lambda L, m, c: m.MapQDotToVelocity(c, qdot))
    p.check(lambda L, m, c: m.MakeVelocityToQDotMap(c).toarray())
    p.check(lambda L, m, c: m.MakeQDotToVelocityMap(c).toarray())
    assert p.s.IsVelocityEqualToQDot() == p.d.IsVelocityEqualToQDot()


@seeds
def test_selectors_and_actuation(seed):
    p = Pair(seed)
    p.check(lambda L, m, c: m.MakeActuationMatrix())
    p.check(lambda L, m, c: m.MakeStateSelectorMatrix([L.JointIndex(1), L.JointIndex(0)]))
    p.check(lambda L, m, c: m.MakeActuatorSelectorMatrix(m.GetJointActuatorIndices()))
    p.check(lambda L, m, c: m.MakeActuationMatrixPseudoinverse().toarray())


@seeds
def test_continuous_dynamics(seed):
    p = Pair(seed)
    u = p.rng.normal(size=p.d.num_actuated_dofs())
    tau = p.rng.normal(size=p.nv)

    def derivatives(L, m, c):
        m.get_actuation_input_port().FixValue(c, u)
        m.get_applied_generalized_force_input_port().FixValue(c, tau)
        return m.EvalTimeDerivatives(c).CopyToVector()

    condition = np.linalg.cond(p.d.CalcMassMatrix(p.cd))
    p.check(derivatives, max(1e-11, 40 * 2.2e-16 * condition))
    p.check(lambda L, m, c: m.get_generalized_acceleration_output_port().Eval(c), max(1e-11, 1e-14 * condition))
    p.check(
        lambda L, m, c: [F.get_coeffs() for F in m.get_reaction_forces_output_port().Eval(c)][: m.num_joints()],
        max(1e-11, 1e-13 * condition),
    )
    p.check(
        lambda L, m, c: [A.get_coeffs() for A in m.get_body_spatial_accelerations_output_port().Eval(c)],
        max(1e-11, 1e-14 * condition),
    )
    p.check(lambda L, m, c: m.CalcCenterOfMassTranslationalAccelerationInWorld(c), max(1e-11, 1e-14 * condition))


@seeds
def test_locked_joints_in_continuous_time(seed):
    p = Pair(seed)
    locked = [int(j.index()) for j in map(p.d.get_joint, p.d.GetJointIndices())][:: 2 + seed % 2]

    def derivatives(L, m, c):
        for i in locked:
            m.get_joint(L.JointIndex(i)).Lock(c)
        return [m.GetVelocities(c).tolist(), m.EvalTimeDerivatives(c).CopyToVector().tolist()]

    ours, theirs = p.both(derivatives)
    condition = np.linalg.cond(p.d.CalcMassMatrix(p.cd))
    assert ours[0] == theirs[0]
    close(ours[1], theirs[1], tolerance=max(1e-11, 40 * 2.2e-16 * condition))


@seeds
def test_accelerations_from_vdot(seed):
    p = Pair(seed)
    vdot = p.rng.normal(size=p.nv)
    p.check(lambda L, m, c: [A.get_coeffs() for A in m.CalcSpatialAccelerationsFromVdot(c, vdot)], 1e-11)


@seeds
def test_bushings_and_door_hinges(seed):
    p = Pair(seed, bushings=True)

    def elements(lib, plant):
        all_elements = (plant.get_force_element(lib.ForceElementIndex(i)) for i in range(plant.num_force_elements()))
        return {type(e).__name__: e for e in all_elements}

    def forces(lib, plant, context):
        forces = lib.MultibodyForces(plant)
        plant.CalcForceElementsContribution(context, forces)
        return plant.CalcGeneralizedForces(context, forces)

    def bushing(lib, plant, context):
        e = elements(lib, plant)["LinearBushingRollPitchYaw"]
        on_A, on_C = e.CalcBushingSpatialForceOnFrameA(context), e.CalcBushingSpatialForceOnFrameC(context)
        return [on_A.get_coeffs(), on_C.get_coeffs()]

    p.check(forces, 1e-11)
    p.check(bushing, 1e-11)
    if "DoorHinge" in elements(p.D, p.d):
        for angle, rate in ((0.3, 0.05), (-0.1, -2.0)):
            p.check(lambda L, m, c, a=angle, r=rate: elements(L, m)["DoorHinge"].CalcHingeTorque(a, r))
            p.check(lambda L, m, c, a=angle: elements(L, m)["DoorHinge"].CalcHingeSpringTorque(a))
            p.check(lambda L, m, c, r=rate: elements(L, m)["DoorHinge"].CalcHingeFrictionalTorque(r))


def test_potential_energy_of_a_door_hinge():
    def energies(lib):
        plant = lib.MultibodyPlant(0.0)
        door = plant.AddRigidBody("door", lib.SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.2, 0.3))
        hinge = plant.AddJoint(lib.RevoluteJoint("hinge", plant.world_frame(), door.body_frame(), [0, 0, 1]))
        plant.AddForceElement(lib.DoorHinge(hinge, lib.DoorHingeConfig(catch_width=0.4)))
        plant.Finalize()
        context = plant.CreateDefaultContext()
        values = []
        for angle in (0.0, 0.1, 0.4, 1.2):
            hinge.set_angle(context, angle)
            values.append(plant.CalcPotentialEnergy(context))
        return np.array(values)

    close(energies(sheldrake()), energies(pydrake()))


def test_quaternions_of_joints_are_as_the_positions_have_them():
    found = []
    for L in (sheldrake(), pydrake()):
        plant = L.MultibodyPlant(0.0)
        body = plant.AddRigidBody("b", L.SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        joint = plant.AddJoint(L.QuaternionFloatingJoint("j", plant.world_frame(), body.body_frame()))
        joint.set_default_positions([0.2, 0.4, 0.0, 0.0, 1.0, 2.0, 3.0])
        plant.Finalize()
        context = plant.CreateDefaultContext()
        plant.SetPositions(context, [0.1, 0.1, -0.1, 0.1, 1.0, 2.0, 3.0])
        quaternions = joint.get_quaternion(context), joint.get_default_quaternion()
        found.append([q.wxyz() for q in quaternions] + [joint.GetPose(context).rotation().matrix().ravel()])
    for ours, theirs in zip(*found):
        close(ours, theirs)


def test_the_unique_floating_base_of_a_model_instance():
    def answers(lib):
        plant = lib.MultibodyPlant(0.0)
        inertia = lib.SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.2, 0.3)
        instances = [plant.AddModelInstance(name) for name in "ABCDE"]
        bodies = [plant.AddRigidBody(f"{i}{n}", i, inertia) for i in instances for n in range(2)]

        def join(parent, child):
            frame = plant.world_frame() if parent is None else bodies[parent].body_frame()
            plant.AddJoint(lib.RevoluteJoint(f"j{child}", frame, bodies[child].body_frame(), [0, 0, 1]))

        join(0, 1)  # A: one tree
        join(None, 3)  # B: one body floats, the other hangs on the world
        join(1, 4)  # C: one body floats, the other hangs on A
        join(None, 6), join(6, 7)  # D: none floats; E: both float
        plant.Finalize()
        unique = [plant.HasUniqueFloatingBaseBody(i) for i in instances]
        return unique, [plant.GetUniqueFloatingBaseBodyOrThrow(i).name() for i, u in zip(instances, unique) if u]

    ours = answers(sheldrake())
    assert ours == answers(pydrake())
    assert ours[0] == [True, False, True, False, False]


def test_benchmark_mechanisms_equal_drakes():
    def numbers(name):
        import importlib

        benchmarks = importlib.import_module(f"{name}.multibody.benchmarks")
        acrobot = importlib.import_module(f"{name}.multibody.benchmarks.acrobot")
        plant = acrobot.MakeAcrobotPlant(acrobot.AcrobotParameters(), finalize=True)
        context = plant.CreateDefaultContext()
        plant.SetPositionsAndVelocities(context, [0.1, 0.2, 0.3, 0.4])
        plant.get_actuation_input_port().FixValue(context, [0.5])
        values = [*plant.EvalTimeDerivatives(context).CopyToVector(), plant.CalcPotentialEnergy(context)]
        for damping in (0.0, 0.3, 4.0, 9.0):
            solution = benchmarks.MassDamperSpringAnalyticalSolution(2.0, damping, 2.0)
            solution.SetInitialValue(x0=0.7, xDt0=-0.4)
            values += [f(1.3) for f in (solution.get_x, solution.get_xDt, solution.get_xDtDt)]
        return values, plant.GetStateNames(), plant.num_frames()

    ours, theirs = numbers("sheldrake"), numbers("pydrake")
    close(ours[0], theirs[0])
    assert ours[1:] == theirs[1:]
