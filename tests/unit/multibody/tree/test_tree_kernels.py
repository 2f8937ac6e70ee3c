"""The tree kernels against slow references, conservation laws, and themselves as plain Python."""

import numpy as np
import pytest
from benchmarks._loop import forward_dynamics
from trees import ALL_TYPES, body_poses, random_tree

import sheldrake.all as lib
from sheldrake import autodiffutils as autodiff
from sheldrake.multibody.tree._compile import Mobilizer, TreeDescription, compile_tree
from sheldrake.multibody.tree._kernels import dynamics, integrate, kinematics, queries
from sheldrake.multibody.tree._kernels import model as m


class Tree:
    """A random tree in a random state, all stages done natively."""

    def __init__(self, seed, num_bodies=9, **options):
        self.rng = rng = np.random.default_rng(seed)
        self.description, self.model, self.p, self.nq, self.nv = random_tree(rng, num_bodies, **options)
        self.work = m.make_work(self.model)
        self.q, self.v = rng.normal(size=self.nq), rng.normal(size=self.nv)
        self.update()

    def update(self):
        kinematics.position_kinematics.native(self.model, self.p, self.work, self.q)
        dynamics.body_inertias.native(self.model, self.p, self.work)
        kinematics.velocity_kinematics.native(self.model, self.p, self.work, self.q, self.v)

    def at(self, q, v=None):
        other = object.__new__(Tree)
        other.__dict__ |= self.__dict__
        other.work, other.q, other.v = m.make_work(self.model), q, self.v if v is None else v
        other.update()
        return other

    def qdot(self, v):
        out = np.zeros(self.nq)
        integrate.qdot_of_velocity(self.model, self.q, v, out)
        return out

    def mass_matrix(self):
        M = np.zeros((self.nv, self.nv))
        queries.calc_mass_matrix.native(self.model, self.p, self.work, M)
        return M

    def bias(self, gravity_scale=0.0):
        """As the kernel of the step: with gravity's force taken away gravity_scale times."""
        dynamics.bias_term(self.model, self.work, gravity_scale)
        return self.work.bias.copy()

    def velocities(self):
        out = np.zeros((len(self.model.body), 6))
        kinematics.body_velocities(self.model, self.work, out)
        return out

    def poses(self):
        bodies = [self.work[b] for b in range(len(self.work.X_WB))]
        return [np.vstack([np.c_[np.reshape(b.R_WB, (3, 3)), b.p_WB], [0, 0, 0, 1]]) for b in bodies]

    def energy(self):
        """Kinetic and potential energy [J], body by body."""
        kinetic = potential = 0.0
        for X, V, b in zip(self.poses()[1:], self.velocities()[1:], self.description.mobilizers):
            mass, *rest = self.p[b.inertia : b.inertia + 10]
            c, (xx, yy, zz, xy, xz, yz) = np.array(rest[:3]), rest[3:]
            G = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            w, v = X[:3, :3].T @ V[:3], X[:3, :3].T @ V[3:]
            kinetic += 0.5 * mass * (w @ G @ w + v @ v + 2 * v @ np.cross(w, c))
            potential -= mass * np.dot(b.gravity, X[:3, 3] + X[:3, :3] @ c)
        return kinetic, potential


seeds = pytest.mark.parametrize("seed", range(12))


@seeds
def test_poses_equal_products_of_matrices(seed):
    t = Tree(seed)
    for X, expected in zip(t.poses(), body_poses(t.description, t.p, t.q)):
        np.testing.assert_allclose(X, expected, atol=1e-12)


@seeds
def test_velocities_are_the_derivatives_of_the_poses(seed):
    t, h = Tree(seed), 1e-6
    qdot = t.qdot(t.v)
    before, after = t.at(t.q - h * qdot).poses(), t.at(t.q + h * qdot).poses()
    for X, V, X0, X1 in zip(t.poses(), t.velocities(), before, after):
        rate = (X1 - X0) / (2 * h)
        W = rate[:3, :3] @ X[:3, :3].T
        expected = [W[2, 1], W[0, 2], W[1, 0], *rate[:3, 3]]
        np.testing.assert_allclose(V, expected, atol=2e-8 * (1 + np.abs(V).max()))


