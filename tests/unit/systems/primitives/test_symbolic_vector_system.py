"""SymbolicVectorSystem: expressions run as machine code, with the values and the errors of the expressions."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.all import Expression as E
from sheldrake.all import Simulator, SymbolicVectorSystem, Variable, cos, if_then_else, sin, sqrt
from sheldrake.all import max as drake_max
from sheldrake.all import min as drake_min
from sheldrake.common.kernel import Kernel
from sheldrake.systems.framework._declarations import Callback

T, X, V, U, A = (Variable(name) for name in "txvua")


def all_functions() -> list[E]:
    x, v = E(X), E(V)
    one = sin(x) + cos(x) * np.tan(x) + np.arcsin(0.3 * x) - np.arccos(0.2 * v) + np.arctan(v) + np.arctan2(v, x)
    two = np.sinh(x) - np.cosh(v) + np.tanh(x * v) + np.exp(-x) * np.log(x) + abs(v) + np.ceil(v) + np.floor(v) * 3.0
    three = drake_min(x, v) * drake_max(x, U) + x**3 / v - (x * x + 1.0) ** 0.3 + x**-2 + sqrt(x) * A - 2.5
    return [one, two, three, E(T) * 2.0, E(X), E(-0.0), U * A]


def kinds(system: SymbolicVectorSystem, context: object) -> list[type]:
    return [type(row.calc) for row in context._store.layout.rows]


@pytest.mark.parametrize("period", [0.0, 0.1])
def test_kernels_give_what_expressions_do(period):
    functions = all_functions()
    system = SymbolicVectorSystem(T, [X, V], [U], [A], functions[:2], functions[2:], period)
    context = system.CreateDefaultContext()
    env = {T: 0.3, X: 0.7, V: -1.2, U: 2.0, A: -0.4}
    context.SetTime(env[T])
    (context.SetDiscreteState if period else context.SetContinuousState)([env[X], env[V]])
    context.get_mutable_numeric_parameter(0).SetFromVector([env[A]])
    system.get_input_port().FixValue(context, [env[U]])
    expected = np.array([f.Evaluate(env) for f in functions])
    assert set(kinds(system, context)) == {Kernel}
    np.testing.assert_array_equal(system.get_output_port().Eval(context), expected[2:])
    if period:
        motion = system.EvalUniquePeriodicDiscreteUpdate(context).get_vector(0).CopyToVector()
    else:
        motion = system.EvalTimeDerivatives(context).CopyToVector()
    np.testing.assert_array_equal(motion, expected[:2])


@pytest.mark.parametrize("period", [0.0, 0.1])
def test_on_other_scalars_the_same_functions_run(period):
    functions = all_functions()
    system = SymbolicVectorSystem(T, [X, V], [U], [A], functions[:2], functions[3:], period)
    for converted in (system.ToAutoDiffXd(), system.ToSymbolic()):
        assert set(kinds(converted, converted.CreateDefaultContext())) == {Callback}
    again = system.Clone()
    assert set(kinds(again, again.CreateDefaultContext())) == {Kernel}


def test_a_condition_is_evaluated_in_python():
    system = SymbolicVectorSystem(state=[X], dynamics=[if_then_else(X > 0.5, E(-1.0), E(-2.0))], output=[X * 2.0])
    context = system.CreateDefaultContext()
    assert set(kinds(system, context)) == {Kernel, Callback}
    context.SetContinuousState([1.0])
    assert system.EvalTimeDerivatives(context).CopyToVector() == -1.0
    context.SetContinuousState([0.0])
    assert system.EvalTimeDerivatives(context).CopyToVector() == -2.0


@pytest.mark.parametrize(
    ("dynamics", "error", "text"),
    [
        (1.0 / E(X), RuntimeError, "Division by zero: 1 / 0"),
        (np.log(X - 1.0), ValueError, r"log\(-1\) : numerical argument out of domain"),
        (sqrt(X - 1.0), ValueError, r"sqrt\(-1\)"),
        (np.arcsin(X + 2.0), ValueError, r"asin\(2\)"),
        (np.arccos(X - 2.0), ValueError, r"acos\(-2\)"),
        ((X - 2.0) ** 0.5, ValueError, r"pow\(-2, 0.5\)"),
    ],
)
def test_a_value_that_does_not_exist_is_named(dynamics, error, text):
    """Whichever of both fails, and whatever numbers the other has."""
    for system in (
        SymbolicVectorSystem(state=[X], dynamics=[dynamics], output=[X * 3.0 + 7.0]),
        SymbolicVectorSystem(state=[X], dynamics=[0.0 * E(X)], output=[dynamics]),
    ):
        context = system.CreateDefaultContext()
        with pytest.raises(error, match=text):
            system.EvalTimeDerivatives(context)
            system.get_output_port().Eval(context)


def test_a_value_that_is_nan_is_named():
    system = SymbolicVectorSystem(state=[X], input=[U], dynamics=[U + 1.0], output=[X])
    context = system.CreateDefaultContext()
    system.get_input_port().FixValue(context, [np.nan])
    with pytest.raises(RuntimeError, match="the value of u is nan"):
        Simulator(system, context).AdvanceTo(0.1)
    assert system.get_output_port().Eval(context) == 0.0
    assert not system.HasAnyDirectFeedthrough()
