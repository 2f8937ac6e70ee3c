"""Diagrams as FMUs, simulated by FMPy, and FMUs as systems."""

import os
import re
import stat
import struct
import subprocess
import sys
import zipfile
from xml.etree import ElementTree

import numpy as np
import pytest
from tests.unit.export.exported_pages import falling_block

from sheldrake.common.kernel import jit_enabled
from sheldrake.export import FmuSystem, Freeze, SaveFmu
from sheldrake.export._fmu_system import _Instance
from sheldrake.export._universal import universal_library
from sheldrake.systems.analysis import InitializeParams, Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import ConstantVectorSource, Gain, LinearSystem

fmpy = pytest.importorskip("fmpy")
validate_fmu = pytest.importorskip("fmpy.validation").validate_fmu
pytest.importorskip("ziglang")
pytestmark = [
    pytest.mark.skipif(not jit_enabled(), reason="runs machine code; SHELDRAKE_JIT=0 switches it off"),
    pytest.mark.skipif(fmpy.platform_tuple != "x86_64-linux", reason="makes FMUs for x86-64 Linux"),
]
HERE = ["x86_64-linux"]
VERSIONS = ("2.0", "3.0")


def servo(name="servo"):
    """A cart, sampled every 10 ms, behind a filter in continuous time; input u, output y."""
    builder = DiagramBuilder()
    smooth = builder.AddNamedSystem("filter", LinearSystem([[-20.0]], [[20.0]], [[1.0]], [[0.0]]))
    A, B = np.array([[1.0, 0.01], [0.0, 0.98]]), np.array([[0.0], [0.01]])
    cart = builder.AddNamedSystem("cart", LinearSystem(A, B, np.eye(2), np.zeros((2, 1)), 0.01))
    builder.Connect(smooth.get_output_port(), cart.get_input_port())
    builder.ExportInput(smooth.get_input_port(), "u")
    builder.ExportOutput(cart.get_output_port(), "y")
    diagram = builder.Build()
    diagram.set_name(name)
    simulator = Simulator(diagram)
    diagram.get_input_port().FixValue(simulator.get_mutable_context(), [1.0])
    return simulator


def answer(simulator):
    return simulator.get_system().get_output_port().Eval(simulator.get_context())


@pytest.fixture(scope="module")
def servos(tmp_path_factory):
    """The servo as FMUs, by version."""
    folder = tmp_path_factory.mktemp("fmu")
    paths = {version: str(folder / f"servo{version}.fmu") for version in VERSIONS}
    for version, path in paths.items():
        SaveFmu(servo(), path, fmi_version=version, platforms=HERE)
    return paths


def plant_of(simulator):
    return next(s for s in simulator.get_system().GetSystems() if hasattr(s, "GetPositionsAndVelocities"))


@pytest.mark.parametrize("version", VERSIONS)
def test_fmpy_validates_a_falling_block_and_gets_the_bits_of_the_simulator(tmp_path, version):
    simulator, path = falling_block(), str(tmp_path / "block.fmu")
    plant = plant_of(simulator)
    SaveFmu(simulator, path, fmi_version=version, platforms=HERE, outputs=[plant.get_state_output_port()])
    assert validate_fmu(path) == []
    result = fmpy.simulate_fmu(path, stop_time=1.0, output_interval=0.1)  # through first contact to rest
    about = {v.name: v for v in fmpy.read_model_description(path).modelVariables}
    names = [f"plant/state.{n}" for n in plant.GetStateNames()]
    assert about[names[4]].unit == "m" and about[names[-1]].unit == "m/s"
    assert about["plant/applied_generalized_force[3]"].causality == "input"
    assert {about[n].causality for n in names} == {"output"}
    assert {f"plant/x.{n}" for n in plant.GetStateNames()} <= set(about)  # the states, to be set at first
    context = plant.GetMyContextFromRoot(simulator.get_context())
    for row in result[1:]:
        simulator.AdvanceTo(row["time"])
        np.testing.assert_array_equal([row[n] for n in names], plant.GetPositionsAndVelocities(context))
    with zipfile.ZipFile(path) as archive:
        (library,) = [n for n in archive.namelist() if n.startswith("binaries")]
        assert b"Python" not in archive.read(library) and b"libpython" not in archive.read(library)


