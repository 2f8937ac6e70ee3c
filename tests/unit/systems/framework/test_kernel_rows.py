"""Systems whose behaviour is kernels: what they see, what they fill, how they fail."""

from typing import Annotated, NamedTuple

import numpy as np
import pytest

from sheldrake.autodiffutils import ExtractGradient, InitializeAutoDiff
from sheldrake.common.kernel import IntVector, Matrix, Vector, Vectors, kernel
from sheldrake.common.record import Record, number, table
from sheldrake.common.value import AbstractValue
from sheldrake.symbolic import Variable
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import BasicVector, DiagramBuilder, LeafSystem
from sheldrake.systems.framework._declarations import PythonStage, Stages
from sheldrake.systems.framework._index import Ticket
from sheldrake.systems.primitives import ConstantVectorSource, Gain, Linearize, LogVectorOutput


class Settings(Record):
    dt = number("time step", "s")
    mass = number("of each", "kg")
    longest = number("extension", "m")


@table
class Springs(NamedTuple):
    stiffness: Matrix  # [N/m]
    settings: Annotated[Vector, Settings]


class Factor(Record):
    gain = number("of the forces")


@table
class Parameters(NamedTuple):
    values: Annotated[Vector, Factor]


class Work(NamedTuple):
    force: Matrix
    count: IntVector


@kernel(top=True)
def step(t: float, model: Springs, xd: Vector, p: Parameters, u: Vectors, work: Work, x_next: Vector) -> int:
    n = xd.shape[0] // 2
    dt = model.dt
    for i in range(n):
        work.force[i, 0] = p.gain * u[0][i]
        for j in range(n):
            work.force[i, 0] -= model.stiffness[i, j] * xd[j]
        if xd[i] > model.longest:
            return 7 + i
    for i in range(n):
        x_next[n + i] = xd[n + i] + dt * work.force[i, 0] / model.mass
        x_next[i] = xd[i] + dt * x_next[n + i]
    work.count[0] += 1
    return 0


@kernel(top=True)
def forces(work: Work, y: Vector) -> None:
    for i in range(y.shape[0]):
        y[i] = work.force[i, 0]


@kernel(top=True)
def positions(xd: Vector, y: Vector) -> None:
    for i in range(y.shape[0]):
        y[i] = xd[i]


class Chain(LeafSystem):
    """Masses on springs: state, parameters, scratch, model, and an output of what the last step left."""

    K = np.array([[20.0, -10.0], [-10.0, 20.0]])

    def __init__(self, longest=1e9, optional=False):
        super().__init__()
        self.settings = np.array([0.01, 2.0, longest])
        self.DeclareVectorInputPort("force", 2)
        self._inputs[0].optional = optional
        self.DeclareNumericParameter(BasicVector([3.0]))
        self.DeclareDiscreteState([0.1, 0.0])
        self.DeclareDiscreteState([0.0, 1.0])
        self._declare_scratch(Work(np.full((2, 1), -1.0), np.zeros(1, np.int64)))
        self.DeclarePeriodicDiscreteUpdateEvent(0.01, 0.0, step)
        self.DeclareForcedDiscreteUpdateEvent(step)
        self.DeclareVectorOutputPort("forces", 2, forces)
        self.DeclareVectorOutputPort("positions", 2, positions)
        self.asked = 0

    def _kernel_models(self, root):
        self.asked += 1
        self.fed_by = root.source(0)
        return {"model": Springs(self.K, self.settings)}

    def _explain_status(self, status, context):
        return ValueError(f"spring {status - 7} broke at {context.get_discrete_state(0)[status - 7]:.3f} m")


def reference(steps, force):
    q, v = np.array([0.1, 0.0]), np.array([0.0, 1.0])
    for _ in range(steps):
        f = 3.0 * force - Chain.K @ q
        v = v + 0.01 * f / 2.0
        q = q + 0.01 * v
    return q, v, f


@pytest.fixture(params=[False, True], ids=["interpreted", "native"])
def scene(request):
    builder = DiagramBuilder()
    source = builder.AddSystem(ConstantVectorSource([1.0, -2.0]))
    chain, gain = builder.AddNamedSystem("chain", Chain()), builder.AddSystem(Gain(1.0, 2))
    builder.Connect(source.get_output_port(), chain.get_input_port())
    builder.Connect(chain.GetOutputPort("positions"), gain.get_input_port())
    sink = LogVectorOutput(gain.get_output_port(), builder)
    simulator = Simulator(builder.Build())
    simulator._native = request.param
    return simulator, chain, source, sink


