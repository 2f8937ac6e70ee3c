"""The same systems on AutoDiffXd and on symbols: only the context's memory is another."""

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.common.value import Value
from sheldrake.math import RigidTransform, RigidTransform_
from sheldrake.symbolic import Expression, Variable
from sheldrake.systems.analysis import ExtractSimulatorConfig, ResetIntegratorFromFlags, Simulator, Simulator_
from sheldrake.systems.framework import (
    BasicVector,
    BasicVector_,
    DiagramBuilder,
    DiagramBuilder_,
    LeafSystem,
    LeafSystem_,
    SystemScalarConverter,
)
from sheldrake.systems.primitives import (
    Gain,
    Gain_,
    Integrator,
    Integrator_,
    LinearSystem,
    LogVectorOutput,
    Saturation_,
    SharedPointerSystem_,
    Sine,
    StateInterpolatorWithDiscreteDerivative_,
    VectorLogSink_,
)
from sheldrake.systems.scalar_conversion import TemplateSystem
from sheldrake.systems.sensors import RotaryEncoders_


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


def test_what_a_system_gives_is_of_its_scalar():
    system = LinearSystem([[0.0]], [[1.0]], [[1.0]], [[0.0]]).ToAutoDiffXd()
    context = system.CreateDefaultContext()
    context.SetContinuousState([AutoDiffXd(0.25, [1.0])])
    system.get_input_port(0).FixValue(context, [AutoDiffXd(0.5)])
    outputs = system.AllocateOutput()
    system.CalcOutput(context, outputs)
    assert outputs.get_vector_data(0)[0].derivatives() == pytest.approx([1.0])
    assert "_[AutoDiffXd]([<AutoDiffXd 0.25" in repr(outputs.get_vector_data(0))
    assert repr(BasicVector_[Expression]([Expression(1.0)])) == 'BasicVector_[Expression]([<Expression "1">])'
    assert "\n    0.25\n" in str(context)  # values, as for floats
    for number in (system.EvalPotentialEnergy(context), *system.AllocateImplicitTimeDerivativesResidual()):
        assert isinstance(number, AutoDiffXd)
    for port in (system.get_input_port(0), system.get_output_port(0)):
        assert isinstance(port.Allocate().get_value()[0], AutoDiffXd)
    vector = BasicVector_[AutoDiffXd]([1.0, 2.0])
    vector.SetZero()
    assert [type(x) for x in vector] == [AutoDiffXd, AutoDiffXd]


def test_ports_of_poses_take_those_of_their_systems_scalar():
    class Pose(LeafSystem):
        _generic = True

        def __init__(self):
            super().__init__()
            self.DeclareAbstractInputPort("X", Value(RigidTransform()))
            self.DeclareAbstractInputPort("Xs", Value([RigidTransform()]))

    system, X = Pose().ToAutoDiffXd(), RigidTransform_[AutoDiffXd](np.array([1.0, 2.0, AutoDiffXd(3.0, [1.0])]))
    context = system.CreateDefaultContext()
    system.GetInputPort("X").FixValue(context, X)
    system.GetInputPort("Xs").FixValue(context, [X])
    assert system.GetInputPort("X").Eval(context).translation()[2].derivatives() == [1.0]
    assert len(system.GetInputPort("Xs").Eval(context)) == 1
    with pytest.raises(RuntimeError, match=r"takes a Value\[RigidTransform_\[AutoDiffXd\]\], not a"):
        system.GetInputPort("X").FixValue(context, Value(RigidTransform()))


def test_simulator_of_duals_takes_times_that_are_duals():
    system = LinearSystem([[-1.0]], [[0.0]], [[1.0]], [[0.0]]).ToAutoDiffXd()
    simulator = Simulator_[AutoDiffXd](system)
    simulator.get_mutable_context().SetContinuousState([AutoDiffXd(2.0, [1.0])])
    system.get_input_port(0).FixValue(simulator.get_mutable_context(), [0.0])
    integrator = ResetIntegratorFromFlags(simulator, "runge_kutta2", AutoDiffXd(0.01))
    integrator.set_requested_minimum_step_size(AutoDiffXd(1e-6))
    simulator.AdvanceTo(AutoDiffXd(0.1))
    x = simulator.get_context().get_continuous_state_vector()[0]
    assert x.derivatives() == pytest.approx([np.exp(-0.1)], rel=1e-4)
    assert ExtractSimulatorConfig(simulator).start_time == pytest.approx(0.1)


@pytest.mark.parametrize("T", [AutoDiffXd, Expression])
def test_systems_made_on_a_scalar_are_of_it(T):
    builder = DiagramBuilder_[T]()
    gain = builder.AddSystem(Gain_[T](2.0, 1))
    sink = LogVectorOutput(gain.get_output_port(), builder)
    assert type(sink) is VectorLogSink_[T] and SharedPointerSystem_[T].AddToBuilder(builder, "kept") == "kept"
    limits = Saturation_[T](min_value=[T(0.25)], max_value=[T(0.5)])
    context = limits.CreateDefaultContext()
    limits.get_input_port(0).FixValue(context, [T(0.75)])
    assert type(limits.get_output_port(0).Eval(context)[0]) is T
    encoders = RotaryEncoders_[T]([100])
    context = encoders.CreateDefaultContext()
    encoders.set_calibration_offsets(context, [T(0.5)])
    assert type(encoders.get_calibration_offsets(context)[0]) is T
    interpolator = StateInterpolatorWithDiscreteDerivative_[T](1, 0.1)
    context = interpolator.CreateDefaultContext()
    interpolator.set_initial_position(context, [T(0.5)])
    interpolator.GetInputPort("position").FixValue(context, [T(0.5)])
    assert {type(x) for x in interpolator.get_output_port().Eval(context)} == {T}


def test_system_of_a_template_clones_by_way_of_another_scalar():
    system = Quadratic_[float](0.5)
    clone = system.Clone()
    assert type(clone) is Quadratic_[float] and clone is not system and clone.k == 0.5


def test_a_family_of_systems_says_what_it_is():
    assert str(Quadratic_) == f"<TemplateSystem {__name__}.Quadratic_>"


@pytest.mark.parametrize("scalar", [AutoDiffXd, Expression])
def test_what_is_written_becomes_a_number_of_the_contexts_scalar(scalar):
    variables = [Variable("a"), Variable("b")]
    system = LinearSystem(np.eye(2), np.zeros((2, 0)), np.eye(2), np.zeros((2, 0)), 0.1)
    context = (system.ToAutoDiffXd() if scalar is AutoDiffXd else system.ToSymbolic()).CreateDefaultContext()
    state = context.get_mutable_discrete_state_vector()
    given = [[1, 2], np.array([1, 2], object), np.array([1.0, AutoDiffXd(2.0) if scalar is AutoDiffXd else 2.0])]
    given += [variables, np.array(variables)] if scalar is Expression else []
    for values in given:
        for write in (
            state.SetFromVector,
            context.SetDiscreteState,
            lambda v: state.__setitem__(slice(0, 2), v),
            lambda v: [state.SetAtIndex(i, x) for i, x in enumerate(v)],
        ):
            state.SetZero()
            write(values)
            found = context.get_discrete_state_vector().CopyToVector()
            assert [type(x) for x in found] == [scalar, scalar]
            assert [str(x) for x in found] == [str(x if isinstance(x, scalar) else scalar(x)) for x in values]
