"""Graphs of convex sets in the language of Graphviz."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.geometry.optimization._gcs_elements import Edge, Vertex
from sheldrake.geometry.optimization._gcs_options import GcsGraphvizOptions


def graphviz(
    vertices: list[Vertex], edges: list[Edge], result: Any, options: GcsGraphvizOptions, active_path: list[Edge]
) -> str:
    """The graph; with values of a solution, and a path as dashed edges."""

    def number(value: float) -> str:
        return f"{value:.{options.precision}g}" if options.scientific else f"{value:.{options.precision}f}"

    def numbers(values: np.ndarray) -> str:
        texts = [number(v) for v in values]
        width = max((len(t) for t in texts), default=0)
        return "[" + " ".join(t.rjust(width) for t in texts) + "]"

    def node(v: Vertex) -> str:
        lines = [v.name()]
        if result is not None and options.show_vars and (x := v.GetSolution(result)) is not None:
            lines.append(f"x = {numbers(x)}")
        if result is not None and options.show_costs:
            lines.append(f"cost = {number(v.GetSolutionCost(result))}")
        text = "\n".join(lines)
        return f'v{v.id().get_value()} [label="{text}"]\n'

    def arrow(e: Edge) -> str:
        lines, color = [e.name()], ""
        if result is not None and options.show_costs:
            lines.append(f"cost = {number(e.GetSolutionCost(result))}")
        if result is not None and options.show_slacks:
            y, z = e.GetSolutionPhiXu(result), e.GetSolutionPhiXv(result)
            products = (("xu", y), ("xv", z))
            lines.append(",\n".join(f"ϕ{name} = {numbers(v)}" for name, v in products if v is not None))
        if result is not None and options.show_flows:
            flow = result.GetSolution(e.phi())
            lines.append(f"ϕ = {number(flow)}")
            # What takes no part is still to be seen.
            color = f', color="#000000{int(np.floor(min(max(flow, 0.0), 1.0) * 223.0 + 32.0)):02X}"'
        text = "\n".join(lines)
        return f'v{e.u().id().get_value()} -> v{e.v().id().get_value()} [label="{text}"{color}];\n'

    def dashes(e: Edge) -> str:
        ends = f"v{e.u().id().get_value()} -> v{e.v().id().get_value()}"
        return f'{ends} [label="{e.name()} = active", color="#ff0000", style="dashed"];\n'

    parts = [*map(node, vertices), *map(arrow, edges), *map(dashes, active_path)]
    return "digraph GraphOfConvexSets {\nlabelloc=t;\n" + "".join(parts) + "}\n"
