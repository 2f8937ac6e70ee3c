"""Steps of implicit integrators, one at a time: the equations they solve, and what they do when they cannot."""

import numpy as np
import pytest

from sheldrake.math import RigidTransform
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import PrismaticJoint, SpatialInertia, UnitInertia
from sheldrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from sheldrake.systems.framework import DiagramBuilder, LeafSystem

IMPLICIT = ("implicit_euler", "radau1", "radau3", "velocity_implicit_euler")


class Equation(LeafSystem):
    def __init__(self, f, num_q, num_v, num_z):
        super().__init__()
        self.f, self.evaluations = f, 0
        self.DeclareContinuousState(num_q, num_v, num_z)

    def DoCalcTimeDerivatives(self, context, derivatives):
        self.evaluations += 1
        x = context.get_continuous_state_vector().CopyToVector()
        derivatives.get_mutable_vector().SetFromVector(self.f(x))


def body(plant):
    return plant.AddRigidBody("body", SpatialInertia(1.0, [0.1, 0.2, 0.0], UnitInertia(0.3, 0.4, 0.5)))


def tumbling():
    plant = MultibodyPlant(0.0)
    body(plant)
    plant.Finalize()
    return plant


def stepper(system, scheme, h, x, accuracy=1e-12):
    simulator = Simulator(system)
    integrator = ResetIntegratorFromFlags(simulator, scheme, h)
    if scheme != "semi_explicit_euler":
        integrator.set_fixed_step_mode(True)
        integrator.set_target_accuracy(accuracy)
    simulator.get_mutable_context().SetContinuousState(x)
    return simulator, integrator


def state(simulator):
    return simulator.get_context().get_continuous_state_vector().CopyToVector()


TUMBLE = np.array([1.0, 0.0, 0.0, 0.0, 0.1, 0.2, 0.3, 3.0, 1.0, 0.5, 0.1, 0.2, 0.3])


@pytest.mark.parametrize("scheme", ["implicit_euler", "velocity_implicit_euler"])
def test_two_half_steps_solve_the_equations_of_euler(scheme):
    """x1 = x0 + h f(t1, x1), of a body whose rates of positions are not its velocities."""
    plant = tumbling()
    simulator, _ = stepper(plant, scheme, 0.02, TUMBLE)
    simulator.AdvanceTo(0.02)
    end = state(simulator)
    context = plant.CreateDefaultContext()

    def f(x):
        context.SetContinuousState(x)
        return plant.EvalTimeDerivatives(context).CopyToVector()

    middle = end - 0.01 * f(end)
    np.testing.assert_allclose(middle - 0.01 * f(middle), TUMBLE, atol=1e-11)
    assert np.abs(end - 0.02 * f(end) - TUMBLE).max() > 1e-4, "one whole step is another"


def test_positions_of_several_systems_follow_their_velocities():
    """Beside the body's quaternion: a plant of one slider and an equation."""

    def diagram():
        builder = DiagramBuilder()
        builder.AddSystem(Equation(lambda x: np.array([x[2], x[3], -x[0], -x[1], -x[4]]), 2, 2, 1))
        builder.AddSystem(tumbling())
        slider = builder.AddSystem(MultibodyPlant(0.0))
        frame = body(slider).body_frame()
        slider.AddJoint(PrismaticJoint("joint", slider.world_frame(), frame, [0, 0, 1]))
        slider.Finalize()
        return builder.Build()

    x = np.concatenate([[0.1, 0.2, 0.3, 0.4, 0.5], TUMBLE, [0.6, 0.7]])
    ends = []
    for scheme in ("implicit_euler", "velocity_implicit_euler", "semi_explicit_euler"):
        simulator, _ = stepper(diagram(), scheme, 0.001, x)
        simulator.AdvanceTo(0.01)
        ends.append(state(simulator))
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-11)
    np.testing.assert_allclose(ends[2], ends[0], atol=2e-4)
    assert ends[0] == pytest.approx(x, abs=0.3) and np.abs(ends[0] - x).min() > 1e-6


def test_velocity_steps_have_half_the_unknowns():
    counts = {}
    for scheme in ("implicit_euler", "velocity_implicit_euler"):
        simulator, integrator = stepper(tumbling(), scheme, 0.02, TUMBLE)
        simulator.AdvanceTo(0.02)
        counts[scheme] = dict(integrator.GetStatisticsSummary())["integrator_num_derivative_evaluations_for_jacobian"]
    assert counts == {"implicit_euler": 14, "velocity_implicit_euler": 7}


