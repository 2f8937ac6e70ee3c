"""Logs in files: written while a simulation runs, so that a run that is killed leaves what it logged, and read back.

A file written so is a header and then blocks of samples that are only ever appended. Each block carries its length and
a checksum; a reader takes blocks until one is cut short. A block is handed to the operating system as soon as it is
made: the end of the process, however sudden, loses nothing of it.
"""

from __future__ import annotations

import csv
import json
import os
import struct
import time
import zlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.systems.framework._diagram import all_systems
from sheldrake.systems.primitives._log_set import LogSet, TableLog
from sheldrake.systems.primitives._vector_log_sink import VectorLogSink

if TYPE_CHECKING:
    from sheldrake.systems.analysis import Simulator
    from sheldrake.systems.framework import Context, System
    from sheldrake.systems.framework._engine.store import Store

# ---- written while a simulation runs


MAGIC = b"sheldrake log 1\n"
_HEADER = struct.Struct("<II")  # length and checksum of the JSON header
_BLOCK = struct.Struct("<4sIII")  # what, log, samples, checksum of the samples
_ROWS, _END = b"ROWS", b"END\n"
_ROOM = 8192  # samples of a log whose samples are let go
_PERIOD = 0.1  # [s] of real time between blocks while a simulation advances


class LogStream:
    """A file that grows with the logs of a simulation.

    Made by `StreamLogs`; a context manager that closes the file.

    Attributes:
        path: The file.
    """

    def __init__(self, simulator: Simulator, path: str | os.PathLike, sinks: Mapping[str, VectorLogSink], keep: bool):
        self.path = os.fspath(path)
        self._simulator, self._sinks, self._keep = simulator, dict(sinks), keep
        self._store: Store | None = None
        self._written = [0] * len(self._sinks)
        self._last = -np.inf
        self._file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | getattr(os, "O_BINARY", 0), 0o644)
        self._write(self._header())
        simulator._between.append(self._advance)

    def _logs(self) -> list[Any]:
        context = self._simulator.get_context()
        return [sink.FindLog(context) for sink in self._sinks.values()]

    def _header(self) -> bytes:
        logs = [
            {"title": title, "names": log.names(), "units": log.units()}
            for title, log in zip(self._sinks, self._logs())
        ]
        text = json.dumps({"started": time.time(), "logs": logs}).encode()
        return MAGIC + _HEADER.pack(len(text), zlib.crc32(text)) + text

    def _advance(self, is_end: bool) -> None:
        """Called by the simulator between native spans, and when AdvanceTo() returns."""
        now = time.monotonic()
        if is_end or not self._keep or now - self._last >= _PERIOD:
            self.Flush()
            self._last = now

    def Flush(self) -> None:
        """Writes what was logged since the last time.

        Raises:
            OSError: The disk is full, or the file is gone.
            RuntimeError: The stream is closed.
        """
        if self._file < 0:
            raise RuntimeError(f"LogStream.Flush(): '{self.path}' is closed.")
        store = self._simulator.get_context()._store
        if store is not self._store:  # another context: its logs begin anew
            self._store, self._written = store, [0] * len(self._sinks)
            self._views = self._logs()
            for log in () if self._keep else self._views:
                log.Reserve(_ROOM)  # a full log interrupts the simulation
        blocks = []
        for number, log in enumerate(self._views):
            record = log._record()
            if len(record) < self._written[number]:  # cleared
                self._written[number] = 0
            rows = record[self._written[number] :]
            if len(rows):
                data = np.ascontiguousarray(rows, dtype="<f8").tobytes()
                blocks.append(_BLOCK.pack(_ROWS, number, len(rows), zlib.crc32(data)) + data)
                self._written[number] = len(record)
            if not self._keep and len(record):
                log.Clear()
                self._written[number] = 0
        if blocks:
            self._write(b"".join(blocks))

    def Close(self) -> None:
        """Writes what is left and marks the end; harmless when repeated."""
        if self._file < 0:
            return
        self._simulator._between.remove(self._advance)
        try:
            self.Flush()
            self._write(_BLOCK.pack(_END, 0, 0, 0))
        finally:
            os.close(self._file)
            self._file = -1

    def _write(self, data: bytes) -> None:
        view = memoryview(data)
        while view:
            view = view[os.write(self._file, view) :]

    def __enter__(self) -> LogStream:
        return self

    def __exit__(self, *args: object) -> None:
        self.Close()


