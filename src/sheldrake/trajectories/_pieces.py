"""Trajectories as polynomials between breaks, for those that are such."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from sheldrake.trajectories._bezier import BezierCurve
from sheldrake.trajectories._bspline import BsplineTrajectory
from sheldrake.trajectories._composed import CompositeTrajectory, StackedTrajectory
from sheldrake.trajectories._derivative_trajectory import DerivativeTrajectory, _WrappedTrajectory
from sheldrake.trajectories._piecewise_polynomial import PiecewisePolynomial

_STEEPEST = 5
"""Degree up to which the powers of the time since the beginning represent a Bézier curve well in one piece."""


def is_piecewise(trajectory: Any) -> bool:
    """Whether `as_piecewise_polynomial` knows how; classes of users compute something else, and so do other scalars."""
    kind = type(trajectory)
    if kind is CompositeTrajectory:
        parts = [trajectory.segment(i) for i in range(trajectory.get_number_of_segments())]
        return bool(parts) and all(map(is_piecewise, parts))
    if kind is StackedTrajectory:
        return trajectory.rowwise() and bool(trajectory.children()) and all(map(is_piecewise, trajectory.children()))
    if kind is DerivativeTrajectory:
        derivative = trajectory._nominal.MakeDerivative(trajectory._order)
        return type(derivative) is not DerivativeTrajectory and is_piecewise(derivative)
    if kind is _WrappedTrajectory:
        return is_piecewise(trajectory.unwrap())
    if kind is BezierCurve:
        return trajectory.order() >= 0 and trajectory.end_time() > trajectory.start_time()
    return kind in (PiecewisePolynomial, BsplineTrajectory) and trajectory.rows() > 0


def as_piecewise_polynomial(trajectory: Any) -> PiecewisePolynomial:
    """The same function of time, to round-off.

    Args:
        trajectory: One of which `is_piecewise` says so.
    """
    kind = type(trajectory)
    if kind is CompositeTrajectory:
        parts = (trajectory.segment(i) for i in range(trajectory.get_number_of_segments()))
        return functools.reduce(_one_after_the_other, map(as_piecewise_polynomial, parts))
    if kind is StackedTrajectory:
        return _stacked([as_piecewise_polynomial(child) for child in trajectory.children()])
    if kind is DerivativeTrajectory:
        return as_piecewise_polynomial(trajectory._nominal.MakeDerivative(trajectory._order))
    if kind is _WrappedTrajectory:
        return as_piecewise_polynomial(trajectory.unwrap())
    if kind is BsplineTrajectory:
        basis = trajectory.basis()
        inside = basis.knots()[basis.order() - 1 : len(basis.knots()) - basis.order() + 1]
        return _by_slopes(trajectory, np.unique(inside), basis.order())
    if kind is BezierCurve:
        n = trajectory.order()
        times = np.linspace(trajectory.start_time(), trajectory.end_time(), (1 if n <= _STEEPEST else n) + 1)
        return _by_slopes(trajectory, times, n + 1)
    return trajectory


def _by_slopes(trajectory: Any, breaks: np.ndarray, powers: int) -> PiecewisePolynomial:
    """Taylor's polynomials at the breaks of a function that is polynomial between them."""
    slopes = [trajectory, *(trajectory.MakeDerivative(k) for k in range(1, powers))]
    coefficients = [
        np.stack([slope.value(t) / math.factorial(k) for k, slope in enumerate(slopes)], axis=-1) for t in breaks[:-1]
    ]
    return PiecewisePolynomial._of(coefficients, breaks.tolist())


def _one_after_the_other(first: PiecewisePolynomial, then: PiecewisePolynomial) -> PiecewisePolynomial:
    return PiecewisePolynomial._of([*first._c, *then._c], [*first._breaks, *then._breaks[1:]])


def _stacked(parts: list[PiecewisePolynomial]) -> PiecewisePolynomial:
    """One below the other, between the breaks of all of them."""
    breaks = sorted({b for part in parts for b in part._breaks})
    powers = max(c.shape[-1] for part in parts for c in part._c)
    coefficients = [np.concatenate([_at(part, b, powers) for part in parts]) for b in breaks[:-1]]
    return PiecewisePolynomial._of(coefficients, breaks)


def _at(part: PiecewisePolynomial, begin: float, powers: int) -> np.ndarray:
    """Coefficients of the time since `begin`, of the piece that is there."""
    i = part._index(begin)
    c = part._c[i]
    out = np.zeros((*c.shape[:2], powers))
    if begin == part._breaks[i] or c.shape[-1] == 1:
        out[..., : c.shape[-1]] = c
        return out
    for k in range(c.shape[-1]):
        out[..., k] = part._at(begin, k) / math.factorial(k)
    return out
