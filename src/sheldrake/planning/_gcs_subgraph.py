"""Regions with a Bézier curve in each, the vertices of a graph, and the edges between them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from sheldrake.common._overloads import overloaded
from sheldrake.geometry.optimization import CartesianProduct, ConvexSet, HPolyhedron
from sheldrake.geometry.optimization._gcs_elements import COSTS, constraints
from sheldrake.planning._gcs_parts import (
    Part,
    add_derivative_bounds,
    add_velocity_bounds,
    checked_bounds,
    energy_weights,
    placeholders,
    renamed,
    require_higher,
    weights,
)
from sheldrake.planning._gcs_pieces import (
    derivative_matrix,
)
from sheldrake.solvers import (
    L2NormCost,
    LinearCost,
    QuadraticCost,
)
from sheldrake.solvers._functions.bindings import bind
from sheldrake.symbolic import Variable


class Subgraph(Part):
    """Regions and the edges between those that meet; made by `AddRegions`."""

    @classmethod
    def _make(
        cls,
        traj: Any,
        regions: list[ConvexSet],
        pairs: list[tuple[int, int]],
        order: int,
        h_min: float,
        h_max: float,
        name: str,
        offsets: list | None,
    ) -> Subgraph:
        out = cls.__new__(cls)
        out._traj, out._regions, out._order, out._name = traj, [s.Clone() for s in regions], int(order), name
        n = traj.num_positions()
        for region in regions:
            if region.ambient_dimension() != n:
                raise RuntimeError(f"AddRegions(): a region has dimension {region.ambient_dimension()}, expected {n}.")
        time = HPolyhedron.MakeBox([h_min], [h_max])
        gcs = traj.graph_of_convex_sets()
        out._vertices = []
        for i, region in enumerate(out._regions):
            product = CartesianProduct([region] * (order + 1) + [time])
            out._vertices.append(gcs.AddVertex(product, f"{name}: Region{i}"))
        out._edges = []
        for k, (i, j) in enumerate(pairs):
            u, v = out._vertices[i], out._vertices[j]
            edge = gcs.AddEdge(u, v, f"{u.name()} -> {v.name()}")
            out._edges.append(edge)
            out._join(edge, None if offsets is None else offsets[k])
        out._x, out._t = placeholders("x", n, order), Variable("t")
        out._edge_names()
        return out

    _vertices: list[Any]

    def name(self) -> str:
        """Returns its name."""
        return self._name

    def order(self) -> int:
        """Returns the order of its curves."""
        return self._order

    def size(self) -> int:
        """Returns the number of regions."""
        return len(self._vertices)

    def regions(self) -> list[ConvexSet]:
        """Returns the regions."""
        return list(self._regions)

    def Vertices(self) -> list[Any]:
        """Returns the vertices, one for each region."""
        return list(self._vertices)

    def vertex_duration(self) -> Variable:
        """Returns what stands for the duration of a curve in `AddVertexCost` and `AddVertexConstraint`."""
        return self._t

    def vertex_control_points(self) -> np.ndarray:
        """Returns what stands for the control points of a curve, columns."""
        return self._x.copy()

    def _of_vertex(self, vertex: Any) -> dict[int, tuple[Variable, Variable]]:
        stand_ins = [*self._x.ravel(order="F"), self._t]
        return {p.get_id(): (p, v) for p, v in zip(stand_ins, vertex.x())}

    @overloaded(*COSTS)
    def AddVertexCost(self, what: Any, use_in_transcription: Iterable) -> None:
        """Adds a cost to each vertex, written in `vertex_duration` and `vertex_control_points`.

        Raises:
            RuntimeError: it has other variables.
        """
        for vertex in self._vertices:
            vertex.AddCost(renamed(what, self._of_vertex(vertex)), use_in_transcription)

    @overloaded(*constraints("e"))
    def AddVertexConstraint(self, what: Any, use_in_transcription: Iterable) -> None:
        """Adds a constraint to each vertex, written in `vertex_duration` and `vertex_control_points`.

        Raises:
            RuntimeError: it has other variables.
        """
        for vertex in self._vertices:
            vertex.AddConstraint(renamed(what, self._of_vertex(vertex)), use_in_transcription)

    def AddTimeCost(self, weight: float = 1.0) -> None:
        """Adds the duration of each curve, times a weight, to the cost."""
        for vertex in self._vertices:
            cost = LinearCost(np.array([float(weight)]), 0.0)
            vertex.AddCost(bind(LinearCost, cost, vertex.x()[-1:]))

    def _steps(self, vertex: Any) -> list[np.ndarray]:
        """Variables of neighbouring control points, the later ones first."""
        points = self._points(vertex.x(), self._order)
        return [np.concatenate((points[:, k + 1], points[:, k])) for k in range(self._order)]

    def AddPathLengthCost(self, weight_matrix: Any = 1.0, *, weight: Any = None) -> None:
        """Adds the lengths of steps between control points, times a weight (or a matrix), to the cost.

        Raises:
            RuntimeError: the order is zero, or the matrix has another shape.
        """
        W = weights("AddPathLengthCost", self._traj.num_positions(), weight_matrix if weight is None else weight)
        self._require_order("Path length cost is", 1)
        for vertex in self._vertices:
            for vars in self._steps(vertex):
                cost = L2NormCost(np.hstack((W, -W)), np.zeros(len(W)))
                vertex.AddCost(bind(L2NormCost, cost, vars))

    def AddPathEnergyCost(self, weight_matrix: Any = 1.0, *, weight: Any = None) -> None:
        """Adds the squares of steps between control points to the cost: step' W step / 2, or |w step|^2 for a number w.

        Raises:
            RuntimeError: the order is zero, or the matrix has another shape.
        """
        given = weight_matrix if weight is None else weight
        W = energy_weights("AddPathEnergyCost", self._traj.num_positions(), given)
        self._require_order("Path energy cost is", 1)
        for vertex in self._vertices:
            for vars in self._steps(vertex):
                Q = np.block([[W, -W], [-W, W]])
                vertex.AddCost(bind(QuadraticCost, QuadraticCost(Q, np.zeros(len(Q)), 0.0), vars))

    def _require_order(self, what: str, least: int) -> None:
        if self._order < least:
            raise RuntimeError(f"{what} not defined for a set of order {self._order}.")

    def AddVelocityBounds(self, lb: Any, ub: Any) -> None:
        """Keeps velocities dq/dt of all curves between bounds.

        Raises:
            RuntimeError: the order is zero, or there is another number of bounds than of positions.
        """
        lower, upper = checked_bounds("AddVelocityBounds", self._traj.num_positions(), lb, ub)
        self._require_order("Velocity Bounds are", 1)
        D = derivative_matrix(self._order, 1)
        for vertex in self._vertices:
            x = vertex.x()
            add_velocity_bounds(vertex, D, self._points(x, self._order), x[-1], lower, upper)

    def AddNonlinearDerivativeBounds(self, lb: Any, ub: Any, derivative_order: int) -> None:
        """Keeps higher time derivatives of all curves between bounds; the relaxation takes the duration for one.

        Raises:
            RuntimeError: the derivative is no higher one, or the order is lower, or the number of bounds is another.
        """
        lower, upper = checked_bounds("AddNonlinearDerivativeBounds", self._traj.num_positions(), lb, ub)
        require_higher(derivative_order)
        if derivative_order > self._order:
            raise RuntimeError(
                f"Cannot add derivative bounds of order {derivative_order} to a set of order {self._order}."
            )
        D = derivative_matrix(self._order, derivative_order)
        for vertex in self._vertices:
            x = vertex.x()
            add_derivative_bounds(vertex, D, self._points(x, self._order), x[-1], lower, upper, derivative_order)

    def _orders(self) -> tuple[int, int]:
        return self._order, self._order

    def _require_continuity(self, derivative: int) -> None:
        if derivative > self._order:
            raise RuntimeError("Cannot add continuity constraint of order greater than the set order.")
