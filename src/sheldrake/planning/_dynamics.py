"""The dynamics of a system as a function of state and input, with derivatives."""

from __future__ import annotations

import functools
from collections import OrderedDict
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, SupportsIndex

import numpy as np

from sheldrake.common._bound_calls import BoundCalls
from sheldrake.common.kernel import Bound
from sheldrake.planning._kernels import curvature
from sheldrake.solvers import _arrays
from sheldrake.symbolic import Expression, Variable
from sheldrake.symbolic._tape import AtPoints, write
from sheldrake.systems.framework import InputPortSelection
from sheldrake.systems.framework._engine.linear_rows import ByComplexSteps, rows_of_motion
from sheldrake.systems.primitives import SymbolicVectorSystem

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context, System
    from sheldrake.systems.framework._port import InputPort

_KEPT = 256  # Values kept, so that neighbouring constraints share those of a sample.


def input_port_of(system: System, input_port_index: InputPortSelection | SupportsIndex) -> InputPort | None:
    """The chosen input port, or None.

    Raises:
        RuntimeError: the port is not a vector port.
    """
    if input_port_index is InputPortSelection.kNoInput:
        return None
    if input_port_index is InputPortSelection.kUseFirstInputIfItExists:
        port = system.get_input_port(0) if system.num_input_ports() else None
    else:
        port = system.get_input_port(int(input_port_index))
    if port is not None and port.get_data_type().name == "kAbstractValued":
        raise RuntimeError(
            f"The input port {port.get_name()} of system {system.get_name()} is abstract; an input that is optimized "
            "must be a vector port."
        )
    return port


def _points_and_neighbours(count: int, n: int, m: int) -> tuple[Bound, curvature.Differences]:
    z, moved, H = np.zeros((count, n)), np.zeros(((n + 1) * count, n)), np.zeros((count, n * n))
    work = curvature.Differences(z, moved, np.zeros((len(moved), m * n)), np.zeros((count, m)), H)
    return curvature.take_differences.bind(work, curvature.MOVE), work


_differences = BoundCalls(_points_and_neighbours)


def _key(x: np.ndarray, u: np.ndarray, t: float | None) -> bytes:
    return x.tobytes() + u.tobytes() + np.float64(0.0 if t is None else t).tobytes()


