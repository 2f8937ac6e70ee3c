"""Logs of everything, exports, and streams that survive the end of their process."""

import os
import re

import numpy as np
import pytest
from killed_runs import kill_at_moments

from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import (
    Adder,
    ConstantVectorSource,
    Gain,
    Integrator,
    LogAll,
    LogSet,
    LogVectorOutput,
    ReadLogs,
    Sine,
    StreamLogs,
    VectorLog,
)


def diagram_with_logs(**options):
    builder = DiagramBuilder()
    sine = builder.AddNamedSystem("sine", Sine(1.0, 2.0, 0.0, 2))
    integrator = builder.AddNamedSystem("integrator", Integrator(2))
    builder.AddNamedSystem("lonely", Gain(1.0, 1))
    builder.Connect(sine.get_output_port(0), integrator.get_input_port())
    logs = LogAll(builder, **options)
    return builder.Build(), logs


def ran(until=1.0, **options):
    diagram, logs = diagram_with_logs(**options)
    simulator = Simulator(diagram)
    simulator.AdvanceTo(until)
    return simulator, logs


def test_log_all_logs_every_vector_port_that_can_be_computed():
    simulator, logs = ran(publish_period=0.1)
    assert len(logs.sinks) == 4 and all(re.fullmatch("(sine|integrator)/\\w+", title) for title in logs.sinks)
    (skipped,) = logs.skipped
    assert skipped.startswith("lonely/") and "not connected" in logs.skipped[skipped]
    found = logs.FindLogs(simulator.get_context())
    first = found[next(iter(found))]
    np.testing.assert_allclose(first.sample_times(), np.arange(11) * 0.1, atol=1e-12)
    np.testing.assert_allclose(first.data()[0], np.sin(2.0 * first.sample_times()), atol=1e-12)
    with pytest.raises(KeyError, match="There is no log 'nothing'"):
        found["nothing"]


def test_log_all_can_be_narrowed():
    diagram, logs = diagram_with_logs(only="^integrator/")
    assert len(logs.sinks) == 1 and not logs.skipped
    assert all(title.startswith("integrator/") for title in logs.sinks)
    assert len(diagram.GetSystems()) == 4


def test_logs_of_a_plant_have_names_and_units():
    import sheldrake
    from sheldrake.multibody.parsing import Parser
    from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    Parser(plant).AddModels(sheldrake.model_path("two_hole_block/two_hole_block.urdf"))
    plant.Finalize()
    logs = LogAll(builder)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.01)
    found = logs.FindLogs(simulator.get_context())
    name = plant.GetModelInstanceName(plant.get_body(next(iter(plant.GetFloatingBaseBodies()))).model_instance())
    assert set(found) == {"plant/state", "plant/generalized_acceleration", f"plant/{name}_generalized_contact_forces"}
    assert found["plant/state"].units() == ["1"] * 4 + ["m"] * 3 + ["rad/s"] * 3 + ["m/s"] * 3
    acceleration = found["plant/generalized_acceleration"]
    assert acceleration.names()[-1].endswith("_vz_dot [rad/s^2 or m/s^2]")
    assert acceleration.data()[-1, -1] == pytest.approx(-9.81)
    assert found["plant/state"].num_samples() == 11


def two_logs():
    first, second = VectorLog(2), VectorLog(1)
    for t in (0.0, 0.1, 0.2):
        first.AddData(t, [t, -t])
    for t in (0.1, 0.3):
        second.AddData(t, [10 * t])
    return LogSet({"a/state": first, "b/out": second})


@pytest.mark.parametrize(
    "ending, write, module",
    [
        ("npz", "ToNpz", None),
        ("csv", "ToCsv", None),
        ("parquet", "ToParquet", "pyarrow.parquet"),
    ],
)
def test_sets_go_to_files_and_back(tmp_path, ending, write, module):
    if module:
        pytest.importorskip(module)
    path = tmp_path / f"logs.{ending}"
    logs = two_logs()
    getattr(logs, write)(path)
    back = ReadLogs(path)
    assert back.is_complete is None
    assert sum(log.get_input_size() for log in back.values()) == 3
    np.testing.assert_array_equal(back["a/state"].data(), logs["a/state"].data())
    np.testing.assert_array_equal(back["a/state"].sample_times(), [0.0, 0.1, 0.2])
    assert back["a/state"].names() == ["y0", "y1"]
    single = back["b/out"] if ending == "npz" else next(log for t, log in back.items() if t != "a/state")
    np.testing.assert_array_equal(single.data(), [[1.0, 3.0]])


