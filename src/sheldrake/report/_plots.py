"""Logs as the plots that the script of a report draws."""

from __future__ import annotations

import base64
import heapq
import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

_MOST_POINTS, _FEWEST_POINTS = 2000, 200  # of a line that is thinned
_POINTS = 100_000  # of all lines together, about: 1 MB of a page
_EXACT = 1e-5  # of the height of a line: points that tell less are left out
_MOST_LINES = 40  # of a plot


def packed(values: ArrayLike) -> str:
    """Numbers in single precision, as the script unpacks them."""
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode("ascii")


@dataclass
class Panel:
    """Lines of one quantity.

    Attributes:
        title: What they are of.
        unit: Of all of them, "" where it is not known.
        times: [s], shape (n,).
        labels: One a line.
        lines: Values, each of shape (n,).
    """

    title: str
    unit: str
    times: np.ndarray
    labels: list[str]
    lines: list[np.ndarray]


def panels_of(logs: Any) -> Iterator[Panel]:
    """The lines of logs, those of one kind and unit together, orientations as roll, pitch and yaw.

    Of logs that say the same (a script's own and that of LogAll(), say) the first is taken.
    """
    from sheldrake.systems.primitives._vector_log import quantity, short_labels
    from sheldrake.visualization._roll_pitch_yaw import with_roll_pitch_yaw

    seen: list[Any] = []
    for log_title, log in logs.items():
        if not log.num_samples() or any(_say_the_same(log, other) for other in seen):
            continue
        seen.append(log)
        names = log.names()
        if log.get_input_size() == 1 and names == ["y0"]:
            names = [log_title.rpartition("/")[2]]
        names, rows = with_roll_pitch_yaw(names, log.data())
        times = log.sample_times()
        kinds: dict[tuple[str, str], list[tuple[str, np.ndarray]]] = {}
        for name, row in zip(names, rows):
            kind, unit, label = quantity(name)
            if unit == "rad" and "roll" in kind:
                unit, row = "deg", np.degrees(row)
            kinds.setdefault((kind, unit), []).append((label, row))
        for (kind, unit), lines in kinds.items():
            start, labels = short_labels([label for label, _ in lines])
            title = f"{log_title}: {kind}" if kind not in ("", "value") else log_title
            title += f" of {start}" if start else ""
            yield Panel(title, unit, times, labels, [row for _, row in lines])


def plots_of(logs: Any) -> list[dict[str, Any]]:
    """Plots as the script draws them: title, unit, lines with label, times and values."""
    most = _POINTS // max(1, sum(log.get_input_size() for log in logs.values()))
    most = min(max(most, _FEWEST_POINTS), _MOST_POINTS)
    return [_plot(panel, most) for panel in panels_of(logs)]


def _say_the_same(one: Any, other: Any) -> bool:
    return np.array_equal(one.sample_times(), other.sample_times()) and np.array_equal(one.data(), other.data())


def _plot(panel: Panel, most: int) -> dict[str, Any]:
    count = len(panel.lines)
    title = panel.title + (f" (first {_MOST_LINES} of {count})" if count > _MOST_LINES else "")
    drawn = []
    for label, row in zip(panel.labels[:_MOST_LINES], panel.lines):
        t, y = thinned(panel.times, row, most)
        drawn.append({"label": label, "t": packed(t), "y": packed(y)})
    return {"title": title, "unit": panel.unit, "lines": drawn}


def thinned(times: np.ndarray, values: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """A line with fewer points that looks the same, also to who looks closely at where much happens.

    The point that is farthest from the line so far is added, again and again (Ramer 1972, Douglas and Peucker 1973,
    but the worst stretch first), until none is off by more than a hundred-thousandth of the height.
    """
    n = len(times)
    if n <= most:
        return times, values
    known = np.isfinite(values)
    y = np.where(known, values, 0.0)
    edges = np.flatnonzero(np.diff(known)) if not known.all() else np.array([], dtype=int)
    kept = sorted({0, n - 1, *edges.tolist(), *(edges + 1).tolist(), int(np.argmin(y)), int(np.argmax(y))})
    enough = _EXACT * float(np.ptp(y))
    stretches = [_farthest(times, y, a, b) for a, b in itertools.pairwise(kept)]
    heapq.heapify(stretches)
    while len(kept) < most and stretches and -stretches[0][0] > enough:
        _, a, middle, b = heapq.heappop(stretches)
        kept.append(middle)
        heapq.heappush(stretches, _farthest(times, y, a, middle))
        heapq.heappush(stretches, _farthest(times, y, middle, b))
    kept.sort()
    return times[kept], values[kept]


def _farthest(t: np.ndarray, y: np.ndarray, a: int, b: int) -> tuple[float, int, int, int]:
    """Minus how far the point between two is off the line through them that is farthest off; and all three."""
    if b - a < 2:
        return 0.0, a, a, b
    slope = (y[b] - y[a]) / (t[b] - t[a]) if t[b] > t[a] else 0.0
    off = np.abs(y[a + 1 : b] - y[a] - slope * (t[a + 1 : b] - t[a]))
    middle = int(np.argmax(off))
    return -float(off[middle]), a, a + 1 + middle, b
