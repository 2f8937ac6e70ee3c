"""Diagrams of chance of the small systems, one written in Python among them: logs, counts and states of pydrake."""

import importlib

import numpy as np
import pytest

pytest.importorskip("pydrake")

pytestmark = pytest.mark.peer

A = np.array([[-0.3, 1.0], [-1.0, -0.2]])
SCHEMES = ["runge_kutta3", "explicit_euler", "runge_kutta2", "implicit_euler", "runge_kutta5"]


def kinds(m, period):
    """Makers of systems, those that sample with a period of chance."""

    class Sampled(m.LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareVectorInputPort("u", 2)
            self.DeclareDiscreteState([0.1, 0.2])
            self.DeclarePeriodicDiscreteUpdateEvent(period(), 0.0, self.update)
            self.DeclareVectorOutputPort("y", 2, self.calc)

        def update(self, context, state):
            state.set_value(0.5 * context.get_discrete_state_vector().value() + self.get_input_port().Eval(context))

        def calc(self, context, y):
            y.SetFromVector(np.sin(context.get_discrete_state_vector().value()) + context.get_time())

    one, none = np.eye(2), np.zeros((2, 2))
    hold = m.PiecewisePolynomial.FirstOrderHold([0, 1.0], [[0, 1.0], [2, 3]])
    return [
        Sampled,
        lambda: m.Sine(1.0, 2.0, 0.3, 2),
        lambda: m.Gain([2.0, -1]),
        lambda: m.Adder(2, 2),
        lambda: m.Integrator([0.1, 0.2]),
        lambda: m.ZeroOrderHold(period(), 2),
        lambda: m.ZeroOrderHold(period(), 2, 0.02),
        lambda: m.DiscreteTimeDelay(period(), 2, 2),
        lambda: m.DiscreteDerivative(2, period(), True),
        lambda: m.DiscreteDerivative(2, period(), False),
        lambda: m.FirstOrderLowPassFilter(0.4, 2),
        lambda: m.LinearSystem(A, one, one, none),
        lambda: m.LinearSystem(A, one, one, one, period()),
        lambda: m.AffineSystem(A, one, [1, 1], one, none, [0.1, 0.1], period()),
        lambda: m.Saturation([-1.0, -2], [1, 2]),
        lambda: m.MatrixGain([[1.0, 2], [0, 1]]),
        lambda: m.TrajectorySource(hold),
        lambda: m.StateInterpolatorWithDiscreteDerivative(1, period()),
        lambda: m.DiscreteTimeIntegrator(2, period()),
        lambda: m.PidController([1.0], [2.0], [0.5]),
        lambda: m.WrapToSystem(2),
    ]


def run(library, seed):
    m, rng = importlib.import_module(f"{library}.all"), np.random.default_rng(seed)
    builder, ports = m.DiagramBuilder(), []
    make = kinds(m, lambda: [0.1, 0.05, 0.125, 0.2, 0.03][rng.integers(5)])
    for _ in range(rng.integers(3, 10)):
        system = builder.AddSystem(make[rng.integers(len(make))]())
        for i in range(system.num_input_ports()):
            port = system.get_input_port(i)
            fit = [p for p in ports if p.size() == port.size()]
            constant = np.arange(port.size()) + 0.5
            source = fit[rng.integers(len(fit))] if fit else builder.AddSystem(m.ConstantVectorSource(constant))
            builder.Connect(source if fit else source.get_output_port(), port)
        ports += [system.get_output_port(j) for j in range(system.num_output_ports())]
    logs = [m.LogVectorOutput(port, builder, [0.0, 0.1, 0.07][rng.integers(3)]) for port in ports]
    simulator = m.Simulator(builder.Build())
    scheme = SCHEMES[rng.integers(len(SCHEMES))]
    integrator = m.ResetIntegratorFromFlags(simulator, scheme, 0.04)
    if scheme in ("runge_kutta3", "runge_kutta5"):
        integrator.set_fixed_step_mode(True)
    for T in sorted(rng.uniform(0, 1.2, 3)):
        simulator.AdvanceTo(T)
        if rng.random() < 0.3:
            simulator.AdvancePendingEvents()
    context = simulator.get_context()
    found = [log.FindLog(context) for log in logs]
    numbers = [context.get_continuous_state_vector().CopyToVector()]
    numbers += [context.get_discrete_state(k).value() for k in range(context.num_discrete_state_groups())]
    numbers += [x for log in found for x in (log.sample_times(), log.data().ravel())]
    counts = (simulator.get_num_publishes(), simulator.get_num_steps_taken(), simulator.get_num_discrete_updates())
    return counts, [len(x) for x in numbers], np.concatenate(numbers)


@pytest.mark.parametrize("block", range(6))
def test_logs_counts_and_states(block):
    for seed in range(20 * block, 20 * block + 20):
        ours, theirs = run("sheldrake", seed), run("pydrake", seed)
        assert ours[:2] == theirs[:2], seed
        np.testing.assert_allclose(ours[2], theirs[2], rtol=1e-8, atol=1e-9, err_msg=str(seed))  # sums in other orders