@pytest.mark.parametrize("ending, write", [("npz", "ToNpz"), ("csv", "ToCsv")])
def test_one_log_goes_to_a_file_and_back(tmp_path, ending, write):
    log = two_logs()["a/state"]
    getattr(log, write)(tmp_path / f"one.{ending}")
    (back,) = ReadLogs(tmp_path / f"one.{ending}").values()
    np.testing.assert_array_equal(back.data(), log.data())
    assert back.names() == ["y0", "y1"]


def test_one_table_of_logs_with_different_times():
    pandas = pytest.importorskip("pandas")
    frame = two_logs().ToDataFrame()
    assert isinstance(frame, pandas.DataFrame)
    assert list(frame.columns) == ["a/state: y0", "a/state: y1", "b/out"]
    assert frame["b/out"].isna().sum() == 2 and frame.loc[0.1, "b/out"] == 1.0
    assert set(frame.attrs["units"]) == set(frame.columns)


def test_mcap(tmp_path):
    readers = pytest.importorskip("mcap.reader")
    import json

    two_logs().ToMcap(tmp_path / "logs.mcap")
    with open(tmp_path / "logs.mcap", "rb") as file:
        messages = [
            (channel.topic, message.log_time, json.loads(message.data))
            for schema, channel, message in readers.make_reader(file).iter_messages()
        ]
    assert ("/a/state", 100_000_000, {"y0": 0.1, "y1": -0.1}) in messages
    assert [m[0] for m in messages].count("/b/out") == 2
    assert [m[1] for m in messages] == sorted(m[1] for m in messages)


def test_what_is_no_log_is_refused(tmp_path):
    for name, data, what in (
        ("a.csv", b"x,y\n1,2\n", "first column"),
        ("b.csv", b"time,y\n1,two\n", "not a log"),
        ("c.npz", b"PK garbage", "can not be read"),
        ("d.bin", bytes(range(256)), "not a log"),
        ("e.log", b"sheldrake log 1\n", "not a log stream"),
        ("f.log", b"sheldrake log 1\n" + bytes([200, 0, 0, 0, 0, 0, 0, 0]), "cut off"),
    ):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(ValueError, match=what):
            ReadLogs(tmp_path / name)
    with pytest.raises(FileNotFoundError):
        ReadLogs(tmp_path / "absent")


# Streams.


def test_a_stream_has_what_the_logs_have(tmp_path):
    diagram, logs = diagram_with_logs(publish_period=1e-3)
    simulator = Simulator(diagram)
    with StreamLogs(simulator, tmp_path / "run.log") as stream:
        simulator.AdvanceTo(0.5)
        halfway = ReadLogs(tmp_path / "run.log")
        simulator.AdvanceTo(1.0)
    assert halfway.is_complete is False and next(iter(halfway.values())).num_samples() == 501
    stream.Close()
    back = ReadLogs(tmp_path / "run.log")
    found = logs.FindLogs(simulator.get_context())
    assert back.is_complete is True and set(back) == set(found)
    for title, log in found.items():
        np.testing.assert_array_equal(back[title].sample_times(), log.sample_times())
        np.testing.assert_array_equal(back[title].data(), log.data())
    simulator.AdvanceTo(1.1)
    assert next(iter(ReadLogs(tmp_path / "run.log").values())).num_samples() == 1001
    with pytest.raises(RuntimeError, match="closed"):
        stream.Flush()


def test_memory_can_be_let_go(tmp_path):
    diagram, logs = diagram_with_logs(publish_period=1e-3)
    simulator = Simulator(diagram)
    with StreamLogs(simulator, tmp_path / "run.log", logs, keep=False):
        for until in (1.0, 2.0, 50.0):
            simulator.AdvanceTo(until)
            assert all(log.num_samples() == 0 for log in logs.FindLogs(simulator.get_context()).values())
    for log in ReadLogs(tmp_path / "run.log").values():
        np.testing.assert_allclose(log.sample_times(), np.arange(50_001) * 1e-3, atol=1e-9)
    assert simulator.get_context()._store.L.size < 4 * 8192 * 4


def test_logs_that_are_cleared_or_replaced_go_on(tmp_path):
    diagram, logs = diagram_with_logs(publish_period=0.1)
    simulator = Simulator(diagram)
    with StreamLogs(simulator, tmp_path / "run.log"):
        simulator.AdvanceTo(0.5)
        for sink in logs.sinks.values():
            sink.FindMutableLog(simulator.get_context()).Clear()
        simulator.AdvanceTo(1.0)
        simulator.reset_context(diagram.CreateDefaultContext())
        simulator.AdvanceTo(0.2)
    log = next(iter(ReadLogs(tmp_path / "run.log").values()))
    np.testing.assert_allclose(log.sample_times(), [*np.arange(11) * 0.1, 0.0, 0.1, 0.2], atol=1e-12)


