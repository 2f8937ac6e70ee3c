"""Events that happen at once: system by system, whatever triggers them."""

import pytest

from sheldrake.all import (
    ConstantVectorSource,
    DiagramBuilder,
    EventStatus,
    LeafSystem,
    LogVectorOutput,
    Simulator,
    Value,
)

pytestmark = pytest.mark.twin


class Noted(LeafSystem):
    """Notes what happens to it."""

    def __init__(self, name, told):
        super().__init__()
        self.set_name(name)
        self.told = told
        self.DeclareDiscreteState(1)

    def note(self, label, factor=0):
        def handle(context, *target):
            self.told.append((self.get_name(), label))
            for x in target:
                x.set_value([factor * x.value()[0] + 1])

        return handle


def run(make, until):
    told = []
    builder = DiagramBuilder()
    systems = [builder.AddSystem(system) for system in make(told)]
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    told.clear()
    simulator.AdvanceTo(until)
    return told, simulator, systems


def test_publishes_come_system_by_system():
    def make(told):
        a, b = Noted("a", told), Noted("b", told)
        a.DeclarePeriodicPublishEvent(0.5, 0.0, a.note("half"))
        b.DeclarePeriodicPublishEvent(1.0, 0.0, b.note("whole"))
        b.DeclarePerStepPublishEvent(b.note("step"))
        a.DeclarePeriodicPublishEvent(1.0, 0.0, a.note("whole"))
        a.DeclarePerStepPublishEvent(a.note("step"))
        return a, b

    told, *_ = run(make, 1.0)
    half = [("a", "step"), ("a", "half"), ("b", "step")]
    assert told == [*half, ("a", "step"), ("a", "half"), ("a", "whole"), ("b", "step"), ("b", "whole")]


def test_updates_of_a_system_come_as_they_are_declared():
    """Each goes on from what the one before has written."""

    def make(told):
        other, system = Noted("other", told), Noted("system", told)
        other.DeclarePeriodicDiscreteUpdateEvent(1.0, 0.0, other.note("first of all clocks"))
        system.DeclarePeriodicDiscreteUpdateEvent(0.5, 0.0, system.note("x + 1", 1))
        system.DeclarePeriodicDiscreteUpdateEvent(1.0, 0.0, system.note("10 x + 1", 10))
        return other, system

    _, simulator, (_, system) = run(make, 0.25)
    context = system.GetMyContextFromRoot(simulator.get_context())
    assert context.get_discrete_state_vector().GetAtIndex(0) == 11  # not 2


def test_publishes_go_on_when_one_fails_and_the_first_failure_is_told():
    told = []

    def make(_):
        for name in ("a", "b", "c"):
            system = Noted(name, told)
            status = EventStatus.Failed(system, f"{name} fails") if name != "b" else None
            system.DeclarePerStepPublishEvent(lambda context, n=name, s=status: told.append(n) or s)
            yield system

    with pytest.raises(RuntimeError, match=r"because .*::a' failed with message: \"a fails\""):
        run(make, 1.0)
    assert told == ["a", "b", "c"]


def test_updates_that_do_nothing_leave_nothing_behind():
    class Idle(LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareAbstractState(Value(0))
            self.DeclareInitializationUnrestrictedUpdateEvent(self.update)
            self.DeclarePeriodicUnrestrictedUpdateEvent(0.25, 0.0, self.update)

        def update(self, context, state):
            value = state.get_mutable_abstract_state().get_mutable_value(0)
            value.set_value(value.get_value() + 1)
            return EventStatus.Succeeded() if context.get_time() == 0.75 else EventStatus.DidNothing()

    system = Idle()
    simulator = Simulator(system)
    simulator.AdvanceTo(1.0)
    assert simulator.get_context().get_abstract_state(0).get_value() == 1
    assert simulator.get_num_unrestricted_updates() == 1


@pytest.mark.parametrize("writes_first", [False, True])
def test_a_log_sees_what_python_wrote_in_the_same_publish(writes_first):
    """Both are due at once by one clock: whichever was added first has its turn first."""
    builder = DiagramBuilder()
    source = builder.AddSystem(ConstantVectorSource([0.0]))

    def add_writer():
        writer = builder.AddSystem(LeafSystem())
        writer.DeclarePeriodicPublishEvent(1.0, 0.0, lambda context: write(5.0 + context.get_time()))

    def write(value):
        source.get_mutable_source_value(source.GetMyMutableContextFromRoot(context)).SetFromVector([value])

    if writes_first:
        add_writer()
    sink = LogVectorOutput(source.get_output_port(), builder, 1.0)
    if not writes_first:
        add_writer()
    simulator = Simulator(builder.Build())
    context = simulator.get_mutable_context()
    simulator.AdvanceTo(3.0)
    expected = [5.0, 6.0, 7.0, 8.0] if writes_first else [0.0, 5.0, 6.0, 7.0]
    assert sink.FindLog(context).data()[0].tolist() == expected
