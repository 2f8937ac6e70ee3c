"""Piecewise polynomials through samples: holds, lines, cubics of several sorts; `_interpolation` solves for them."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from sheldrake.common._overloads import Mismatch
from sheldrake.common._scalars import any_array, as_scalar
from sheldrake.trajectories import _interpolation as interpolation

_NOT_GIVEN = object()


class ThroughSamples:
    """The part of PiecewisePolynomial that makes trajectories from samples; the same for all scalars."""

    _T: Any
    _name: Any
    _mismatch: Any
    _scalars: Any
    _matrix: Any
    _check_increasing: Any

    @classmethod
    def _of(cls, coefficients: list[np.ndarray], breaks: list) -> Any:
        """The trajectory of one matrix of coefficients for each segment."""
        raise NotImplementedError

    @classmethod
    def _samples(cls, call: str, breaks: Any, samples: Any, least: int) -> tuple[list, np.ndarray]:
        """Breaks and samples, checked; samples of shape (n, rows, cols)."""
        times = cls._scalars(call, breaks)
        y = cls._sample_array(call, samples)
        if len(times) != len(y):
            raise RuntimeError(
                f"{cls._name(call)}: Number of break points {len(times)} does not match number of samples {len(y)}."
            )
        if len(y) < least:
            raise RuntimeError(
                f"{cls._name(call)}: {len(y)} samples is not enough samples (this method requires at least {least})."
            )
        if y.size == 0:
            raise RuntimeError(f"{cls._name(call)}: Knots need to be non-empty.")
        cls._check_increasing(times)
        return times, y

    @classmethod
    def _sample_array(cls, call: str, samples: Any) -> np.ndarray:
        try:
            y = any_array(cls._T, samples)
        except Mismatch:
            shapes = {np.shape(s) for s in samples} if hasattr(samples, "__iter__") else set()
            if len(shapes) > 1:
                raise RuntimeError(f"{cls._name(call)}: Knots have inconsistent dimensions: {shapes}.") from None
            raise cls._mismatch(call, f"samples of {cls._T.__name__}", samples) from None
        if y.ndim == 2:
            return y.T[:, :, None]
        if y.ndim != 3:
            raise cls._mismatch(
                call, "samples as the columns of a matrix, or as a list of matrices", f"an array of shape {y.shape}"
            )
        return y

    @classmethod
    def _durations(cls, times: list) -> list:
        return [b - a for a, b in itertools.pairwise(times)]

    @classmethod
    def ZeroOrderHold(cls, breaks: Any, samples: Any) -> Any:
        """Returns the trajectory that keeps each sample until the next break.

        Args:
            breaks: Times [s], shape `(n,)`, increasing.
            samples: Vectors as the columns of a matrix, shape `(rows, n)`, or a list of n matrices.

        Raises:
            RuntimeError: numbers of breaks and samples differ, too few samples, or breaks do not increase.
        """
        times, y = cls._samples("ZeroOrderHold", breaks, samples, 2)
        return cls._of(interpolation.constant(y), times)

    @classmethod
    def FirstOrderHold(cls, breaks: Any, samples: Any) -> Any:
        """Returns straight lines from sample to sample; arguments as those of `ZeroOrderHold`."""
        times, y = cls._samples("FirstOrderHold", breaks, samples, 2)
        return cls._of(interpolation.linear(cls._durations(times), y), times)

    @classmethod
    def CubicShapePreserving(cls, breaks: Any, samples: Any, zero_end_point_derivatives: bool = False) -> Any:
        """Returns cubics with continuous slopes that rise and fall where the samples do.

        Args:
            breaks: Times [s], shape `(n,)`, increasing; at least three, or two with zero end slopes.
            samples: Vectors as the columns of a matrix, shape `(rows, n)`, or a list of n matrices.
            zero_end_point_derivatives: The slopes at both ends are zero.

        Raises:
            RuntimeError: as `ZeroOrderHold`.
        """
        least = 2 if zero_end_point_derivatives else 3
        times, y = cls._samples("CubicShapePreserving", breaks, samples, least)
        h = cls._durations(times)
        slopes = interpolation.shape_preserving_slopes(h, y, bool(zero_end_point_derivatives))
        return cls._of(interpolation.cubic(h, y, slopes), times)

    @classmethod
    def CubicWithContinuousSecondDerivatives(
        cls,
        breaks: Any,
        samples: Any,
        sample_dot_at_start: Any = _NOT_GIVEN,
        sample_dot_at_end: Any = _NOT_GIVEN,
        *,
        periodic_end_condition: bool = False,
        periodic_end: bool = False,
    ) -> Any:
        """Returns cubics whose first and second derivatives are continuous.

        Args:
            breaks: Times [s], shape `(n,)`, increasing.
            samples: Vectors as the columns of a matrix, shape `(rows, n)`, or a list of n matrices.
            sample_dot_at_start: Slope at the start, of the shape of a sample; without it and with two segments or
                more, the first two cubics are one, as are the last two.
            sample_dot_at_end: Slope at the end.
            periodic_end_condition: First and second derivatives at the end equal those at the start. May also be the
                third argument.
            periodic_end: The same.

        Raises:
            RuntimeError: as `ZeroOrderHold`.
        """
        call = "CubicWithContinuousSecondDerivatives"
        if sample_dot_at_end is _NOT_GIVEN and isinstance(sample_dot_at_start, (bool, np.bool_)):
            periodic_end, sample_dot_at_start = bool(sample_dot_at_start), _NOT_GIVEN
        clamped = sample_dot_at_start is not _NOT_GIVEN
        times, y = cls._samples(call, breaks, samples, 2 if clamped else 3)
        ends: Any = "periodic" if periodic_end_condition or periodic_end else "not-a-knot"
        if clamped:
            ends = tuple(cls._matrix(call, m) for m in (sample_dot_at_start, sample_dot_at_end))
            if any(m.shape != y.shape[1:] for m in ends):
                raise RuntimeError(
                    f"{cls._name(call)}: the slopes at the ends must have the shape of a sample, {y.shape[1:]}; got "
                    f"{ends[0].shape} and {ends[1].shape}."
                )
        h = cls._durations(times)
        slopes = interpolation.smooth_slopes(h, y, ends, as_scalar(cls._T, 0.0))
        return cls._of(interpolation.cubic(h, y, slopes), times)

    @classmethod
    def CubicHermite(cls, breaks: Any, samples: Any, samples_dot: Any) -> Any:
        """Returns cubics through the samples with the given slopes.

        Args:
            breaks: Times [s], shape `(n,)`, increasing.
            samples: Vectors as the columns of a matrix, shape `(rows, n)`, or a list of n matrices.
            samples_dot: Slopes [1/s], like the samples.

        Raises:
            RuntimeError: as `ZeroOrderHold`, or samples and slopes differ in shape.
        """
        times, y = cls._samples("CubicHermite", breaks, samples, 2)
        m = cls._sample_array("CubicHermite", samples_dot)
        if m.shape != y.shape:
            raise RuntimeError(
                f"{cls._name('CubicHermite')}: Y and Ydot have different length or shape: {y.shape}, {m.shape}."
            )
        return cls._of(interpolation.cubic(cls._durations(times), y, m), times)

    @classmethod
    def LagrangeInterpolatingPolynomial(cls, times: Any, samples: Any) -> Any:
        """Returns the one segment whose polynomials, of degree n - 1, go through all n samples."""
        t, y = cls._samples("LagrangeInterpolatingPolynomial", times, samples, 1)
        if len(t) == 1:
            raise RuntimeError(f"{cls._name('LagrangeInterpolatingPolynomial')}: one sample makes no segment.")
        return cls._of([interpolation.lagrange(t, y)], [t[0], t[-1]])