def test_a_file_cut_anywhere_gives_what_came_before(tmp_path):
    diagram, _ = diagram_with_logs(publish_period=0.1)
    simulator = Simulator(diagram)
    with StreamLogs(simulator, tmp_path / "run.log"):
        for until in (0.3, 0.6, 1.0):
            simulator.AdvanceTo(until)
    whole = (tmp_path / "run.log").read_bytes()
    full = ReadLogs(tmp_path / "run.log")
    seen = set()
    for end in range(0, len(whole), 7):
        (tmp_path / "cut.log").write_bytes(whole[:end])
        try:
            cut = ReadLogs(tmp_path / "cut.log")
        except ValueError:
            continue
        assert cut.is_complete is False
        for title, log in cut.items():
            n = log.num_samples()
            seen.add(n)
            np.testing.assert_array_equal(log.data(), full[title].data()[:, :n])
    assert len(seen) >= 4 and {0, 11} <= seen
    damaged = bytearray(whole)
    damaged[-200] ^= 1
    (tmp_path / "cut.log").write_bytes(damaged)
    assert ReadLogs(tmp_path / "cut.log").is_complete is False


def test_streams_need_logs(tmp_path):
    builder = DiagramBuilder()
    builder.AddSystem(ConstantVectorSource([1.0]))
    simulator = Simulator(builder.Build())
    with pytest.raises(ValueError, match="no VectorLogSink"):
        StreamLogs(simulator, tmp_path / "run.log")
    assert not (tmp_path / "run.log").exists()


def test_sinks_in_diagrams_in_diagrams_are_found(tmp_path):
    inner = DiagramBuilder()
    adder = inner.AddNamedSystem("adder", Adder(1, 1))
    inner.ExportInput(adder.get_input_port(0))
    inner.ExportOutput(adder.get_output_port())
    LogVectorOutput(adder.get_output_port(), inner, 0.1)
    LogVectorOutput(adder.get_output_port(), inner, 0.2)
    outer = DiagramBuilder()
    source = outer.AddSystem(ConstantVectorSource([3.0]))
    outer.Connect(source.get_output_port(), outer.AddSystem(inner.Build()).get_input_port(0))
    simulator = Simulator(outer.Build())
    with StreamLogs(simulator, tmp_path / "run.log"):
        simulator.AdvanceTo(1.0)
    logs = ReadLogs(tmp_path / "run.log")
    assert list(logs) == ["adder/sum", "adder/sum (2)"]
    assert [log.num_samples() for log in logs.values()] == [11, 6]


@pytest.mark.parametrize("rate, work", [(1.0, 0.0), (0.0, 0.0), (0.0, 0.02)])
def test_a_killed_run_loses_less_than_a_second(tmp_path, rate, work):
    """In step with real time, as fast as possible, and with slow steps."""
    (lost,) = kill_at_moments(tmp_path, [1.3], rate=rate, work=work)
    assert lost < 1.0


@pytest.mark.slow
def test_runs_killed_at_random_moments(tmp_path):
    """A taste of `tests/endurance`, where there are twenty over a whole minute."""
    moments = np.random.default_rng(7).uniform(0.0, 12.0, 5)
    lost = kill_at_moments(tmp_path, moments.tolist(), scene="block")
    assert max(lost) < 1.0, lost


@pytest.mark.parametrize("cut", [2, 30, 100, -1])
@pytest.mark.parametrize("name", ["a.npz", "a.parquet"])
def test_a_file_that_was_cut_is_refused_by_name(tmp_path, name, cut):
    if name == "a.parquet":
        pytest.importorskip("pyarrow")
    path = tmp_path / name
    getattr(two_logs(), "ToNpz" if name == "a.npz" else "ToParquet")(path)
    path.write_bytes(path.read_bytes()[:cut])
    with pytest.raises(ValueError, match=re.escape(str(path))):
        ReadLogs(path)


@pytest.mark.parametrize(
    ("array", "value"),
    [("time", np.zeros((2, 2))), ("time", np.zeros(7)), ("data", np.array(3.0)), ("names", ["x"]), ("units", "m")],
)
def test_arrays_that_do_not_belong_together_are_refused_by_name(tmp_path, array, value):
    path = tmp_path / "a.npz"
    arrays = {"time": np.zeros(3), "data": np.zeros((2, 3)), "names": ["a", "b"], "units": ["m", ""]}
    np.savez(path, **arrays)
    assert len(ReadLogs(path)["a"].sample_times()) == 3
    np.savez(path, **(arrays | {array: value}))
    with pytest.raises(ValueError, match=re.escape(str(path))):
        ReadLogs(path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="asks for a pipe in the file system")
def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "a.csv")
    with pytest.raises(ValueError, match="no regular file"):
        ReadLogs(tmp_path / "a.csv")