@seeds
def test_bias_acceleration_is_the_derivative_of_the_velocity(seed):
    t, h = Tree(seed), 1e-6
    qdot = t.qdot(t.v)
    V0, V1 = t.at(t.q - h * qdot).velocities(), t.at(t.q + h * qdot).velocities()
    for row in range(1, len(t.model.body)):
        w, v = t.velocities()[row].reshape(2, 3)
        alpha, a = map(np.array, t.work[row].A_WB)
        p_RootB = np.subtract(t.work[row].p_WB, t.work[t.model.bodies[row].root].p_WB)
        expected = np.r_[alpha, a + np.cross(alpha, p_RootB) + np.cross(w, v)]
        np.testing.assert_allclose((V1 - V0)[row] / (2 * h), expected, atol=1e-6 * (1 + np.abs(expected).max()))


@seeds
def test_kinetic_energy_is_half_v_M_v(seed):
    t = Tree(seed)
    assert 0.5 * t.v @ t.mass_matrix() @ t.v == pytest.approx(t.energy()[0], rel=1e-13)


@seeds
def test_inverse_dynamics_is_M_vdot_plus_bias(seed):
    t = Tree(seed, actuators=True)
    vdot, tau, A = t.rng.normal(size=t.nv), np.zeros(t.nv), np.zeros((len(t.model.body), 6))
    F, applied = t.rng.normal(size=A.shape), t.rng.normal(size=t.nv)
    queries.calc_inverse_dynamics.native(t.model, t.p, t.work, vdot, F, applied, A, tau)
    given = np.zeros(t.nv)
    queries.calc_generalized_forces.native(t.model, t.work, F, given)
    expected = t.mass_matrix() @ vdot + t.bias() - given - applied
    np.testing.assert_allclose(tau, expected, atol=1e-12 * np.abs(expected).max())


@seeds
def test_coriolis_forces_do_no_work_beyond_changing_M(seed):
    """d/dt of v·M v at constant v equals twice the power of the bias (passivity)."""
    t, h = Tree(seed), 1e-6
    qdot = t.qdot(t.v)
    power = [t.v @ t.at(t.q + s * h * qdot).mass_matrix() @ t.v for s in (-1, 1)]
    rate = (power[1] - power[0]) / (2 * h)
    assert 2 * t.v @ t.bias() == pytest.approx(rate, rel=1e-6, abs=1e-6 * abs(power[0]))


@seeds
def test_gravity_force_is_minus_the_gradient_of_potential_energy(seed):
    t, h = Tree(seed), 1e-6
    tau_g = np.zeros(t.nv)
    queries.calc_gravity.native(t.model, t.work, tau_g)
    np.testing.assert_allclose(tau_g, t.bias() - t.bias(1.0), atol=1e-12 * (1 + np.abs(tau_g).max()))
    for k in range(t.nv):
        qdot = t.qdot(np.eye(t.nv)[k])
        rise = t.at(t.q + h * qdot).energy()[1] - t.at(t.q - h * qdot).energy()[1]
        assert tau_g[k] == pytest.approx(-rise / (2 * h), abs=1e-6 * (1 + np.abs(tau_g).max()))


@seeds
def test_reflected_inertia_adds_to_the_diagonal_only(seed):
    t = Tree(seed, actuators=True)
    M = t.mass_matrix()
    t.model = t.model._replace(actuator=t.model.actuator[:0])
    expected = np.zeros(t.nv)
    for k, rotor, gear in t.description.actuators:
        expected[k] += t.p[gear] ** 2 * t.p[rotor]
    np.testing.assert_allclose(M - t.mass_matrix(), np.diag(expected), atol=1e-12)


@seeds
def test_factor_solves_what_M_multiplies(seed):
    t = Tree(seed, num_bodies=14)
    M = t.mass_matrix()
    vdot, tau = np.zeros(t.nv), t.rng.normal(size=t.nv)
    status = forward_dynamics.native(t.model, t.p, t.work, t.q, t.v, tau, 0.1, vdot)
    D = np.diag(t.p[t.model.dof[:, m.Dof.damping]])
    expected = np.linalg.solve(M + 0.1 * D, tau - t.bias(1.0) - D @ t.v)
    assert status == 0
    np.testing.assert_allclose(vdot, expected, rtol=1e-9, atol=1e-10 * np.abs(expected).max())