def test_state_scratch_and_model(scene):
    simulator, chain, source, sink = scene
    context = chain.GetMyContextFromRoot(simulator.get_context())
    port = chain.GetOutputPort("forces")
    assert np.array_equal(port.Eval(context), [-1.0, -1.0])
    simulator.AdvanceTo(0.2)
    q, v, f = reference(20, np.array([1.0, -2.0]))
    np.testing.assert_allclose(context.get_discrete_state(0).value(), q, rtol=1e-13)
    np.testing.assert_allclose(context.get_discrete_state(1).value(), v, rtol=1e-13)
    np.testing.assert_allclose(port.Eval(context), f, rtol=1e-13)
    assert chain._scratch(context).count[0] == 20
    with pytest.raises(ValueError, match="read-only"):
        chain._scratch(context).force[0, 0] = 1.0
    np.testing.assert_allclose(sink.FindLog(simulator.get_context()).data()[:, -1], q, rtol=1e-13)
    assert chain.asked == 1 and chain.fed_by == (source, 0)


def test_scratch_is_cloned(scene):
    simulator, chain, _, _ = scene
    simulator.AdvanceTo(0.1)
    clone = simulator.get_context().Clone()
    simulator.AdvanceTo(0.2)
    counts = [chain._scratch(chain.GetMyContextFromRoot(c)).count[0] for c in (clone, simulator.get_context())]
    assert counts == [10, 20]


def test_an_update_by_hand_leaves_the_state_alone(scene):
    simulator, chain, _, _ = scene
    context = chain.GetMyContextFromRoot(simulator.get_context())
    values = chain.AllocateDiscreteVariables()
    chain.CalcForcedDiscreteVariableUpdate(context, values)
    q, v, _ = reference(1, np.array([1.0, -2.0]))
    np.testing.assert_allclose(values.get_vector(0).value(), q, rtol=1e-14)
    np.testing.assert_allclose(values.get_vector(1).value(), v, rtol=1e-14)
    assert context.get_discrete_state(0)[0] == 0.1
    again = chain.EvalUniquePeriodicDiscreteUpdate(context)
    assert np.array_equal(again.get_vector(1).value(), values.get_vector(1).value())


@pytest.mark.parametrize("native", [False, True])
def test_a_status_becomes_the_systems_error(native):
    chain = Chain(longest=0.105)
    simulator = Simulator(chain)
    simulator._native = native
    chain.get_input_port().FixValue(simulator.get_mutable_context(), [0.0, 0.0])
    with pytest.raises(ValueError, match=r"spring 1 broke at 0\.1\d\d m") as info:
        simulator.AdvanceTo(1.0)
    context = simulator.get_context()
    assert "discrete update of System ::_" in info.value.__notes__[0]
    assert context.get_discrete_state(0)[1] > 0.105
    steps = round(context.get_time() / 0.01)
    assert np.allclose(context.get_discrete_state(0).value(), reference(steps, np.zeros(2))[0], rtol=1e-12)
    with pytest.raises(ValueError, match="spring 1 broke"):
        chain.EvalUniquePeriodicDiscreteUpdate(context)


def test_a_missing_input_is_an_error_unless_it_is_optional():
    with pytest.raises(RuntimeError, match=r"InputPort\[0\] \(force\) of System .* is not connected"):
        Simulator(Chain()).AdvanceTo(0.1)
    chain = Chain(optional=True)
    simulator = Simulator(chain)
    simulator.AdvanceTo(0.05)
    q, _, _ = reference(5, np.zeros(2))
    np.testing.assert_allclose(simulator.get_context().get_discrete_state(0).value(), q, rtol=1e-13)


def test_parameters_reach_the_kernel():
    chain = Chain()
    context = chain.CreateDefaultContext()
    chain.get_input_port().FixValue(context, [1.0, 0.0])
    first = chain.EvalUniquePeriodicDiscreteUpdate(context).get_vector(1)[0]
    context.get_mutable_numeric_parameter(0)[0] = 30.0
    second = chain.EvalUniquePeriodicDiscreteUpdate(context).get_vector(1)[0]
    assert second - first == pytest.approx(0.01 * 27.0 / 2.0)


def test_feedthrough_and_freshness_are_read_off_the_signature():
    chain = Chain()
    assert not chain.HasAnyDirectFeedthrough()

    @kernel(top=True)
    def through(u: Vectors, y: Vector) -> None:
        y[0] = u[0][0]

    @kernel(top=True)
    def wrong(speed: Vector, y: Vector) -> None:
        y[0] = speed[0]

    system = LeafSystem()
    system.DeclareVectorInputPort("u", 1)
    system.DeclareVectorOutputPort("y", 1, through)
    assert system.HasDirectFeedthrough(0, 0)
    system = LeafSystem()
    system.DeclareVectorOutputPort("y", 1, wrong)
    with pytest.raises(TypeError, match="'speed' is none of t, xc, xd, p, u, work, model"):
        system.CreateDefaultContext()


