"""The page of a report: data for its script, and the rest as plain HTML."""

from __future__ import annotations

import html
import json
from dataclasses import dataclass, field
from importlib import resources
from typing import Any

from ._contact_events import ContactEvent
from ._plots import packed, plots_of
from ._replay import Replay
from ._summary import Table
from ._timing import Timing, timing_section

_LONG = 8  # rows; a longer table is folded
_MOST_EVENTS = 300
_SPEEDS = (0.01, 0.1, 0.25, 0.5, 1, 2, 5)  # of the replay


@dataclass
class Report:
    """What a page shows."""

    title: str
    facts: list[str] = field(default_factory=list)
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
            "times": packed(report.replay.times),
            "poses": packed(report.replay.poses.reshape(-1)),
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
            f"<header><h1>{html.escape(report.title)}</h1>{_facts(report.facts)}</header>",
            _main(report, bool(plots)),
            f'<script type="application/json" id="data">{script_text(json.dumps(data))}</script>',
            f'<script type="application/json" id="scene-page">{script_text(scene)}</script>',
            f"<script>{(files / 'page.js').read_text(encoding='utf-8')}</script>",
            "</body></html>",
        ]
    )


def script_text(text: str) -> str:
    """JSON that no HTML parser takes for the end of its element."""
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def _span(report: Report) -> list[float]:
    ends = []
    if report.replay is not None:
        ends.append((report.replay.times[0], report.replay.times[-1]))
    for log in (report.logs or {}).values():
        times = log.sample_times()
        if len(times):
            ends.append((times.min(), times.max()))
    return [float(min(a for a, _ in ends)), float(max(b for _, b in ends))] if ends else [0.0, 0.0]


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
        speeds = "".join(
            f'<option value="{speed}"{" selected" if speed == 1 else ""}>{speed}×</option>' for speed in _SPEEDS
        )
        parts.append(_PLAYER.replace("{speeds}", speeds))
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


def _facts(facts: list[str]) -> str:
    return '<ul class="facts">' + "".join(f"<li>{html.escape(fact)}</li>" for fact in facts) + "</ul>" if facts else ""


_PLAYER = """<div class="player" role="group" aria-label="Player">
<button id="play" type="button">Play</button>
<label for="time" class="away">Time</label><input id="time" type="range" min="0" max="1" step="any" value="0">
<output id="now" for="time">0 s</output>
<label for="speed" class="away">Speed</label><select id="speed">{speeds}</select>
<span class="choices" role="group" aria-label="Stretch of time that is shown">
<button id="closer" type="button" title="A shorter stretch of time" aria-label="A shorter stretch of time">+</button>
<button id="farther" type="button" title="A longer stretch of time" aria-label="A longer stretch of time">−</button>
<button id="all" type="button" title="The whole run" aria-label="The whole run">All</button></span></div>"""


def _events(report: Report) -> str:
    rows = []
    last = _span(report)[1]
    for event in report.events[:_MOST_EVENTS]:
        end = "still touching" if event.end is None else f"{event.end:.4g}"
        lasted = (last if event.end is None else event.end) - event.begin
        bodies = html.escape(" and ".join(event.bodies))
        button = f'<button type="button" class="seek" data-time="{event.begin!r}">{event.begin:.4g}</button>'
        cells = (button, end, f"{lasted:.3g}", f"{event.peak:.4g}", f"{event.last:.4g}")
        rows.append(f'<tr><th scope="row">{bodies}</th>' + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    names = ("bodies", "from [s]", "to [s]", "for [s]", "largest normal force [N]", "last one [N]")
    head = "".join(f'<th scope="col">{name}</th>' for name in names)
    note = f"Looked at every {report.look:.3g} s; what is shorter may be missing." if report.look else ""
    if len(report.events) > _MOST_EVENTS:
        note += f" The first {_MOST_EVENTS} of {len(report.events)}."
    body = "".join(rows) or f'<tr><td colspan="{len(names)}">No bodies touched.</td></tr>'
    return (
        f'<section><h2>Contacts</h2><p class="hint">{note}</p><div class="wide tall" tabindex="0" role="region" '
        f'aria-label="Contacts"><table class="events"><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'
        "</section>"
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
    title = html.escape(table.title)
    unfolded = "" if len(table.rows) > _LONG else " open"
    return (
        f'<details{unfolded}><summary>{title}</summary><div class="wide" tabindex="0" role="region" '
        f'aria-label="{title}"><table>{thead}<tbody>{body}</tbody></table></div></details>'
    )