@seeds
def test_what_is_welded_together_moves_as_one_body(seed):
    """As when every body has an inertial force of its own."""
    t = Tree(seed, num_bodies=24, types=("weld", "weld", "revolute", "prismatic", "ball_rpy"))
    own = np.arange(len(t.model.body))
    assert np.any(t.model.body[:, m.Body.carrier] != own)
    M, bias = t.mass_matrix(), t.bias(1.0)
    body = t.model.body.copy()  # which trees that are connected alike share
    body[:, m.Body.carrier] = own
    t.model = t.model._replace(body=body)
    t.update()
    np.testing.assert_allclose(M, t.mass_matrix(), atol=1e-13 * np.abs(M).max())
    np.testing.assert_allclose(bias, t.bias(1.0), atol=1e-13 * np.abs(bias).max())


def test_only_what_falls_alike_is_carried():
    g, weld = (0.0, 0.0, -9.81), (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    d = TreeDescription()
    d.mobilizers = [
        Mobilizer(0, "weld", 0, constants=weld, gravity=g),  # to the world
        Mobilizer(1, "revolute", 0, constants=(0.0, 0.0, 1.0, 0.0), damping=(0,), gravity=g),
        Mobilizer(2, "weld", 0, constants=weld, gravity=g),
        Mobilizer(3, "weld", 0, constants=weld, gravity=g),
        Mobilizer(4, "weld", 0, constants=weld),
        Mobilizer(4, "weld", 0, constants=weld, gravity=g, added_gravity=7),
    ]
    assert compile_tree(d).body[:, m.Body.carrier].tolist() == [0, 1, 2, 2, 2, 5, 6]


def test_matrix_that_is_not_positive_definite_names_its_dof():
    t = Tree(3, types=("revolute",), num_bodies=4)
    t.p[t.description.mobilizers[2].inertia] = 0.0
    t.p[t.description.mobilizers[3].inertia] = 0.0
    zero = np.zeros(t.nv)
    status = forward_dynamics.native(t.model, t.p, t.work, t.q, t.v, zero, 0.0, zero.copy())
    assert status > 0


@seeds
def test_qdot_maps_are_inverse(seed):
    t, v = Tree(seed), np.zeros(0)
    v = np.zeros(t.nv)
    integrate.velocity_of_qdot(t.model, t.q, t.qdot(t.v), v)
    np.testing.assert_allclose(v, t.v, atol=1e-12)


@seeds
def test_integration_is_q_plus_dt_qdot_even_in_place(seed):
    t = Tree(seed)
    expected, q = t.q + 0.01 * t.qdot(t.v), t.q.copy()
    integrate.integrate_positions(t.model, q, t.v, 0.01, q)
    np.testing.assert_allclose(q, expected, atol=1e-14)


@seeds
def test_plain_python_gives_the_same_numbers(seed):
    t = Tree(seed, num_bodies=6, actuators=True)
    tau, native, python = t.rng.normal(size=t.nv), np.zeros(t.nv), np.zeros(t.nv)
    forward_dynamics.native(t.model, t.p, t.work, t.q, t.v, tau, 0.0, native)
    forward_dynamics(t.model, t.p, m.make_work(t.model), t.q, t.v, tau, 0.0, python)
    np.testing.assert_allclose(native, python, rtol=1e-9, atol=1e-9)


def test_free_motion_of_a_floating_chain_conserves_energy_with_second_order_error():
    """Halving the step of a time-symmetric integrator divides the energy error by four."""
    errors = []
    for steps in (200, 400):
        rng = np.random.default_rng(5)
        d, model, p, nq, nv = random_tree(rng, 4, types=("revolute",))
        t = object.__new__(Tree)
        t.description, t.model, t.p, t.nq, t.nv, t.work = d, model, p, nq, nv, m.make_work(model)
        p[model.dof[:, m.Dof.damping]] = 0.0
        t.q, t.v, dt = rng.normal(size=nq), rng.normal(size=nv), 0.2 / steps
        t.update()
        start, a = sum(t.energy()), np.zeros(nv)
        for _ in range(steps):
            v0, q0 = t.v.copy(), t.q.copy()
            for c in (0.5, 1.0):
                forward_dynamics.native(model, p, t.work, t.q, t.v, np.zeros(nv), 0.0, a)
                t.q, t.v = q0 + c * dt * (t.v if c == 1.0 else v0), v0 + c * dt * a
        t.update()
        errors.append(abs(sum(t.energy()) - start))
    assert np.log2(errors[0] / errors[1]) > 1.8


def test_kernels_take_other_scalars():
    """Derivatives of the mass matrix through dual numbers equal finite differences."""
    t = Tree(2, num_bodies=4)
    q = autodiff.InitializeAutoDiff(t.q).ravel()
    work = m.make_work(t.model, dtype=object)
    kinematics.position_kinematics(t.model, t.p, work, q)
    dynamics.body_inertias(t.model, t.p, work)
    dynamics.mass_matrix(t.model, t.p, work, work.M)
    gradient = autodiff.ExtractGradient(work.M.reshape(-1, 1))
    h = 1e-6
    for k in range(t.nq):
        e = h * np.eye(t.nq)[k]
        plus, minus = t.at(t.q + e), t.at(t.q - e)
        plus.mass_matrix(), minus.mass_matrix()
        np.testing.assert_allclose(gradient[:, k], (plus.work.M - minus.work.M) / (2 * h), atol=1e-5)


def test_one_of_every_joint_type_is_covered():
    seen = {b.type_name for seed in range(12) for b in Tree(seed).description.mobilizers}
    assert seen == set(ALL_TYPES)


def test_body_before_its_parent_is_an_error():
    with pytest.raises(ValueError, match="before its inboard body"):
        compile_tree(TreeDescription([Mobilizer(parent=2, type_name="weld", inertia=0)]))


def test_trees_must_be_contiguous():
    axis = dict(type_name="revolute", inertia=0, constants=(0, 0, 1, 0), damping=(0,))
    rows = [Mobilizer(parent=0, **axis), Mobilizer(parent=0, **axis), Mobilizer(parent=1, **axis)]
    with pytest.raises(ValueError, match="apart from"):
        compile_tree(TreeDescription(rows))


def welded_chain(offset_of_frame):
    """A swinging body, a link without mass welded beside it, and one with mass; offsets in frames or in the welds."""
    plant = lib.MultibodyPlant(1e-3)
    X = lib.RigidTransform(lib.RollPitchYaw(0.3, -0.2, 0.5), [0.1, 0.2, -0.3])
    inertia = lib.SpatialInertia.SolidBoxWithMass(2.0, 0.1, 0.2, 0.3)
    bodies = [
        plant.AddRigidBody("swinging", inertia),
        plant.AddRigidBody("massless", lib.SpatialInertia.Zero()),
        plant.AddRigidBody("heavy", inertia),
    ]
    plant.AddJoint(lib.BallRpyJoint("ball", plant.world_frame(), bodies[0].body_frame()))
    for k in range(2):
        frame, X_FM = bodies[k].body_frame(), X
        if offset_of_frame:
            frame, X_FM = plant.AddFrame(lib.FixedOffsetFrame(f"offset{k}", frame, X)), lib.RigidTransform()
        plant.AddJoint(lib.WeldJoint(f"weld{k}", frame, bodies[k + 1].body_frame(), X_FM))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, [0.3, 0.4, -0.5, 1.0, -2.0, 3.0])
    poses = [plant.EvalBodyPoseInWorld(context, body).GetAsMatrix34() for body in bodies]
    return np.concatenate([*map(np.ravel, poses), plant.CalcBiasTerm(context), plant.CalcMassMatrix(context).ravel()])


def test_a_weld_at_an_offset_frame_is_a_weld_at_an_offset():
    np.testing.assert_allclose(welded_chain(True), welded_chain(False), rtol=1e-14, atol=1e-15)


def test_trees_that_are_connected_alike_share_what_numbers_their_bodies():
    def tree(axis, kind="revolute"):
        return compile_tree(TreeDescription([Mobilizer(0, kind, 0, constants=(*axis, 0.0), damping=(3,))]))

    one, other, along_x, slider = (
        tree((0, 0.6, 0.8)),
        tree((0, 0.8, 0.6)),
        tree((1, 0, 0)),
        tree((1, 0, 0), "prismatic"),
    )
    assert one.body is other.body
    assert one.joint[1, :3].tolist() == [0, 0.6, 0.8]
    assert other.joint[1, :3].tolist() == [0, 0.8, 0.6]
    assert [t.body[1, m.Body.along] for t in (one, along_x)] == [0, 1]
    assert slider.body[1, m.Body.kind] != along_x.body[1, m.Body.kind]
    with pytest.raises(ValueError, match="read-only"):
        one.dof[0, 0] = 1
