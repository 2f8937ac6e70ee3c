"""Random signals."""

from __future__ import annotations

import copy
import itertools
import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common import RandomDistribution, RandomGenerator
from sheldrake.common._checked import checked
from sheldrake.common._kernels.twister import SIZE
from sheldrake.common.value import Value
from sheldrake.systems.framework import LeafSystem, PortDataType
from sheldrake.systems.primitives._kernels.random_numbers import gaussians, uniforms

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context, DiagramBuilder
    from sheldrake.systems.framework._state import State

_seeds = itertools.count(RandomGenerator.default_seed)


_FEW = 32
"""Numbers that are drawn one by one, before it pays to draw many ahead."""
_AHEAD = 256


class _Sampler:
    """A generator and its distribution; a copy continues the same sequence.

    Args:
        distribution: Of the numbers.
        seed: Of the generator.
    """

    __slots__ = ("_ahead", "_before", "_count", "_generator", "_position", "_spare", "distribution")

    def __init__(self, distribution: RandomDistribution, seed: int):
        self._begin(distribution, RandomGenerator(seed), None)

    def _begin(self, distribution: RandomDistribution, generator: RandomGenerator, spare: float | None) -> None:
        self.distribution, self._generator, self._spare = distribution, generator, spare
        self._count = self._position = 0
        self._ahead: list[float] = []  # numbers that were drawn from `_before`, of which `_position` are given away
        self._before: RandomGenerator | None = None

    def __deepcopy__(self, memo: dict) -> _Sampler:
        new = object.__new__(_Sampler)
        new.distribution, new._spare, new._count = self.distribution, self._spare, self._count
        new._ahead, new._position, new._before = self._ahead, self._position, self._before
        # Where numbers have been drawn ahead, generators stay as they are.
        new._generator = copy.copy(self._generator) if self._before is None else self._generator
        return new

    def draw(self, count: int) -> list[float]:
        """The next numbers."""
        begin, end, most = self._position, self._position + count, len(self._ahead)
        if end <= most:
            self._position = end
            return self._ahead[begin:end]
        found, self._position = self._ahead[begin:], most
        while len(found) < count:
            if self._count < _FEW or self._spare is not None:
                self._count += 1
                found.append(self._one())
            else:
                self._draw_ahead()
                found += self.draw(count - len(found))
        return found

    def _draw_ahead(self) -> None:
        """Draws many numbers by a kernel."""
        self._before = self._generator
        self._generator = copy.copy(self._before)
        key, place, out = np.zeros(SIZE, np.int64), np.zeros(2, np.int64), np.zeros(_AHEAD)
        kernel = gaussians if self.distribution is RandomDistribution.kGaussian else uniforms
        self._generator._draw(key, place, partial(kernel.native, key, place, out))
        self._ahead, self._position = out.tolist(), 0
        if self.distribution is RandomDistribution.kExponential:
            self._ahead = [_exponential(x) for x in self._ahead]

    def _one(self) -> float:
        """The next number, from the generator itself."""
        if self.distribution is RandomDistribution.kUniform:
            return self._generator._uniform()
        if self.distribution is RandomDistribution.kExponential:
            return _exponential(self._generator._uniform())
        return self._normal()

    def ToPlain(self) -> dict:
        """Where the sequence stands, for `SaveContext`."""
        if self._before is None:
            return {"generator": self._generator.ToPlain(), "spare": self._spare}
        now = object.__new__(_Sampler)
        now._begin(self.distribution, copy.copy(self._before), None)
        for _ in range(self._position):
            now._one()
        return now.ToPlain()

    def SetFromPlain(self, content: dict) -> None:
        """Goes on from where `ToPlain` was called.

        Raises:
            ValueError: the content is not what `ToPlain` gives.
        """
        spare = content["spare"]
        if not (spare is None or (type(spare) is float and np.isfinite(spare))):
            raise ValueError("that is no state of a RandomSource")
        generator = RandomGenerator()
        generator.SetFromPlain(content["generator"])
        self._begin(self.distribution, generator, spare)

    def _normal(self) -> float:
        """Marsaglia's polar method, as C++'s normal_distribution does it."""
        if self._spare is not None:
            spare, self._spare = self._spare, None
            return spare
        while True:
            x, y = 2.0 * self._generator._uniform() - 1.0, 2.0 * self._generator._uniform() - 1.0
            r = x * x + y * y
            if 0.0 < r <= 1.0:
                break
        scale = math.sqrt(-2.0 * math.log(r) / r)
        self._spare = x * scale
        return y * scale


def _exponential(uniform: float) -> float:
    return -math.log1p(-uniform)


class RandomSource(LeafSystem):
    """Independent random numbers, drawn anew periodically and held.

    Args:
        distribution: Of each number.
        num_outputs: How many numbers.
        sampling_interval_sec: Period [s].
    """

    _generic = True
    _symbolic = False

    @checked
    def __init__(self, distribution: RandomDistribution, num_outputs: int, sampling_interval_sec: float):
        super().__init__()
        self._distribution, self._seed = distribution, next(_seeds)
        self.DeclareStateOutputPort("output", self.DeclareDiscreteState(num_outputs))
        self.DeclareAbstractState(Value[object](_Sampler(distribution, self._seed)))
        self.DeclarePeriodicUnrestrictedUpdateEvent(float(sampling_interval_sec), 0.0, self._draw)

    def _draw(self, context: Context, state: State) -> None:
        x = state.get_mutable_discrete_state(0)._v
        x[:] = state.get_mutable_abstract_state(0).get_mutable_value().draw(x.size)

    def _set_default_context(self, context: Context) -> None:
        self._start(context, self._seed)

    def _set_random_context(self, context: Context, generator: RandomGenerator) -> None:
        self._start(context, generator())

    def _start(self, context: Context, seed: int) -> None:
        sampler = _Sampler(self._distribution, seed)
        context.SetAbstractState(0, sampler)
        x = context.get_mutable_discrete_state_vector()
        x.SetFromVector(sampler.draw(x.size()))


@checked
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
