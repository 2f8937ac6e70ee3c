"""A linear model is the same from the kernels' rows, as duals or as complex numbers, and from a converted system."""

import numpy as np
import pytest

from sheldrake.autodiffutils import _complex_step
from sheldrake.examples import AcrobotPlant, PendulumPlant
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from sheldrake.systems.framework import (
    DiagramBuilder,
    InputPortIndex,
    InputPortSelection,
    LeafSystem,
    OutputPortIndex,
    OutputPortSelection,
)
from sheldrake.systems.primitives import (
    FirstOrderTaylorApproximation,
    Gain,
    Integrator,
    Linearize,
    LinearSystem,
    SymbolicVectorSystem,
    _linearization,
)

ARM = """<robot name="arm"><link name="base"/>{}</robot>""".format(
    "".join(
        f"""<link name="l{k}"><inertial><origin xyz="0.01 0.02 0.2"/><mass value="{1 + 0.3 * k}"/>
  <inertia ixx="0.1" iyy="0.12" izz="0.05" ixy="0.001" ixz="0.002" iyz="-0.003"/></inertial></link>
  <joint name="j{k}" type="{"prismatic" if k == 1 else "revolute"}"><parent link="{f"l{k - 1}" if k else "base"}"/>
  <child link="l{k}"/><origin xyz="0 0.1 0.2" rpy="0.1 0.2 0"/><axis xyz="{axis}"/>
  <limit lower="-9" upper="9" effort="500"/><dynamics damping="0.{k}"/></joint>
  <transmission name="t{k}"><type>SimpleTransmission</type><joint name="j{k}"/><actuator name="m{k}"/></transmission>"""
        for k, axis in enumerate(["0 0 1", "0 1 0", "0.6 0 0.8"])
    )
)


