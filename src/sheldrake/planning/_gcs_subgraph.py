"""Parts of a graph whose vertices are regions with a Bézier curve in each, and edges between parts."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from sheldrake.geometry.optimization import CartesianProduct, ConvexSet, HPolyhedron, Point
from sheldrake.geometry.optimization._gcs_elements import ALL, Transcription
from sheldrake.planning._gcs_pieces import (
    NonlinearContinuityConstraint,
    NonlinearDerivativeConstraint,
    derivative_matrix,
)
from sheldrake.solvers import (
    Binding,
    Constraint,
    L2NormCost,
    LinearConstraint,
    LinearCost,
    LinearEqualityConstraint,
    QuadraticCost,
)
from sheldrake.solvers._bindings import BindingBase, bind
from sheldrake.symbolic import Variable

_CONVEX = {Transcription.kRelaxation}
_EXACT = {Transcription.kRestriction, Transcription.kMIP}


def placeholders(name: str, num_positions: int, order: int) -> np.ndarray:
    """Variables that stand for control points, shape (num_positions, order + 1)."""
    out = np.empty((num_positions, order + 1), dtype=object)
    for i, j in np.ndindex(out.shape):
        out[i, j] = Variable(f"{name}({i}, {j})")
    return out


def renamed(what: Any, names: dict[int, tuple[Variable, Variable]]) -> Any:
    """An expression, formula or binding with other variables."""
    if isinstance(what, BindingBase):
        vars = [names[v.get_id()][1] if v.get_id() in names else v for v in what._variables]
        return type(what)(what.evaluator(), np.array(vars, dtype=object))
    if isinstance(what, Variable):
        what = 1.0 * what
    return what.Substitute(dict(names.values()))


def checked_bounds(call: str, n: int, lb: Any, ub: Any) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of n coordinates.

    Raises:
        RuntimeError: there is another number of them.
    """
    lower, upper = (np.array(b, dtype=float).ravel() for b in (lb, ub))
    if lower.size != n or upper.size != n:
        raise RuntimeError(f"{call}(): bounds have {lower.size} and {upper.size} elements, expected {n}.")
    return lower, upper


def weights(call: str, n: int, weight: Any) -> np.ndarray:
    """A weight matrix; from a number, that of all coordinates.

    Raises:
        RuntimeError: its shape is another.
    """
    W = np.array(weight, dtype=float)
    W = W * np.eye(n) if W.ndim == 0 else W
    if W.shape != (n, n):
        raise RuntimeError(f"{call}(): the weight matrix has shape {W.shape}, expected {(n, n)}.")
    return W


def energy_weights(call: str, n: int, weight: Any) -> np.ndarray:
    """W of costs step' W step / 2; for a number w that of |w step|^2, as pydrake has it."""
    return weights(call, n, 2.0 * float(weight) ** 2 if np.ndim(weight) == 0 else weight)


def _linear(A: np.ndarray, lower: Any, upper: Any, vars: Any) -> Any:
    A = np.atleast_2d(A)
    m = len(A)
    c = LinearConstraint(A, np.broadcast_to(float(lower), m), np.broadcast_to(float(upper), m))
    return bind(LinearConstraint, c, np.asarray(vars, dtype=object))


def _zero(A: np.ndarray, b: Any, vars: Any) -> Any:
    c = LinearEqualityConstraint(np.atleast_2d(A), np.atleast_1d(b))
    return bind(LinearEqualityConstraint, c, np.asarray(vars, dtype=object))


