import numpy as np
import pytest

from sheldrake.systems.analysis import Simulator
from sheldrake.systems.controllers import (
    DiscreteTimeLinearQuadraticRegulator,
    LinearQuadraticRegulator,
    PidControlledSystem,
    PidController,
)
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import AffineSystem, ConstantVectorSource, LinearSystem, LogVectorOutput

RNG = np.random.default_rng(11)


def double_integrators(n, period=0.0):
    A = np.block([[np.zeros((n, n)), np.eye(n)], [np.zeros((n, n)), np.zeros((n, n))]])
    B = np.vstack([np.zeros((n, n)), np.eye(n)])
    if period:
        A, B = np.eye(2 * n) + period * A, period * B
    return LinearSystem(A, B, np.eye(2 * n), np.zeros((2 * n, n)), period)


@pytest.mark.parametrize("projected", [False, True])
def test_pid_law(projected):
    n = 2
    kp, ki, kd = RNG.normal(size=(3, n))
    P, O = RNG.normal(size=(2 * n, 5)), RNG.normal(size=(3, n))
    pid = PidController(P, O, kp, ki, kd) if projected else PidController(kp=kp, ki=ki, kd=kd)
    if not projected:
        P, O = np.eye(2 * n), np.eye(n)
    context = pid.CreateDefaultContext()
    x, desired, integral = RNG.normal(size=P.shape[1]), RNG.normal(size=2 * n), RNG.normal(size=n)
    pid.get_input_port_estimated_state().FixValue(context, x)
    pid.get_input_port_desired_state().FixValue(context, desired)
    context.SetContinuousState(integral)
    e = desired - P @ x
    np.testing.assert_allclose(
        pid.get_output_port_control().Eval(context), O @ (kp * e[:n] + ki * integral + kd * e[n:]), rtol=1e-13
    )
    np.testing.assert_allclose(pid.EvalTimeDerivatives(context).CopyToVector(), e[:n], rtol=1e-13)
    np.testing.assert_array_equal(pid.get_Ki_vector(), ki)


def test_pid_in_other_scalars():
    pid = PidController([2.0], [3.0], [4.0])
    symbolic = pid.ToSymbolic()
    context = symbolic.CreateDefaultContext()
    from sheldrake.symbolic import MakeVectorContinuousVariable

    x, d = MakeVectorContinuousVariable(2, "x"), MakeVectorContinuousVariable(2, "d")
    symbolic.get_input_port(0).FixValue(context, x * 1)
    symbolic.get_input_port(1).FixValue(context, d * 1)
    y = symbolic.get_output_port(0).Eval(context)[0]
    assert y.Evaluate({x[0]: 1.0, x[1]: 2.0, d[0]: 3.0, d[1]: 5.0}) == pytest.approx(2.0 * 2 + 4.0 * 3)


def test_pid_errors():
    for wrong, error in (
        (lambda: PidController([1.0], [1.0, 2.0], [1.0]), RuntimeError),
        (lambda: PidController(np.ones((3, 6)), [1.0, 1.0], [0.0, 0.0], [0.0, 1.0]), RuntimeError),
        (lambda: PidController(np.ones((4, 6)), np.ones((3, 3)), [1.0, 1], [0.0, 0], [0.0, 1]), RuntimeError),
        (lambda: PidController(1.0, 1.0, 1.0), TypeError),
        (lambda: PidController([1.0]), TypeError),
    ):
        with pytest.raises(error):
            wrong()


def test_a_controlled_plant_reaches_its_goal():
    builder = DiagramBuilder()
    system = builder.AddSystem(PidControlledSystem(double_integrators(2), kp=4.0, ki=0.5, kd=4.0))
    goal = builder.AddSystem(ConstantVectorSource([1.0, -2.0, 0.0, 0.0]))
    push = builder.AddSystem(ConstantVectorSource([0.3, 0.0]))
    builder.Connect(goal.get_output_port(), system.get_state_input_port())
    builder.Connect(push.get_output_port(), system.get_control_input_port())
    log = LogVectorOutput(system.get_state_output_port(), builder)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(60.0)
    final = log.FindLog(simulator.get_context()).data()[:, -1]
    np.testing.assert_allclose(final, [1.0, -2.0, 0.0, 0.0], atol=1e-3)  # the integral removes the push
    names = [system.get_input_port(i).get_name() for i in range(2)]
    assert names == ["feedforward_control", "desired_state"]
    with pytest.raises(TypeError):
        PidControlledSystem(double_integrators(1), 1.0)


