"""One native span as a file that a process of another platform can run: see span_driver.c."""

from __future__ import annotations

import numpy as np

from sheldrake.common._native import build
from sheldrake.common._native.binding import HERE, arguments
from sheldrake.systems.analysis._span import Span
from sheldrake.systems.framework._kernels import loop


class Case:
    """What a span's memory is before it runs, and where addresses stand in it."""

    def __init__(self, span: Span, T: float, level: int):
        store = span.store
        given, _ = arguments(loop.advance, (*span._tables(), span.table, float(T)))
        parts = [given.words, *(r.array for words in (given, store.layout.arguments) for r in words.relocations)]
        self.live = list({HERE.place(a): a for a in parts if a.size}.values())
        """The arrays themselves, which a run in this process changes."""
        self.blobs = [as_words(a).copy() for a in self.live]
        self.watched = {"S": self._number(store.S), "L": self._number(store.L)}
        self.entry = f"k_{loop.advance.__name__}_{level}"
        self.addresses = [
            (self._number(blob), at, self._number(array), 0 if absolute else 3)
            for blob, words in ((given.words, given), (span.program.words, store.layout.arguments))
            for at, array, absolute in words.relocations
            if array.size
        ]
        symbols = {id(kernel): symbol for symbol, kernel in build.entries().items()}
        self.functions = [
            (self._number(span.table), r, f"{symbols[id(row.calc)]}_{level}")
            for r, row in enumerate(store.layout.rows)
            if row.native
        ]

    def _number(self, array: np.ndarray) -> int:
        (number,) = (i for i, a in enumerate(self.live) if HERE.place(a) == HERE.place(array))
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


def as_words(array: np.ndarray) -> np.ndarray:
    return array.reshape(-1).view(np.int64)
