"""Simulations of random systems, and many of them."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

from sheldrake.common import RandomGenerator


class RandomSimulationResult:
    """One sample: `output`, and `generator_snapshot`, the generator from which it can be had again."""

    generator_snapshot: Any
    output: float

    def __init__(self, *args: Any, **kwargs: Any):
        raise TypeError("RandomSimulationResult: No constructor defined!")

    @classmethod
    def _make(cls, generator_snapshot: RandomGenerator, output: float) -> RandomSimulationResult:
        result = object.__new__(cls)
        result.generator_snapshot, result.output = generator_snapshot, output
        return result


def RandomSimulation(make_simulator: Callable, output: Callable, final_time: float, generator: Any) -> float:
    """Makes a simulator, draws its context, advances it and gives its output.

    Args:
        make_simulator: `make_simulator(generator)` gives a Simulator.
        output: `output(system, context)` gives a number.
        final_time: Time to advance to [s].
        generator: The only source of randomness.
    """
    simulator = make_simulator(generator)
    system, context = simulator.get_system(), simulator.get_mutable_context()
    system.SetRandomContext(context, generator)
    simulator.AdvanceTo(final_time)
    return float(output(system, context))


def MonteCarloSimulation(
    make_simulator: Callable,
    output: Callable,
    final_time: float,
    num_samples: int,
    generator: Any = None,
    num_parallel_executions: Any = None,
) -> list[RandomSimulationResult]:
    """Runs `RandomSimulation` many times.

    Args:
        make_simulator: As there.
        output: As there.
        final_time: As there [s].
        num_samples: How many times.
        generator: As there; a new one if not given, so that calls repeat each other.
        num_parallel_executions: Accepted for compatibility; samples are drawn one after the other.
    """
    generator = RandomGenerator() if generator is None else generator
    found = []
    for _ in range(num_samples):
        snapshot = copy.deepcopy(generator)
        value = RandomSimulation(make_simulator, output, final_time, generator)
        found.append(RandomSimulationResult._make(snapshot, value))
    return found
