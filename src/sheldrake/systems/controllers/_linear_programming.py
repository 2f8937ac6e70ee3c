"""Approximate dynamic programming by a linear program."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.controllers._dynamic_programming import (
    DynamicProgrammingOptions,
    check_settings,
    chosen_input,
    steps_of,
)


@checked
def LinearProgrammingApproximateDynamicProgramming(
    simulator: Simulator,
    cost_function: Callable[[Any], float],
    linearly_parameterized_cost_to_go_function: Callable[[np.ndarray, np.ndarray], Any],
    num_parameters: int,
    state_samples: np.ndarray,
    input_samples: np.ndarray,
    time_step: float,
    options: DynamicProgrammingOptions | None = None,
    /,
) -> np.ndarray:
    """Returns the parameters of the largest cost to go that no sampled step contradicts (de Farias and Van Roy, 2003).

    The sum of J(x) over the samples is maximized, subject to J(x) <= h cost(x, u) + discount J(next x) for all samples
    x and u.

    Args:
        simulator: Of the system to control, which has continuous state.
        cost_function: Cost rate [1/s] for a context.
        linearly_parameterized_cost_to_go_function: J(x, parameters), linear in the parameters.
        num_parameters: How many there are.
        state_samples: States, shape (n, number of samples).
        input_samples: Inputs to try at each, shape (m, number of samples).
        time_step: Time step h [s].
        options: Everything else.

    Raises:
        RuntimeError: the samples do not fit the system, an option is out of range, or the linear program has no
            solution.
    """
    from sheldrake.solvers import MathematicalProgram, Solve

    call, options = "LinearProgrammingApproximateDynamicProgramming", options or DynamicProgrammingOptions()
    x, u, h = np.atleast_2d(state_samples), np.atleast_2d(input_samples), float(time_step)
    check_settings(call, simulator, x.shape[0], h, options)
    port = chosen_input(call, simulator, u.shape[0], options)
    program = MathematicalProgram()
    parameters = program.NewContinuousVariables(int(num_parameters), "a")
    to_go = [linearly_parameterized_cost_to_go_function(sample, parameters) for sample in x.T]
    program.AddLinearCost(-sum(to_go))
    for costs, reached in steps_of(simulator, cost_function, port, x, u, h, options):
        for now, cost, end in zip(to_go, costs.tolist(), reached.T):
            following = linearly_parameterized_cost_to_go_function(end, parameters)
            program.AddLinearConstraint(now <= cost + options.discount_factor * following)
    result = Solve(program)
    if not result.is_success():
        raise RuntimeError(
            f"{call}(): the linear program has no solution ({result.get_solver_id().name()} says "
            f"{result.get_solution_result().name})."
        )
    return result.GetSolution(parameters)
