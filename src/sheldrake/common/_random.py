"""Random numbers: the same sequences as Drake's from the same seeds."""

from __future__ import annotations

import math
import threading
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._enums import BoundEnum
from sheldrake.common._overloads import incompatible
from sheldrake.common._scalar_math import all_of, select
from sheldrake.common._scalars import Mismatch, any_array, scalar_types

if TYPE_CHECKING:
    from collections.abc import Callable

    from sheldrake.common._types import Scalars

_TWO_32 = 4294967296.0
_BELOW_ONE = math.nextafter(1.0, 0.0)


class RandomDistribution(BoundEnum):
    """Of a random scalar: on [0, 1), with mean 0 and deviation 1, or with rate 1."""

    kUniform = 0
    kGaussian = 1
    kExponential = 2


class _Stretch:
    """Numbers of a sequence between two steps of its state, which never change: generators and their copies share them.

    Args:
        numbers: The 624 integers; None makes them of the state when somebody asks.
        key: The state that gives them; None for the first ones after a seed, which say it when somebody asks.
        seed: That seed.
    """

    __slots__ = ("_following", "_key", "_seed", "numbers")
    numbers: list[int]

    def __init__(self, numbers: list[int] | None, key: np.ndarray | None, seed: int = 0):
        self._key, self._seed = key, seed
        self._following: _Stretch | None = None
        if numbers is not None:
            self.numbers = numbers

    def __getattr__(self, name: str) -> Any:
        """The numbers, when they are not there yet."""
        if name != "numbers":
            raise AttributeError(name)
        self.numbers = _Stretch.of_key(self.key(), 0).numbers
        return self.numbers

    @staticmethod
    def of_seed(seed: int) -> _Stretch:
        """The first one."""
        bits = _twister()
        bits._legacy_seeding(seed)
        return _Stretch(bits.random_raw(_SIZE).tolist(), None, seed)

    @staticmethod
    def of_key(key: np.ndarray, position: int) -> _Stretch:
        """What a state gives: at position 0 its own numbers, at the end those of the next one."""
        bits = _twister()
        bits.state = {"bit_generator": "MT19937", "state": {"key": key, "pos": position}}
        return _Stretch(bits.random_raw(_SIZE).tolist(), bits.state["state"]["key"])

    def key(self) -> np.ndarray:
        """The state of these numbers, shape (624,)."""
        if self._key is None:
            self._key = _Stretch.of_key(_seeded_key(self._seed), _SIZE)._key
        assert self._key is not None
        return self._key

    def following(self) -> _Stretch:
        """The numbers after these."""
        if self._following is None:
            self._following = _Stretch.of_key(self.key(), _SIZE)
        return self._following


_SIZE = 624  # of the twister's state [words]
_of_this_thread = threading.local()


def _twister() -> Any:
    """NumPy's twister of this thread, in any state: making one takes a hundred times longer than seeding it."""
    bits = getattr(_of_this_thread, "bits", None)
    if bits is None:
        from numpy.random import MT19937

        bits = _of_this_thread.bits = MT19937(0)
    return bits


def _seeded_key(seed: int) -> np.ndarray:
    bits = _twister()
    bits._legacy_seeding(seed)
    key: np.ndarray = bits.state["state"]["key"]
    return key


class RandomGenerator:
    """The 32-bit Mersenne twister; called, it gives the next integer below 2^32.

    A copy goes on with the same numbers and costs nothing: both read the same stretches of them.
    """

    __slots__ = ("__weakref__", "_position", "_seed", "_stretch")
    default_seed = 5489

    def __init__(self, seed: int = default_seed):
        """
        Args:
            seed: Not negative.
        """
        if isinstance(seed, bool) or not hasattr(seed, "__index__") or seed < 0:
            raise incompatible("RandomGenerator", ["()", "(seed: int, not negative)"], (seed,), {}, constructor=True)
        self._seed = int(seed) % 2**32
        self._stretch: _Stretch | None = None  # before the first number
        self._position = _SIZE

    def __call__(self) -> int:
        """The next integer."""
        stretch, position = self._stretch, self._position
        if stretch is None:
            stretch, position = _Stretch.of_seed(self._seed), 0
        elif position == _SIZE:
            stretch, position = stretch.following(), 0
        self._stretch, self._position = stretch, position + 1
        return stretch.numbers[position]

    def _uniform(self) -> float:
        """The next number in [0, 1), from two integers, low half first, as C++'s generate_canonical takes them."""
        stretch, position = self._stretch, self._position
        if stretch is not None and position <= _SIZE - 2:
            low, high = stretch.numbers[position : position + 2]
            self._position = position + 2
        else:
            low, high = self(), self()
        number = (low + high * _TWO_32) / (_TWO_32 * _TWO_32)
        return number if number < 1.0 else _BELOW_ONE

    def _draw(self, key: np.ndarray, place: np.ndarray, draw: Callable[[], int]) -> int:
        """Has a kernel take numbers, from `key` and `place` (`_kernels.twister`); returns its status."""
        key[:] = self._key()
        place[:] = self._position, 0
        status = draw()
        if place[1]:
            self._stretch = _Stretch(None, key.astype(np.uint32))
        self._position = int(place[0])
        return status

    def _key(self) -> np.ndarray:
        return _seeded_key(self._seed) if self._stretch is None else self._stretch.key()

    def ToPlain(self) -> dict:
        """Where the sequence stands, as numbers and arrays; `SetFromPlain` goes on from there."""
        return {"key": self._key().copy(), "position": self._position}

    def SetFromPlain(self, content: dict) -> None:
        """Goes on from where `ToPlain` was called."""
        key, position = content["key"], content["position"]
        if _shape_and_kind(key) != ((_SIZE,), "u") or type(position) is not int or not 0 <= position <= _SIZE:
            raise ValueError("that is no state of a RandomGenerator")  # NumPy would read what is behind it
        self._stretch, self._position = _Stretch.of_key(key, 0), position

    def __copy__(self) -> RandomGenerator:
        new = object.__new__(type(self))
        new._seed, new._stretch, new._position = self._seed, self._stretch, self._position
        return new

    def __deepcopy__(self, memo: dict) -> RandomGenerator:
        return self.__copy__()

    def __getstate__(self) -> dict:
        return self.ToPlain()

    def __setstate__(self, state: dict) -> None:
        self._seed = self.default_seed
        self.SetFromPlain(state)

    def __repr__(self) -> str:
        return f"<RandomGenerator at {id(self):#x}>"


def _shape_and_kind(array: np.ndarray) -> tuple[Any, Any]:
    return getattr(array, "shape", None), getattr(getattr(array, "dtype", None), "kind", None)


@checked
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
