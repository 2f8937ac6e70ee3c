"""The same diagrams in Drake: same logs, same event times, same order of events."""

import numpy as np
import pytest

from sheldrake import symbolic
from sheldrake.systems import analysis, framework, primitives

pytest.importorskip("pydrake")
pytestmark = pytest.mark.peer


class Library:
    """One library's names, so that a scene is written once."""

    def __init__(self, *modules):
        self._modules = modules

    def __getattr__(self, name):
        for module in self._modules:
            if hasattr(module, name):
                return getattr(module, name)
        raise AttributeError(name)


OURS = Library(framework, analysis, primitives, symbolic)


@pytest.fixture(scope="module")
def drake():
    import pydrake.symbolic
    import pydrake.systems.analysis
    import pydrake.systems.framework
    import pydrake.systems.primitives

    systems = pydrake.systems
    return Library(systems.framework, systems.analysis, systems.primitives, pydrake.symbolic)


def python_plant(lib, dt, x0):
    class Plant(lib.LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareVectorInputPort("u", len(x0) // 2)
            self.DeclareStateOutputPort("x", self.DeclareDiscreteState(np.array(x0, float)))
            self.DeclarePeriodicDiscreteUpdateEvent(dt, 0.0, self.step)

        def step(self, context, x_next):
            x, u = context.get_discrete_state_vector().value(), self.get_input_port(0).Eval(context)
            v = x[len(u) :] + dt * u
            x_next.set_value(np.concatenate([x[: len(u)] + dt * v, v]))

    return Plant()


def counter(lib, period):
    """A periodic unrestricted update: runs before the discrete updates of the same instant."""

    class Count(lib.LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareStateOutputPort("x", self.DeclareDiscreteState(np.array([0.0, 1.0])))
            self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self.update)

        def update(self, context, state):
            state.get_mutable_discrete_state(0).set_value(context.get_discrete_state_vector().value() + 1.0)

    return Count()


def signals(lib):
    """Multi-rate holds, updates that feed each other, a subdiagram, integrators, filters; logs of three kinds."""
    b, inner = lib.DiagramBuilder(), lib.DiagramBuilder()

    def connect(source, target, i=0, j=0):
        b.Connect(source.get_output_port(j), target.get_input_port(i))

    constant = b.AddSystem(lib.ConstantVectorSource([1.0, -2.0]))
    first, second = b.AddSystem(lib.Integrator([0.0, 0.5])), b.AddSystem(lib.Integrator([0.1, 0.2]))
    times = ((0.1, 0.0), (0.1, 0.0), (0.3, 0.0), (0.07, 0.02), (1 / 3, 0.0))
    holds = [b.AddSystem(lib.ZeroOrderHold(p, 2, offset_sec=o)) for p, o in times]
    adder = b.AddSystem(lib.Adder(3, 2))
    low_pass, gain = inner.AddSystem(lib.FirstOrderLowPassFilter(0.4, 2)), inner.AddSystem(lib.Gain(-1.5, 2))
    inner.Connect(gain.get_output_port(), low_pass.get_input_port())
    inner.ExportInput(gain.get_input_port(), "u")
    inner.ExportOutput(low_pass.get_output_port(), "y")
    inner.ExportOutput(gain.get_output_port(), "gy")
    sub = b.AddSystem(inner.Build())
    connect(constant, first), connect(adder, second), connect(first, holds[0]), connect(holds[0], holds[1])
    connect(holds[1], holds[2]), connect(second, holds[3]), connect(holds[3], holds[4]), connect(holds[2], sub)
    connect(sub, adder, 0, 0), connect(sub, adder, 1, 1), connect(holds[4], adder, 2)
    count, held = b.AddSystem(counter(lib, 0.1)), b.AddSystem(lib.ZeroOrderHold(0.1, 2))
    connect(count, held)
    logged = (count, held, second, adder, holds[1], holds[2], holds[4])
    sinks = [lib.LogVectorOutput(x.get_output_port(), b) for x in logged]
    sinks += [lib.LogVectorOutput(adder.get_output_port(), b, p) for p in (0.05, 1 / 3, 0.01005)]
    return b.Build(), sinks


def feedback(lib):
    """A Python plant under a static controller."""
    b = lib.DiagramBuilder()
    plant = b.AddSystem(python_plant(lib, 1e-3, [0.0, 0.5]))
    control = b.AddSystem(lib.MatrixGain(np.array([[-20.0, -8.0]])))
    b.Connect(plant.get_output_port(0), control.get_input_port(0))
    b.Connect(control.get_output_port(0), plant.get_input_port(0))
    sinks = [lib.LogVectorOutput(s.get_output_port(0), b) for s in (plant, control)]
    return b.Build(), sinks


def delays(lib):
    """Delays, discrete integrals, a discrete linear system and a sine."""
    b = lib.DiagramBuilder()
    wave = b.AddSystem(lib.Sine(1.5, 2.0, 0.3, 2))
    delay = b.AddSystem(lib.DiscreteTimeDelay(0.05, 3, 2))
    total = b.AddSystem(lib.DiscreteTimeIntegrator(2, 0.02))
    A, B = np.array([[0.9, 0.1], [-0.2, 0.8]]), np.array([[0.0], [1.0]])
    linear = b.AddSystem(lib.LinearSystem(A, B, np.array([[1.0, 2.0]]), np.array([[0.5]]), 0.03))
    limit = b.AddSystem(lib.Saturation([-1.0, -0.5], [1.0, 0.25]))
    split, join = b.AddSystem(lib.Demultiplexer(2)), b.AddSystem(lib.Multiplexer(2))
    for source, target in ((wave, delay), (wave, total), (wave, limit), (limit, split)):
        b.Connect(source.get_output_port(0), target.get_input_port(0))
    b.Connect(split.get_output_port(0), linear.get_input_port())
    b.Connect(split.get_output_port(0), join.get_input_port(1))
    b.Connect(linear.get_output_port(), join.get_input_port(0))
    ports = [wave.get_output_port(k) for k in range(3)] + [
        s.get_output_port() for s in (delay, total, linear, limit, join)
    ]
    sinks = [lib.LogVectorOutput(port, b) for port in ports]
    return b.Build(), sinks


def run(lib, make, stops, setting):
    diagram, sinks = make(lib)
    simulator = lib.Simulator(diagram)
    integrator = simulator.get_mutable_integrator()
    if setting == "fixed":
        integrator.set_fixed_step_mode(True)
        integrator.set_maximum_step_size(0.01)
    elif setting in ("runge_kutta2", "explicit_euler"):
        lib.ResetIntegratorFromFlags(simulator, setting, 0.013)
    elif setting in ("runge_kutta5", "bogacki_shampine3"):
        lib.ResetIntegratorFromFlags(simulator, setting, 0.1)
        simulator.get_mutable_integrator().set_target_accuracy(1e-3)
    elif isinstance(setting, float):
        integrator.set_target_accuracy(setting)
    for stop in stops:
        simulator.AdvanceTo(stop)
    found = []
    for sink in sinks:
        log = sink.FindLog(simulator.get_context())
        found += [log.sample_times(), log.data()]
    return found, simulator


@pytest.mark.parametrize(
    "setting", ["fixed", "runge_kutta2", "explicit_euler", "runge_kutta5", "bogacki_shampine3", 1e-4, 1e-7]
)
@pytest.mark.parametrize("make", [signals, delays, feedback])
def test_logs_are_equal(drake, make, setting):
    stops = (0.0, 0.35, 1.0, 1.2345, 3.0)
    (ours, mine), (theirs, its) = run(OURS, make, stops, setting), run(drake, make, stops, setting)
    for a, b in zip(ours, theirs):
        assert a.shape == b.shape
        # Lengths of controlled steps hang on the round-off of a small error estimate.
        tolerance = 1e-8 if setting == 1e-7 else 1e-12
        np.testing.assert_allclose(a, b, rtol=tolerance, atol=tolerance)
    for name in ("num_steps_taken", "num_publishes", "num_discrete_updates", "num_unrestricted_updates"):
        assert getattr(mine, f"get_{name}")() == getattr(its, f"get_{name}")(), name


ACCURACIES = {  # the accuracy without a setting, and the loosest that a setting can ask for
    "bogacki_shampine3": (1e-3, 0.1),
    "runge_kutta3": (1e-3, 0.1),
    "runge_kutta5": (1e-5, 1e-3),
    "implicit_euler": (0.1, 0.5),
    "velocity_implicit_euler": (0.1, 0.5),
    "radau1": (0.1, 0.5),
    "radau3": (1e-3, 0.01),
}


def steps_taken(lib, scheme, accuracy):
    """Lengths of steps of a stiff oscillator, under error control."""
    x, v = lib.Variable("x"), lib.Variable("v")
    system = lib.SymbolicVectorSystem(state=[x, v], dynamics=[v, -50 * v - x * x * x + 1], output=[x])
    simulator = lib.Simulator(system)
    integrator = lib.ResetIntegratorFromFlags(simulator, scheme, 0.5)
    integrator.set_fixed_step_mode(False)
    if accuracy is not None:
        integrator.set_target_accuracy(accuracy)
    simulator.get_mutable_context().SetContinuousState([1.0, 0.5])
    times = []
    simulator.set_monitor(lambda context: times.append(context.get_time()))
    simulator.AdvanceTo(3.0)
    return np.diff(np.unique(times)), simulator.get_context().get_continuous_state_vector().CopyToVector()


@pytest.mark.parametrize("accuracy", [None, 10.0, 1e-3])
@pytest.mark.parametrize("scheme", ACCURACIES)
def test_accuracy_without_and_beyond_settings(drake, scheme, accuracy):
    ours, x = steps_taken(OURS, scheme, accuracy)
    theirs, y = steps_taken(drake, scheme, accuracy)
    default, loosest = ACCURACIES[scheme]
    np.testing.assert_allclose(ours, theirs, rtol=1e-5)
    assert np.abs(x - y).max() < min(accuracy or default, loosest)


def every_event(lib, story):
    """A leaf with every kind of event, each of which tells."""

    class Teller(lib.LeafSystem):
        def __init__(self):
            super().__init__()
            self.answers = {}
            self.DeclareDiscreteState(1)
            for kind in ("DiscreteUpdate", "UnrestrictedUpdate", "Publish"):
                for when in ("PerStep", "Initialization", "Forced"):
                    getattr(self, f"Declare{when}{kind}Event")(self.teller(when, kind))
                for period in (1.0, 0.7):
                    declare = getattr(self, f"DeclarePeriodic{kind}Event")
                    declare(period, 0.0, self.teller(f"Periodic{period}", kind))

        def teller(self, when, kind):
            def handle(context, *state):
                story.append((when, kind, context.get_time()))
                return self.answers.get((when, kind))

            return handle

    return Teller()


def tell(lib):
    """Everything a simulator does, as a list."""
    story = []
    teller = every_event(lib, story)
    simulator = lib.Simulator(teller)

    def counts():
        names = ("steps_taken", "publishes", "discrete_updates", "unrestricted_updates")
        story.append(tuple(getattr(simulator, f"get_num_{name}")() for name in names))

    story.append("Initialize")
    simulator.Initialize()
    for stop in (1.5, 2.0):
        story.append(stop)
        simulator.AdvanceTo(stop)
        counts()
    for _ in range(2):
        story.append("AdvancePendingEvents")
        simulator.AdvancePendingEvents()
    simulator.AdvanceTo(2.0)
    counts()
    simulator.set_monitor(lambda context: story.append(("monitor", context.get_time())))
    simulator.AdvanceTo(3.5)
    simulator.clear_monitor()
    for key in (("Periodic1.0", "DiscreteUpdate"), ("PerStep", "UnrestrictedUpdate"), ("PerStep", "Publish")):
        teller.answers = {key: lib.EventStatus.ReachedTermination(teller, "enough")}
        for _ in range(2):
            status = simulator.AdvanceTo(5.5)
            story.append((status.FormatMessage(), status.return_time(), status.reason().name, status.succeeded()))
    teller.answers = {}
    simulator.get_mutable_context().SetTime(10.2)
    story.append("Initialize again")
    simulator.Initialize(lib.InitializeParams(suppress_initialization_events=True))
    simulator.AdvanceTo(11.5)
    counts()
    context = simulator.get_mutable_context()
    for call in (teller.ForcedPublish, teller.ExecuteInitializationEvents, teller.ExecuteForcedEvents):
        story.append("by hand")
        call(context)
    teller.ExecuteForcedEvents(context, publish=False)
    return story


def test_events_happen_in_the_same_order(drake):
    ours, theirs = tell(OURS), tell(drake)
    plain = [[str(x).replace(f"{__name__}.", "") for x in story] for story in (ours, theirs)]
    assert plain[0] == plain[1]


def bouncing(lib, publish):
    """A ball that changes direction when its height changes sign."""

    class Ball(lib.LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareContinuousState(1, 1, 0)
            self.DeclareStateOutputPort("x", lib.ContinuousStateIndex(0))
            kind = lib.PublishEvent if publish else lib.UnrestrictedUpdateEvent
            event = kind(system_callback=Ball.hit)
            direction = lib.WitnessFunctionDirection.kPositiveThenNonPositive
            self.witness = self.MakeWitnessFunction("height", direction, self.height, event)
            self.hits = []

        def DoCalcTimeDerivatives(self, context, derivatives):
            x = context.get_continuous_state_vector().CopyToVector()
            derivatives.get_mutable_vector().SetFromVector([x[1], -9.81])

        def DoGetWitnessFunctions(self, context):
            return [self.witness]

        def height(self, context):
            return context.get_continuous_state_vector()[0]

        def hit(self, context, event, state=None):
            self.hits.append(context.get_time())
            if state is not None:
                x = state.get_mutable_continuous_state().get_mutable_vector()
                x.SetAtIndex(0, 0.0)
                x.SetAtIndex(1, -0.8 * x.GetAtIndex(1))

    return Ball()


@pytest.mark.parametrize("publish", [True, False])
@pytest.mark.parametrize("fixed", [True, False])
def test_witness_functions_trigger_at_the_same_times(drake, publish, fixed):
    found = []
    for lib in (OURS, drake):
        b = lib.DiagramBuilder()
        ball = b.AddSystem(bouncing(lib, publish))
        sink = lib.LogVectorOutput(ball.get_output_port(), b)
        simulator = lib.Simulator(b.Build())
        context = simulator.get_mutable_context()
        context.SetContinuousState([1.0, 0.0])
        if fixed:
            lib.ResetIntegratorFromFlags(simulator, "runge_kutta2", 0.01)
        context.SetAccuracy(1e-3)
        simulator.AdvanceTo(1.3)
        log = sink.FindLog(simulator.get_context())
        found.append((ball.hits, log.sample_times(), log.data()))
    assert len(found[0][0]) == len(found[1][0]) > 0
    for a, b in zip(*found):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-9)


def falling(lib, kind):
    """A body that falls through the ground, which one kind of event notices."""

    class Falling(lib.LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareContinuousState(lib.BasicVector([1.0, 0.0]), 1, 1, 0)
            self.DeclareDiscreteState(1)
            event = getattr(lib, f"{kind}Event")(system_callback=lambda *_: None)
            direction = lib.WitnessFunctionDirection.kPositiveThenNonPositive
            self.ground = self.MakeWitnessFunction("ground", direction, self.height, event)

        def height(self, context):
            return context.get_continuous_state_vector()[0]

        def DoGetWitnessFunctions(self, context):
            return [self.ground]

        def DoCalcTimeDerivatives(self, context, derivatives):
            derivatives.get_mutable_vector().SetFromVector([context.get_continuous_state_vector()[1], -9.81])

    return Falling()


@pytest.mark.parametrize("kind", ["Publish", "UnrestrictedUpdate"])
def test_an_event_of_a_witness_counts_as_what_it_is(drake, kind):
    found = []
    for lib in (OURS, drake):
        simulator = lib.Simulator(falling(lib, kind))
        simulator.get_mutable_context().SetAccuracy(1e-6)
        simulator.AdvanceTo(1.0)
        names = ("publishes", "discrete_updates", "unrestricted_updates")
        found.append([getattr(simulator, f"get_num_{name}")() for name in names])
    assert found[0] == found[1]
    assert sorted(found[0]) == [0, 0, 1]
