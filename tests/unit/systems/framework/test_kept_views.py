"""What contexts keep between calls follows every change: readers of ports, vectors of state, default values."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff
from sheldrake.common.value import Value
from sheldrake.systems.framework import BasicVector, DiagramBuilder, LeafSystem
from sheldrake.systems.primitives import (
    ConstantVectorSource,
    Gain,
    Integrator,
    LinearSystem,
    PassThrough,
    ZeroOrderHold,
)


def chain():
    builder = DiagramBuilder()
    source = builder.AddNamedSystem("source", ConstantVectorSource([2.0]))
    gain = builder.AddNamedSystem("gain", Gain(3.0, 1))
    builder.Connect(source.get_output_port(), gain.get_input_port())
    hold = builder.AddNamedSystem("hold", ZeroOrderHold(0.1, 1))
    builder.Connect(gain.get_output_port(), hold.get_input_port())
    return builder.Build(), gain, hold


class TestReaders:
    def test_a_port_read_before_shows_a_value_fixed_over_its_connection(self):
        diagram, gain, hold = chain()
        root = diagram.CreateDefaultContext()
        context = gain.GetMyMutableContextFromRoot(root)
        assert gain.get_input_port().Eval(context) == [2.0]
        assert gain.get_output_port().Eval(context) == [6.0]
        gain.get_input_port().FixValue(context, [5.0])
        assert gain.get_input_port().Eval(context) == [5.0]
        assert gain.get_output_port().Eval(context) == [15.0]
        assert hold.get_input_port().Eval(hold.GetMyContextFromRoot(root)) == [15.0]

    def test_contexts_do_not_share_readers(self):
        diagram, gain, _ = chain()
        root = diagram.CreateDefaultContext()
        gain.get_output_port().Eval(gain.GetMyContextFromRoot(root))
        other = root.Clone()
        gain.get_input_port().FixValue(gain.GetMyMutableContextFromRoot(other), [-1.0])
        assert gain.get_output_port().Eval(gain.GetMyContextFromRoot(other)) == [-3.0]
        assert gain.get_output_port().Eval(gain.GetMyContextFromRoot(root)) == [6.0]

    def test_an_answer_belongs_to_the_caller(self):
        diagram, gain, _ = chain()
        context = gain.GetMyContextFromRoot(diagram.CreateDefaultContext())
        for port in (gain.get_input_port(), gain.get_output_port()):
            first = port.Eval(context)
            port.Eval(context)[:] = np.nan
            assert np.array_equal(port.Eval(context), first)

    def test_without_caching_every_call_computes(self):
        class Counter(LeafSystem):
            def __init__(self):
                super().__init__()
                self.calls = 0
                self.DeclareVectorOutputPort("y", 1, self.calc)

            def calc(self, context, output):
                self.calls += 1
                output.SetFromVector([self.calls])

        counter = Counter()
        context = counter.CreateDefaultContext()
        port = counter.get_output_port()
        assert [port.Eval(context)[0] for _ in range(2)] == [1.0, 1.0]
        context.DisableCaching()
        assert [port.Eval(context)[0] for _ in range(2)] == [2.0, 3.0]
        context.EnableCaching()
        assert [port.Eval(context)[0] for _ in range(2)] == [3.0, 3.0]

    def test_a_context_of_another_system_is_still_refused(self):
        diagram, gain, hold = chain()
        root = diagram.CreateDefaultContext()
        gain.get_output_port().Eval(gain.GetMyContextFromRoot(root))
        with pytest.raises(RuntimeError, match="not created for this"):
            gain.get_output_port().Eval(hold.GetMyContextFromRoot(root))


class TestState:
    def test_vectors_kept_follow_the_memory_when_it_moves(self):
        diagram, gain, hold = chain()
        root = diagram.CreateDefaultContext()
        context = hold.GetMyMutableContextFromRoot(root)
        context.SetDiscreteState([1.0])
        assert context.get_discrete_state_vector()[0] == 1.0
        gain.get_input_port().FixValue(gain.GetMyMutableContextFromRoot(root), [5.0])  # moves the memory
        context.SetDiscreteState([4.0])
        assert context.get_discrete_state_vector()[0] == 4.0
        assert hold.get_output_port().Eval(context) == [4.0]

    def test_a_vector_of_a_clone_is_its_own(self):
        hold = ZeroOrderHold(0.1, 2)
        context = hold.CreateDefaultContext()
        context.SetDiscreteState([1.0, 2.0])
        clone = context.Clone()
        clone.get_mutable_discrete_state_vector()[0] = 9.0
        assert context.get_discrete_state_vector().CopyToVector().tolist() == [1.0, 2.0]
        assert clone.get_discrete_state_vector().CopyToVector().tolist() == [9.0, 2.0]


class TestDefaults:
    def test_defaults_changed_after_the_first_context_reach_the_next(self):
        builder = DiagramBuilder()
        integrator = builder.AddSystem(Integrator([1.0]))
        linear = builder.AddSystem(LinearSystem(A=[[0.5]], B=[[1.0]], C=[[1.0]], D=[[0.0]], time_period=0.1))
        diagram = builder.Build()
        first = diagram.CreateDefaultContext()
        integrator.set_default_integral_value([7.0])
        linear.configure_default_state([8.0])
        second = diagram.CreateDefaultContext()
        assert first.get_continuous_state_vector().CopyToVector() == [1.0]
        assert second.get_continuous_state_vector().CopyToVector() == [7.0]
        assert second.get_discrete_state_vector().CopyToVector() == [8.0]

    def test_set_default_context_of_a_subsystem_leaves_the_others_alone(self):
        builder = DiagramBuilder()
        systems = [builder.AddSystem(Integrator([float(k)])) for k in range(3)]
        diagram = builder.Build()
        root = diagram.CreateDefaultContext()
        root.SetContinuousState([5.0, 6.0, 7.0])
        systems[1].SetDefaultContext(systems[1].GetMyMutableContextFromRoot(root))
        assert root.get_continuous_state_vector().CopyToVector().tolist() == [5.0, 1.0, 7.0]

    def test_outputs_not_computed_yet_begin_as_declared_in_every_context(self):
        block = PassThrough(value=[3.0, 4.0])
        for context in (block.CreateDefaultContext(), block.CreateDefaultContext()):
            block.get_input_port().FixValue(context, [1.0, 2.0])
            assert block.get_output_port().Eval(context).tolist() == [1.0, 2.0]


class TestVectors:
    @pytest.mark.parametrize("bad", [["a", 1.0], [[1.0, 2.0], 3.0]])
    def test_a_bad_list_changes_nothing(self, bad):
        vector = BasicVector([5.0, 6.0])
        with pytest.raises(TypeError):
            vector.SetFromVector(bad)
        assert vector.CopyToVector().tolist() == [5.0, 6.0]

    def test_sizes_must_agree(self):
        with pytest.raises(IndexError, match="size 1 does not match"):
            BasicVector([5.0, 6.0]).SetFromVector([1.0])

    def test_elements_are_floats_and_ends_are_checked(self):
        vector = BasicVector([5.0, 6.0])
        assert type(vector[1]) is float and vector[1] == 6.0
        for index in (2, -1):
            with pytest.raises(IndexError):
                vector[index]


class TestStates:
    def test_the_state_is_one_object_that_follows_every_change(self):
        system = LinearSystem(-np.eye(1), np.eye(1), np.eye(1), np.eye(1))
        context = system.CreateDefaultContext()
        state = context.get_state()
        assert context.get_state() is state is context.get_mutable_state()
        context.SetContinuousState([2.0])
        assert state.get_continuous_state().get_vector().GetAtIndex(0) == 2.0
        assert context.Clone().get_state() is not state

    def test_it_follows_memory_that_moves(self):
        diagram, gain, hold = chain()
        context = diagram.CreateDefaultContext()
        own = hold.GetMyContextFromRoot(context)
        own.get_state()
        gain.get_input_port().FixValue(gain.GetMyContextFromRoot(context), [5.0])
        own.SetDiscreteState([7.0])
        assert own.get_state().get_discrete_state(0).GetAtIndex(0) == 7.0


class TestParameters:
    class Scale(LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareVectorInputPort("u", 1)
            self.DeclareNumericParameter(BasicVector([1.0, 2.0]))
            self.DeclareAbstractParameter(Value(3.0))

    def test_they_are_one_object_that_follows_every_change(self):
        system = self.Scale()
        context = system.CreateDefaultContext()
        parameters = context.get_parameters()
        assert context.get_parameters() is parameters is context.get_mutable_parameters()
        context.get_mutable_numeric_parameter(0).SetAtIndex(1, 5.0)
        context.get_mutable_abstract_parameter(0).set_value(6.0)
        assert parameters.get_numeric_parameter(0).CopyToVector().tolist() == [1.0, 5.0]
        assert parameters.get_abstract_parameter(0).get_value() == 6.0
        assert context.Clone().get_parameters() is not parameters

    def test_they_follow_memory_that_moves(self):
        builder = DiagramBuilder()
        source = builder.AddSystem(ConstantVectorSource([2.0]))
        system = builder.AddSystem(self.Scale())
        builder.Connect(source.get_output_port(), system.get_input_port())
        root = builder.Build().CreateDefaultContext()
        context = system.GetMyMutableContextFromRoot(root)
        context.get_parameters()
        memory = context._store.S
        system.get_input_port().FixValue(context, [5.0])
        assert context._store.S is not memory
        context.get_mutable_numeric_parameter(0).SetAtIndex(0, 7.0)
        assert context.get_parameters().get_numeric_parameter(0).GetAtIndex(0) == 7.0
        context.get_mutable_parameters().get_mutable_numeric_parameter(0).SetAtIndex(0, 8.0)
        assert context.get_numeric_parameter(0).GetAtIndex(0) == 8.0


def test_an_abstract_value_of_a_vector_port_is_the_callers_own():
    diagram, gain, _ = chain()
    context = gain.GetMyContextFromRoot(diagram.CreateDefaultContext())
    for port in (gain.get_input_port(), gain.get_output_port()):
        before = port.Eval(context).tolist()
        value = port.EvalAbstract(context)
        value.get_mutable_value().SetAtIndex(0, -1.0)
        assert port.Eval(context).tolist() == before
    gain.get_output_port().Allocate().get_mutable_value().SetAtIndex(0, 9.0)
    assert gain.AllocateOutput().get_vector_data(0).GetAtIndex(0) != 9.0


def test_numbers_of_duals_taken_from_another_context_are_ones_own():
    system = Integrator(2).ToAutoDiffXd()
    source, target = system.CreateDefaultContext(), system.CreateDefaultContext()
    source.SetContinuousState(InitializeAutoDiff([1.0, 2.0]).ravel())
    target.SetStateAndParametersFrom(source)
    source.SetContinuousState(InitializeAutoDiff([3.0, 4.0]).ravel())
    taken = target.get_continuous_state_vector().CopyToVector()
    assert ExtractValue(taken).ravel().tolist() == [1.0, 2.0]
    assert ExtractGradient(taken).tolist() == [[1.0, 0.0], [0.0, 1.0]]
