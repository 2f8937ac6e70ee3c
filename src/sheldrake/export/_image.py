"""One block of memory with all arrays of a diagram, and which of its words are addresses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.common._native.binding import HERE, Words

ALIGNMENT = 64
"""Of each array [bytes]."""


class Fixup(NamedTuple):
    """A word of an image that is an address.

    Attributes:
        at: Which word of the image it is.
        to: What it points to, in bytes from the beginning of the image.
        absolute: Whether it is an address in bytes; else an address by eight.
    """

    at: int
    to: int
    absolute: bool


class Image:
    """Copies of arrays side by side; a view of one that is there has its place within it."""

    def __init__(self) -> None:
        self.parts: list[bytes] = []
        self.size = 0
        self.fixups: list[Fixup] = []
        self._known: list[tuple[int, int, int]] = []  # address, bytes, place
        self._kept: list[np.ndarray] = []  # whose addresses nobody else may get meanwhile

    def add(self, array: np.ndarray, content: np.ndarray | None = None) -> int:
        """Puts an array into the image, or what it is to have in there; its place [bytes]."""
        content = array if content is None else content
        place = self._append(np.ascontiguousarray(content).tobytes())
        self._know(array, place)
        return place

    def _know(self, array: np.ndarray, place: int) -> None:
        self._known.append((HERE.place(array), array.nbytes, place))
        self._kept.append(array)

    def place(self, array: np.ndarray) -> int:
        """Where an array is [bytes]; it is put there if it is not."""
        begin = HERE.place(array)
        for known, size, place in self._known:
            if known <= begin and begin + array.nbytes <= known + size and (array.nbytes or known == begin):
                return place + begin - known
        return self.add(array)

    def add_words(self, words: Words, known_as: np.ndarray | None = None) -> int:
        """Puts arguments into the image, where an array may be known to stand for them; their place [bytes]."""
        place = self._append(words.words.tobytes())
        if known_as is not None:
            self._know(known_as, place)
        for at, array, absolute in words.relocations:
            self.fixups.append(Fixup(place // 8 + at, self.place(array), absolute))
        return place

    def _append(self, data: bytes) -> int:
        place = self.size
        padding = -len(data) % ALIGNMENT
        self.parts += [data, bytes(padding)]
        self.size += len(data) + padding
        return place

    def data(self) -> bytes:
        """The whole, with zeros where addresses belong."""
        return b"".join(self.parts)
