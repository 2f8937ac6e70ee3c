"""Contexts: values, views, copies, errors."""

import copy
import gc
import os
import resource
import sys

import numpy as np
import pytest

from sheldrake.common.value import Value
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import (
    BasicVector,
    ContinuousState,
    Diagram,
    DiagramBuilder,
    DiscreteValues,
    LeafSystem,
    Parameters,
)
from sheldrake.systems.framework._engine.scratch import copy_of, size_of, write_prototype
from sheldrake.systems.primitives import Gain, Integrator, LogVectorOutput, ZeroOrderHold


class Everything(LeafSystem):
    """A bit of each kind of state and parameter."""

    def __init__(self):
        super().__init__()
        self.DeclareVectorInputPort("u", 2)
        self.DeclareAbstractInputPort("name", Value("x"))
        self.DeclareContinuousState(BasicVector([1.0, 2.0, 3.0]), 1, 1, 1)
        self.first = self.DeclareDiscreteState([4.0, 5.0])
        self.second = self.DeclareDiscreteState(1)
        self.text = self.DeclareAbstractState(Value("begin"))
        self.gain = self.DeclareNumericParameter(BasicVector([7.0]))
        self.title = self.DeclareAbstractParameter(Value("title"))
        self.DeclareStateOutputPort("xd", self.first)
        self.DeclareStateOutputPort("text", self.text)

    def DoCalcTimeDerivatives(self, context, derivatives):
        derivatives.SetFromVector(np.zeros(3))


def two():
    builder = DiagramBuilder()
    systems = [builder.AddNamedSystem(name, Everything()) for name in ("a", "b")]
    diagram = builder.Build()
    diagram.set_name("root")
    return diagram, systems


def test_defaults_and_counts():
    diagram, (a, _) = two()
    root = diagram.CreateDefaultContext()
    assert root.num_continuous_states() == 6
    assert root.num_discrete_state_groups() == 4
    assert root.num_abstract_states() == root.num_abstract_parameters() == 2
    assert root.num_numeric_parameter_groups() == 2
    context = a.GetMyContextFromRoot(root)
    state = context.get_continuous_state()
    assert (state.num_q(), state.num_v(), state.num_z()) == (1, 1, 1)
    assert state.get_generalized_velocity()[0] == 2.0
    assert np.array_equal(context.get_discrete_state(0).value(), [4.0, 5.0])
    assert context.get_abstract_state(0).get_value() == "begin"
    assert context.get_numeric_parameter(0)[0] == 7.0
    assert np.array_equal(root.get_continuous_state().get_generalized_position().CopyToVector(), [1.0, 1.0])
    with pytest.raises(RuntimeError, match="abstract"):
        context.num_total_states()


def test_the_root_is_made_of_its_parts():
    diagram, (_, b) = two()
    root = diagram.CreateDefaultContext()
    root.SetContinuousState(np.arange(6.0))
    context = b.GetMyMutableContextFromRoot(root)
    assert np.array_equal(context.get_continuous_state_vector().value(), [3.0, 4.0, 5.0])
    context.SetDiscreteState(0, [8.0, 9.0])
    assert np.array_equal(root.get_discrete_state(2).value(), [8.0, 9.0])
    assert np.array_equal(b.GetOutputPort("xd").Eval(context), [8.0, 9.0])
    context.SetAbstractState(0, "changed")
    assert root.get_abstract_state(1).get_value() == b.GetOutputPort("text").Eval(context) == "changed"
    root.get_mutable_continuous_state().get_mutable_misc_continuous_state().SetFromVector([-1.0, -2.0])
    assert np.array_equal(root.get_continuous_state_vector().value(), [0.0, 1.0, -1.0, 3.0, 4.0, -2.0])


def test_constant_views_cannot_be_written():
    system = Everything()
    context = system.CreateDefaultContext()
    for view in (context.get_continuous_state_vector().value(), context.get_discrete_state(0).value()):
        with pytest.raises(ValueError, match="read-only"):
            view[0] = 1.0


def test_clone_is_independent():
    diagram, (a, _) = two()
    root = diagram.CreateDefaultContext()
    a.GetInputPort("u").FixValue(a.GetMyContextFromRoot(root), [1.0, 2.0])
    a.GetInputPort("name").FixValue(a.GetMyContextFromRoot(root), "first")
    for other in (root.Clone(), copy.copy(root), copy.deepcopy(root)):
        mine = a.GetMyMutableContextFromRoot(other)
        assert np.array_equal(a.GetInputPort("u").Eval(mine), [1.0, 2.0])
        other.SetTime(3.0)
        mine.SetDiscreteState(0, [0.0, 0.0])
        mine.SetAbstractState(0, "other")
        a.GetInputPort("name").FixValue(mine, "second")
        original = a.GetMyContextFromRoot(root)
        assert root.get_time() == 0.0
        assert np.array_equal(original.get_discrete_state(0).value(), [4.0, 5.0])
        assert original.get_abstract_state(0).get_value() == "begin"
        assert a.GetInputPort("name").Eval(original) == "first"
    with pytest.raises(RuntimeError, match="non-root"):
        a.GetMyContextFromRoot(root).Clone()


