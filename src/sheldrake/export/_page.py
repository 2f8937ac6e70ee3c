"""SavePage: a diagram as one HTML file that simulates it, without a network and without Python."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import TYPE_CHECKING, Any

from sheldrake.common._files import whole_file
from sheldrake.export._freeze import Freezer
from sheldrake.export._frozen import FrozenDiagram
from sheldrake.export._scene import Scene
from sheldrake.export._wasm import wasm_module
from sheldrake.report._page import script_text
from sheldrake.report._replay import find_meshcat
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import System

if TYPE_CHECKING:
    from os import PathLike

    from sheldrake.geometry._meshcat.meshcat import Meshcat

_SPEEDS = (0.1, 0.25, 0.5, 1, 2, 5)
_MOST_LINES = 12  # of a plot


@dataclass
class PageSlider:
    """A slider of a page: it sets one number of an input port or of a group of parameters.

    Attributes:
        name: As `FrozenDiagram.input_names()` or `parameter_names()` has it, such as "plant/actuation".
        low: Least value.
        high: Greatest value.
        element: Which number of the vector.
        label: What stands beside it; by default the name and the element.
        unit: Behind its value.
    """

    name: str
    low: float
    high: float
    element: int = 0
    label: str = ""
    unit: str = ""


def SavePage(
    simulator: Any,
    path: str | PathLike[str],
    *,
    title: str = "",
    sliders: Sequence[PageSlider] = (),
    meshcat: Meshcat | None = None,
) -> None:
    """Writes one HTML file that simulates a diagram in any browser, from where the simulator stands.

    It shows the scene, and plots of what `LogVectorOutput` logs, with play, pause, step, reset and speed. Before the
    run free bodies are dragged to where they begin; in it bodies are pulled by a spring. A state is kept in a link or
    a file. Nothing is loaded from anywhere: the file works offline. Kernels run as WebAssembly.

    Args:
        simulator: Of a diagram that `Freeze` takes.
        path: The file, which is overwritten.
        title: Of the page; by default the name of the diagram.
        sliders: Numbers that are set while it runs.
        meshcat: Where the scene is drawn already; by default the Meshcat of the diagram's MeshcatVisualizer, or a new
            one that lives as long as this call.

    Raises:
        ValueError: something in the diagram is Python (see `Freeze`); or a slider's name or element is none.
        ModuleNotFoundError: a kernel's WebAssembly does not come with the wheel, as one's own does not, and llvmlite or
            ziglang is not installed.
        OSError: the file can not be written.
    """
    text = _page_of(simulator, title, sliders, meshcat)
    with whole_file(path, encoding="utf-8", newline="\n") as file:
        file.write(text)


class NotebookPage:
    """A page that simulates, in a notebook: it shows itself where it is the last line of a cell.

    Args:
        html: The page.
        height: Of its place in the notebook [px].
    """

    def __init__(self, html: str, height: int):
        self.html, self.height = html, height

    def _repr_html_(self) -> str:
        style = f"width:100%; height:{self.height}px; border:0"
        return f'<iframe srcdoc="{html.escape(self.html)}" title="Simulation" style="{style}"></iframe>'


def ShowPage(
    simulator: Any, *, title: str = "", sliders: Sequence[PageSlider] = (), meshcat: Any = None, height: int = 560
) -> NotebookPage:
    """Returns the page that `SavePage` writes, for a notebook, which shows it in a cell and keeps it when it is saved.

    Args:
        simulator: As in `SavePage`; or a diagram, which begins with its default context.
        title: As in `SavePage`.
        sliders: As in `SavePage`.
        meshcat: As in `SavePage`.
        height: Of its place in the notebook [px].

    Raises:
        ValueError: as in `SavePage`.
        ModuleNotFoundError: as in `SavePage`.
    """
    ready = Simulator(simulator) if isinstance(simulator, System) else simulator
    return NotebookPage(_page_of(ready, title, sliders, meshcat), int(height))


def _page_of(simulator: Any, title: str, sliders: Iterable[PageSlider], meshcat: Any) -> str:
    freezer = Freezer(simulator)
    scene = Scene(freezer, meshcat if meshcat is not None else find_meshcat(simulator.get_system()))
    frozen = freezer.frozen()
    return make_page(frozen, scene, title or frozen.name or "Simulation", sliders)


def make_page(frozen: FrozenDiagram, scene: Scene, title: str, sliders: Iterable[PageSlider]) -> str:
    """The page of a frozen diagram and its scene."""
    about = frozen.description
    shown = {**about, "functions": [{"symbol": f["symbol"]} for f in about["functions"]]}
    page = {
        "diagram": hashlib.sha256(frozen.ToBytes()).hexdigest()[:16],
        "file": "".join(c if c.isalnum() else "-" for c in title)[:40],
        "image": _packed(frozen.image),
        "code": _packed(wasm_module(frozen)),
        "scene": scene.description,
        "plots": [plot for k, log in enumerate(about["logs"]) for plot in _plots(k, log)],
        "sliders": [_slider(about, slider) for slider in sliders],
    }
    files = resources.files("sheldrake.export")
    read = {name: (files / name).read_text(encoding="utf-8") for name in ("page.css", "machine.js", "page.js")}
    scripts = [
        f'<script type="application/json" id="{name}">{script_text(json.dumps(value))}</script>'
        for name, value in (("diagram", shown), ("page", page), ("scene-page", scene.html))
    ]
    return "\n".join(
        [
            '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{html.escape(title)}</title>",
            f"<style>{read['page.css']}</style></head><body>",
            f'<header><h1>{html.escape(title)}</h1><p id="note" role="status"></p></header>',
            _main(title, _hint(scene), bool(page["plots"]), bool(page["sliders"])),
            *scripts,
            f"<script>{read['machine.js']}</script><script>{read['page.js']}</script>",
            "</body></html>\n",
        ]
    )


def _packed(data: bytes) -> str:
    """Bytes as the page unpacks them."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    return base64.b64encode(packer.compress(data) + packer.flush()).decode("ascii")


