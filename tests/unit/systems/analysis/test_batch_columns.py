"""Derivatives and updates at many states: equal to those at one after the other, on any number of threads."""

import numpy as np
import pytest

from sheldrake.common import Parallelism
from sheldrake.common.kernel import jit_enabled
from sheldrake.systems.analysis import BatchEvalTimeDerivatives, BatchEvalUniquePeriodicDiscreteUpdate, _batch
from sheldrake.systems.framework import DiagramBuilder, LeafSystem
from sheldrake.systems.primitives import Gain, LinearSystem

rng = np.random.default_rng(1)
A, B = 0.3 * rng.normal(size=(3, 3)), rng.normal(size=(3, 2))
N = 201
TIMES, STATES, INPUTS = np.linspace(0.0, 1.0, N), rng.normal(size=(3, N)), rng.normal(size=(2, N))
ways = pytest.mark.parametrize("parallelize", [None, 1, 2, 7, True, Parallelism(3)])


def linear(period):
    """A linear system behind a gain."""
    builder = DiagramBuilder()
    gain = builder.AddSystem(Gain(2.0, 2))
    system = builder.AddSystem(LinearSystem(A, B, np.eye(3), np.zeros((3, 2)), period))
    builder.Connect(gain.get_output_port(), system.get_input_port())
    builder.ExportInput(gain.get_input_port())
    return builder.Build()


@ways
def test_derivatives(parallelize):
    system = linear(0.0)
    context = system.CreateDefaultContext()
    found = BatchEvalTimeDerivatives(system, context, TIMES, STATES, INPUTS, parallelize=parallelize)
    np.testing.assert_allclose(found, A @ STATES + 2.0 * B @ INPUTS, rtol=1e-12, atol=1e-13)
    one_by_one = [
        BatchEvalTimeDerivatives(system, context, TIMES[k], STATES[:, k : k + 1], INPUTS[:, k : k + 1])[:, 0]
        for k in range(N)
    ]
    np.testing.assert_array_equal(found, np.transpose(one_by_one))
    assert context.get_time() == 0.0


@ways
def test_updates(parallelize):
    system = linear(0.1)
    context = system.CreateDefaultContext()
    found = BatchEvalUniquePeriodicDiscreteUpdate(system, context, TIMES, STATES, INPUTS, 4, parallelize=parallelize)
    x = STATES
    for _ in range(4):
        x = A @ x + 2.0 * B @ INPUTS
    np.testing.assert_allclose(found, x, rtol=1e-12, atol=1e-12)


@pytest.mark.skipif(not jit_enabled(), reason="asks about machine code; SHELDRAKE_JIT=0 switches it off")
@pytest.mark.parametrize("period", [0.0, 0.1])
def test_machine_code_is_what_python_would_give(period, monkeypatch):
    system = linear(period)
    call = BatchEvalUniquePeriodicDiscreteUpdate if period else BatchEvalTimeDerivatives
    native = call(system, system.CreateDefaultContext(), TIMES, STATES, INPUTS)
    monkeypatch.setattr(_batch, "_is_native", lambda *_: False)
    np.testing.assert_array_equal(native, call(system, system.CreateDefaultContext(), TIMES, STATES, INPUTS))


class Square(LeafSystem):
    """x' = x², in Python."""

    def __init__(self):
        super().__init__()
        self.DeclareContinuousState(1)

    def DoCalcTimeDerivatives(self, context, derivatives):
        x = context.get_continuous_state_vector()[0]
        derivatives.get_mutable_vector().SetFromVector([x**2])


def test_python_systems_take_part():
    system, x = Square(), np.arange(5.0)[None]
    found = BatchEvalTimeDerivatives(system, system.CreateDefaultContext(), np.zeros(5), x, None, parallelize=2)
    np.testing.assert_array_equal(found, x**2)


def test_a_missing_input_is_named():
    system = LinearSystem(A, B, np.eye(3), np.zeros((3, 2)), 0.0)
    from sheldrake.systems.framework import InputPortSelection

    with pytest.raises(RuntimeError, match="is not connected"):
        BatchEvalTimeDerivatives(
            system, system.CreateDefaultContext(), TIMES, STATES, None, InputPortSelection.kNoInput
        )