def arm(time_step=0.0):
    plant = MultibodyPlant(time_step)
    Parser(plant).AddModelsFromString(ARM, "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    if time_step:
        plant.SetUseSampledOutputPorts(False)
    plant.Finalize()
    return plant


def geared_pendulum():
    builder = DiagramBuilder()
    gain, pendulum = builder.AddSystem(Gain(2.0, 1)), builder.AddSystem(PendulumPlant())
    builder.Connect(gain.get_output_port(), pendulum.get_input_port())
    builder.ExportInput(gain.get_input_port())
    builder.ExportOutput(pendulum.get_output_port(0))
    return builder.Build()


def arm_in_a_scene():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    Parser(plant).AddModelsFromString(ARM, "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    plant.Finalize()
    builder.ExportInput(plant.get_actuation_input_port())
    builder.ExportOutput(plant.get_state_output_port())
    return builder.Build()


def sampled():
    A, B = np.array([[0.9, 0.1, 0.0], [0.0, 0.8, 0.2], [0.1, 0.0, 0.7]]), np.ones((3, 2))
    return LinearSystem(A, B, np.eye(2, 3), np.arange(4.0).reshape(2, 2), 0.1)


SYSTEMS = {
    "pendulum": (PendulumPlant, 0, 0),
    "acrobot": (AcrobotPlant, 0, 0),
    "geared pendulum": (geared_pendulum, 0, 0),
    "linear, in discrete time": (sampled, 0, 0),
    "plant": (arm, "actuation", "state"),
    "plant of steps": (lambda: arm(1e-3), "actuation", "state"),
    "plant in a scene": (arm_in_a_scene, 0, 0),
}


def setting(name):
    """A system, a context away from all equilibria, and the ports."""
    make, i, j = SYSTEMS[name]
    system = make()
    context = system.CreateDefaultContext()
    input_port = system.GetInputPort(system.get_input_port(i).get_name() if i == 0 else f"{i}")
    output_port = system.GetOutputPort(system.get_output_port(j).get_name() if j == 0 else f"{j}")
    rng = np.random.default_rng(2)
    input_port.FixValue(context, rng.uniform(-1.0, 1.0, input_port.size()))
    context.SetTime(0.3)
    if context.num_continuous_states():
        context.SetContinuousState(rng.uniform(-1.0, 1.0, context.num_continuous_states()))
    else:
        context.SetDiscreteState(rng.uniform(-1.0, 1.0, context.get_discrete_state(0).size()))
    return system, context, input_port.get_index(), output_port.get_index()


def matrices(model):
    return [model.A(), model.B(), model.f0(), model.C(), model.D(), model.y0()]


def by_conversion(monkeypatch, *arguments):
    with monkeypatch.context() as patch:
        patch.setattr(_linearization, "motion_by_rows", lambda *_: None)
        return matrices(FirstOrderTaylorApproximation(*arguments))


def forbid_conversion(monkeypatch):
    def never(*_):
        raise AssertionError("it was converted")

    monkeypatch.setattr(_linearization, "_by_conversion", never)


def assert_same(ours, theirs):
    for a, b in zip(ours, theirs):
        np.testing.assert_allclose(a, b, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("name", SYSTEMS)
def test_rows_and_conversion(name, monkeypatch):
    arguments = setting(name)
    expected = by_conversion(monkeypatch, *arguments)
    assert max(np.abs(m).max(initial=0.0) for m in expected) > 0.1
    forbid_conversion(monkeypatch)
    assert_same(matrices(FirstOrderTaylorApproximation(*arguments)), expected)


@pytest.mark.parametrize("name", ["plant", "plant of steps", "plant in a scene"])
def test_machine_code_and_conversion(name, monkeypatch):
    monkeypatch.setattr(_complex_step, "PATIENCE", 0)
    arguments = setting(name)
    expected = by_conversion(monkeypatch, *arguments)
    forbid_conversion(monkeypatch)
    assert_same(matrices(FirstOrderTaylorApproximation(*arguments)), expected)
    chains = [key for key in arguments[1]._store.chains if key[0] == "linear"]
    assert chains, "kept for the next time"


@pytest.mark.parametrize("patience", [0, 1000])
def test_the_context_s_own_numbers_count(patience, monkeypatch):
    """State, input and parameters of now, not of the first time."""
    monkeypatch.setattr(_complex_step, "PATIENCE", patience)
    plant, context, i, j = setting("plant")
    before = matrices(FirstOrderTaylorApproximation(plant, context, i, j))
    plant.GetBodyByName("l1").SetMass(context, 7.0)
    plant.SetVelocities(context, [0.3, 0.2, -0.4])
    plant.get_actuation_input_port().FixValue(context, [1.0, 2.0, 3.0])
    after = matrices(FirstOrderTaylorApproximation(plant, context, i, j))
    assert_same(after, by_conversion(monkeypatch, plant, context, i, j))
    assert np.abs(after[0] - before[0]).max() > 0.01
    clone = context.Clone()
    assert_same(matrices(FirstOrderTaylorApproximation(plant, clone, i, j)), after)


def test_contexts_keep_their_values():
    system, context, i, j = setting("plant of steps")
    before = context._store.S.copy()
    FirstOrderTaylorApproximation(system, context, i, j)
    np.testing.assert_array_equal(context._store.S, before)


def test_a_part_of_a_diagram_is_converted():
    """Its input comes from another system."""
    diagram = geared_pendulum()
    root = diagram.CreateDefaultContext()
    diagram.get_input_port(0).FixValue(root, [0.5])
    pendulum = diagram.GetSubsystemByName(diagram.GetSystems()[1].get_name())
    model = FirstOrderTaylorApproximation(pendulum, pendulum.GetMyContextFromRoot(root))
    alone = PendulumPlant()
    context = alone.CreateDefaultContext()
    alone.get_input_port().FixValue(context, [1.0])
    assert_same(matrices(model), matrices(FirstOrderTaylorApproximation(alone, context)))


def test_without_ports():
    none = InputPortSelection.kNoInput, OutputPortSelection.kNoOutput
    pendulum = PendulumPlant()
    context = pendulum.CreateDefaultContext()
    pendulum.get_input_port().FixValue(context, [0.0])
    model = Linearize(pendulum, context, *none)
    assert (model.A().shape, model.B().shape, model.C().shape, model.D().shape) == ((2, 2), (2, 0), (0, 2), (0, 0))
    gain = Gain(3.0, 2)
    context = gain.CreateDefaultContext()
    gain.get_input_port().FixValue(context, [1.0, 2.0])
    np.testing.assert_array_equal(Linearize(gain, context, InputPortIndex(0), OutputPortIndex(0)).D(), 3 * np.eye(2))


def test_an_input_without_a_value_is_named():
    integrator = Integrator(2)
    with pytest.raises(RuntimeError, match=r"InputPort\[0\]"):
        FirstOrderTaylorApproximation(integrator, integrator.CreateDefaultContext(), InputPortSelection.kNoInput)


class Slope(LeafSystem):
    def __init__(self):
        super().__init__()
        self.DeclareContinuousState(1)

    def DoCalcTimeDerivatives(self, context, derivatives):
        derivatives.get_mutable_vector().SetFromVector([-context.get_continuous_state_vector()[0]])


def test_python_systems_must_convert():
    system = Slope()
    with pytest.raises(RuntimeError, match="does not support scalar conversion"):
        FirstOrderTaylorApproximation(system, system.CreateDefaultContext())


def test_symbolic_systems_convert():
    from sheldrake.symbolic import Variable

    x = Variable("x")
    system = SymbolicVectorSystem(state=[x], dynamics=[-2 * x], output=[3 * x])
    model = Linearize(system, system.CreateDefaultContext())
    assert (model.A(), model.C()) == (-2.0, 3.0)