def _plots(k: int, log: dict[str, Any]) -> list[dict[str, Any]]:
    """Plots of a log, one for each kind of quantity."""
    from sheldrake.systems.primitives._vector_log import quantity, short_labels

    kinds: dict[tuple[str, str], list[tuple[int, str]]] = {}
    for column, element in enumerate(log["elements"]):
        kind, unit, label = quantity(element)
        kinds.setdefault((kind, unit), []).append((column, label))
    plots = []
    for (kind, unit), lines in kinds.items():
        begin, labels = short_labels([label for _, label in lines])
        title = log["name"] if kind in ("", "value") else f"{log['name']}: {kind}"
        title += f" of {begin}" if begin else ""
        title += f" (first {_MOST_LINES} of {len(lines)})" if len(lines) > _MOST_LINES else ""
        found = [{"column": column, "label": label} for (column, _), label in zip(lines, labels)]
        plots.append({"log": k, "title": title, "unit": unit, "lines": found[:_MOST_LINES]})
    return plots


def _slider(about: dict[str, Any], slider: PageSlider) -> dict[str, Any]:
    known = {v["name"]: v for v in (*about["inputs"], *about["parameters"])}
    if slider.name not in known:
        names = ", ".join(map(repr, known)) or "none"
        raise ValueError(f"SavePage(): there is no input or parameter {slider.name!r} for a slider; there are {names}.")
    vector = known[slider.name]
    if not 0 <= slider.element < len(vector["elements"]):
        raise ValueError(
            f"SavePage(): {slider.name!r} has {len(vector['elements'])} elements; a slider asks for number "
            f"{slider.element}."
        )
    if not slider.low < slider.high:
        raise ValueError(f"SavePage(): a slider of {slider.name!r} goes from {slider.low} to {slider.high}.")
    return {
        "at": vector["at"] + slider.element,
        "low": slider.low,
        "high": slider.high,
        "label": slider.label or f"{slider.name} {vector['elements'][slider.element]}",
        "unit": slider.unit or vector["units"][slider.element],
    }


def _hint(scene: Scene) -> str:
    """What can be done with mouse and keys; "" where there is nothing to see."""
    if not scene.html:
        return ""
    about = scene.description
    ways = (
        ["drag a free body to where it is to begin, with Shift to turn it"]
        if any(f["free"] >= 0 for f in about["frames"])
        else []
    )
    ways += ["pull on a body while it runs"] if any(plant["tau"] >= 0 for plant in about["plants"]) else []
    said = "; ".join(ways)
    return f"{said[:1].upper()}{said[1:]}. ".lstrip(". ") + "Keys: space plays, s steps, r resets."


def _main(title: str, hint: str, has_plots: bool, has_sliders: bool) -> str:
    alone = "" if hint and (has_plots or has_sliders) else ' class="alone"'
    parts = [f"<main{alone}>"]
    if hint:
        parts.append(
            '<section class="scene" aria-label="Scene">'
            f'<iframe id="scene" title="Three-dimensional scene of {html.escape(title)}"></iframe>'
            f'<p class="hint">{hint}</p></section>'
        )
    if has_plots or has_sliders:
        parts.append('<section class="side" aria-label="Values" tabindex="0">')
        if has_sliders:
            parts.append('<h2>Values</h2><div id="sliders" class="sliders"></div>')
        if has_plots:
            parts.append('<h2>Plots</h2><div id="plots"></div>')
        parts.append("</section>")
    speeds = "".join(f'<option value="{s}"{" selected" if s == 1 else ""}>{s}×</option>' for s in _SPEEDS)
    return "\n".join([*parts, "</main>", _PLAYER.replace("{speeds}", speeds)])


_PLAYER = """<footer class="player" aria-label="Player">
<button id="play" type="button" disabled>Play</button>
<button id="step" type="button" disabled>Step</button>
<button id="reset" type="button" disabled>Reset</button>
<label for="speed" class="away">Speed</label><select id="speed">{speeds}</select>
<output id="now" aria-label="Time">0 s</output>
<span class="gap"></span>
<button id="link" type="button" disabled>Link to this state</button>
<button id="save" type="button" disabled>Save</button>
<button id="load" type="button" disabled>Load</button>
<label for="file" class="away">File with a state</label><input id="file" type="file" class="away" tabindex="-1">
</footer>"""
