"""The small systems beside Drake's: ports, states, values."""

import numpy as np
import pytest

from sheldrake import math, symbolic, trajectories
from sheldrake.common import value as values
from sheldrake.systems import framework, primitives

pytest.importorskip("pydrake")
pytestmark = pytest.mark.peer


class Library:
    def __init__(self, *modules):
        self._modules = modules

    def __getattr__(self, name):
        for module in self._modules:
            if hasattr(module, name):
                return getattr(module, name)
        raise AttributeError(name)


OURS = Library(framework, primitives, values, trajectories, symbolic, math)


@pytest.fixture(scope="module")
def drake():
    import pydrake.common.value
    import pydrake.math
    import pydrake.symbolic
    import pydrake.systems.framework
    import pydrake.systems.primitives
    import pydrake.trajectories

    systems = pydrake.systems
    others = (pydrake.common.value, pydrake.trajectories, pydrake.symbolic, pydrake.math)
    return Library(systems.framework, systems.primitives, *others)


A, B, C = np.array([[0.5, 0.1], [-0.3, 0.7]]), np.array([[1.0], [2.0]]), np.array([[1.0, -1.0]])
D, F0, Y0 = np.array([[0.25]]), [0.1, 0.2], [0.3]

SYSTEMS = {
    "Adder": lambda m: m.Adder(2, 3),
    "AffineSystem": lambda m: m.AffineSystem(A=A, B=B, f0=F0, C=C, D=D, y0=Y0),
    "AffineSystem discrete": lambda m: m.AffineSystem(A=A, B=B, f0=F0, C=C, D=D, y0=Y0, time_period=0.1),
    "LinearSystem": lambda m: m.LinearSystem(A, B, C, np.zeros((1, 1)), 0.1),
    "LinearSystem without input": lambda m: m.LinearSystem(A=A, B=np.zeros((2, 0)), C=C, D=np.zeros((1, 0))),
    "MatrixGain": lambda m: m.MatrixGain(np.arange(6.0).reshape(2, 3)),
    "ConstantVectorSource": lambda m: m.ConstantVectorSource([1.0, 2.0]),
    "ConstantValueSource": lambda m: m.ConstantValueSource(m.Value("text")),
    "Demultiplexer": lambda m: m.Demultiplexer(4, 2),
    "Demultiplexer of sizes": lambda m: m.Demultiplexer(output_ports_sizes=[1, 2]),
    "Multiplexer": lambda m: m.Multiplexer([1, 2]),
    "Multiplexer of scalars": lambda m: m.Multiplexer(3),
    "DiscreteDerivative": lambda m: m.DiscreteDerivative(2, 0.1),
    "DiscreteDerivative at once": lambda m: m.DiscreteDerivative(2, 0.1, False),
    "DiscreteTimeDelay": lambda m: m.DiscreteTimeDelay(0.1, 2, 2),
    "DiscreteTimeIntegrator": lambda m: m.DiscreteTimeIntegrator(2, 0.1),
    "FirstOrderLowPassFilter": lambda m: m.FirstOrderLowPassFilter([0.5, 2.0]),
    "Gain": lambda m: m.Gain([2.0, -1.0]),
    "Integrator": lambda m: m.Integrator([1.0, 2.0]),
    "PassThrough": lambda m: m.PassThrough(2),
    "PassThrough abstract": lambda m: m.PassThrough(m.Value("text")),
    "Saturation": lambda m: m.Saturation([-1.0, 0.0], [1.0, 0.5]),
    "Sine": lambda m: m.Sine([1.0, 2.0], [3.0, 4.0], [0.1, 0.2], True),
    "Sine of input": lambda m: m.Sine(1.5, 2.0, 0.3, 2, False),
    "StateInterpolatorWithDiscreteDerivative": lambda m: m.StateInterpolatorWithDiscreteDerivative(2, 0.1),
    "TrajectorySource": lambda m: m.TrajectorySource(
        m.PiecewisePolynomial.FirstOrderHold([0.0, 1.0], np.array([[0.0, 2.0], [1.0, 3.0]])), 1
    ),
    "WrapToSystem": lambda m: wrapped(m),
    "ZeroOrderHold": lambda m: m.ZeroOrderHold(0.1, 2, 0.05),
    "SymbolicVectorSystem": lambda m: pendulum(m),
    "BarycentricMeshSystem": lambda m: m.BarycentricMeshSystem(
        m.BarycentricMesh([{0.0, 1.0, 2.0}, {-1.0, 1.0}]), np.arange(12.0).reshape(2, 6) ** 2
    ),
}


def wrapped(m):
    system = m.WrapToSystem(2)
    system.set_interval(1, -1.0, 2.0)
    return system


def pendulum(m):
    q, v, u = m.Variable("q"), m.Variable("v"), m.Variable("u")
    return m.SymbolicVectorSystem(state=[q, v], input=[u], dynamics=[v, -m.sin(q) + u], output=[q + v])


