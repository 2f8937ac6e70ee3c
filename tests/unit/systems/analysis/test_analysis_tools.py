"""Batches, samples, discrete approximations, dense output, configuration."""

import copy

import numpy as np
import pytest
from scipy.linalg import expm

from sheldrake.common import RandomDistribution, RandomGenerator
from sheldrake.systems.analysis import (
    ApplySimulatorConfig,
    BatchEvalTimeDerivatives,
    BatchEvalUniquePeriodicDiscreteUpdate,
    DiscreteTimeApproximation,
    ExtractSimulatorConfig,
    MonteCarloSimulation,
    PrintSimulatorStatistics,
    RandomSimulation,
    ResetIntegratorFromFlags,
    RungeKutta2Integrator,
    Simulator,
    SimulatorConfig,
)
from sheldrake.systems.framework import InputPortSelection, LeafSystem
from sheldrake.systems.primitives import AffineSystem, Integrator, LinearSystem, RandomSource

A, B = np.array([[0.0, 1.0], [-4.0, -0.1]]), np.array([[0.0], [1.0]])


class Pendulum(LeafSystem):
    """q'' = u - sin q."""

    def __init__(self):
        super().__init__()
        self.DeclareVectorInputPort("u", 1)
        self.DeclareStateOutputPort("x", self.DeclareContinuousState(1, 1, 0))

    def DoCalcTimeDerivatives(self, context, derivatives):
        q, v = context.get_continuous_state_vector().value()
        derivatives.SetFromVector([v, self.get_input_port().Eval(context)[0] - np.sin(q)])


def test_batches():
    g = np.random.default_rng(0)
    times, states, inputs = np.arange(5.0), g.normal(size=(2, 5)), g.normal(size=(1, 5))
    system = LinearSystem(A, B, np.eye(2), np.zeros((2, 1)))
    context = system.CreateDefaultContext()
    found = BatchEvalTimeDerivatives(system, context, times, states, inputs)
    np.testing.assert_allclose(found, A @ states + B @ inputs, rtol=1e-14)
    discrete = LinearSystem(A, B, np.eye(2), np.zeros((2, 1)), 0.1)
    context = discrete.CreateDefaultContext()
    found = BatchEvalUniquePeriodicDiscreteUpdate(discrete, context, times, states, inputs, num_time_steps=2)
    np.testing.assert_allclose(found, A @ (A @ states + B @ inputs) + B @ inputs, rtol=1e-13)
    with pytest.raises(RuntimeError, match=r"shape \(1, 5\), not \(1, 4\)"):
        BatchEvalTimeDerivatives(system, system.CreateDefaultContext(), times, states, inputs[:, :4])
    with pytest.raises(RuntimeError, match="no difference equation"):
        BatchEvalUniquePeriodicDiscreteUpdate(system, context, times, states, inputs)
    free = LinearSystem(A=A, B=np.zeros((2, 0)), C=np.eye(2), D=np.zeros((2, 0)))
    selection = InputPortSelection.kNoInput
    found = BatchEvalTimeDerivatives(free, free.CreateDefaultContext(), times, states, None, selection)
    np.testing.assert_allclose(found, A @ states, rtol=1e-14)


def test_samples_can_be_had_again():
    def make(generator):
        return Simulator(RandomSource(RandomDistribution.kUniform, 1, 1.0))

    def output(system, context):
        return float(system.get_output_port().Eval(context)[0])

    samples = MonteCarloSimulation(make, output, 2.5, 20, RandomGenerator(3))
    values = [s.output for s in samples]
    assert len(set(values)) == 20 and 0.0 <= min(values) and max(values) < 1.0
    again = RandomSimulation(make, output, 2.5, copy.deepcopy(samples[7].generator_snapshot))
    assert again == values[7]
    assert [s.output for s in MonteCarloSimulation(make, output, 2.5, 2)] == [
        s.output for s in MonteCarloSimulation(make, output, 2.5, 2)
    ]


def test_discrete_time_approximation():
    linear = DiscreteTimeApproximation(LinearSystem(A, B, np.eye(2), np.zeros((2, 1))), 0.1)
    np.testing.assert_allclose(linear.A(), expm(0.1 * A), rtol=1e-13)
    affine = DiscreteTimeApproximation(AffineSystem(A, B, [1.0, 2.0], np.eye(2), np.zeros((2, 1)), [0.0, 1.0]), 0.1)
    np.testing.assert_allclose(affine.f0(), np.linalg.solve(A, (expm(0.1 * A) - np.eye(2)) @ [1.0, 2.0]), rtol=1e-12)
    config = SimulatorConfig(accuracy=1e-9)
    sampled = DiscreteTimeApproximation(Pendulum(), 0.2, config)
    context = sampled.CreateDefaultContext()
    context.SetDiscreteState([0.5, 0.1])
    sampled.get_input_port().FixValue(context, [0.3])
    found = sampled.EvalUniquePeriodicDiscreteUpdate(context).value()
    original = Pendulum()
    simulator = Simulator(original)
    simulator.get_mutable_integrator().set_target_accuracy(1e-10)
    simulator.get_mutable_context().SetContinuousState([0.5, 0.1])
    original.get_input_port().FixValue(simulator.get_mutable_context(), [0.3])
    simulator.AdvanceTo(0.2)
    np.testing.assert_allclose(found, simulator.get_context().get_continuous_state_vector().value(), atol=1e-8)
    assert np.array_equal(sampled.get_output_port().Eval(context), [0.5, 0.1])
    for period, system in ((0.0, Pendulum()), (0.1, Integrator(1).ToAutoDiffXd() and LinearSystem(A, B, A, B, 0.1))):
        with pytest.raises(RuntimeError):
            DiscreteTimeApproximation(system, period)