def test_lqr_solves_its_riccati_equation():
    A, B = RNG.normal(size=(4, 4)), RNG.normal(size=(4, 2))
    Q, R, N = np.eye(4) * 3.0, np.diag([1.0, 2.0]), 0.1 * RNG.normal(size=(4, 2))
    K, S = LinearQuadraticRegulator(A, B, Q, R, N)
    residual = A.T @ S + S @ A - (S @ B + N) @ np.linalg.inv(R) @ (B.T @ S + N.T) + Q
    np.testing.assert_allclose(residual, 0.0, atol=1e-9)
    assert np.linalg.eigvals(A - B @ K).real.max() < 0.0 and np.linalg.eigvalsh(S).min() > 0.0
    K, S = DiscreteTimeLinearQuadraticRegulator(A, B, Q, R, N)
    gain = np.linalg.inv(R + B.T @ S @ B) @ (B.T @ S @ A + N.T)
    np.testing.assert_allclose(K, gain, rtol=1e-9)
    np.testing.assert_allclose(A.T @ S @ A - (A.T @ S @ B + N) @ gain + Q, S, rtol=1e-8)
    assert np.abs(np.linalg.eigvals(A - B @ K)).max() < 1.0


def test_lqr_with_constraints_controls_what_moves():
    A, B, F = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]])
    K, S = LinearQuadraticRegulator(A=A, B=B, Q=np.eye(2), R=np.eye(1), F=F)
    np.testing.assert_allclose(K, [[0.0, 1.0]], atol=1e-12)
    np.testing.assert_allclose(S, np.diag([0.0, 1.0]), atol=1e-12)


@pytest.mark.parametrize("period", [0.0, 0.1])
def test_regulators_as_systems(period):
    plant = double_integrators(1, period)
    Q, R = np.eye(2), np.eye(1)
    solve = DiscreteTimeLinearQuadraticRegulator if period else LinearQuadraticRegulator
    K = solve(plant.A(), plant.B(), Q, R)[0]
    regulator = LinearQuadraticRegulator(plant, Q, R)
    assert isinstance(regulator, LinearSystem)
    np.testing.assert_allclose(regulator.D(), -K)
    context = plant.CreateDefaultContext()
    plant.get_input_port().FixValue(context, [0.0])
    about = LinearQuadraticRegulator(plant, context, Q, R)
    assert isinstance(about, AffineSystem)
    np.testing.assert_allclose(about.D(), -K, rtol=1e-9)
    np.testing.assert_allclose(about.y0(), 0.0, atol=1e-12)


def test_lqr_errors():
    A, B, Q, R = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]]), np.eye(2), np.eye(1)
    for wrong, words in (
        ((A, B, Q, -R), "positive definite"),
        ((A, 0 * B, Q, R), "stabilizable"),
        ((A, B, np.eye(3), R), "2 x 2"),
        ((A, B, np.array([[1.0, 2.0], [0.0, 1.0]]), R), "symmetric"),
        ((A, B, Q, R, np.eye(2)), "2 x 1"),
    ):
        with pytest.raises(RuntimeError, match=words):
            LinearQuadraticRegulator(*wrong)


def test_modes_that_no_cost_sees_must_decay_by_themselves():
    A, B = [[0.0, 1.0], [0.0, 0.0]], [[0.0], [1.0]]
    with pytest.raises(RuntimeError, match="no stabilizing solution"):
        LinearQuadraticRegulator(A, B, np.diag([0.0, 1.0]), np.eye(1))  # no cost knows where it is
    LinearQuadraticRegulator(A, B, np.diag([1e-9, 0.0]), np.eye(1))
    with pytest.raises(RuntimeError, match="no stabilizing solution"):
        DiscreteTimeLinearQuadraticRegulator(np.eye(2), np.eye(2), np.zeros((2, 2)), np.eye(2))
