"""RandomSource: one sequence, however its numbers are drawn, copied and saved."""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest

from sheldrake.all import DiagramBuilder, LogVectorOutput, RandomDistribution, RandomGenerator, RandomSource, Simulator
from sheldrake.systems.primitives._random_source import _Sampler

KINDS = [RandomDistribution.kUniform, RandomDistribution.kGaussian, RandomDistribution.kExponential]


def one_by_one(kind: RandomDistribution, seed: int, count: int) -> list[float]:
    sampler = _Sampler(kind, seed)
    return [sampler._one() for _ in range(count)]


@pytest.mark.parametrize("at_once", [1, 3, 7, 300])
@pytest.mark.parametrize("kind", KINDS)
def test_numbers_drawn_ahead_are_those_drawn_one_by_one(kind, at_once):
    sampler, found = _Sampler(kind, 3), []
    while len(found) < 900:
        found += sampler.draw(at_once)
    assert found == one_by_one(kind, 3, len(found))


@pytest.mark.parametrize("kind", KINDS)
def test_copies_and_files_go_on_alike_from_anywhere(kind):
    sampler = _Sampler(kind, 8)
    for k in range(60):
        sampler.draw(k)
        copied, loaded = copy.deepcopy(sampler), _Sampler(kind, 0)
        loaded.SetFromPlain(sampler.ToPlain())
        again = copy.deepcopy(sampler)
        expected = again.draw(400)
        assert copied.draw(400) == loaded.draw(400) == expected


def test_a_clone_of_a_context_draws_the_same():
    builder = DiagramBuilder()
    source = builder.AddSystem(RandomSource(RandomDistribution.kGaussian, 3, 0.01))
    log = LogVectorOutput(source.get_output_port(), builder, 0.01)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    diagram.SetRandomContext(context, RandomGenerator(1))
    simulator.AdvanceTo(0.5)
    clone = context.Clone()
    simulator.AdvanceTo(2.0)
    other = Simulator(diagram, clone)
    other.Initialize()
    other.AdvanceTo(2.0)
    ours, its = (log.FindLog(c).data()[:, -140:] for c in (context, clone))
    np.testing.assert_array_equal(ours, its)
    assert math.isclose(np.std(ours), 1.0, rel_tol=0.3)
