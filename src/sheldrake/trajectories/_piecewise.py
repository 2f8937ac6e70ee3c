"""Trajectories made of segments."""

from __future__ import annotations

import bisect
import itertools
from typing import TYPE_CHECKING, Any

from sheldrake.common._checked import checked
from sheldrake.common._scalar_math import all_of
from sheldrake.common._scalars import is_symbolic
from sheldrake.trajectories._base import Trajectory

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar, Scalars

EPSILON_TIME = 2.220446049250313e-16
"""Breaks closer than this [s] are not told apart."""


@checked
class PiecewiseTrajectory(Trajectory):
    """A trajectory made of segments, one from each break in time to the next."""

    def __init__(self, breaks: Scalars = ()):
        self._breaks = self._scalars("", breaks)
        self._check_increasing(self._breaks)

    @classmethod
    def _check_increasing(cls, breaks: list) -> None:
        if is_symbolic(cls._T):
            return
        for a, b in itertools.pairwise(breaks):
            if not b - a >= EPSILON_TIME:  # of nan, too
                raise RuntimeError(f"{cls._name('')}: Times must be in increasing order. {b} follows {a}.")

    def get_number_of_segments(self) -> int:
        """Returns how many segments there are."""
        return max(len(self._breaks) - 1, 0)

    def get_segment_times(self) -> list:
        """Returns the breaks [s]: one more than there are segments."""
        return list(self._breaks)

    def start_time(self, segment_index: int | None = None) -> float:
        """Returns the first time [s], of the trajectory or of one segment."""
        if segment_index is None:
            return self.do_start_time()
        return self._breaks[self._segment(segment_index)]

    def end_time(self, segment_index: int | None = None) -> float:
        """Returns the last time [s], of the trajectory or of one segment."""
        if segment_index is None:
            return self.do_end_time()
        return self._breaks[self._segment(segment_index) + 1]

    def duration(self, segment_index: int) -> float:
        """Returns how long a segment lasts [s]."""
        i = self._segment(segment_index)
        return self._breaks[i + 1] - self._breaks[i]

    def get_segment_index(self, t: Scalar) -> int:
        """Returns the segment at time t [s]; the first or the last for a time outside."""
        time = self._scalar("get_segment_index", t)
        if len(self._breaks) < 2:
            return -1 if not self._breaks else 0
        if is_symbolic(self._T) and len(self._breaks) > 2:
            time = time.Evaluate()
        return self._index(time)

    def _index(self, time: Scalar) -> int:
        n = len(self._breaks) - 1
        if n == 1:
            return 0
        if self._T is float:
            return bisect.bisect_right(self._breaks, time, 1, n) - 1
        breaks = [b.Evaluate() for b in self._breaks] if is_symbolic(self._T) else self._breaks
        return min(max(bisect.bisect_right(breaks, time) - 1, 0), n - 1)

    def is_time_in_range(self, t: Scalar) -> bool:
        """Tells whether t [s] is between the first and the last break."""
        if type(t) is float and self._T is float and len(self._breaks) > 1:
            return bool(self._breaks[0] <= t <= self._breaks[-1])
        time = self._scalar("is_time_in_range", t)
        inside = all_of([time >= self.start_time(), time <= self.end_time()])
        return inside if is_symbolic(self._T) else bool(inside)

    def do_start_time(self) -> float:
        """The first break."""
        return self._breaks[self._segment(0)]

    def do_end_time(self) -> float:
        """The last break."""
        return self._breaks[self._segment(self.get_number_of_segments() - 1) + 1]

    def _segment(self, index: int) -> int:
        n, index = self.get_number_of_segments(), self._whole("", index)
        if not 0 <= index < n:
            raise RuntimeError(f"{self._name('')}: Segment number {index} out of range [0, {n}).")
        return index

    def _clamped(self, time: Scalar) -> Scalar:
        """The nearest time inside."""
        start: Any = self._breaks[0]
        end: Any = self._breaks[-1]
        if self._T is not float and is_symbolic(self._T):
            return end.min(start.max(time))
        if time < start:
            return start
        return end if time > end else time