def StreamLogs(simulator: Simulator, path: str | os.PathLike, logs: Any = None, *, keep: bool = True) -> LogStream:
    """Writes logs to a file while the simulator advances; read it with `ReadLogs`, plot it with `sheldrake plot`.

    What was logged is on its way to the disk within some 0.2 s of real time, and when AdvanceTo() returns; a process
    that is killed loses no more, and the file can be read up to there.

    Args:
        simulator: A Simulator.
        path: The file, which is overwritten.
        logs: What LogAll() returned, a VectorLogSink, or VectorLogSinks by title; by default all in the diagram.
        keep: Keep the samples in memory, too; False frees them once they are written, for long runs.

    Raises:
        ValueError: There is no log.
        OSError: The file can not be written.
    """
    sinks = _sinks(simulator, logs)
    if not sinks:
        raise ValueError("StreamLogs(): the diagram has no VectorLogSink; add LogVectorOutput() or LogAll().")
    return LogStream(simulator, path, sinks, keep)


def _sinks(simulator: Simulator, logs: Any) -> dict[str, VectorLogSink]:
    if logs is None:
        return find_sinks(simulator.get_system(), simulator.get_context())
    if isinstance(logs, VectorLogSink):
        return {log_title(logs, simulator.get_context()): logs}
    return dict(getattr(logs, "sinks", logs))


def find_sinks(system: System, context: Context) -> dict[str, VectorLogSink]:
    """All VectorLogSinks in a system, by the port that each logs."""
    found: dict[str, VectorLogSink] = {}
    for sink in all_systems(system):
        if isinstance(sink, VectorLogSink):
            title, number = log_title(sink, context), 1
            while title in found:
                number += 1
                title = f"{log_title(sink, context)} ({number})"
            found[title] = sink
    return found


def log_title(sink: VectorLogSink, context: Context) -> str:
    """`system/port` of what a sink logs, or the sink's own name."""
    store = context._store
    kind, m, j = store.layout.sources[store.layout.node_of[sink._system_id], 0]
    if kind != "out":
        return sink.get_name()
    system = store.systems[m]
    return f"{system.get_name()}/{system.get_output_port(j, warn_deprecated=False).get_name()}"


def read_stream(path: str | os.PathLike) -> LogSet:
    """The logs of a file that `StreamLogs` wrote, up to its end or to where it was cut off.

    Raises:
        ValueError: It is no such file, or was cut off before its header was complete.
    """
    with open(path, "rb") as file:
        data = file.read()
    at = len(MAGIC) + _HEADER.size
    if not data.startswith(MAGIC) or len(data) < at:
        raise ValueError(f"'{os.fspath(path)}' is not a log stream.")
    length, checksum = _HEADER.unpack_from(data, len(MAGIC))
    text = data[at : at + length]
    if len(text) < length or zlib.crc32(text) != checksum:
        raise ValueError(f"'{os.fspath(path)}' was cut off before its header was complete: nothing was logged yet.")
    logs = json.loads(text)["logs"]
    rows: list[list[np.ndarray]] = [[] for _ in logs]
    is_complete = False
    at += length
    while at + _BLOCK.size <= len(data):
        what, number, count, checksum = _BLOCK.unpack_from(data, at)
        at += _BLOCK.size
        if what == _END:
            is_complete = True
            break
        if what != _ROWS or number >= len(logs):
            break
        width = len(logs[number]["names"]) + 1
        block = data[at : at + 8 * width * count]
        if len(block) < 8 * width * count or zlib.crc32(block) != checksum:
            break
        rows[number].append(np.frombuffer(block, dtype="<f8").reshape(count, width))
        at += len(block)
    found = {}
    for log, blocks in zip(logs, rows):
        table = np.concatenate(blocks) if blocks else np.zeros((0, len(log["names"]) + 1))
        found[log["title"]] = TableLog(table[:, 0], table[:, 1:].T, log["names"], log["units"])
    return LogSet(found, is_complete)


# ---- read back


