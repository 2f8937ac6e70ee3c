"""Cache entries and output ports: computed when needed, never stale."""

import pytest

from sheldrake.common.value import Value
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import BasicVector, DiagramBuilder, LeafSystem, ValueProducer
from sheldrake.systems.primitives import ConstantVectorSource


class Counting(LeafSystem):
    """Entries with different prerequisites, which count how often they are computed."""

    SOURCES = ("time", "xc", "xd", "pn", "all_input_ports", "nothing", "all_sources")

    def __init__(self):
        super().__init__()
        self.DeclareVectorInputPort("u", 1)
        self.DeclareContinuousState(1)
        self.DeclareDiscreteState(1)
        self.DeclareNumericParameter(BasicVector([1.0]))
        self.DeclarePeriodicDiscreteUpdateEvent(0.1, 0.0, self.update)
        self.counts = dict.fromkeys(self.SOURCES, 0)
        self.entries = {name: self.declare(name) for name in self.SOURCES}

    def declare(self, name):
        def calc(context, value):
            self.counts[name] += 1
            value.set_value(float(self.counts[name]))

        tickets = {getattr(self, f"{name}_ticket")()}
        return self.DeclareCacheEntry(name, ValueProducer(Value(0.0).Clone, calc), tickets)

    def update(self, context, x_next):
        x_next[0] = context.get_discrete_state_vector()[0] + 1.0

    def DoCalcTimeDerivatives(self, context, derivatives):
        derivatives[0] = 0.0

    def evaluate(self, context):
        """Evaluates all entries; names of those that were computed."""
        before = dict(self.counts)
        for entry in self.entries.values():
            entry.Eval(context)
        return {name for name in self.SOURCES if self.counts[name] > before[name]}


CHANGES = {
    "time": lambda root, c: root.SetTime(root.get_time() + 1.0),
    "xc": lambda root, c: c.SetContinuousState([2.0]),
    "xd": lambda root, c: c.get_mutable_discrete_state_vector().SetAtIndex(0, 3.0),
    "pn": lambda root, c: c.get_mutable_numeric_parameter(0).SetFromVector([4.0]),
    "all_input_ports": lambda root, c: c._system.get_input_port().FixValue(c, [5.0]),
}


@pytest.mark.parametrize("source", CHANGES)
def test_a_change_reaches_what_depends_on_it_and_nothing_else(source):
    builder = DiagramBuilder()
    system = builder.AddSystem(Counting())
    root = builder.Build().CreateDefaultContext()
    context = system.GetMyMutableContextFromRoot(root)
    system.get_input_port().FixValue(context, [0.0])
    assert system.evaluate(context) == set(Counting.SOURCES)
    assert system.evaluate(context) == set()
    CHANGES[source](root, context)
    assert system.entries[source].is_out_of_date(context)
    assert system.evaluate(context) == {source, "all_sources"}
    root.SetAllCacheEntriesOutOfDate()
    assert system.evaluate(context) == set(Counting.SOURCES)


def test_a_write_through_the_whole_tree_reaches_a_leaf():
    builder = DiagramBuilder()
    system = builder.AddSystem(Counting())
    root = builder.Build().CreateDefaultContext()
    context = system.GetMyContextFromRoot(root)
    system.get_input_port().FixValue(context, [0.0])
    system.evaluate(context)
    root.SetContinuousState([9.0])
    assert system.evaluate(context) == {"xc", "all_sources"}
    root.get_mutable_state()
    assert system.evaluate(context) == {"xc", "xd", "all_sources"}


def test_the_event_loop_makes_values_out_of_date():
    system = Counting()
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    system.get_input_port().FixValue(context, [0.0])
    system.evaluate(context)
    simulator.AdvanceTo(0.25)
    assert {"time", "xc", "xd", "all_sources"} <= system.evaluate(context)
    assert system.counts["nothing"] == system.counts["pn"] == 1


def test_an_input_is_as_fresh_as_what_feeds_it():
    builder = DiagramBuilder()
    source, system = builder.AddSystem(ConstantVectorSource([1.0])), builder.AddSystem(Counting())
    builder.Connect(source.get_output_port(), system.get_input_port())
    root = builder.Build().CreateDefaultContext()
    context = system.GetMyContextFromRoot(root)
    system.evaluate(context)
    root.SetTime(1.0)
    assert system.evaluate(context) == {"time", "all_sources"}
    source.get_mutable_source_value(source.GetMyMutableContextFromRoot(root)).SetFromVector([2.0])
    assert system.evaluate(context) == {"all_input_ports", "all_sources"}


