"""A callback that sets the time: clocks go on from there, as in Drake; nothing is caught up."""

import math

import pytest

from sheldrake.symbolic import Variable
from sheldrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from sheldrake.systems.framework import DiagramBuilder, LeafSystem
from sheldrake.systems.primitives import SymbolicVectorSystem

pytestmark = pytest.mark.twin


class Clocks(LeafSystem):
    """An update every millisecond and a publish every two."""

    def __init__(self):
        super().__init__()
        self.updates, self.publishes = [], []
        self.DeclareDiscreteState(1)
        self.DeclarePeriodicUnrestrictedUpdateEvent(1e-3, 0.0, lambda c, x: self.updates.append(c.get_time()))
        self.DeclarePeriodicPublishEvent(2e-3, 0.5e-3, lambda c: self.publishes.append(c.get_time()))


def leap(to, native=True):
    """(times of updates, of publishes, last time) when a monitor sets the time once, after 4.2 ms."""
    builder = DiagramBuilder()
    clocks = builder.AddSystem(Clocks())
    simulator, done = Simulator(builder.Build()), []
    simulator._native = native

    def monitor(context):
        if not done and context.get_time() > 0.0042:
            done.append(context.SetTime(to))

    simulator.set_monitor(monitor)
    simulator.AdvanceTo(0.01)
    simulator.AdvanceTo(max(to, 0.01) + 0.0031)
    return clocks.updates, clocks.publishes, simulator.get_context().get_time()


@pytest.mark.parametrize("native", [True, False])
def test_forwards_nothing_is_caught_up(native):
    """The numbers are Drake's 1.51."""
    updates, publishes, end = leap(5.0004, native)
    assert updates == pytest.approx([0.0, 0.001, 0.002, 0.003, 0.004, 5.001, 5.002, 5.003], abs=1e-12)
    assert publishes == pytest.approx([0.0005, 0.0025, 0.0045, 5.0005, 5.0025], abs=1e-12)
    assert end == pytest.approx(5.0035)


@pytest.mark.parametrize("native", [True, False])
def test_onto_a_tick_and_backwards(native):
    """A tick at the new time itself is over; backwards, ticks come again (Drake 1.51)."""
    updates, _, _ = leap(5.0, native)
    assert updates[5:] == pytest.approx([5.001, 5.002, 5.003], abs=1e-12)
    updates, publishes, _ = leap(0.0, native)
    assert updates[5:] == pytest.approx([0.001 * k for k in range(1, 14)], abs=1e-12)
    assert publishes[3:] == pytest.approx([0.0005 + 0.002 * k for k in range(7)], abs=1e-12)


@pytest.mark.parametrize("native", [True, False])
@pytest.mark.parametrize("to", [math.inf, math.nan, 1e300, -math.inf, -1e300])
def test_what_is_no_time_is_refused(to, native):
    with pytest.raises((RuntimeError, ValueError), match="time"):
        leap(to, native)


class Leaps(LeafSystem):
    """Its third update, at 2 ms, sets the time."""

    def __init__(self, to, continuous):
        super().__init__()
        self.to, self.times, self.context = to, [], None
        self.DeclareDiscreteState(1)
        self.DeclareContinuousState(continuous)
        self.DeclarePeriodicUnrestrictedUpdateEvent(1e-3, 0.0, self.leap)

    def DoCalcTimeDerivatives(self, context, derivatives):
        derivatives.SetFromVector([1.0] * derivatives.size())

    def leap(self, context, state):
        self.times.append(context.get_time())
        if len(self.times) == 3:
            self.context.SetTime(self.to)


def update_that_leaps(to, native, continuous):
    """The system, and a simulator of it."""
    builder = DiagramBuilder()
    system = builder.AddSystem(Leaps(to, continuous))
    simulator = Simulator(builder.Build())
    simulator._native, system.context = native, simulator.get_mutable_context()
    return system, simulator


@pytest.mark.parametrize("native", [True, False])
@pytest.mark.parametrize("continuous", [0, 1])
def test_an_update_may_set_the_time(native, continuous):
    system, simulator = update_that_leaps(5.0, native, continuous)
    simulator.AdvanceTo(5.0031)
    assert system.times == pytest.approx([0.0, 0.001, 0.002, 5.001, 5.002, 5.003], abs=1e-12)


@pytest.mark.parametrize("native", [True, False])
@pytest.mark.parametrize("continuous", [0, 1])
@pytest.mark.parametrize(
    ("to", "says"),
    [
        (math.inf, "time of the context is inf"),
        (-math.inf, "time of the context is -inf"),
        (math.nan, "time of the context is nan"),
        (-1e300, "at the time -1e\\+300 s"),
        (5.0, "an update has set the time to 5.0 s, which lies behind boundary_time 0.0051"),
    ],
)
def test_an_update_that_sets_no_time_ends_the_run(to, says, native, continuous):
    """Drake 1.51 raises, aborts or hangs; here nothing may pass over it."""
    system, simulator = update_that_leaps(to, native, continuous)
    with pytest.raises(RuntimeError, match=says):
        simulator.AdvanceTo(0.0051)
    assert len(system.times) == 3


def test_steps_of_python_end_where_the_time_is_no_number():
    """A thousand of them would take minutes."""
    x = Variable("x")
    builder = DiagramBuilder()
    builder.AddSystem(SymbolicVectorSystem(state=[x], dynamics=[-x]))
    simulator, steps = Simulator(builder.Build()), []
    ResetIntegratorFromFlags(simulator, "implicit_euler", 1e-3)

    def monitor(context):
        steps.append(context.get_time())
        if len(steps) == 5:
            context.SetTime(math.nan)

    simulator.set_monitor(monitor)
    with pytest.raises(RuntimeError, match="the time of the context is nan s"):
        simulator.AdvanceTo(1.0)
    assert len(steps) < 8
