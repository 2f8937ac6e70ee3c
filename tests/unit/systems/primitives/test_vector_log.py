"""Logs: samples, triggers, names and files."""

import builtins
import csv

import numpy as np
import pytest

from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder, EventStatus, TriggerType
from sheldrake.systems.framework._engine import logs
from sheldrake.systems.primitives import LogVectorOutput, Sine, VectorLog, VectorLogSink
from sheldrake.systems.primitives._vector_log import write_csv


def logged(**kwargs):
    builder = DiagramBuilder()
    wave = builder.AddSystem(Sine(1.0, 2.0, 0.1, 2))
    sink = LogVectorOutput(wave.get_output_port(0), builder, **kwargs)
    other = LogVectorOutput(wave.get_output_port(1), builder, 0.25)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(1.0)
    return simulator, sink, other


@pytest.mark.parametrize(
    ("kwargs", "times"),
    [
        ({}, [0.0, 0.25, 0.5, 0.75, 1.0]),
        ({"publish_period": 0.5}, [0.0, 0.5, 1.0]),
        ({"publish_triggers": {TriggerType.kForced}}, []),
        ({"publish_triggers": {TriggerType.kPeriodic}, "publish_period": 1.0}, [0.0, 1.0]),
    ],
)
def test_when_a_sample_is_taken(kwargs, times):
    simulator, sink, _ = logged(**kwargs)
    context = simulator.get_context()
    log = sink.FindLog(context)
    assert log.sample_times().tolist() == times
    expected = [[np.sin(2.0 * t + 0.1)] * 2 for t in times]
    np.testing.assert_allclose(log.data(), np.array(expected).reshape(-1, 2).T, rtol=1e-15)
    simulator.get_system().ForcedPublish(context)
    forced = kwargs.get("publish_triggers", {TriggerType.kForced}) >= {TriggerType.kForced}
    assert sink.FindLog(context).num_samples() == len(times) + forced


def test_the_log_belongs_to_the_context():
    simulator, sink, other = logged()
    context = simulator.get_context()
    clone = context.Clone()
    sink.FindMutableLog(context).Clear()
    assert sink.FindLog(context).num_samples() == 0
    assert sink.FindLog(clone).num_samples() == other.FindLog(context).num_samples() == 5
    sink.FindMutableLog(context).Reserve(100000)
    simulator.AdvanceTo(3.0)
    assert sink.FindLog(context).num_samples() == 8
    assert other.FindLog(context).num_samples() == 13
    assert sink.GetLog(sink.GetMyContextFromRoot(context)).num_samples() == 8
    with pytest.raises(RuntimeError, match="contains no System"):
        sink.FindLog(VectorLogSink(1).CreateDefaultContext())


def test_logs_with_room_stay_where_they_are_at_initialize():
    simulator, sink, _ = logged()
    context = simulator.get_mutable_context()
    store = context._store
    samples = store.L
    for round in range(1, 4):
        context.SetTime(0.0)
        simulator.Initialize()
        assert sink.FindLog(context).num_samples() == 5 + round
    assert store.L is samples
    for _ in range(300):
        simulator.Initialize()
    assert store.L is not samples and sink.FindLog(context).sample_times().tolist()[-2:] == [0.0, 0.0]
    assert sink.FindLog(context).num_samples() == 308


def test_a_long_run_makes_room_once(monkeypatch):
    moves = []
    lay_out = logs._lay_out
    monkeypatch.setattr(logs, "_lay_out", lambda *args: (moves.append(args), lay_out(*args)))
    simulator, sink, other = logged(publish_period=2.0**-10)
    simulator.AdvanceTo(40.0)
    log = sink.FindLog(simulator.get_context())
    np.testing.assert_array_equal(log.sample_times(), np.arange(40 * 1024 + 1) / 1024)
    np.testing.assert_allclose(log.data()[0], np.sin(2.0 * log.sample_times() + 0.1), atol=1e-14)
    np.testing.assert_array_equal(other.FindLog(simulator.get_context()).sample_times(), np.arange(161) / 4)
    assert len(moves) == 2  # `logged` knows nothing but one second


def test_a_run_without_an_end_makes_room_by_and_by():
    simulator, sink, _ = logged(publish_period=2.0**-10)
    simulator.set_monitor(
        lambda context: (
            EventStatus.ReachedTermination(simulator.get_system(), "enough")
            if context.get_time() == 8.0
            else EventStatus.DidNothing()
        )
    )
    simulator.AdvanceTo(1e8)
    context = simulator.get_context()
    assert sink.FindLog(context).num_samples() == 8 * 1024 + 1
    assert context._store.L.nbytes < 2 * 16e6  # of the 2.4 TB that it would fill


