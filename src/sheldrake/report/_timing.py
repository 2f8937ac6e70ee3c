"""Where the time of a run went: each system's kernels and Python functions, the logs, and the event loop."""

from __future__ import annotations

import html
import re
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ._replay import StateLog

if TYPE_CHECKING:
    from sheldrake.systems.analysis import Simulator
    from sheldrake.systems.framework._context.context import Context

_LOOKS = 60  # states at which kernels are measured
_MOST_ROWS = 25


class Timing(NamedTuple):
    """Costs of a run.

    Attributes:
        costs: Of rows that were called, dearest first.
        seconds: All time spent in steps [s].
        simulated: Time that passed in the simulation [s].
    """

    costs: list[Any]
    seconds: float
    simulated: float


def timing_of_run(simulator: Simulator, logs: list[StateLog], sinks: dict[str, Any]) -> Timing:
    """Measures what the steps of a run cost, at logged states of its plants; logs go by what they log."""
    from sheldrake.systems.analysis._costs import costs_of_run, seconds_in_steps

    context = simulator.get_context()
    last = context.get_time()
    first = max((log.times[0] for log in logs), default=last)

    def set_state(root: Context, t: float) -> None:
        root.SetTime(t)
        for log in logs:
            log.set_state(root, t)

    costs = costs_of_run(simulator, set_state, np.linspace(first, last, _LOOKS).tolist())
    logged = {sink.GetSystemPathname(): name for name, sink in sinks.items()}
    costs = [cost._replace(system=logged.get(cost.system) or _short(cost.system)) for cost in costs]
    costs.sort(key=lambda cost: -cost.calls * cost.each)
    return Timing(costs, seconds_in_steps(simulator), last - simulator._time0)


def timing_section(timing: Timing) -> str:
    """HTML that shows it."""
    measured = sum(cost.calls * cost.each for cost in timing.costs)
    whole = max(timing.seconds, measured) or 1.0
    rows = [_row(cost.system, cost.name, cost.calls, cost.each, whole) for cost in timing.costs[:_MOST_ROWS]]
    others = timing.costs[_MOST_ROWS:]
    if others:
        rest = sum(cost.calls * cost.each for cost in others)
        rows.append(_row("", f"{len(others)} more", None, rest, whole))
    rows.append(_row("", "event loop, Python between steps, other programs", None, whole - measured, whole))
    names = ("system", "what", "calls", "each [µs]", "total [ms]", "share")
    head = "".join(f'<th scope="col">{name}</th>' for name in names)
    return (
        '<section><h2>Where the time went</h2><p class="hint">'
        f"{timing.simulated:.4g} s were simulated in {timing.seconds:.3g} s. Machine code was timed after the run, "
        "called again at logged states; Python functions by the median of their first calls in the run.</p>"
        '<div class="wide" tabindex="0" role="region" aria-label="Where the time went"><table class="costs">'
        f"<thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table></div></section>"
    )


def _short(path: str) -> str:
    """Path below the root; systems without a name by their class."""
    names = path.split("::")[2:] or path.split("::")
    return "/".join(re.sub(r"^[\w.]*\.(\w+)@[0-9a-f]+$", r"\1", name) for name in names)


def _row(system: str, name: str, calls: int | None, each: float, whole: float) -> str:
    total = each * (1 if calls is None else calls)
    share = 100.0 * total / whole
    numbers = ("", "") if calls is None else (f"{calls:,}".replace(",", "\u202f"), f"{1e6 * each:.3g}")
    cells = "".join(f"<td>{cell}</td>" for cell in (*numbers, f"{1e3 * total:.3g}"))
    bar = f'<span class="bar" style="width: {share / 10:.2f}em" aria-hidden="true"></span>'
    return (
        f'<tr><th scope="row">{html.escape(system)}</th><td>{html.escape(name)}</td>{cells}'
        f"<td>{bar} {share:.1f} %</td></tr>"
    )