@pytest.mark.parametrize("version", VERSIONS)
def test_inputs_states_and_times_of_the_host(servos, version):
    path = servos[version]
    start = {"u[0]": 3.0, "cart/x[0]": 0.25}
    result = fmpy.simulate_fmu(path, start_time=5.0, stop_time=6.0, output_interval=0.02, start_values=start)
    simulator = servo()
    system, context = simulator.get_system(), simulator.get_mutable_context()
    system.get_input_port().FixValue(context, [3.0])
    cart = system.GetSubsystemByName("cart")
    cart.GetMyMutableContextFromRoot(context).SetDiscreteState([0.25, 0.0])
    for row in result:
        simulator.AdvanceTo(round((row["time"] - 5.0) / 0.01) * 0.01)  # its own time begins at 0 all the same
        np.testing.assert_array_equal([row["y[0]"], row["y[1]"]], answer(simulator))
    assert result[-1]["time"] == pytest.approx(6.0) and answer(simulator)[0] > 0.3


def running(path, **start):
    """An instance after its initialization, and value references by name."""
    about = fmpy.read_model_description(path)
    said = []
    fmu = fmpy.instantiate_fmu(fmpy.extract(path), about, "CoSimulation", logger=lambda *words: said.append(words[-1]))
    if about.fmiVersion == "2.0":
        fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    return fmu, {v.name: v.valueReference for v in about.modelVariables}, said


def read(fmu, references):
    return (fmu.getReal if hasattr(fmu, "getReal") else fmu.getFloat64)(references)


def write(fmu, references, values):
    (fmu.setReal if hasattr(fmu, "setReal") else fmu.setFloat64)(references, values)


