"""Discrete-time systems of continuous ones."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.systems.analysis._config import ApplySimulatorConfig, SimulatorConfig
from sheldrake.systems.analysis._simulator import Simulator
from sheldrake.systems.framework import BasicVector, LeafSystem, PortDataType, System
from sheldrake.systems.framework._vector import plain

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context


@checked
def DiscreteTimeApproximation(
    system: System | None = None,
    time_period: float = 0.0,
    integrator_config: Any = None,
    *,
    linear_system: Any = None,
    affine_system: Any = None,
) -> Any:
    """The system as seen every `time_period` [s], its input held between.

    Args:
        system: A LinearSystem or AffineSystem, whose result is exact and of its kind; or any system that has only
            continuous state.
        time_period: Period [s].
        integrator_config: How to integrate (a SimulatorConfig).
        linear_system: The system, when it is a LinearSystem.
        affine_system: The system, when it is an AffineSystem.

    Raises:
        RuntimeError: the period is not positive, or the system is not continuous.
    """
    if not time_period > 0:
        raise RuntimeError(f"DiscreteTimeApproximation(): time_period must be positive, got {time_period}.")
    system = next(s for s in (system, linear_system, affine_system) if s is not None)
    exact = getattr(system, "_discrete_time_approximation", None)
    if exact is not None:
        return exact(float(time_period))
    if system.num_discrete_state_groups() or system.num_abstract_states() or not system.num_continuous_states():
        raise RuntimeError(f"DiscreteTimeApproximation(): {system._describe()} must have only continuous state.")
    return _Sampled(system, float(time_period), integrator_config or SimulatorConfig())


def _numbers(vector: Any) -> np.ndarray:
    """The default values of a context on any scalar."""
    return np.array([plain(x) for x in vector.CopyToVector()], dtype=float)


class _Sampled(LeafSystem):
    """A continuous system, integrated from sample to sample."""

    def __init__(self, system: System, period: float, config: SimulatorConfig):
        super().__init__()
        self._scalar = system._scalar
        self._system, self._period, self._config = system, period, config
        self.set_name(system.get_name())
        context = system.CreateDefaultContext()
        for i in range(system.num_input_ports()):
            port = system.get_input_port(i)
            if port.get_data_type() is PortDataType.kVectorValued:
                self.DeclareVectorInputPort(port.get_name(), port.size())
            else:
                self.DeclareAbstractInputPort(port.get_name(), port.Allocate())
        self.DeclareDiscreteState(_numbers(context.get_continuous_state_vector()))
        for k in range(context.num_numeric_parameter_groups()):
            self.DeclareNumericParameter(BasicVector(_numbers(context.get_numeric_parameter(k))))
        for k in range(context.num_abstract_parameters()):
            self.DeclareAbstractParameter(context.get_abstract_parameter(k))
        for j in range(system.num_output_ports()):
            self._declare_copy(j)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _declare_copy(self, j: int) -> None:
        port = self._system.get_output_port(j)
        tickets = {self.all_sources_except_input_ports_ticket()}
        tickets |= {
            self.input_port_ticket(i) for i in range(self.num_input_ports()) if self._system.HasDirectFeedthrough(i, j)
        }

        def calc(context: Context, output: Any) -> None:
            value = self._system.get_output_port(j).EvalAbstract(self._continuous(context))
            output.SetFrom(value.get_value() if isinstance(output, BasicVector) else value)

        if port.get_data_type() is PortDataType.kVectorValued:
            self.DeclareVectorOutputPort(port.get_name(), port.size(), calc, tickets)
        else:
            self.DeclareAbstractOutputPort(port.get_name(), port.Allocate, calc, tickets)

    def _continuous(self, context: Context) -> Context:
        """A context of the continuous system with the values of `context`."""
        inner = self._system.CreateDefaultContext()
        inner.SetTimeAndContinuousState(context.get_time(), context.get_discrete_state_vector().value())
        for k in range(context.num_numeric_parameter_groups()):
            inner.get_mutable_numeric_parameter(k).SetFrom(context.get_numeric_parameter(k))
        for k in range(context.num_abstract_parameters()):
            inner.get_mutable_abstract_parameter(k).SetFrom(context.get_abstract_parameter(k))
        for i in range(self.num_input_ports()):
            port = self.get_input_port(i)
            if port.HasValue(context):
                self._system.get_input_port(i).FixValue(inner, port.EvalAbstract(context))
        return inner

    def _update(self, context: Context, x_next: Any) -> None:
        inner = self._continuous(context)
        t = inner.get_time()
        simulator = Simulator(self._system, inner)
        ApplySimulatorConfig(self._config, simulator)
        inner.SetTime(t)
        simulator.AdvanceTo(plain(t) + self._period)
        x_next.set_value(inner.get_continuous_state_vector().CopyToVector())