def shape(system):
    """What can be counted and named."""
    ports = [
        [(p.get_name(), p.size(), p.get_data_type().name) for p in map(get, range(count))]
        for get, count in (
            (system.get_input_port, system.num_input_ports()),
            (system.get_output_port, system.num_output_ports()),
        )
    ]
    counts = [
        getattr(system, f"num_{what}")()
        for what in (
            "continuous_states",
            "discrete_state_groups",
            "abstract_states",
            "numeric_parameter_groups",
            "abstract_parameters",
        )
    ]
    through = [
        (i, j)
        for i in range(system.num_input_ports())
        for j in range(system.num_output_ports())
        if system.HasDirectFeedthrough(i, j)
    ]
    period = system.GetUniquePeriodicDiscreteUpdateAttribute()
    times = None if period is None else (period.period_sec(), period.offset_sec())
    kind = (system.IsDifferenceEquationSystem(), system.IsDifferentialEquationSystem())
    return ports, counts, through, times, kind


def numbers(system, seed):
    """Outputs, derivatives and updates at a random state and input."""
    g = np.random.default_rng(seed)
    context = system.CreateDefaultContext()
    context.SetTime(g.uniform(0.0, 1.0))
    for i in range(system.num_input_ports()):
        port = system.get_input_port(i)
        port.FixValue(context, g.normal(size=port.size()) if port.size() else "given")
    if context.num_continuous_states():
        context.SetContinuousState(g.normal(size=context.num_continuous_states()))
    for k in range(context.num_discrete_state_groups()):
        group = context.get_mutable_discrete_state(k)
        group.SetFromVector(g.normal(size=group.size()))
    found = [system.get_output_port(j).Eval(context) for j in range(system.num_output_ports())]
    if context.num_continuous_states():
        found.append(system.EvalTimeDerivatives(context).CopyToVector())
    if system.GetUniquePeriodicDiscreteUpdateAttribute() is not None:
        update = system.EvalUniquePeriodicDiscreteUpdate(context)
        found += [update.get_vector(k).CopyToVector() for k in range(update.num_groups())]
    return found


@pytest.mark.parametrize("name", SYSTEMS)
def test_ports_states_and_values(drake, name):
    ours, theirs = SYSTEMS[name](OURS), SYSTEMS[name](drake)
    assert shape(ours) == shape(theirs)
    for seed in range(3):
        for a, b in zip(numbers(ours, seed), numbers(theirs, seed)):
            if isinstance(b, str):
                assert a == b
            else:
                np.testing.assert_allclose(a, b, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("discrete", [False, True])
def test_linearization(drake, discrete):
    found = []
    for m in (OURS, drake):
        q, v, u = m.Variable("q"), m.Variable("v"), m.Variable("u")
        system = m.SymbolicVectorSystem(
            state=[q, v], input=[u], dynamics=[v, -m.sin(q) * v + u * u], output=[q * v], time_period=0.1 * discrete
        )
        context = system.CreateDefaultContext()
        (context.SetDiscreteState if discrete else context.SetContinuousState)([0.5, 2.0])
        system.get_input_port().FixValue(context, [3.0])
        t = m.FirstOrderTaylorApproximation(system, context)
        found.append([t.A(), t.B(), t.f0(), t.C(), t.D(), t.y0()])
        with pytest.raises(RuntimeError, match="not an equilibrium"):
            m.Linearize(system, context)
        linear = m.LinearSystem(t.A(), t.B(), t.C(), t.D())
        found[-1] += [m.ControllabilityMatrix(linear), m.ObservabilityMatrix(linear)]
        found[-1] += [m.IsControllable(linear), m.IsObservable(linear), m.IsStabilizable(linear)]
    for a, b in zip(*found):
        np.testing.assert_allclose(a, b, rtol=1e-13, atol=1e-13)


def test_random_source_draws_the_same_numbers(drake):
    import pydrake.common
    import pydrake.systems.analysis

    from sheldrake.common import RandomDistribution, RandomGenerator
    from sheldrake.systems.analysis import Simulator

    found = []
    for m, common, simulate in (
        (OURS, (RandomDistribution, RandomGenerator), Simulator),
        (
            drake,
            (pydrake.common.RandomDistribution, pydrake.common.RandomGenerator),
            pydrake.systems.analysis.Simulator,
        ),
    ):
        source = m.RandomSource(common[0].kUniform, 2, 0.1)
        context = source.CreateDefaultContext()
        source.SetRandomContext(context, common[1](7))
        samples = [source.get_output_port().Eval(context)]
        simulator = simulate(source, context)
        for k in range(3):
            simulator.AdvanceTo(0.1 * k + 0.05)
            samples.append(source.get_output_port().Eval(context))
        found.append(np.array(samples))
    assert np.array_equal(*found)


def perceptron(m, periodic):
    kinds = m.PerceptronActivationType
    if periodic:
        return m.MultilayerPerceptron([True, False], [3, 1], [kinds.kTanh, kinds.kReLU])
    return m.MultilayerPerceptron([2, 4, 3, 1], [kinds.kTanh, kinds.kReLU, kinds.kIdentity])


@pytest.mark.parametrize("periodic", [False, True])
def test_perceptron(drake, periodic):
    found = []
    for m in (OURS, drake):
        g = np.random.default_rng(1)
        network = perceptron(m, periodic)
        context = network.CreateDefaultContext()
        network.SetParameters(context, g.normal(size=network.num_parameters()))
        network.SetBiases(context, 0, g.normal(size=len(network.GetBiases(context, 0))))
        X, wanted = g.normal(size=(2, 6)), g.normal(size=(1, 6))
        network.get_input_port().FixValue(context, X[:, 0])
        Y, slopes = np.zeros((1, 6), order="F"), np.zeros((2, 6), order="F")
        network.BatchOutput(context, X, Y, slopes)
        gradient = np.zeros(network.num_parameters())
        loss = network.BackpropagationMeanSquaredError(context, X, wanted, gradient)
        found.append([network.layers(), network.get_output_port().Eval(context), Y, slopes, loss, gradient])
        found[-1] += [network.GetWeights(context, 1), network.BatchOutput(context, X)]
    for a, b in zip(*found):
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-12)


