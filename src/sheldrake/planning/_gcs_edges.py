"""Edges between the regions of two subgraphs."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.geometry.optimization import ConvexSet, HPolyhedron, Point
from sheldrake.planning._gcs_parts import (
    Part,
    add_derivative_bounds,
    add_velocity_bounds,
    checked_bounds,
    require_higher,
    zero,
)
from sheldrake.planning._gcs_pieces import (
    derivative_matrix,
)
from sheldrake.planning._gcs_subgraph import Subgraph
from sheldrake.solvers import (
    LinearConstraint,
)
from sheldrake.solvers._functions.bindings import bind


class EdgesBetweenSubgraphs(Part):
    """Edges from the regions of one subgraph to those of another; made by `AddEdges`."""

    @classmethod
    def _make(
        cls,
        traj: Any,
        u: Subgraph,
        v: Subgraph,
        pairs: list[tuple[int, int]],
        offsets: list | None,
        subspace: ConvexSet | None,
    ) -> EdgesBetweenSubgraphs:
        out = cls.__new__(cls)
        out._traj, out._from, out._to = traj, u, v
        out._edges = []
        for k, (i, j) in enumerate(pairs):
            a, b = u._vertices[i], v._vertices[j]
            edge = traj.graph_of_convex_sets().AddEdge(a, b, f"{a.name()} -> {b.name()}")
            out._edges.append(edge)
            out._join(edge, None if offsets is None else offsets[k])
            if subspace is not None:
                out._keep_in(edge, subspace)
        out._edge_names()
        return out

    def _orders(self) -> tuple[int, int]:
        return self._from._order, self._to._order

    def _keep_in(self, edge: Any, subspace: ConvexSet) -> None:
        last = self._points(edge.xu(), self._from._order)[:, -1]
        if isinstance(subspace, Point):
            edge.AddConstraint(zero(np.eye(len(last)), subspace.x(), last))
        elif isinstance(subspace, HPolyhedron):
            c = LinearConstraint(subspace.A(), np.full(subspace.b().size, -np.inf), subspace.b())
            edge.AddConstraint(bind(LinearConstraint, c, last))
        else:
            raise RuntimeError("Subspace must be a Point or HPolyhedron.")

    def _ends(self, derivative: int) -> list[tuple[int, np.ndarray, bool]]:
        """Order, row of the derivative matrix, shape (1, order + 1), and whether it is the first of the two curves."""
        out = []
        for order, row, first in ((self._from._order, slice(-1, None), True), (self._to._order, slice(1), False)):
            if order >= derivative:
                out.append((order, derivative_matrix(order, derivative)[row], first))
        return out

    def AddVelocityBounds(self, lb: Any, ub: Any) -> None:
        """Keeps the velocity where the curves meet between bounds.

        Raises:
            RuntimeError: both orders are zero, or there is another number of bounds than of positions.
        """
        lower, upper = checked_bounds("AddVelocityBounds", self._traj.num_positions(), lb, ub)
        ends = self._ends(1)
        if not ends:
            raise RuntimeError("Cannot add velocity bounds to subgraph edges where both subgraphs have zero order.")
        for edge in self._edges:
            for order, D, first in ends:
                x = edge.xu() if first else edge.xv()
                add_velocity_bounds(edge, D, self._points(x, order), x[-1], lower, upper)

    def AddNonlinearDerivativeBounds(self, lb: Any, ub: Any, derivative_order: int) -> None:
        """Keeps a higher time derivative where the curves meet between bounds.

        Raises:
            RuntimeError: the derivative is no higher one, or both orders are lower, or the number of bounds is another.
        """
        lower, upper = checked_bounds("AddNonlinearDerivativeBounds", self._traj.num_positions(), lb, ub)
        require_higher(derivative_order)
        ends = self._ends(derivative_order)
        self._require_ends(ends, derivative_order)
        for edge in self._edges:
            for order, D, first in ends:
                x = edge.xu() if first else edge.xv()
                add_derivative_bounds(edge, D, self._points(x, order), x[-1], lower, upper, derivative_order)

    def AddZeroDerivativeConstraints(self, derivative_order: int) -> None:
        """Makes a derivative zero where the curves meet.

        Raises:
            RuntimeError: the derivative is below one, or above both orders.
        """
        if derivative_order < 1:
            raise RuntimeError("Derivative order must be greater than 1.")
        ends = self._ends(derivative_order)
        self._require_ends(ends, derivative_order)
        for edge in self._edges:
            for order, D, first in ends:
                for row in self._points(edge.xu() if first else edge.xv(), order):
                    edge.AddConstraint(zero(D, 0.0, row))

    def _require_ends(self, ends: list, derivative: int) -> None:
        if not ends:
            raise RuntimeError(
                "Cannot add derivative bounds to subgraph edges where both subgraphs have less than derivative order.\n"
                f" From subgraph order: {self._from._order}\n To subgraph order: {self._to._order}\n"
                f" Derivative order: {derivative}"
            )

    def _require_continuity(self, derivative: int) -> None:
        if derivative > min(self._orders()):
            raise RuntimeError(
                "Cannot add continuity constraint to a subgraph edge where both subgraphs order are not greater than "
                "or equal to the requested continuity order."
            )
