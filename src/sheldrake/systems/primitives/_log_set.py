"""Several logs together: named by the ports they come from, exported as one table."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.systems.primitives._vector_log import (
    VectorLog,
    _need,
    log_channel,
    write_csv,
    write_mcap,
    write_npz,
    write_parquet,
)

if TYPE_CHECKING:
    import numpy as np
    import pandas
    import xarray
    from numpy.typing import ArrayLike


class TableLog(VectorLog):
    """A log that holds times and samples it was given, as one read from a file does."""

    def __init__(
        self, times: ArrayLike, data: ArrayLike, names: Sequence[str] | None = None, units: Sequence[str] | None = None
    ):
        times, data = np.asarray(times, dtype=float), np.asarray(data, dtype=float)
        if times.ndim != 1 or data.ndim != 2 or data.shape[1] != len(times):
            raise ValueError(f"times of shape {times.shape} and data of shape {data.shape} are no log")
        for what, texts in (("names", names), ("units", units)):
            if texts is not None and len(texts) != len(data):
                raise ValueError(f"there are {len(texts)} {what} for {len(data)} elements")
        super().__init__(len(data))
        self._own = np.column_stack([times, data.T])
        self._count = len(self._own)
        self._given = None if names is None else [str(name) for name in names]
        self._given_units = None if units is None else [str(unit) for unit in units]

    def _names(self) -> list[str]:
        return super()._names() if self._given is None else self._given

    def units(self) -> list[str]:
        """Units of the elements, "" where they are not known."""
        return super().units() if self._given_units is None else self._given_units


class LogSet(Mapping):
    """Logs by title, in order; a mapping of str to VectorLog.

    Args:
        logs: The logs.
        is_complete: Whether the run that wrote them came to its end; None when that is not known.
    """

    def __init__(self, logs: Mapping[str, VectorLog], is_complete: bool | None = None):
        self._logs = dict(logs)
        self.is_complete = is_complete

    def __getitem__(self, title: str) -> VectorLog:
        try:
            return self._logs[title]
        except KeyError:
            raise KeyError(f"There is no log '{title}'; there are {', '.join(self._logs)}.") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._logs)

    def __len__(self) -> int:
        return len(self._logs)

    def __repr__(self) -> str:
        return f"LogSet({', '.join(f'{title} ({log.num_samples()})' for title, log in self._logs.items())})"

    def columns(self) -> list[str]:
        """Names of all elements: title and element, such as `plant/state: block_body_qw`."""
        return [column_name(title, name, log) for title, log in self._logs.items() for name in log.names()]

    def units(self) -> list[str]:
        """Units of all elements, "" where they are not known."""
        return [unit for log in self._logs.values() for unit in log.units()]

    def table(self) -> tuple[np.ndarray, np.ndarray]:
        """All logs on one axis of time: times [s], shape (n,), and values, shape (n, number of columns).

        A log without a sample at a time has NaN there; of several samples at one time the last counts, unless all logs
        have the same times, which then stay as they are.
        """
        logs = list(self._logs.values())
        if not logs:
            return np.zeros(0), np.zeros((0, 0))
        times = [log.sample_times() for log in logs]
        if all(np.array_equal(t, times[0]) for t in times):
            return times[0], np.column_stack([log.data().T for log in logs])
        axis = np.unique(np.concatenate(times))
        parts = []
        for t, log in zip(times, logs):
            part = np.full((len(axis), log.get_input_size()), np.nan)
            part[np.searchsorted(axis, t)] = log.data().T
            parts.append(part)
        return axis, np.column_stack(parts)

    def ToDataFrame(self) -> pandas.DataFrame:
        """All logs as one pandas DataFrame, indexed by time [s]; units are in `attrs["units"]`, by column.

        Raises:
            ImportError: pandas is not installed.
        """
        pandas = _need("pandas", "LogSet.ToDataFrame()", "pip install 'sheldrake[dataframe]'")
        times, values = self.table()
        frame = pandas.DataFrame(values, columns=self.columns(), index=pandas.Index(times, name="time"))
        frame.attrs["units"] = dict(zip(self.columns(), self.units()))
        return frame

    def ToXarray(self) -> xarray.Dataset:
        """All logs as one xarray Dataset: a variable for each, on times and elements of its own.

        The log k has the dimensions `time_k` [s] and `element_k`, with names and units; logs with the same times share
        theirs.

        Raises:
            ImportError: xarray is not installed.
        """
        xarray = _need("xarray", "LogSet.ToXarray()", "pip install 'sheldrake[xarray]'")
        variables, axes = {}, list[tuple[int, np.ndarray]]()
        for k, (title, log) in enumerate(self._logs.items()):
            times = log.sample_times()
            j = next((j for j, other in axes if np.array_equal(other, times)), k)
            axes.append((j, times))
            names = {"time": f"time_{j}", "element": f"element_{k}", "unit": f"unit_{k}"}
            variables[title] = log.ToXarray().rename(names)
        return xarray.Dataset(variables)

    def ToCsv(self, path: str | os.PathLike) -> None:
        """Writes one CSV file with a column for each element, empty where a log has no sample."""
        times, values = self.table()
        write_csv(path, times, values, self.columns())

    def ToNpz(self, path: str | os.PathLike) -> None:
        """Writes an NPZ file: `titles`, and for log k `time_k`, `data_k` (size, samples), `names_k`, `units_k`."""
        arrays: dict[str, Any] = {"titles": np.array(list(self._logs), dtype=str)}
        for k, log in enumerate(self._logs.values()):
            arrays[f"time_{k}"], arrays[f"data_{k}"] = log.sample_times(), log.data()
            arrays[f"names_{k}"] = np.array(log.names(), dtype=str)
            arrays[f"units_{k}"] = np.array(log.units(), dtype=str)
        write_npz(path, **arrays)

    def ToParquet(self, path: str | os.PathLike) -> None:
        """Writes a Parquet file with a column `time` and one for each element; units are in the columns' metadata.

        Raises:
            ImportError: pyarrow is not installed.
        """
        times, values = self.table()
        write_parquet(path, times, values, self.columns(), self.units(), "LogSet.ToParquet()")

    def ToMcap(self, path: str | os.PathLike) -> None:
        """Writes an MCAP file with a topic for each log, messages as JSON with a schema.

        Raises:
            ImportError: mcap is not installed.
        """
        write_mcap(path, [log_channel(title, log) for title, log in self._logs.items()], "LogSet.ToMcap()")


def column_name(title: str, name: str, log: VectorLog) -> str:
    """Name of an element among those of all logs."""
    return title if log.get_input_size() == 1 and name in ("y0", title) else f"{title}: {name}"
