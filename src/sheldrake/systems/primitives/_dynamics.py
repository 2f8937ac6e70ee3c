"""Systems with state: integrators, filters, holds, delays, linear systems."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.common.value import AbstractValue
from sheldrake.systems.framework import BasicVector, LeafSystem
from sheldrake.systems.framework._vector import as_vector, is_size
from sheldrake.systems.primitives._kernels import blocks


class Integrator(LeafSystem):
    """Integral of the input, continuous.

    Args:
        size: Size; or
        initial_value: the integral at the beginning.
    """

    _generic = True

    def __init__(self, *args: Any, **kwargs: Any):
        super().__init__()
        given = next(iter((*args, *kwargs.values())))
        initial = np.zeros(int(given)) if is_size(given) else as_vector(given)
        self.DeclareVectorInputPort("u0", len(initial))
        self.DeclareStateOutputPort("y0", self.DeclareContinuousState(BasicVector(initial)))
        self._declare_time_derivatives(blocks.copy_input)

    def set_integral_value(self, context: Any, value: Any) -> None:
        """Sets the integral in a context."""
        self.ValidateContext(context)
        context.SetContinuousState(value)

    def set_default_integral_value(self, initial_value: Any) -> None:
        """Sets the integral in contexts made from now on."""
        self._xc_model.SetFromVector(initial_value)
        self._defaults_changed()


class FirstOrderLowPassFilter(LeafSystem):
    """x' = (u - x) / time constant, element-wise; the output is x.

    Args:
        time_constant: Time constant [s].
        size: Size.
        time_constants: One for each element, instead of the above.
    """

    _generic = True

    def __init__(self, time_constant: Any = None, size: int = 1, *, time_constants: Any = None):
        super().__init__()
        given = time_constant if time_constants is None else time_constants
        self._tau = as_vector(given) if np.ndim(given) else np.full(int(size), float(given))
        if not np.all(self._tau > 0):
            raise RuntimeError(f"FirstOrderLowPassFilter: time constants must be positive, got {self._tau.tolist()}.")
        n = len(self._tau)
        self.DeclareVectorInputPort("u0", n)
        self.DeclareStateOutputPort("y0", self.DeclareContinuousState(n))
        self._declare_time_derivatives(blocks.low_pass)

    def _kernel_models(self, root: Any) -> dict:
        return {"model": self._tau}

    def get_time_constant(self) -> float:
        """The time constant [s].

        Raises:
            ValueError: elements have different ones.
        """
        if not np.all(self._tau == self._tau[0]):
            raise ValueError("Time constants vector is not constant; use get_time_constants_vector() instead.")
        return float(self._tau[0])

    def get_time_constants_vector(self) -> np.ndarray:
        """Time constants [s], shape (size,)."""
        return self._tau.copy()

    def set_initial_output_value(self, context: Any, z0: Any, /) -> None:
        """Sets the output in a context."""
        self.ValidateContext(context)
        context.SetContinuousState(z0)


class ZeroOrderHold(LeafSystem):
    """The input, sampled periodically and held.

    Args:
        period_sec: Period [s].
        vector_size: Size; or
        abstract_model_value: an AbstractValue of the type.
        offset_sec: Time of the first sample [s].
    """

    _generic = True

    def __init__(
        self,
        period_sec: float,
        vector_size: Any = None,
        offset_sec: float = 0.0,
        *,
        abstract_model_value: AbstractValue | None = None,
    ):
        super().__init__()
        self._period, self._offset = float(period_sec), float(offset_sec)
        model = vector_size if abstract_model_value is None else abstract_model_value
        if isinstance(model, AbstractValue):
            self.DeclareAbstractInputPort("u", model)
            self.DeclareStateOutputPort("y", self.DeclareAbstractState(model))
            self.DeclarePeriodicUnrestrictedUpdateEvent(self._period, self._offset, self._hold_value)
        else:
            self.DeclareVectorInputPort("u", int(model))
            self.DeclareStateOutputPort("y", self.DeclareDiscreteState(int(model)))
            self.DeclarePeriodicDiscreteUpdateEvent(self._period, self._offset, blocks.copy_input)

    def _hold_value(self, context: Any, state: Any) -> None:
        state.get_mutable_abstract_state(0).SetFrom(self.get_input_port(0).EvalAbstract(context))

    def period(self) -> float:
        """Period [s]."""
        return self._period

    def offset(self) -> float:
        """Time of the first sample [s]."""
        return self._offset

    def SetVectorState(self, context: Any, value: Any, /) -> None:
        """Sets what is held, in a context."""
        self.ValidateContext(context)
        context.SetDiscreteState(value)


class DiscreteTimeDelay(LeafSystem):
    """The input, as it was some samples ago.

    Args:
        update_sec: Period of sampling [s].
        delay_time_steps: How many samples ago.
        vector_size: Size; or
        abstract_model_value: an AbstractValue of the type.
    """

    _generic = True

    def __init__(
        self,
        update_sec: float,
        delay_time_steps: int,
        vector_size: Any = None,
        *,
        abstract_model_value: AbstractValue | None = None,
    ):
        super().__init__()
        steps, model = int(delay_time_steps), vector_size if abstract_model_value is None else abstract_model_value
        if isinstance(model, AbstractValue):
            self.DeclareAbstractInputPort("u", model)
            oldest = self.DeclareAbstractState(model)
            for _ in range(steps + 1):  # one more than samples, as Drake has
                self.DeclareAbstractState(model)
            self.DeclareStateOutputPort("delayed_u", oldest)
            self.DeclarePeriodicUnrestrictedUpdateEvent(float(update_sec), 0.0, self._shift)
        else:
            n = int(model)
            self.DeclareVectorInputPort("u", n)
            self.DeclareDiscreteState((steps + 1) * n)
            self.DeclareVectorOutputPort("delayed_u", n, blocks.first_elements)
            self.DeclarePeriodicDiscreteUpdateEvent(float(update_sec), 0.0, blocks.delay)

    def _shift(self, context: Any, state: Any) -> None:
        values = state.get_mutable_abstract_state()
        last = values.size() - 2
        for k in range(last):
            values.get_mutable_value(k).SetFrom(context.get_abstract_state(k + 1))
        values.get_mutable_value(last).SetFrom(self.get_input_port(0).EvalAbstract(context))


class DiscreteTimeIntegrator(LeafSystem):
    """Sum of the input times the time step.

    Args:
        size: Size.
        time_step: Time step [s].
    """

    _generic = True

    def __init__(self, size: int, time_step: float):
        super().__init__()
        self._dt = float(time_step)
        self.DeclareVectorInputPort("u", int(size))
        self.DeclareStateOutputPort("y", self.DeclareDiscreteState(int(size)))
        self.DeclarePeriodicDiscreteUpdateEvent(self._dt, 0.0, blocks.euler)

    def _kernel_models(self, root: Any) -> dict:
        return {"step_model": blocks.Step(np.array([self._dt]))}

    def set_integral_value(self, context: Any, value: Any) -> None:
        """Sets the sum in a context."""
        self.ValidateContext(context)
        context.SetDiscreteState(value)

    def time_step(self) -> float:
        """Time step [s]."""
        return self._dt


class WrapToSystem(LeafSystem):
    """The input, with chosen elements wrapped into an interval.

    Args:
        input_size: Size.
    """

    _generic = True

    def __init__(self, input_size: int, /):
        super().__init__()
        self._intervals = np.zeros((int(input_size), 2))
        self.DeclareVectorInputPort("u0", int(input_size))
        self.DeclareVectorOutputPort("y0", int(input_size), blocks.wrap)

    def set_interval(self, index: int, low: float, high: float, /) -> None:
        """Wraps element `index` into [low, high)."""
        if not 0 <= index < len(self._intervals) or not high > low:
            raise RuntimeError(
                f"WrapToSystem.set_interval(): index {index} must be within [0, {len(self._intervals)}) and "
                f"high {high} above low {low}."
            )
        self._intervals[index] = low, high

    def _kernel_models(self, root: Any) -> dict:
        return {"model": self._intervals}


class AffineSystem(LeafSystem):
    """x' = A x + B u + f0 (or the next x), y = C x + D u + y0.

    Args:
        A: Shape (n, n).
        B: Shape (n, m).
        f0: Shape (n,).
        C: Shape (k, n).
        D: Shape (k, m).
        y0: Shape (k,).
        time_period: Period of the discrete update [s]; 0: continuous.
    """

    _generic = True

    def __init__(
        self,
        A: Any = None,
        B: Any = None,
        f0: Any = None,
        C: Any = None,
        D: Any = None,
        y0: Any = None,
        time_period: float = 0.0,
    ):
        super().__init__()
        self._set_up(_sized(A, B, f0, C, D, y0), float(time_period))

    def _set_up(self, coefficients: blocks.Affine, period: float) -> None:
        if not period >= 0:
            raise RuntimeError(f"{type(self).__name__}: time_period must not be negative, got {period}.")
        self._coefficients, self._period = coefficients, period
        self._covariance: np.ndarray | None = None
        k, m = coefficients.D.shape
        n = len(coefficients.f0)
        if m:
            self.DeclareVectorInputPort("u0", m)
        if n and period > 0:
            self.DeclareDiscreteState(n)
            update = blocks.affine_next if m else blocks.autonomous_next
            self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, update)
        elif n:
            self.DeclareContinuousState(n)
            self._declare_time_derivatives(blocks.affine_derivatives if m else blocks.autonomous_derivatives)
        if k:
            through = np.any(coefficients.D != 0)
            self.DeclareVectorOutputPort("y0", k, blocks.affine_output if through else blocks.affine_output_of_state)

    def _kernel_models(self, root: Any) -> dict:
        return {"model": self._coefficients}

    def UpdateCoefficients(
        self, A: Any = None, B: Any = None, f0: Any = None, C: Any = None, D: Any = None, y0: Any = None
    ) -> None:
        """Replaces coefficients; those not given become zero. Sizes and feedthrough stay as they are.

        Raises:
            RuntimeError: a size differs.
        """
        old = self._coefficients
        for name, target, value in zip(old._fields, old, (A, B, f0, C, D, y0)):
            value = np.zeros(target.shape) if value is None else np.asarray(value, float)
            if value.shape != target.shape:
                raise RuntimeError(
                    f"{type(self).__name__}.UpdateCoefficients(): {name} has shape {target.shape}, got {value.shape}."
                )
            target[...] = value
        through = np.any(old.D != 0)
        if self._outputs and old.D.shape[1]:
            calc = blocks.affine_output if through else blocks.affine_output_of_state
            if self._outputs[0].calc is not calc:
                self._outputs[0].calc = calc
                self._changed()

    def _discrete_time_approximation(self, period: float) -> AffineSystem:
        """The same system as seen every `period` [s], its input held between."""
        from scipy.linalg import expm

        if self._period != 0:
            raise RuntimeError("DiscreteTimeApproximation(): the system is discrete already.")
        n, m = self.num_states(), self.num_inputs()
        M = np.zeros((n + m + 1, n + m + 1))
        M[:n, :n], M[:n, n : n + m], M[:n, n + m] = self.A(), self.B(), self.f0()
        E = expm(M * period)
        A, B, f0 = E[:n, :n], E[:n, n : n + m], E[:n, n + m]
        if isinstance(self, LinearSystem):
            return LinearSystem(A, B, self.C(), self.D(), period)
        return AffineSystem(A, B, f0, self.C(), self.D(), self.y0(), period)

    def A(self) -> np.ndarray:
        """Shape (n, n)."""
        return self._coefficients.A.copy()

    def B(self) -> np.ndarray:
        """Shape (n, m)."""
        return self._coefficients.B.copy()

    def C(self) -> np.ndarray:
        """Shape (k, n)."""
        return self._coefficients.C.copy()

    def D(self) -> np.ndarray:
        """Shape (k, m)."""
        return self._coefficients.D.copy()

    def f0(self) -> np.ndarray:
        """Shape (n,)."""
        return self._coefficients.f0.copy()

    def y0(self) -> np.ndarray:
        """Shape (k,)."""
        return self._coefficients.y0.copy()

    def num_states(self) -> int:
        """n."""
        return len(self._coefficients.f0)

    def num_inputs(self) -> int:
        """m."""
        return self._coefficients.D.shape[1]

    def num_outputs(self) -> int:
        """k."""
        return self._coefficients.D.shape[0]

    def time_period(self) -> float:
        """Period of the discrete update [s]; 0: continuous."""
        return self._period

    def configure_default_state(self, x0: Any) -> None:
        """Sets the default state."""
        x0 = as_vector(x0)
        if len(x0) != self.num_states():
            raise RuntimeError(
                f"{type(self).__name__}.configure_default_state(): the state has size {self.num_states()}, "
                f"got {len(x0)}."
            )
        if self.num_states():
            (self._xd_models[0] if self._period > 0 else self._xc_model).SetFromVector(x0)
            self._defaults_changed()

    def configure_random_state(self, covariance: Any) -> None:
        """Lets `SetRandomContext` add normal noise of this covariance, shape (n, n), to the default state."""
        self._covariance = np.array(covariance, float)

    def _set_random_context(self, context: Any, generator: Any) -> None:
        if self._covariance is None or not self.num_states():
            return
        values, vectors = np.linalg.eigh(self._covariance)
        normal = np.random.default_rng(int(generator())).standard_normal(self.num_states())
        x = context.get_discrete_state_vector() if self._period > 0 else context.get_continuous_state_vector()
        x.SetFromVector(x.CopyToVector() + vectors @ (np.sqrt(np.maximum(values, 0.0)) * normal))


class LinearSystem(AffineSystem):
    """x' = A x + B u (or the next x), y = C x + D u.

    Args:
        A: Shape (n, n).
        B: Shape (n, m).
        C: Shape (k, n).
        D: Shape (k, m).
        time_period: Period of the discrete update [s]; 0: continuous.
    """

    def __init__(self, A: Any = None, B: Any = None, C: Any = None, D: Any = None, time_period: float = 0.0):
        super().__init__(A, B, None, C, D, None, time_period)


class MatrixGain(LinearSystem):
    """y = D u.

    Args:
        D: Shape (k, m).
    """

    def __init__(self, D: Any):
        if np.ndim(D) not in (1, 2):
            raise TypeError(f"MatrixGain(): incompatible constructor arguments: D must be a matrix, got {D!r}")
        super().__init__(D=D)


def _sized(A: Any, B: Any, f0: Any, C: Any, D: Any, y0: Any) -> blocks.Affine:
    """Coefficients of consistent sizes; what is not given is zero."""
    given = {k: None if v is None else np.asarray(v, float) for k, v in zip("ABfCDy", (A, B, f0, C, D, y0))}
    for name in "ABCD":
        m = given[name]
        if m is not None and m.ndim == 1:
            given[name] = m.reshape(-1, 1) if m.size else m.reshape(0, 0)
    axes = {"A": "nn", "B": "nm", "f": "n", "C": "kn", "D": "km", "y": "k"}
    sizes: dict[str, int] = {}
    for name, dims in axes.items():
        m = given[name]
        if m is None or m.size == 0:
            continue
        for axis, size in zip(dims, m.shape):
            if sizes.setdefault(axis, size) != size:
                shapes = {k: v.shape for k, v in given.items() if v is not None}
                raise RuntimeError(f"AffineSystem: the sizes of the coefficients do not fit: {shapes}.")
    for name, dims in axes.items():  # an empty matrix may still tell a size, as (0, 2) does
        m = given[name]
        if m is not None and m.ndim == len(dims):
            for axis, size in zip(dims, m.shape):
                sizes.setdefault(axis, size)
    out = []
    for name, dims in axes.items():
        m = given[name]
        shape = tuple(sizes.get(axis, 0) for axis in dims)
        out.append(np.zeros(shape) if m is None or m.size == 0 else np.ascontiguousarray(m.reshape(shape)).copy())
    return blocks.Affine(*out)
