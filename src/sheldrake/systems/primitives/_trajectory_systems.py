"""Systems that follow trajectories.

A trajectory as an output, and linear systems whose matrices are trajectories.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.autodiffutils._matrices import filled
from sheldrake.common._checked import checked
from sheldrake.common._overloads import incompatible
from sheldrake.systems.framework import LeafSystem
from sheldrake.systems.framework._index import Ticket
from sheldrake.systems.primitives._kernels import paths
from sheldrake.systems.primitives._state_space import StateSpace, declare_motion
from sheldrake.trajectories import PiecewisePolynomial, PiecewiseQuaternionSlerp
from sheldrake.trajectories._base import kept
from sheldrake.trajectories._pieces import as_piecewise_polynomial, is_piecewise

if TYPE_CHECKING:
    from sheldrake.common.kernel import Kernel
    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._values import ContinuousState, DiscreteValues
    from sheldrake.systems.framework._vector import BasicVector
    from sheldrake.trajectories import Trajectory


class TrajectorySource(LeafSystem):
    """A trajectory of time, with derivatives if asked for.

    Piecewise polynomials, B-splines, Bézier curves, what is composed or stacked of these, and quaternions between
    breaks are evaluated by kernels; others, such as functions, in Python.

    Args:
        trajectory: A vector trajectory.
        output_derivative_order: How many derivatives follow the value.
        zero_derivatives_beyond_limits: Derivatives are zero outside the trajectory's time.
    """

    _generic = True

    def __init__(
        self, trajectory: Trajectory, output_derivative_order: int = 0, zero_derivatives_beyond_limits: bool = True
    ):
        super().__init__()
        if not hasattr(trajectory, "MakeDerivative"):
            raise incompatible(
                "TrajectorySource", ["(trajectory: Trajectory, ...)"], (trajectory,), {}, constructor=True
            )
        self._order, self._zero = int(output_derivative_order), bool(zero_derivatives_beyond_limits)
        self._arrays: Any = None
        self._stores: list[Any] = []  # of contexts that know the arrays
        self._set(trajectory)
        size = trajectory.rows() * (1 + self._order)
        self.DeclareVectorOutputPort("y0", size, self._calc, {Ticket.TIME})
        self._compute_natively(0, self._kernel())

    def _set(self, trajectory: Trajectory) -> None:
        if trajectory.cols() != 1:
            raise RuntimeError(
                f"TrajectorySource: the trajectory must be a column vector, not "
                f"{trajectory.rows()} x {trajectory.cols()}."
            )
        if self._order < 0:
            raise RuntimeError(f"TrajectorySource: output_derivative_order must not be negative, got {self._order}.")
        self._derivatives = [trajectory.MakeDerivative(k) for k in range(1, self._order + 1)]
        self._trajectory = kept(trajectory)

    @checked
    def UpdateTrajectory(self, trajectory: Trajectory) -> None:
        """Follows another trajectory of the same size from now on; contexts must be told their cache is out of date."""
        if trajectory.rows() != self._trajectory.rows():
            raise RuntimeError(
                f"TrajectorySource.UpdateTrajectory(): the trajectory must have {self._trajectory.rows()} rows, not "
                f"{trajectory.rows()}."
            )
        self._set(trajectory)
        old, self._arrays = self._arrays, None
        if old is not None and self._kernel() is self._outputs[0].calc:
            new = self._make_arrays()
            if all(a.shape == b.shape for a, b in zip(old, new)):
                for a, b in zip(old, new):
                    a[...] = b
                self._arrays = old  # which contexts know
                return
        self._compute_natively(0, self._kernel())
        for store in (store for stores in self._stores for store in list(stores)):
            store.restructure()
        self._stores = []

    def _kernel(self) -> Kernel | None:
        """What computes the output on doubles, if not Python."""
        if type(self._trajectory) is PiecewiseQuaternionSlerp and self._order == 0:
            return paths.turn_of_time
        return paths.polynomials_of_time if is_piecewise(self._trajectory) else None

    def _make_arrays(self) -> Any:
        """Constant arrays for the kernel."""
        if self._kernel() is paths.turn_of_time:
            trajectory: Any = self._trajectory
            return paths.Turns(np.array(trajectory.get_segment_times(), float), np.array(trajectory._q, float))
        path = as_piecewise_polynomial(self._trajectory)
        return pieces_of([path, *(path.derivative(k) for k in range(1, self._order + 1))], self._zero)

    def _kernel_models(self, root: Any) -> dict:
        if self._kernel() is None:
            return {}
        self._stores.append(root.stores())
        if self._arrays is None:
            self._arrays = self._make_arrays()
        return {"path_model": self._arrays, "turn_model": self._arrays}

    def _converted(self, scalar: Any) -> Any:
        new = super()._converted(scalar)
        if new is not None:
            new._arrays, new._stores = None, []
        return new

    def _calc(self, context: Context, output: BasicVector) -> None:
        t = context.get_time()
        time = number_of(t)
        parts = [value_at(self._trajectory, t).ravel()]
        inside = self._trajectory.start_time() <= time <= self._trajectory.end_time()
        for derivative in self._derivatives:
            parts.append(np.zeros(len(parts[0])) if self._zero and not inside else value_at(derivative, t).ravel())
        output.SetFromVector(np.concatenate(parts))


def pieces_of(functions: list[PiecewisePolynomial], zero_outside: bool = False) -> paths.Pieces:
    """A piecewise polynomial and its derivatives, to be evaluated together; elements of a matrix row by row."""
    size, powers = functions[0].rows() * functions[0].cols(), max(c.shape[-1] for c in functions[0]._c)
    c = np.zeros((len(functions[0]._c), powers, size * len(functions)))
    for k, function in enumerate(functions):
        for i, piece in enumerate(function._c):
            c[i, : piece.shape[-1], k * size : (k + 1) * size] = piece.reshape(size, -1).T
    form = np.array([powers, size if zero_outside else c.shape[-1]], np.int64)
    breaks = np.array(functions[0].get_segment_times(), float)
    return paths.Pieces(breaks, c.reshape(-1, c.shape[-1]), form)


def number_of(t: Any) -> float:
    """A time without derivatives; an expression has no variables."""
    return t if isinstance(t, float) else t.value() if hasattr(t, "value") else t.Evaluate()


def value_at(trajectory: Trajectory, t: Any) -> np.ndarray:
    """The value at a time [s], a float, a dual number or an expression without variables."""
    value = trajectory.value(number_of(t))
    if not hasattr(t, "derivatives") or not len(t.derivatives()):
        return value
    slope = trajectory.EvalDerivative(t.value())
    return filled(np.asarray(value, float), np.multiply.outer(np.asarray(slope, float).ravel(), t.derivatives()))


@checked
class TrajectoryAffineSystem(StateSpace):
    """x' = A(t) x + B(t) u + f0(t) (or the next x), y = C(t) x + D(t) u + y0(t).

    Args:
        A: Trajectory of shape (n, n).
        B: Trajectory of shape (n, m).
        f0: Trajectory of shape (n, 1).
        C: Trajectory of shape (k, n).
        D: Trajectory of shape (k, m).
        y0: Trajectory of shape (k, 1).
        time_period: Period of the discrete update [s]; 0: continuous.
    """

    _generic = True
    _symbolic = False

    def __init__(
        self,
        A: Any,
        B: Any,
        f0: Any,
        C: Any,
        D: Any,
        y0: Any,
        time_period: float = 0.0,
    ):
        super().__init__()
        self._of = {"A": A, "B": B, "f0": f0, "C": C, "D": D, "y0": y0}
        self._period = float(time_period)
        n, m, k = self._check()
        if m:
            self.DeclareVectorInputPort("u0", m)
        kernel = self._kernel()
        declare_motion(self, TrajectoryAffineSystem, n, kernel)
        if k:
            self.DeclareVectorOutputPort("y0", k, self._calc)
            self._compute_natively(0, kernel)
            if kernel is not None:
                self._output_models[0] = self._models("C", "D", "y0")

    def _kernel(self) -> Kernel | None:
        """What computes on doubles; None if a coefficient is no polynomial between breaks."""
        if type(self) not in (TrajectoryAffineSystem, TrajectoryLinearSystem):
            return None  # a class of a user may compute coefficients in its own way
        if not all(is_piecewise(t) for t in self._of.values() if t is not None and t.rows() * t.cols()):
            return None
        return paths.affine_in_discrete_state if self._period > 0 else paths.affine_in_continuous_state

    def _models(self, M: str, N: str, offset: str) -> dict[str, Any]:
        """The coefficients of a map, for its kernel."""
        names = {"by_state_model": M, "by_input_model": N, "offset_model": offset}
        return {key: self._pieces_of(name) for key, name in names.items()}

    def _pieces_of(self, name: str) -> paths.Pieces:
        trajectory = self._of[name]
        if trajectory is None or not trajectory.rows() * trajectory.cols():
            return pieces_of([PiecewisePolynomial(self._at(name, 0.0) if trajectory is None else np.zeros((1, 1)))])
        return pieces_of([as_piecewise_polynomial(trajectory)])

    def _kernel_models(self, root: Any) -> dict:
        return self._models("A", "B", "f0") if self._kernel() is not None else {}

    def _check(self) -> tuple[int, int, int]:
        shapes = {name: (t.rows(), t.cols()) for name, t in self._of.items() if t is not None}
        n, m = shapes["B"]
        k = shapes["C"][0]
        wanted = {"A": (n, n), "B": (n, m), "f0": (n, 1), "C": (k, n), "D": (k, m), "y0": (k, 1)}
        if any(shapes[name] != wanted[name] for name in shapes):
            raise RuntimeError(f"{type(self).__name__}: the sizes of the coefficients do not fit: {shapes}.")
        return n, m, k

    def _at(self, name: str, t: float) -> np.ndarray:
        trajectory = self._of[name]
        if trajectory is None:
            return np.zeros((self._of["B" if name == "f0" else "C"].rows(), 1))
        return value_at(trajectory, t)

    def _state(self, context: Context) -> np.ndarray:
        x = context.get_discrete_state_vector() if self._period > 0 else context.get_continuous_state_vector()
        return x.CopyToVector()

    def _map(self, context: Context, M: str, N: str, offset: str) -> np.ndarray:
        t = context.get_time()
        out = self._at(offset, t).ravel()
        if self._xc_counts[2] or self._xd_models:
            out = out + self._at(M, t) @ self._state(context)
        if self._inputs:
            out = out + self._at(N, t) @ self.get_input_port(0).Eval(context)
        return out

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._map(context, "C", "D", "y0"))

    def _update(self, context: Context, x_next: DiscreteValues) -> None:
        x_next.set_value(self._map(context, "A", "B", "f0"))

    def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
        derivatives.SetFromVector(self._map(context, "A", "B", "f0"))

    def A(self, t: float, /) -> np.ndarray:
        """Coefficient at time t [s]."""
        return self._at("A", t)

    def B(self, t: float, /) -> np.ndarray:
        """Coefficient at time t [s]."""
        return self._at("B", t)

    def C(self, t: float, /) -> np.ndarray:
        """Coefficient at time t [s]."""
        return self._at("C", t)

    def D(self, t: float, /) -> np.ndarray:
        """Coefficient at time t [s]."""
        return self._at("D", t)

    def f0(self, t: float, /) -> np.ndarray:
        """Coefficient at time t [s]."""
        return self._at("f0", t).ravel()

    def y0(self, t: float, /) -> np.ndarray:
        """Coefficient at time t [s]."""
        return self._at("y0", t).ravel()


@checked
class TrajectoryLinearSystem(TrajectoryAffineSystem):
    """x' = A(t) x + B(t) u (or the next x), y = C(t) x + D(t) u.

    Args:
        A: Trajectory of shape (n, n).
        B: Trajectory of shape (n, m).
        C: Trajectory of shape (k, n).
        D: Trajectory of shape (k, m).
        time_period: Period of the discrete update [s]; 0: continuous.
    """

    def __init__(
        self,
        A: Any,
        B: Any,
        C: Any,
        D: Any,
        time_period: float = 0.0,
    ):
        super().__init__(A, B, None, C, D, None, time_period)
