"""Simulations of random systems, and many of them."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from sheldrake.common import RandomGenerator
from sheldrake.common._checked import checked
from sheldrake.common._no_constructor import no_constructor
from sheldrake.common._thread_team import in_parallel, threads_of

if TYPE_CHECKING:
    from sheldrake.systems.analysis import Simulator


@no_constructor()
class RandomSimulationResult:
    """One sample: `output`, and `generator_snapshot`, the generator from which it can be had again."""

    generator_snapshot: RandomGenerator
    output: float

    @classmethod
    def _make(cls, generator_snapshot: RandomGenerator, output: float) -> RandomSimulationResult:
        result = object.__new__(cls)
        result.generator_snapshot, result.output = generator_snapshot, output
        return result


@checked
def RandomSimulation(
    make_simulator: Callable, output: Callable, final_time: float, generator: RandomGenerator
) -> float:
    """Makes a simulator, draws its context, advances it and gives its output.

    Args:
        make_simulator: `make_simulator(generator)` gives a Simulator.
        output: `output(system, context)` gives a number.
        final_time: Time to advance to [s].
        generator: The only source of randomness.
    """
    _, simulator = _draw(make_simulator, generator)
    return _run(simulator, output, final_time)


@checked
def MonteCarloSimulation(
    make_simulator: Callable,
    output: Callable,
    final_time: float,
    num_samples: int,
    generator: RandomGenerator | None = None,
    num_parallel_executions: Any = None,
) -> list[RandomSimulationResult]:
    """Runs `RandomSimulation` many times.

    Samples are the same however many are run at a time: simulators are made, and their contexts drawn, one after the
    other in the calling thread; threads advance them and ask for their outputs.

    Args:
        make_simulator: As there; with several at a time, a new simulator with a context of its own at each call.
        output: As there; with several at a time it is called by several threads, and must not use `generator`.
        final_time: As there [s].
        num_samples: How many times.
        generator: As there; a new one if not given, so that calls repeat each other.
        num_parallel_executions: How many at a time: a number, a Parallelism, or True for as many as this process may
            use; one if not given.

    Raises:
        RuntimeError: `make_simulator` gave the same simulator or context twice, of several at a time.
    """
    generator = RandomGenerator() if generator is None else generator
    threads = threads_of(num_parallel_executions, False)
    found: list[RandomSimulationResult] = []
    while len(found) < num_samples:
        at_once = 1 if threads == 1 else min(_AT_ONCE * threads, num_samples - len(found))
        drawn = [_draw(make_simulator, generator) for _ in range(at_once)]
        if len({id(simulator.get_context()) for _, simulator in drawn}) < len(drawn):
            raise RuntimeError(
                "MonteCarloSimulation(): make_simulator gave the same context twice; threads need simulators of their "
                "own. Make a new one at each call, or run one at a time."
            )
        values = in_parallel(lambda pair: _run(pair[1], output, final_time), drawn, threads)
        found += [RandomSimulationResult._make(snapshot, value) for (snapshot, _), value in zip(drawn, values)]
    return found


_AT_ONCE = 4
"""Simulators that wait for a thread, for each thread that there is."""


def _draw(make_simulator: Callable, generator: RandomGenerator) -> tuple[Any, Any]:
    """The generator as it was, and a simulator whose context is drawn from it."""
    snapshot = copy.deepcopy(generator)
    simulator = make_simulator(generator)
    simulator.get_system().SetRandomContext(simulator.get_mutable_context(), generator)
    return snapshot, simulator


def _run(simulator: Simulator, output: Callable, final_time: float) -> float:
    simulator.AdvanceTo(final_time)
    return float(output(simulator.get_system(), simulator.get_context()))
