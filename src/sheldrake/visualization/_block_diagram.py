"""Block diagrams as SVG: systems, their ports by name, what feeds what, and a click into each part."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

from sheldrake.systems.framework import Diagram

from ._layered_layout import Box, Wire
from ._svg_boxes import EDGE, PAD, PortBox, Row, document, draw_boxes, text_width

if TYPE_CHECKING:
    from sheldrake.systems.framework._declarations import InputDeclaration, OutputDeclaration
    from sheldrake.systems.framework._system import System

_MADE_UP = re.compile(r"@[0-9a-f]{16}$")  # names that DiagramBuilder gives
_MOST_PORTS = 8  # unconnected ports beyond these are only counted


def DrawDiagram(
    system: System, path: str | os.PathLike | None = None, *, leave_out: Callable[[Any], bool] = lambda system: False
) -> str:
    """Returns a picture of a diagram as SVG, made without other programs; notebooks show it by themselves.

    Boxes are systems, with the names of their ports; inputs are on the left, outputs on the right, feedback runs below
    (orange). In a browser, a click on a diagram inside shows what is in it, and pointing at a wire says what it
    connects.

    Args:
        system: A Diagram, or any other System, which is drawn as one box.
        path: A file to write the picture to as well, "diagram.svg".
        leave_out: Says which systems inside are not drawn.
    """
    text = _document(system, leave_out)
    if path is not None:
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
    return text


def _document(system: System, leave_out: Callable[[Any], bool]) -> str:
    levels: list[tuple[str, float, float]] = []
    _add_level(system, None, levels, leave_out)
    # What is inside may be larger: then it is made to fit, but the picture grows for it as far as it still looks well.
    width = max(levels[0][1], 0.6 * max(width for _, width, _ in levels))
    height = max(levels[0][2], 0.6 * max(height for _, _, height in levels))
    body = "\n".join(content.replace("@W@", f"{width:.0f}").replace("@H@", f"{height:.0f}") for content, _, _ in levels)
    return document(body, width, height, f"Block diagram of {_called(system)}")


def _add_level(
    system: System, parent: System | None, levels: list[tuple[str, float, float]], leave_out: Callable[[Any], bool]
) -> None:
    """Adds the picture of a system, then those of the diagrams inside, each with its size."""
    picture, width, height = _Level(system, parent, leave_out).draw()
    shown = 'class="level root"' if parent is None else 'class="level" display="none"'
    # Every level fills the same picture; what is larger is made to fit.
    levels.append(
        (
            f'<svg {shown} id="{_anchor(system)}" width="@W@" height="@H@" viewBox="0 0 {width:.0f} {height:.0f}" '
            f'preserveAspectRatio="xMidYMin meet">\n{picture}\n</svg>',
            width,
            height,
        )
    )
    if isinstance(system, Diagram):
        for inner in system.GetSystems():
            if isinstance(inner, Diagram) and not leave_out(inner):
                _add_level(inner, system, levels, leave_out)


def _anchor(system: System) -> str:
    return f"shd{system._system_id}"


def _label(system: System) -> tuple[str, str]:
    """Returns a system's name, "" where nobody gave it one, and its class."""
    name = system.get_name()
    return "" if _MADE_UP.search(name) else name, type(system).__name__


def _called(system: System) -> str:
    """Returns a system's name, or its class where it has none."""
    name, kind = _label(system)
    return name or kind


def _port_rows(
    declarations: Sequence[InputDeclaration] | Sequence[OutputDeclaration], used: set[int]
) -> tuple[list[Row], dict[int, int]]:
    """Returns the rows of one side of a box, as (text, what pointing at it says, whether it leads anywhere).

    Where there are many ports, those that lead nowhere share a row. Also returns the row of each port.
    """
    names = [declaration.name for declaration in declarations]
    free = [k for k in range(len(names)) if k not in used]
    if len(names) <= _MOST_PORTS or len(free) < 2:
        return [(name, name, k in used) for k, name in enumerate(names)], {k: k for k in range(len(names))}
    shown = sorted(used)
    rows = [(names[k], names[k], True) for k in shown]
    rows.append((f"+ {len(free)} unconnected", ", ".join(names[k] for k in free), False))
    return rows, {k: row for row, k in enumerate(shown)}


