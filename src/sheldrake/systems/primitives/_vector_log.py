"""Logs of vectors: times, values, names, and export to tables."""

from __future__ import annotations

import os
from typing import Any

import numpy as np


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
        return self._record()[:, 1:].copy().T

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
        with open(path, "w", encoding="utf-8", newline="") as file:
            file.write(",".join(_quoted(name) for name in ["time", *self.names()]) + "\n")
            for row in self._record().tolist():
                file.write(",".join(map(repr, row)) + "\n")

    def ToNpz(self, path: str | os.PathLike) -> None:
        """Writes an NPZ file with arrays `time`, `data` (input_size, num_samples) and `names`."""
        np.savez_compressed(path, time=self.sample_times(), data=self.data(), names=np.array(self.names(), dtype=str))

    def ToParquet(self, path: str | os.PathLike) -> None:
        """Writes a Parquet file with a column `time` and one for each element.

        Raises:
            ImportError: pyarrow is not installed.
        """
        hint = "pip install 'sheldrake[parquet]'"
        arrow = _need("pyarrow", "VectorLog.ToParquet()", hint)
        parquet = _need("pyarrow.parquet", "VectorLog.ToParquet()", hint)
        columns = {"time": self.sample_times(), **dict(zip(self.names(), self.data()))}
        parquet.write_table(arrow.table(columns), os.fspath(path))


class _ContextLog(VectorLog):
    """The log that an event loop keeps in a context."""

    def __init__(self, store: Any, number: int, size: int, source_names: list[str] | None):
        self._store, self._number, self._size = store, number, size
        self._source_names = source_names

    def _record(self) -> np.ndarray:
        return self._store.log_record(self._number)

    def _names(self) -> list[str]:
        return self._source_names or super()._names()

    def AddData(self, time: float, sample: Any) -> None:
        sample = np.asarray(sample)
        if sample.shape != (self._size,):
            raise RuntimeError(f"VectorLog.AddData(): a sample has size {self._size}, got shape {sample.shape}.")
        self._store.add_to_log(self._number, time, sample)

    def Clear(self) -> None:
        self._store.clear_log(self._number)

    def Reserve(self, capacity: int, /) -> None:
        self._store.reserve_log(self._number, int(capacity))


def _need(module: str, call: str, hint: str) -> Any:
    import importlib

    try:
        return importlib.import_module(module)
    except ImportError:
        raise ImportError(f"{call} needs {module.partition('.')[0]}, which is not installed: {hint}") from None


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"' if any(c in name for c in ',"\n') else name