class Part:
    """What subgraphs and edges between them have in common."""

    _traj: Any

    def __init__(self, *args: Any, **kwargs: Any):
        name = type(self).__name__
        raise TypeError(f"pydrake.planning.GcsTrajectoryOptimization.{name}: No constructor defined!")

    def _edge_names(self, orders: tuple[int, int]) -> None:
        n = self._traj.num_positions()
        self._xu, self._xv = placeholders("xu", n, orders[0]), placeholders("xv", n, orders[1])
        self._tu, self._tv = Variable("tu"), Variable("tv")

    _edges: list[Any]

    def Edges(self) -> list[Any]:
        """Returns the edges."""
        return list(self._edges)

    def edge_constituent_vertex_durations(self) -> tuple[Variable, Variable]:
        """Returns what stands for the durations of the two curves of an edge, in `AddEdgeCost` and so on."""
        return self._tu, self._tv

    def edge_constituent_vertex_control_points(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns what stands for the control points of the two curves of an edge, columns."""
        return self._xu.copy(), self._xv.copy()

    def _of_edge(self, edge: Any) -> dict[int, tuple[Variable, Variable]]:
        stand_ins = [*self._xu.ravel(order="F"), self._tu, *self._xv.ravel(order="F"), self._tv]
        return {p.get_id(): (p, v) for p, v in zip(stand_ins, (*edge.xu(), *edge.xv()))}

    def AddEdgeCost(self, *args: Any, use_in_transcription: Iterable = ALL, **kwargs: Any) -> None:
        """Adds a cost to each edge, written in `edge_constituent_vertex_...`; called as `(e)` or `(binding)`.

        Raises:
            RuntimeError: it has other variables.
        """
        (what, *rest) = [*args, *kwargs.values()]
        for edge in self._edges:
            edge.AddCost(renamed(what, self._of_edge(edge)), rest[0] if rest else use_in_transcription)

    def AddEdgeConstraint(self, *args: Any, use_in_transcription: Iterable = ALL, **kwargs: Any) -> None:
        """Adds a constraint to each edge, written in `edge_constituent_vertex_...`; called as `(e)` or `(binding)`.

        Raises:
            RuntimeError: it has other variables.
        """
        (what, *rest) = [*args, *kwargs.values()]
        for edge in self._edges:
            edge.AddConstraint(renamed(what, self._of_edge(edge)), rest[0] if rest else use_in_transcription)

    # What holds where two curves meet

    def _points(self, x: np.ndarray, order: int) -> np.ndarray:
        """Variables of the control points among those of a vertex, shape (num_positions, order + 1)."""
        n = self._traj.num_positions()
        return x[: n * (order + 1)].reshape(order + 1, n).T

    def _join(self, edge: Any, orders: tuple[int, int], offset: np.ndarray | None) -> None:
        """The first curve ends, moved by an offset, where the second starts."""
        last, first = self._points(edge.xu(), orders[0])[:, -1], self._points(edge.xv(), orders[1])[:, 0]
        n = len(last)
        shift = np.zeros(n) if offset is None else np.asarray(offset, dtype=float)
        edge.AddConstraint(_zero(np.hstack((np.eye(n), -np.eye(n))), -shift, np.concatenate((last, first))))

    def _continue_path(self, orders: tuple[int, int], derivative: int, use: Iterable = ALL) -> None:
        last, first = derivative_matrix(orders[0], derivative)[-1], derivative_matrix(orders[1], derivative)[0]
        for edge in self._edges:
            u, v = self._points(edge.xu(), orders[0]), self._points(edge.xv(), orders[1])
            for i in range(len(u)):
                row = _zero(np.concatenate((last, -first)), 0.0, np.concatenate((u[i], v[i])))
                edge.AddConstraint(row, use)

    def _continue_motion(self, orders: tuple[int, int], derivative: int) -> None:
        self._continue_path(orders, derivative, _CONVEX)
        last, first = derivative_matrix(orders[0], derivative)[-1], derivative_matrix(orders[1], derivative)[0]
        for edge in self._edges:
            xu, xv = edge.xu(), edge.xv()
            u, v = self._points(xu, orders[0]), self._points(xv, orders[1])
            for i in range(len(u)):
                exact = NonlinearContinuityConstraint(last, first, derivative)
                vars = np.concatenate((u[i], xu[-1:], v[i], xv[-1:]))
                edge.AddConstraint(Binding[Constraint](exact, vars), _EXACT)


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
            out._join(edge, (order, order), None if offsets is None else offsets[k])
        out._x, out._t = placeholders("x", n, order), Variable("t")
        out._edge_names((order, order))
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

    def AddVertexCost(self, *args: Any, use_in_transcription: Iterable = ALL, **kwargs: Any) -> None:
        """Adds a cost to each vertex, written in `vertex_duration` and `vertex_control_points`.

        Raises:
            RuntimeError: it has other variables.
        """
        (what, *rest) = [*args, *kwargs.values()]
        for vertex in self._vertices:
            vertex.AddCost(renamed(what, self._of_vertex(vertex)), rest[0] if rest else use_in_transcription)

    def AddVertexConstraint(self, *args: Any, use_in_transcription: Iterable = ALL, **kwargs: Any) -> None:
        """Adds a constraint to each vertex, written in `vertex_duration` and `vertex_control_points`.

        Raises:
            RuntimeError: it has other variables.
        """
        (what, *rest) = [*args, *kwargs.values()]
        for vertex in self._vertices:
            vertex.AddConstraint(renamed(what, self._of_vertex(vertex)), rest[0] if rest else use_in_transcription)

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
            points = self._points(x, self._order)
            for i, row in enumerate(points):
                for bound, ends in ((lower[i], (0.0, np.inf)), (upper[i], (-np.inf, 0.0))):
                    A = np.column_stack((D, np.full(len(D), -bound)))
                    vertex.AddConstraint(_linear(A, *ends, [*row, x[-1]]))

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
            for i, row in enumerate(self._points(x, self._order)):
                vars = np.array([*row, x[-1]], dtype=object)
                m = len(D)
                A = np.vstack(
                    (np.column_stack((D, np.full(m, -lower[i]))), np.column_stack((-D, np.full(m, upper[i]))))
                )
                vertex.AddConstraint(_linear(A, 0.0, np.inf, vars), _CONVEX)
                exact = NonlinearDerivativeConstraint(D, lower[i], upper[i], derivative_order)
                vertex.AddConstraint(Binding[Constraint](exact, vars), _EXACT)

    def AddPathContinuityConstraints(self, continuity_order: int) -> None:
        """Makes a derivative of the path r(s) agree wherever two curves meet.

        Raises:
            RuntimeError: the order is below one, or above that of the curves.
        """
        require_more_than_position(continuity_order)
        self._require_continuity(continuity_order)
        self._continue_path((self._order, self._order), continuity_order)

    def AddContinuityConstraints(self, continuity_order: int) -> None:
        """Makes a time derivative of q(t) agree wherever two curves meet; the relaxation has that of the path instead.

        Raises:
            RuntimeError: the order is below one, or above that of the curves.
        """
        require_more_than_position(continuity_order)
        self._require_continuity(continuity_order)
        self._continue_motion((self._order, self._order), continuity_order)

    def _require_continuity(self, derivative: int) -> None:
        if derivative > self._order:
            raise RuntimeError("Cannot add continuity constraint of order greater than the set order.")


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
        orders = out._orders()
        for k, (i, j) in enumerate(pairs):
            a, b = u._vertices[i], v._vertices[j]
            edge = traj.graph_of_convex_sets().AddEdge(a, b, f"{a.name()} -> {b.name()}")
            out._edges.append(edge)
            out._join(edge, orders, None if offsets is None else offsets[k])
            if subspace is not None:
                out._keep_in(edge, subspace)
        out._edge_names(orders)
        return out

    def _orders(self) -> tuple[int, int]:
        return self._from._order, self._to._order

    def _keep_in(self, edge: Any, subspace: ConvexSet) -> None:
        last = self._points(edge.xu(), self._from._order)[:, -1]
        if isinstance(subspace, Point):
            edge.AddConstraint(_zero(np.eye(len(last)), subspace.x(), last))
        elif isinstance(subspace, HPolyhedron):
            c = LinearConstraint(subspace.A(), np.full(subspace.b().size, -np.inf), subspace.b())
            edge.AddConstraint(bind(LinearConstraint, c, last))
        else:
            raise RuntimeError("Subspace must be a Point or HPolyhedron.")

    def _ends(self, derivative: int) -> list[tuple[int, np.ndarray, bool]]:
        """Order, row of the derivative matrix, and whether it is the first one, of curves that have the derivative."""
        out = []
        for order, row, first in ((self._from._order, -1, True), (self._to._order, 0, False)):
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
                for i, row in enumerate(self._points(x, order)):
                    for bound, limits in ((lower[i], (0.0, np.inf)), (upper[i], (-np.inf, 0.0))):
                        edge.AddConstraint(_linear(np.append(D, -bound), *limits, [*row, x[-1]]))

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
                for i, row in enumerate(self._points(x, order)):
                    vars = np.array([*row, x[-1]], dtype=object)
                    A = np.vstack((np.append(D, -lower[i]), np.append(-D, upper[i])))
                    edge.AddConstraint(_linear(A, 0.0, np.inf, vars), _CONVEX)
                    exact = NonlinearDerivativeConstraint(D.reshape(1, -1), lower[i], upper[i], derivative_order)
                    edge.AddConstraint(Binding[Constraint](exact, vars), _EXACT)

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
                    edge.AddConstraint(_zero(D, 0.0, row))

    def _require_ends(self, ends: list, derivative: int) -> None:
        if not ends:
            raise RuntimeError(
                "Cannot add derivative bounds to subgraph edges where both subgraphs have less than derivative order.\n"
                f" From subgraph order: {self._from._order}\n To subgraph order: {self._to._order}\n"
                f" Derivative order: {derivative}"
            )

    def AddPathContinuityConstraints(self, continuity_order: int) -> None:
        """Makes a derivative of the path r(s) agree where the curves meet.

        Raises:
            RuntimeError: the order is below one, or above that of one of the curves.
        """
        require_more_than_position(continuity_order)
        self._require_continuity(continuity_order)
        self._continue_path(self._orders(), continuity_order)

    def AddContinuityConstraints(self, continuity_order: int) -> None:
        """Makes a time derivative of q(t) agree where the curves meet.

        Raises:
            RuntimeError: the order is below one, or above that of one of the curves.
        """
        require_more_than_position(continuity_order)
        self._require_continuity(continuity_order)
        self._continue_motion(self._orders(), continuity_order)

    def _require_continuity(self, derivative: int) -> None:
        if derivative > min(self._orders()):
            raise RuntimeError(
                "Cannot add continuity constraint to a subgraph edge where both subgraphs order are not greater than "
                "or equal to the requested continuity order."
            )


def require_higher(derivative: int) -> None:
    """Checks that a derivative is the second or a higher one.

    Raises:
        RuntimeError: it is not.
    """
    if derivative <= 1:
        raise RuntimeError(
            f"Use AddVelocityBounds instead of AddNonlinearDerivativeBounds with derivative_order={derivative}; "
            "velocity bounds are linear."
        )


def require_more_than_position(order: int) -> None:
    """Checks that continuity is asked for of a derivative.

    Raises:
        RuntimeError: it is not.
    """
    if order < 1:
        raise RuntimeError("Path continuity is enforced by default. Choose a higher order.")
