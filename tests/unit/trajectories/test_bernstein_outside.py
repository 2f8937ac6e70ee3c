"""A Bernstein polynomial is a polynomial also outside the time of its curve."""

import numpy as np
import pytest

from sheldrake.trajectories import BezierCurve


@pytest.mark.parametrize("time", [-0.5, 1.0, 2.5, 3.7])
def test_outside(time):
    curve = BezierCurve(1.0, 3.0, np.zeros((2, 4)))
    s = (time - 1.0) / 2.0
    np.testing.assert_allclose(curve.BernsteinBasis(1, time), 3 * s * (1 - s) ** 2)
    np.testing.assert_allclose(sum(curve.BernsteinBasis(i, time) for i in range(4)), 1.0)
