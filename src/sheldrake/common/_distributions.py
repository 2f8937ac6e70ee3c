"""Random numbers and vectors as YAML describes them. Samples are Drake's, from the same generator."""

from __future__ import annotations

import copy
import importlib
import math
from collections.abc import Iterator, Sequence
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from sheldrake.common._kinds import instance_of
from sheldrake.common._names import pretty_class_name
from sheldrake.common._overloads import Kind, Mismatch, dispatch, kind, overload
from sheldrake.common._random import RandomGenerator
from sheldrake.common._scalars import any_array, scalar, vector
from sheldrake.common.cpp_template import TemplateClass

if TYPE_CHECKING:
    from types import GenericAlias

    from numpy.typing import ArrayLike
    from typing_extensions import Self

    from sheldrake.symbolic._expression import Expression


def sample_gaussian(generator: RandomGenerator, mean: float, stddev: float) -> float:
    """A normal number by Marsaglia's polar method; one of each pair is dropped, as a fresh C++ distribution does."""
    return next(gaussian_pairs(generator)) * stddev + mean


def gaussian_pairs(generator: RandomGenerator) -> Iterator[float]:
    """Normal numbers, both of each pair: what one C++ distribution gives when it is asked again and again."""
    while True:
        x, y = 2.0 * generator._uniform() - 1.0, 2.0 * generator._uniform() - 1.0
        r2 = x * x + y * y
        if 0.0 < r2 <= 1.0:
            factor = math.sqrt(-2.0 * math.log(r2) / r2)
            yield y * factor
            yield x * factor


def sample_uniform(generator: RandomGenerator, low: float, high: float) -> float:
    """A number in [low, high)."""
    return generator._uniform() * (high - low) + low


def random_variable(kind: str, i: int) -> Expression:
    """The symbol of a random number: `kind` is "uniform" or "gaussian"."""
    symbolic = importlib.import_module("sheldrake.symbolic")
    Type = symbolic.Variable.Type
    return symbolic.Variable(f"random_{kind}_{i}", getattr(Type, f"RANDOM_{kind.upper()}"))


class _Schema:
    """A value with the named fields of `_TYPES`, each converted and checked when set."""

    __fields__: ClassVar[tuple] = ()

    def __copy__(self) -> Self:
        new = object.__new__(type(self))
        for name, value in vars(self).items():
            object.__setattr__(new, name, copy.copy(value))
        return new

    def __deepcopy__(self, memo: dict) -> Self:
        new = object.__new__(type(self))
        for name, value in vars(self).items():
            object.__setattr__(new, name, copy.deepcopy(value, memo))
        return new

    def __repr__(self) -> str:
        pairs = ", ".join(f"{field.name}={getattr(self, field.name)!r}" for field in self.__fields__)
        return f"{pretty_class_name(type(self))}({pairs})"


@kind("list of float")
def _numbers(value: float | Sequence[float] | np.ndarray) -> list[float]:
    array = any_array(float, value)
    if array.ndim != 1:
        raise Mismatch
    return array.tolist()


class _Fields(_Schema):
    """Fields of one kind each, given all together, by position or name, or not at all."""

    _KINDS: ClassVar[dict[str, Kind]] = {}
    _DEFAULTS: ClassVar[dict[str, Any]] = {}

    def __init__(self, *args: Any, **kwargs: Any):
        """All fields, none, or another one to copy."""
        cls: Any = next(base for base in type(self).__mro__ if "_KINDS" in vars(base))

        def set_all(self: Any, *values: Any) -> None:
            for name, value in zip(cls._KINDS, values):
                object.__setattr__(self, name, value)

        def set_default(self: Any) -> None:
            set_all(self, *(copy.copy(value) for value in cls._DEFAULTS.values()))

        def set_copy(self: Any, other: Any) -> None:
            set_all(self, *(copy.copy(getattr(other, name)) for name in cls._KINDS))

        ways = [
            overload(set_default),
            overload(set_copy, other=instance_of(cls)),
            overload(set_all, **cls._KINDS),
        ]
        dispatch(pretty_class_name(type(self)), ways, self, args, kwargs, constructor=True)

    def __setattr__(self, name: str, value: object) -> None:
        if name not in self._KINDS:
            raise AttributeError(f"{type(self).__name__} has no field '{name}'; it has {', '.join(self._KINDS)}.")
        try:
            object.__setattr__(self, name, self._KINDS[name](value))
        except Mismatch:
            description = getattr(self._KINDS[name], "description")  # noqa: B009
            raise TypeError(f"{type(self).__name__}.{name} takes a {description}, not {value!r}.") from None