@pytest.mark.parametrize("version", VERSIONS)
def test_states_are_kept_restored_and_given_to_others(servos, version):
    fmu, at, said = running(servos[version])
    y = [at["y[0]"], at["y[1]"]]
    for k in range(30):
        fmu.doStep(k * 0.01, 0.01)
    state = fmu.getFMUState()
    bytes_ = fmu.serializeFMUState(state)
    for k in range(30, 60):
        fmu.doStep(k * 0.01, 0.01)
    expected = read(fmu, y)
    fmu.setFMUState(state)
    assert read(fmu, y) != expected
    other, _, words = running(servos[version])
    other.setFMUState(other.deserializeFMUState(bytes_))
    for one in (fmu, other):
        for k in range(30, 60):
            one.doStep(k * 0.01, 0.01)
        assert read(one, y) == expected
    altered = bytearray(bytes_)
    altered[len(altered) // 2] ^= 1
    for wrong in (bytes(altered), bytes_[:-8]):
        with pytest.raises(Exception, match="erialize"):
            other.deserializeFMUState(wrong)
    assert len(words) == 2 and b"not as they were written" in words[0] and b"bytes, not" in words[1]
    fmu.freeFMUState(state)
    fmu.reset()
    other.freeInstance()
    fmu.freeInstance()
    assert not said


@pytest.mark.parametrize("version", VERSIONS)
def test_faults_are_told_to_the_host(servos, version):
    fmu, at, said = running(servos[version])
    for call, words in (
        (lambda: write(fmu, [at["y[0]"]], [1.0]), b"y[0] is computed"),
        (lambda: write(fmu, [at["cart/x[0]"]], [1.0]), b"cart/x[0] is a state"),
        (lambda: read(fmu, [999]), b"no variable with value reference 999"),
        (lambda: fmu.doStep(0.5, 0.01), b"stands at 0 s"),
        (lambda: fmu.doStep(0.0, -1.0), b"expected a positive number"),
    ):
        said.clear()
        with pytest.raises(Exception, match="failed with status 3"):
            call()
        assert len(said) == 1 and words in said[0], said
    fmu.terminate()
    with pytest.raises(Exception, match="failed with status 3"):
        fmu.doStep(0.0, 0.01)
    fmu.freeInstance()


def test_the_same_diagram_gives_the_same_bytes(servos, tmp_path):
    SaveFmu(Freeze(servo()), tmp_path / "again.fmu", platforms="x86_64-linux")
    with open(servos["3.0"], "rb") as file:
        assert (tmp_path / "again.fmu").read_bytes() == file.read()


def test_names_do_not_become_markup(tmp_path):
    name = '</fmiModelDescription><img src=x onerror="x()">&\n"'
    SaveFmu(servo(name), tmp_path / "x.fmu", platforms=HERE)
    assert validate_fmu(str(tmp_path / "x.fmu")) == []
    with zipfile.ZipFile(tmp_path / "x.fmu") as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    assert root.get("modelName") == name.replace("\n", " ") and root.find(".//img") is None


def test_what_is_unknown_is_refused(tmp_path):
    for wrong, words in (
        ({"fmi_version": "1.0"}, r"no fmi_version '1.0'; there are 2.0, 3.0"),
        ({"platforms": ["amiga"]}, r"platforms \['amiga'\]; there are x86_64-linux"),
        ({"platforms": []}, r"platforms are missing"),
    ):
        with pytest.raises(ValueError, match=words):
            SaveFmu(servo(), tmp_path / "x.fmu", **wrong)
    assert not (tmp_path / "x.fmu").exists()


def test_a_universal_library_has_each_at_a_page():
    ones = [struct.pack("<III", 0xFEEDFACF, kind, 3) + b"x" * 20000 for kind in (0x01000007, 0x0100000C)]
    both = universal_library(ones)
    assert struct.unpack_from(">II", both) == (0xCAFEBABE, 2)
    for k, one in enumerate(ones):
        kind, _, place, size, page = struct.unpack_from(">IIIII", both, 8 + 20 * k)
        assert kind == struct.unpack_from("<I", one, 4)[0] and place % 2**page == 0
        assert both[place : place + size] == one
    with pytest.raises(ValueError, match="64-bit library"):
        universal_library([b"\x7fELF" + bytes(20)])


def test_the_command_writes_what_a_script_simulates(tmp_path):
    script, out = tmp_path / "simulate.py", tmp_path / "out.fmu"
    script.write_text("from tests.unit.export.test_fmu import servo\nservo().AdvanceTo(1.0)\n")
    command = [sys.executable, "-m", "sheldrake", "fmu", "--fmi", "2.0", "--platform", *HERE, "-o", out, script]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    assert validate_fmu(str(out)) == []
    assert done.stdout == f"wrote {out}\n"


# FMUs as systems.


def around(path, u=1.0, **options):
    """A simulator of an FMU with a constant input, and the system."""
    builder = DiagramBuilder()
    fmu = builder.AddNamedSystem("fmu", FmuSystem(path, **options))
    source = builder.AddSystem(ConstantVectorSource([u]))
    builder.Connect(source.get_output_port(), fmu.GetInputPort("u[0]"))
    after = builder.AddSystem(Gain(2.0, 1))
    builder.Connect(fmu.GetOutputPort("y[0]"), after.get_input_port())
    return Simulator(builder.Build()), fmu


def outputs(fmu, context):
    own = fmu.GetMyContextFromRoot(context)
    return [fmu.GetOutputPort(name).Eval(own)[0] for name in ("y[0]", "y[1]")]


@pytest.mark.parametrize("version", VERSIONS)
def test_an_fmu_of_ours_gives_the_numbers_of_the_diagram(servos, version):
    simulator, fmu = around(servos[version], u=2.0, parameters={"cart/x[0]": 0.5})
    assert fmu.get_step() == 0.01 and fmu.left_out() == []
    native = servo()
    context = native.get_mutable_context()
    native.get_system().get_input_port().FixValue(context, [2.0])
    cart = native.get_system().GetSubsystemByName("cart")
    cart.GetMyMutableContextFromRoot(context).SetDiscreteState([0.5, 0.0])
    simulator.AdvanceTo(0.3)
    copy = simulator.get_context().Clone()
    native.AdvanceTo(0.3)
    for time in (0.4, 0.5):
        simulator.AdvanceTo(time)
        native.AdvanceTo(time)
        np.testing.assert_array_equal(outputs(fmu, simulator.get_context()), answer(native))
    other = Simulator(simulator.get_system(), copy)  # goes on by itself, from a state that was kept for it
    quiet = InitializeParams()
    quiet.suppress_initialization_events = True
    other.Initialize(quiet)
    other.AdvanceTo(0.5)
    np.testing.assert_array_equal(outputs(fmu, other.get_context()), answer(native))


@pytest.mark.parametrize("begin", [0.0, 0.005])
def test_each_step_begins_where_the_last_ended_at_multiples_of_the_step(servos, monkeypatch, begin):
    """To the last bit: an FMU with steps of its own loses one otherwise, or takes one twice."""
    taken, step = [], _Instance.step
    monkeypatch.setattr(_Instance, "step", lambda run, t, h: taken.append((t, h)) or step(run, t, h))
    simulator, _ = around(servos["3.0"])
    simulator.get_mutable_context().SetTime(begin)
    simulator.AdvanceTo(1.0)
    begins = [t for t, _ in taken]
    assert begins == [begin, *(k * 0.01 for k in range(2 if begin else 1, 100))]
    assert [t + h for t, h in taken[:-1]] == begins[1:]


@pytest.mark.parametrize(("platforms", "folders"), [
    (["aarch64-linux"], ["aarch64-linux", "linux64"]),
    (["x86_64-linux", "aarch64-linux"], ["aarch64-linux", "linux64"]),
])  # fmt: skip
def test_hosts_of_fmi_2_on_arm_look_where_code_for_x86_is_if_there_is_some(tmp_path, platforms, folders):
    SaveFmu(servo(), tmp_path / "x.fmu", fmi_version="2.0", platforms=platforms)
    with zipfile.ZipFile(tmp_path / "x.fmu") as archive:
        machines = {n.split("/")[1]: archive.read(n)[18] for n in archive.namelist() if n.startswith("binaries")}
    arm, x86 = 183, 62  # e_machine of ELF
    assert machines == dict(zip(folders, (arm, arm if len(platforms) == 1 else x86)))


def test_with_step_0_it_is_where_the_last_step_of_the_simulator_began(servos):
    simulator, fmu = around(servos["3.0"], step=0.0)
    native = servo()
    for k in range(1, 6):
        simulator.AdvanceTo(k / 20)
        np.testing.assert_array_equal(outputs(fmu, simulator.get_context()), answer(native))
        native.AdvanceTo(k / 20)


def test_wrong_names_and_values_are_named(servos):
    for options, words in (
        ({"parameters": {"cart/z[0]": 1.0}}, r"no variable 'cart/z\[0\]' of numbers; there are 'cart/x\[0\]'"),
        ({"parameters": {"y[0]": 1.0}}, r"'y\[0\]' is computed by the FMU \(output\)"),
        ({"parameters": {"u[0]": [1.0, 2.0]}}, r"'u\[0\]' has 1 elements, not 2"),
        ({"parameters": {"u[0]": "much"}}, r"'u\[0\]' is a number, not 'much'"),
        ({"outputs": ["z"]}, r"outputs: there is no variable 'z'"),
        ({"step": -1.0}, r"step -1.0 must be"),
    ):
        with pytest.raises(ValueError, match=words):
            FmuSystem(servos["3.0"], **options)


def rewritten(path, out, change):
    """A copy of an FMU whose files `change` has changed, in place, by name."""
    with zipfile.ZipFile(path) as archive:
        files = {n: archive.read(n) for n in archive.namelist()}
    change(files)
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return out


def in_description(old, new):
    def change(files):
        text = files["modelDescription.xml"]
        assert re.search(old, text)
        files["modelDescription.xml"] = re.sub(old, new, text, count=1)

    return change


ENTITY = b'<!DOCTYPE x [<!ENTITY e SYSTEM "file:///etc/passwd">]>\n<fmiModelDescription'
HIDDEN = b'encoding="UTF-7"?>\n' + "<!DOCTYPE x [<!ENTITY e SYSTEM 'file:///etc/passwd'>]>".encode("utf-7")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda files: files.update({"../../escaped.txt": b"x"}), r"'../../escaped.txt' in it leads out of it"),
        (lambda files: files.update({"/tmp/escaped.txt": b"x"}), r"leads out of it"),
        (lambda files: files.update({"a\\..\\b": b"x"}), r"leads out of it"),
        (lambda files: files.pop("modelDescription.xml"), r"no modelDescription.xml"),
        (lambda files: files.pop("binaries/x86_64-linux/servo.so"), r"no binaries/x86_64-linux/servo.so .*no platform"),
        (in_description(b"<fmiModelDescription", ENTITY), r"document type or entities"),
        (in_description(rb'encoding="UTF-8"\?>', HIDDEN), r"is in UTF-7, and FMI wants UTF-8"),
        (lambda files: files.update({"modelDescription.xml": "<a/>".encode("utf-16")}), r"FMI wants UTF-8"),
        (lambda files: files.update({"resources/bomb": bytes(80_000_000)}), r"unpack to 8\d{7} bytes; more than"),
        (in_description(b"</ModelVariables>", b""), r"can not be understood"),
        (in_description(b'fmiVersion="3.0"', b'fmiVersion="3.1"'), r"of FMI 3.1; 2.0 and 3.0"),
        (in_description(b'modelIdentifier="servo"', b'modelIdentifier="../servo"'), r"no identifier of C"),
        (in_description(b"<CoSimulation", b"<ModelExchange"), r"not for co-simulation|can not be understood"),
        (in_description(b'instantiationToken="{', b'instantiationToken="{1'), r"model description is of another FMU"),
        (lambda files: files.update({"binaries/x86_64-linux/servo.so": b"\x7fELF"}), r"could not be instantiated"),
    ],
)
def test_damaged_fmus_are_refused(servos, tmp_path, change, words):
    damaged = rewritten(servos["3.0"], tmp_path / "damaged.fmu", change)
    here = os.getcwd()
    with pytest.raises((ValueError, RuntimeError), match=words):
        FmuSystem(damaged)
    assert os.getcwd() == here
    assert not (tmp_path.parent / "escaped.txt").exists()


def test_links_and_broken_archives_are_refused(servos, tmp_path):
    linked = tmp_path / "linked.fmu"
    with zipfile.ZipFile(linked, "w") as archive:
        entry = zipfile.ZipInfo("modelDescription.xml")
        entry.external_attr = (stat.S_IFLNK | 0o777) << 16
        archive.writestr(entry, "/etc/passwd")
    with pytest.raises(ValueError, match="is a link"):
        FmuSystem(linked)
    with open(servos["3.0"], "rb") as file:
        whole = file.read()
    for broken in (whole[: len(whole) // 2], b"", b"PK\x03\x04" + bytes(100)):
        (tmp_path / "broken.fmu").write_bytes(broken)
        with pytest.raises(ValueError, match="it is damaged, or no archive"):
            FmuSystem(tmp_path / "broken.fmu")
    with pytest.raises(OSError, match="nowhere"):
        FmuSystem(tmp_path / "nowhere.fmu")
    os.mkfifo(tmp_path / "pipe.fmu")
    with pytest.raises(ValueError, match="no regular file"):
        FmuSystem(tmp_path / "pipe.fmu")
