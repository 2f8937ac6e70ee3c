"""Logs read back from files."""

from __future__ import annotations

import csv
import os
from typing import Any

import numpy as np

from sheldrake.systems.primitives._log_set import LogSet, TableLog
from sheldrake.systems.primitives._log_stream import MAGIC, read_stream


def ReadLogs(path: Any) -> LogSet:
    """The logs in a file: what StreamLogs() wrote, or ToNpz(), ToCsv(), ToParquet().

    Raises:
        FileNotFoundError: There is no such file.
        ValueError: It holds no log.
        ImportError: It is a Parquet file, and pyarrow is not installed.
    """
    name = os.fspath(path)
    with open(name, "rb") as file:
        start = file.read(len(MAGIC))
    if start == MAGIC:
        return read_stream(name)
    if start.startswith(b"PK"):
        return _read_npz(name)
    if start.startswith(b"PAR1"):
        return _read_parquet(name)
    return _read_csv(name)


def _title(name: str) -> str:
    return os.path.splitext(os.path.basename(name))[0]


def _read_npz(name: str) -> LogSet:
    try:
        with np.load(name, allow_pickle=False) as arrays:
            held = {key: arrays[key] for key in arrays.files}
    except (ValueError, OSError, KeyError) as error:
        raise ValueError(f"'{name}' can not be read: {error}") from None
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
