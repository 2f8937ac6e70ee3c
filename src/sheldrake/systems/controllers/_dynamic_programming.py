"""Approximate dynamic programming on grids."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, SupportsIndex

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._logging import logger
from sheldrake.common._options import Options
from sheldrake.math import BarycentricMesh
from sheldrake.systems.analysis import BatchSimulator, Simulator
from sheldrake.systems.framework import InputPortSelection
from sheldrake.systems.primitives import BarycentricMeshSystem

if TYPE_CHECKING:
    from sheldrake.systems.framework._port import InputPort


_MOST_WORLDS = 1024


class PeriodicBoundaryCondition:
    """A state that wraps around, such as an angle.

    Args:
        state_index: Which state.
        low: Lowest value.
        high: Highest value; the same as the lowest.
    """

    __slots__ = ("high", "low", "state_index")

    @checked
    def __init__(self, state_index: int, low: float, high: float):
        self.state_index, self.low, self.high = int(state_index), float(low), float(high)

    def _wrapped(self, x: Any) -> Any:
        return self.low + (x - self.low) % (self.high - self.low)


class DynamicProgrammingOptions(Options):
    """Options of `FittedValueIteration` and `LinearProgrammingApproximateDynamicProgramming`.

    Attributes:
        discount_factor: What a cost is worth one time step later.
        convergence_tol: The iteration ends when no cost changes by more.
        periodic_boundary_conditions: States that wrap around.
        input_port_index: Which input is chosen.
        assume_non_continuous_states_are_fixed: Discrete and abstract states stay as they are, instead of an error.
        visualization_callback: Called after each iteration with its number, the mesh, costs and policy; or None.
    """

    __repr__ = object.__repr__

    discount_factor: float = 1.0
    convergence_tol: float = 1e-4
    periodic_boundary_conditions: list[PeriodicBoundaryCondition] = []
    input_port_index: InputPortSelection | SupportsIndex = InputPortSelection.kUseFirstInputIfItExists
    assume_non_continuous_states_are_fixed: bool = False
    visualization_callback: Callable[..., None] | None = None

    PeriodicBoundaryCondition = PeriodicBoundaryCondition


@checked
def FittedValueIteration(
    simulator: Simulator,
    cost_function: Callable[[Any], float],
    state_grid: list,
    input_grid: list,
    time_step: float,
    options: DynamicProgrammingOptions | None = None,
    /,
) -> tuple[BarycentricMeshSystem, np.ndarray]:
    """Returns the policy, as a system from state to input, and the costs to go at the points of the state grid.

    The inputs are held over each time step. Costs between points of the grid are interpolated.

    Args:
        simulator: Of the system to control, which has continuous state.
        cost_function: Cost rate [1/s] for a context.
        state_grid: For each state, the set of values that are points of the grid.
        input_grid: For each element of the input, the set of values to choose from.
        time_step: Time step [s].
        options: Everything else.

    Raises:
        RuntimeError: the grids do not fit the system, or an option is out of range.
    """
    options = options or DynamicProgrammingOptions()
    states, inputs = BarycentricMesh(state_grid), BarycentricMesh(input_grid)
    port = _checked(simulator, states, inputs, float(time_step), options)
    x, u = (np.array(mesh.get_all_mesh_points()) for mesh in (states, inputs))
    logger.info("Computing transition and cost matrices.")
    costs, indices, weights = _transitions(simulator, cost_function, port, states, x, u, float(time_step), options)
    logger.info("Running value iteration.")
    to_go, policy, iteration = np.zeros(x.shape[1]), np.zeros((u.shape[0], x.shape[1])), 0
    while True:
        iteration += 1
        totals = costs + options.discount_factor * np.einsum("iks,iks->is", weights, to_go[indices])
        best = totals.argmin(axis=0)
        following = totals[best, np.arange(x.shape[1])]
        change = np.abs(following - to_go).max()
        to_go, policy = following, u[:, best]
        if options.visualization_callback is not None:
            options.visualization_callback(iteration, states, to_go.copy(), policy.copy())
        if change <= options.convergence_tol:
            logger.info(f"Value iteration converged to requested tolerance after {iteration} iterations.")
            return BarycentricMeshSystem(states, policy), to_go


def _checked(simulator: Simulator, states: Any, inputs: Any, time_step: float, options: Any) -> Any:
    """The input port to control, after checking everything against the system."""
    call = "FittedValueIteration"
    check_settings(call, simulator, states.get_input_size(), time_step, options)
    for b in options.periodic_boundary_conditions:
        values = states.get_input_grid()[b.state_index]
        if not b.low < b.high or abs(min(values) - b.low) > 1e-9 or abs(max(values) - b.high) > 1e-9:
            raise RuntimeError(
                f"{call}(): state {b.state_index} wraps from {b.low} to {b.high}, but its grid goes from {min(values)} "
                f"to {max(values)}."
            )
    return chosen_input(call, simulator, inputs.get_input_size(), options)


def check_settings(
    call: str, simulator: Simulator, num_states: int, time_step: float, options: DynamicProgrammingOptions
) -> None:
    """Raises RuntimeError where the settings of `call` are out of range, or do not fit the system's state."""
    context = simulator.get_context()
    if not time_step > 0.0:
        raise RuntimeError(f"{call}(): the time step must be positive, got {time_step} s.")
    if not 0.0 < options.discount_factor <= 1.0:
        raise RuntimeError(f"{call}(): the discount factor must be in (0, 1], got {options.discount_factor}.")
    if not context.has_only_continuous_state() and not options.assume_non_continuous_states_are_fixed:
        raise RuntimeError(f"{call}(): the system has other than continuous state.")
    if num_states != context.num_continuous_states():
        raise RuntimeError(
            f"{call}(): {num_states} states are given, the system has {context.num_continuous_states()} continuous "
            "states."
        )


