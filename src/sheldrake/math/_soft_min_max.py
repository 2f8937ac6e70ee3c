"""Smooth stand-ins for minimum and maximum, above or below the true one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.math._functions import exp, log

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar

__all__ = ["SoftOverMax", "SoftOverMin", "SoftUnderMax", "SoftUnderMin"]


def _check(call: str, x: Sequence[Any], alpha: float) -> None:
    if len(x) == 0:
        raise RuntimeError(f"{call}(): x is empty; it needs at least one number.")
    if not (alpha > 0 and math.isfinite(alpha)):
        raise RuntimeError(f"{call}(): alpha is {alpha}; it must be positive and finite.")


def _weights(x: Sequence[Any], alpha: float) -> tuple[Any, list]:
    largest = x[0]
    for number in x[1:]:
        largest = number if largest < number else largest
    return largest, [exp(alpha * (number - largest)) for number in x]


@checked
def SoftOverMax(x: Sequence[Any], alpha: float = 1.0) -> Scalar:
    """At least the maximum: log(sum(exp(alpha x))) / alpha.

    Args:
        x: Numbers, floats or AutoDiffXd.
        alpha: The larger, the closer to the maximum.

    Raises:
        RuntimeError: `x` is empty or `alpha` is not positive and finite.
    """
    _check("SoftOverMax", x, alpha)
    return _over(x, alpha)


def _over(x: Sequence[Any], alpha: float) -> Scalar:
    largest, weights = _weights(np.asarray(x).tolist(), alpha)
    return largest + log(sum(weights)) / alpha


@checked
def SoftUnderMax(x: Sequence[Any], alpha: float = 1.0) -> Scalar:
    """At most the maximum: the mean of x with weights exp(alpha x). See `SoftOverMax`."""
    _check("SoftUnderMax", x, alpha)
    return _under(x, alpha)


def _under(x: Sequence[Any], alpha: float) -> Scalar:
    x = np.asarray(x).tolist()  # Python's floats give Python's floats
    _, weights = _weights(x, alpha)
    return sum(weight * number for weight, number in zip(weights, x)) / sum(weights)


@checked
def SoftOverMin(x: Sequence[Any], alpha: float = 1.0) -> Scalar:
    """At least the minimum. See `SoftOverMax`."""
    _check("SoftOverMin", x, alpha)
    return -_under([-number for number in x], alpha)


@checked
def SoftUnderMin(x: Sequence[Any], alpha: float = 1.0) -> Scalar:
    """At most the minimum. See `SoftOverMax`."""
    _check("SoftUnderMin", x, alpha)
    return -_over([-number for number in x], alpha)
