import numpy as np
import pytest

from sheldrake.systems.analysis import Simulator
from sheldrake.systems.controllers import DynamicProgrammingOptions, FittedValueIteration, PeriodicBoundaryCondition
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


def test_errors():
    simulator, discrete = Simulator(Integrator(1)), LinearSystem([[1.0]], [[1.0]], [[1.0]], [[0.0]], 0.1)
    options = DynamicProgrammingOptions()
    options.periodic_boundary_conditions = [PeriodicBoundaryCondition(0, -1.0, 2.0)]
    for arguments, words in (
        ((simulator, away_from_zero, GRID * 2, CHOICES, STEP), "2 axes"),
        ((simulator, away_from_zero, GRID, CHOICES * 2, STEP), "input grid has 2 axes"),
        ((simulator, away_from_zero, GRID, CHOICES, 0.0), "positive"),
        ((simulator, away_from_zero, GRID, CHOICES, STEP, options), "wraps from"),
        ((Simulator(discrete), away_from_zero, GRID, CHOICES, STEP), "continuous state"),
    ):
        with pytest.raises(RuntimeError, match=words):
            FittedValueIteration(*arguments)