def test_set_time_state_and_parameters_from():
    diagram, (a, _) = two()
    one, other = diagram.CreateDefaultContext(), diagram.CreateDefaultContext()
    one.SetTime(2.0)
    one.SetContinuousState(np.arange(6.0))
    a.GetMyMutableContextFromRoot(one).get_mutable_numeric_parameter(0)[0] = 11.0
    a.GetMyMutableContextFromRoot(one).get_mutable_abstract_parameter(0).set_value("new")
    other.SetTimeStateAndParametersFrom(one)
    context = a.GetMyContextFromRoot(other)
    assert other.get_time() == 2.0
    assert np.array_equal(other.get_continuous_state_vector().value(), np.arange(6.0))
    assert context.get_numeric_parameter(0)[0] == 11.0
    assert context.get_abstract_parameter(0).get_value() == "new"


def test_errors_name_what_is_wrong():
    diagram, (a, b) = two()
    root = diagram.CreateDefaultContext()
    context = a.GetMyContextFromRoot(root)
    with pytest.raises(RuntimeError, match="root"):
        context.SetTime(1.0)
    with pytest.raises(IndexError, match="size 1"):
        root.SetDiscreteState(1, [1.0, 2.0])
    with pytest.raises(RuntimeError, match="2 groups"):
        context.get_discrete_state_vector()
    with pytest.raises(RuntimeError, match="::root::b"):
        b.get_output_port(0).Eval(context)
    with pytest.raises(RuntimeError, match="GetMyContextFromRoot"):
        a.get_output_port(0).Eval(root)
    with pytest.raises(RuntimeError, match="not contained"):
        Gain(1.0, 1).GetMyContextFromRoot(root)
    with pytest.raises(RuntimeError, match="must be a root"):
        a.GetMyContextFromRoot(context)
    with pytest.raises(TypeError, match="expected a number"):
        root.SetTime("now")


def test_an_input_fixed_over_its_connection():
    builder = DiagramBuilder()
    source, gain = builder.AddSystem(Gain(1.0, 1)), builder.AddSystem(Gain(3.0, 1))
    hold = builder.AddSystem(ZeroOrderHold(0.1, 1))
    builder.Connect(source.get_output_port(), gain.get_input_port())
    builder.Connect(gain.get_output_port(), hold.get_input_port())
    builder.ExportInput(source.get_input_port())
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    diagram.get_input_port().FixValue(root, [2.0])
    context = gain.GetMyContextFromRoot(root)
    assert gain.get_output_port().Eval(context) == 6.0
    simulator = Simulator(diagram, root)
    simulator.AdvanceTo(0.05)
    gain.get_input_port().FixValue(context, [5.0])
    assert gain.get_output_port().Eval(context) == 15.0
    assert source.get_output_port().Eval(source.GetMyContextFromRoot(root)) == 2.0
    simulator.AdvanceTo(0.15)
    assert hold.get_output_port().Eval(hold.GetMyContextFromRoot(root)) == 15.0


def test_values_by_hand():
    assert np.all(np.isnan(BasicVector(2).value()))
    vector = BasicVector([1.0, 2.0])
    assert (str(vector), repr(vector)) == ("[1.0, 2.0]", "BasicVector([1.0, 2.0])")
    vector.PlusEqScaled(2.0, BasicVector([1.0, 1.0]))
    assert list(vector) == [3.0, 4.0]
    with pytest.raises(IndexError, match=r"Index 2 is not within \[0, 2\)"):
        vector.GetAtIndex(2)
    values = DiscreteValues([BasicVector([1.0]), BasicVector([2.0, 3.0])])
    values.set_value(1, [4.0, 5.0])
    assert values.Clone().get_vector(1)[1] == 5.0
    with pytest.raises(RuntimeError, match="2 groups"):
        values.size()
    state = ContinuousState(BasicVector([1.0, 2.0, 3.0]), 1, 1, 1)
    state.get_mutable_generalized_velocity()[0] = 9.0
    assert state[1] == 9.0
    assert Parameters(BasicVector([1.0])).Clone().get_numeric_parameter(0)[0] == 1.0


