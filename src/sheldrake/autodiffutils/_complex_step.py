"""Dual numbers as complex numbers, one partial derivative at a time, for kernels compiled on complex arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.autodiffutils import AutoDiffXd

STEP = 2.0**-200  # its square is nothing beside 1, and far from where numbers get lost
PATIENCE = 200
"""Calls as Python before machine code is made."""


class Directions:
    """Duals, and the complex numbers that stand for them in one direction.

    Args:
        duals: AutoDiffXd or numbers.
        counter: Changes whenever the duals may have, shape (1,); None: they are read every time.
        numbers: Where the complex numbers go; None: an array of their own.
    """

    def __init__(self, duals: np.ndarray, counter: np.ndarray | None = None, numbers: np.ndarray | None = None):
        self.duals, self.counter = duals, counter
        self.numbers = np.zeros(duals.shape, complex) if numbers is None else numbers
        self.seen: Any = None
        self.n = 0

    def gather(self) -> int:
        """Reads the duals if they may have changed; how many derivatives they have (-1: not all the same number)."""
        if self.counter is not None and self.seen == self.counter[0]:
            return self.n
        self.seen = None if self.counter is None else self.counter[0].copy()
        flat = self.duals.ravel()
        self.numbers.real[...] = np.array([getattr(a, "_v", a) for a in flat], float).reshape(self.duals.shape)
        self.numbers.imag[...] = 0.0
        found = [(i, a._d) for i, a in enumerate(flat) if type(a) is AutoDiffXd and a._d is not None]
        sizes = {len(d) for _, d in found}
        self.n = max(sizes, default=0) if len(sizes) < 2 else -1
        self.places = np.array([i for i, _ in found], np.int64)
        self.slopes = np.array([d for _, d in found]).reshape(len(found), -1) * STEP if self.n > 0 else None
        return self.n

    def moving(self) -> list[int]:
        """Numbers of the derivatives that are not zero everywhere."""
        return [] if self.slopes is None else np.flatnonzero(self.slopes.any(axis=0)).tolist()

    def set(self, k: int) -> None:
        """Makes the imaginary parts those of derivative k."""
        if self.slopes is not None:
            self.numbers.imag.flat[self.places] = self.slopes[:, k]


def duals_of(values: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """Duals of these values, and of these imaginary parts for each derivative, of the shape of the values."""
    new = np.empty(values.size, object)
    for i, (value, slope) in enumerate(zip(values.ravel().tolist(), slopes * (1.0 / STEP))):
        dual = new[i] = object.__new__(AutoDiffXd)
        dual._v, dual._d = value, slope if slope.size else None
    return new.reshape(values.shape)