class _SystemBox(PortBox):
    """A system, a click away from its inside when it is a diagram."""

    def __init__(self, system: System, used_in: set[int], used_out: set[int]):
        left, self.row_of_input = _port_rows(system._inputs, used_in)
        right, self.row_of_output = _port_rows(system._outputs, used_out)
        name, kind = _label(system)
        link = f"#{_anchor(system)}" if isinstance(system, Diagram) else ""
        super().__init__(name or kind, kind if name else "", left, right, link)


class _EndBox:
    """A port of the whole diagram."""

    def __init__(self, name: str, end: int):
        self._name, self._is_input = name, end < 0
        width, height = text_width(name) + 2 * PAD, 20.0
        self.box = Box(width, height, [] if end < 0 else [height / 2], [height / 2] if end < 0 else [], end)

    def draw(self) -> str:
        """Returns its SVG."""
        box = self.box
        what = "input" if self._is_input else "output"
        return (
            f'<g><title>{what} port of the diagram</title><rect class="end {what}" x="{box.x:.1f}" '
            f'y="{box.y:.1f}" width="{box.width:.1f}" height="{box.height:.1f}" rx="10"/><text '
            f'x="{box.x + box.width / 2:.1f}" y="{box.y + 14:.1f}" text-anchor="middle">{escape(self._name)}</text></g>'
        )


class _Level:
    """The picture of one diagram's inside, or of one system."""

    def __init__(self, system: System, parent: System | None, leave_out: Callable[[Any], bool]):
        self._system, self._parent = system, parent
        self._drawn: list[_SystemBox | _EndBox] = []
        self._wires: list[Wire] = []
        self._titles: list[str] = []
        if isinstance(system, Diagram):
            self._add_inside(system, leave_out)
        else:
            self._drawn.append(_SystemBox(system, set(), set()))

    def _add_inside(self, diagram: Diagram, leave_out: Callable[[Any], bool]) -> None:
        systems = dict(enumerate(diagram.GetSystems()))
        shown = [k for k, system in systems.items() if not leave_out(system)]
        place = {k: n for n, k in enumerate(shown)}
        wires = [(to, by) for to, by in diagram._wires.items() if to[0] in place and by[0] in place]
        used_in = {*(to for to, _ in wires), *diagram._exported_inputs}
        used_out = {*(by for _, by in wires), *diagram._exported_outputs}
        boxes = {
            k: _SystemBox(systems[k], {i for a, i in used_in if a == k}, {j for b, j in used_out if b == k})
            for k in shown
        }
        self._drawn += boxes.values()

        def input_of(a: int, i: int) -> tuple[tuple[int, int], str]:
            return (place[a], boxes[a].row_of_input[i]), f"{_called(systems[a])}.{systems[a]._inputs[i].name}"

        def output_of(b: int, j: int) -> tuple[tuple[int, int], str]:
            return (place[b], boxes[b].row_of_output[j]), f"{_called(systems[b])}.{systems[b]._outputs[j].name}"

        def end(name: str, side: int) -> tuple[tuple[int, int], str]:
            self._drawn.append(_EndBox(name, side))
            return (len(self._drawn) - 1, 0), name

        for to, by in wires:
            self._connect(output_of(*by), input_of(*to))
        for k, declaration in enumerate(diagram._inputs):
            source = end(declaration.name, -1)
            for (a, i), own in diagram._exported_inputs.items():
                if own == k and a in place:
                    self._connect(source, input_of(a, i))
        for exported, (b, j) in zip(diagram._outputs, diagram._exported_outputs):
            if b not in place:
                continue
            self._connect(output_of(b, j), end(exported.name, +1))

    def _connect(self, source: tuple[tuple[int, int], str], target: tuple[tuple[int, int], str]) -> None:
        self._wires.append(Wire(source[0], target[0]))
        self._titles.append(f"{source[1]} \u2192 {target[1]}")

    def draw(self) -> tuple[str, float, float]:
        """Returns its SVG, width and height."""
        drawing, width, height = draw_boxes(self._drawn, self._wires, self._titles)
        called = _called(self._system)
        title = f'<text class="title" x="{EDGE}" y="20">{escape(called)}</text>'
        if self._parent is not None:
            above = _called(self._parent)
            title = (
                f'<a href="#{_anchor(self._parent)}"><text class="title link" x="{EDGE}" y="20">\u2039 '
                f"{escape(above)}</text></a>"
                f'<text class="title" x="{EDGE + 26 + text_width(above, 13.5):.1f}" y="20">'
                f"{escape(called)}</text>"
            )
        return f"{title}\n{drawing}", max(width, text_width(called, 14) + 2 * EDGE), height