def chosen_input(call: str, simulator: Simulator, size: int, options: DynamicProgrammingOptions) -> InputPort:
    """The input port to control, of this size."""
    index = options.input_port_index
    port = simulator.get_system().get_input_port(0 if isinstance(index, InputPortSelection) else int(index))
    if size != port.size():
        raise RuntimeError(f"{call}(): {size} inputs are given, input {port.get_name()!r} has size {port.size()}.")
    return port


def _transitions(
    simulator: Simulator,
    cost_function: Callable[..., Any],
    port: InputPort,
    states: Any,
    x: np.ndarray,
    u: np.ndarray,
    h: float,
    options: DynamicProgrammingOptions,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For each input and state: cost of the step, and the grid points about where it leads, with their weights."""
    costs, indices, weights = [], [], []
    for cost, reached in steps_of(simulator, cost_function, port, x, u, h, options):
        nearby, shares = states._interpolants_of_all(reached)
        costs.append(cost)
        indices.append(nearby.T)
        weights.append(shares.T)
    return np.array(costs), np.array(indices), np.array(weights)


def steps_of(
    simulator: Simulator,
    cost_function: Callable[..., Any],
    port: InputPort,
    x: np.ndarray,
    u: np.ndarray,
    h: float,
    options: DynamicProgrammingOptions,
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Simulates h [s] with each input (column of u) from each state (column of x).

    Yields for each input the costs of the steps, shape (states,), and the states reached, as x.
    """
    context = simulator.get_mutable_context()
    ends = _ends_in_worlds(simulator, port, x, h) or _ends_one_by_one(simulator, x, h)
    for column in u.T:
        port.FixValue(context, column)
        costs = np.empty(x.shape[1])
        for s, state in enumerate(x.T):
            context.SetTime(0.0)
            context.SetContinuousState(state)
            costs[s] = h * cost_function(context)
        reached = ends(column)
        for b in options.periodic_boundary_conditions:
            reached[b.state_index] = b._wrapped(reached[b.state_index])
        yield costs, reached


def _ends_one_by_one(simulator: Simulator, x: np.ndarray, h: float) -> Callable[[np.ndarray], np.ndarray]:
    context = simulator.get_mutable_context()

    def ends(_: np.ndarray) -> np.ndarray:
        reached = np.empty(x.shape)
        for s, state in enumerate(x.T):
            context.SetTime(0.0)
            context.SetContinuousState(state)
            simulator._initialize_anew()
            simulator.AdvanceTo(h)
            reached[:, s] = context.get_continuous_state_vector().CopyToVector()
        return reached

    return ends


def _ends_in_worlds(
    simulator: Simulator, port: InputPort, x: np.ndarray, h: float
) -> Callable[[np.ndarray], np.ndarray] | None:
    """Where an input leads from all states, in worlds of machine code; None where that takes Python."""
    paced = simulator.get_target_realtime_rate() or simulator.get_publish_every_time_step()
    if simulator.get_monitor() is not None or paced:
        return None
    count, num_states = min(_MOST_WORLDS, x.shape[1]), x.shape[1]
    worlds = BatchSimulator(simulator.get_system(), count, simulator.get_context(), config=simulator)
    if not worlds.is_native():
        return None
    numbers = worlds.continuous_states()

    def ends(column: np.ndarray) -> np.ndarray:
        reached = np.empty(x.shape)
        worlds.inputs(port)[:] = column
        for first in range(0, num_states, count):
            some = range(min(count, num_states - first))
            worlds.SetTime(0.0, some)
            numbers[: len(some)] = x.T[first : first + len(some)]
            worlds.AdvanceTo(h, some)
            reached[:, first : first + len(some)] = numbers[: len(some)].T
        return reached

    return ends
