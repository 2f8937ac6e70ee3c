"""The discrete step of free bodies: free flight, contact, rest, statuses, and the Python twin."""

from __future__ import annotations

import numpy as np
import pytest
from free_bodies import FreeBodies, box_inertia, random_quaternion

from sheldrake import geometry as g
from sheldrake.multibody.contact_solvers._kernels import problem as codes
from sheldrake.multibody.contact_solvers._kernels.problem import Participation
from sheldrake.multibody.contact_solvers._status import explain_solver_status

CUBE = (g.Box(0.1, 0.1, 0.1), 1.0, [0.0, 0.0, 0.0], box_inertia(1.0, [0.1, 0.1, 0.1]))
BALL = (g.Sphere(0.1), 1.0, [0.0, 0.0, 0.0], 0.4 * 0.01 * np.eye(3))
APPROXIMATIONS = ("lagged", "similar", "sap", "tamsi")


def test_free_flight_is_symplectic_euler():
    scene = FreeBodies([CUBE])
    scene.q[0, 6] = 10.0
    scene.v[0, 3:] = 1.0, 2.0, 3.0
    x = scene.step(100)[-1]
    n, dt = 100, scene.dt
    np.testing.assert_allclose(x[10:], [1.0, 2.0, 3.0 - 9.81 * n * dt], rtol=1e-13)
    np.testing.assert_allclose(x[6], 10.0 + 3.0 * n * dt - 9.81 * dt**2 * n * (n + 1) / 2, rtol=1e-13)
    assert scene.work.problem.num_contacts == 0


def test_a_sliding_ball_starts_to_roll():
    """Coulomb friction mu g until rolling at 5/7 of the initial speed."""
    scene = FreeBodies([BALL])
    scene.q[0, 6] = 0.1 - 9.81 / 5e5
    scene.v[0, 3] = 1.0
    early = scene.step(40)[-1]
    np.testing.assert_allclose(early[10], 1.0 - 0.5 * 9.81 * 0.04, rtol=2e-3)
    late = scene.step(960)[-1]
    np.testing.assert_allclose(late[10], 5.0 / 7.0, rtol=1e-3)
    np.testing.assert_allclose(late[8] * 0.1, late[10], rtol=1e-3)


@pytest.mark.parametrize("approximation", APPROXIMATIONS)
def test_a_cube_comes_to_rest(approximation):
    rng = np.random.default_rng(1)
    scene = FreeBodies([CUBE], approximation=approximation)
    scene.q[0, :4] = random_quaternion(rng)
    scene.q[0, 6] = 0.12
    states = scene.step(5000)
    assert np.abs(states[-1000:, 7:10]).max() < 1e-9
    # kTamsi stops on changes of velocity, not on a residual
    assert np.abs(states[-1000:, 10:]).max() < (1e-6 if approximation == "tamsi" else 1e-9)
    assert scene.work.problem.num_contacts == 4
    assert 0.0499 < states[-1, 6] < 0.05


def test_action_equals_reaction():
    """Two bodies colliding in free fall keep their momentum."""
    rng = np.random.default_rng(2)
    scene = FreeBodies([BALL, BALL], ground=False)
    scene.q[:, :4] = [random_quaternion(rng) for _ in range(2)]
    scene.q[0, 4:], scene.q[1, 4:] = [0.0, 0.0, 1.0], [0.15, 0.05, 1.05]
    scene.v[:] = rng.normal(0, 1, (2, 6))
    scene.v[0, 3], scene.v[1, 3] = 1.0, -1.0
    before = scene.v[:, 3:].sum(axis=0)
    touched = 0
    for i in range(1, 200):
        scene.step()
        touched += scene.work.problem.num_contacts
        fallen = np.array([0.0, 0.0, -2 * 9.81 * i * scene.dt])
        np.testing.assert_allclose(scene.v[:, 3:].sum(axis=0), before + fallen, atol=1e-12)
    assert touched > 5


def test_trees_without_contact_take_their_free_motion():
    scene = FreeBodies([CUBE, BALL])
    scene.q[0, 6], scene.q[1, 4:] = 0.0499, [5.0, 0.0, 5.0]
    scene.step(3)
    assert scene.work.problem.tree[:, Participation.active].tolist() == [1, 0]
    np.testing.assert_allclose(scene.v[1], [0, 0, 0, 0, 0, -9.81 * 3e-3], rtol=1e-13)


def test_the_same_step_gives_the_same_bits():
    results = []
    for _ in range(2):
        scene = FreeBodies([CUBE, CUBE])
        rng = np.random.default_rng(3)
        scene.q[:, :4] = [random_quaternion(rng) for _ in range(2)]
        scene.q[0, 6], scene.q[1, 4:] = 0.08, [0.5, 0.0, 0.08]
        results.append(scene.step(300))
    assert (results[0] == results[1]).all()


@pytest.mark.parametrize("approximation", APPROXIMATIONS)
def test_python_twin_and_native_agree(approximation):
    scene = FreeBodies([CUBE], approximation=approximation)
    scene.q[0, :4] = [1.0, 0.01, 0.02, 0.0]
    scene.q[0, 6] = 0.0495
    scene.v[0] = [0.1, -0.2, 0.3, 0.2, 0.1, -0.3]
    before = scene.x.copy()
    native = scene.step(5)[-1]
    scene.x[:] = before
    for _ in range(5):
        assert scene.chain(**scene.arguments()) == 0
        scene.x[:] = scene.next
    np.testing.assert_allclose(scene.x, native, rtol=0, atol=1e-11)


def test_too_many_contacts_are_a_status():
    scene = FreeBodies([CUBE], capacity=2)
    scene.q[0, 6] = 0.049
    assert scene.chain.native(**scene.arguments()) == codes.CONTACT_CAPACITY
    assert "more contact points" in explain_solver_status(codes.CONTACT_CAPACITY)


def test_a_body_without_mass_is_a_status():
    scene = FreeBodies([CUBE])
    scene.p[1] = 0.0
    assert scene.chain.native(**scene.arguments()) == codes.MASS_NOT_POSITIVE


def test_every_status_is_explained():
    values = {v for k, v in vars(codes).items() if k.isupper() and isinstance(v, int) and v > 100}
    assert len(values) > 9 and all(explain_solver_status(v) for v in values)
    assert explain_solver_status(0) == ""


def test_single_point_keeps_drakes_tolerance():
    assert FreeBodies([CUBE], algorithm="single_point").solver.relative_tolerance == 1e-6
    assert FreeBodies([CUBE]).solver.relative_tolerance == 1e-9


def test_islands_do_not_touch_each_other():
    """A stack of two moves by the same bits whether or not other bodies tumble beside it."""
    rng = np.random.default_rng(6)
    alone, among = FreeBodies([CUBE, CUBE]), FreeBodies([CUBE, CUBE, CUBE, BALL])
    among.q[2:, :4] = [random_quaternion(rng) for _ in range(2)]
    among.q[2, 4:], among.q[3, 4:] = [3.0, 0.0, 0.1], [3.1, 0.05, 0.3]
    for scene in (alone, among):
        scene.q[0, 6], scene.q[1, 4:] = 0.06, [0.01, 0.02, 0.17]
        scene.v[0, 3], scene.v[1, :3] = 0.2, [0.0, 0.1, 0.3]
    islands = set()
    for _ in range(400):
        alone.step()
        among.step()
        np.testing.assert_array_equal(among.q[:2], alone.q)
        np.testing.assert_array_equal(among.v[:2], alone.v)
        islands.add(int(among.work.problem.num_islands))
    assert {2} <= islands
