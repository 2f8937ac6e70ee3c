"""Plots of logs, one panel a kind of quantity, with names and units."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.systems.primitives._log_set import LogSet, column_name
from sheldrake.systems.primitives._vector_log import quantity, short_labels
from sheldrake.visualization._roll_pitch_yaw import with_roll_pitch_yaw

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sheldrake.systems.primitives._vector_log import VectorLog
    from sheldrake.systems.primitives._vector_log_sink import VectorLogSink

_STILL = 1e-3  # of the height of a panel: what changes less is at rest
_EARLY = 0.4  # of a run: what has ended by then is shown larger, with the rest in a strip
_ROOM = 1.5  # how much longer than the motion its panel is
_STRIP = 0.12  # of the width, for the rest


def PlotLog(
    log: Any,
    context: Any = None,
    *,
    state_names: list[str] | None = None,
    title: str | None = None,
    rpy: bool = False,
    degrees: bool = False,
) -> Any:
    """Plots a log over time, one panel for each kind of quantity, and returns the matplotlib Figure.

    A run that comes to rest early is shown in two parts: its motion, and the rest in a strip beside it. Works without a
    display; `matplotlib.pyplot.show()` shows it where there is one, and a notebook shows it once.

    Args:
        log: A VectorLog, a LogSet (each log has panels of its own), or a VectorLogSink or what LogAll() returned
            together with a context.
        context: The root context, where `log` is a VectorLogSink.
        state_names: Names of the elements, in place of those the log knows.
        title: Title of the figure.
        rpy: Show quaternions (names ending in `_qw`, `_qx`, `_qy`, `_qz`) as roll, pitch and yaw, without jumps.
        degrees: Show angles in degrees.

    Raises:
        TypeError: when `log` is none of these.
        ValueError: when the number of names is not the number of elements.
    """
    if hasattr(log, "FindLogs") or hasattr(log, "FindLog"):
        if context is None:
            raise TypeError(f"PlotLog(): a {type(log).__name__} needs the context, too: PlotLog(log, context).")
        if hasattr(log, "FindLogs"):
            log = log.FindLogs(context)
        else:
            title = title if title is not None else log.get_name()
            log = log.FindLog(context)
    if isinstance(log, LogSet):
        return _plot(_panels_of_set(log, rpy, degrees), title)
    if not hasattr(log, "sample_times"):
        raise TypeError(f"PlotLog(): expected a VectorLog, a LogSet or a VectorLogSink, got {type(log).__name__}.")
    times, data = np.asarray(log.sample_times()), np.asarray(log.data())
    names = list(state_names) if state_names is not None else _names_of(log, len(data))
    if len(names) != len(data):
        raise ValueError(f"PlotLog(): the log has {len(data)} elements, but {len(names)} names were given.")
    panels = _panels(times, data, names, rpy, degrees)
    _shorten_labels(panels)
    return _plot(panels, title)


def _panels_of_set(logs: LogSet, rpy: bool, degrees: bool) -> dict:
    """Panels of several logs: each named by its log, but for one of states, whose names say enough."""
    panels: dict = {}
    for title, log in logs.items():
        names = list(log.names())
        if log.get_input_size() == 1 and names == ["y0"]:
            names = [column_name(title, "y0", log)]
        found = _panels(log.sample_times(), log.data(), names, rpy, degrees)
        _shorten_labels(found)
        for (kind, unit), lines in found.items():
            panels[title if kind in ("", "value") else f"{title}: {kind}", unit] = lines
    return panels


def _names_of(log: VectorLogSink | VectorLog, size: int) -> list[str]:
    return list(log.names()) if hasattr(log, "names") else [f"y{i}" for i in range(size)]


def _panels(times: np.ndarray, data: np.ndarray, names: list[str], rpy: bool, degrees: bool) -> dict:
    """For each kind and unit, the lines: label, times and values."""
    if rpy:
        names, data = with_roll_pitch_yaw(names, data)
    panels: dict[tuple[str, str], list[tuple[str, np.ndarray, np.ndarray]]] = {}
    for name, row in zip(names, data):
        kind, unit, label = quantity(name)
        if degrees and unit in ("rad", "rad/s"):
            unit, row = unit.replace("rad", "deg"), np.degrees(row)
        panels.setdefault((kind, unit), []).append((label, times, row))
    return panels


def _plot(panels: dict, title: str | None) -> Figure:
    import matplotlib.pyplot as plt

    from sheldrake.visualization._notebook_figure import NotebookFigure

    count, split = max(1, len(panels)), _end_of_motion(panels)
    size = (9, 1.2 + 2.1 * count)
    figure = plt.figure(FigureClass=NotebookFigure, figsize=size, layout="constrained")
    columns = 1 if split is None else 2
    widths = [1.0] if split is None else [1.0 - _STRIP, _STRIP]
    axes = figure.subplots(count, columns, sharex="col", sharey="row", squeeze=False, width_ratios=widths)
    for row, ((kind, unit), lines) in zip(axes, panels.items()):
        for ax in row:
            for label, times, values in lines:
                ax.plot(times, values, label=label, linewidth=1.3)
            ax.grid(alpha=0.3)
            ax.margins(x=0.01)
        text = f"{kind} [{unit}]" if unit else kind
        row[0].set_ylabel(text.strip(), fontsize=9)
        if len(lines) <= 20:
            row[-1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8, frameon=False)
    axes[-1, 0].set_xlabel("time [s]")
    if split is not None:
        spans = [times[[0, -1]] for lines in panels.values() for _, times, _ in lines]
        _join(axes, np.min(spans), split, np.max(spans))
    if title:
        figure.suptitle(title)
    return figure


def _end_of_motion(panels: dict) -> float | None:
    """The time [s] where the motion of a run that comes to rest early has ended, with room behind it; else None."""
    drawn = [[(times, values) for _, times, values in lines if len(times)] for lines in panels.values()]
    spans = [(times[0], times[-1]) for lines in drawn for times, _ in lines]
    if not spans:
        return None
    first, last = min(start for start, _ in spans), max(stop for _, stop in spans)
    end = first
    for lines in drawn:
        height = max((float(np.ptp(values)) for _, values in lines), default=0.0)
        for times, values in lines:
            moves = np.flatnonzero(np.abs(values - values[-1]) > _STILL * height)
            end = max([end, *times[moves[-1:]]])
    split = first + _ROOM * (end - first)
    return float(split) if first < split < first + _EARLY * (last - first) else None


def _join(axes: Any, first: float, split: float, end: float) -> None:
    """Left panels show the motion, from first to split [s], and the right ones, a strip, the rest to the end."""
    for motion, rest in axes:
        motion.set_xlim(first - 0.01 * (split - first), split)
        rest.set_xlim(split, end)
        rest.set_xticks([end], [f"{end:g}"])
        rest.set_facecolor("0.97")
        rest.tick_params(left=False)
        motion.spines["right"].set_linestyle(":")
        rest.spines["left"].set_linestyle(":")


def _shorten_labels(panels: dict) -> None:
    for key, lines in panels.items():
        _, labels = short_labels([label for label, _, _ in lines])
        panels[key] = [(label, times, row) for label, (_, times, row) in zip(labels, lines)]