@pytest.mark.parametrize("scheme", ["velocity_implicit_euler", "semi_explicit_euler"])
def test_who_knows_how_two_positions_follow_one_velocity(scheme):
    system = Equation(lambda x: np.array([x[2], x[2], -x[0]]), 2, 1, 0)
    simulator, _ = stepper(system, scheme, 0.1, [1.0, 2.0, 0.0])
    with pytest.raises(RuntimeError, match="2 positions and 1 velocities"):
        simulator.AdvanceTo(0.1)


def test_semi_explicit_steps_evaluate_once():
    system = Equation(lambda x: np.array([x[1], -x[0]]), 1, 1, 0)
    simulator, integrator = stepper(system, "semi_explicit_euler", 0.125, [1.0, 0.0])
    simulator.AdvanceTo(1.0)
    assert system.evaluations == integrator.get_num_derivative_evaluations() == 8
    q, v = 1.0, 0.0
    for _ in range(8):
        v -= 0.125 * q
        q += 0.125 * v
    np.testing.assert_allclose(state(simulator), [q, v], rtol=1e-15)


def wall(x):
    return np.array([-1000.0 * (x[0] - np.cos(5.0 * x[0] ** 3))])


@pytest.mark.parametrize("scheme", IMPLICIT)
def test_steps_that_fail_are_made_shorter(scheme):
    """Newton's method finds no zero from far away: steps are halved until it does, fixed or not."""
    simulator, integrator = stepper(Equation(wall, 0, 0, 1), scheme, 0.1, [3.0], 1e-3)
    simulator.AdvanceTo(0.5)
    counts = dict(integrator.GetStatisticsSummary())
    assert integrator.get_num_substep_failures() == integrator.get_num_step_shrinkages_from_substep_failures() > 0
    assert counts["integrator_num_substep_failures"] == integrator.get_num_substep_failures()
    assert integrator.get_num_steps_taken() > 5
    x = state(simulator)
    assert abs(wall(x)[0]) < 1e-3 * 1000, "it stands still in the end"
    assert simulator.get_context().get_time() == 0.5


@pytest.mark.parametrize("scheme", IMPLICIT)
def test_a_step_that_never_succeeds_is_an_error(scheme):
    def f(x):
        return np.array([np.nan if x[0] != 1.0 else 1.0])

    simulator, _ = stepper(Equation(f, 0, 0, 1), scheme, 0.1, [1.0])
    with pytest.raises(RuntimeError, match="fails even when it is"):
        simulator.AdvanceTo(0.5)
    assert simulator.get_context().get_time() == 0.0
    assert state(simulator)[0] == 1.0


@pytest.mark.parametrize("scheme", IMPLICIT)
def test_statistics_add_up(scheme, capsys):
    simulator, integrator = stepper(tumbling(), scheme, 0.05, TUMBLE, 1e-4)
    integrator.set_fixed_step_mode(False)
    simulator.AdvanceTo(0.2)
    counts = dict(integrator.GetStatisticsSummary())
    for name in ("jacobian_evaluations", "newton_raphson_iterations", "derivative_evaluations"):
        parts = [counts[f"integrator_num_{part}_{name}"] for part in ("integrator", "error_estimator")]
        assert sum(parts) == counts[f"integrator_num_{name}"] > 0
    integrator.ResetStatistics()
    assert not any(v for _, v in integrator.GetStatisticsSummary() if v == v)


def test_pose_of_the_tumbling_body_is_one():
    """Implicit steps keep quaternions near unit length."""
    plant = tumbling()
    simulator, _ = stepper(plant, "velocity_implicit_euler", 1e-3, TUMBLE)
    simulator.AdvanceTo(0.1)
    X_WB = plant.EvalBodyPoseInWorld(simulator.get_context(), plant.GetBodyByName("body"))
    assert isinstance(X_WB, RigidTransform)
    assert np.linalg.norm(state(simulator)[:4]) == pytest.approx(1.0, abs=2e-3)


def stiff_line(n):
    """A linear system whose matrices need other pivots than their diagonals, and the matrix."""
    random = np.random.default_rng(3)
    J = random.normal(size=(n, n)) - 2.0 * np.eye(n)
    J[0] = 0.0
    J[0, n - 1], J[n - 1, 0] = 400.0, -400.0
    return Equation(lambda x: J @ x, 0, 0, n), J


