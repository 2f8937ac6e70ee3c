"""Random numbers: the same sequences as Drake's from the same seeds."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from sheldrake.common._enums import BoundEnum
from sheldrake.common._overloads import incompatible
from sheldrake.common._scalar_math import all_of, select
from sheldrake.common._scalars import Mismatch, any_array, scalar_types

if TYPE_CHECKING:
    import numpy as np

    from sheldrake.common._types import Scalars

_TWO_32 = 4294967296.0


class RandomDistribution(BoundEnum):
    """Of a random scalar: on [0, 1), with mean 0 and deviation 1, or with rate 1."""

    kUniform = 0
    kGaussian = 1
    kExponential = 2


class RandomGenerator:
    """The 32-bit Mersenne twister; called, it gives the next integer below 2^32."""

    default_seed = 5489

    def __init__(self, seed: int = default_seed):
        """
        Args:
            seed: Not negative.
        """
        if isinstance(seed, bool) or not hasattr(seed, "__index__") or seed < 0:
            raise incompatible("RandomGenerator", ["()", "(seed: int, not negative)"], (seed,), {}, constructor=True)
        import numpy.random

        self._bits = numpy.random.RandomState(int(seed) % 2**32)._bit_generator

    def __call__(self) -> int:
        """The next integer."""
        return int(self._bits.random_raw())

    def _uniform(self) -> float:
        """The next number in [0, 1), from two integers, low half first, as C++'s generate_canonical takes them."""
        low, high = self(), self()
        return min((low + high * _TWO_32) / (_TWO_32 * _TWO_32), math.nextafter(1.0, 0.0))

    def ToPlain(self) -> dict:
        """Where the sequence stands, as numbers and arrays; `SetFromPlain` goes on from there."""
        state: Any = self._bits.state
        return {"key": state["state"]["key"], "position": int(state["state"]["pos"])}

    def SetFromPlain(self, content: dict) -> None:
        """Goes on from where `ToPlain` was called."""
        key, position = content["key"], content["position"]
        if _shape_and_kind(key) != ((624,), "u") or type(position) is not int or not 0 <= position <= 624:
            raise ValueError("that is no state of a RandomGenerator")  # NumPy would read what is behind it
        state = {"key": key, "pos": position}
        self._bits.state = {"bit_generator": "MT19937", "state": state}

    def __repr__(self) -> str:
        return f"<RandomGenerator at {id(self):#x}>"


def _shape_and_kind(array: np.ndarray) -> tuple[Any, Any]:
    return getattr(array, "shape", None), getattr(getattr(array, "dtype", None), "kind", None)


def CalcProbabilityDensity(distribution: RandomDistribution, x: Scalars) -> Any:
    """Joint density of independent numbers with one distribution at `x`, shape (n,); any scalar."""
    for T in scalar_types():
        try:
            numbers = any_array(T, x).ravel().tolist()
            break
        except Mismatch:
            continue
    else:
        raise incompatible("CalcProbabilityDensity", ["(distribution, x: array of shape (n,))"], (distribution, x), {})
    density = T(1.0)
    for number in numbers:
        density = density * _density(distribution, number, T)
    return density


def _density(distribution: RandomDistribution, x: np.ndarray, T: type) -> Any:

    def exp(y: Any) -> Any:
        return math.exp(y) if T is float else y.exp()

    if distribution is RandomDistribution.kGaussian:
        return exp(-0.5 * x * x) / math.sqrt(2.0 * math.pi)
    if distribution is RandomDistribution.kUniform:
        return select(all_of((x >= 0.0, x <= 1.0)), lambda: T(1.0), lambda: T(0.0))
    return select(x >= 0.0, lambda: exp(-x), lambda: T(0.0))