def test_density_of_a_linear_transform(drake):
    import pydrake.common

    from sheldrake.common import RandomDistribution

    found = []
    for m, distributions in ((OURS, RandomDistribution), (drake, pydrake.common.RandomDistribution)):
        system = m.LinearTransformDensity(distributions.kGaussian, 2, 2)
        context = system.CreateDefaultContext()
        system.FixConstantA(context, np.array([[1.0, 2.0], [3.0, 5.5]]))
        system.get_input_port_w_in().FixValue(context, [0.1, 0.2])
        found.append([port.Eval(context) for port in (system.get_output_port(0), system.get_output_port(1))])
        system.FixConstantB(context, [1.0, 2.0])
        found[-1] += [system.get_output_port(0).Eval(context), system.CalcDensity(context)]
    for a, b in zip(*found):
        np.testing.assert_allclose(a, b, rtol=1e-13)


def affine_kinds(library):
    """An affine, a linear discrete and a time-varying system of two states."""
    one, two, column = np.eye(2), np.zeros((2, 1)), np.ones((2, 1))
    of_time = [library.PiecewisePolynomial(m) for m in (one, column, column, one, two, column)]
    return [
        library.AffineSystem(one, two, np.zeros(2), one, two, np.zeros(2)),
        library.LinearSystem(one, two, one, two, 0.1),
        library.TrajectoryAffineSystem(*of_time),
    ]


@pytest.mark.parametrize("kind", range(3))
def test_random_states_of_affine_systems_are_the_same(drake, kind):
    from pydrake.common import RandomGenerator as TheirGenerator

    from sheldrake.common import RandomGenerator

    states = []
    for library, Generator in ((OURS, RandomGenerator), (drake, TheirGenerator)):
        system = affine_kinds(library)[kind]
        system.configure_default_state([5.0, 6.0])
        system.configure_random_state(np.array([[2.0, 0.5], [0.5, 1.0]]))
        context, generator = system.CreateDefaultContext(), Generator(2)
        for _ in range(3):
            system.SetRandomContext(context, generator)
            x = context.get_discrete_state_vector() if kind == 1 else context.get_continuous_state_vector()
            states.append(x.CopyToVector())
    np.testing.assert_allclose(states[:3], states[3:], rtol=1e-12)


def test_the_selector_of_a_port_switch_takes_an_index_in_a_value(drake):
    for library in (OURS, drake):
        switch = library.PortSwitch(2)
        ports = [switch.DeclareInputPort(name) for name in "ab"]
        context = switch.CreateDefaultContext()
        for i, port in enumerate(ports):
            port.FixValue(context, [i, i + 0.5])
        for i, port in enumerate(ports):
            for index in (port.get_index(), library.Value(port.get_index())):
                switch.get_port_selector_input_port().FixValue(context, index)
                assert list(switch.get_output_port().Eval(context)) == [i, i + 0.5]


def test_texts_of_contexts_count_parameters_the_same(drake):
    texts = []
    for library in (OURS, drake):
        builder = library.DiagramBuilder()
        x = library.Variable("x")
        p = [library.Variable(name) for name in "pqr"]
        builder.AddSystem(library.SymbolicVectorSystem(state=[x], parameter=p, dynamics=[x * p[0] + p[1] + p[2]]))
        texts.append(str(builder.Build().CreateDefaultContext()))
    assert "3 total numeric parameters in 1 groups" in texts[0]
    assert [text.splitlines()[2:4] for text in texts[:1]] == [text.splitlines()[2:4] for text in texts[1:]]


@pytest.mark.parametrize("failed", [False, True])
def test_ends_of_runs_by_nobody_read_the_same(drake, failed):
    import pydrake.systems.analysis as their_analysis

    from sheldrake.systems import analysis

    texts = []
    for library, Simulator in ((OURS, analysis.Simulator), (drake, their_analysis.Simulator)):
        status = library.EventStatus.Failed if failed else library.EventStatus.ReachedTermination
        simulator = Simulator(library.ConstantVectorSource([1.0]))
        simulator.set_monitor(lambda context, status=status: status(None, "why"))
        try:
            texts.append(simulator.AdvanceTo(1.0).FormatMessage())
        except RuntimeError as error:
            texts.append(str(error))
    assert texts[0] == texts[1]
