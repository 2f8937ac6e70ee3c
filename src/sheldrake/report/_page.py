"""The page of a report: data for its script, and the rest as plain HTML."""

from __future__ import annotations

import base64
import html
import json
from dataclasses import dataclass, field
from importlib import resources
from typing import Any

import numpy as np

from ._contact_events import ContactEvent
from ._replay import Replay
from ._summary import Table
from ._timing import Timing, timing_section

_MOST_POINTS = 2000  # of a line; of more, the least and the largest of each stretch are kept
_MOST_LINES = 40  # of a plot


@dataclass
class Report:
    """What a page shows."""

    title: str
    replay: Replay | None = None
    logs: Any = None
    events: list[ContactEvent] = field(default_factory=list)
    look: float = 0.0
    timing: Timing | None = None
    diagram: str = ""
    topologies: dict[str, str] = field(default_factory=dict)
    tables: list[Table] = field(default_factory=list)


def make_page(report: Report) -> str:
    """The whole page."""
    plots = plots_of(report.logs) if report.logs is not None else []
    data: dict[str, Any] = {"replay": None, "plots": plots, "times": _span(report)}
    if report.replay is not None:
        data["replay"] = {
            "paths": report.replay.paths,
            "times": _packed(report.replay.times),
            "poses": _packed(report.replay.poses.reshape(-1)),
            "camera": None if report.replay.camera is None else report.replay.camera.tolist(),
        }
    scene = json.dumps(report.replay.html) if report.replay is not None else "null"
    files = resources.files("sheldrake.report")
    return "\n".join(
        [
            '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{html.escape(report.title)}</title>",
            f"<style>{(files / 'page.css').read_text(encoding='utf-8')}</style></head><body>",
            f"<header><h1>{html.escape(report.title)}</h1></header>",
            _main(report, bool(plots)),
            f'<script type="application/json" id="data">{_script_text(json.dumps(data))}</script>',
            f'<script type="application/json" id="scene-page">{_script_text(scene)}</script>',
            f"<script>{(files / 'page.js').read_text(encoding='utf-8')}</script>",
            "</body></html>",
        ]
    )


def _script_text(text: str) -> str:
    """JSON that no HTML parser takes for the end of its element."""
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def _packed(values: Any) -> str:
    """Numbers in single precision, as the script unpacks them."""
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode("ascii")


def _span(report: Report) -> list[float]:
    ends = []
    if report.replay is not None:
        ends.append((report.replay.times[0], report.replay.times[-1]))
    for log in (report.logs or {}).values():
        times = log.sample_times()
        if len(times):
            ends.append((times.min(), times.max()))
    return [float(min(a for a, _ in ends)), float(max(b for _, b in ends))] if ends else [0.0, 0.0]


def plots_of(logs: Any) -> list[dict[str, Any]]:
    """Plots as the script draws them: title, unit, lines with label, times and values."""
    from sheldrake.systems.primitives._log_units import quantity
    from sheldrake.visualization._roll_pitch_yaw import with_roll_pitch_yaw

    plots = []
    for title, log in logs.items():
        if not log.num_samples():
            continue
        names = log.names()
        if log.get_input_size() == 1 and names == ["y0"]:
            names = [title.rpartition("/")[2]]
        names, rows = with_roll_pitch_yaw(names, log.data())
        times = log.sample_times()
        panels: dict[tuple[str, str], list[tuple[str, np.ndarray]]] = {}
        for name, row in zip(names, rows):
            kind, unit, label = quantity(name)
            if unit == "rad" and "roll" in kind:
                unit, row = "deg", np.degrees(row)
            panels.setdefault((kind, unit), []).append((label, row))
        for (kind, unit), lines in panels.items():
            plots.append(_plot(title, kind, unit, times, lines))
    return plots


def _plot(title: str, kind: str, unit: str, times: np.ndarray, lines: list) -> dict[str, Any]:
    stems = {label.rpartition(" ")[0] for label, _ in lines}
    if len(stems) == 1 and stems != {""}:
        lines = [(label.rpartition(" ")[2], row) for label, row in lines]
    about = f"{title}: {kind}" if kind not in ("", "value") else title
    packed = []
    for label, row in lines[:_MOST_LINES]:
        t, y = thinned(times, row)
        packed.append({"label": label, "t": _packed(t), "y": _packed(y)})
    hidden = len(lines) - len(packed)
    return {
        "title": about + (f" (first {_MOST_LINES} of {len(lines)})" if hidden else ""),
        "unit": unit,
        "lines": packed,
    }