class Motion(Record):
    x = number("position", "m")
    v = number("velocity", "m/s")


class Law(Record):
    stiffness = number("for each kilogram", "N/(m kg)")
    damping = number("for each kilogram", "N s/(m kg)")


class Pushed(Record):
    push = number("acceleration", "m/s²")


@kernel(top=True)
def spring(xc: Motion, p: Law, u: Pushed, xdot: Motion) -> None:
    xdot.x = xc.v
    xdot.v = u.push - p.stiffness * np.sin(xc.x) - p.damping * xc.v


@kernel(top=True)
def energy(xc: Motion, p: Law, y: Vector) -> None:
    y[0] = xc.v**2 / 2 - p.stiffness * np.cos(xc.x)


class Oscillator(LeafSystem):
    """Nothing but kernels, whose vectors are records."""

    def __init__(self, inputs=1):
        super().__init__()
        for i in range(inputs):
            self.DeclareVectorInputPort(f"push{i}", 1)
        state = self.DeclareContinuousState(Motion.of(x=0.5, v=0.0))
        self.DeclareNumericParameter(Law.of(stiffness=4.0, damping=0.5))
        self.DeclareTimeDerivatives(spring)
        self.DeclareStateOutputPort("state", state)
        self.DeclareVectorOutputPort("energy", 1, energy)


def oscillator_at(system, state, push):
    context = system.CreateDefaultContext()
    context.SetContinuousState(state)
    system.get_input_port(0).FixValue(context, push)
    return context


def test_vectors_of_a_system_are_records():
    system = Oscillator()
    context = oscillator_at(system, [0.5, 2.0], [3.0])
    derivatives = system.EvalTimeDerivatives(context).CopyToVector()
    assert derivatives == pytest.approx([2.0, 3.0 - 4.0 * np.sin(0.5) - 1.0])
    assert system.GetOutputPort("energy").Eval(context) == pytest.approx([2.0 - 4.0 * np.cos(0.5)])
    context.get_mutable_numeric_parameter(0)[Law.damping] = 0.0
    assert system.EvalTimeDerivatives(context)[1] == pytest.approx(3.0 - 4.0 * np.sin(0.5))
    assert system.HasDirectFeedthrough(1, 0) is False


def test_a_system_of_kernels_takes_every_scalar():
    system = Oscillator()
    dual = system.ToAutoDiffXd()
    seeds = InitializeAutoDiff([0.5, 2.0, 3.0]).ravel()
    gradient = ExtractGradient(dual.EvalTimeDerivatives(oscillator_at(dual, seeds[:2], seeds[2:])).CopyToVector())
    expected = [[0.0, 1.0, 0.0], [-4.0 * np.cos(0.5), -0.5, 1.0]]
    np.testing.assert_allclose(gradient, expected, rtol=1e-14)
    x, v, a = (Variable(name) for name in "xva")
    symbolic = system.ToSymbolic()
    found = symbolic.EvalTimeDerivatives(oscillator_at(symbolic, [x, v], [a])).CopyToVector()
    assert found[0].EqualTo(v) and found[1].Evaluate({x: 0.5, v: 2.0, a: 3.0}) == pytest.approx(2.0 - 4.0 * np.sin(0.5))
    linear = Linearize(system, oscillator_at(system, [0.0, 0.0], [0.0]), output_port_index=0)
    np.testing.assert_allclose(linear.A(), [[0.0, 1.0], [-4.0, -0.5]])
    assert Oscillator()._clone().num_continuous_states() == 2

    class Listens(Oscillator):
        def __init__(self):
            super().__init__()
            self.DeclareVectorOutputPort("python", 1, lambda context, y: y.SetAtIndex(0, 1.0))

    assert Listens().ToAutoDiffXdMaybe() is None and LeafSystem().ToAutoDiffXdMaybe() is None


