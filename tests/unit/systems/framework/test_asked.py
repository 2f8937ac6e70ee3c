"""Derivatives and updates that are asked for again and again come from one native call: same numbers, same errors."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest

from sheldrake.all import (
    Adder,
    ConstantVectorSource,
    DiagramBuilder,
    LeafSystem,
    LinearSystem,
    MatrixGain,
    SymbolicVectorSystem,
    Variable,
    sqrt,
)
from sheldrake.common.kernel import jit_enabled
from sheldrake.systems.framework._engine.asked import DERIVATIVES, UPDATE

A, B = np.array([[0.0, 1.0], [-2.0, -0.3]]), np.array([[0.0], [1.0]])
K = np.array([[-1.0, 0.5]])


def closed_loop():
    builder = DiagramBuilder()
    system = builder.AddSystem(LinearSystem(A, B, np.eye(2), np.zeros((2, 1))))
    gain, adder = builder.AddSystem(MatrixGain(K)), builder.AddSystem(Adder(2, 1))
    builder.Connect(system.get_output_port(), gain.get_input_port())
    builder.Connect(gain.get_output_port(), adder.get_input_port(0))
    builder.ExportInput(adder.get_input_port(1), "u")
    builder.Connect(adder.get_output_port(), system.get_input_port())
    return builder.Build(), system


def test_numbers_are_those_of_the_state_and_the_input():
    diagram, system = closed_loop()
    context = diagram.CreateDefaultContext()
    derivatives = diagram.AllocateTimeDerivatives()
    diagram.get_input_port().FixValue(context, [0.0])
    rng = np.random.default_rng(1)
    for _ in range(10):
        x, u = rng.normal(size=2), rng.normal(size=1)
        context.SetContinuousState(x)
        diagram.get_input_port().FixValue(context, u)
        expected = (A + B @ K) @ x + B @ u
        np.testing.assert_allclose(diagram.EvalTimeDerivatives(context).CopyToVector(), expected, rtol=1e-15)
        diagram.CalcTimeDerivatives(context, derivatives)
        np.testing.assert_array_equal(derivatives.CopyToVector(), diagram.EvalTimeDerivatives(context).CopyToVector())
        inner = system.EvalTimeDerivatives(system.GetMyContextFromRoot(context))
        np.testing.assert_array_equal(inner.CopyToVector(), derivatives.CopyToVector())
    assert jit_enabled() == (context._reads.get(DERIVATIVES) is not None)


def test_what_was_given_stays_as_it_is():
    diagram, _ = closed_loop()
    context = diagram.CreateDefaultContext()
    diagram.get_input_port().FixValue(context, [0.0])
    kept = []
    for k in range(6):
        context.SetContinuousState([float(k), 0.0])
        kept.append(diagram.EvalTimeDerivatives(context))
    assert [one.CopyToVector()[1] for one in kept] == [-3.0 * k for k in range(6)]


def test_a_missing_input_is_named():
    diagram, _ = closed_loop()
    context = diagram.CreateDefaultContext()
    for _ in range(6):
        with pytest.raises(RuntimeError, match=r"not connected.*exported as input port 'u'"):
            diagram.EvalTimeDerivatives(context)


def test_a_row_that_fails_is_explained_and_later_ones_are_not_hindered():
    x = Variable("x")
    system = SymbolicVectorSystem(state=[x], dynamics=[sqrt(x)])
    context = system.CreateDefaultContext()
    for value in (4.0, -1.0, 9.0, 1.0, -4.0, 16.0, -9.0, 25.0):
        context.SetContinuousState([value])
        if value < 0.0:
            with pytest.raises(ValueError, match=rf"sqrt\({value:g}\)"):
                system.EvalTimeDerivatives(context)
        else:
            assert system.EvalTimeDerivatives(context).CopyToVector() == [np.sqrt(value)]


def test_caches_that_are_disabled_or_frozen():
    diagram, _ = closed_loop()
    context = diagram.CreateDefaultContext()
    diagram.get_input_port().FixValue(context, [0.0])
    for k in range(5):
        context.SetContinuousState([float(k), 0.0])
        diagram.EvalTimeDerivatives(context)
    context.DisableCaching()
    assert diagram.EvalTimeDerivatives(context).CopyToVector()[1] == -12.0
    context.EnableCaching()
    context.SetContinuousState([7.0, 0.0])
    context.FreezeCache()
    with pytest.raises(RuntimeError, match="frozen"):
        diagram.EvalTimeDerivatives(context)
    context.UnfreezeCache()
    assert diagram.EvalTimeDerivatives(context).CopyToVector()[1] == -21.0


def test_an_input_that_gets_memory_of_its_own_moves_them():
    builder = DiagramBuilder()
    system = builder.AddSystem(LinearSystem(A, B, np.eye(2), np.zeros((2, 1))))
    source = builder.AddSystem(ConstantVectorSource([2.0]))
    builder.Connect(source.get_output_port(), system.get_input_port())
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    for _ in range(5):
        context.SetContinuousState([0.0, 0.0])
        assert diagram.EvalTimeDerivatives(context).CopyToVector()[1] == 2.0
    system.get_input_port().FixValue(system.GetMyContextFromRoot(context), [5.0])
    for _ in range(5):
        context.SetContinuousState([0.0, 0.0])
        assert diagram.EvalTimeDerivatives(context).CopyToVector()[1] == 5.0


def test_a_system_in_python_is_asked():
    class Motion(LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareContinuousState(1)
            self.factor = 1.0

        def DoCalcTimeDerivatives(self, context, derivatives):
            derivatives.SetFromVector(self.factor * context.get_continuous_state_vector().CopyToVector())

    system = Motion()
    context = system.CreateDefaultContext()
    for k in range(6):
        system.factor = float(k)
        context.SetContinuousState([2.0])
        assert system.EvalTimeDerivatives(context).CopyToVector() == [2.0 * k]


def test_contexts_go_when_nobody_holds_them():
    diagram, _ = closed_loop()
    context = diagram.CreateDefaultContext()
    diagram.get_input_port().FixValue(context, [0.0])
    for k in range(5):
        context.SetContinuousState([float(k), 0.0])
        diagram.EvalTimeDerivatives(context)
    gc.disable()
    try:
        store = weakref.ref(context._store)
        del context
        assert store() is None
    finally:
        gc.enable()


def sampled_loop(period=0.1, second=None):
    """Two sampled systems, each with the state of the other as input."""
    builder = DiagramBuilder()
    Ad, Bd = np.array([[0.5]]), np.array([[1.0]])
    one = builder.AddSystem(LinearSystem(Ad, Bd, np.eye(1), np.zeros((1, 1)), period))
    two = builder.AddSystem(LinearSystem(2.0 * Ad, Bd, np.eye(1), np.zeros((1, 1)), second or period))
    adder = builder.AddSystem(Adder(2, 1))
    builder.Connect(two.get_output_port(), adder.get_input_port(0))
    builder.ExportInput(adder.get_input_port(1), "u")
    builder.Connect(adder.get_output_port(), one.get_input_port())
    builder.Connect(one.get_output_port(), two.get_input_port())
    return builder.Build(), one


def test_updates_are_those_of_the_state_and_the_input():
    diagram, one = sampled_loop()
    context = diagram.CreateDefaultContext()
    diagram.get_input_port().FixValue(context, [0.0])
    own = one.GetMyMutableContextFromRoot(context)
    rng, given = np.random.default_rng(2), []
    for k in range(10):
        if k == 5:
            context = context.Clone()  # what has been asked often enough is native in new contexts at once
            own = one.GetMyMutableContextFromRoot(context)
        (x, y), u = rng.normal(size=2), rng.normal()
        context.get_mutable_discrete_state(0).SetFromVector([x])
        context.get_mutable_discrete_state(1).SetFromVector([y])
        diagram.get_input_port().FixValue(context, [u])
        found = diagram.EvalUniquePeriodicDiscreteUpdate(context)
        expected = [0.5 * x + y + u, y + x]
        np.testing.assert_allclose([found.value(0)[0], found.value(1)[0]], expected, atol=1e-15)  # terms of about 1
        assert one.EvalUniquePeriodicDiscreteUpdate(own).value()[0] == found.value(0)[0]
        given.append((found, found.value(0)[0]))
        assert context.get_discrete_state(0)[0] == x
    assert all(values.value(0)[0] == number for values, number in given)
    assert jit_enabled() == (context._reads.get(UPDATE) is not None)


def test_updates_without_an_input_or_one_timing_are_refused_each_time():
    diagram, _ = sampled_loop()
    context = diagram.CreateDefaultContext()
    for _ in range(6):
        with pytest.raises(RuntimeError, match=r"not connected.*exported as input port 'u'"):
            diagram.EvalUniquePeriodicDiscreteUpdate(context)
    diagram, _ = sampled_loop(second=0.2)
    context = diagram.CreateDefaultContext()
    diagram.get_input_port().FixValue(context, [0.0])
    for _ in range(6):
        with pytest.raises(RuntimeError, match="multiple timing attributes"):
            diagram.EvalUniquePeriodicDiscreteUpdate(context)


def test_updates_of_python_are_called_each_time():
    class Counts(LeafSystem):
        calls = 0

        def __init__(self):
            super().__init__()
            self.DeclareDiscreteState(1)
            self.DeclarePeriodicDiscreteUpdateEvent(0.1, 0.0, self.update)

        def update(self, context, values):
            self.calls += 1
            values.set_value(2.0 * context.get_discrete_state_vector().value() + self.calls)

    system = Counts()
    context = system.CreateDefaultContext()
    for k in range(1, 7):
        context.SetDiscreteState([1.0])
        assert system.EvalUniquePeriodicDiscreteUpdate(context).value()[0] == 2.0 + k
        assert system.EvalUniquePeriodicDiscreteUpdate(context).value()[0] == 2.0 + k  # nothing has changed
    assert context._reads.get(UPDATE) is None