def thinned(times: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A line with fewer points that looks the same: of each stretch, its first, least and largest value."""
    n = len(times)
    if n <= _MOST_POINTS:
        return times, values
    stretches = np.array_split(np.arange(n), _MOST_POINTS // 3)
    kept = {n - 1}
    for stretch in stretches:
        part = values[stretch]
        if np.isnan(part).all():
            kept.add(int(stretch[0]))
            continue
        kept |= {int(stretch[0]), int(stretch[np.nanargmin(part)]), int(stretch[np.nanargmax(part)])}
    order = sorted(kept)
    return times[order], values[order]


# Plain HTML.


def _main(report: Report, has_plots: bool) -> str:
    parts = ["<main>", '<div class="run">']
    if report.replay is not None:
        parts.append(
            '<section class="scene" aria-label="Replay"><h2>Replay</h2>'
            f'<iframe id="scene" title="Three-dimensional scene of {html.escape(report.title)}"></iframe></section>'
        )
    elif report.logs is not None and report.diagram:
        parts.append(
            '<section class="scene"><h2>Replay</h2><p>There is no replay: no state was logged. Before Build(), call '
            "<code>LogAll(builder)</code> or <code>LogVectorOutput(plant.get_state_output_port(), builder)</code>.</p>"
            "</section>"
        )
    if has_plots:
        parts.append('<section class="plots" aria-label="Plots" tabindex="0">')
        parts.append('<h2>Plots</h2><div id="plots"></div></section>')
    parts.append("</div>")
    if report.replay is not None or has_plots:
        parts.append(_PLAYER)
    if report.events or report.look:
        parts.append(_events(report))
    if report.timing is not None:
        parts.append(timing_section(report.timing))
    if report.diagram:
        parts.append('<section><h2>Block diagram</h2><p class="hint">Logs are left out.</p>')
        parts += [_picture("Block diagram", report.diagram), "</section>"]
    for name, picture in report.topologies.items():
        title = html.escape(f"Bodies and joints of {name}")
        parts += [f"<section><h2>{title}</h2>", _picture(title, picture), "</section>"]
    parts.append("<section><h2>Model and run</h2>")
    parts += [_table(table) for table in report.tables]
    parts += ["</section>", "</main>"]
    return "\n".join(parts)


_PLAYER = """<div class="player" role="group" aria-label="Player">
<button id="play" type="button">Play</button>
<label for="time">Time</label><input id="time" type="range" min="0" max="1" step="any" value="0">
<output id="now" for="time">0 s</output>
<label for="speed">Speed</label><select id="speed"><option>0.1</option><option>0.25</option><option>0.5</option>
<option selected>1</option><option>2</option><option>5</option></select></div>"""


def _events(report: Report) -> str:
    rows = []
    for event in report.events:
        end = "still touching" if event.end is None else f"{event.end:.4g}"
        lasted = "" if event.end is None else f"{event.end - event.begin:.3g}"
        bodies = html.escape(" and ".join(event.bodies))
        button = f'<button type="button" class="seek" data-time="{event.begin!r}">{event.begin:.4g}</button>'
        rows.append(
            f"<tr><td>{bodies}</td><td>{button}</td><td>{end}</td><td>{lasted}</td><td>{event.peak:.4g}</td></tr>"
        )
    names = ("bodies", "from [s]", "to [s]", "for [s]", "largest normal force [N]")
    head = "".join(f'<th scope="col">{name}</th>' for name in names)
    note = f"Looked at every {report.look:.3g} s; what is shorter may be missing." if report.look else ""
    body = "".join(rows) or f'<tr><td colspan="{len(names)}">No bodies touched.</td></tr>'
    return (
        f'<section><h2>Contacts</h2><p class="hint">{note}</p><div class="wide" tabindex="0" role="region" '
        f'aria-label="Contacts"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div></section>'
    )


def _picture(title: str, svg: str) -> str:
    return f'<div class="wide" tabindex="0" role="region" aria-label="{title}">{svg}</div>'


def _table(table: Table) -> str:
    has_head = any(table.head)
    head = "".join(f'<th scope="col">{html.escape(name)}</th>' for name in table.head) if has_head else ""
    body = ""
    for row in table.rows:
        first, *rest = (html.escape(cell) for cell in row)
        body += f'<tr><th scope="row">{first}</th>{"".join(f"<td>{cell}</td>" for cell in rest)}</tr>'
    thead = f"<thead><tr>{head}</tr></thead>" if has_head else ""
    caption = html.escape(table.title)
    return (
        f'<div class="wide" tabindex="0" role="region" aria-label="{caption}">'
        f"<table><caption>{caption}</caption>{thead}<tbody>{body}</tbody></table></div>"
    )
