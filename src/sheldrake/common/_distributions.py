"""Random numbers and vectors as YAML describes them. Samples are Drake's, from the same generator."""

from __future__ import annotations

import importlib
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from sheldrake.common._names import pretty_class_name
from sheldrake.common._no_constructor import no_constructor
from sheldrake.common._options import Options
from sheldrake.common._overloads import incompatible
from sheldrake.common._random import RandomGenerator
from sheldrake.common.cpp_template import TemplateClass

if TYPE_CHECKING:
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


def _gaussian(mean: float, stddev: float) -> Expression:
    """A normally distributed number as an expression; a deviation that is not a number goes on as one."""
    if stddev <= 0.0:
        raise RuntimeError(f"ToSymbolic(): the stddev of a Gaussian is {stddev:g}, but it must be positive.")
    return mean + stddev * random_variable("gaussian", 0)


def _uniform(low: float, high: float) -> Expression:
    """A number from `low` to `high` as an expression."""
    if low > high:
        raise RuntimeError(f"ToSymbolic(): the minimum {low:g} of a Uniform is greater than its maximum {high:g}.")
    return low + (high - low) * random_variable("uniform", 0)


class Schema(Options):
    """Settings that may also be those of another one, given as `other`."""

    def __init__(self, *args: Any, **kwargs: Any):
        """Settings by name, or another one to copy."""
        if self._is_other(args, kwargs):
            other = args[0] if args else kwargs["other"]
            args, kwargs = (), {name: getattr(other, name) for name in self._defaults}
        super().__init__(*args, **kwargs)

    def _is_other(self, args: tuple, kwargs: dict[str, Any]) -> bool:
        other = args[0] if args else kwargs.get("other")
        related = isinstance(other, Schema) and (isinstance(other, type(self)) or isinstance(self, type(other)))
        return related and len(args) + len(kwargs) == 1


class _Whole(Schema):
    """A schema whose settings are given all together, by position or name, or not at all."""

    def __init__(self, *args: Any, **kwargs: Any):
        """All settings, none, or another one to copy."""
        names = list(self._defaults)
        if (args or kwargs) and not self._is_other(args, kwargs):
            if len(args) + len(kwargs) != len(names) or {*names[: len(args)], *kwargs} != set(names):
                accepted = ["()", "(other)", f"({', '.join(names)})"]
                raise incompatible(pretty_class_name(type(self)), accepted, args, kwargs, constructor=True)
            args, kwargs = (), {**dict(zip(names, args)), **kwargs}
        super().__init__(*args, **kwargs)


@no_constructor("Use Gaussian, Uniform, ...")
class Distribution:
    """A random number."""

    def Sample(self, generator: RandomGenerator) -> float:
        """A random value."""
        raise NotImplementedError

    def Mean(self) -> float:
        """The expected value."""
        raise NotImplementedError

    def ToSymbolic(self) -> Expression:
        """An expression of random variables."""
        raise NotImplementedError


class Deterministic(_Whole, Distribution):
    """A number that is known."""

    value: float = 0.0

    def Sample(self, generator: RandomGenerator) -> float:
        return self.value

    def Mean(self) -> float:
        return self.value

    def ToSymbolic(self) -> Expression:
        return importlib.import_module("sheldrake.symbolic").Expression(self.value)


class Gaussian(_Whole, Distribution):
    """A normally distributed number."""

    mean: float = 0.0
    stddev: float = 0.0

    def Sample(self, generator: RandomGenerator) -> float:
        return sample_gaussian(generator, self.mean, self.stddev)

    def Mean(self) -> float:
        return self.mean

    def ToSymbolic(self) -> Expression:
        return _gaussian(self.mean, self.stddev)


class Uniform(_Whole, Distribution):
    """A number equally likely anywhere in [min, max)."""

    min: float = 0.0
    max: float = 0.0

    def Sample(self, generator: RandomGenerator) -> float:
        return sample_uniform(generator, self.min, self.max)

    def Mean(self) -> float:
        return (self.min + self.max) / 2.0

    def ToSymbolic(self) -> Expression:
        return _uniform(self.min, self.max)


class UniformDiscrete(_Whole, Distribution):
    """One of several numbers, all equally likely."""

    values: list[float] = []

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


@no_constructor("Use GaussianVector, UniformVector, ...")
class DistributionVector:
    """A random vector."""

    def Sample(self, generator: RandomGenerator) -> np.ndarray:
        """A random value, shape (n,)."""
        raise NotImplementedError

    def Mean(self) -> np.ndarray:
        """The expected value, shape (n,)."""
        raise NotImplementedError

    def ToSymbolic(self) -> np.ndarray:
        """Expressions of random variables, shape (n,)."""
        raise NotImplementedError


class _DeterministicVector(_Whole, DistributionVector):
    """A vector that is known."""

    value: np.ndarray

    def Sample(self, generator: RandomGenerator) -> np.ndarray:
        return self.value.copy()

    def Mean(self) -> np.ndarray:
        return self.value.copy()

    def ToSymbolic(self) -> np.ndarray:
        Expression = importlib.import_module("sheldrake.symbolic").Expression
        return np.array([Expression(x) for x in self.value.tolist()], dtype=object)


class _GaussianVector(_Whole, DistributionVector):
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
        return np.array([_gaussian(mean, stddev) for mean, stddev in zip(self.mean.tolist(), deviations)], dtype=object)


class _UniformVector(_Whole, DistributionVector):
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
        return np.array([_uniform(low, high) for low, high in pairs], dtype=object)


def _family(name: str, base: type, *fields: str, loose: str | None = None) -> TemplateClass:
    """`Family[n]` for vectors of size n up to 6, and `Family[None]` for any size."""
    template = TemplateClass(name, scope=importlib.import_module("sheldrake.common.schema"))
    for size in (None, 1, 2, 3, 4, 5, 6):
        sizes = {field: None if field == loose else size for field in fields}
        members = {
            "__annotations__": {field: Annotated[np.ndarray, n] for field, n in sizes.items()},
            "__doc__": base.__doc__,
            **{field: np.zeros(n or 0) for field, n in sizes.items()},
        }
        template.add_instantiation((size,), type(name, (base,), members))
    template.__doc__ = base.__doc__
    return template
