"""Block diagrams as SVG: systems, their ports by name, what feeds what, and a click into each part."""

from __future__ import annotations

import os
import re
from html import escape
from typing import Any

from sheldrake.systems.framework import Diagram

from ._layered_layout import Box, Layout, Wire

_ROW, _HEADER, _PAD = 15.0, 34.0, 8.0
_EDGE = 16.0  # around the drawing
_TITLE_ROOM = 30.0
_WIDEST = 1500.0  # what is made to fit into a notebook
_MADE_UP = re.compile(r"@[0-9a-f]{16}$")  # names that DiagramBuilder gives
_MOST_PORTS = 8  # unconnected ports beyond these are only counted

_STYLE = """
.shd{font-family:system-ui,-apple-system,"Segoe UI",Roboto,Helvetica,Arial,sans-serif;font-size:11px;fill:#1f2328}
.shd .paper{fill:#fff}
.shd .box{fill:#f6f8fa;stroke:#57606a;stroke-width:1}
.shd .inner{fill:#eef4fc;stroke:#2f6db5;stroke-width:1.4}
.shd .header{fill:#e4e9ee}
.shd .inner+.header{fill:#d3e3f7}
.shd .name{font-weight:600;font-size:12px}
.shd .kind{fill:#57606a;font-size:10px}
.shd .free{fill:#8c959f}
.shd .end{fill:#fff;stroke:#57606a}
.shd .wire{fill:none;stroke:#57606a;stroke-width:1.3}
.shd .back{stroke:#b35900}
.shd .hit{fill:none;stroke:transparent;stroke-width:8}
.shd .dot{fill:#57606a}
.shd g.w:hover .wire{stroke:#d1242f;stroke-width:2.4}
.shd a{cursor:pointer}
.shd a:hover .inner{stroke-width:2.4}
.shd .title{font-size:13px;font-weight:600}
.shd .link{fill:#2f6db5}
.shd .level:target{display:inline}
.shd:has(.level:target) .root:not(:target){display:none}
"""


def DrawDiagram(system: Any, path: str | os.PathLike | None = None) -> str:
    """Returns a picture of a diagram as SVG, made without other programs; notebooks show it by themselves.

    Boxes are systems, with the names of their ports; inputs are on the left, outputs on the right, feedback runs below
    (orange). In a browser, a click on a diagram inside shows what is in it, and pointing at a wire says what it
    connects.

    Args:
        system: A Diagram, or any other System, which is drawn as one box.
        path: A file to write the picture to as well, "diagram.svg".
    """
    text = _document(system)
    if path is not None:
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
    return text


def _document(system: Any) -> str:
    levels: list[tuple[str, float, float]] = []
    _add_level(system, None, levels)
    # What is inside may be larger: then it is made to fit, but the picture grows for it as far as it still looks well.
    width = max(levels[0][1], 0.6 * max(width for _, width, _ in levels))
    height = max(levels[0][2], 0.6 * max(height for _, _, height in levels))
    body = "\n".join(content.replace("@W@", f"{width:.0f}").replace("@H@", f"{height:.0f}") for content, _, _ in levels)
    title = escape(_called(system))
    # A very wide picture would be too small to read in a notebook: it scrolls.
    fit = ' style="max-width:100%;height:auto"' if width < _WIDEST else ""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" class="shd" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="0 0 {width:.0f} {height:.0f}"{fit} '
        f'role="img" aria-label="Block diagram of {title}">\n'
        f"<style>{_STYLE}</style>\n"
        f'<rect class="paper" width="100%" height="100%"/>\n{body}\n</svg>\n'
    )


def _add_level(system: Any, parent: Any, levels: list[tuple[str, float, float]]) -> None:
    """Adds the picture of a system, then those of the diagrams inside, each with its size."""
    picture, width, height = _Level(system, parent).draw()
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
            if isinstance(inner, Diagram):
                _add_level(inner, system, levels)


def _anchor(system: Any) -> str:
    return f"shd{system._system_id}"


def _label(system: Any) -> tuple[str, str]:
    """Returns a system's name, "" where nobody gave it one, and its class."""
    name = system.get_name()
    return "" if _MADE_UP.search(name) else name, type(system).__name__


def _called(system: Any) -> str:
    """Returns a system's name, or its class where it has none."""
    name, kind = _label(system)
    return name or kind


def _text_width(text: str, size: float = 11.0) -> float:
    """Returns about how wide a text is, generously: nobody can measure here what font there will be."""
    narrow = sum(c in "fijlrt.,:;|!'()[] " for c in text)
    wide = sum(c in "mwMW@" or ord(c) > 0x2000 for c in text)
    return size * (0.6 * (len(text) - narrow - wide) + 0.38 * narrow + 0.95 * wide)


