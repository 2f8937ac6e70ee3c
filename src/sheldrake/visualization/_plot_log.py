"""Plots of logs, one panel a kind of quantity, with names and units."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

# Endings of state names, the title of their panel, its unit, and the line's label after what stands before the ending.
_ENDINGS = [
    (r"_(q[wxyz])$", "orientation (quaternion)", "1", r"\1"),
    (r"_w([xyz])$", "angular velocity", "rad/s", r"w\1"),
    (r"_v([xyz])$", "velocity", "m/s", r"v\1"),
    (r"_([xyz])$", "position", "m", r"\1"),
    (r"_q$", "joint position", "rad or m", ""),
    (r"_w$", "joint angular velocity", "rad/s", ""),
    (r"_v$", "joint velocity", "m/s", ""),
]


def _kind(name: str) -> tuple[str, str, str]:
    """Returns the panel's title, the unit and the line's label of a named quantity."""
    stated = re.fullmatch(r"(.*?)\s*[\[(]([^\])]*)[\])]", name)
    plain, unit = (stated[1], stated[2]) if stated else (name, "")
    for ending, title, usual, label in _ENDINGS:
        found = re.search(ending, plain)
        if found:
            stem = plain[: found.start()]
            part = found.expand(label)
            return title, unit or usual, f"{stem} {part}".strip() if part else stem
    return ("", unit, plain) if unit else ("value", "", plain)


def PlotLog(log: Any, context: Any = None, *, state_names: list[str] | None = None, title: str | None = None) -> Any:
    """Plots a log over time, one panel for each kind of quantity, and returns the matplotlib Figure.

    Works without a display; `matplotlib.pyplot.show()` shows it where there is one.

    Args:
        log: A VectorLog, or a VectorLogSink together with a context.
        context: The root context, where `log` is a VectorLogSink.
        state_names: Names of the elements, in place of those the log knows.
        title: Title of the figure.

    Raises:
        TypeError: when `log` is neither.
        ValueError: when the number of names is not the number of elements.
    """
    if hasattr(log, "FindLog"):
        if context is None:
            raise TypeError("PlotLog(): a VectorLogSink needs the context, too: PlotLog(sink, context).")
        title = title if title is not None else log.get_name()
        log = log.FindLog(context)
    if not hasattr(log, "sample_times"):
        raise TypeError(f"PlotLog(): expected a VectorLog or a VectorLogSink, got {type(log).__name__}.")
    times, data = np.asarray(log.sample_times()), np.asarray(log.data())
    names = list(state_names) if state_names is not None else _names_of(log, len(data))
    if len(names) != len(data):
        raise ValueError(f"PlotLog(): the log has {len(data)} elements, but {len(names)} names were given.")
    return _plot(times, data, names, title)


def _names_of(log: Any, size: int) -> list[str]:
    return list(log.names()) if hasattr(log, "names") else [f"y{i}" for i in range(size)]


def _plot(times: np.ndarray, data: np.ndarray, names: list[str], title: str | None) -> Any:
    import matplotlib.pyplot as plt

    panels: dict[tuple[str, str], list[tuple[str, np.ndarray]]] = {}
    for name, row in zip(names, data):
        kind, unit, label = _kind(name)
        panels.setdefault((kind, unit), []).append((label, row))
    _drop_common_stem(panels)
    count = max(1, len(panels))
    size = (9, 1.2 + 2.1 * count)
    figure, axes = plt.subplots(count, 1, sharex=True, squeeze=False, figsize=size, layout="constrained")
    for ax, ((kind, unit), lines) in zip(axes[:, 0], panels.items()):
        for label, row in lines:
            ax.plot(times, row, label=label, linewidth=1.3)
        text = f"{kind} [{unit}]" if unit else kind
        ax.set_ylabel(text.strip(), fontsize=9)
        ax.grid(alpha=0.3)
        ax.margins(x=0.01)
        if len(lines) <= 20:
            ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, frameon=False)
    axes[-1, 0].set_xlabel("time [s]")
    if title:
        figure.suptitle(title)
    return figure


def _drop_common_stem(panels: dict[tuple[str, str], list[tuple[str, np.ndarray]]]) -> None:
    """Shortens labels "block_body x" to "x" where all of them start with the same words."""
    stems = {label.rpartition(" ")[0] for lines in panels.values() for label, _ in lines}
    if len(stems) == 1 and stems != {""}:
        for key, lines in panels.items():
            panels[key] = [(label.rpartition(" ")[2], row) for label, row in lines]
