"""Saved contexts: a new process goes on with the same bits; what cannot be saved or loaded is said."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.unit.systems.framework.saved_run import build, results

from sheldrake.common.value import Value
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder, LeafSystem, LoadContext, SaveContext
from sheldrake.systems.primitives import Gain, Integrator

PROGRAM = Path(__file__).with_name("saved_run.py")


def go_on_elsewhere(path):
    done = subprocess.run([sys.executable, str(PROGRAM), "go-on", str(path)], env=dict(os.environ), capture_output=True)
    assert done.returncode == 0, done.stderr.decode()
    with np.load(f"{path}.npz") as found:
        return dict(found)


@pytest.fixture(scope="module")
def half(tmp_path_factory):
    """A run saved at 0.5 s, and what it came to at 1 s without stopping."""
    path = tmp_path_factory.mktemp("saved") / "half.npz"
    diagram = build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.5)
    SaveContext(simulator.get_context(), path)
    simulator.AdvanceTo(1.0)
    return path, results(diagram, simulator.get_context())


def test_another_process_goes_on_with_the_same_bits(half):
    path, never_stopped = half
    found = go_on_elsewhere(path)
    assert found.keys() == never_stopped.keys()
    for name, values in never_stopped.items():
        np.testing.assert_array_equal(found[name], values, err_msg=name)
    assert len(never_stopped["plant log times"]) > 1000


def test_the_comparison_sees_one_bit(half, tmp_path):
    diagram = build()
    context = LoadContext(diagram, half[0])
    x = context._store.S
    x[1] = np.nextafter(x[1], np.inf)
    SaveContext(context, tmp_path / "off.npz")
    found = go_on_elsewhere(tmp_path / "off.npz")
    assert not all(np.array_equal(found[name], half[1][name]) for name in found)


def test_everything_comes_back(tmp_path):
    class Everything(LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareAbstractState(Value[object]({"a": [1, 2.5, None, "ä"], "b": np.arange(6).reshape(2, 3)}))
            self.DeclareAbstractParameter(Value("text"))
            self.DeclareNumericParameter(_vector([1.0, 2.0]))
            self.DeclareDiscreteState(3)
            self.DeclareVectorInputPort("u", 2)
            self.DeclareAbstractInputPort("v", Value[str]())

    system = Everything()
    context = system.CreateDefaultContext()
    context.SetTime(3.25)
    context.SetAccuracy(1e-5)
    context.SetAbstractState(0, {"a": (1, True), "c": np.array([np.pi, -0.0])})
    context.get_mutable_abstract_parameter(0).set_value("changed")
    context.get_mutable_numeric_parameter(0).SetFromVector([5.0, np.nextafter(6.0, 7.0)])
    context.SetDiscreteState([7.0, 8.0, 9.0])
    system.get_input_port(0).FixValue(context, [0.1, 0.2])
    system.get_input_port(1).FixValue(context, "hello")
    SaveContext(context, tmp_path / "c.npz")
    found = LoadContext(Everything(), tmp_path / "c.npz")
    assert found.get_time() == 3.25 and found.get_accuracy() == 1e-5
    state = found.get_abstract_state(0).get_value()
    assert state["a"] == (1, True) and state["c"].tobytes() == np.array([np.pi, -0.0]).tobytes()
    assert found.get_abstract_parameter(0).get_value() == "changed"
    np.testing.assert_array_equal(found.get_numeric_parameter(0).value(), [5.0, np.nextafter(6.0, 7.0)])
    np.testing.assert_array_equal(found.get_discrete_state_vector().value(), [7.0, 8.0, 9.0])
    loaded = found._store.systems[0]
    np.testing.assert_array_equal(loaded.get_input_port(0).Eval(found), [0.1, 0.2])
    assert loaded.get_input_port(1).Eval(found) == "hello"


def _vector(values):
    from sheldrake.systems.framework import BasicVector

    return BasicVector(values)


def _diagram(size=1, name="gain"):
    builder = DiagramBuilder()
    gain = builder.AddNamedSystem(name, Gain(2.0, size))
    integrator = builder.AddNamedSystem("integrator", Integrator(size))
    builder.Connect(gain.get_output_port(), integrator.get_input_port())
    builder.ExportInput(gain.get_input_port(), "u")
    return builder.Build()


@pytest.mark.parametrize(("other", "words"), [(_diagram(2), "integrator"), (_diagram(1, "loud"), "gain")])
def test_another_system_is_named(other, words, tmp_path):
    SaveContext(_diagram().CreateDefaultContext(), tmp_path / "c.npz")
    with pytest.raises(RuntimeError, match=f"saved for another system.*{words}"):
        LoadContext(other, tmp_path / "c.npz")


def test_a_connected_input_that_was_fixed_stays_fixed(tmp_path):
    diagram = _diagram()
    context = diagram.CreateDefaultContext()
    diagram.get_input_port().FixValue(context, [1.0])
    port = diagram.GetSubsystemByName("integrator").get_input_port()
    port.FixValue(diagram.GetSubsystemByName("integrator").GetMyMutableContextFromRoot(context), [5.0])
    SaveContext(context, tmp_path / "c.npz")
    other = _diagram()
    found = LoadContext(other, tmp_path / "c.npz")
    integrator = other.GetSubsystemByName("integrator")
    assert integrator.get_input_port().Eval(integrator.GetMyContextFromRoot(found)) == [5.0]


@pytest.mark.parametrize("content", [b"", b"garbage", b"PK\x03\x04 cut short"])
def test_another_file_is_refused(content, tmp_path):
    (tmp_path / "c.npz").write_bytes(content)
    with pytest.raises(RuntimeError, match="no file of SaveContext"):
        LoadContext(_diagram(), tmp_path / "c.npz")


def test_a_cut_file_is_refused(half, tmp_path):
    whole = half[0].read_bytes()
    (tmp_path / "c.npz").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(RuntimeError, match="no file of SaveContext"):
        LoadContext(build(), tmp_path / "c.npz")


def test_an_archive_of_others_is_refused(tmp_path):
    np.savez(tmp_path / "c.npz", a=np.zeros(3))
    with pytest.raises(RuntimeError, match="no file of SaveContext"):
        LoadContext(_diagram(), tmp_path / "c.npz")


def test_values_nested_without_end_are_refused(tmp_path):
    system = LeafSystem()
    system.DeclareAbstractState(Value[object]([1.0]))
    SaveContext(system.CreateDefaultContext(), tmp_path / "c.npz")
    with np.load(tmp_path / "c.npz") as archive:
        found = dict(archive)
    text = str(found["meta"])
    plain = '{"list": [{"plain": 1.0}]}'
    assert plain in text
    for depth in (100, 900, 100_000):
        deep = '{"list": [' * depth + plain + "]}" * depth
        found["meta"] = np.array(text.replace(plain, deep))
        np.savez(tmp_path / "deep.npz", **found)
        if depth == 100:
            LoadContext(system, tmp_path / "deep.npz")
            continue
        with pytest.raises(RuntimeError, match="no file of SaveContext"):
            LoadContext(system, tmp_path / "deep.npz")


def test_no_file(tmp_path):
    with pytest.raises(FileNotFoundError):
        LoadContext(_diagram(), tmp_path / "none.npz")


def test_what_cannot_be_saved_is_named(tmp_path):
    class Holder(LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareAbstractState(Value[object](object()))

    system = Holder()
    system.set_name("holder")
    with pytest.raises(TypeError, match=r"holder.*object"):
        SaveContext(system.CreateDefaultContext(), tmp_path / "c.npz")
    assert not (tmp_path / "c.npz").exists()
    diagram = _diagram()
    with pytest.raises(RuntimeError, match="root"):
        SaveContext(diagram.GetSubsystemByName("gain").GetMyContextFromRoot(diagram.CreateDefaultContext()), "c.npz")
    with pytest.raises(RuntimeError, match="float"):
        SaveContext(diagram.ToAutoDiffXd().CreateDefaultContext(), tmp_path / "c.npz")


def test_a_changed_scene_is_not_lost_silently(tmp_path):
    diagram = build()
    context = diagram.CreateDefaultContext()
    scene_graph = diagram.GetSubsystemByName("scene_graph")
    mine = scene_graph.GetMyMutableContextFromRoot(context)
    inspector = scene_graph.model_inspector()
    (geometry, *_) = inspector.GetAllGeometryIds()
    plant = diagram.GetSubsystemByName("plant")
    scene_graph.RemoveGeometry(mine, plant.get_source_id(), geometry)
    with pytest.raises(TypeError, match="GeometryState"):
        SaveContext(context, tmp_path / "c.npz")