def _port_rows(declarations: Any, used: set[int]) -> tuple[list[tuple[str, str, bool]], dict[int, int]]:
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


class _SystemBox:
    """A system as a box with a header and its ports' names."""

    def __init__(self, system: Any, used_in: set[int], used_out: set[int]):
        self._system = system
        self._left, self.row_of_input = _port_rows(system._inputs, used_in)
        self._right, self.row_of_output = _port_rows(system._outputs, used_out)
        self._name, self._kind = _label(system)
        self._is_diagram = isinstance(system, Diagram)
        names = [max((_text_width(row[0]) for row in rows), default=0.0) for rows in (self._left, self._right)]
        header = max(_text_width(self._name or self._kind, 12.5), _text_width(self._kind, 10) + 14)
        rows = max(len(self._left), len(self._right))
        self.box = Box(
            max(sum(names) + 3.5 * _PAD, header + 2 * _PAD, 70.0),
            _HEADER + _ROW * rows + (5.0 if rows else 0.0),
            [_HEADER + _ROW * (k + 0.5) + 2 for k in range(len(self._left))],
            [_HEADER + _ROW * (k + 0.5) + 2 for k in range(len(self._right))],
        )

    def draw(self) -> str:
        """Returns its SVG."""
        box = self.box
        x, y, width, height = box.x, box.y, box.width, box.height
        frame = f'x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" rx="4"'
        style = "box inner" if self._is_diagram else "box"
        parts = [
            f'<rect class="{style}" {frame} height="{height:.1f}"/>',
            f'<path class="header" d="M{x + 0.7:.1f} {y + _HEADER - 3:.1f}V{y + 4:.1f}q0 -3.3 3.3 -3.3h{width - 8:.1f}'
            f'q3.3 0 3.3 3.3V{y + _HEADER - 3:.1f}z"/>',
        ]
        middle = x + width / 2
        first, second = (self._name, self._kind) if self._name else (self._kind, "")
        parts.append(
            f'<text class="name" x="{middle:.1f}" y="{y + 14:.1f}" text-anchor="middle">{escape(first)}</text>'
        )
        if second:
            more = " \u2295" if self._is_diagram else ""
            place = f'x="{middle:.1f}" y="{y + 26:.1f}" text-anchor="middle"'
            parts.append(f'<text class="kind" {place}>{escape(second)}{more}</text>')
        for rows, offsets, at, anchor in (
            (self._left, box.inputs, x + _PAD, "start"),
            (self._right, box.outputs, x + width - _PAD, "end"),
        ):
            for (text, title, used), offset in zip(rows, offsets):
                kind = "" if used else ' class="free"'
                tip = f"<title>{escape(title)}</title>" if title != text else ""
                place = f'x="{at:.1f}" y="{y + offset + 4:.1f}" text-anchor="{anchor}"'
                parts.append(f"<text{kind} {place}>{escape(text)}{tip}</text>")
        text = "".join(parts)
        return f'<a href="#{_anchor(self._system)}">{text}</a>' if self._is_diagram else f"<g>{text}</g>"


class _EndBox:
    """A port of the whole diagram."""

    def __init__(self, name: str, end: int):
        self._name, self._is_input = name, end < 0
        width, height = _text_width(name) + 2 * _PAD, 20.0
        self.box = Box(width, height, [] if end < 0 else [height / 2], [height / 2] if end < 0 else [], end)

    def draw(self) -> str:
        """Returns its SVG."""
        box = self.box
        what, color = ("input", "#2f6db5") if self._is_input else ("output", "#2e8540")
        return (
            f'<g><title>{what} port of the diagram</title><rect class="end" style="stroke:{color}" x="{box.x:.1f}" '
            f'y="{box.y:.1f}" width="{box.width:.1f}" height="{box.height:.1f}" rx="10"/><text '
            f'x="{box.x + box.width / 2:.1f}" y="{box.y + 14:.1f}" text-anchor="middle">{escape(self._name)}</text></g>'
        )


