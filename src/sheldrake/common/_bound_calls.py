"""Kernels bound to arrays of their own, which stay from call to call."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")
_MOST = 64


LARGEST = 8192


def room(size: int) -> int:
    """The power of two from 8 on that holds so many: the size of arrays that serve for many sizes.

    More than `LARGEST` get arrays of their own size: to make these takes little of the time that they are worked on.
    """
    return size if size > LARGEST else max(8, 1 << (size - 1).bit_length())


class BoundCalls(threading.local, Generic[T]):
    """A bound call and its arrays for each size in each thread.

    Args:
        make: Makes them for given sizes.
        largest: Of greater sizes nothing is kept.
    """

    def __init__(self, make: Callable[..., T], largest: float = math.inf):
        self._make, self._largest = make, largest
        self._known: dict[tuple[int, ...], T] = {}

    def of(self, *sizes: int) -> T:
        """What was made for these sizes."""
        found = self._known.get(sizes)
        if found is None:
            if max(sizes) > self._largest:
                return self._make(*sizes)
            if len(self._known) >= _MOST:
                self._known.clear()
            found = self._known[sizes] = self._make(*sizes)
        return found