class Dynamics:
    """xdot = f(t, x, u), or x+ = f(t, x, u) of a system with one periodic update, with derivatives by AutoDiffXd.

    Args:
        system: The system; it must convert to AutoDiffXd.
        context: Its parameters and other inputs.
        input_port_index: The input u.
        discrete: Whether the state is discrete.
    """

    def __init__(
        self, system: System, context: Context, input_port_index: InputPortSelection | SupportsIndex, discrete: bool
    ):
        port = input_port_of(system, input_port_index)
        self.num_inputs = port.size() if port is not None else 0
        self._place = None if port is None else int(port.get_index())
        self._discrete = discrete
        self._system = system
        self._context = system.CreateDefaultContext()
        self._context.SetTimeStateAndParametersFrom(context)
        system.FixInputPortsFrom(system, context, self._context)
        self._time = context.get_time()
        self._duals = system.ToAutoDiffXd()
        self.num_states = context.num_total_states() if discrete else context.num_continuous_states()
        self._function: Callable[..., Any] | None = None
        self._of_points: Callable[..., Any] | None = None
        self._symbols_may_do = True
        self._symbols: AtPoints | None = None
        self._known: OrderedDict[bytes, tuple[np.ndarray, np.ndarray]] = OrderedDict()
        self._values: OrderedDict[bytes, np.ndarray] = OrderedDict()

    @functools.cached_property
    def _dual_context(self) -> Context:
        """A context for duals; kernels need none."""
        out = self._duals.CreateDefaultContext()
        out.SetTimeStateAndParametersFrom(self._context)
        out.SetTime(self._time)
        self._duals.FixInputPortsFrom(self._system, self._context, out)
        return out

    def _set(self, system: System, context: Context, t: Any, x: np.ndarray, u: np.ndarray) -> None:
        if t is not None:
            context.SetTime(t)
        if self._place is not None and self.num_inputs:
            system.get_input_port(self._place).FixValue(context, u)
        if self._discrete:
            context.SetDiscreteState(x)
        else:
            context.SetContinuousState(x)

    def _at(self, system: System, context: Context, t: Any, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        self._set(system, context, t, x, u)
        if self._discrete:
            return system.EvalUniquePeriodicDiscreteUpdate(context).value()
        return system.EvalTimeDerivatives(context).CopyToVector()

    def value(self, x: np.ndarray, u: np.ndarray, t: float | None = None) -> np.ndarray:
        """f, shape (nx,)."""
        key = _key(x, u, t)
        found = self._values.get(key)
        if found is None:
            found = self._values[key] = self._value(x, u, t)
            if len(self._values) > _KEPT:
                self._values.popitem(last=False)
        return found

    def value_and_slope(self, x: np.ndarray, u: np.ndarray, t: float | None = None) -> tuple[np.ndarray, np.ndarray]:
        """f and its derivatives by (x, u), shapes (nx,) and (nx, nx + nu)."""
        key = _key(x, u, t)
        found = self._known.get(key)
        if found is None:
            found = self._by_rows(x, u, t) or self._by_duals(x, u, t)
            self._known[key] = found
            if len(self._known) > _KEPT:
                self._known.popitem(last=False)
        return found

    def at_points(self, z: np.ndarray, with_slopes: bool) -> tuple[np.ndarray, np.ndarray]:
        """f and its derivatives at many (x, u) and the time of the context.

        Args:
            z: States and inputs, shape (points, nx + nu).
            with_slopes: Whether derivatives are wanted.

        Returns:
            Shapes (points, nx) and (points, nx, nx + nu); the latter without rows if derivatives are not wanted.
        """
        if self._of_points is None and self._symbols_may_do:
            self._symbols_may_do = False
            symbols = self._by_symbols()
            if symbols is not None:
                found = symbols(z, True)
                if all(np.allclose(a, b, 1e-8, 1e-10) for a, b in zip(found, self._one_by_one(z, True))):
                    self._of_points, self._symbols = symbols, symbols
        if self._of_points is None and len(z):
            self.value_and_slope(z[0, : self.num_states], z[0, self.num_states :])  # may find out how many are done
        if self._of_points is not None:
            found = self._of_points(z, with_slopes)
            if found is not None:
                return found
        return self._one_by_one(z, with_slopes)

    def hessian_at_points(self, z: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Second derivatives of weights' f at many (x, u), shape (points, nx + nu, nx + nu).

        Args:
            z: States and inputs, shape (points, nx + nu).
            weights: Shape (points, nx).
        """
        if self._symbols is not None:
            return self._symbols.hessian(z, weights)
        count, n = z.shape
        take, work = _differences.of(count, n, self.num_states)
        work.z[:], work.weights[:] = z, weights
        take.set("what", curvature.MOVE)
        take()
        work.J[:] = self.at_points(work.moved, True)[1].reshape(work.J.shape)
        take.set("what", curvature.DIFFERENCE)
        take()
        return work.H.reshape(count, n, n).copy()

    @functools.cached_property
    def may_depend_on_time(self) -> bool:
        """Whether f may depend on time: not where kernels move the system that do not ask for it."""
        self._set(self._system, self._context, None, np.zeros(self.num_states), np.zeros(self.num_inputs))
        place = self._place if self.num_inputs else None
        found = rows_of_motion(self._system, self._context, self.num_states, place, None, self._discrete)
        return found is None or found[0].asks_for_time()

    def _one_by_one(self, z: np.ndarray, with_slopes: bool) -> tuple[np.ndarray, np.ndarray]:
        nx = self.num_states
        if not with_slopes:
            return np.array([self.value(p[:nx], p[nx:]) for p in z]), np.zeros((len(z), 0, z.shape[1]))
        found = [self.value_and_slope(p[:nx], p[nx:]) for p in z]
        return np.array([f for f, _ in found]), np.array([J for _, J in found])

    def _by_symbols(self) -> AtPoints | None:
        """The motion as expressions, which a kernel evaluates at all points at once; None where it cannot be had.

        Systems of kernels have their own way. Those in Python run once on symbols: where they branch on their state, or
        where a user's code does not take symbols at all, it may raise whatever it likes.
        """
        of_symbols = isinstance(self._system, SymbolicVectorSystem)
        if self._discrete or (self._system._is_generic() and not of_symbols):
            return None
        try:
            system = self._system.ToSymbolicMaybe()
            if system is None:
                return None
            context = system.CreateDefaultContext()
            context.SetTimeStateAndParametersFrom(self._context)
            system.FixInputPortsFrom(self._system, self._context, context)
            variables = np.array([Variable(f"z{i}") for i in range(self.num_states + self.num_inputs)])
            z = np.array([Expression(v) for v in variables])
            f = self._at(system, context, None, z[: self.num_states], z[self.num_states :])
            written = write([Expression(e) for e in f], variables.tolist(), smooth=True)
            return None if written is None else AtPoints(written)
        except Exception:
            return None

    def _value(self, x: np.ndarray, u: np.ndarray, t: float | None) -> np.ndarray:
        if self._function is not None:
            found = self._function(self._time if t is None else t, np.concatenate((x, u)), False)
            if found is not None:
                return found[0]
        return np.array(self._at(self._system, self._context, t, x, u))

    def _by_rows(self, x: np.ndarray, u: np.ndarray, t: float | None) -> tuple[np.ndarray, np.ndarray] | None:
        """The same from the kernels on the context of floats; None where others than kernels move the system."""
        if self._function is not None:
            return self._function(self._time if t is None else t, np.concatenate((x, u)), True)
        self._set(self._system, self._context, t, x, u)
        place = self._place if u.size else None
        found = rows_of_motion(self._system, self._context, self.num_states, place, None, self._discrete)
        if found is None:
            return None
        rows, seeds, wanted = found
        if isinstance(rows, ByComplexSteps):  # it stays what it is
            self._function = rows.function(seeds, wanted)
            self._of_points = rows.function_of_points(seeds, wanted)
        return rows.evaluate(seeds, wanted)

    def _by_duals(self, x: np.ndarray, u: np.ndarray, t: float | None) -> tuple[np.ndarray, np.ndarray]:
        duals = _arrays.variables_at(np.concatenate((x, u)))
        time = None if t is None else _arrays.duals(np.array([t]), np.zeros((1, duals.size)))[0]
        y = self._at(self._duals, self._dual_context, time, duals[: x.size], duals[x.size :])
        values, J = _arrays.values_and_gradient(np.asarray(y, dtype=object))
        return values, J if J.size else np.zeros((values.size, duals.size))
