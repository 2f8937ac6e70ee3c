"""Boxes with named ports, and wires between them, as SVG."""

from __future__ import annotations

from html import escape

from ._layered_layout import Box, Layout, Wire

_ROW, _HEADER, PAD = 15.0, 34.0, 8.0
EDGE = 16.0  # around the drawing
TITLE_ROOM = 30.0
_WIDEST = 1500.0  # what is made to fit into a notebook

# What is colored, how, on light and on dark paper.
_COLORS = [
    ("", "fill", "#1f2328", "#e6ebf1"),
    (".paper", "fill", "#fff", "#161b22"),
    (".box", "fill", "#f6f8fa", "#1f2630"),
    (".box", "stroke", "#57606a", "#8b98a8"),
    (".inner", "fill", "#eef4fc", "#16263d"),
    (".inner", "stroke", "#2f6db5", "#6cb0ff"),
    (".header", "fill", "#e4e9ee", "#2d3743"),
    (".inner+.header", "fill", "#d3e3f7", "#1f3c63"),
    (".kind", "fill", "#57606a", "#a9b5c2"),
    (".free", "fill", "#69727c", "#95a1ad"),
    (".end", "fill", "#fff", "#161b22"),
    (".end", "stroke", "#57606a", "#8b98a8"),
    (".wire", "stroke", "#57606a", "#9aa7b5"),
    (".back", "stroke", "#b35900", "#f0943e"),
    (".dot", "fill", "#57606a", "#9aa7b5"),
    ("g.w:hover .wire", "stroke", "#d1242f", "#ff7b72"),
    (".link", "fill", "#2f6db5", "#6cb0ff"),
    (".input", "stroke", "#2f6db5", "#6cb0ff"),
    (".output", "stroke", "#2e8540", "#5fd573"),
]

_LOOK = """
.shd{font-family:system-ui,-apple-system,"Segoe UI",Roboto,Helvetica,Arial,sans-serif;font-size:11px}
.shd .box{stroke-width:1}
.shd .inner{stroke-width:1.4}
.shd .name{font-weight:600;font-size:12px}
.shd .kind{font-size:10px}
.shd .wire{fill:none;stroke-width:1.3}
.shd .hit{fill:none;stroke:transparent;stroke-width:8}
.shd g.w:hover .wire{stroke-width:2.4}
.shd a{cursor:pointer}
.shd a:hover .inner{stroke-width:2.4}
.shd .title{font-size:13px;font-weight:600}
.shd .level:target{display:inline}
.shd:has(.level:target) .root:not(:target){display:none}
"""


def _colors(dark: bool, *pages: str) -> str:
    """Rules for the colors, on all pages or on those that a selector finds."""
    rules = []
    for name, what, *colors in _COLORS:
        where = ",".join(f"{page}.shd {name}".strip() for page in pages or ("",))
        rules.append(f"{where}{{{what}:{colors[dark]}}}")
    return "\n".join(rules)


# Plain colors first: not every program that reads SVG knows variables. Then the reader's wish; and pages that have a
# switch of their own, notebooks and the documentation's, know better.
_STYLE = f"""{_LOOK}{_colors(False)}
@media (prefers-color-scheme:dark) {{
{_colors(True)}
}}
{_colors(False, "[data-jp-theme-light=true] ", "body[data-theme=light] ")}
{_colors(True, "[data-jp-theme-light=false] ", "body[data-theme=dark] ", "body.vscode-dark ")}
"""


def document(body: str, width: float, height: float, title: str) -> str:
    """Returns a whole SVG document around a drawing of a size, with a title for those who cannot see it."""
    # A very wide picture would be too small to read in a notebook: it scrolls.
    fit = ' style="max-width:100%;height:auto"' if width < _WIDEST else ""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" class="shd" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="0 0 {width:.0f} {height:.0f}"{fit} role="img" aria-label="{escape(title)}">\n'
        f"<style>{_STYLE}</style>\n"
        f'<rect class="paper" width="100%" height="100%"/>\n{body}\n</svg>\n'
    )