def test_a_log_by_hand():
    log = VectorLog(2)
    for k in range(2500):
        log.AddData(0.1 * k, [k, -k])
    assert log.num_samples() == 2500 and log.get_input_size() == 2
    assert np.array_equal(log.data()[1], -np.arange(2500.0))
    with pytest.raises(RuntimeError, match="size 2"):
        log.AddData(0.0, [1.0])
    log.Clear()
    assert log.data().shape == (2, 0)


def test_bad_triggers():
    with pytest.raises(RuntimeError, match="if and only if"):
        VectorLogSink(1, {TriggerType.kPeriodic})
    with pytest.raises(RuntimeError, match="some of kForced"):
        VectorLogSink(1, {TriggerType.kWitness})
    with pytest.raises(RuntimeError, match="not be negative"):
        VectorLogSink(1, -1.0)


def test_files(tmp_path):
    simulator, sink, _ = logged()
    log = sink.FindLog(simulator.get_context())
    log.ToCsv(tmp_path / "log.csv")
    lines = (tmp_path / "log.csv").read_text().splitlines()
    assert lines[0] == "time,y0,y1" and len(lines) == 6
    table = np.array([[float(x) for x in line.split(",")] for line in lines[1:]])
    assert np.array_equal(table[:, 0], log.sample_times()) and np.array_equal(table[:, 1:].T, log.data())
    log.ToNpz(tmp_path / "log.npz")
    with np.load(tmp_path / "log.npz") as arrays:
        assert np.array_equal(arrays["time"], log.sample_times())
        assert np.array_equal(arrays["data"], log.data())
        assert arrays["names"].tolist() == ["y0", "y1"]


def test_data_frame():
    pandas = pytest.importorskip("pandas")
    simulator, sink, _ = logged()
    log = sink.FindLog(simulator.get_context())
    frame = log.ToDataFrame()
    assert isinstance(frame, pandas.DataFrame)
    assert frame.columns.tolist() == ["y0", "y1"] and frame.index.name == "time"
    assert np.array_equal(frame.to_numpy().T, log.data())


def test_parquet(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    simulator, sink, _ = logged()
    log = sink.FindLog(simulator.get_context())
    log.ToParquet(tmp_path / "log.parquet")
    table = parquet.read_table(tmp_path / "log.parquet")
    assert table.column_names == ["time", "y0", "y1"]
    columns = [column.to_numpy() for column in table.columns]
    assert np.array_equal(columns[0], log.sample_times()) and np.array_equal(columns[1:], log.data())


def test_what_is_not_installed_is_named(monkeypatch, tmp_path):
    real = builtins.__import__

    def without(name, *args, **kwargs):
        if name.startswith(("pandas", "pyarrow")):
            raise ImportError(name)
        return real(name, *args, **kwargs)

    import importlib

    monkeypatch.setattr(importlib, "import_module", lambda name, package=None: without(name))
    log = VectorLog(1)
    with pytest.raises(ImportError, match=r"needs pandas.*sheldrake\[dataframe\]"):
        log.ToDataFrame()
    with pytest.raises(ImportError, match=r"needs pyarrow.*sheldrake\[parquet\]"):
        log.ToParquet(tmp_path / "log.parquet")


def test_names_of_states_where_the_source_knows_them():
    class Named(Sine):
        def _output_names(self, j):
            return ["angle [rad]", "rate [rad/s]"]

    builder = DiagramBuilder()
    wave = builder.AddSystem(Named(1.0, 2.0, 0.1, 2))
    sink = LogVectorOutput(wave.get_output_port(0), builder)
    context = builder.Build().CreateDefaultContext()
    assert sink.FindLog(context).names() == ["angle [rad]", "rate [rad/s]"]


@pytest.mark.parametrize("name", ["=1+1", "+x", "-x", "@SUM(A1)", "\tx", '=HYPERLINK("a,b")'])
def test_a_name_is_no_formula_of_a_spreadsheet(tmp_path, name):
    write_csv(tmp_path / "log.csv", np.zeros(1), np.zeros((1, 1)), [name])
    with open(tmp_path / "log.csv", newline="", encoding="utf-8") as file:
        assert next(csv.reader(file)) == ["time", "'" + name]


def test_a_small_file_that_unpacks_to_gigabytes_is_refused(tmp_path, monkeypatch):
    from sheldrake.systems.primitives import ReadLogs, _log_files

    np.savez_compressed(tmp_path / "a.npz", time=np.zeros(200_000), data=np.zeros((1, 200_000)))
    assert ReadLogs(tmp_path / "a.npz")
    monkeypatch.setattr(_log_files, "_MOST_BYTES", 1 << 20)
    with pytest.raises(ValueError, match="would unpack to 3200256 bytes, more than 300 times its own size"):
        ReadLogs(tmp_path / "a.npz")