class Distribution:
    """A random number."""

    def __init__(self, *args: object, **kwargs: object):
        raise TypeError("Distribution: No constructor defined! Use Gaussian, Uniform, ...")

    def Sample(self, generator: RandomGenerator) -> float:
        """A random value."""
        raise NotImplementedError

    def Mean(self) -> float:
        """The expected value."""
        raise NotImplementedError

    def ToSymbolic(self) -> Expression:
        """An expression of random variables."""
        raise NotImplementedError


def _field(name: str, kind: type | GenericAlias) -> SimpleNamespace:
    return SimpleNamespace(name=name, type=kind)


class Deterministic(_Fields, Distribution):
    """A number that is known."""

    _KINDS: ClassVar[dict] = {"value": scalar(float)}
    _DEFAULTS: ClassVar[dict] = {"value": 0.0}
    __fields__ = (_field("value", float),)
    value: float

    def Sample(self, generator: RandomGenerator) -> float:
        return self.value

    def Mean(self) -> float:
        return self.value

    def ToSymbolic(self) -> Expression:
        return importlib.import_module("sheldrake.symbolic").Expression(self.value)


class Gaussian(_Fields, Distribution):
    """A normally distributed number."""

    _KINDS: ClassVar[dict] = {"mean": scalar(float), "stddev": scalar(float)}
    _DEFAULTS: ClassVar[dict] = {"mean": 0.0, "stddev": 0.0}
    __fields__ = (_field("mean", float), _field("stddev", float))
    mean: float
    stddev: float

    def Sample(self, generator: RandomGenerator) -> float:
        return sample_gaussian(generator, self.mean, self.stddev)

    def Mean(self) -> float:
        return self.mean

    def ToSymbolic(self) -> Expression:
        return self.mean + self.stddev * random_variable("gaussian", 0)


class Uniform(_Fields, Distribution):
    """A number equally likely anywhere in [min, max)."""

    _KINDS: ClassVar[dict] = {"min": scalar(float), "max": scalar(float)}
    _DEFAULTS: ClassVar[dict] = {"min": 0.0, "max": 0.0}
    __fields__ = (_field("min", float), _field("max", float))
    min: float
    max: float

    def Sample(self, generator: RandomGenerator) -> float:
        return sample_uniform(generator, self.min, self.max)

    def Mean(self) -> float:
        return (self.min + self.max) / 2.0

    def ToSymbolic(self) -> Expression:
        return self.min + (self.max - self.min) * random_variable("uniform", 0)


class UniformDiscrete(_Fields, Distribution):
    """One of several numbers, all equally likely."""

    _KINDS: ClassVar[dict] = {"values": _numbers}
    _DEFAULTS: ClassVar[dict] = {"values": []}
    __fields__ = (_field("values", list[float]),)
    values: list[float]

    def _need_values(self, call: str) -> None:
        if not self.values:
            raise RuntimeError(f"Cannot {call}() empty UniformDiscrete distribution.")

    def Sample(self, generator: RandomGenerator) -> float:
        self._need_values("Sample")
        return self.values[int(generator._uniform() * len(self.values))]

    def Mean(self) -> float:
        self._need_values("Mean")
        return sum(self.values) / len(self.values)

    def ToSymbolic(self) -> Expression:
        self._need_values("ToSymbolic")
        symbolic = importlib.import_module("sheldrake.symbolic")
        place = len(self.values) * random_variable("uniform", 0)
        result = symbolic.Expression(self.values[-1])
        for i in range(len(self.values) - 1, 0, -1):
            result = symbolic.if_then_else(place < i, symbolic.Expression(self.values[i - 1]), result)
        return result