def test_derivatives_may_be_a_python_function():
    class Decay(LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareContinuousState([1.0])
            self.DeclareTimeDerivatives(self.rate)

        def rate(self, context, derivatives):
            derivatives.get_mutable_vector()[0] = -context.get_continuous_state_vector()[0]

    simulator = Simulator(Decay())
    simulator.get_mutable_integrator().set_target_accuracy(1e-8)
    simulator.AdvanceTo(1.0)
    assert simulator.get_context().get_continuous_state_vector()[0] == pytest.approx(np.exp(-1.0), rel=1e-7)
    with pytest.raises(TypeError, match=r"DeclareTimeDerivatives\(\): .* cannot be called"):
        LeafSystem().DeclareTimeDerivatives(3)


def test_a_record_that_does_not_fit_is_refused():
    with pytest.raises(TypeError, match=r"`u` is a Pushed in a kernel, .* there are 2. Annotate it Vectors"):
        Oscillator(inputs=2).CreateDefaultContext()
    system = LeafSystem()
    system.DeclareContinuousState(3)
    system.DeclareVectorOutputPort("energy", 1, energy)
    system.DeclareTimeDerivatives(spring)
    with pytest.raises(TypeError, match="xc is a Motion of 2 numbers, not of 3"):
        system.CreateDefaultContext()


def test_a_missing_model_is_named():
    class Bare(Chain):
        def _kernel_models(self, root):
            return {"other": 1}

    with pytest.raises(ValueError, match=r"gives \['other'\]; .*step.* needs 'model'"):
        Bare().CreateDefaultContext()


@kernel(top=True)
def stretched(model: Springs, table: Matrix, xd: Vector, y: Vector) -> None:
    y[0] = model.settings[0] * table[0, 0] * xd[0]


def test_constant_arrays_under_a_name_that_is_no_model_are_refused_when_built():
    class Stretched(Chain):
        def __init__(self):
            super().__init__()
            self.DeclareVectorOutputPort("stretched", 1, stretched)

        def _kernel_models(self, root):
            return super()._kernel_models(root) | {"table": self.K}

    with pytest.raises(TypeError, match=r"stretched.*parameter 'table' is given constant arrays.*'table_model'"):
        Stretched().CreateDefaultContext()


class Seen(NamedTuple):
    speed: Vector


class Remembered(NamedTuple):
    seen: Seen


@kernel(top=True)
def at_speed(xc: Vector, seen: Seen, xdot: Vector) -> None:
    xdot[0] = seen.speed[0] + 0.0 * xc[0]


class Shuttle(LeafSystem):
    """Moves at a speed that is an abstract state, of which a kernel is told; it turns round each second."""

    def __init__(self, needs):
        super().__init__()
        self.looks = 0
        stage = PythonStage(Shuttle.look, ("seen", "speed"), needs)
        self.DeclareContinuousState(1)
        self.DeclareAbstractState(AbstractValue.Make(2.0))
        self.DeclareTimeDerivatives(Stages(lambda system, root: [stage, at_speed]))
        self._declare_scratch(Remembered(Seen(np.zeros(1))))
        self.DeclarePeriodicUnrestrictedUpdateEvent(1.0, 1.0, self.turn)

    def look(self, context):
        self.looks += 1
        context._store.scratch(context._node).seen.speed[0] = context.get_abstract_state(0).get_value()

    @staticmethod
    def turn(context, state):
        value = state.get_mutable_abstract_state(0)
        value.set_value(-value.get_value())


@pytest.mark.parametrize("needs", [None, frozenset({Ticket.XA})])
def test_a_python_stage_is_called_again_when_what_it_names_has_changed(needs):
    system = Shuttle(needs)
    simulator = Simulator(system)
    simulator.get_mutable_integrator().set_maximum_step_size(0.01)
    context = simulator.get_mutable_context()
    place = context.get_continuous_state_vector()
    for t, x in ((0.5, 1.0), (1.5, 1.0), (2.0, 0.0), (2.5, 1.0)):
        simulator.AdvanceTo(t)
        assert place[0] == pytest.approx(x, abs=1e-12)
    other = context.Clone()
    context.SetAbstractState(0, 10.0)
    simulator.AdvanceTo(2.75)
    assert place[0] == pytest.approx(3.5)
    assert system.EvalTimeDerivatives(context)[0] == 10.0
    assert system.EvalTimeDerivatives(other)[0] == 2.0
    second = Simulator(system, other)
    second.AdvanceTo(2.75)
    assert other.get_continuous_state_vector()[0] == pytest.approx(1.5)
    context.SetTimeStateAndParametersFrom(other)
    simulator.Initialize()
    simulator.AdvanceTo(3.0)
    assert place[0] == pytest.approx(2.0)
    assert simulator.get_integrator().get_num_derivative_evaluations() > 0
    if needs is None:
        assert system.looks > 275
    else:
        assert system.looks < 20
