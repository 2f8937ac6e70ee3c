"""Logs of vectors: times, values, names and units, and their export as CSV, Parquet and MCAP."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._files import whole_file
from sheldrake.common._overloads import Mismatch
from sheldrake.systems.framework._engine import logs
from sheldrake.systems.framework._engine.store import Store

if TYPE_CHECKING:
    from types import ModuleType

    import numpy as np
    import pandas
    import xarray

    from sheldrake.common._types import Scalars

# ---- kinds and units of quantities, from their names


class Quantity(NamedTuple):
    """What a name says.

    Attributes:
        kind: Such as "angular velocity"; "" when the name says a unit only.
        unit: "" when it is not known.
        label: The name without what kind and unit say already.
    """

    kind: str
    unit: str
    label: str


# Endings of state names, their kind and unit, and the label after what stands before the ending.
_ENDINGS = [
    (r"_(q[wxyz])$", "orientation (quaternion)", "1", r"\1"),
    (r"_(roll|pitch|yaw)$", "orientation (roll, pitch, yaw)", "rad", r"\1"),
    (r"_w([xyz])$", "angular velocity", "rad/s", r"w\1"),
    (r"_v([xyz])$", "velocity", "m/s", r"v\1"),
    (r"_([xyz])$", "position", "m", r"\1"),
    (r"_q$", "joint position", "rad or m", ""),
    (r"_w$", "joint angular velocity", "rad/s", ""),
    (r"_v$", "joint velocity", "m/s", ""),
]


def quantity(name: str) -> Quantity:
    """The kind, unit and label of a named quantity; `name [unit]` and `name (unit)` state their unit."""
    stated = re.fullmatch(r"(.*?)\s*[\[(]([^\])]*)[\])]", name)
    plain, unit = (stated[1], stated[2]) if stated else (name, "")
    for ending, kind, usual, label in _ENDINGS:
        found = re.search(ending, plain)
        if found:
            stem = plain[: found.start()]
            part = found.expand(label)
            return Quantity(kind, unit or usual, f"{stem} {part}".strip() if part else stem)
    return Quantity("", unit, plain) if unit else Quantity("value", "", plain)


def short_labels(labels: list[str]) -> tuple[str, list[str]]:
    """What all labels of a plot begin with, in whole words, and the labels without it.

    The model instance for what belongs to no model is never worth a word. Numbers keep the word before them.
    """
    words = [re.split(r"(?<=[_ /])(?=.)", label.removeprefix("DefaultModelInstance_")) for label in labels]
    same = 0
    if len(words) > 1:
        most = min(map(len, words)) - 1
        while same < most and len({word[same] for word in words}) == 1:
            same += 1
        while same and any(word[same][0].isdigit() for word in words):
            same -= 1
    start = "".join(words[0][:same]).rstrip("_ /") if words else ""
    return start, ["".join(word[same:]) for word in words]


# ---- export


def write_csv(path: str | os.PathLike, times: np.ndarray, values: np.ndarray, names: list[str]) -> None:
    """A line of names, then one line a sample; numbers in full precision, nothing where there is none."""
    with whole_file(path, encoding="utf-8", newline="") as file:
        file.write(",".join(quoted(name) for name in ["time", *names]) + "\n")
        for time, row in zip(times.tolist(), values.tolist()):
            file.write(",".join([repr(time), *("" if x != x else repr(x) for x in row)]) + "\n")


def quoted(name: str) -> str:
    """A name as CSV takes it; one that spreadsheets would take for a formula begins with an apostrophe."""
    if name.startswith(("=", "+", "-", "@", "\t", "\r")):
        name = "'" + name
    return '"' + name.replace('"', '""') + '"' if any(c in name for c in ',"\n') else name


def write_parquet(
    path: str | os.PathLike, times: np.ndarray, values: np.ndarray, names: list[str], units: list[str], call: str
) -> None:
    """A column `time` and one for each element, null where there is none; units as metadata of the columns."""

    hint = "pip install 'sheldrake[parquet]'"
    arrow = _need("pyarrow", call, hint)
    parquet = _need("pyarrow.parquet", call, hint)
    fields = [arrow.field("time", arrow.float64(), metadata={"unit": "s"})]
    fields += [arrow.field(n, arrow.float64(), metadata={"unit": u}) for n, u in zip(names, units)]
    columns = [arrow.array(times)] + [arrow.array(column, from_pandas=True) for column in values.T]
    parquet.write_table(arrow.Table.from_arrays(columns, schema=arrow.schema(fields)), os.fspath(path))


def write_npz(path: str | os.PathLike, **arrays: np.ndarray) -> None:
    """A compressed archive; its name ends in .npz."""
    name = os.fspath(path)
    with whole_file(name if name.endswith(".npz") else f"{name}.npz") as file:
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]  # names of arrays, not its other parameters


class Channel(NamedTuple):
    """What an MCAP file has under one topic: JSON objects in time.

    Attributes:
        topic: Its name.
        schema_name: What viewers know such objects by.
        schema: The same as a JSON schema.
        times: [s].
        message: The object of sample k.
    """

    topic: str
    schema_name: str
    schema: dict[str, Any]
    times: list[float]
    message: Callable[[int], dict[str, Any]]


def log_channel(title: str, log: Any) -> Channel:
    """A log as objects with a number for each element, NaN and infinity as null."""
    names, data = log.names(), log.data().T
    properties = {n: {"type": "number", "description": u} for n, u in zip(names, log.units())}

    def message(k: int) -> dict[str, Any]:
        return {n: x if math.isfinite(x) else None for n, x in zip(names, data[k].tolist())}

    schema = {"type": "object", "properties": properties}
    return Channel("/" + title.lstrip("/"), title, schema, log.sample_times().tolist(), message)


def write_mcap(path: str | os.PathLike, channels: list[Channel], call: str) -> None:
    """Writes channels, messages in the order of their times, and of channels where times are equal."""

    writers = _need("mcap.writer", call, "pip install 'sheldrake[mcap]'")
    with whole_file(path) as file:
        writer = writers.Writer(file)
        writer.start("", "sheldrake")
        queue: list[tuple[int, int, int, int]] = []
        for number, (topic, name, schema, times, _) in enumerate(channels):
            schema_id = writer.register_schema(name, "jsonschema", json.dumps(schema).encode())
            channel = writer.register_channel(topic, "json", schema_id)
            queue += [(round(t * 1e9), number, k, channel) for k, t in enumerate(times)]
        for nanoseconds, number, k, channel in sorted(queue):
            text = json.dumps(channels[number].message(k)).encode()
            writer.add_message(channel, nanoseconds, text, nanoseconds, k)
        writer.finish()


# ---- logs


@checked
class VectorLog:
    """Samples of a vector with their times.

    Args:
        input_size: Number of elements of a sample.
    """

    kDefaultCapacity = 1000

    def __init__(self, input_size: int):
        if not hasattr(input_size, "__index__") or input_size < 0:
            raise Mismatch(f"VectorLog(): incompatible constructor arguments: {input_size!r} is no size")
        self._size, self._count = int(input_size), 0
        self._own = np.empty((self.kDefaultCapacity, self._size + 1))

    def _record(self) -> np.ndarray:
        """Rows of time and sample."""
        return self._own[: self._count]

    def get_input_size(self) -> int:
        """Number of elements of a sample."""
        return self._size

    def __repr__(self) -> str:
        times = self.sample_times()
        span = f", from {times[0]:g} to {times[-1]:g} s" if len(times) else ""
        return f"<VectorLog of {self._size} elements, {len(times)} samples{span}>"

    def num_samples(self) -> int:
        """How many samples there are."""
        return len(self._record())

    def sample_times(self) -> np.ndarray:
        """Times of the samples [s], shape (num_samples,)."""
        return self._record()[:, 0].copy()

    def data(self) -> np.ndarray:
        """The samples as columns, shape (input_size, num_samples)."""
        samples = self._record().copy()[:, 1:].T  # all at once, which takes a third of what columns alone do
        samples.flags.writeable = False
        return samples

    def AddData(self, time: float, sample: Scalars) -> None:
        """Appends a sample.

        Raises:
            RuntimeError: it has another size.
        """
        sample = np.asarray(sample)
        if sample.shape != (self._size,):
            raise RuntimeError(f"VectorLog.AddData(): a sample has size {self._size}, got shape {sample.shape}.")
        if self._count == len(self._own):
            self.Reserve(2 * max(self._count, 1))
        if sample.dtype == object and self._own.dtype != object:
            self._own = self._own.astype(object)
        self._own[self._count, 0], self._own[self._count, 1:] = time, sample
        self._count += 1

    def Clear(self) -> None:
        """Forgets all samples."""
        self._count = 0

    def Reserve(self, capacity: int, /) -> None:
        """Room for at least this many samples."""
        if capacity > len(self._own):
            room = np.empty((capacity, self._size + 1), self._own.dtype)
            room[: self._count] = self._own[: self._count]
            self._own = room

    # Names and tables.

    def _names(self) -> list[str]:
        return [f"y{i}" for i in range(self._size)]

    def names(self) -> list[str]:
        """Names of the elements; of states and their units where the logged system knows them."""
        names = self._names()
        return names if len(names) == self._size else [f"y{i}" for i in range(self._size)]

    def units(self) -> list[str]:
        """Units of the elements as far as their names tell, else ""."""
        return [quantity(name).unit for name in self.names()]

    def ToDataFrame(self) -> pandas.DataFrame:
        """The log as a pandas DataFrame, indexed by time [s].

        Raises:
            ImportError: pandas is not installed.
        """
        pandas = _need("pandas", "VectorLog.ToDataFrame()", "pip install 'sheldrake[dataframe]'")
        index = pandas.Index(self.sample_times(), name="time")
        return pandas.DataFrame(self.data().T, columns=self.names(), index=index)

    def ToXarray(self) -> xarray.DataArray:
        """The log as an xarray DataArray with dimensions `time` [s] and `element`, whose names and units it has.

        Raises:
            ImportError: xarray is not installed.
        """
        xarray = _need("xarray", "VectorLog.ToXarray()", "pip install 'sheldrake[xarray]'")
        coordinates = {"time": ("time", self.sample_times(), {"units": "s"}), "element": self.names()}
        array = xarray.DataArray(self.data().T, coordinates, ("time", "element"))
        return array.assign_coords(unit=("element", self.units()))

    def ToCsv(self, path: str | os.PathLike) -> None:
        """Writes a CSV file: a line of names, then one line a sample; numbers in full precision."""
        write_csv(path, self.sample_times(), self.data().T, self.names())

    def ToNpz(self, path: str | os.PathLike) -> None:
        """Writes an NPZ file with arrays `time`, `data` (input_size, num_samples), `names` and `units`."""
        names, units = (np.array(words, dtype=str) for words in (self.names(), self.units()))
        write_npz(path, time=self.sample_times(), data=self.data(), names=names, units=units)

    def ToParquet(self, path: str | os.PathLike) -> None:
        """Writes a Parquet file with a column `time` and one for each element.

        Raises:
            ImportError: pyarrow is not installed.
        """
        write_parquet(path, self.sample_times(), self.data().T, self.names(), self.units(), "VectorLog.ToParquet()")

    def ToMcap(self, path: str | os.PathLike, topic: str = "log") -> None:
        """Writes an MCAP file with one topic, messages as JSON with a schema.

        Raises:
            ImportError: mcap is not installed.
        """
        write_mcap(path, [log_channel(topic, self)], "VectorLog.ToMcap()")


class _ContextLog(VectorLog):
    """The log that an event loop keeps in a context."""

    def __init__(self, store: Store, number: int, size: int, source_names: Callable[[], list[str] | None]):
        self._store, self._number, self._size = store, number, size
        self._source_names = source_names
        self._memory: Any = None  # where rows were found, and by which layout
        self._layout: Any = None

    def _record(self) -> np.ndarray:
        store = self._store
        if store.waiting.samples:
            return logs.record(store, self._number)
        with store.moving:
            if store.L is not self._memory or store.layout is not self._layout:
                self._memory, self._layout = store.L, store.layout
                self._rows, self._counted = logs.room(store, self._number), logs.place_of_count(store, self._number)
            return self._rows[: store.i[self._counted]]

    def _names(self) -> list[str]:
        return self._source_names() or super()._names()

    def AddData(self, time: float, sample: Scalars) -> None:
        sample = np.asarray(sample)
        if sample.shape != (self._size,):
            raise RuntimeError(f"VectorLog.AddData(): a sample has size {self._size}, got shape {sample.shape}.")
        logs.add(self._store, self._number, time, sample)

    def Clear(self) -> None:
        logs.clear(self._store, self._number)

    def Reserve(self, capacity: int, /) -> None:
        logs.reserve(self._store, self._number, int(capacity))


_ContextLog.__name__ = _ContextLog.__qualname__ = VectorLog.__name__  # to people they are one thing


def _need(module: str, call: str, hint: str) -> ModuleType:
    import importlib

    try:
        return importlib.import_module(module)
    except ImportError:
        raise ImportError(f"{call} needs {module.partition('.')[0]}, which is not installed: {hint}") from None
