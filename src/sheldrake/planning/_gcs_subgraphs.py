"""Parts of trajectory optimizations in graphs of convex sets: subgraphs of regions, and the edges between them."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import overloaded
from sheldrake.geometry.optimization import CartesianProduct, ConvexSet, HPolyhedron, Point
from sheldrake.geometry.optimization._gcs_elements import ALL, COSTS, Transcription, constraints
from sheldrake.solvers import (
    Binding,
    Constraint,
    L2NormCost,
    LinearConstraint,
    LinearCost,
    LinearEqualityConstraint,
    QuadraticCost,
)
from sheldrake.solvers._functions.bindings import BindingBase, bind
from sheldrake.solvers._functions.evaluators import Many, Opaque
from sheldrake.symbolic import Variable

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.geometry.optimization import GraphOfConvexSets
    from sheldrake.planning._gcs_trajectory_optimization import GcsTrajectoryOptimization
    from sheldrake.symbolic import Expression


def derivative_matrix(order: int, derivative: int) -> np.ndarray:
    """Control points of a derivative from those of a Bézier curve, shape (order + 1 - derivative, order + 1)."""
    D = np.eye(order + 1)
    for _ in range(derivative):
        D = D[1:] - D[:-1]
    return math.perm(order, derivative) * D


class NonlinearDerivativeConstraint(Opaque, Constraint):
    """lb h^N <= control points of the N-th derivative of r <= ub h^N, of one coordinate; variables (r, h)."""

    def __init__(self, D: np.ndarray, lb: float, ub: float, derivative: int):
        self._D, self._lb, self._ub, self._power = D, lb, ub, derivative
        count = 2 * len(D)
        self._set_sizes(count, D.shape[1] + 1)
        self._set_bounds(np.zeros(count), np.full(count, np.inf))

    def _values(self, x: np.ndarray) -> np.ndarray:
        d, scale = self._D @ x[:-1], x[-1] ** self._power
        return np.concatenate((d - self._lb * scale, self._ub * scale - d))

    def _alike(self) -> Hashable | None:
        return type(self), self._D.shape, self._D.tobytes(), self._lb, self._ub, self._power

    def _many(self) -> Many:
        return _DerivativesWithin(self._D, self._lb, self._ub, self._power)

    _eval = _eval_duals = _eval_symbols = _values


class _DerivativesWithin:
    """Values of a NonlinearDerivativeConstraint at many points (r, h), and their derivatives."""

    def __init__(self, D: np.ndarray, lb: float, ub: float, power: int):
        self._rows, self._power = np.vstack((D, -D)), power
        self._factors = np.repeat((-lb, ub), len(D))  # of h^N

    def values(self, points: np.ndarray) -> np.ndarray:
        """Shape (points, 2 m)."""
        return points[:, :-1] @ self._rows.T + self._factors * points[:, -1:] ** self._power

    def slopes(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values, and derivatives of shape (points, 2 m, n)."""
        rows, n = self._rows.shape
        J = np.empty((len(points), rows, n + 1))
        J[:, :, :-1] = self._rows
        J[:, :, -1] = self._factors * (self._power * points[:, -1:] ** (self._power - 1))
        return self.values(points), J

    def hessian(self, points: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Second derivatives times weights of shape (points, 2 m), shape (points, n, n)."""
        H = np.zeros((len(points), points.shape[1], points.shape[1]))
        N = self._power
        H[:, -1, -1] = (weights @ self._factors) * (N * (N - 1) * points[:, -1] ** max(N - 2, 0))
        return H


class NonlinearContinuityConstraint(Opaque, Constraint):
    """The N-th time derivatives of one coordinate agree where one curve ends and the next starts.

    Variables (r_u, h_u, r_v, h_v); the value is r_u^(N)(1) h_v^N - r_v^(N)(0) h_u^N, which is zero.
    """

    def __init__(self, last: np.ndarray, first: np.ndarray, derivative: int):
        self._last, self._first, self._power = last, first, derivative
        self._set_sizes(1, last.size + first.size + 2)
        self._set_bounds(np.zeros(1), np.zeros(1))

    def _values(self, x: np.ndarray) -> np.ndarray:
        n = self._last.size
        u, h_u, v, h_v = x[:n], x[n], x[n + 1 : -1], x[-1]
        return np.array([(self._last @ u) * h_v**self._power - (self._first @ v) * h_u**self._power])

    def _alike(self) -> Hashable | None:
        return type(self), self._last.tobytes(), self._first.tobytes(), self._power

    def _many(self) -> Many:
        return _DerivativesMeet(self._last, self._first, self._power)

    _eval = _eval_duals = _eval_symbols = _values


class _DerivativesMeet:
    """Values of a NonlinearContinuityConstraint at many points (r_u, h_u, r_v, h_v), and their derivatives."""

    def __init__(self, last: np.ndarray, first: np.ndarray, power: int):
        self._last, self._first, self._power, self._at = last, first, power, last.size

    def values(self, points: np.ndarray) -> np.ndarray:
        """Shape (points, 1)."""
        return self.slopes(points)[0]

    def slopes(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values, and derivatives of shape (points, 1, n)."""
        k, N = self._at, self._power
        ends, starts, h_u, h_v = points[:, :k] @ self._last, points[:, k + 1 : -1] @ self._first, *self._times(points)
        J = np.empty((len(points), 1, points.shape[1]))
        J[:, 0, :k] = np.outer(h_v**N, self._last)
        J[:, 0, k] = -starts * N * h_u ** (N - 1)
        J[:, 0, k + 1 : -1] = -np.outer(h_u**N, self._first)
        J[:, 0, -1] = ends * N * h_v ** (N - 1)
        return (ends * h_v**N - starts * h_u**N)[:, None], J

    def hessian(self, points: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Second derivatives times weights of shape (points, 1), shape (points, n, n)."""
        k, N, w = self._at, self._power, weights[:, 0]
        ends, starts, h_u, h_v = points[:, :k] @ self._last, points[:, k + 1 : -1] @ self._first, *self._times(points)
        H = np.zeros((len(points), points.shape[1], points.shape[1]))
        H[:, :k, -1] = np.outer(w * N * h_v ** (N - 1), self._last)
        H[:, k, k + 1 : -1] = -np.outer(w * N * h_u ** (N - 1), self._first)
        H += H.transpose(0, 2, 1)
        H[:, -1, -1] = w * ends * N * (N - 1) * h_v ** max(N - 2, 0)
        H[:, k, k] = -w * starts * N * (N - 1) * h_u ** max(N - 2, 0)
        return H

    def _times(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return points[:, self._at], points[:, -1]


CONVEX = {Transcription.kRelaxation}
EXACT = {Transcription.kRestriction, Transcription.kMIP}


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


def checked_bounds(call: str, n: int, lb: ArrayLike, ub: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of n coordinates.

    Raises:
        RuntimeError: there is another number of them.
    """
    lower, upper = (np.array(b, dtype=float).ravel() for b in (lb, ub))
    if lower.size != n or upper.size != n:
        raise RuntimeError(f"{call}(): bounds have {lower.size} and {upper.size} elements, expected {n}.")
    return lower, upper


def weights(call: str, n: int, weight: float) -> np.ndarray:
    """A weight matrix; from a number, that of all coordinates.

    Raises:
        RuntimeError: its shape is another.
    """
    W = np.array(weight, dtype=float)
    W = W * np.eye(n) if W.ndim == 0 else W
    if W.shape != (n, n):
        raise RuntimeError(f"{call}(): the weight matrix has shape {W.shape}, expected {(n, n)}.")
    return W


def energy_weights(call: str, n: int, weight: float) -> np.ndarray:
    """W of costs step' W step / 2; for a number w that of |w step|^2, as pydrake has it."""
    return weights(call, n, 2.0 * float(weight) ** 2 if np.ndim(weight) == 0 else weight)


def linear(A: np.ndarray, lower: float, upper: float) -> LinearConstraint:
    """lower <= A x <= upper."""
    m = len(A)
    return LinearConstraint(A, np.full(m, lower), np.full(m, upper))


def zero(A: np.ndarray, b: ArrayLike = 0.0) -> LinearEqualityConstraint:
    """A x = b."""
    return LinearEqualityConstraint(np.atleast_2d(A), np.atleast_1d(b))


Target: TypeAlias = "tuple[Any, np.ndarray, Variable]"  # a vertex or edge, control points of a curve, its duration


def add_velocity_bounds(targets: Iterable[Target], D: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> None:
    """Adds lower h <= D r <= upper h for the control points r of each coordinate; h is the curve's duration.

    Args:
        targets: What it is added to; control points have shape (num_positions, order + 1).
        D: Rows of a derivative matrix, shape (m, order + 1).
        lower: Least velocities, shape (num_positions,).
        upper: Greatest velocities, shape (num_positions,).
    """

    def bounded(bound: float, low: float, high: float) -> LinearConstraint:
        return linear(np.column_stack((D, np.full(len(D), -bound))), low, high)

    above = [bounded(bound, 0.0, np.inf) for bound in lower.tolist()]
    below = [bounded(bound, -np.inf, 0.0) for bound in upper.tolist()]
    for target, points, h in targets:
        for i, r in enumerate(points):
            vars = np.array([*r, h], dtype=object)
            target.AddConstraint(bind(LinearConstraint, above[i], vars))
            target.AddConstraint(bind(LinearConstraint, below[i], vars))


def add_derivative_bounds(
    targets: Iterable[Target], D: np.ndarray, lower: np.ndarray, upper: np.ndarray, derivative: int
) -> None:
    """Adds lower h^n <= D r <= upper h^n for derivative n, with h in the place of h^n in the relaxation.

    Arguments are those of `add_velocity_bounds`.
    """
    m, relaxed, exact = len(D), [], []
    for low, high in zip(lower, upper):
        A = np.vstack((np.column_stack((D, np.full(m, -low))), np.column_stack((-D, np.full(m, high)))))
        relaxed.append(linear(A, 0.0, np.inf))
        exact.append(NonlinearDerivativeConstraint(D, low, high, derivative))
    for target, points, h in targets:
        for i, r in enumerate(points):
            vars = np.array([*r, h], dtype=object)
            target.AddConstraint(bind(LinearConstraint, relaxed[i], vars), CONVEX)
            target.AddConstraint(Binding[Constraint](exact[i], vars), EXACT)


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


class Part:
    """What subgraphs and edges between them have in common."""

    _traj: GcsTrajectoryOptimization

    def __init__(self, *args: Any, **kwargs: Any):
        name = type(self).__name__
        raise TypeError(f"pydrake.planning.GcsTrajectoryOptimization.{name}: No constructor defined!")

    def _edge_names(self) -> None:
        n, orders = self._traj.num_positions(), self._orders()
        self._xu, self._xv = placeholders("xu", n, orders[0]), placeholders("xv", n, orders[1])
        self._tu, self._tv = Variable("tu"), Variable("tv")

    _edges: list[GraphOfConvexSets.Edge]

    def Edges(self) -> list[GraphOfConvexSets.Edge]:
        """Returns the edges."""
        return list(self._edges)

    def edge_constituent_vertex_durations(self) -> tuple[Variable, Variable]:
        """Returns what stands for the durations of the two curves of an edge, in `AddEdgeCost` and so on."""
        return self._tu, self._tv

    def edge_constituent_vertex_control_points(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns what stands for the control points of the two curves of an edge, columns."""
        return self._xu.copy(), self._xv.copy()

    def _of_edge(self, edge: GraphOfConvexSets.Edge) -> dict[int, tuple[Variable, Variable]]:
        stand_ins = [*self._xu.ravel(order="F"), self._tu, *self._xv.ravel(order="F"), self._tv]
        return {p.get_id(): (p, v) for p, v in zip(stand_ins, (*edge.xu(), *edge.xv()))}

    @overloaded(*COSTS)
    def AddEdgeCost(self, what: Expression | Callable[..., Any] | Binding, use_in_transcription: Iterable) -> None:
        """Adds a cost to each edge, written in `edge_constituent_vertex_...`; called as `(e)` or `(binding)`.

        Raises:
            RuntimeError: it has other variables.
        """
        for edge in self._edges:
            edge.AddCost(renamed(what, self._of_edge(edge)), use_in_transcription)

    @overloaded(*constraints("e"))
    def AddEdgeConstraint(
        self, what: Expression | Callable[..., Any] | Binding, use_in_transcription: Iterable
    ) -> None:
        """Adds a constraint to each edge, written in `edge_constituent_vertex_...`; called as `(e)` or `(binding)`.

        Raises:
            RuntimeError: it has other variables.
        """
        for edge in self._edges:
            edge.AddConstraint(renamed(what, self._of_edge(edge)), use_in_transcription)

    # What holds where two curves meet

    def _points(self, x: np.ndarray, order: int) -> np.ndarray:
        """Variables of the control points among those of a vertex, shape (num_positions, order + 1)."""
        n = self._traj.num_positions()
        return x[: n * (order + 1)].reshape(order + 1, n).T

    def _join(self, edge: GraphOfConvexSets.Edge, offset: np.ndarray | None) -> None:
        """The first curve ends, moved by an offset, where the second starts."""
        orders = self._orders()
        last, first = self._points(edge.xu(), orders[0])[:, -1], self._points(edge.xv(), orders[1])[:, 0]
        n = len(last)
        shift = np.zeros(n) if offset is None else np.asarray(offset, dtype=float)
        joined = zero(np.hstack((np.eye(n), -np.eye(n))), -shift)
        edge.AddConstraint(bind(LinearEqualityConstraint, joined, np.concatenate((last, first))))

    def _orders(self) -> tuple[int, int]:
        """Orders of the curves before and after each edge."""
        raise NotImplementedError

    def _require_continuity(self, derivative: int) -> None:
        """Checks that the curves have this derivative."""
        raise NotImplementedError

    def AddPathContinuityConstraints(self, continuity_order: int) -> None:
        """Makes a derivative of the path r(s) agree wherever two curves meet.

        Raises:
            RuntimeError: the order is below one, or above that of one of the curves.
        """
        require_more_than_position(continuity_order)
        self._require_continuity(continuity_order)
        self._continue_path(continuity_order, ALL)

    def AddContinuityConstraints(self, continuity_order: int) -> None:
        """Makes a time derivative of q(t) agree wherever two curves meet; the relaxation has that of the path instead.

        Raises:
            RuntimeError: the order is below one, or above that of one of the curves.
        """
        require_more_than_position(continuity_order)
        self._require_continuity(continuity_order)
        self._continue_path(continuity_order, CONVEX)
        self._continue_motion(continuity_order)

    def _continue_path(self, derivative: int, use: Iterable) -> None:
        orders = self._orders()
        last, first = derivative_matrix(orders[0], derivative)[-1], derivative_matrix(orders[1], derivative)[0]
        same = zero(np.concatenate((last, -first)))
        for edge in self._edges:
            u, v = self._points(edge.xu(), orders[0]), self._points(edge.xv(), orders[1])
            for row in np.hstack((u, v)):
                edge.AddConstraint(bind(LinearEqualityConstraint, same, row), use)

    def _continue_motion(self, derivative: int) -> None:
        orders = self._orders()
        last, first = derivative_matrix(orders[0], derivative)[-1], derivative_matrix(orders[1], derivative)[0]
        exact = NonlinearContinuityConstraint(last, first, derivative)
        for edge in self._edges:
            xu, xv = edge.xu(), edge.xv()
            u, v = self._points(xu, orders[0]), self._points(xv, orders[1])
            for i in range(len(u)):
                vars = np.concatenate((u[i], xu[-1:], v[i], xv[-1:]))
                edge.AddConstraint(Binding[Constraint](exact, vars), EXACT)


@checked
class Subgraph(Part):
    """Regions and the edges between those that meet; made by `AddRegions`."""

    _regions: list[ConvexSet]
    _order: int
    _name: str
    _x: np.ndarray
    _t: Variable

    @classmethod
    def _make(
        cls,
        traj: GcsTrajectoryOptimization,
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

    _vertices: list[GraphOfConvexSets.Vertex]

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

    def Vertices(self) -> list[GraphOfConvexSets.Vertex]:
        """Returns the vertices, one for each region."""
        return list(self._vertices)

    def vertex_duration(self) -> Variable:
        """Returns what stands for the duration of a curve in `AddVertexCost` and `AddVertexConstraint`."""
        return self._t

    def vertex_control_points(self) -> np.ndarray:
        """Returns what stands for the control points of a curve, columns."""
        return self._x.copy()

    def _of_vertex(self, vertex: GraphOfConvexSets.Vertex) -> dict[int, tuple[Variable, Variable]]:
        stand_ins = [*self._x.ravel(order="F"), self._t]
        return {p.get_id(): (p, v) for p, v in zip(stand_ins, vertex.x())}

    @overloaded(*COSTS)
    def AddVertexCost(self, what: Expression | Callable[..., Any] | Binding, use_in_transcription: Iterable) -> None:
        """Adds a cost to each vertex, written in `vertex_duration` and `vertex_control_points`.

        Raises:
            RuntimeError: it has other variables.
        """
        for vertex in self._vertices:
            vertex.AddCost(renamed(what, self._of_vertex(vertex)), use_in_transcription)

    @overloaded(*constraints("e"))
    def AddVertexConstraint(
        self, what: Expression | Callable[..., Any] | Binding, use_in_transcription: Iterable
    ) -> None:
        """Adds a constraint to each vertex, written in `vertex_duration` and `vertex_control_points`.

        Raises:
            RuntimeError: it has other variables.
        """
        for vertex in self._vertices:
            vertex.AddConstraint(renamed(what, self._of_vertex(vertex)), use_in_transcription)

    def AddTimeCost(self, weight: float = 1.0) -> None:
        """Adds the duration of each curve, times a weight, to the cost."""
        cost = LinearCost(np.array([float(weight)]), 0.0)
        for vertex in self._vertices:
            vertex.AddCost(bind(LinearCost, cost, vertex.x()[-1:]))

    def _steps(self, vertex: GraphOfConvexSets.Vertex) -> list[np.ndarray]:
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
        cost = L2NormCost(np.hstack((W, -W)), np.zeros(len(W)))
        for vertex in self._vertices:
            for vars in self._steps(vertex):
                vertex.AddCost(bind(L2NormCost, cost, vars))

    def AddPathEnergyCost(self, weight_matrix: Any = 1.0, *, weight: Any = None) -> None:
        """Adds the squares of steps between control points to the cost: step' W step / 2, or |w step|^2 for a number w.

        Raises:
            RuntimeError: the order is zero, or the matrix has another shape.
        """
        given = weight_matrix if weight is None else weight
        W = energy_weights("AddPathEnergyCost", self._traj.num_positions(), given)
        self._require_order("Path energy cost is", 1)
        cost = QuadraticCost(np.block([[W, -W], [-W, W]]), np.zeros(2 * len(W)), 0.0)
        for vertex in self._vertices:
            for vars in self._steps(vertex):
                vertex.AddCost(bind(QuadraticCost, cost, vars))

    def _require_order(self, what: str, least: int) -> None:
        if self._order < least:
            raise RuntimeError(f"{what} not defined for a set of order {self._order}.")

    def AddVelocityBounds(self, lb: ArrayLike, ub: ArrayLike) -> None:
        """Keeps velocities dq/dt of all curves between bounds.

        Raises:
            RuntimeError: the order is zero, or there is another number of bounds than of positions.
        """
        lower, upper = checked_bounds("AddVelocityBounds", self._traj.num_positions(), lb, ub)
        self._require_order("Velocity Bounds are", 1)
        add_velocity_bounds(self._targets(), derivative_matrix(self._order, 1), lower, upper)

    def _targets(self) -> list[Target]:
        """All vertices, for bounds."""
        points = [(vertex, vertex.x()) for vertex in self._vertices]
        return [(vertex, self._points(x, self._order), x[-1]) for vertex, x in points]

    def AddNonlinearDerivativeBounds(self, lb: ArrayLike, ub: ArrayLike, derivative_order: int) -> None:
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
        add_derivative_bounds(self._targets(), D, lower, upper, derivative_order)

    def _orders(self) -> tuple[int, int]:
        return self._order, self._order

    def _require_continuity(self, derivative: int) -> None:
        if derivative > self._order:
            raise RuntimeError("Cannot add continuity constraint of order greater than the set order.")


@checked
class EdgesBetweenSubgraphs(Part):
    """Edges from the regions of one subgraph to those of another; made by `AddEdges`."""

    _from: Subgraph
    _to: Subgraph

    @classmethod
    def _make(
        cls,
        traj: GcsTrajectoryOptimization,
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

    def _keep_in(self, edge: GraphOfConvexSets.Edge, subspace: ConvexSet) -> None:
        last = self._points(edge.xu(), self._from._order)[:, -1]
        if isinstance(subspace, Point):
            edge.AddConstraint(bind(LinearEqualityConstraint, zero(np.eye(len(last)), subspace.x()), last))
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

    def AddVelocityBounds(self, lb: ArrayLike, ub: ArrayLike) -> None:
        """Keeps the velocity where the curves meet between bounds.

        Raises:
            RuntimeError: both orders are zero, or there is another number of bounds than of positions.
        """
        lower, upper = checked_bounds("AddVelocityBounds", self._traj.num_positions(), lb, ub)
        ends = self._ends(1)
        if not ends:
            raise RuntimeError("Cannot add velocity bounds to subgraph edges where both subgraphs have zero order.")
        for order, D, first in ends:
            add_velocity_bounds(self._targets(order, first), D, lower, upper)

    def _targets(self, order: int, first: bool) -> list[Target]:
        """All edges, for bounds on one of the two curves."""
        points = [(edge, edge.xu() if first else edge.xv()) for edge in self._edges]
        return [(edge, self._points(x, order), x[-1]) for edge, x in points]

    def AddNonlinearDerivativeBounds(self, lb: ArrayLike, ub: ArrayLike, derivative_order: int) -> None:
        """Keeps a higher time derivative where the curves meet between bounds.

        Raises:
            RuntimeError: the derivative is no higher one, or both orders are lower, or the number of bounds is another.
        """
        lower, upper = checked_bounds("AddNonlinearDerivativeBounds", self._traj.num_positions(), lb, ub)
        require_higher(derivative_order)
        ends = self._ends(derivative_order)
        self._require_ends(ends, derivative_order)
        for order, D, first in ends:
            add_derivative_bounds(self._targets(order, first), D, lower, upper, derivative_order)

    def AddZeroDerivativeConstraints(self, derivative_order: int) -> None:
        """Makes a derivative zero where the curves meet.

        Raises:
            RuntimeError: the derivative is below one, or above both orders.
        """
        if derivative_order < 1:
            raise RuntimeError("Derivative order must be greater than 1.")
        ends = self._ends(derivative_order)
        self._require_ends(ends, derivative_order)
        for order, D, first in ends:
            rest = zero(D)
            for edge, points, _ in self._targets(order, first):
                for row in points:
                    edge.AddConstraint(bind(LinearEqualityConstraint, rest, row))

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
