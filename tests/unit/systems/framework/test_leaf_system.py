"""Systems that users write: declarations, events in all spellings, vector systems, abstract values."""

import math

import numpy as np
import pytest
from tests.unit.common.counting import calls_of

from sheldrake.common.value import Value
from sheldrake.systems import primitives
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import (
    BasicVector,
    DiscreteUpdateEvent,
    EventStatus,
    LeafSystem,
    PublishEvent,
    TriggerType,
    UnrestrictedUpdateEvent,
    VectorSystem,
    kUseDefaultName,
)
from sheldrake.systems.primitives import Integrator


class Told(LeafSystem):
    """Keeps a list of what happened."""

    def __init__(self):
        super().__init__()
        self.story = []

    def tell(self, name):
        def handle(context, event, *state):
            self.story.append((name, event.get_trigger_type().name, context.get_time()))

        return handle


def test_events_as_objects():
    class System(Told):
        def __init__(self):
            super().__init__()
            self.DeclareDiscreteState(1)
            self.DeclarePeriodicEvent(1.0, 0.5, PublishEvent(TriggerType.kPeriodic, self.tell("p")))
            self.DeclarePerStepEvent(PublishEvent(self.tell("step")))
            self.DeclareInitializationEvent(UnrestrictedUpdateEvent(callback=self.tell("u")))
            self.DeclareInitializationEvent(PublishEvent(system_callback=lambda s, c, e: s.tell("i")(c, e)))

    system = System()
    Simulator(system).AdvanceTo(0.75)
    assert system.story == [
        ("u", "kInitialization", 0.0),
        ("i", "kInitialization", 0.0),
        ("step", "kPerStep", 0.0),
        ("step", "kPerStep", 0.5),
        ("p", "kPeriodic", 0.5),
        ("step", "kPerStep", 0.75),
    ]


def test_an_overridden_dispatcher_gets_what_happens_together():
    class System(Told):
        def __init__(self):
            super().__init__()
            self.DeclareDiscreteState(1)
            for name in "ab":
                self.DeclarePeriodicEvent(1.0, 0.0, PublishEvent(self.tell(name)))
            self.DeclarePeriodicDiscreteUpdateEvent(0.5, 0.0, lambda context, x: None)

        def DoPublish(self, context, events):
            self.story.append(len(events))
            LeafSystem.DoPublish(self, context, events)

        def DoCalcDiscreteVariableUpdates(self, context, events, discrete_state):
            discrete_state.get_mutable_vector()[0] = context.get_discrete_state_vector()[0] + len(events)

    system = System()
    simulator = Simulator(system)
    simulator.AdvanceTo(1.0)
    together = [[2, ("a", "kPeriodic", t), ("b", "kPeriodic", t)] for t in (0.0, 1.0)]
    assert system.story == together[0] + together[1]
    assert simulator.get_context().get_discrete_state_vector()[0] == 2.0
    system.story.clear()
    system.ForcedPublish(simulator.get_context())
    assert system.story == [1]


def test_a_vector_system_may_declare_its_update_with_a_function():
    class Counter(VectorSystem):
        def __init__(self):
            super().__init__(0, 1, False)
            self.DeclareDiscreteState(1)
            self.DeclarePeriodicDiscreteUpdateEvent(0.1, 0.0, self.count)

        def count(self, context, x_next):
            x_next[0] = context.get_discrete_state_vector()[0] + 1.0

        def DoCalcVectorOutput(self, context, u, x, y):
            y[:] = x

    system = Counter()
    simulator = Simulator(system)
    simulator.AdvanceTo(0.55)
    assert system.get_output_port().Eval(simulator.get_context()) == [6.0]


