"""How many threads a computation may use."""

from __future__ import annotations

import os

import numpy as np

from sheldrake.common._overloads import incompatible


class Parallelism:
    """A number of threads, at least one."""

    def __init__(self, *args: object, **kwargs: object):
        """
        `Parallelism()` is one thread, `Parallelism(True)` as many as the machine offers, `Parallelism(n)` n threads.

        Raises:
            RuntimeError: the number is less than one.
        """
        values = [*args, *kwargs.values()]
        value = values[0] if values else 1
        if (
            len(values) > 1
            or not kwargs.keys() <= {"parallelize", "num_threads"}
            or (not hasattr(value, "__index__") and not isinstance(value, np.bool_))
        ):
            raise incompatible(
                "Parallelism", ["()", "(parallelize: bool)", "(num_threads: int)"], args, kwargs, constructor=True
            )
        if isinstance(value, bool | np.bool_):
            value = _machine() if value else 1
        self._num_threads = int(value)  # type: ignore[call-overload]
        if self._num_threads < 1:
            raise RuntimeError(f"Parallelism(): num_threads is {self._num_threads}; it must be at least 1.")

    @staticmethod
    def Max() -> Parallelism:
        """As many threads as the machine offers, or as $DRAKE_NUM_THREADS or $OMP_NUM_THREADS say."""
        return Parallelism(True)

    def num_threads(self) -> int:
        """How many threads."""
        return self._num_threads

    def __copy__(self) -> Parallelism:
        return Parallelism(self._num_threads)

    def __deepcopy__(self, memo: dict) -> Parallelism:
        return Parallelism(self._num_threads)

    def __repr__(self) -> str:
        return f"Parallelism(num_threads={self._num_threads})"


def _machine() -> int:
    try:
        available = len(os.sched_getaffinity(0))
    except AttributeError:
        available = os.cpu_count() or 1
    for name in ("DRAKE_NUM_THREADS", "OMP_NUM_THREADS"):
        text = os.environ.get(name, "")
        if text.isdigit() and int(text) > 0:
            return min(int(text), available)
    return available
