"""Paths of lines and arcs: smooth, of the given turning rates, at unit speed."""

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.symbolic import Expression
from sheldrake.trajectories import PiecewiseConstantCurvatureTrajectory as Path
from sheldrake.trajectories import PiecewiseConstantCurvatureTrajectory_

BREAKS, RATES = [0.0, 1.0, 1.5, 3.0], [2.0, 0.0, -0.7]
STADIUM = [0.0, 1.0, 1.0 + np.pi / 2, 2.0 + np.pi / 2, 2.0 + np.pi], [0.0, 2.0, 0.0, 2.0]


def path(**options):
    return Path(BREAKS, RATES, [0.0, 3.0, 3.0], [2.0, 0.0, 0.0], [0.1, 0.2, 0.3], **options)


def test_it_begins_where_it_was_told():
    X = path().CalcPose(0.0)
    half = np.sqrt(0.5)
    np.testing.assert_allclose(X.translation(), [0.1, 0.2, 0.3], atol=1e-15)
    np.testing.assert_allclose(X.rotation().matrix().T, [[0, half, half], [0, -half, half], [1, 0, 0]], atol=1e-15)


@pytest.mark.parametrize("s", [-0.4, 0.3, 0.999, 1.2, 1.51, 2.9, 4.0])
def test_the_tangent_is_the_derivative_and_turns_at_the_rate(s):
    p, h = path(), 1e-6
    before, X, after = (p.CalcPose(s + d) for d in (-h, 0.0, h))
    x, y, z = X.rotation().matrix().T
    np.testing.assert_allclose((after.translation() - before.translation()) / (2 * h), x, atol=1e-9)
    turning = (after.rotation().col(0) - before.rotation().col(0)) / (2 * h)
    np.testing.assert_allclose(turning, p.curvature(s) * y, atol=1e-9)
    np.testing.assert_allclose(z, [1.0, 0.0, 0.0], atol=1e-15)
    assert p.curvature(s) == RATES[np.clip(np.searchsorted(BREAKS, s, "right") - 1, 0, 2)]


@pytest.mark.parametrize("s", BREAKS[1:-1])
def test_pieces_join_smoothly(s):
    before, after = path().CalcPose(s - 1e-12), path().CalcPose(s)
    np.testing.assert_allclose(before.GetAsMatrix34(), after.GetAsMatrix34(), atol=1e-11)


def test_a_stadium_closes_and_begins_anew():
    stadium = Path(*STADIUM, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0], is_periodic=True)
    assert stadium.is_periodic() and stadium.EndpointsAreNearlyEqual(1e-14)
    assert not path().EndpointsAreNearlyEqual(1e-3)
    for s in (0.3, 2.0, 5.0):
        for turns in (-3, 1, 7):
            there, here = (stadium.CalcPose(a).GetAsMatrix34() for a in (s + turns * stadium.length(), s))
            np.testing.assert_allclose(there, here, atol=1e-13)
            assert stadium.curvature(s + turns * stadium.length()) == stadium.curvature(s)


def test_what_a_trajectory_says():
    p = path()
    assert (p.rows(), p.cols(), p.length(), p.start_time(), p.end_time()) == (3, 1, 3.0, 0.0, 3.0)
    assert not p.has_derivative()
    np.testing.assert_array_equal(p.value(1.2).ravel(), p.CalcPose(1.2).translation())
    np.testing.assert_array_equal(p.Clone().value(1.2), p.value(1.2))


def test_of_other_scalars():
    X = PiecewiseConstantCurvatureTrajectory_[AutoDiffXd](path()).CalcPose(AutoDiffXd(2.0, [1.0]))
    slope = [x.derivatives()[0] for x in X.translation()]
    np.testing.assert_allclose(slope, path().CalcPose(2.0).rotation().col(0), atol=1e-14)


def test_of_expressions():
    symbolic = PiecewiseConstantCurvatureTrajectory_[Expression](path())
    for s in (0.4, 1.2, 2.0):
        p = [x.Evaluate() for x in symbolic.CalcPose(Expression(s)).translation()]
        np.testing.assert_allclose(p, path().CalcPose(s).translation(), atol=1e-14)


WRONG = {
    "one turning rate for each segment": ([0.0, 1.0], [1.0, 2.0]),
    "the first must be 0": ([0.5, 1.0], [1.0]),
    "increasing order": ([0.0, 1.0, 1.0], [1.0, 2.0]),
    "initial tangent is zero": ([0.0, 1.0], [1.0], [0.0, 0.0, 0.0]),
    "normal is zero": ([0.0, 1.0], [1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
    "perpendicular": ([0.0, 1.0], [1.0], [1.0, 0.0, 0.0], [0.1, 0.0, 1.0]),
}


@pytest.mark.parametrize("message", WRONG)
def test_wrong_paths_are_refused(message):
    with pytest.raises(RuntimeError, match=message):
        Path(*WRONG[message])
