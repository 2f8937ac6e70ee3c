"""A frozen diagram gives the bits of the diagram, in a process that knows nothing of it, or is refused."""

import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest
from tests.scenes.scene import drop, library

import sheldrake
from sheldrake.common.kernel import jit_enabled, kernel
from sheldrake.common.record import Record, number
from sheldrake.export import Freeze, FrozenSimulation, LoadFrozen
from sheldrake.geometry import Meshcat
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder, LeafSystem
from sheldrake.systems.primitives import ConstantVectorSource, Gain, Integrator, LogVectorOutput, ZeroOrderHold

pytestmark = pytest.mark.skipif(not jit_enabled(), reason="runs machine code; SHELDRAKE_JIT=0 switches it off")


def falling_block(meshcat=None):
    block = sheldrake.model_path("two_hole_block/two_hole_block.urdf")
    simulator, sink, *_ = drop(library("sheldrake"), block, height=0.03, rpy=(0.0, 0.3, 0.1), meshcat=meshcat)
    return simulator, sink


class Motion(Record):
    x = number("of the mass", "m")
    v = number("of the mass", "m/s")


class Pull(Record):
    force = number("by mass", "m/s^2")


class Spring(Record):
    rate = number("stiffness by mass", "1/s^2")


@kernel(top=True)
def pulled_mass(xc: Motion, p: Spring, u: Pull, xdot: Motion) -> None:
    """A mass on a spring."""
    xdot.x = xc.v
    xdot.v = u.force - p.rate * xc.x


class PulledMass(LeafSystem):
    """A system of a user, whose derivatives are a kernel."""

    def __init__(self):
        super().__init__()
        self.DeclareVectorInputPort("pull", 1)
        state = self.DeclareContinuousState(Motion.of(x=1.0, v=0.0))
        self.DeclareNumericParameter(Spring.of(rate=4.0))
        self.DeclareTimeDerivatives(pulled_mass)
        self.DeclareStateOutputPort("state", state)


class InPython(LeafSystem):
    def __init__(self):
        super().__init__()
        self.DeclareVectorInputPort("u", 1)
        self.DeclareVectorOutputPort("y", 1, self.double)

    def double(self, context, output):
        output.SetAtIndex(0, 2.0 * self.get_input_port().Eval(context)[0])


def springs(middle=None):
    """A mass whose doubled state is held for a tenth of a second; `pull` is open, or given by a system."""
    builder = DiagramBuilder()
    mass = builder.AddNamedSystem("mass", PulledMass())
    gain = builder.AddNamedSystem("gain", Gain(2.0, 2))
    hold = builder.AddNamedSystem("hold", ZeroOrderHold(0.1, 2))
    builder.Connect(mass.GetOutputPort("state"), gain.get_input_port())
    builder.Connect(gain.get_output_port(), hold.get_input_port())
    LogVectorOutput(hold.get_output_port(), builder, 0.05).set_name("held")
    if middle is None:
        builder.ExportInput(mass.get_input_port(), "pull")
    else:
        builder.AddNamedSystem("middle", middle)
        source = builder.AddSystem(ConstantVectorSource(np.array([0.5])))
        builder.Connect(source.get_output_port(), middle.get_input_port())
        builder.Connect(middle.get_output_port(), mass.get_input_port())
    builder.ExportOutput(gain.get_output_port(), "doubled")
    diagram = builder.Build()
    diagram.set_name("springs")
    simulator = Simulator(diagram)
    if middle is None:
        diagram.GetInputPort("pull").FixValue(simulator.get_mutable_context(), np.array([0.25]))
    return simulator


def slab(simulator):
    return simulator.get_context()._store.S


OTHER_PROCESS = """
import sys
from sheldrake.export import FrozenSimulation, LoadFrozen
simulation = FrozenSimulation(LoadFrozen(sys.argv[1]))
simulation.AdvanceTo(float(sys.argv[2]))
for name in simulation.frozen.state_names():
    print(name, simulation.GetState(name).tobytes().hex())
for name in simulation.frozen.log_names():
    times, values = simulation.FindLog(name)
    print(name, times.tobytes().hex(), values.tobytes().hex())
"""


def test_a_file_steps_with_the_same_bits_where_the_script_is_unknown(tmp_path):
    for k, simulator in enumerate((falling_block()[0], springs())):
        simulator.AdvanceTo(0.1)
        path = tmp_path / f"{k}.frozen"
        Freeze(simulator).Save(path)
        done = subprocess.run(
            [sys.executable, "-c", OTHER_PROCESS, str(path), "0.4"], capture_output=True, text=True, check=True
        )
        found = dict(line.split(" ", 1) for line in done.stdout.splitlines())
        simulator.AdvanceTo(0.4)
        context, system = simulator.get_context(), simulator.get_system()
        logged = [s for s in system.GetSystems() if hasattr(s, "FindLog")]
        for sink in logged:
            log = sink.FindLog(context)
            data = np.ascontiguousarray(log.data()).tobytes().hex()
            assert f"{log.sample_times().tobytes().hex()} {data}" in found.values()
        for name in ("plant",) if k == 0 else ("mass", "hold"):
            own = system.GetSubsystemByName(name).GetMyContextFromRoot(context)
            state = own.get_discrete_state_vector() if name != "mass" else own.get_continuous_state_vector()
            assert state.CopyToVector().tobytes().hex() == found[name]
        assert len(logged) == 1 and len(found) == 2 + k


