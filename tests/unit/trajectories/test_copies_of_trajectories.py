"""A copy of a trajectory shares nothing that anybody could notice."""

import numpy as np
import pytest

from sheldrake.math import BsplineBasis, RigidTransform, RollPitchYaw
from sheldrake.polynomial import Polynomial
from sheldrake.trajectories import (
    BezierCurve,
    BsplineTrajectory,
    CompositeTrajectory,
    PathParameterizedTrajectory,
    PiecewisePolynomial,
    PiecewisePose,
    StackedTrajectory,
    Trajectory,
)

TIMES, SAMPLES = [0.0, 1.0, 3.0], np.array([[1.0, 2.0, 0.5], [0.0, -1.0, 4.0]])


def lines() -> PiecewisePolynomial:
    return PiecewisePolynomial.FirstOrderHold(TIMES, SAMPLES)


def bezier() -> BezierCurve:
    return BezierCurve(0.0, 3.0, SAMPLES)


def spline() -> BsplineTrajectory:
    return BsplineTrajectory(BsplineBasis(3, 4, initial_parameter_value=0.0, final_parameter_value=3.0), np.eye(4))


def pose() -> PiecewisePose:
    return PiecewisePose.MakeLinear(TIMES, [RigidTransform(RollPitchYaw(t, 0.1, 0.2), [t, 0.0, 1.0]) for t in TIMES])


def scaling() -> PiecewisePolynomial:
    return PiecewisePolynomial.FirstOrderHold([0.0, 1.0], [[0.0, 3.0]])


def stacked() -> StackedTrajectory:
    out = StackedTrajectory()
    out.Append(bezier())
    return out


CHANGES = {
    "scaled": (lines, lambda x: x.ScaleTime(2.0)),
    "moved": (lines, lambda x: x.shiftRight(0.5)),
    "reversed": (lines, lambda x: x.ReverseTime()),
    "longer": (lines, lambda x: x.AppendFirstOrderSegment(5.0, [7.0, 7.0])),
    "shorter": (lines, lambda x: x.RemoveFinalSegment()),
    "another block": (lines, lambda x: x.setPolynomialMatrixBlock([[Polynomial([5.0])]], 0, 0, 0)),
    "other coefficients": (lines, lambda x: setattr(x, "polynomials", 2.0 * x.polynomials)),
    "its coefficients": (lines, lambda x: x.polynomials.fill(0.0)),
    "elevated": (bezier, lambda x: x.ElevateOrder()),
    "its points": (bezier, lambda x: x.control_points().fill(0.0)),
    "more knots": (spline, lambda x: x.InsertKnots([0.7])),
    "its control points": (spline, lambda x: x.control_points()[0].fill(9.0)),
    "appended to": (stacked, lambda x: x.Append(bezier())),
    "a child": (stacked, lambda x: x.children()[0].ElevateOrder()),
    "a segment": (lambda: CompositeTrajectory([lines()]), lambda x: x.segment(0).ScaleTime(2.0)),
    "a path": (lambda: PathParameterizedTrajectory(lines(), scaling()), lambda x: x.path().ScaleTime(3.0)),
    "a position": (pose, lambda x: x.get_position_trajectory().ScaleTime(3.0)),
}


def values(x: Trajectory) -> np.ndarray:
    return np.array([x.value(t) for t in (0.0, 0.3, 1.0, 2.2, 3.0)])


@pytest.mark.parametrize("call", ["Clone", "__copy__"])
@pytest.mark.parametrize(("make", "change"), CHANGES.values(), ids=CHANGES)
def test_changes_of_either_are_not_seen_in_the_other(make, change, call):
    first, again = make(), make()
    copies = getattr(first, call)(), getattr(again, call)()
    before = values(make())
    change(first)
    np.testing.assert_array_equal(values(copies[0]), before)
    change(copies[1])
    np.testing.assert_array_equal(values(again), before)


def test_values_that_a_caller_changes_are_the_callers():
    for make in (lines, bezier, spline, pose, stacked):
        x = make()
        before = values(x)
        for t in (0.0, 0.3, 3.0):
            x.value(t)[:] = 9.0
        np.testing.assert_array_equal(values(x.Clone()), before)