@pytest.mark.parametrize("scheme", IMPLICIT)
def test_steps_of_a_linear_system(scheme):
    """What the schemes say of x' = J x, solved by LAPACK."""
    n, h = 12, 0.01
    system, J = stiff_line(n)
    x = np.linspace(1.0, 2.0, n)
    simulator, _ = stepper(system, scheme, h, x)
    simulator.AdvanceTo(h)
    if "euler" in scheme:
        half = np.eye(n) - 0.5 * h * J
        expected = np.linalg.solve(half, np.linalg.solve(half, x))
    else:
        A = np.array([[1.0]] if scheme == "radau1" else [[5 / 12, -1 / 12], [3 / 4, 1 / 4]])
        M = np.eye(n * len(A)) - h * np.kron(A, J)
        expected = np.linalg.solve(M, np.tile(x, len(A)))[-n:]
    np.testing.assert_allclose(state(simulator), expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize("scheme", IMPLICIT)
def test_interpreted_steps_have_the_bits_of_native_ones(scheme):
    found = []
    for native in (True, False):
        simulator, integrator = stepper(tumbling(), scheme, 0.05, TUMBLE, 1e-4)
        simulator._native = native
        integrator.set_fixed_step_mode(False)
        simulator.AdvanceTo(0.1)
        found.append((state(simulator).tobytes(), integrator.GetStatisticsSummary()))
    assert found[0] == found[1]


@pytest.mark.parametrize("scheme", IMPLICIT)
def test_an_error_in_derivatives_ends_the_run_where_the_step_began(scheme):
    calls = []

    def f(x):
        calls.append(x)
        if len(calls) > 40:
            raise ArithmeticError("no more")
        return -x

    simulator, _ = stepper(Equation(f, 0, 0, 2), scheme, 0.1, [1.0, 2.0])
    with pytest.raises(ArithmeticError, match="no more"):
        simulator.AdvanceTo(5.0)
    t = simulator.get_context().get_time()
    assert 0.0 < t < 5.0 and len(calls) == 41
    np.testing.assert_allclose(state(simulator), np.exp(-t) * np.array([1.0, 2.0]), rtol=0.05)


def test_initialize_forgets_matrices_and_steps_go_on():
    simulator, integrator = stepper(tumbling(), "radau3", 0.05, TUMBLE)
    simulator.AdvanceTo(0.2)
    assert [M is None for M in integrator._memory()] == [False] * 4
    integrator.Initialize()
    assert [M is None for M in integrator._memory()] == [False, True, True, True]
    simulator.AdvanceTo(0.4)
    assert dict(integrator.GetStatisticsSummary())["integrator_num_jacobian_evaluations"] > 0


@pytest.mark.parametrize("spoil", [lambda M: M[:-1], lambda M: np.full_like(M, 99.0), lambda M: np.full_like(M, 0.5)])
def test_saved_matrices_that_are_none(spoil):
    simulator, integrator = stepper(tumbling(), "implicit_euler", 0.05, TUMBLE)
    simulator.AdvanceTo(0.2)
    h, jacobian, matrix, trapezoid = integrator._memory()
    with pytest.raises(ValueError, match="a matrix"):
        integrator._remember([h, jacobian, spoil(matrix), trapezoid])


@pytest.mark.parametrize("scheme", [*IMPLICIT, "semi_explicit_euler"])
@pytest.mark.parametrize("starts_late", [False, True])
def test_dense_output_begins_each_step_with_its_slope(scheme, starts_late):
    system = Equation(lambda x: np.array([x[1], -x[0]]), 1, 1, 0)
    simulator, integrator = stepper(system, scheme, 0.125, [1.0, 0.0])
    if starts_late:
        simulator.AdvanceTo(0.25)
    integrator.StartDenseIntegration()
    simulator.AdvanceTo(1.0)
    trajectory, h = integrator.StopDenseIntegration(), 1e-7
    for t in np.arange(0.25, 1.0, 0.125):
        x0, x1 = (trajectory.value(s).ravel() for s in (t, t + h))
        np.testing.assert_allclose((x1 - x0) / h, [x0[1], -x0[0]], atol=1e-5)
