"""Block diagrams as SVG, without the graphviz program.

Systems stand in columns: each to the right of what feeds it, loops cut where a walk finds them closing (Sugiyama,
Tagawa and Toda, 1981). Within a column the order follows the neighbours' mean height. Connections that go back run
below.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any
from xml.sax.saxutils import escape

_CHARACTER = 6.6  # [px] width of a letter of the 12 px font, about
_ROW, _HEAD, _PAD = 17.0, 24.0, 14.0  # [px] of a port, of a title, beside texts
_GAP_X, _GAP_Y = 70.0, 26.0
_SWEEPS = 6


@dataclass(eq=False)
class _Box:
    """A system, or a port of the diagram itself, with the ports that are connected."""

    title: str
    kind: str
    inputs: list[tuple[Any, str]] = field(default_factory=list)  # key, name
    outputs: list[tuple[Any, str]] = field(default_factory=list)
    link: str = ""
    hidden: int = 0
    rank: int = 0
    x: float = 0.0
    y: float = 0.0
    width: float = 0.0
    height: float = 0.0

    def measure(self) -> None:
        names = max((len(i) + len(o) for i, o in self._rows()), default=0)
        letters = max(len(self.title), names + 3, len(self.kind) * 0.85)
        self.width = letters * _CHARACTER + 2 * _PAD
        head = _HEAD + (14.0 if self.kind else 0.0)
        self.height = head + max(len(self.inputs), len(self.outputs)) * _ROW + (_ROW if self.hidden else 0.0) + 6.0
        if not self.kind:
            self.height = 26.0

    def _rows(self) -> list[tuple[str, str]]:
        n = max(len(self.inputs), len(self.outputs))
        left = [name for _, name in self.inputs] + [""] * (n - len(self.inputs))
        right = [name for _, name in self.outputs] + [""] * (n - len(self.outputs))
        return list(zip(left, right))

    def port_y(self, key: Any, is_input: bool) -> float:
        if not self.kind:
            return self.y + self.height / 2
        ports = self.inputs if is_input else self.outputs
        row = next(i for i, (k, _) in enumerate(ports) if k == key)
        return self.y + _HEAD + 14.0 + row * _ROW + _ROW / 2


@dataclass
class Picture:
    """One level of a diagram.

    Attributes:
        name: Full name of the diagram.
        anchor: Identifier that links to it.
        svg: The picture.
    """

    name: str
    anchor: str
    svg: str


def draw_diagram(diagram: Any) -> list[Picture]:
    """Pictures of a diagram and of the diagrams inside it, outermost first.

    A system that is no diagram gives a picture of itself alone.
    """
    pictures: list[Picture] = []
    waiting = [(diagram, diagram.get_name() or type(diagram).__name__)]
    while waiting:
        system, name = waiting.pop(0)
        anchor = f"diagram-{len(pictures)}"
        inner = [s for s in getattr(system, "GetSystems", list)() if hasattr(s, "GetSystems")]
        links = {}
        for child in inner:
            waiting.append((child, f"{name}/{child.get_name()}"))
            links[id(child)] = f"diagram-{len(pictures) + len(waiting)}"
        pictures.append(Picture(name, anchor, _draw(system, name, links)))
    return pictures


def _draw(system: Any, name: str, links: dict[int, str]) -> str:
    boxes, edges = _read(system, links)
    for box in boxes:
        box.measure()
    back = _rank(boxes, edges)
    columns = _order(boxes, edges)
    width, height = _place(columns, 48.0 if back else 8.0)
    paths = []
    depth = 0
    for edge in edges:
        if edge in back:
            depth += 1
            paths.append(_back_path(edge, height + 10.0 * depth))
        else:
            paths.append(_path(edge))
    height += 10.0 * depth + (12.0 if depth else 0.0)
    label = f"Block diagram of {name}: {sum(bool(b.kind) for b in boxes)} systems, {len(edges)} connections"
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" class="diagram" viewBox="0 0 {width:.0f} {height:.0f}" '
        f'width="{width:.0f}" height="{height:.0f}" role="img" aria-label="{escape(label, {chr(34): "&quot;"})}">',
        '<g class="wires" fill="none">',
        *paths,
        "</g>",
        *(_box_svg(box) for box in boxes),
        "</svg>",
    ]
    return "\n".join(parts)


_Edge = tuple[_Box, Any, _Box, Any]


def _read(system: Any, links: dict[int, str]) -> tuple[list[_Box], list[_Edge]]:
    if not hasattr(system, "GetSystems"):
        return [_leaf_box(system)], []
    shown = [s for s in system.GetSystems() if _kind(s) != "VectorLogSink"]  # they would be half of the picture
    boxes = {id(s): _Box(s.get_name(), _kind(s), link=links.get(id(s), "")) for s in shown}
    edges: list[_Edge] = []

    def attach(box: _Box, ports: list, key: Any, name: str) -> Any:
        if all(k != key for k, _ in ports):
            ports.append((key, name))
        return key

    def of_input(s: Any, i: Any) -> tuple[_Box, Any]:
        box = boxes[id(s)]
        return box, attach(box, box.inputs, int(i), s.get_input_port(i, warn_deprecated=False).get_name())

    def of_output(s: Any, j: Any) -> tuple[_Box, Any]:
        box = boxes[id(s)]
        return box, attach(box, box.outputs, int(j), s.get_output_port(j, warn_deprecated=False).get_name())

    for (target, i), (source, j) in system.connection_map().items():
        if id(target) not in boxes:
            continue
        edges.append((*of_output(source, j), *of_input(target, i)))
    ends: list[_Box] = []
    for k in range(system.num_input_ports()):
        end = _Box(system.get_input_port(k, warn_deprecated=False).get_name(), "", outputs=[(0, "")])
        ends.append(end)
        edges += [(end, 0, *of_input(s, i)) for s, i in system.GetInputPortLocators(_index("InputPortIndex", k))]
    for k in range(system.num_output_ports()):
        end = _Box(system.get_output_port(k, warn_deprecated=False).get_name(), "", inputs=[(0, "")])
        ends.append(end)
        edges.append((*of_output(*system.get_output_port_locator(_index("OutputPortIndex", k))), end, 0))
    for s in shown:
        box = boxes[id(s)]
        box.inputs.sort()
        box.outputs.sort()
        box.hidden = s.num_input_ports() + s.num_output_ports() - len(box.inputs) - len(box.outputs)
    return [*boxes.values(), *ends], edges


def _index(name: str, k: int) -> Any:
    from sheldrake.systems import framework

    return getattr(framework, name)(k)


def _leaf_box(system: Any) -> _Box:
    box = _Box(system.get_name(), _kind(system))
    box.inputs = [(i, system.get_input_port(i).get_name()) for i in range(system.num_input_ports())]
    box.outputs = [(j, system.get_output_port(j).get_name()) for j in range(system.num_output_ports())]
    return box


def _kind(system: Any) -> str:
    return type(system).__name__.partition("_[")[0]


def _rank(boxes: list[_Box], edges: list[_Edge]) -> list[_Edge]:
    """Gives each box its column, and returns the edges that close loops."""
    leaving: dict[int, list[_Edge]] = {id(box): [] for box in boxes}
    entering = {id(box): 0 for box in boxes}
    for edge in edges:
        leaving[id(edge[0])].append(edge)
        entering[id(edge[2])] += 1
    back: list[_Edge] = []
    done: dict[int, int] = {}  # 1: on the walk, 2: finished
    finished: list[_Box] = []

    def walk(box: _Box) -> None:
        stack = [(box, iter(leaving[id(box)]))]
        done[id(box)] = 1
        while stack:
            at, rest = stack[-1]
            for edge in rest:
                state = done.get(id(edge[2]))
                if state == 1:
                    back.append(edge)
                elif state is None:
                    done[id(edge[2])] = 1
                    stack.append((edge[2], iter(leaving[id(edge[2])])))
                    break
            else:
                done[id(at)] = 2
                finished.append(at)
                stack.pop()

    for box in sorted(boxes, key=lambda b: entering[id(b)]):
        if id(box) not in done:
            walk(box)
    for box in reversed(finished):
        for edge in leaving[id(box)]:
            if edge not in back:
                edge[2].rank = max(edge[2].rank, box.rank + 1)
    return back


def _order(boxes: list[_Box], edges: list[_Edge]) -> list[list[_Box]]:
    columns: list[list[_Box]] = [[] for _ in range(max((b.rank for b in boxes), default=0) + 1)]
    for box in boxes:
        columns[box.rank].append(box)
    neighbours: dict[int, list[_Box]] = {id(box): [] for box in boxes}
    for source, _, target, _ in edges:
        neighbours[id(source)].append(target)
        neighbours[id(target)].append(source)
    place = {id(box): float(i) for column in columns for i, box in enumerate(column)}
    for sweep in range(_SWEEPS):
        for column in columns if sweep % 2 == 0 else reversed(columns):
            mean = {
                id(box): sum(place[id(n)] for n in neighbours[id(box)]) / len(neighbours[id(box)])
                if neighbours[id(box)]
                else place[id(box)]
                for box in column
            }
            column.sort(key=lambda box: mean[id(box)])
            for i, box in enumerate(column):
                place[id(box)] = i - (len(column) - 1) / 2.0
    return columns


def _place(columns: list[list[_Box]], margin: float) -> tuple[float, float]:
    """Puts the boxes in their places; returns width and height of the picture, with a margin at both sides."""
    heights = [sum(box.height for box in column) + _GAP_Y * (len(column) - 1) for column in columns]
    tallest = max(heights, default=0.0)
    x = margin
    for column, height in zip(columns, heights):
        width = max((box.width for box in column), default=0.0)
        y = 8.0 + (tallest - height) / 2.0
        for box in column:
            box.x, box.y, box.width = x, y, width if box.kind else box.width
            if not box.kind and box.inputs == []:
                box.x = x + width - box.width  # an input of the diagram stands near what it feeds
            y += box.height + _GAP_Y
        x += width + _GAP_X
    return x - _GAP_X + margin, tallest + 16.0


def _path(edge: _Edge) -> str:
    source, j, target, i = edge
    x0, y0 = source.x + source.width, source.port_y(j, False)
    x1, y1 = target.x, target.port_y(i, True)
    bend = max(24.0, 0.45 * (x1 - x0))
    return f'<path d="M{x0:.1f} {y0:.1f}C{x0 + bend:.1f} {y0:.1f} {x1 - bend:.1f} {y1:.1f} {x1 - 1:.1f} {y1:.1f}"/>'


def _back_path(edge: _Edge, below: float) -> str:
    source, j, target, i = edge
    x0, y0 = source.x + source.width, source.port_y(j, False)
    x1, y1 = target.x, target.port_y(i, True)
    down = f"M{x0:.1f} {y0:.1f}C{x0 + 40:.1f} {y0:.1f} {x0 + 40:.1f} {below:.1f} {x0:.1f} {below:.1f}"
    up = f"C{x1 - 40:.1f} {below:.1f} {x1 - 40:.1f} {y1:.1f} {x1 - 1:.1f} {y1:.1f}"
    return f'<path class="back" d="{down}L{x1:.1f} {below:.1f}{up}"/>'


def _box_svg(box: _Box) -> str:
    if not box.kind:
        return (
            f'<g class="end"><rect x="{box.x:.1f}" y="{box.y:.1f}" width="{box.width:.1f}" height="{box.height:.1f}" '
            f'rx="13"/><text x="{box.x + box.width / 2:.1f}" y="{box.y + 17:.1f}" text-anchor="middle">'
            f"{escape(box.title)}</text></g>"
        )
    x, y, middle = box.x, box.y, box.x + box.width / 2
    lines = [
        f'<g class="system"><rect x="{x:.1f}" y="{y:.1f}" width="{box.width:.1f}" height="{box.height:.1f}" rx="6"/>',
        f'<text class="name" x="{middle:.1f}" y="{y + 17:.1f}" text-anchor="middle">{escape(box.title)}</text>',
        f'<text class="kind" x="{middle:.1f}" y="{y + 31:.1f}" text-anchor="middle">{escape(box.kind)}</text>',
    ]
    for key, name in box.inputs:
        at = box.port_y(key, True)
        lines.append(f'<circle cx="{x:.1f}" cy="{at:.1f}" r="2.5"/>')
        lines.append(f'<text x="{x + 7:.1f}" y="{at + 4:.1f}">{escape(name)}</text>')
    for key, name in box.outputs:
        at = box.port_y(key, False)
        lines.append(f'<circle cx="{x + box.width:.1f}" cy="{at:.1f}" r="2.5"/>')
        lines.append(f'<text x="{x + box.width - 7:.1f}" y="{at + 4:.1f}" text-anchor="end">{escape(name)}</text>')
    if box.hidden:
        lines.append(
            f'<text class="kind" x="{middle:.1f}" y="{y + box.height - 7:.1f}" text-anchor="middle">'
            f"{box.hidden} more ports, not connected</text>"
        )
    lines.append("</g>")
    text = "".join(lines)
    return f'<a href="#{box.link}">{text}</a>' if box.link else text
