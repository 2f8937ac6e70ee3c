"""Random signals."""

from __future__ import annotations

import copy
import itertools
import math
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common import RandomDistribution, RandomGenerator
from sheldrake.common.value import Value
from sheldrake.systems.framework import LeafSystem, PortDataType

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context, DiagramBuilder
    from sheldrake.systems.framework._state import State

_seeds = itertools.count(RandomGenerator.default_seed)


class _Sampler:
    """A generator and its distribution; a copy continues the same sequence."""

    def __init__(self, distribution: RandomDistribution, seed: int):
        self.distribution, self.generator = distribution, RandomGenerator(seed)
        self._spare: float | None = None

    def __deepcopy__(self, memo: dict) -> _Sampler:
        new = object.__new__(_Sampler)
        new.distribution, new.generator, new._spare = self.distribution, copy.copy(self.generator), self._spare
        return new

    def draw(self) -> float:
        """The next number."""
        if self.distribution is RandomDistribution.kUniform:
            return self.generator._uniform()
        if self.distribution is RandomDistribution.kExponential:
            return -math.log1p(-self.generator._uniform())
        return self._normal()

    def ToPlain(self) -> dict:
        """Where the sequence stands, for `SaveContext`."""
        return {"generator": self.generator.ToPlain(), "spare": self._spare}

    def SetFromPlain(self, content: dict) -> None:
        """Goes on from where `ToPlain` was called.

        Raises:
            ValueError: the content is not what `ToPlain` gives.
        """
        spare = content["spare"]
        if not (spare is None or (type(spare) is float and np.isfinite(spare))):
            raise ValueError("that is no state of a RandomSource")
        self.generator.SetFromPlain(content["generator"])
        self._spare = spare

    def _normal(self) -> float:
        """Marsaglia's polar method, as C++'s normal_distribution does it."""
        if self._spare is not None:
            spare, self._spare = self._spare, None
            return spare
        while True:
            x, y = 2.0 * self.generator._uniform() - 1.0, 2.0 * self.generator._uniform() - 1.0
            r = x * x + y * y
            if 0.0 < r <= 1.0:
                break
        scale = math.sqrt(-2.0 * math.log(r) / r)
        self._spare = x * scale
        return y * scale


class RandomSource(LeafSystem):
    """Independent random numbers, drawn anew periodically and held.

    Args:
        distribution: Of each number.
        num_outputs: How many numbers.
        sampling_interval_sec: Period [s].
    """

    _generic = True
    _symbolic = False

    def __init__(self, distribution: RandomDistribution, num_outputs: int, sampling_interval_sec: float):
        super().__init__()
        self._distribution, self._seed = distribution, next(_seeds)
        self.DeclareStateOutputPort("output", self.DeclareDiscreteState(num_outputs))
        self.DeclareAbstractState(Value[object](_Sampler(distribution, self._seed)))
        self.DeclarePeriodicUnrestrictedUpdateEvent(float(sampling_interval_sec), 0.0, self._draw)

    def _draw(self, context: Context, state: State) -> None:
        sampler = state.get_mutable_abstract_state(0).get_mutable_value()
        x = state.get_mutable_discrete_state(0)
        x.SetFromVector([sampler.draw() for _ in range(x.size())])

    def _set_default_context(self, context: Context) -> None:
        self._start(context, self._seed)

    def _set_random_context(self, context: Context, generator: RandomGenerator) -> None:
        self._start(context, generator())

    def _start(self, context: Context, seed: int) -> None:
        sampler = _Sampler(self._distribution, seed)
        context.SetAbstractState(0, sampler)
        x = context.get_mutable_discrete_state_vector()
        x.SetFromVector([sampler.draw() for _ in range(x.size())])


def AddRandomInputs(sampling_interval_sec: float, builder: DiagramBuilder) -> int:
    """Feeds every unconnected input port that was declared with a distribution from a RandomSource; says how many."""
    count = 0
    for system in builder.GetSystems():
        for i, declaration in enumerate(system._inputs):
            port = system.get_input_port(i)
            if (
                declaration.random_type is None
                or declaration.data_type is not PortDataType.kVectorValued
                or builder.IsConnectedOrExported(port)
            ):
                continue
            source = builder.AddSystem(RandomSource(declaration.random_type, declaration.size, sampling_interval_sec))
            builder.Connect(source.get_output_port(), port)
            count += 1
    return count
