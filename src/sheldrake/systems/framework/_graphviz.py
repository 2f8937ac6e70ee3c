"""Pictures of systems as Graphviz text.

Text only, for whoever has Graphviz; `visualization.DrawDiagram` draws without it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sheldrake.systems.framework._index import PortDataType

if TYPE_CHECKING:
    from sheldrake.systems.framework._declarations import InputDeclaration, OutputDeclaration
    from sheldrake.systems.framework._diagram import Diagram
    from sheldrake.systems.framework._system import System


class GraphvizFragment:
    """A piece of a picture: its text, and the nodes that edges to its ports go to."""

    def __init__(self, input_ports: list[str], output_ports: list[str], fragments: list[str]):
        self.input_ports, self.output_ports, self.fragments = input_ports, output_ports, fragments


class GraphvizFragmentParams:
    """What `DoGetGraphvizFragment` is given: how deep to draw, options, a node's name, and what its header says."""

    def __init__(self, max_depth: int, options: dict[str, str], node_id: str, header_lines: list[str]):
        self.max_depth, self.options, self.node_id, self.header_lines = max_depth, options, node_id, header_lines


class Graphviz:
    """The part of SystemBase that draws it."""

    GraphvizFragment = GraphvizFragment
    GraphvizFragmentParams = GraphvizFragmentParams

    def GetGraphvizString(self: Any, max_depth: int | None = None, options: dict[str, str] | None = None) -> str:
        """The system as a Graphviz "digraph"; diagrams deeper than `max_depth` are drawn as boxes."""
        fragment = self.GetGraphvizFragment(max_depth, options)
        return f"digraph _{self._system_id} {{\nrankdir=LR\n{''.join(fragment.fragments)}}}\n"

    def GetGraphvizFragment(self: Any, max_depth: int | None = None, options: dict[str, str] | None = None) -> Any:
        """The system as a piece of a picture.

        Args:
            max_depth: Diagrams deeper than this are drawn as boxes; None: none are.
            options: `{"split": "I/O"}` draws input and output apart; `{"a/b/split": "I/O"}` those of subsystem a/b.
        """
        header = [f"<B>{escape(self._class_label())}</B>"]
        if self.get_name():
            header.append(f"name={escape(self.get_name())}")
        depth = 2**31 - 1 if max_depth is None else int(max_depth)
        return self.DoGetGraphvizFragment(
            GraphvizFragmentParams(depth, dict(options or {}), f"s{self._system_id}", header)
        )

    def _class_label(self: Any) -> str:
        name = self.GetSystemType()
        return type(self).__name__ if name.startswith("sheldrake.") else name

    def DoGetGraphvizFragment(self: Any, params: Any) -> Any:
        """Draws the system; may be overridden."""
        if self._subsystems() is not None and params.max_depth > 0:
            return _diagram(self, params)
        return _box(self, params)


def escape(text: str) -> str:
    """`text` for an HTML-like label."""
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def _box(system: System, params: GraphvizFragmentParams) -> GraphvizFragment:
    inputs, outputs = ([_label(port) for port in ports] for ports in (system._inputs, system._outputs))
    node, most = params.node_id, max(len(inputs), len(outputs))
    if params.options.get("split") == "I/O":
        text = _table(f"{node}in", params, inputs, None, most) + _table(f"{node}out", params, None, outputs, most)
        return GraphvizFragment(
            [f"{node}in:u{i}" for i in range(len(inputs))], [f"{node}out:y{j}" for j in range(len(outputs))], text
        )
    text = _table(node, params, inputs, outputs, most)
    return GraphvizFragment(
        [f"{node}:u{i}" for i in range(len(inputs))], [f"{node}:y{j}" for j in range(len(outputs))], text
    )


def _label(port: InputDeclaration | OutputDeclaration) -> str:
    """A port's name, grey if it carries nothing."""
    empty = port.data_type == PortDataType.kVectorValued and port.size == 0
    return f'<FONT COLOR="grey">{escape(port.name)}</FONT>' if empty else escape(port.name)


