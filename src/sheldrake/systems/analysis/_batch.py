"""Dynamics at many states at once."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.systems.framework import InputPortSelection, PortDataType, System


def BatchEvalTimeDerivatives(
    system: System,
    context: Any,
    times: Any,
    states: Any,
    inputs: Any,
    input_port_index: Any = InputPortSelection.kUseFirstInputIfItExists,
    parallelize: Any = None,
) -> np.ndarray:
    """Time derivatives, one column for each column of `times`, `states` and `inputs`.

    Args:
        system: The system.
        context: Its parameters and other state; not changed.
        times: Times [s], shape (N,) or (1, N).
        states: Continuous states, shape (n, N).
        inputs: Inputs, shape (m, N); ignored without an input.
        input_port_index: Which input, or an InputPortSelection.
        parallelize: Accepted for compatibility; columns are computed one after the other.

    Raises:
        RuntimeError: shapes do not fit.
    """
    clone, port, columns = _prepare(system, context, times, states, inputs, input_port_index)
    if len(states) != clone.num_continuous_states():
        raise RuntimeError(
            f"BatchEvalTimeDerivatives(): states must have {clone.num_continuous_states()} rows, not {len(states)}."
        )
    found = []
    for t, x, u in columns:
        clone.SetTimeAndContinuousState(t, x)
        if port is not None:
            port.FixValue(clone, u)
        found.append(system.EvalTimeDerivatives(clone).CopyToVector())
    return _columns(found, len(states))


def BatchEvalUniquePeriodicDiscreteUpdate(
    system: System,
    context: Any,
    times: Any,
    states: Any,
    inputs: Any,
    num_time_steps: int = 1,
    input_port_index: Any = InputPortSelection.kUseFirstInputIfItExists,
    parallelize: Any = None,
) -> np.ndarray:
    """Discrete states some steps later, one column for each column of `times`, `states` and `inputs`.

    Args:
        system: A difference equation (see `System.IsDifferenceEquationSystem`).
        context: Its parameters; not changed.
        times: Times [s], shape (N,) or (1, N).
        states: Discrete states, shape (n, N).
        inputs: Inputs, shape (m, N); ignored without an input.
        num_time_steps: How many steps.
        input_port_index: Which input, or an InputPortSelection.
        parallelize: Accepted for compatibility; columns are computed one after the other.

    Raises:
        RuntimeError: shapes do not fit, or the system is no difference equation.
    """
    is_difference, period = system.IsDifferenceEquationSystem()
    if not is_difference:
        raise RuntimeError(f"BatchEvalUniquePeriodicDiscreteUpdate(): {system._describe()} is no difference equation.")
    clone, port, columns = _prepare(system, context, times, states, inputs, input_port_index)
    found = []
    for t, x, u in columns:
        clone.SetDiscreteState(x)
        if port is not None:
            port.FixValue(clone, u)
        for step in range(num_time_steps):
            clone.SetTime(t + step * period)
            clone.SetDiscreteState(system.EvalUniquePeriodicDiscreteUpdate(clone))
        found.append(clone.get_discrete_state_vector().CopyToVector())
    return _columns(found, len(states))


def _prepare(system: System, context: Any, times: Any, states: Any, inputs: Any, selection: Any) -> tuple:
    system.ValidateContext(context)
    times, states = np.ravel(times), np.atleast_2d(states)
    port = _port(system, selection)
    if states.shape[1] != len(times):
        raise RuntimeError(f"states must have one column for each of the {len(times)} times, not {states.shape[1]}.")
    if port is None:
        inputs = np.zeros((0, len(times)))
    inputs = np.atleast_2d(inputs)
    if port is not None and inputs.shape != (port.size(), len(times)):
        raise RuntimeError(f"inputs must have shape {(port.size(), len(times))}, not {inputs.shape}.")
    return context.Clone(), port, list(zip(times, states.T, inputs.T))


def _port(system: System, selection: Any) -> Any:
    if selection is InputPortSelection.kNoInput:
        return None
    if selection is InputPortSelection.kUseFirstInputIfItExists:
        if not system.num_input_ports():
            return None
        selection = 0
    port = system.get_input_port(selection)
    if port.get_data_type() is not PortDataType.kVectorValued:
        raise RuntimeError(f"{port.GetFullDescription()} is not vector-valued.")
    return port


def _columns(found: list, rows: int) -> np.ndarray:
    return np.stack(found, axis=1) if found else np.zeros((rows, 0))