class DistributionVector:
    """A random vector."""

    def __init__(self, *args: object, **kwargs: object):
        raise TypeError("DistributionVector: No constructor defined! Use GaussianVector, UniformVector, ...")

    def Sample(self, generator: RandomGenerator) -> np.ndarray:
        """A random value, shape (n,)."""
        raise NotImplementedError

    def Mean(self) -> np.ndarray:
        """The expected value, shape (n,)."""
        raise NotImplementedError

    def ToSymbolic(self) -> np.ndarray:
        """Expressions of random variables, shape (n,)."""
        raise NotImplementedError


@kind("vector of floats")
def _any_vector(value: ArrayLike) -> np.ndarray:
    array = any_array(float, value)
    if array.ndim == 2 and array.shape[1] == 1:
        array = array[:, 0].copy()
    if array.ndim != 1:
        raise Mismatch
    array.setflags(write=False)
    return array


def _vector_of(size: int | None) -> Kind:
    return _any_vector if size is None else vector(float, size)


class _DeterministicVector(_Fields, DistributionVector):
    """A vector that is known."""

    value: np.ndarray

    def Sample(self, generator: RandomGenerator) -> np.ndarray:
        return self.value.copy()

    def Mean(self) -> np.ndarray:
        return self.value.copy()

    def ToSymbolic(self) -> np.ndarray:
        Expression = importlib.import_module("sheldrake.symbolic").Expression
        return np.array([Expression(x) for x in self.value.tolist()], dtype=object)


class _GaussianVector(_Fields, DistributionVector):
    """A vector of independent normally distributed numbers; one deviation for all, or one for each."""

    mean: np.ndarray
    stddev: np.ndarray

    def _deviations(self, call: str) -> list[float]:
        if len(self.stddev) == 1:
            return self.stddev.tolist() * len(self.mean)
        if len(self.stddev) != len(self.mean):
            raise RuntimeError(
                f"Cannot {call}() a GaussianVector distribution with size {len(self.mean)} mean but size "
                f"{len(self.stddev)} dev"
            )
        return self.stddev.tolist()

    def Sample(self, generator: RandomGenerator) -> np.ndarray:
        pairs = zip(self.mean.tolist(), self._deviations("Sample"))
        return np.array([sample_gaussian(generator, mean, stddev) for mean, stddev in pairs])

    def Mean(self) -> np.ndarray:
        self._deviations("Mean")
        return self.mean.copy()

    def ToSymbolic(self) -> np.ndarray:
        deviations = self._deviations("ToSymbolic")
        return np.array(
            [mean + stddev * random_variable("gaussian", 0) for mean, stddev in zip(self.mean.tolist(), deviations)],
            dtype=object,
        )


class _UniformVector(_Fields, DistributionVector):
    """A vector of independent numbers, equally likely anywhere between `min` and `max`."""

    min: np.ndarray
    max: np.ndarray

    def _check(self, call: str) -> None:
        if len(self.min) != len(self.max):
            raise RuntimeError(
                f"Cannot {call}() a UniformVector distribution with size {len(self.min)} min but size "
                f"{len(self.max)} max"
            )

    def Sample(self, generator: RandomGenerator) -> np.ndarray:
        self._check("Sample")
        pairs = zip(self.min.tolist(), self.max.tolist())
        return np.array([sample_uniform(generator, low, high) for low, high in pairs])

    def Mean(self) -> np.ndarray:
        self._check("Mean")
        return (self.min + self.max) / 2.0

    def ToSymbolic(self) -> np.ndarray:
        self._check("ToSymbolic")
        pairs = zip(self.min.tolist(), self.max.tolist())
        return np.array([low + (high - low) * random_variable("uniform", 0) for low, high in pairs], dtype=object)


def _family(name: str, base: type, *fields: str, loose: str | None = None) -> TemplateClass:
    """`Family[n]` for vectors of size n up to 6, and `Family[None]` for any size."""
    template = TemplateClass(name, scope=importlib.import_module("sheldrake.common.schema"))
    for size in (None, 1, 2, 3, 4, 5, 6):
        kinds = {field: _vector_of(None if field == loose else size) for field in fields}
        empty = np.zeros(size or 0)
        members = {
            "_KINDS": kinds,
            "_DEFAULTS": {field: np.zeros(0) if field == loose else empty for field in fields},
            "__fields__": tuple(_field(field, np.ndarray) for field in fields),
            "__doc__": base.__doc__,
        }
        template.add_instantiation((size,), type(name, (base,), members))
    template.__doc__ = base.__doc__
    return template