def _table(
    node: str, params: GraphvizFragmentParams, inputs: list | None, outputs: list | None, most: int
) -> list[str]:
    """A box with these ports; the only port on a side is as high as `most` ports."""
    rows = max(len(inputs or ()), len(outputs or ()))
    header = "<BR/>\n".join(params.header_lines)
    text = [
        f"{node} [shape=none, border=0, label=<\n"
        f'<TABLE BORDER="0" CELLSPACING="0">\n<TR><TD BORDER="1" COLSPAN="2">\n{header}\n</TD></TR>\n'
    ]
    for row in range(rows):
        text.append("<TR>\n")
        text += _cell("u", "BL", inputs, row, rows, most)
        text += _cell("y", "BR", outputs, row, rows, most)
        text.append("</TR>\n")
    return [*text, "</TABLE>\n>];\n"]


def _cell(letter: str, sides: str, names: list[str] | None, row: int, rows: int, most: int) -> list[str]:
    if names is None:  # drawn elsewhere
        if row:
            return []
        return [
            f'<TD BORDER="1" STYLE="dotted" COLOR="cadetblue" ROWSPAN="{rows}">\n'
            '<FONT COLOR="cadetblue">(split)</FONT>\n</TD>\n'
        ]
    if row < len(names):
        span = f'ROWSPAN="{most}"' if len(names) == 1 and most > 1 else ""
        return [f'<TD PORT="{letter}{row}" BORDER="1" {span}>{names[row]}</TD>\n']
    if row == len(names) and len(names) != 1:
        return [f'<TD PORT="{letter}{row}" BORDER="1" COLOR="grey" ROWSPAN="{rows - row}" SIDES="{sides}"></TD>\n']
    return []


def _diagram(system: Diagram, params: GraphvizFragmentParams) -> GraphvizFragment:
    node, number = params.node_id, system._system_id
    header = "<BR/>\n".join(params.header_lines)
    text = [
        f"subgraph cluster{number}diagram {{\ncolor=black\nconcentrate=true\n"
        f'label=<<TABLE BORDER="0"><TR><TD>\n{header}\n</TD></TR></TABLE>>;\n'
    ]
    text += _ports(node, "in", "input ports", "blue", [_label(port) for port in system._inputs])
    text += _ports(node, "out", "output ports", "green", [_label(port) for port in system._outputs])
    text.append(f'subgraph cluster{number}subsystems {{\ncolor=white\nlabel=""\n')
    inside = [
        s.GetGraphvizFragment(params.max_depth - 1, _below(s.get_name(), params.options)) for s in system._subsystems()
    ]
    for fragment in inside:
        text += fragment.fragments
    for (a, i), (b, j) in sorted(system._wires.items()):
        text.append(f"{inside[b].output_ports[j]}:e -> {inside[a].input_ports[i]}:w\n")
    for (a, i), k in sorted(system._exported_inputs.items()):
        text.append(f"{node}in:{k}:e -> {inside[a].input_ports[i]}:w [color=blue];\n")
    for k, (b, j) in enumerate(system._exported_outputs):
        text.append(f"{inside[b].output_ports[j]}:e -> {node}out:{k}:w [color=green];\n")
    return GraphvizFragment(
        [f"{node}in:{i}" for i in range(len(system._inputs))],
        [f"{node}out:{j}" for j in range(len(system._outputs))],
        [*text, "}\n}\n"],
    )


def _below(name: str, options: dict[str, str]) -> dict[str, str]:
    """The options for the subsystem of this name, whose path they begin with."""
    return {key[len(name) + 1 :]: value for key, value in options.items() if key.startswith(f"{name}/")}


def _ports(node: str, side: str, label: str, color: str, names: list[str]) -> list[str]:
    if not names:
        return []
    return [
        f'subgraph cluster{node}{side} {{\nrank=same\ncolor=lightgrey\nstyle=filled\nlabel="{label}"\n'
        f'{node}{side} [shape=none, label=<\n<TABLE BORDER="0" COLOR="{color}" CELLSPACING="3" STYLE="rounded">\n',
        *(f'<TR><TD BORDER="1" PORT="{k}">{name}</TD></TR>\n' for k, name in enumerate(names)),
        "</TABLE>\n>];\n}\n",
    ]
