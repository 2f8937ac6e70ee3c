import numpy as np
import pytest

from sheldrake.systems.analysis import Simulator
from sheldrake.systems.controllers import (
    DynamicProgrammingOptions,
    FittedValueIteration,
    LinearQuadraticRegulator,
    PeriodicBoundaryCondition,
)
from sheldrake.systems.primitives import Integrator, LinearSystem

GRID, CHOICES, STEP = [set(np.linspace(-2.0, 2.0, 17))], [{-1.0, 0.0, 1.0}], 0.25


def away_from_zero(context):
    return 0.0 if abs(context.get_continuous_state_vector()[0]) < 1e-9 else 1.0


def test_minimum_time_of_an_integrator():
    """From x the way to zero takes |x| at speed 1, and grid and step make that exact."""
    policy, to_go = FittedValueIteration(Simulator(Integrator(1)), away_from_zero, GRID, CHOICES, STEP)
    x = np.linspace(-2.0, 2.0, 17)
    np.testing.assert_allclose(to_go, np.abs(x), atol=1e-12)
    np.testing.assert_array_equal(policy.get_output_values()[0], -np.sign(x))
    context = policy.CreateDefaultContext()
    policy.get_input_port().FixValue(context, [1.5])
    assert policy.get_output_port().Eval(context)[0] == -1.0


def test_discount_and_periodic_states():
    options = DynamicProgrammingOptions()
    options.discount_factor = 0.9
    options.convergence_tol = 1e-9
    options.periodic_boundary_conditions = [PeriodicBoundaryCondition(state_index=0, low=-2.0, high=2.0)]
    calls = []
    options.visualization_callback = lambda i, mesh, costs, policy: calls.append((i, costs.shape, policy.shape))

    def away_from_one(context):
        return 0.0 if abs(context.get_continuous_state_vector()[0] - 1.0) < 1e-9 else 1.0

    _, to_go = FittedValueIteration(Simulator(Integrator(1)), away_from_one, GRID, CHOICES, STEP, options)
    x = np.linspace(-2.0, 2.0, 17)
    steps = np.minimum(np.abs(x - 1.0), 4.0 - np.abs(x - 1.0)) / STEP  # the shorter way around
    np.testing.assert_allclose(to_go, STEP * (1.0 - 0.9**steps) / (1.0 - 0.9), rtol=1e-6)
    assert calls[0] == (1, (17,), (1, 17)) and [c[0] for c in calls] == list(range(1, len(calls) + 1))


def test_steps_in_machine_code_lead_where_those_of_a_simulator_with_a_monitor_do():
    """The monitor is Python, so that each step is one of the simulator; more states than worlds at a time."""
    found = []
    for watched in (False, True):
        simulator = Simulator(LinearSystem(A, B, np.eye(2), np.zeros((2, 1))))
        simulator.get_mutable_integrator().request_initial_step_size_target(0.003)
        simulator.get_mutable_integrator().set_target_accuracy(1e-6)
        if watched:
            simulator.set_monitor(lambda context: None)
        grid, rates = np.linspace(-1.0, 1.0, 41), np.linspace(-1.0, 1.0, 31)
        options = DynamicProgrammingOptions(discount_factor=0.5)
        arguments = simulator, away_from_zero, [set(grid), set(rates)], CHOICES, 0.1, options
        policy, to_go = FittedValueIteration(*arguments)
        found.append(np.vstack([policy.get_output_values(), to_go]))
    assert len(to_go) > 1024 and np.ptp(to_go) > 0.1
    np.testing.assert_array_equal(found[0], found[1])


def test_errors():
    simulator, discrete = Simulator(Integrator(1)), LinearSystem([[1.0]], [[1.0]], [[1.0]], [[0.0]], 0.1)
    options = DynamicProgrammingOptions()
    options.periodic_boundary_conditions = [PeriodicBoundaryCondition(0, -1.0, 2.0)]
    for arguments, words in (
        ((simulator, away_from_zero, GRID * 2, CHOICES, STEP), "2 states"),
        ((simulator, away_from_zero, GRID, CHOICES * 2, STEP), "2 inputs are given"),
        ((simulator, away_from_zero, GRID, CHOICES, 0.0), "positive"),
        ((simulator, away_from_zero, GRID, CHOICES, STEP, options), "wraps from"),
        ((Simulator(discrete), away_from_zero, GRID, CHOICES, STEP), "continuous state"),
    ):
        with pytest.raises(RuntimeError, match=words):
            FittedValueIteration(*arguments)


A, B = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]])


def quadratic_cost_to_go(library, discount=1.0, x=None, u=None):
    """P of x'Px for the double integrator with cost x'x + u'u, by the linear program of a library."""
    import importlib

    controllers, primitives, analysis = (
        importlib.import_module(f"{library}.systems.{m}") for m in ("controllers", "primitives", "analysis")
    )
    simulator = analysis.Simulator(primitives.LinearSystem(A, B, np.eye(2), np.zeros((2, 1))))
    system = simulator.get_system()

    def cost(context):
        x = context.get_continuous_state_vector().CopyToVector()
        u = system.get_input_port(0).Eval(context)
        return float(x @ x + u @ u)

    def to_go(x, p):
        return p[0] * x[0] ** 2 + 2.0 * p[1] * x[0] * x[1] + p[2] * x[1] ** 2

    options = controllers.DynamicProgrammingOptions()
    options.discount_factor = discount
    grid = np.linspace(-1.0, 1.0, 7)
    samples = np.array(np.meshgrid(grid, grid)).reshape(2, -1) if x is None else x
    inputs = np.linspace(-3.0, 3.0, 61)[None] if u is None else u
    solve = controllers.LinearProgrammingApproximateDynamicProgramming
    return solve(simulator, cost, to_go, 3, samples, inputs, 0.01, options)


def test_linear_program_gives_the_riccati_solution():
    """Up to the steps in time and between inputs."""
    _, P = LinearQuadraticRegulator(A, B, np.eye(2), np.eye(1))
    np.testing.assert_allclose(quadratic_cost_to_go("sheldrake"), [P[0, 0], P[0, 1], P[1, 1]], rtol=0.02)


@pytest.mark.peer
def test_linear_program_equals_pydrakes():
    pytest.importorskip("pydrake")
    x, u = np.random.default_rng(0).uniform(-1, 1, (2, 12)), np.linspace(-2, 2, 9)[None]
    found = [quadratic_cost_to_go(name, 0.95, x, u) for name in ("sheldrake", "pydrake")]
    np.testing.assert_allclose(*found, rtol=1e-5, atol=1e-7)


def test_errors_of_the_linear_program():
    with pytest.raises(RuntimeError, match="1 states are given"):
        quadratic_cost_to_go("sheldrake", x=np.zeros((1, 3)))
    with pytest.raises(RuntimeError, match="2 inputs are given"):
        quadratic_cost_to_go("sheldrake", u=np.zeros((2, 3)))
    with pytest.raises(RuntimeError, match="no solution"):
        quadratic_cost_to_go("sheldrake", x=np.ones((2, 1)), u=np.zeros((1, 0)))