def text_width(text: str, size: float = 11.0) -> float:
    """Returns about how wide a text is, generously: nobody can measure here what font there will be."""
    narrow = sum(c in "fijlrt.,:;|!'()[] " for c in text)
    wide = sum(c in "mwMW@" or ord(c) > 0x2000 for c in text)
    return size * (0.6 * (len(text) - narrow - wide) + 0.38 * narrow + 0.95 * wide)


Row = tuple[str, str, bool]  # text, what pointing at it says, whether it leads anywhere


class PortBox:
    """A box with a header and rows of ports on both sides.

    Args:
        name: What the header says.
        kind: The line below it, "" for none.
        left: Rows of the left side.
        right: Rows of the right side.
        link: What a click leads to, "" for nothing.
    """

    def __init__(self, name: str, kind: str, left: list[Row], right: list[Row], link: str = ""):
        self._name, self._kind, self._left, self._right, self._link = name, kind, left, right, link
        names = [max((text_width(row[0]) for row in rows), default=0.0) for rows in (left, right)]
        header = max(text_width(name, 12.5), text_width(kind, 10) + 14)
        rows = max(len(left), len(right))
        self.box = Box(
            max(sum(names) + 3.5 * PAD, header + 2 * PAD, 70.0),
            _HEADER + _ROW * rows + (5.0 if rows else 0.0),
            [_HEADER + _ROW * (k + 0.5) + 2 for k in range(len(left))],
            [_HEADER + _ROW * (k + 0.5) + 2 for k in range(len(right))],
        )

    def draw(self) -> str:
        """Returns its SVG."""
        box = self.box
        x, y, width, height = box.x, box.y, box.width, box.height
        frame = f'x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" rx="4"'
        style = "box inner" if self._link else "box"
        parts = [
            f'<rect class="{style}" {frame} height="{height:.1f}"/>',
            f'<path class="header" d="M{x + 0.7:.1f} {y + _HEADER - 3:.1f}V{y + 4:.1f}q0 -3.3 3.3 -3.3h{width - 8:.1f}'
            f'q3.3 0 3.3 3.3V{y + _HEADER - 3:.1f}z"/>',
        ]
        middle = x + width / 2
        place = f'x="{middle:.1f}" y="{y + 14:.1f}" text-anchor="middle"'
        parts.append(f'<text class="name" {place}>{escape(self._name)}</text>')
        if self._kind:
            more = " \u2295" if self._link else ""
            place = f'x="{middle:.1f}" y="{y + 26:.1f}" text-anchor="middle"'
            parts.append(f'<text class="kind" {place}>{escape(self._kind)}{more}</text>')
        for rows, offsets, at, anchor in (
            (self._left, box.inputs, x + PAD, "start"),
            (self._right, box.outputs, x + width - PAD, "end"),
        ):
            for (text, title, used), offset in zip(rows, offsets):
                kind = "" if used else ' class="free"'
                tip = f"<title>{escape(title)}</title>" if title != text else ""
                place = f'x="{at:.1f}" y="{y + offset + 4:.1f}" text-anchor="{anchor}"'
                parts.append(f"<text{kind} {place}>{escape(text)}{tip}</text>")
        text = "".join(parts)
        return f'<a href="{self._link}">{text}</a>' if self._link else f"<g>{text}</g>"


def draw_boxes(boxes: list, wires: list[Wire], titles: list[str]) -> tuple[str, float, float]:
    """Places boxes, each with a `box` and a `draw()`, and returns the SVG of them and of their wires, and its size."""
    layout = Layout([one.box for one in boxes], wires)
    parts = [draw_wire(wire, title, layout) for wire, title in zip(wires, titles)]
    parts += [f'<circle class="dot" cx="{x:.1f}" cy="{y:.1f}" r="2.4"/>' for x, y in layout.dots]
    parts += [one.draw() for one in boxes]
    drawing = "\n".join(parts)
    return (
        f'<g transform="translate({EDGE} {TITLE_ROOM + 6})">\n{drawing}\n</g>',
        layout.width + 2 * EDGE,
        layout.height + TITLE_ROOM + 6 + EDGE,
    )


def draw_wire(wire: Wire, title: str, layout: Layout) -> str:
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
