"""Dynamics at many states at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, SupportsIndex

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._native.binding import HERE
from sheldrake.common._thread_team import ThreadTeam, threads_of
from sheldrake.systems.framework import InputPortSelection, PortDataType, System
from sheldrake.systems.framework._declarations import DISCRETE
from sheldrake.systems.framework._kernels.columns import derivatives_at, updates_at
from sheldrake.systems.framework._kernels.program import Run, RunWords, Sizes

_COLUMNS = 64
"""How many a thread takes at a time."""

if TYPE_CHECKING:
    from sheldrake.common._parallelism import Parallelism
    from sheldrake.common.kernel import Kernel
    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._engine.store import Store
    from sheldrake.systems.framework._port import InputPort


@checked
def BatchEvalTimeDerivatives(
    system: System,
    context: Context,
    times: Any,
    states: Any,
    inputs: Any,
    input_port_index: InputPortSelection | SupportsIndex = InputPortSelection.kUseFirstInputIfItExists,
    parallelize: Parallelism | int | bool | None = None,
) -> np.ndarray:
    """Time derivatives, one column for each column of `times`, `states` and `inputs`.

    Args:
        system: The system.
        context: Its parameters and other state; not changed.
        times: Times [s], shape (N,) or (1, N).
        states: Continuous states, shape (n, N).
        inputs: Inputs, shape (m, N); ignored without an input.
        input_port_index: Which input, or an InputPortSelection.
        parallelize: How many threads: a number, a Parallelism, or True for as many as this process may use; these if
            not given. Values do not depend on it. Systems written in Python are computed by one thread.

    Raises:
        RuntimeError: shapes do not fit.
    """
    clone, port, columns = _prepare(system, context, times, states, inputs, input_port_index)
    if len(states) != clone.num_continuous_states():
        raise RuntimeError(
            f"BatchEvalTimeDerivatives(): states must have {clone.num_continuous_states()} rows, not {len(states)}."
        )
    group = int(clone._store.layout.program.size[Sizes.derivatives])
    if columns and _is_native(clone._store, group):
        native = _on_threads(derivatives_at, clone, port, group, columns, parallelize)
        if native is not None:
            return native
    found = []
    for t, x, u in columns:
        clone.SetTimeAndContinuousState(t, x)
        if port is not None:
            port.FixValue(clone, u)
        found.append(system.EvalTimeDerivatives(clone).CopyToVector())
    return _columns(found, len(states))


@checked
def BatchEvalUniquePeriodicDiscreteUpdate(
    system: System,
    context: Context,
    times: Any,
    states: Any,
    inputs: Any,
    num_time_steps: int = 1,
    input_port_index: InputPortSelection | SupportsIndex = InputPortSelection.kUseFirstInputIfItExists,
    parallelize: Parallelism | int | bool | None = None,
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
        parallelize: As there.

    Raises:
        RuntimeError: shapes do not fit, or the system is no difference equation.
    """
    is_difference, period = system.IsDifferenceEquationSystem()
    if not is_difference:
        raise RuntimeError(f"BatchEvalUniquePeriodicDiscreteUpdate(): {system._describe()} is no difference equation.")
    clone, port, columns = _prepare(system, context, times, states, inputs, input_port_index)
    layout = clone._store.layout
    (group,) = (g for g, (kind, clock, *_) in enumerate(layout.group_list) if (kind, clock) == (DISCRETE, 0))
    if columns and len(states) == clone.num_total_states() and _is_native(clone._store, group):
        more = layout.xd[0], group, num_time_steps, period
        native = _on_threads(updates_at, clone, port, group, columns, parallelize, *more)
        if native is not None:
            return native
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


def _rows_of(layout: Any, group: int) -> list[int]:
    """Rows of a group, and those that it reads."""
    program = layout.program
    acts = program.calls[program.calls_begin[group] : program.calls_begin[group + 1]].tolist()
    return (
        acts
        + program.prerequisites[program.prerequisites_begin[group] : program.prerequisites_begin[group + 1]].tolist()
    )


def _is_native(store: Store, group: int) -> bool:
    """Whether kernels compute all that a group does and reads."""
    return store.native and all(r >= 0 and store.layout.rows[r].native for r in _rows_of(store.layout, group))


def _on_threads(
    kernel: Kernel,
    context: Context,
    port: Any,
    group: int,
    columns: list,
    parallelize: Parallelism | int | bool | None,
    *more: Any,
) -> np.ndarray | None:
    """What a kernel of `columns` finds, one column for each; None if it fails somewhere, which Python can explain.

    Each thread has a copy of the context.
    """
    layout, inputs_at = context._store.layout, np.zeros(0, np.int64)
    times, states, inputs = (np.ascontiguousarray(part, float) for part in zip(*columns))
    if port is not None:
        port.FixValue(context, inputs[0])
        layout = context._store.layout
        slot = layout.input_slot(layout.node_of[port.get_system()._system_id], port.get_index())
        inputs_at = np.arange(*slot.span)
    for r in _rows_of(layout, group):
        context._store.check_inputs(layout.rows[r])
    found, good = np.empty(states.shape), [True] * len(columns)
    rows = np.array([HERE.address(row.calc) if row.native else 0 for row in layout.rows], np.int64)
    run = (Run(np.zeros(RunWords.SIZE, np.int64)),) if "run" in kernel.names else ()
    calls: dict[int, Any] = {}

    def work(thread: int, part: int) -> None:
        if thread not in calls:
            store = context.Clone()._store
            given = store.S, store.side, store.L, rows, times, states, inputs, inputs_at, found
            calls[thread] = kernel.bind(layout.program, *run, *given, *more, 0, 0)
        calls[thread].set("first", part * _COLUMNS)
        calls[thread].set("last", min((part + 1) * _COLUMNS, len(columns)))
        good[part] = calls[thread]() == 0

    team = ThreadTeam(min(threads_of(parallelize, True), len(columns)))
    team.run(work, -(-len(columns) // _COLUMNS))
    return found.T if all(good) else None


def _prepare(
    system: System,
    context: Context,
    times: Any,
    states: Any,
    inputs: Any,
    selection: InputPortSelection | SupportsIndex,
) -> tuple:
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


def _port(system: System, selection: InputPortSelection | SupportsIndex) -> InputPort | None:
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
