"""Derivatives that neither time nor continuous state influences are computed once a step, with the same bits."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.common.kernel import Vector, Vectors, kernel
from sheldrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from sheldrake.systems.framework import DiagramBuilder, LeafSystem
from sheldrake.systems.primitives import ConstantVectorSource, Integrator, Sine


@kernel(top=True)
def rates(p: Vector, u: Vectors, xdot: Vector) -> None:
    for k in range(xdot.shape[0]):
        xdot[k] = p[0] * u[0][k]


@kernel(top=True)
def decay(xc: Vector, xdot: Vector) -> None:
    for k in range(xdot.shape[0]):
        xdot[k] = -xc[k]


class Rates(LeafSystem):
    """Continuous state that grows at the rate of an input."""

    def __init__(self, derivatives=rates):
        super().__init__()
        self.DeclareVectorInputPort("rate", 2)
        self.DeclareNumericParameter(np.array([0.7]))
        self.DeclareContinuousState(2)
        self.DeclareTimeDerivatives(derivatives)


def run(system, source, scheme, steady=None):
    """Bits of the state after some steps, evaluations, and whether the derivatives count as steady."""
    builder = DiagramBuilder()
    one, other = builder.AddSystem(system), builder.AddSystem(source)
    builder.Connect(other.get_output_port(0), one.get_input_port())
    simulator = Simulator(builder.Build())
    simulator.get_mutable_context().SetContinuousState(np.array([0.3, -1.7]))
    ResetIntegratorFromFlags(simulator, scheme, 0.01)
    simulator.Initialize()
    span = simulator._span
    found = bool(span.program.steady)
    if steady is not None:  # in a copy: the table is that of all diagrams like this
        span.program, span._logs = span.program._replace(size=span.program.size.copy()), None
        span.program.steady = steady
    simulator.AdvanceTo(0.1234)
    x = simulator.get_context().get_continuous_state_vector().CopyToVector()
    return x.tobytes(), simulator.get_integrator().get_num_derivative_evaluations(), found


@pytest.mark.parametrize("scheme", ["runge_kutta3", "runge_kutta2", "explicit_euler", "runge_kutta5"])
def test_steady_derivatives_give_the_same_bits_and_counts(scheme):
    def source():
        return ConstantVectorSource([0.1, 1.0 / 3.0])

    bits, count, steady = run(Rates(), source(), scheme)
    assert steady
    assert (bits, count) == run(Rates(), source(), scheme, steady=0)[:2]


@pytest.mark.parametrize(
    ("system", "source"),
    [(Rates(decay), ConstantVectorSource([0.1, 0.2])), (Rates(), Sine(1.0, 2.0, 0.0, 2))],
    ids=["by xc", "by time"],
)
def test_derivatives_that_change_within_a_step_are_not_steady(system, source):
    assert not run(system, source, "runge_kutta3")[2]


def test_an_integrator_of_another_is_not_steady():
    builder = DiagramBuilder()
    first, second = (builder.AddSystem(Integrator(1)) for _ in range(2))
    builder.Connect(first.get_output_port(), second.get_input_port())
    builder.ExportInput(first.get_input_port())
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    diagram.get_input_port(0).FixValue(context, [2.0])
    simulator = Simulator(diagram, context)
    simulator.AdvanceTo(3.0)
    np.testing.assert_allclose(context.get_continuous_state_vector().CopyToVector(), [6.0, 9.0], rtol=1e-12)
