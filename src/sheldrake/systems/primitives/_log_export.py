"""Logs as CSV, Parquet and MCAP."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from typing import Any

import numpy as np


def write_csv(path: str | os.PathLike, times: np.ndarray, values: np.ndarray, names: list[str]) -> None:
    """A line of names, then one line a sample; numbers in full precision, nothing where there is none."""
    with open(path, "w", encoding="utf-8", newline="") as file:
        file.write(",".join(quoted(name) for name in ["time", *names]) + "\n")
        for time, row in zip(times.tolist(), values.tolist()):
            file.write(",".join([repr(time), *("" if x != x else repr(x) for x in row)]) + "\n")


def quoted(name: str) -> str:
    """A name as CSV takes it."""
    return '"' + name.replace('"', '""') + '"' if any(c in name for c in ',"\n') else name


def write_parquet(
    path: str | os.PathLike, times: np.ndarray, values: np.ndarray, names: list[str], units: list[str], call: str
) -> None:
    """A column `time` and one for each element, null where there is none; units as metadata of the columns."""
    from sheldrake.systems.primitives._vector_log import _need

    hint = "pip install 'sheldrake[parquet]'"
    arrow = _need("pyarrow", call, hint)
    parquet = _need("pyarrow.parquet", call, hint)
    fields = [arrow.field("time", arrow.float64(), metadata={"unit": "s"})]
    fields += [arrow.field(n, arrow.float64(), metadata={"unit": u}) for n, u in zip(names, units)]
    columns = [arrow.array(times)] + [arrow.array(column, from_pandas=True) for column in values.T]
    parquet.write_table(arrow.Table.from_arrays(columns, schema=arrow.schema(fields)), os.fspath(path))


def write_mcap(path: str | os.PathLike, logs: Mapping[str, Any], call: str) -> None:
    """A topic for each log; messages are JSON objects with a number for each element, NaN and infinity as null."""
    from sheldrake.systems.primitives._vector_log import _need

    writers = _need("mcap.writer", call, "pip install 'sheldrake[mcap]'")
    with open(path, "wb") as file:
        writer = writers.Writer(file)
        writer.start("", "sheldrake")
        queue: list[tuple[int, int, int, int]] = []
        records = []
        for number, (title, log) in enumerate(logs.items()):
            names = log.names()
            schema = {
                "type": "object",
                "properties": {n: {"type": "number", "description": u} for n, u in zip(names, log.units())},
            }
            schema_id = writer.register_schema(title, "jsonschema", json.dumps(schema).encode())
            channel = writer.register_channel("/" + title.lstrip("/"), "json", schema_id)
            times, data = log.sample_times(), log.data().T
            records.append((names, data))
            queue += [(round(t * 1e9), number, row, channel) for row, t in enumerate(times.tolist())]
        for nanoseconds, number, row, channel in sorted(queue):
            names, data = records[number]
            message = {n: x if math.isfinite(x) else None for n, x in zip(names, data[row].tolist())}
            text = json.dumps(message).encode()
            writer.add_message(channel, nanoseconds, text, nanoseconds, row)
        writer.finish()
