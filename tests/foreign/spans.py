"""One native span as a file that a process of another platform can run: see span_driver.c."""

from __future__ import annotations

import numpy as np

from sheldrake.common._native import build
from sheldrake.common._native.words import pack
from sheldrake.systems.analysis._span import Span
from sheldrake.systems.framework._kernels import loop


class Case:
    """What a span's memory is before it runs, and where addresses stand in it."""

    def __init__(self, span: Span, T: float, level: int):
        store = span.store
        arguments = (span.program, span.N, span.Z, store.S, store.I, store.L, span.table, float(T))
        words, _ = pack(loop.advance, arguments)
        models = [a for row in store.layout.rows if row.native for a in arrays_of(row.models)]
        self.live = unique([words, *arrays_of(arguments), *models])
        """The arrays themselves, which a run in this process changes."""
        self.blobs = [as_words(a).copy() for a in self.live]
        self.watched = {"S": self._number(store.S), "L": self._number(store.L)}
        self.entry = f"k_{loop.advance.__name__}_{level}"
        self.addresses = [
            (b, int(w), target, shift)
            for b in (0, self._number(span.program.words))
            for target, a in enumerate(self.live)
            for shift in (0, 3)
            for w in np.flatnonzero(self.blobs[b] == address(a) >> shift)
        ]
        symbols = {id(kernel): symbol for symbol, kernel in build.entries().items()}
        self.functions = [
            (self._number(span.table), r, f"{symbols[id(row.calc)]}_{level}")
            for r, row in enumerate(store.layout.rows)
            if row.native
        ]

    def _number(self, array: np.ndarray) -> int:
        (number,) = (i for i, a in enumerate(self.live) if a is array)
        return number

    def write(self, path) -> None:
        """Writes the file."""
        with open(path, "wb") as file:

            def put(*numbers: int) -> None:
                file.write(np.array(numbers, np.int64).tobytes())

            put(len(self.blobs))
            for blob in self.blobs:
                put(len(blob))
                file.write(blob.tobytes())
            put(len(self.addresses), *np.ravel(self.addresses))
            put(len(self.functions))
            for blob, word, name in self.functions:
                put(blob, word)
                file.write(name.encode().ljust(128, b"\0"))
            file.write(self.entry.encode().ljust(128, b"\0"))
            put(0)

    def read(self, path) -> tuple[int, dict[str, np.ndarray]]:
        """Reads a result: the status, and the watched arrays afterwards."""
        data = np.fromfile(path, np.int64)
        ends = np.cumsum([1, *map(len, self.blobs)])
        assert data.size == ends[-1]
        parts = np.split(data, ends[:-1])[1:]
        return int(data[0]), {name: parts[i].view(float) for name, i in self.watched.items()}


def arrays_of(values) -> list[np.ndarray]:
    """All arrays in nested tuples and dictionaries."""
    if isinstance(values, np.ndarray):
        return [values]
    if isinstance(values, dict):
        values = tuple(values.values())
    return [a for v in values for a in arrays_of(v)] if isinstance(values, tuple) else []


def as_words(array: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(array).reshape(-1).view(np.int64)


def address(array: np.ndarray) -> int:
    return array.__array_interface__["data"][0]


def unique(arrays: list[np.ndarray]) -> list[np.ndarray]:
    """One array per address that holds something."""
    found: dict[int, np.ndarray] = {}
    for a in arrays:
        if a.size and (address(a) not in found or found[address(a)].size < a.size):
            found[address(a)] = a
    return list(found.values())
