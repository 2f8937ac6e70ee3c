"""Random numbers of many environments, drawn at once, each from a stream of its own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

_STEP = np.uint64(0x9E3779B97F4A7C15)


class Streams:
    """A stream of random numbers for each environment, which depends on its own seed alone.

    Numbers are SplitMix64's (Steele, Lea, Flood: Fast splittable pseudorandom number generators, OOPSLA 2014).

    Args:
        seeds: One for each environment.
    """

    def __init__(self, seeds: Sequence[int]):
        # Streams of neighbouring seeds begin far apart: where the seed, mixed, says.
        self._state = _mix((np.asarray(seeds, np.uint64) + np.uint64(1)) * _STEP)

    def seed(self, who: np.ndarray, seeds: Sequence[int]) -> None:
        """Begins these streams anew."""
        self._state[who] = Streams(seeds)._state

    def uniform(self, who: np.ndarray, low: float, high: float, size: int) -> np.ndarray:
        """The next numbers in [low, high) of these environments, shape (len(who), size)."""
        counts = np.arange(1, size + 1, dtype=np.uint64)
        bits = _mix(self._state[who][:, None] + counts * _STEP)
        self._state[who] += counts[-1:] * _STEP
        return low + (high - low) * ((bits >> np.uint64(11)) * 2.0**-53)


def _mix(z: np.ndarray) -> np.ndarray:
    """SplitMix64's finalizer; products wrap around."""
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))
