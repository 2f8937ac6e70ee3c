"""Contexts in words, as `str()` gives them."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sheldrake.common._types import Scalar
    from sheldrake.systems.framework._context.context import Context


def _numbers(values: Iterable[Scalar]) -> str:
    values = [x.value() if hasattr(x, "value") else x for x in values]
    return " ".join(repr(x).removesuffix(".0") if isinstance(x, float) else str(x) for x in values)


def of_tree(c: Context) -> str:
    """A diagram's context: how much there is, then its leaves' contexts."""
    title = f"{c.GetSystemPathname()} Context (of a Diagram)"
    lines = [title, "-" * (len(title) + 1)]
    if n := c.num_continuous_states():
        lines.append(f"{n} total continuous states")
    if n := c.num_discrete_state_groups():
        total = sum(group.size() for group in c.get_discrete_state().get_data())
        lines.append(f"{total} total discrete states in {n} groups")
    if n := c.num_abstract_states():
        lines.append(f"{n} total abstract states")
    if n := c.num_numeric_parameter_groups():
        total = sum(c.get_numeric_parameter(i).size() for i in range(n))
        lines.append(f"{total} total numeric parameters in {n} groups")
    if n := c.num_abstract_parameters():
        lines.append(f"{n} total abstract parameters")
    node = c._store.layout.nodes[c._node]
    leaves = [c._store.context(m) for m in c._store.layout.leaves[node.first_leaf : node.last_leaf]]
    told = [of_one(leaf) for leaf in leaves if not leaf.is_stateless() or leaf.num_numeric_parameter_groups()]
    return "\n".join(["\n".join(lines) + "\n", *told])


def of_one(c: Context) -> str:
    """A leaf's context: time, state and parameters."""
    title = f"{c.GetSystemPathname()} Context"
    t = c.get_time()
    lines = [title, "-" * (len(title) + 1), f"Time: {_numbers([t])}"]
    if not c.is_stateless():
        lines.append("States:")
        if n := c.num_continuous_states():
            lines += [f"  {n} continuous states", f"    {_numbers(c.get_continuous_state_vector())}"]
        if n := c.num_discrete_state_groups():
            lines.append(f"  {n} discrete state groups with")
            for group in c.get_discrete_state().get_data():
                lines += [f"     {group.size()} states", f"       {_numbers(group)}"]
        if n := c.num_abstract_states():
            lines.append(f"  {n} abstract states")
        lines.append("")
    if c.num_numeric_parameter_groups() or c.num_abstract_parameters():
        lines.append("Parameters:")
        if n := c.num_numeric_parameter_groups():
            lines.append(f"  {n} numeric parameter groups with")
            for k in range(n):
                group = c.get_numeric_parameter(k)
                lines += [f"     {group.size()} parameters", f"       {_numbers(group)}"]
        if n := c.num_abstract_parameters():
            lines.append(f"  {n} abstract parameters")
    return "\n".join(lines) + "\n"