def test_the_whole_memory_is_the_same_to_the_last_bit():
    simulator, sink = falling_block()
    frozen = FrozenSimulation(Freeze(simulator))
    for T in (0.2, 0.7):  # more samples than a frozen log holds at once
        simulator.AdvanceTo(T)
        frozen.AdvanceTo(T)
        assert slab(simulator).tobytes() == frozen._slab.tobytes()
    log = sink.FindLog(simulator.get_context())
    times, values = frozen.FindLog("plant/two_hole_block_state")
    np.testing.assert_array_equal(times, log.sample_times())
    np.testing.assert_array_equal(values, log.data())
    frozen.Reset()
    frozen.AdvanceTo(0.2)
    frozen.AdvanceTo(0.7)
    assert slab(simulator).tobytes() == frozen._slab.tobytes()


def test_frozen_twice_gives_the_same_bytes_and_the_simulator_goes_on():
    simulator, other = springs(), springs()
    simulator.AdvanceTo(0.3)
    other.AdvanceTo(0.3)
    assert Freeze(simulator).ToBytes() == Freeze(simulator).ToBytes() == Freeze(other).ToBytes()
    simulator.AdvanceTo(0.6)
    other.AdvanceTo(0.6)
    assert slab(simulator).tobytes() == slab(other).tobytes()


def unnamed():
    """Two gains, one of them in a diagram, and two integrators, none of which has a name."""
    builder, inner = DiagramBuilder(), DiagramBuilder()
    gain, first = inner.AddSystem(Gain(2.0, 1)), inner.AddSystem(Integrator(1))
    inner.Connect(gain.get_output_port(), first.get_input_port())
    inner.ExportInput(gain.get_input_port(), "u")
    inner.ExportOutput(first.get_output_port(), "y")
    inside, second, third = builder.AddSystem(inner.Build()), *(builder.AddSystem(Integrator(1)) for _ in range(2))
    for system in (second, third):
        builder.Connect(inside.get_output_port(), system.get_input_port())
        LogVectorOutput(system.get_output_port(), builder, 0.1)
    simulator = Simulator(builder.Build())
    inside.get_input_port().FixValue(inside.GetMyMutableContextFromRoot(simulator.get_mutable_context()), [1.0])
    return Freeze(simulator)


def test_systems_without_a_name_go_by_their_class_so_that_a_diagram_built_twice_gives_the_same_bytes():
    frozen = unnamed()
    assert frozen.state_names() == ["Diagram/Integrator", "Integrator", "Integrator 2"]
    assert frozen.log_names() == ["Integrator/y0", "Integrator/y0 (2)"]
    assert frozen.input_names() == ["Diagram/u"]
    assert b"@0" not in frozen.ToBytes()
    assert unnamed().ToBytes() == frozen.ToBytes()


def test_inputs_parameters_states_and_outputs_go_by_name():
    simulator = springs()
    diagram, context = simulator.get_system(), simulator.get_mutable_context()
    frozen = FrozenSimulation(Freeze(simulator))
    assert frozen.frozen.name == "springs"
    assert frozen.frozen.input_names() == ["pull"]
    assert frozen.frozen.output_names() == ["doubled"]
    assert frozen.frozen.parameter_names() == ["mass/parameters 0"]
    mass = diagram.GetSubsystemByName("mass")
    own = mass.GetMyMutableContextFromRoot(context)
    for T, pull, rate in ((0.25, 1.5, 4.0), (0.5, -2.0, 9.0)):
        diagram.GetInputPort("pull").FixValue(context, np.array([pull]))
        own.get_mutable_numeric_parameter(0).SetFromVector(np.array([rate]))
        frozen.SetInput("pull", [pull])
        frozen.SetParameters("mass/parameters 0", [rate])
        simulator.AdvanceTo(T)
        frozen.AdvanceTo(T)
        expected = diagram.GetOutputPort("doubled").Eval(context)
        np.testing.assert_array_equal(frozen.EvalOutput("doubled"), expected)
    frozen.SetState("mass", [3.0, 0.0])
    np.testing.assert_array_equal(frozen.EvalOutput("doubled"), [6.0, 0.0])
    with pytest.raises(ValueError, match=r"no 'push' among the inputs; there are 'pull'"):
        frozen.SetInput("push", [1.0])
    with pytest.raises(ValueError, match=r"'pull' has 1 elements, not 2"):
        frozen.SetInput("pull", [1.0, 2.0])
    with pytest.raises(RuntimeError, match=r"before the current time"):
        frozen.AdvanceTo(0.1)


