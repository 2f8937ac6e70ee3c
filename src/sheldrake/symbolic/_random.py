"""Values of random variables, drawn as the C++ standard library draws them from the same generator."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from sheldrake.common import RandomGenerator
from sheldrake.symbolic._kinds import VariableType
from sheldrake.symbolic._variable import Variable


def sample(variables: frozenset[Variable], values: dict[Variable, float], generator: Callable[[], int]) -> None:
    """Puts a value for each random variable that has none into `values`, drawn in the order of their creation.

    Args:
        variables: All variables.
        values: Values known, by variable.
        generator: Gives 32 random bits a call.
    """
    for v in sorted(variables, key=Variable.get_id):
        draw: Any = _DRAWS.get(v._type)
        if v not in values and draw is not None:
            values[v] = draw(generator)


def _uniform(generator: Callable[[], int]) -> float:
    if type(generator) is RandomGenerator:
        return generator._uniform()
    low = int(generator())
    value = (low + int(generator()) * 2.0**32) / 2.0**64
    return value if value < 1.0 else math.nextafter(1.0, 0.0)


def _gaussian(generator: Callable[[], int]) -> float:
    """Marsaglia's polar method (1964)."""
    while True:
        x = 2.0 * _uniform(generator) - 1.0
        y = 2.0 * _uniform(generator) - 1.0
        r2 = x * x + y * y
        if 0.0 < r2 <= 1.0:
            return y * math.sqrt(-2.0 * math.log(r2) / r2)


def _exponential(generator: Callable[[], int]) -> float:
    return -math.log(1.0 - _uniform(generator))


_DRAWS = {
    VariableType.RANDOM_UNIFORM: _uniform,
    VariableType.RANDOM_GAUSSIAN: _gaussian,
    VariableType.RANDOM_EXPONENTIAL: _exponential,
}
