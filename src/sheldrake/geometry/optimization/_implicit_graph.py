"""Graphs of convex sets that grow where they are looked at."""

from __future__ import annotations

from sheldrake.common._checked import checked
from sheldrake.geometry.optimization._gcs_elements import Edge, Vertex
from sheldrake.geometry.optimization._graph_of_convex_sets import GraphOfConvexSets


@checked
class ImplicitGraphOfConvexSets:
    """A graph whose edges from a vertex are made when asked for; derived classes write `DoSuccessors(v)`."""

    def __init__(self) -> None:
        self._gcs = GraphOfConvexSets()

    def gcs(self) -> GraphOfConvexSets:
        """Returns the graph as far as it is made."""
        return self._gcs

    mutable_gcs = gcs

    def DoSuccessors(self, v: Vertex) -> list[Edge]:
        """Returns the edges from a vertex of the graph, made if they are not there yet."""
        raise NotImplementedError(f"{type(self).__name__} has no DoSuccessors().")

    def Successors(self, v: Vertex) -> list[Edge]:
        """Returns the edges from a vertex.

        Raises:
            RuntimeError: it is not of this graph.
        """
        self._gcs._require("Successors", v)
        return self.DoSuccessors(v)

    def ExpandRecursively(self, start: Vertex, max_successor_calls: int = 1000) -> None:
        """Makes all that can be reached from a vertex, with at most so many calls of `Successors`.

        Raises:
            RuntimeError: the vertex is not of this graph.
        """
        waiting, seen = [start], {id(start)}
        while waiting and max_successor_calls > 0:
            max_successor_calls -= 1
            for edge in self.Successors(waiting.pop(0)):
                if id(edge._v) not in seen:
                    seen.add(id(edge._v))
                    waiting.append(edge._v)


@checked
class ImplicitGraphOfConvexSetsFromExplicit(ImplicitGraphOfConvexSets):
    """Copies of a graph's vertices and edges, made when asked for.

    Args:
        gcs: The graph.
    """

    def __init__(self, gcs: GraphOfConvexSets):
        super().__init__()
        self._explicit = gcs
        self._copies: dict[int, Vertex] = {}
        self._originals: dict[int, Vertex] = {}
        self._expanded: set[int] = set()

    def ImplicitVertexFromExplicit(self, v_explicit: Vertex) -> Vertex:
        """Returns the copy of a vertex, made if it is not there yet.

        Raises:
            RuntimeError: the vertex is not of the given graph.
        """
        if not self._explicit.IsValid(v_explicit):
            raise RuntimeError(f"ImplicitVertexFromExplicit(): vertex {v_explicit.name()} is not in the given graph.")
        if id(v_explicit) not in self._copies:
            copy = self._gcs.AddVertexFromTemplate(v_explicit)
            self._copies[id(v_explicit)], self._originals[id(copy)] = copy, v_explicit
        return self._copies[id(v_explicit)]

    def DoSuccessors(self, v: Vertex) -> list[Edge]:
        """Returns copies of the edges from a vertex."""
        if id(v) not in self._expanded:
            self._expanded.add(id(v))
            for edge in self._originals[id(v)]._out:
                self._gcs.AddEdgeFromTemplate(v, self.ImplicitVertexFromExplicit(edge._v), edge)
        return v.outgoing_edges()
