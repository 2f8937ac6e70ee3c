"""Pictures of systems as Graphviz text."""

from __future__ import annotations

from typing import Any


class GraphvizFragment:
    """A piece of a picture: its text, and the nodes that edges to its ports go to."""

    def __init__(self, input_ports: list[str], output_ports: list[str], fragments: list[str]):
        self.input_ports, self.output_ports, self.fragments = input_ports, output_ports, fragments


class GraphvizFragmentParams:
    """What `DoGetGraphvizFragment` is given: how deep to draw, options, a node's name, and what its header says."""

    def __init__(self, max_depth: int, options: dict[str, str], node_id: str, header_lines: list[str]):
        self.max_depth, self.options, self.node_id, self.header_lines = max_depth, options, node_id, header_lines


class Graphviz:
    """The part of System that draws it."""

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
            options: `{"split": "I/O"}` draws input and output apart.
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


def _box(system: Any, params: GraphvizFragmentParams) -> GraphvizFragment:
    inputs = [port.name for port in system._inputs]
    outputs = [port.name for port in system._outputs]
    node = params.node_id
    if params.options.get("split") == "I/O":
        text = _table(f"{node}in", params, inputs, None) + _table(f"{node}out", params, None, outputs)
        return GraphvizFragment(
            [f"{node}in:u{i}" for i in range(len(inputs))], [f"{node}out:y{j}" for j in range(len(outputs))], text
        )
    text = _table(node, params, inputs, outputs)
    return GraphvizFragment(
        [f"{node}:u{i}" for i in range(len(inputs))], [f"{node}:y{j}" for j in range(len(outputs))], text
    )


def _table(node: str, params: GraphvizFragmentParams, inputs: list | None, outputs: list | None) -> list[str]:
    rows = max(len(inputs or ()), len(outputs or ()), 1)
    header = "<BR/>\n".join(params.header_lines)
    text = [
        f"{node} [shape=none, border=0, label=<\n"
        f'<TABLE BORDER="0" CELLSPACING="0">\n<TR><TD BORDER="1" COLSPAN="2">\n{header}\n</TD></TR>\n'
    ]
    for row in range(rows):
        text.append("<TR>\n")
        text += _cell("u", "BL", inputs, row, rows)
        text += _cell("y", "BR", outputs, row, rows)
        text.append("</TR>\n")
    return [*text, "</TABLE>\n>];\n"]


def _cell(letter: str, sides: str, names: list[str] | None, row: int, rows: int) -> list[str]:
    if names is None:  # drawn elsewhere
        if row:
            return []
        return [
            f'<TD BORDER="1" STYLE="dotted" COLOR="cadetblue" ROWSPAN="{rows}">\n'
            '<FONT COLOR="cadetblue">(split)</FONT>\n</TD>\n'
        ]
    if row < len(names):
        span = f'ROWSPAN="{rows}"' if len(names) == 1 and rows > 1 else ""
        return [f'<TD PORT="{letter}{row}" BORDER="1" {span}>{escape(names[row])}</TD>\n']
    if row == len(names) and len(names) != 1:
        return [f'<TD PORT="{letter}{row}" BORDER="1" COLOR="grey" ROWSPAN="{rows - row}" SIDES="{sides}"></TD>\n']
    return []


def _diagram(system: Any, params: GraphvizFragmentParams) -> GraphvizFragment:
    node, number = params.node_id, system._system_id
    header = "<BR/>\n".join(params.header_lines)
    text = [
        f"subgraph cluster{number}diagram {{\ncolor=black\nconcentrate=true\n"
        f'label=<<TABLE BORDER="0"><TR><TD>\n{header}\n</TD></TR></TABLE>>;\n'
    ]
    text += _ports(node, "in", "input ports", "blue", [port.name for port in system._inputs])
    text += _ports(node, "out", "output ports", "green", [port.name for port in system._outputs])
    text.append(f'subgraph cluster{number}subsystems {{\ncolor=white\nlabel=""\n')
    options = {key: value for key, value in params.options.items() if key != "split"}
    inside = [s.GetGraphvizFragment(params.max_depth - 1, options) for s in system._subsystems()]
    for fragment in inside:
        text += fragment.fragments
    for (a, i), (b, j) in sorted(system._wires.items()):
        text.append(f"{inside[b].output_ports[j]}:e -> {inside[a].input_ports[i]}:w\n")
    for (a, i), k in system._exported_inputs.items():
        text.append(f"{node}in:{k}:e -> {inside[a].input_ports[i]}:w [color=blue];\n")
    for k, (b, j) in enumerate(system._exported_outputs):
        text.append(f"{inside[b].output_ports[j]}:e -> {node}out:{k}:w [color=green];\n")
    return GraphvizFragment(
        [f"{node}in:{i}" for i in range(len(system._inputs))],
        [f"{node}out:{j}" for j in range(len(system._outputs))],
        [*text, "}\n", "}\n"],
    )


def _ports(node: str, side: str, label: str, color: str, names: list[str]) -> list[str]:
    if not names:
        return []
    rows = "".join(f'<TR><TD BORDER="1" PORT="{k}">{escape(name)}</TD></TR>\n' for k, name in enumerate(names))
    return [
        f'subgraph cluster{node}{side} {{\nrank=same\ncolor=lightgrey\nstyle=filled\nlabel="{label}"\n'
        f'{node}{side} [shape=none, label=<\n<TABLE BORDER="0" COLOR="{color}" CELLSPACING="3" STYLE="rounded">\n'
        f"{rows}</TABLE>\n>];\n}}\n"
    ]
