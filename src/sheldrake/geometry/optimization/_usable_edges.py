"""Edges of a directed graph that some path from a source to a target may take."""

from __future__ import annotations

from collections.abc import Collection, Sequence

Ends = tuple[int, int]
_MANY = 1000  # edges from which on each is not looked at on its own, which takes a time that grows with their square


class _Graph:
    def __init__(self, edges: Sequence[Ends]) -> None:
        self._after: dict[int, list[int]] = {}
        for u, v in edges:
            self._after.setdefault(u, []).append(v)

    def reached(self, start: int) -> set[int]:
        """The vertices there are ways to, itself included."""
        return set(self._search(start, None, ()))

    def way(self, start: int, end: int, spared: Collection[int]) -> list[int]:
        """The vertices of a shortest way that spares some; none if there is no such way."""
        before = self._search(start, end, spared)
        if end not in before:
            return []
        out = [end]
        while out[-1] != start:
            out.append(before[out[-1]])
        return out

    def _search(self, start: int, end: int | None, spared: Collection[int]) -> dict[int, int]:
        """The vertices that are reached until one is found, each with the one before it."""
        if start in spared or end in spared:
            return {}
        before, waiting = {start: start}, [start]
        for v in waiting:
            if v == end:
                break
            for other in self._after.get(v, ()):
                if other not in before and other not in spared:
                    before[other] = v
                    waiting.append(other)
        return before


def usable(source: int, target: int, edges: Sequence[Ends]) -> list[bool]:
    """Whether a path from source to target, another vertex, that visits none twice may take an edge, as far as known.

    None can take an edge if no way to its start spares its end, or no way on spares its start, or if all of both ways
    pass the same vertex. Of graphs of many edges only those go that cannot be reached, or from which nothing is.

    Args:
        source, target: Where paths begin and end.
        edges: Where each begins and ends.
    """
    graph, reverse = _Graph(edges), _Graph([(v, u) for u, v in edges])
    ahead, behind = graph.reached(source), reverse.reached(target)

    def may_be_taken(u: int, v: int) -> bool:
        there, onward = graph.way(source, u, (v, target)), graph.way(v, target, (u, source))
        if not (there and onward):
            return False
        shared = set(there).intersection(onward)
        return all([graph.way(source, u, (v, target, w)) or graph.way(v, target, (u, source, w)) for w in shared])

    found = [u in ahead and v in behind for u, v in edges]
    return found if len(edges) > _MANY else [may and may_be_taken(*ends) for may, ends in zip(found, edges)]