def test_clone_and_step_both_gives_the_same_bits():
    builder = DiagramBuilder()
    integrator, gain = builder.AddSystem(Integrator([1.0, 0.5])), builder.AddSystem(Gain([-1.5, 0.3]))
    builder.Connect(integrator.get_output_port(), gain.get_input_port())
    builder.Connect(gain.get_output_port(), integrator.get_input_port())
    sink = LogVectorOutput(gain.get_output_port(), builder, 0.01)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.123)
    others = [Simulator(diagram, simulator.get_context().Clone()) for _ in range(2)]
    for other in others:
        other.AdvanceTo(0.3)
    logs = [sink.FindLog(other.get_context()) for other in others]
    assert np.array_equal(logs[0].data(), logs[1].data())
    assert logs[0].num_samples() > 0


def test_a_thousand_diagrams_leave_nothing_behind():
    def build_simulate_drop():
        builder = DiagramBuilder()
        systems = [builder.AddSystem(Everything()) for _ in range(3)]
        hold = builder.AddSystem(ZeroOrderHold(0.01, 2))
        builder.Connect(systems[0].GetOutputPort("xd"), hold.get_input_port())
        sink = LogVectorOutput(hold.get_output_port(), builder)
        simulator = Simulator(builder.Build())
        sink.FindMutableLog(simulator.get_mutable_context()).Reserve(20000)
        simulator.AdvanceTo(0.05)

    gc.collect()
    gc.disable()  # nothing may hang on the collector
    try:
        for _ in range(50):
            build_simulate_drop()
        before, peak = len(gc.get_objects()), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        for _ in range(1000):
            build_simulate_drop()
        grown = len(gc.get_objects()) - before
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - peak
    finally:
        gc.enable()
    assert grown < 50
    if sys.platform == "linux":
        assert peak < 5000  # KiB


@pytest.mark.skipif(sys.platform != "linux", reason="asks Linux how much memory is in use")
@pytest.mark.skipif("MALLOC_PERTURB_" in os.environ, reason="memory that malloc fills with a pattern is in use")
def test_scratch_of_zeros_takes_no_memory():
    def in_use():
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * resource.getpagesize()

    prototype = (np.zeros(1 << 25), np.full(3, 7), np.full(2, -0.0))
    before = in_use()
    slab = np.zeros(1 + size_of(prototype))
    write_prototype(prototype, slab[1:])
    copies = [copy_of(slab) for _ in range(4)]
    assert in_use() - before < slab.nbytes / 4
    for made in (slab, *copies):
        assert made[-5:-2].view(np.int64).tolist() == [7, 7, 7] and np.signbit(made[-2:]).all()
        assert not made[:-5].any()


def nested(depth):
    """A diagram in a diagram, and so on, each with an integrator and a hold beside the next."""
    inside = None
    for _ in range(depth):
        builder = DiagramBuilder()
        hold, integrator = builder.AddSystem(ZeroOrderHold(0.01, 1)), builder.AddSystem(Integrator(1))
        builder.Connect(hold.get_output_port(), integrator.get_input_port())
        if inside is not None:
            builder.AddSystem(inside)
            builder.Connect(inside.get_output_port(0), hold.get_input_port())
        else:
            builder.ExportInput(hold.get_input_port(), "u")
        builder.ExportOutput(integrator.get_output_port(), "y")
        inside = builder.Build()
    return inside


def calls_of(function):
    """How many functions run, Python's and built-in ones."""
    count = 0

    def see(frame, event, argument):
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(see)
    try:
        function()
    finally:
        sys.setprofile(None)
    return count


def test_contexts_of_deep_diagrams_take_work_in_proportion():
    three, one, two = (nested(depth) for depth in (100, 150, 300))  # which share no layout
    three.CreateDefaultContext()  # what is loaded when first used
    assert calls_of(two.CreateDefaultContext) < 2.2 * calls_of(one.CreateDefaultContext)


def test_the_state_of_a_nested_diagram_is_that_of_all_inside():
    system = nested(4)
    context = system.CreateDefaultContext()
    context.SetContinuousState([1.0, 2.0, 3.0, 4.0])
    for depth in (3, 2, 1):
        (system,) = (s for s in system.GetSystems() if isinstance(s, Diagram))
        state = system.GetMyMutableContextFromRoot(context).get_mutable_continuous_state()
        assert (state.num_q(), state.num_v(), state.num_z()) == (0, 0, depth)
        state.SetFromVector(state.CopyToVector() + 10.0)
    added = context.get_continuous_state_vector().CopyToVector() - [1.0, 2.0, 3.0, 4.0]
    assert sorted(added) == [0.0, 10.0, 20.0, 30.0]


@pytest.mark.parametrize("data", [[None], [object()], [float], [1.0, "a", None], [Value(1.0)], float, [[1.0], None]])
def test_vectors_hold_numbers_only(data):
    with pytest.raises(TypeError, match="expected a vector of numbers"):
        BasicVector(data)
