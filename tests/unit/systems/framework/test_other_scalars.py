"""The same systems on AutoDiffXd and on symbols: only the context's memory is another."""

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.common.value import Value
from sheldrake.symbolic import Expression, Variable
from sheldrake.systems.analysis import Simulator, Simulator_
from sheldrake.systems.framework import (
    BasicVector,
    BasicVector_,
    DiagramBuilder,
    DiagramBuilder_,
    LeafSystem,
    LeafSystem_,
    SystemScalarConverter,
)
from sheldrake.systems.primitives import Gain, Integrator, Integrator_, LinearSystem, LogVectorOutput, Sine
from sheldrake.systems.scalar_conversion import TemplateSystem


@TemplateSystem.define("Quadratic_")
def Quadratic_(T):
    class Impl(LeafSystem_[T]):
        """x' = -k x^2 + u."""

        def _construct(self, k, converter=None):
            LeafSystem_[T].__init__(self, converter=converter)
            self.k = k
            self.DeclareVectorInputPort("u", 1)
            self.DeclareStateOutputPort("x", self.DeclareContinuousState(1))

        def _construct_copy(self, other, converter=None):
            Impl._construct(self, other.k, converter=converter)

        def DoCalcTimeDerivatives(self, context, derivatives):
            x = context.get_continuous_state_vector()[0]
            derivatives[0] = self.get_input_port().Eval(context)[0] - self.k * x * x

    return Impl


Quadratic = Quadratic_[None]


def loop():
    builder = DiagramBuilder()
    plant, gain = builder.AddNamedSystem("plant", Quadratic(0.5)), builder.AddNamedSystem("gain", Gain([-1.5]))
    filtered = builder.AddSystem(LinearSystem(A=[[0.9]], B=[[0.1]], C=[[1.0]], D=[[0.0]], time_period=0.05))
    builder.Cascade(plant, filtered)
    builder.Cascade(filtered, gain)
    builder.Cascade(gain, plant)
    sink = LogVectorOutput(plant.get_output_port(), builder)
    return builder.Build(), sink


def test_derivative_of_a_simulation_through_updates_integration_and_user_code():
    diagram, _ = loop()
    ends = []
    for x0 in (1.0 - 1e-5, 1.0 + 1e-5):
        simulator = Simulator(diagram)
        simulator.get_mutable_integrator().set_fixed_step_mode(True)
        simulator.get_mutable_context().SetContinuousState([x0])
        simulator.AdvanceTo(0.8)
        ends.append(simulator.get_context().get_continuous_state_vector()[0])
    dual = diagram.ToAutoDiffXd()
    simulator = Simulator_[AutoDiffXd](dual)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    simulator.get_mutable_context().SetContinuousState([AutoDiffXd(1.0, [1.0])])
    simulator.AdvanceTo(0.8)
    x = simulator.get_context().get_continuous_state_vector()[0]
    assert isinstance(x, AutoDiffXd)
    assert x.value() == pytest.approx(np.mean(ends), abs=1e-9)
    assert x.derivatives()[0] == pytest.approx((ends[1] - ends[0]) / 2e-5, abs=1e-8)


def test_symbols_write_the_equations():
    system = Quadratic(2.0).ToSymbolic()
    x, u = Variable("x"), Variable("u")
    context = system.CreateDefaultContext()
    context.SetContinuousState([Expression(x)])
    system.get_input_port().FixValue(context, [Expression(u)])
    derivative = system.EvalTimeDerivatives(context)[0]
    assert derivative.EqualTo(u - 2.0 * x * x)
    time = Variable("t")
    wave = Sine(3.0, 2.0, 0.0, 1).ToSymbolic()
    context = wave.CreateDefaultContext()
    context.SetTime(Expression(time))
    assert wave.get_output_port(0).Eval(context)[0].Evaluate({time: 0.25}) == pytest.approx(3.0 * np.sin(0.5))


def test_values_move_between_scalars():
    diagram, _ = loop()
    plain = diagram.CreateDefaultContext()
    plain.SetTime(2.0)
    plain.SetContinuousState([3.0])
    dual = diagram.ToAutoDiffXd()
    assert [s.get_name() for s in dual.GetSystems()] == [s.get_name() for s in diagram.GetSystems()] != [""]
    context = dual.CreateDefaultContext()
    context.SetTimeStateAndParametersFrom(plain)
    assert isinstance(context.get_time(), AutoDiffXd) and context.get_time().value() == 2.0
    assert context.get_continuous_state_vector()[0].value() == 3.0
    context.SetContinuousState([AutoDiffXd(4.0, [1.0])])
    plain.SetTimeStateAndParametersFrom(context)
    assert plain.get_continuous_state_vector()[0] == 4.0
    context.SetContinuousState([5.0])
    assert isinstance(context.get_continuous_state_vector()[0], AutoDiffXd)


def test_families_of_classes():
    assert LeafSystem_[float] is LeafSystem and LeafSystem_[None] is LeafSystem
    system = Integrator(2).ToAutoDiffXd()
    assert type(system) is Integrator_[AutoDiffXd] and isinstance(system, LeafSystem_[AutoDiffXd])
    assert isinstance(BasicVector_[AutoDiffXd](2)[0], AutoDiffXd)
    assert isinstance(BasicVector_[Expression]([1.0])[0], Expression)
    assert Value[BasicVector_[AutoDiffXd]] is not Value[BasicVector]
    with pytest.raises(TypeError, match="AutoDiffXd"):
        DiagramBuilder_[AutoDiffXd]().AddSystem(Integrator(1))
    builder = DiagramBuilder_[AutoDiffXd]()
    builder.AddSystem(system)
    assert builder.Build().CreateDefaultContext().get_continuous_state_vector()[1].value() == 0.0
    assert SystemScalarConverter.SupportedScalars == (float, AutoDiffXd, Expression)


def test_conversion_keeps_names_and_says_when_it_cannot():
    gain = Gain(2.0, 1)
    gain.set_name("amplifier")
    assert gain.ToScalarType[Expression]().get_name() == gain.Clone().get_name() == "amplifier"
    assert gain.get_system_scalar_converter().IsConvertible[AutoDiffXd, float]()

    class Plain(LeafSystem):
        pass

    assert Plain().ToAutoDiffXdMaybe() is None
    with pytest.raises(RuntimeError, match="does not support scalar conversion to type"):
        Plain().ToSymbolic()
    with pytest.raises(RuntimeError, match="does not support Cloning"):
        Plain().Clone()


def test_fix_input_ports_from():
    gain = Gain([3.0])
    context = gain.CreateDefaultContext()
    gain.get_input_port().FixValue(context, [2.0])
    dual = gain.ToAutoDiffXd()
    other = dual.CreateDefaultContext()
    dual.FixInputPortsFrom(gain, context, other)
    assert dual.get_output_port().Eval(other)[0].value() == 6.0
