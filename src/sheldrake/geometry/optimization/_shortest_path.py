"""The shortest path in a graph of convex sets as a mixed-integer convex program.

T. Marcucci, J. Umenberger, P. Parrilo and R. Tedrake, "Shortest paths in graphs of convex sets", SIAM Journal on
Optimization, 2024. Symbols are theirs: phi is the flow of an edge, y and z are the flow times the points where the edge
starts and ends.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.geometry.optimization._affine import Affine, Known, Rows
from sheldrake.geometry.optimization._gcs_elements import Edge, Element, Transcription, Vertex
from sheldrake.geometry.optimization._perspective import add_constraint, bound_cost
from sheldrake.solvers import MathematicalProgram
from sheldrake.solvers._program.parts import parts_of

if TYPE_CHECKING:
    from sheldrake.solvers._functions.bindings import BindingBase

_NEGLIGIBLE = 100.0 * np.finfo(float).eps  # A flow below this gives no point.


def total(terms: list[Affine], size: int) -> Affine:
    """The sum of affine functions of one size; zero if there are none."""
    return sum(terms, Affine.constant(np.zeros(size)))


class ShortestPathProgram:
    """The program of paths from a source to a target over some of the edges."""

    def __init__(self, source: Vertex, target: Vertex, edges: list[Edge], relaxed: bool):
        self._source, self._target, self._relaxed = source, target, relaxed
        self._kind = Transcription.kRelaxation if relaxed else Transcription.kMIP
        self.edges = [e for e in edges if e._fixed is not False and e._v is not source and e._u is not target]
        self._vertices = self._found_vertices()
        self._in: dict[int, list[Edge]] = {id(v): [] for v in self._vertices}
        self._out: dict[int, list[Edge]] = {id(v): [] for v in self._vertices}
        for e in self.edges:
            self._in[id(e._v)].append(e)
            self._out[id(e._u)].append(e)
        self.prog = MathematicalProgram()
        self._rows = Rows(self.prog, has_signs=True)
        self.phi: dict[int, Any] = {}
        for e in self.edges:
            self._add_edge(e)
        for v in self._vertices:
            self._add_vertex(v)

    def _found_vertices(self) -> list[Vertex]:
        """The vertices at the ends of its edges, the source and the target."""
        found = {id(v): v for e in self.edges for v in (e._u, e._v)}
        return list({id(self._source): self._source, **found, id(self._target): self._target}.values())

    def _flow(self, e: Edge) -> Affine:
        return Affine.of([self.phi[id(e)]])

    def _add_edge(self, e: Edge) -> None:
        prog = self.prog
        phi = prog.NewContinuousVariables(1, e._phi.get_name())[0] if self._relaxed else e._phi
        self.phi[id(e)] = phi
        prog.AddDecisionVariables(np.array([phi, *e._y, *e._z], dtype=object))
        if self._relaxed:
            prog.AddBoundingBoxConstraint(0.0, 1.0, phi)
        if e._fixed:
            prog.AddBoundingBoxConstraint(1.0, 1.0, phi)
        flow, y, z = self._flow(e), Affine.of(e._y), Affine.of(e._z)
        for vertex, point in ((e._u, y), (e._v, z)):
            if len(point):
                self._rows.contain(vertex._set, point, flow)
            for constraint in vertex._constraints_in(self._kind):
                self._constrain(vertex, constraint, point, flow)
        both = Affine.of(np.concatenate((e._y, e._z)))
        for constraint in e._constraints_in(self._kind):
            self._constrain(e, constraint, both, flow)
        self._add_costs(e, both, flow)

    def _constrain(self, element: Element, constraint: BindingBase, x: Affine, flow: Affine) -> None:
        """Adds a constraint of an element, whose variables times the flow are x."""
        rows, own = self._rows, _of_binding(element, constraint, x)
        rows.alike(constraint.evaluator(), (own, flow), lambda: add_constraint(rows, constraint, own, flow))

    def _add_costs(self, element: Element, x: Affine, flow: Affine) -> None:
        for cost, ell in element._costs_in(self._kind):
            self.prog.AddDecisionVariables(np.array([ell], dtype=object))
            self.prog.AddLinearCost(np.ones(1), 0.0, np.array([ell], dtype=object))
            of = _of_binding(element, cost, x), flow, Affine.of([ell])
            self._rows.alike(cost.evaluator(), of, functools.partial(bound_cost, self._rows, cost, *of))

    def _add_vertex(self, v: Vertex) -> None:
        inward, outward, n = self._in[id(v)], self._out[id(v)], v.ambient_dimension()
        flow_in, flow_out = (total([self._flow(e) for e in edges], 1) for edges in (inward, outward))
        z_in = total([Affine.of(e._z) for e in inward], n)
        y_out = total([Affine.of(e._y) for e in outward], n)
        one = Affine.constant(1.0)
        if v is self._source:
            self._rows.equal(flow_out - one)
            self._add_costs(v, y_out, flow_out)
            return
        if v is self._target:
            self._rows.equal(flow_in - one)
        elif inward or outward:
            self._rows.equal(flow_in - flow_out)
            if outward:
                self._rows.linear(np.array([-np.inf]), flow_out, np.ones(1))
            if n:
                self._rows.equal(z_in - y_out)
            self._forbid_turning_back(v)
        self._add_costs(v, z_in, flow_in)

    def _forbid_turning_back(self, v: Vertex) -> None:
        """Of two edges between the same vertices, there and back, a path takes at most one."""
        inward, n = self._in[id(v)], v.ambient_dimension()
        for back in self._out[id(v)]:
            for there in inward:
                if there._u is not back._v:
                    continue
                others = [e for e in inward if e is not there]
                flow = total([self._flow(e) for e in others], 1) - self._flow(back)
                self._rows.linear(np.zeros(1), flow, np.array([np.inf]))
                if n:
                    z = total([Affine.of(e._z) for e in others], n)
                    self._rows.contain(v._set, z - Affine.of(back._y), flow)

    def values(self, x: np.ndarray) -> dict[Any, float]:
        """What variables of edges and vertices are, from the values of all decision variables."""
        value = dict(zip(self.prog.decision_variables(), x))
        out = {v: number for v, number in value.items()}
        for e in self.edges:
            out[e._phi] = value[self.phi[id(e)]]
        for v in self._vertices:
            edges, side = (self._out[id(v)], "_y") if v is self._source else (self._in[id(v)], "_z")
            flow = sum(out[e._phi] for e in edges)
            sums = [sum(value[getattr(e, side)[i]] for e in edges) for i in range(v.ambient_dimension())]
            out.update({var: (s / flow if flow > _NEGLIGIBLE else np.nan) for var, s in zip(v._x, sums)})
        return out


def _of_binding(element: Element, binding: BindingBase, x: Affine) -> Affine:
    """The rows of an element's variables that a binding has, in its order."""
    return x[[element._places[v._id] for v in binding._list]]


def restriction(path: list[Edge], known: Known) -> MathematicalProgram:
    """The convex program of one path (or of any edges that are taken together).

    Args:
        path: The edges.
        known: What was added for the vertices of other paths.
    """
    prog = MathematicalProgram()
    rows, kind, bindings = Rows(prog, known=known), Transcription.kRestriction, parts_of(prog).bindings
    vertices = {id(v): v for e in path for v in (e._u, e._v)}.values()
    for v in vertices:
        prog.AddDecisionVariables(v._x)
        if v.ambient_dimension():
            rows.contain(v._set, Affine.of(v._x), Affine.constant(1.0))
    for element in (*vertices, *path):
        for constraint in element._constraints_in(kind):
            bindings.add(constraint)
        for cost, _ in element._costs_in(kind):
            bindings.add(cost)
    return prog
