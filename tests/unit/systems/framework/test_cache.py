"""Cache entries and output ports: computed when needed, never stale."""

import numpy as np
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


class Perception(LeafSystem):
    """Sees something anew ten times a second; what it makes of that is named to depend on that alone."""

    def __init__(self):
        super().__init__()
        self.counts = dict.fromkeys(("port", "vector", "entry", "follower"), 0)
        self.image = self.DeclareAbstractInputPort("image", Value([0.0]))
        seen, number = self.DeclareAbstractState(Value([0.0])), self.DeclareDiscreteState(1)
        self.DeclarePeriodicUnrestrictedUpdateEvent(0.1, 0.0, self.look)
        named = {self.abstract_state_ticket(seen)}
        self.DeclareAbstractOutputPort("seen", lambda: Value([0.0]), self.say, named)
        self.DeclareVectorOutputPort("number", 1, self.count, {self.discrete_state_ticket(number)})
        self.DeclareAbstractOutputPort("follower", lambda: Value([0.0]), self.follow, {self.image.ticket()})
        self.entry = self.DeclareCacheEntry("entry", ValueProducer(lambda: Value([0.0]), self.keep), named)
        self.DeclareVectorOutputPort("kept", 1, lambda context, y: y.SetFromVector(self.entry.Eval(context)))

    def look(self, context, state):
        state.get_mutable_abstract_state(0).set_value([context.get_time()])
        state.get_mutable_discrete_state()[0] += 1.0

    def say(self, context, output):
        self.counts["port"] += 1
        output.set_value(context.get_abstract_state(0).get_value())

    def count(self, context, output):
        self.counts["vector"] += 1
        output.SetFromVector([context.get_discrete_state_vector()[0]])

    def follow(self, context, output):
        self.counts["follower"] += 1
        output.set_value(self.image.Eval(context))

    def keep(self, context, value):
        self.counts["entry"] += 1
        value.set_value(context.get_abstract_state(0).get_value())


class Reader(LeafSystem):
    """Asks for everything a thousand times a second, and sums it up."""

    def __init__(self):
        super().__init__()
        self.reads = 0
        self.sum = self.DeclareDiscreteState(4)
        self.seen = self.DeclareAbstractInputPort("seen", Value([0.0]))
        self.number = self.DeclareVectorInputPort("number", 1)
        self.followed = self.DeclareAbstractInputPort("followed", Value([0.0]))
        self.kept = self.DeclareVectorInputPort("kept", 1)
        self.DeclarePeriodicDiscreteUpdateEvent(0.001, 0.0005, self.read)

    def read(self, context, discrete):
        self.reads += 1
        read = [port.Eval(context)[0] for port in (self.seen, self.number, self.followed, self.kept)]
        discrete.get_mutable_vector().SetFromVector(context.get_discrete_state_vector().CopyToVector() + read)


class Camera(LeafSystem):
    """An image as its state."""

    def __init__(self):
        super().__init__()
        self.DeclareStateOutputPort("image", self.DeclareAbstractState(Value([0.0])))
        self.DeclarePeriodicUnrestrictedUpdateEvent(0.25, 0.0, self.take)

    def take(self, context, state):
        state.get_mutable_abstract_state(0).set_value([context.get_time()])


def test_what_is_named_to_depend_on_seldom_updates_is_computed_as_seldom():
    builder = DiagramBuilder()
    camera, perception = builder.AddSystem(Camera()), builder.AddSystem(Perception())
    reader = builder.AddSystem(Reader())
    builder.Connect(camera.get_output_port(), perception.image)
    builder.Connect(perception.GetOutputPort("seen"), reader.seen)
    builder.Connect(perception.GetOutputPort("number"), reader.number)
    builder.Connect(perception.GetOutputPort("follower"), reader.followed)
    builder.Connect(perception.GetOutputPort("kept"), reader.kept)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(1.0)
    assert reader.reads == 1000
    assert perception.counts == {"port": 10, "vector": 10, "entry": 10, "follower": 4}
    times = np.arange(1000) / 1000 + 0.0005
    looks, images = np.floor(times * 10), np.floor(times * 4)
    expected = [np.sum(looks / 10), np.sum(looks + 1), np.sum(images / 4), np.sum(looks / 10)]
    context = reader.GetMyContextFromRoot(simulator.get_context())
    np.testing.assert_allclose(context.get_discrete_state_vector().value(), expected, rtol=1e-12)


def test_a_calculation_that_failed_is_not_taken_for_done():
    class Fails(LeafSystem):
        def __init__(self):
            super().__init__()
            self.broken = True
            self.DeclareVectorOutputPort("y", 1, self.calc, {self.nothing_ticket()})

        def calc(self, context, output):
            if self.broken:
                raise ValueError("not yet")
            output.SetFromVector([3.0])

    system = Fails()
    context = system.CreateDefaultContext()
    with pytest.raises(ValueError, match="not yet"):
        system.get_output_port().Eval(context)
    system.broken = False
    assert system.get_output_port().Eval(context) == 3.0


def test_time_does_not_concern_what_depends_on_state():
    class System(LeafSystem):
        def __init__(self):
            super().__init__()
            self.calls = 0
            self.DeclareContinuousState(1)
            self.DeclareVectorOutputPort("y", 1, self.calc, {self.xc_ticket()})

        def calc(self, context, output):
            self.calls += 1
            output.SetFromVector(context.get_continuous_state_vector().CopyToVector())

    system = System()
    context = system.CreateDefaultContext()
    found = []
    for change in (lambda: None, lambda: context.SetTime(1.0), lambda: context.SetContinuousState([2.0])):
        change()
        found.append((system.get_output_port().Eval(context)[0], system.calls))
    assert found == [(0.0, 1), (0.0, 1), (2.0, 2)]