def test_dense_output_is_continuous_and_accurate():
    system = LinearSystem(A=A, B=np.zeros((2, 0)), C=np.eye(2), D=np.zeros((2, 0)))
    simulator = Simulator(system)
    integrator = simulator.get_mutable_integrator()
    integrator.set_target_accuracy(1e-6)
    simulator.get_mutable_context().SetContinuousState([1.0, 0.0])
    with pytest.raises(RuntimeError, match="not been started"):
        integrator.StopDenseIntegration()
    integrator.StartDenseIntegration()
    simulator.AdvanceTo(1.0)
    simulator.AdvanceTo(2.0)
    kept = integrator.get_dense_output()
    assert integrator.get_dense_output() is kept
    trajectory = integrator.StopDenseIntegration()
    assert trajectory is kept
    assert (trajectory.start_time(), trajectory.end_time()) == (0.0, 2.0)
    for t in np.linspace(0.0, 2.0, 41):
        np.testing.assert_allclose(trajectory.value(t).ravel(), (expm(t * A) @ [1.0, 0.0]), atol=1e-5)
    assert integrator.get_dense_output() is None


def test_error_control_keeps_its_promise():
    for accuracy in (1e-3, 1e-5, 1e-7):
        system = LinearSystem(A=A, B=np.zeros((2, 0)), C=np.eye(2), D=np.zeros((2, 0)))
        simulator = Simulator(system)
        simulator.get_mutable_integrator().set_target_accuracy(accuracy)
        simulator.get_mutable_context().SetContinuousState([1.0, 0.0])
        simulator.AdvanceTo(1.0)
        x = simulator.get_context().get_continuous_state_vector().value()
        assert np.linalg.norm(x - expm(A) @ [1.0, 0.0]) < 30 * accuracy


def test_configuration(capsys):
    simulator = Simulator(Pendulum())
    config = SimulatorConfig(integration_scheme="runge_kutta5", max_step_size=0.02, accuracy=1e-6, start_time=1.0)
    ApplySimulatorConfig(config, simulator)
    assert repr(ExtractSimulatorConfig(simulator)) == repr(config) == repr(copy.copy(config))
    with pytest.raises(AttributeError, match="integration_scheme"):
        SimulatorConfig(scheme="runge_kutta3")
    with pytest.raises(RuntimeError, match="Unknown integration scheme: zz"):
        ResetIntegratorFromFlags(simulator, "zz", 0.1)
    simulator.get_system().get_input_port().FixValue(simulator.get_mutable_context(), [0.0])
    simulator.AdvanceTo(1.1)
    PrintSimulatorStatistics(simulator)
    text = capsys.readouterr().out
    assert "Number of time steps taken (simulator stats)" in text and "with error control" in text


def test_integrators_say_what_they_cannot_do():
    integrator = RungeKutta2Integrator(Pendulum(), 0.1)
    for call in (
        lambda: integrator.set_target_accuracy(0.1),
        lambda: integrator.set_fixed_step_mode(False),
        lambda: integrator.request_initial_step_size_target(0.1),
        integrator.Initialize,
        lambda: integrator.set_maximum_step_size(-1.0),
    ):
        with pytest.raises(RuntimeError):
            call()


def test_a_step_below_the_minimum_is_an_error():
    class Jumpy(LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareContinuousState(1)

        def DoCalcTimeDerivatives(self, context, derivatives):
            derivatives[0] = 1e6 * np.sign(np.sin(1e3 * context.get_time()))

    simulator = Simulator(Jumpy())
    integrator = simulator.get_mutable_integrator()
    integrator.set_requested_minimum_step_size(1e-3)
    with pytest.raises(RuntimeError, match="minimum step size"):
        simulator.AdvanceTo(1.0)
    integrator.set_throw_on_minimum_step_size_violation(False)
    assert simulator.AdvanceTo(0.1).succeeded()


@pytest.mark.parametrize("native", [True, False])
def test_a_rest_a_little_longer_than_the_smallest_step_is_one_step(native):
    """The step was repeated for ever: cut to the smallest, stretched to the end, found too long."""
    smallest = 2.0**-14
    system = LinearSystem([[-1.0]], [[1.0]], [[1.0]], [[0.0]])
    context = system.CreateDefaultContext()
    system.get_input_port().FixValue(context, [0.0])
    context.SetContinuousState([1e20])  # no step is accurate
    simulator = Simulator(system, context)
    simulator._native = native
    integrator = simulator.get_mutable_integrator()
    integrator.set_requested_minimum_step_size(smallest)
    integrator.set_throw_on_minimum_step_size_violation(False)
    simulator.AdvanceTo(1.0005 * smallest)
    assert context.get_continuous_state_vector()[0] == pytest.approx(1e20 * np.exp(-1.0005 * smallest))
    assert integrator.get_num_steps_taken() == 1