@pytest.mark.parametrize(
    ("answer", "state", "updates"),
    [(None, 3.0, 3), (EventStatus.Succeeded(), 3.0, 3), (EventStatus.DidNothing(), 0.0, 0)],
)
def test_what_an_update_answers(answer, state, updates):
    class System(LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareDiscreteState(1)
            self.DeclarePeriodicDiscreteUpdateEvent(0.1, 0.0, self.update)

        def update(self, context, x_next):
            x_next[0] += 1.0
            return answer

    simulator = Simulator(System())
    assert simulator.AdvanceTo(0.25).succeeded()
    assert simulator.get_context().get_discrete_state_vector()[0] == state
    assert simulator.get_num_discrete_updates() == updates
    assert simulator.get_num_steps_taken() == 3


def test_a_wrong_answer_is_an_error():
    class System(LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclarePerStepPublishEvent(lambda context: 3)

    with pytest.raises(RuntimeError, match="must return None or an EventStatus, not 3"):
        Simulator(System()).Initialize()


@pytest.mark.parametrize("discrete", [False, True])
def test_vector_system(discrete):
    class System(VectorSystem):
        def __init__(self):
            super().__init__(2, 1, True)
            if discrete:
                self.DeclareDiscreteState(2)
                self.DeclarePeriodicDiscreteUpdateEvent(0.1, 0.0, lambda context, x: None)
            else:
                self.DeclareContinuousState(2)

        def DoCalcVectorOutput(self, context, u, x, y):
            y[:] = u[0] + x[1]

        def DoCalcVectorTimeDerivatives(self, context, u, x, xdot):
            xdot[:] = x + u

        def DoCalcVectorDiscreteVariableUpdates(self, context, u, x, x_next):
            x_next[:] = x - u

    system = System()
    context = system.CreateDefaultContext()
    (context.SetDiscreteState if discrete else context.SetContinuousState)([10.0, 20.0])
    system.get_input_port().FixValue(context, [1.0, 2.0])
    assert system.GetInputPort("u0").size() == 2
    assert system.GetOutputPort("y0").Eval(context) == 21.0
    if discrete:
        assert np.array_equal(system.EvalUniquePeriodicDiscreteUpdate(context).value(), [9.0, 18.0])
    else:
        assert np.array_equal(system.EvalTimeDerivatives(context).CopyToVector(), [11.0, 22.0])


class Abstract(LeafSystem):
    """A dictionary as state, shown and changed."""

    def __init__(self):
        super().__init__()
        self.DeclareAbstractInputPort("in", Value[object]())
        index = self.DeclareAbstractState(Value({"a": 1}))
        self.DeclareAbstractOutputPort(
            "out", lambda: Value({}), self.calc, prerequisites_of_calc={self.abstract_state_ticket(index)}
        )
        self.DeclareAbstractOutputPort("bad", lambda: 3, self.calc, {self.nothing_ticket()})
        self.DeclarePeriodicUnrestrictedUpdateEvent(0.1, 0.0, self.update)

    def calc(self, context, output):
        output.set_value(dict(context.get_abstract_state(0).get_value()))

    def update(self, context, state):
        assert state.get_abstract_state(0).get_value() is not context.get_abstract_state(0).get_value()
        state.get_mutable_abstract_state(0).get_mutable_value()["a"] += 1
        if state.get_abstract_state(0).get_value()["a"] == 9:
            raise ValueError("enough")


@pytest.mark.parametrize("native", [False, True])
def test_abstract_state_is_updated_whole_or_not_at_all(native):
    system = Abstract()
    simulator = Simulator(system)
    simulator._native = native
    simulator.AdvanceTo(0.35)
    context = simulator.get_mutable_context()
    assert system.get_output_port(0).Eval(context) == {"a": 5}
    assert not system.HasDirectFeedthrough(0)
    with pytest.raises(ValueError, match="enough"):
        simulator.AdvanceTo(2.0)
    assert system.get_output_port(0).Eval(context) == {"a": 8}
    context.SetAbstractState(0, {"z": 1})
    assert system.get_output_port(0).Eval(context) == {"z": 1}
    with pytest.raises(RuntimeError, match=r"'bad' .* must give an AbstractValue, not 3"):
        system.get_output_port(1).Eval(context)


def test_vector_input_takes_abstract_values_of_vectors():
    system = LeafSystem()
    port = system.DeclareVectorInputPort("u", 2)
    context = system.CreateDefaultContext()
    port.FixValue(context, Value(BasicVector([1.0, 2.0])))
    assert port.Eval(context).tolist() == [1.0, 2.0]
    with pytest.raises(RuntimeError, match="containing type str is not suitable"):
        port.FixValue(context, Value("x"))
    assert port.Eval(context).tolist() == [1.0, 2.0]


def test_abstract_input_takes_what_its_model_takes():
    system = Abstract()
    context = system.CreateDefaultContext()
    port = system.get_input_port()
    with pytest.raises(RuntimeError, match=r"InputPort\[0\] \(in\) of System"):
        port.Eval(context)
    for value in (3, [1, 2], Value([1, 2])):
        port.FixValue(context, value)
    assert port.Eval(context) == [1, 2]
    typed = LeafSystem()
    typed.DeclareAbstractInputPort("text", Value("x"))
    context = typed.CreateDefaultContext()
    fixed = typed.get_input_port().FixValue(context, "hello")
    fixed.GetMutableData().set_value("world")
    assert typed.get_input_port().Eval(context) == "world"
    with pytest.raises(TypeError):
        typed.get_input_port().FixValue(context, 3)
    with pytest.raises(
        RuntimeError, match=r"FixValue\(\): input port 'text' .* takes a Value\[.*str.*\], not a Value\[.*float"
    ):
        typed.get_input_port().FixValue(context, Value(1.0))


def test_a_fixed_value_may_be_changed_in_place():
    system = Integrator(2)
    context = system.CreateDefaultContext()
    fixed = system.get_input_port().FixValue(context, [1.0, 2.0])
    assert np.array_equal(system.EvalTimeDerivatives(context).CopyToVector(), [1.0, 2.0])
    fixed.GetMutableData().get_mutable_value().SetFromVector([3.0, 4.0])
    assert np.array_equal(system.EvalTimeDerivatives(context).CopyToVector(), [3.0, 4.0])
    with pytest.raises(
        RuntimeError, match=r"FixValue\(\): input port 'u0' .* takes a vector of size 2, not one of size 3"
    ):
        system.get_input_port().FixValue(context, [1.0, 2.0, 3.0])
    with pytest.raises(TypeError):
        system.get_input_port().FixValue(context, "a")


class Declaring(LeafSystem):
    """Nothing yet."""

    def calc(self, context, output):
        pass


def test_declarations_in_every_spelling():
    system = Declaring()
    system.DeclareVectorOutputPort(name="a", size=2, calc=system.calc)
    system.DeclareVectorOutputPort(kUseDefaultName, BasicVector([1.0, 2.0]), system.calc, {system.nothing_ticket()})
    system.DeclareVectorInputPort(name="u", size=2)
    system.DeclareVectorInputPort("v", model_vector=BasicVector(3))
    system.DeclareContinuousState(num_q=2, num_v=1, num_z=1)
    system.DeclareDiscreteState(vector=[1.0])
    system.DeclareDiscreteState(num_state_variables=2)
    system.DeclareNumericParameter(BasicVector([5.0]))
    context = system.CreateDefaultContext()
    assert [system.HasDirectFeedthrough(j) for j in range(2)] == [True, False]
    assert system.get_output_port(1).get_name() == "y1"
    assert np.array_equal(system.get_output_port(1).Eval(context), [1.0, 2.0])
    assert np.all(np.isnan(system.get_output_port(0).Eval(context)))
    assert context.num_total_states() == 7
    assert system.AllocateDiscreteVariables().num_groups() == 2
    assert system.AllocateTimeDerivatives().num_v() == 1


@pytest.mark.parametrize(
    ("call", "kind", "text"),
    [
        (lambda s: s.DeclareVectorOutputPort("d", 1, None), TypeError, "cannot be called"),
        (lambda s: s.DeclareVectorInputPort("", 1), RuntimeError, "must not be empty"),
        (lambda s: s.DeclareVectorInputPort("u", -1), TypeError, "negative"),
        (lambda s: s.DeclarePeriodicPublishEvent(0.0, 0.0, s.calc), RuntimeError, "period must be positive"),
        (lambda s: s.DeclarePeriodicPublishEvent(1.0, -1.0, s.calc), RuntimeError, "offset not negative"),
        (lambda s: s.DeclareDiscreteState("a"), TypeError, "vector of numbers"),
        (lambda s: s.DeclareContinuousState(1, 2, 3), RuntimeError, "num_v may not exceed num_q"),
        (lambda s: s.DeclareAbstractState(3), TypeError, "expected an AbstractValue"),
        (lambda s: s.DeclareStateOutputPort("s", 3), TypeError, "no index of a state"),
        (lambda s: s.DeclareVectorOutputPort("d", 1, s.calc, set()), RuntimeError, "may not be empty"),
        (lambda s: s.DeclarePerStepEvent(3), TypeError, "no event"),
        (lambda s: PublishEvent(3), TypeError, "incompatible constructor"),
        (lambda s: DiscreteUpdateEvent(callback=s.calc, other=1), TypeError, "incompatible constructor"),
    ],
)
def test_bad_declarations_change_nothing(call, kind, text):
    system = Declaring()
    with pytest.raises(kind, match=text):
        call(system)
    assert system.num_input_ports() == system.num_output_ports() == system.num_discrete_state_groups() == 0


def test_forgotten_super_init():
    class Forgetful(LeafSystem):
        def __init__(self):
            pass

    with pytest.raises(TypeError, match=r"Forgetful.__init__\(\) must be called"):
        Forgetful().DeclareDiscreteState(1)


def test_continuous_state_needs_derivatives():
    system = LeafSystem()
    system.DeclareContinuousState(1)
    with pytest.raises(NotImplementedError, match="must override DoCalcTimeDerivatives"):
        system.EvalTimeDerivatives(system.CreateDefaultContext())


def test_outputs_derivatives_and_residuals():
    system = Integrator([1.0])
    context = system.CreateDefaultContext()
    system.get_input_port().FixValue(context, [3.0])
    output = system.AllocateOutput()
    system.CalcOutput(context, output)
    assert output.num_ports() == 1 and output.get_vector_data(0)[0] == 1.0
    derivatives = system.AllocateTimeDerivatives()
    system.CalcTimeDerivatives(context, derivatives)
    assert derivatives[0] == 3.0
    derivatives[0] = 5.0
    assert system.CalcImplicitTimeDerivativesResidual(context, derivatives) == 2.0
    assert system.EvalVectorInput(context, 0)[0] == 3.0 and system.EvalPotentialEnergy(context) == 0.0


def test_a_system_whose_init_was_not_called_is_refused():
    class Forgets(LeafSystem):
        def __init__(self):
            self.x = 1

    class Late(LeafSystem):
        def __init__(self):
            self.DeclareVectorInputPort("u", 1)
            super().__init__()

    class Wrong(LeafSystem):
        def __init__(self):
            super().__init__()
            self.x = self.y

    for cls in (Forgets, Late):
        with pytest.raises(TypeError, match=rf"{cls.__name__}.__init__\(\) must be called"):
            cls()
    with pytest.raises(AttributeError, match="no attribute 'y'"):
        Wrong()


def test_a_unique_periodic_update_is_computed_once_until_something_is_written():
    class Counting(LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareDiscreteState(1)
            self.DeclareVectorInputPort("u", 1)
            self.DeclarePeriodicDiscreteUpdateEvent(0.1, 0.0, self.update)
            self.calls = 0

        def update(self, context, state):
            self.calls += 1
            state.set_value([context.get_discrete_state_vector()[0] + self.get_input_port().Eval(context)[0]])

    system = Counting()
    context = system.CreateDefaultContext()
    system.get_input_port().FixValue(context, [2.0])
    for expected, calls in ((2.0, 1), (2.0, 1)):
        found = system.EvalUniquePeriodicDiscreteUpdate(context)
        assert (found.value()[0], system.calls) == (expected, calls)
        found.set_value([9.0])  # its own
    context.SetDiscreteState([1.0])
    assert system.EvalUniquePeriodicDiscreteUpdate(context).value()[0] == 3.0
    system.get_input_port().FixValue(context, [4.0])
    assert system.EvalUniquePeriodicDiscreteUpdate(context).value()[0] == 5.0
    context.DisableCaching()
    system.EvalUniquePeriodicDiscreteUpdate(context)
    assert system.calls == 4


@pytest.mark.parametrize("size", [2.5, 1.0, math.nan, math.inf, -1, np.float64(2.0)])
def test_sizes_are_whole_numbers(size):
    for make in (
        lambda: LeafSystem().DeclareVectorInputPort("u", size),
        lambda: LeafSystem().DeclareContinuousState(size),
        lambda: LeafSystem().DeclareDiscreteState(size),
        lambda: primitives.Integrator(size),
        lambda: primitives.PassThrough(size),
        lambda: primitives.Gain(1.0, size),
        lambda: primitives.Adder(size, 1),
        lambda: primitives.Adder(1, size),
        lambda: primitives.ZeroOrderHold(0.1, size),
        lambda: primitives.DiscreteTimeDelay(0.1, size, 1),
        lambda: primitives.VectorLogSink(size),
    ):
        with pytest.raises(TypeError, match=r"size|num_inputs"):
            make()


def test_a_group_of_parameters_is_one_object_and_inputs_keep_their_own_numbers():
    system = LeafSystem()
    system.DeclareNumericParameter(BasicVector([1.0, 2.0]))
    port = system.DeclareVectorInputPort("u", 2)
    context = system.CreateDefaultContext()
    vector = context.get_numeric_parameter(0)
    assert context.get_numeric_parameter(0) is vector
    context.get_mutable_numeric_parameter(0).SetFromVector([3.0, 4.0])
    np.testing.assert_array_equal(vector.value(), [3.0, 4.0])
    for given in (np.array([5.0, 6.0]), [5.0, 6], [np.float64(5.0), 6.0]):
        port.FixValue(context, given)
        given[0] = 9.0
        np.testing.assert_array_equal(port.Eval(context), [5.0, 6.0])
    with pytest.raises(RuntimeError, match="takes a vector of size 2, not one of size 3"):
        port.FixValue(context, [1.0, 2.0, 3.0])


def test_a_port_costs_the_same_however_many_there_are():
    def declare(count):
        system = LeafSystem()
        for i in range(count):
            system.DeclareVectorInputPort(f"u{i}", 1)
            system.DeclareVectorOutputPort(f"y{i}", 1, lambda context, output: None)

    assert calls_of(lambda: declare(80)) < 2.2 * calls_of(lambda: declare(40))


def test_a_name_of_a_port_is_free_where_its_declaration_failed():
    system = LeafSystem()
    with pytest.raises(TypeError):
        system.DeclareVectorOutputPort("y", 1, None)
    system.DeclareVectorOutputPort("y", 1, lambda context, output: None)
    with pytest.raises(RuntimeError, match="already has an output port named y"):
        system.DeclareVectorOutputPort("y", 1, lambda context, output: None)
    assert system.DeclareVectorInputPort("y", 1).get_name() == "y"
