"""Systems with state: integrators, filters, holds, delays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import called, count, instance_of
from sheldrake.common._overloads import overload, overloaded
from sheldrake.common._scalars import float_vector, scalar
from sheldrake.common.value import AbstractValue
from sheldrake.systems.framework import BasicVector, LeafSystem
from sheldrake.systems.framework._declarations import vector_model
from sheldrake.systems.primitives._kernels import blocks

if TYPE_CHECKING:
    from numpy.typing import ArrayLike
    from typing_extensions import Self

    from sheldrake.common._types import Scalars
    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._engine.memory import RootView
    from sheldrake.systems.framework._state import State


class Integrator(LeafSystem):
    """Integral of the input, continuous.

    Args:
        size: Size; or
        initial_value: the integral at the beginning.
    """

    _generic = True
    _complex_rows = True

    @overloaded(overload(size=count), overload(initial_value=called("float array of shape (n,)")))
    def __init__(self, given: Any):
        super().__init__()
        initial = vector_model(given, "Integrator()").CopyToVector()
        self.DeclareVectorInputPort("u0", len(initial))
        self.DeclareStateOutputPort("y0", self.DeclareContinuousState(BasicVector(initial)))
        self.DeclareTimeDerivatives(blocks.copy_input)

    @checked
    def set_integral_value(self, context: Context, value: ArrayLike) -> None:
        """Sets the integral in a context."""
        self.ValidateContext(context)
        context.SetContinuousState(value)

    @checked
    def set_default_integral_value(self, initial_value: Scalars) -> None:
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
    _complex_rows = True

    @overloaded(overload(time_constant=scalar(float), size=(count, 1)), overload(time_constants=float_vector))
    def __init__(self, given: Any, size: int | None = None):
        super().__init__()
        self._tau = given if size is None else np.full(size, given)
        if not np.all(self._tau > 0):
            raise RuntimeError(f"FirstOrderLowPassFilter: time constants must be positive, got {self._tau.tolist()}.")
        n = len(self._tau)
        self.DeclareVectorInputPort("u0", n)
        self.DeclareStateOutputPort("y0", self.DeclareContinuousState(n))
        self.DeclareTimeDerivatives(blocks.low_pass)

    def _kernel_models(self, root: RootView) -> dict:
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

    @checked
    def set_initial_output_value(self, context: Context, z0: Scalars, /) -> None:
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

    @overloaded(
        overload(period_sec=scalar(float), vector_size=count, offset_sec=(scalar(float), 0.0)),
        overload(
            period_sec=scalar(float), abstract_model_value=instance_of(AbstractValue), offset_sec=(scalar(float), 0.0)
        ),
    )
    def __init__(self, period: float, model: int | AbstractValue, offset: float):
        super().__init__()
        self._period, self._offset = period, offset
        if isinstance(model, AbstractValue):
            self.DeclareAbstractInputPort("u", model)
            self.DeclareStateOutputPort("y", self.DeclareAbstractState(model))
            self.DeclarePeriodicUnrestrictedUpdateEvent(self._period, self._offset, self._hold_value)
        else:
            self.DeclareVectorInputPort("u", model)
            self.DeclareStateOutputPort("y", self.DeclareDiscreteState(model))
            self.DeclarePeriodicDiscreteUpdateEvent(self._period, self._offset, blocks.copy_input)

    def _hold_value(self, context: Context, state: State) -> None:
        state.get_mutable_abstract_state(0).SetFrom(self.get_input_port(0).EvalAbstract(context))

    def period(self) -> float:
        """Period [s]."""
        return self._period

    def offset(self) -> float:
        """Time of the first sample [s]."""
        return self._offset

    @checked
    def SetVectorState(self, context: Context, value: ArrayLike, /) -> None:
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

    @overloaded(
        overload(update_sec=scalar(float), delay_time_steps=count, vector_size=count),
        overload(update_sec=scalar(float), delay_time_steps=count, abstract_model_value=instance_of(AbstractValue)),
    )
    def __init__(self, period: float, steps: int, model: int | AbstractValue):
        super().__init__()
        if isinstance(model, AbstractValue):
            self.DeclareAbstractInputPort("u", model)
            oldest = self.DeclareAbstractState(model)
            for _ in range(steps + 1):  # one more than samples, as Drake has
                self.DeclareAbstractState(model)
            self.DeclareStateOutputPort("delayed_u", oldest)
            self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._shift)
        else:
            self.DeclareVectorInputPort("u", model)
            self.DeclareDiscreteState((steps + 1) * model)
            self.DeclareVectorOutputPort("delayed_u", model, blocks.first_elements)
            self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, blocks.delay)

    def _shift(self, context: Context, state: State) -> None:
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

    @checked
    def __init__(self, size: int, time_step: float):
        super().__init__()
        self._dt = float(time_step)
        self.DeclareVectorInputPort("u", size)
        self.DeclareStateOutputPort("y", self.DeclareDiscreteState(size))
        self.DeclarePeriodicDiscreteUpdateEvent(self._dt, 0.0, blocks.euler)

    def _kernel_models(self, root: RootView) -> dict:
        return {"step_model": blocks.Step.of(dt=self._dt)}

    @checked
    def set_integral_value(self, context: Context, value: ArrayLike) -> None:
        """Sets the sum in a context."""
        self.ValidateContext(context)
        context.SetDiscreteState(value)

    def time_step(self) -> float:
        """Time step [s]."""
        return self._dt


@checked
class WrapToSystem(LeafSystem):
    """The input, with chosen elements wrapped into an interval.

    Args:
        input_size: Size.
    """

    _generic = True

    def __init__(self, input_size: int, /):
        super().__init__()
        self._intervals = np.zeros((int(input_size), blocks.Interval.SIZE))
        self.DeclareVectorInputPort("u0", int(input_size))
        self.DeclareVectorOutputPort("y0", int(input_size), blocks.wrap)

    def _copy(self) -> Self:
        new = super()._copy()
        new._intervals = self._intervals.copy()
        return new

    def set_interval(self, index: int, low: float, high: float, /) -> None:
        """Wraps element `index` into [low, high)."""
        if not 0 <= index < len(self._intervals) or not high > low:
            raise RuntimeError(
                f"WrapToSystem.set_interval(): index {index} must be within [0, {len(self._intervals)}) and "
                f"high {high} above low {low}."
            )
        self._intervals[index] = low, high

    def _kernel_models(self, root: RootView) -> dict:
        return {"model": blocks.Intervals(self._intervals)}