def test_caching_can_be_disabled_and_frozen():
    system = Counting()
    context = system.CreateDefaultContext()
    system.get_input_port().FixValue(context, [0.0])
    entry = system.entries["time"]
    system.evaluate(context)
    entry.disable_caching(context)
    assert entry.is_cache_entry_disabled(context)
    assert system.evaluate(context) == {"time"}
    entry.enable_caching(context)
    context.DisableCaching()
    assert system.evaluate(context) == set(Counting.SOURCES)
    context.EnableCaching()
    context.FreezeCache()
    assert context.is_cache_frozen()
    assert system.evaluate(context) == set()
    context.SetTime(1.0)
    with pytest.raises(RuntimeError, match=r"frozen.*'time'"):
        entry.Eval(context)
    context.UnfreezeCache()
    assert system.evaluate(context) == {"time", "all_sources"}


def test_an_entry_may_depend_on_another():
    class Chain(Counting):
        def __init__(self):
            super().__init__()
            first = self.entries["xd"]
            self.last = self.DeclareCacheEntry("last", ValueProducer(Value(0.0).Clone, self.calc), {first.ticket()})

        def calc(self, context, value):
            value.set_value(10.0 * self.entries["xd"].Eval(context))

    system = Chain()
    context = system.CreateDefaultContext()
    assert system.last.Eval(context) == 10.0
    context.SetTime(5.0)
    assert system.last.Eval(context) == 10.0
    context.SetDiscreteState([1.0])
    assert system.last.Eval(context) == 20.0


def test_entries_say_what_they_are():
    system = Counting()
    context = system.CreateDefaultContext()
    entry = system.entries["all_sources"]
    assert entry.description() == "all_sources"
    assert entry.has_default_prerequisites()
    assert system.get_cache_entry(entry.cache_index()).ticket() == entry.ticket()
    value = entry.get_mutable_cache_entry_value(context)
    with pytest.raises(RuntimeError, match="out of date"):
        value.GetValueOrThrow()
    with pytest.raises(RuntimeError, match="may not be empty"):
        system.DeclareCacheEntry("none", ValueProducer(Value(0.0).Clone, ValueProducer.NoopCalc), set())


def test_output_ports_are_cached():
    class Source(LeafSystem):
        def __init__(self):
            super().__init__()
            self.count = 0
            self.DeclareVectorOutputPort("y", 1, self.calc, {self.time_ticket()})

        def calc(self, context, output):
            self.count += 1
            output[0] = context.get_time()

    system = Source()
    context = system.CreateDefaultContext()
    port = system.get_output_port()
    for _ in range(3):
        assert port.Eval(context) == 0.0
    assert system.count == 1
    context.SetTime(2.0)
    assert port.cache_entry().is_out_of_date(context)
    assert port.Eval(context) == 2.0
    assert system.count == 2
    port.cache_entry().disable_caching(context)
    port.Eval(context)
    assert system.count == 3


def test_a_port_without_caching_is_computed_whenever_it_is_asked_for():
    """Also in contexts made later and in their clones."""

    class Counter(LeafSystem):
        def __init__(self):
            super().__init__()
            self.calls = 0
            port = self.DeclareVectorOutputPort("y", 1, self.calc, {self.nothing_ticket()})
            port.disable_caching_by_default()

        def calc(self, context, output):
            self.calls += 1
            output.SetFromVector([self.calls])

    builder = DiagramBuilder()
    counter = builder.AddSystem(Counter())
    builder.ExportOutput(counter.get_output_port(), "y")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    port = diagram.get_output_port()
    assert [port.Eval(context)[0] for _ in range(3)] == [1, 2, 3]
    assert [port.Eval(context.Clone())[0] for _ in range(2)] == [4, 5]


def test_entries_and_their_values_are_the_same_objects_while_somebody_holds_them():
    system = Counting()
    entry = system.entries["time"]
    assert system.get_cache_entry(entry.cache_index()) is entry
    first, second = system.CreateDefaultContext(), system.CreateDefaultContext()
    value = entry.get_cache_entry_value(first)
    assert entry.get_cache_entry_value(first) is value is entry.get_mutable_cache_entry_value(first)
    assert entry.get_cache_entry_value(second) is not value
