"""What holds on the vertices and edges of a graph of curves: bounds, continuity, costs and constraints by stand-ins."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from sheldrake.common._overloads import overloaded
from sheldrake.geometry.optimization._gcs_elements import ALL, COSTS, Transcription, constraints
from sheldrake.planning._gcs_pieces import (
    NonlinearContinuityConstraint,
    NonlinearDerivativeConstraint,
    derivative_matrix,
)
from sheldrake.solvers import (
    Binding,
    Constraint,
    LinearConstraint,
    LinearEqualityConstraint,
)
from sheldrake.solvers._functions.bindings import BindingBase, bind
from sheldrake.symbolic import Variable

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


def linear(A: np.ndarray, lower: Any, upper: Any, vars: Any) -> Any:
    """lower <= A vars <= upper."""
    A = np.atleast_2d(A)
    m = len(A)
    c = LinearConstraint(A, np.broadcast_to(float(lower), m), np.broadcast_to(float(upper), m))
    return bind(LinearConstraint, c, np.asarray(vars, dtype=object))


def zero(A: np.ndarray, b: Any, vars: Any) -> Any:
    """A vars = b."""
    c = LinearEqualityConstraint(np.atleast_2d(A), np.atleast_1d(b))
    return bind(LinearEqualityConstraint, c, np.asarray(vars, dtype=object))


def add_velocity_bounds(
    target: Any, D: np.ndarray, points: np.ndarray, h: Variable, lower: np.ndarray, upper: np.ndarray
) -> None:
    """Adds lower h <= D r <= upper h for the control points r of each coordinate; h is the curve's duration.

    Args:
        target: A vertex or an edge.
        D: Rows of a derivative matrix, shape (m, order + 1).
        points: Control points, shape (num_positions, order + 1).
        h: The duration.
        lower: Least velocities, shape (num_positions,).
        upper: Greatest velocities, shape (num_positions,).
    """
    for i, r in enumerate(points):
        for bound, ends in ((lower[i], (0.0, np.inf)), (upper[i], (-np.inf, 0.0))):
            target.AddConstraint(linear(np.column_stack((D, np.full(len(D), -bound))), *ends, [*r, h]))


def add_derivative_bounds(
    target: Any, D: np.ndarray, points: np.ndarray, h: Variable, lower: np.ndarray, upper: np.ndarray, derivative: int
) -> None:
    """Adds lower h^n <= D r <= upper h^n for derivative n, with h in the place of h^n in the relaxation.

    Arguments are those of `add_velocity_bounds`.
    """
    for i, r in enumerate(points):
        vars = np.array([*r, h], dtype=object)
        m = len(D)
        A = np.vstack((np.column_stack((D, np.full(m, -lower[i]))), np.column_stack((-D, np.full(m, upper[i])))))
        target.AddConstraint(linear(A, 0.0, np.inf, vars), CONVEX)
        exact = NonlinearDerivativeConstraint(D, lower[i], upper[i], derivative)
        target.AddConstraint(Binding[Constraint](exact, vars), EXACT)


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

    _traj: Any

    def __init__(self, *args: Any, **kwargs: Any):
        name = type(self).__name__
        raise TypeError(f"pydrake.planning.GcsTrajectoryOptimization.{name}: No constructor defined!")

    def _edge_names(self) -> None:
        n, orders = self._traj.num_positions(), self._orders()
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

    @overloaded(*COSTS)
    def AddEdgeCost(self, what: Any, use_in_transcription: Iterable) -> None:
        """Adds a cost to each edge, written in `edge_constituent_vertex_...`; called as `(e)` or `(binding)`.

        Raises:
            RuntimeError: it has other variables.
        """
        for edge in self._edges:
            edge.AddCost(renamed(what, self._of_edge(edge)), use_in_transcription)

    @overloaded(*constraints("e"))
    def AddEdgeConstraint(self, what: Any, use_in_transcription: Iterable) -> None:
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

    def _join(self, edge: Any, offset: np.ndarray | None) -> None:
        """The first curve ends, moved by an offset, where the second starts."""
        orders = self._orders()
        last, first = self._points(edge.xu(), orders[0])[:, -1], self._points(edge.xv(), orders[1])[:, 0]
        n = len(last)
        shift = np.zeros(n) if offset is None else np.asarray(offset, dtype=float)
        edge.AddConstraint(zero(np.hstack((np.eye(n), -np.eye(n))), -shift, np.concatenate((last, first))))

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
        for edge in self._edges:
            u, v = self._points(edge.xu(), orders[0]), self._points(edge.xv(), orders[1])
            for i in range(len(u)):
                row = zero(np.concatenate((last, -first)), 0.0, np.concatenate((u[i], v[i])))
                edge.AddConstraint(row, use)

    def _continue_motion(self, derivative: int) -> None:
        orders = self._orders()
        last, first = derivative_matrix(orders[0], derivative)[-1], derivative_matrix(orders[1], derivative)[0]
        for edge in self._edges:
            xu, xv = edge.xu(), edge.xv()
            u, v = self._points(xu, orders[0]), self._points(xv, orders[1])
            for i in range(len(u)):
                exact = NonlinearContinuityConstraint(last, first, derivative)
                vars = np.concatenate((u[i], xu[-1:], v[i], xv[-1:]))
                edge.AddConstraint(Binding[Constraint](exact, vars), EXACT)