def test_parameters_of_a_plant_go_by_the_elements_that_they_are_of():
    simulator, _ = falling_block()
    plant = next(s for s in simulator.get_system().GetSystems() if hasattr(s, "GetBodyByName"))
    frozen = Freeze(simulator)
    body = next(p for p in frozen.description["parameters"] if p["name"].endswith("/body body"))
    assert body["elements"][:4] == ["mass", "centre of mass x", "centre of mass y", "centre of mass z"]
    assert body["units"][:5] == ["kg", "m", "m", "m", "m^2"]
    simulation, context = FrozenSimulation(frozen), plant.GetMyContextFromRoot(simulator.get_context())
    mass = simulation._slab[body["at"]]
    assert mass == plant.GetBodyByName("body").get_mass(context)
    assert {"/added gravity", "/scale of friction"} <= {n[n.index("/") :] for n in frozen.parameter_names()}


def test_what_is_python_is_refused_with_its_path_its_class_and_the_way_out():
    with pytest.raises(ValueError) as error:
        Freeze(springs(middle=InPython()))
    text = str(error.value)
    assert "'middle' (" in text and f"{__name__}.InPython" in text
    assert "output port 'y' is Python" in text and "@kernel" in text
    simulator = springs()
    simulator.set_monitor(lambda context: None)
    with pytest.raises(ValueError, match=r"a monitor, a Python function; clear_monitor"):
        Freeze(simulator)
    unfixed = Simulator(springs().get_system())
    with pytest.raises(RuntimeError, match=r"pull"):
        Freeze(unfixed)


def test_what_only_draws_is_left_out():
    meshcat = Meshcat()
    simulator, _ = falling_block(meshcat)
    frozen = Freeze(simulator)
    assert frozen.left_out() == ["meshcat_visualizer(visualizer)"]
    simulation = FrozenSimulation(frozen)
    simulator.AdvanceTo(0.3)
    simulation.AdvanceTo(0.3)
    state = simulator.get_system().GetSubsystemByName("plant").GetMyContextFromRoot(simulator.get_context())
    assert simulation.GetState("plant").tobytes() == state.get_discrete_state_vector().CopyToVector().tobytes()


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda data: data[:-1], "truncated or altered"),
        (lambda data: data[:60], "truncated or altered"),
        (lambda data: data[:-9] + bytes([data[-9] ^ 1]) + data[-8:], "truncated or altered"),
        (lambda data: data.replace(b'"name":"springs"', b'"name":"sprongs"'), "truncated or altered"),
        (lambda data: data.replace(b"diagram 1\n", b"diagram 2\n", 1), "the format has version 2, and this sheldrake"),
        (lambda data: b"PK" + data, "no frozen diagram"),
        (lambda data: b"", "no frozen diagram"),
    ],
)
def test_a_file_that_is_not_as_it_was_written_is_refused(tmp_path, change, complaint):
    path = tmp_path / "a.frozen"
    data = Freeze(springs()).ToBytes()
    path.write_bytes(change(data))
    with pytest.raises(ValueError, match=complaint):
        LoadFrozen(path)
    path.write_bytes(data)
    assert LoadFrozen(path).ToBytes() == data


def resigned(data, change):
    """A file whose author changed what it says, checksum and all."""
    first, _, rest = data.split(b"\n", 2)
    size, _, behind = rest.partition(b"\n")
    text, image = change(behind[: int(size)], behind[int(size) :])
    body = b"%d\n" % len(text) + text + image
    return b"%s\n%s\n" % (first, hashlib.sha256(body).hexdigest().encode()) + body


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda text, image: (text[:-1], image), "what it says of the diagram can not be read"),
        (lambda text, image: (b"[" * 100_000, image), "what it says of the diagram can not be read"),
        (lambda text, image: (b"[]", image), "what it says of the diagram can not be read"),
        (lambda text, image: (b"{}", image), "what it says of the diagram can not be read"),
        (lambda text, image: (text, image[:-8]), "its memory is not as large as it says"),
    ],
)
def test_a_file_that_says_nonsense_is_refused_in_words(tmp_path, change, complaint):
    (tmp_path / "a.frozen").write_bytes(resigned(Freeze(springs()).ToBytes(), change))
    with pytest.raises(ValueError, match=rf"LoadFrozen\(.*: {complaint}"):
        LoadFrozen(tmp_path / "a.frozen")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes in folders")
def test_a_pipe_is_no_frozen_diagram(tmp_path):
    os.mkfifo(tmp_path / "a.frozen")
    with pytest.raises(OSError, match="no regular file"):
        LoadFrozen(tmp_path / "a.frozen")