class _Level:
    """The picture of one diagram's inside, or of one system."""

    def __init__(self, system: Any, parent: Any):
        self._system, self._parent = system, parent
        self._drawn: list[_SystemBox | _EndBox] = []
        self._wires: list[Wire] = []
        self._titles: list[str] = []
        if isinstance(system, Diagram):
            self._add_inside(system)
        else:
            self._drawn.append(_SystemBox(system, set(), set()))

    def _add_inside(self, diagram: Diagram) -> None:
        systems = diagram.GetSystems()
        used_in = {*diagram._wires, *diagram._exported_inputs}
        used_out = {*diagram._wires.values(), *diagram._exported_outputs}
        boxes = [
            _SystemBox(system, {i for a, i in used_in if a == k}, {j for b, j in used_out if b == k})
            for k, system in enumerate(systems)
        ]
        self._drawn += boxes

        def input_of(a: int, i: int) -> tuple[tuple[int, int], str]:
            return (a, boxes[a].row_of_input[i]), f"{_called(systems[a])}.{systems[a]._inputs[i].name}"

        def output_of(b: int, j: int) -> tuple[tuple[int, int], str]:
            return (b, boxes[b].row_of_output[j]), f"{_called(systems[b])}.{systems[b]._outputs[j].name}"

        def end(name: str, side: int) -> tuple[tuple[int, int], str]:
            self._drawn.append(_EndBox(name, side))
            return (len(self._drawn) - 1, 0), name

        for (a, i), (b, j) in diagram._wires.items():
            self._connect(output_of(b, j), input_of(a, i))
        for k, declaration in enumerate(diagram._inputs):
            source = end(declaration.name, -1)
            for (a, i), own in diagram._exported_inputs.items():
                if own == k:
                    self._connect(source, input_of(a, i))
        for declaration, (b, j) in zip(diagram._outputs, diagram._exported_outputs):
            self._connect(output_of(b, j), end(declaration.name, +1))

    def _connect(self, source: tuple[tuple[int, int], str], target: tuple[tuple[int, int], str]) -> None:
        self._wires.append(Wire(source[0], target[0]))
        self._titles.append(f"{source[1]} \u2192 {target[1]}")

    def draw(self) -> tuple[str, float, float]:
        """Returns its SVG, width and height."""
        layout = Layout([drawn.box for drawn in self._drawn], self._wires)
        wires = [_draw_wire(wire, title, layout) for wire, title in zip(self._wires, self._titles)]
        dots = [f'<circle class="dot" cx="{x:.1f}" cy="{y:.1f}" r="2.4"/>' for x, y in layout.dots]
        called = _called(self._system)
        title = f'<text class="title" x="{_EDGE}" y="20">{escape(called)}</text>'
        if self._parent is not None:
            above = _called(self._parent)
            title = (
                f'<a href="#{_anchor(self._parent)}"><text class="title link" x="{_EDGE}" y="20">\u2039 '
                f"{escape(above)}</text></a>"
                f'<text class="title" x="{_EDGE + 26 + _text_width(above, 13.5):.1f}" y="20">'
                f"{escape(called)}</text>"
            )
        drawing = "\n".join([*wires, *dots, *(drawn.draw() for drawn in self._drawn)])
        return (
            f'{title}\n<g transform="translate({_EDGE} {_TITLE_ROOM + 6})">\n{drawing}\n</g>',
            max(layout.width, _text_width(called, 14)) + 2 * _EDGE,
            layout.height + _TITLE_ROOM + 6 + _EDGE,
        )


def _draw_wire(wire: Wire, title: str, layout: Layout) -> str:
    """Returns a wire with round corners, an arrow's head, and room to point at."""
    (x, y), *rest = wire.points
    path = [f"M{x:.1f} {y:.1f}"]
    for (px, py), (cx, cy), (nx, ny) in zip(wire.points, rest, rest[1:]):
        r = min(5.0, (abs(cx - px) + abs(cy - py)) / 2, (abs(nx - cx) + abs(ny - cy)) / 2)
        bx, by = cx - r * _sign(cx - px), cy - r * _sign(cy - py)
        ax, ay = cx + r * _sign(nx - cx), cy + r * _sign(ny - cy)
        path.append(f"L{bx:.1f} {by:.1f}Q{cx:.1f} {cy:.1f} {ax:.1f} {ay:.1f}")
    x, y = wire.points[-1]
    path.append(f"L{x:.1f} {y:.1f}")
    d = "".join(path)
    source, target = layout.boxes[wire.source[0]], layout.boxes[wire.target[0]]
    back = " back" if source.layer >= target.layer else ""
    return (
        f'<g class="w"><title>{escape(title)}</title><path class="hit" d="{d}"/><path class="wire{back}" d="{d}"/>'
        f'<path class="wire{back}" d="M{x - 6:.1f} {y - 3:.1f}L{x:.1f} {y:.1f}L{x - 6:.1f} {y + 3:.1f}"/></g>'
    )


def _sign(value: float) -> float:
    return (value > 1e-9) - (value < -1e-9)
