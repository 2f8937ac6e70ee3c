"""Logs of vectors: times, values, names, and export to tables."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from sheldrake.systems.framework._engine import logs
from sheldrake.systems.primitives._log_export import write_csv, write_mcap, write_parquet
from sheldrake.systems.primitives._log_units import quantity


class VectorLog:
    """Samples of a vector with their times.

    Args:
        input_size: Number of elements of a sample.
    """

    kDefaultCapacity = 1000

    def __init__(self, input_size: int):
        if not hasattr(input_size, "__index__") or input_size < 0:
            raise TypeError(f"VectorLog(): incompatible constructor arguments: {input_size!r} is no size")
        self._size, self._count = int(input_size), 0
        self._own = np.empty((self.kDefaultCapacity, self._size + 1))

    def _record(self) -> np.ndarray:
        """Rows of time and sample."""
        return self._own[: self._count]

    def get_input_size(self) -> int:
        """Number of elements of a sample."""
        return self._size

    def num_samples(self) -> int:
        """How many samples there are."""
        return len(self._record())

    def sample_times(self) -> np.ndarray:
        """Times of the samples [s], shape (num_samples,)."""
        return self._record()[:, 0].copy()

    def data(self) -> np.ndarray:
        """The samples as columns, shape (input_size, num_samples)."""
        samples = self._record()[:, 1:].copy().T
        samples.flags.writeable = False
        return samples

    def AddData(self, time: float, sample: Any) -> None:
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

    def ToDataFrame(self) -> Any:
        """The log as a pandas DataFrame, indexed by time [s].

        Raises:
            ImportError: pandas is not installed.
        """
        pandas = _need("pandas", "VectorLog.ToDataFrame()", "pip install 'sheldrake[dataframe]'")
        index = pandas.Index(self.sample_times(), name="time")
        return pandas.DataFrame(self.data().T, columns=self.names(), index=index)

    def ToCsv(self, path: str | os.PathLike) -> None:
        """Writes a CSV file: a line of names, then one line a sample; numbers in full precision."""
        write_csv(path, self.sample_times(), self.data().T, self.names())

    def ToNpz(self, path: str | os.PathLike) -> None:
        """Writes an NPZ file with arrays `time`, `data` (input_size, num_samples), `names` and `units`."""
        names, units = (np.array(words, dtype=str) for words in (self.names(), self.units()))
        np.savez_compressed(path, time=self.sample_times(), data=self.data(), names=names, units=units)

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
        write_mcap(path, {topic: self}, "VectorLog.ToMcap()")


class _ContextLog(VectorLog):
    """The log that an event loop keeps in a context."""

    def __init__(self, store: Any, number: int, size: int, source_names: list[str] | None):
        self._store, self._number, self._size = store, number, size
        self._source_names = source_names

    def _record(self) -> np.ndarray:
        return logs.record(self._store, self._number)

    def _names(self) -> list[str]:
        return self._source_names or super()._names()

    def AddData(self, time: float, sample: Any) -> None:
        sample = np.asarray(sample)
        if sample.shape != (self._size,):
            raise RuntimeError(f"VectorLog.AddData(): a sample has size {self._size}, got shape {sample.shape}.")
        logs.add(self._store, self._number, time, sample)

    def Clear(self) -> None:
        logs.clear(self._store, self._number)

    def Reserve(self, capacity: int, /) -> None:
        logs.reserve(self._store, self._number, int(capacity))


def _need(module: str, call: str, hint: str) -> Any:
    import importlib

    try:
        return importlib.import_module(module)
    except ImportError:
        raise ImportError(f"{call} needs {module.partition('.')[0]}, which is not installed: {hint}") from None
