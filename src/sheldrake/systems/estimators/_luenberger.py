"""Observers that run a copy of the observed system and correct it by the error of its output."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import overload, overloaded
from sheldrake.systems.controllers import DiscreteTimeLinearQuadraticRegulator, LinearQuadraticRegulator
from sheldrake.systems.controllers._lqr import matrix, symmetric_matrix
from sheldrake.systems.estimators._kernels import observer as kernels
from sheldrake.systems.framework import (
    BasicVector,
    Context,
    ContinuousState,
    DiscreteValues,
    LeafSystem,
    System,
)
from sheldrake.systems.framework._port_getters import input_port, output_port
from sheldrake.systems.primitives import AffineSystem, Linearize, LinearSystem

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class LuenbergerObserver(LeafSystem):
    """Estimates the state of a system from its input u and its output y.

    x̂' = f(x̂, u) + L (y - g(x̂, u)), or the same for the next x̂ of a discrete system.

    Args:
        observed_system: With one output, at most one input, and continuous state or one group of discrete state.
        observed_system_context: Its parameters. The first estimate is zero, whatever state it holds.
        observer_gain: L, shape `(n, num_outputs)`.

    Raises:
        RuntimeError: the gain has another shape, or the system is of another kind.
    """

    _generic = True
    _kept_systems = (("_system", "_context"),)

    def __init__(self, observed_system: System, observed_system_context: Any, observer_gain: Any):
        super().__init__()
        observed_system.ValidateContext(observed_system_context)
        if observed_system.num_output_ports() != 1 or observed_system.num_input_ports() > 1:
            raise RuntimeError(
                "LuenbergerObserver(): the observed system must have one output and at most one input; it has "
                f"{observed_system.num_output_ports()} and {observed_system.num_input_ports()}."
            )
        self._system, self._context = observed_system, observed_system_context.Clone()
        self._discrete = self._context.has_only_discrete_state()
        if self._discrete:
            x = np.zeros(self._context.get_discrete_state_vector().size())
        elif self._context.has_only_continuous_state():
            x = np.zeros(self._context.num_continuous_states())
        else:
            raise RuntimeError("LuenbergerObserver(): the state must be continuous, or one group of discrete state.")
        size = observed_system.get_output_port().size()
        self._gain = np.array(observer_gain, dtype=float)
        if self._gain.shape != (x.size, size):
            raise RuntimeError(
                f"LuenbergerObserver(): observer_gain must be {x.size} x {size}, it is {self._gain.shape}."
            )
        self._declare(x, size)

    def _declare(self, x: np.ndarray, output_size: int) -> None:
        self.DeclareVectorInputPort("observed_system_output", output_size)
        if self._system.num_input_ports():
            self.DeclareVectorInputPort("observed_system_input", self._system.get_input_port(0).size())
        if self._is_linear():
            self._declare_scratch(kernels.Error(np.zeros(output_size)))
        if not self._discrete:
            self.DeclareStateOutputPort("estimated_state", self.DeclareContinuousState(BasicVector(x)))
            if self._is_linear():
                self.DeclareTimeDerivatives(kernels.rate_of_estimate)
            return
        self.DeclareStateOutputPort("estimated_state", self.DeclareDiscreteState(x))
        timing = self._system.GetUniquePeriodicDiscreteUpdateAttribute()
        if timing is None:
            raise RuntimeError("LuenbergerObserver(): a discrete system must have one periodic update.")
        update = kernels.next_estimate if self._is_linear() else self._update
        self.DeclarePeriodicDiscreteUpdateEvent(timing.period_sec(), timing.offset_sec(), update)

    def _is_linear(self) -> bool:
        """Whether a kernel computes it; an observer of another system asks that in Python."""
        return isinstance(self._system, AffineSystem)

    def _kernel_models(self, root: Any) -> dict:
        if not self._is_linear():
            return {}
        system: Any = self._system
        return {"system_model": system._kernel_models(root)["model"], "gain_model": kernels.Gain(self._gain)}

    def _correction(self, context: Context, x: np.ndarray) -> np.ndarray:
        """Puts estimate and input into the copy; returns L times the error of the output."""
        system, copy = self._system, self._context
        if self._discrete:
            copy.SetDiscreteState(x)
        else:
            copy.SetContinuousState(x)
        copy.SetTime(context.get_time())
        if system.num_input_ports():
            system.get_input_port(0).FixValue(copy, self.get_input_port(1).Eval(context))
        return self._gain @ (self.get_input_port(0).Eval(context) - system.get_output_port(0).Eval(copy))

    def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
        """The derivative of the estimate."""
        if self._discrete:
            return
        correction = self._correction(context, context.get_continuous_state_vector().CopyToVector())
        rates = self._system.EvalTimeDerivatives(self._context).CopyToVector()
        derivatives.get_mutable_vector().SetFromVector(rates + correction)

    def _update(self, context: Context, discrete_state: DiscreteValues) -> None:
        correction = self._correction(context, context.get_discrete_state_vector().CopyToVector())
        following = self._system.EvalUniquePeriodicDiscreteUpdate(self._context).value()
        discrete_state.set_value(following + correction)

    def L(self) -> np.ndarray:
        """Returns the gain, shape `(n, num_outputs)`."""
        return self._gain.copy()

    def observer_gain(self) -> np.ndarray:
        """Returns the gain, shape `(n, num_outputs)`."""
        return self._gain.copy()

    get_observed_system_output_input_port = input_port(
        "observed_system_output", "Returns the input for the observed system's output."
    )
    get_observed_system_input_input_port = input_port(
        "observed_system_input", "Returns the input for the observed system's input; there is one if that has one."
    )
    get_estimated_state_output_port = output_port(0, "Returns the output with the estimate.")


def _check(call: str, A: np.ndarray, C: np.ndarray, W: np.ndarray, V: np.ndarray) -> None:
    symmetric_matrix(call, "W", W, len(A))
    if np.linalg.eigvalsh(symmetric_matrix(call, "V", V, len(C))).min(initial=np.inf) <= 0.0:
        raise RuntimeError(f"{call}(): V must be positive definite")


def DiscreteTimeSteadyStateKalmanFilter(A: ArrayLike, C: ArrayLike, W: ArrayLike, V: ArrayLike) -> np.ndarray:
    """Returns the observer gain L that is best for x[k+1] = A x[k] + w[k], y[k] = C x[k] + v[k].

    Args:
        A: Shape `(n, n)`.
        C: Shape `(p, n)`.
        W: Covariance of w, shape `(n, n)`.
        V: Covariance of v, shape `(p, p)`, positive definite.

    Raises:
        RuntimeError: sizes do not fit, V is not positive definite, or there is no stable observer.
    """
    A, C, W, V = (matrix(x) for x in (A, C, W, V))
    _check("DiscreteTimeSteadyStateKalmanFilter", A, C, W, V)
    K, _ = DiscreteTimeLinearQuadraticRegulator(A.T, C.T, W, V)
    return K.T


def _gain(system: LinearSystem, W: ArrayLike, V: ArrayLike) -> np.ndarray:
    discrete = system.time_period() > 0.0
    solve: Any = DiscreteTimeSteadyStateKalmanFilter if discrete else SteadyStateKalmanFilter
    return solve(system.A(), system.C(), W, V)


def _of_linear_system(system: LinearSystem, W: ArrayLike, V: ArrayLike) -> LuenbergerObserver:
    return LuenbergerObserver(system, system.CreateDefaultContext(), _gain(system, W, V))


def _of_system_at(system: System, context: Context, W: ArrayLike, V: ArrayLike) -> LuenbergerObserver:
    return LuenbergerObserver(system, context, _gain(Linearize(system, context), W, V))


@typing_overload
def SteadyStateKalmanFilter(A: ArrayLike, C: ArrayLike, W: ArrayLike, V: ArrayLike) -> np.ndarray: ...
@typing_overload
def SteadyStateKalmanFilter(system: LinearSystem, W: ArrayLike, V: ArrayLike) -> LuenbergerObserver: ...
@typing_overload
def SteadyStateKalmanFilter(system: System, context: Context, W: ArrayLike, V: ArrayLike) -> LuenbergerObserver: ...
@overloaded(
    overload(_of_system_at, system=instance_of(System), context=instance_of(Context), W=matrix, V=matrix),
    overload(_of_linear_system, system=instance_of(LinearSystem), W=matrix, V=matrix),
    overload(A=matrix, C=matrix, W=matrix, V=matrix),
)
def SteadyStateKalmanFilter(A: np.ndarray, C: np.ndarray, W: np.ndarray, V: np.ndarray) -> Any:
    """Returns the observer gain that is best for white noise in state and output.

    Called as

    - `SteadyStateKalmanFilter(A, C, W, V)`: the gain L for x' = A x + w, y = C x + v;
    - `SteadyStateKalmanFilter(system, W, V)` with a LinearSystem: the observer;
    - `SteadyStateKalmanFilter(system, context, W, V)`: the observer of any system, linearized at an equilibrium.

    W and V are the intensities of the noise in state and output.

    Raises:
        RuntimeError: sizes do not fit, V is not positive definite, or there is no stable observer.
    """
    _check("SteadyStateKalmanFilter", A, C, W, V)
    K, _ = LinearQuadraticRegulator(A.T, C.T, W, V)
    return K.T
