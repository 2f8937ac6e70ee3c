"""Kernels bound to arrays of their own, which stay from call to call."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")
_MOST = 64


class BoundCalls(threading.local, Generic[T]):
    """A bound call and its arrays for each size in each thread.

    Args:
        make: Makes them for given sizes.
    """

    def __init__(self, make: Callable[..., T]):
        self._make = make
        self._known: dict[tuple[int, ...], T] = {}

    def of(self, *sizes: int) -> T:
        """What was made for these sizes."""
        found = self._known.get(sizes)
        if found is None:
            if len(self._known) >= _MOST:
                self._known.clear()
            found = self._known[sizes] = self._make(*sizes)
        return found