def ReadLogs(path: str | os.PathLike) -> LogSet:
    """The logs in a file: what StreamLogs() wrote, or ToNpz(), ToCsv(), ToParquet().

    Raises:
        FileNotFoundError: There is no such file.
        ValueError: It holds no log, or is damaged.
        ImportError: It is a Parquet file, and pyarrow is not installed.
    """
    name = os.fspath(path)
    if os.path.exists(name) and not os.path.isfile(name):
        raise ValueError(f"'{name}' is no regular file.")  # a pipe or a device may never end
    with open(name, "rb") as file:
        start = file.read(len(MAGIC))
    readers = {MAGIC: read_stream, b"PK": _read_npz, b"PAR1": _read_parquet}
    read = next((reader for begin, reader in readers.items() if start.startswith(begin)), _read_csv)
    try:
        return read(name)
    except (ImportError, FileNotFoundError):
        raise
    except Exception as error:  # what libraries raise for files of others is not listed anywhere
        if type(error) is ValueError and name in str(error):
            raise
        raise ValueError(f"'{name}' can not be read: {error or type(error).__name__}") from error


def _title(name: str) -> str:
    return os.path.splitext(os.path.basename(name))[0]


_MOST_BYTES, _MOST_PACKED = 1 << 30, 300  # a small file must not fill all memory


def _read_npz(name: str) -> LogSet:
    with np.load(name, allow_pickle=False) as arrays:
        size = sum(entry.file_size for entry in arrays.zip.infolist())
        if size > max(_MOST_BYTES, _MOST_PACKED * os.path.getsize(name)):
            raise ValueError(f"'{name}' would unpack to {size} bytes, more than {_MOST_PACKED} times its own size.")
        held = {key: arrays[key] for key in arrays.files}
    if "titles" in held:
        return LogSet(
            {
                str(title): TableLog(held[f"time_{k}"], held[f"data_{k}"], held[f"names_{k}"], held[f"units_{k}"])
                for k, title in enumerate(held["titles"])
            }
        )
    if "time" not in held or "data" not in held:
        raise ValueError(f"'{name}' has no arrays `time` and `data`; it has {', '.join(held) or 'none'}.")
    return LogSet({_title(name): TableLog(held["time"], held["data"], held.get("names"), held.get("units"))})


def _read_csv(name: str) -> LogSet:
    with open(name, encoding="utf-8", newline="") as file:
        try:
            rows = list(csv.reader(file))
            if not rows or rows[0][:1] != ["time"]:
                raise ValueError("its first column is not `time`")
            values = [[float(cell) if cell else np.nan for cell in row] for row in rows[1:]]
            table = np.array(values, dtype=float).reshape(-1, len(rows[0]))
        except UnicodeDecodeError:
            raise ValueError(f"'{name}' is not a log: it is neither text nor an .npz or .parquet file.") from None
        except (ValueError, csv.Error) as error:
            raise ValueError(f"'{name}' is not a log: {error}.") from None
    return _split(name, table[:, 0], table[:, 1:].T, rows[0][1:], None)


def _read_parquet(name: str) -> LogSet:
    from sheldrake.systems.primitives._vector_log import _need

    parquet = _need("pyarrow.parquet", "ReadLogs()", "pip install 'sheldrake[parquet]'")
    table = parquet.read_table(name)
    if table.column_names[:1] != ["time"]:
        raise ValueError(f"'{name}' is not a log: its first column is not `time`.")
    columns = [np.asarray(table.column(i).to_numpy(), dtype=float) for i in range(table.num_columns)]
    units = [((table.schema.field(i).metadata or {}).get(b"unit", b"")).decode() for i in range(1, table.num_columns)]
    data = np.array(columns[1:]).reshape(len(columns) - 1, -1)
    return _split(name, columns[0], data, table.column_names[1:], units)


def _split(name: str, times: np.ndarray, data: np.ndarray, columns: list[str], units: list[str] | None) -> LogSet:
    """Columns `title: element` to logs by title; times at which a log has nothing left out."""
    by_title: dict[str, list[int]] = {}
    elements = []
    for number, column in enumerate(columns):
        title, separator, element = column.rpartition(": ")
        by_title.setdefault(title if separator else "", []).append(number)
        elements.append(element)
    logs = {}
    for title, numbers in by_title.items():
        part = data[numbers]
        there = ~np.isnan(part).all(axis=0) if len(by_title) > 1 else np.ones(len(times), dtype=bool)
        given = None if units is None else [units[i] for i in numbers]
        logs[title or _title(name)] = TableLog(times[there], part[:, there], [elements[i] for i in numbers], given)
    return LogSet(logs)
