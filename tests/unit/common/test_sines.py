"""Sines and cosines of many angles at once, against libm's."""

import numpy as np
import pytest

from sheldrake.common._kernels.generic import sines_and_cosines
from sheldrake.common.kernel import Vector, jit_enabled, kernel


@kernel(top=True)
def of_some(x: Vector, s: Vector, c: Vector, n: int) -> None:
    sines_and_cosines(x, n, s, c)


def found(x):
    """Sines and cosines of the numbers of a vector, in room for whole fours."""
    room = 4 * -(-len(x) // 4)
    padded, s, c = np.zeros((3, room))
    padded[: len(x)] = x
    of_some.native(padded, s, c, len(x))
    return s[: len(x)], c[: len(x)]


QUARTERS = np.arange(-4000, 4001) * (np.pi / 4)
ANGLES = {
    "small": np.r_[0.0, 1e-300, -1e-9, 1e-4, -0.1],
    "one": np.r_[0.3],
    "turns": np.random.default_rng(1).uniform(-10.0, 10.0, 4001),
    "many turns": np.random.default_rng(2).uniform(-1e5, 1e5, 4002),
    "more turns": np.random.default_rng(3).uniform(-1e12, 1e12, 403),
    "quarters": np.r_[QUARTERS, np.nextafter(QUARTERS, 9.0), np.nextafter(QUARTERS, -9.0)],
}


@pytest.mark.parametrize("name", ANGLES)
def test_they_are_right_to_the_last_place(name):
    """Both are within one unit in the last place of what is right: libm's is nearly always the nearest number."""
    x = ANGLES[name]
    for y, right in zip(found(x), (np.sin(x), np.cos(x))):
        np.testing.assert_array_less(np.abs(y - right), 1.6 * np.spacing(np.abs(right)))


def test_one_far_angle_does_not_matter_to_the_others():
    x = np.r_[0.5, 1e300, -2.0, 1e5 + 1.0]
    s, c = found(x)
    np.testing.assert_allclose(s, np.sin(x), rtol=1e-15)
    np.testing.assert_allclose(c, np.cos(x), rtol=1e-15)


@pytest.mark.skipif(not jit_enabled(), reason="math.sin(inf) raises")
def test_what_is_no_angle_has_no_sine():
    s, c = found(np.r_[np.nan, 1.0, np.inf])
    assert np.isnan(s).tolist() == np.isnan(c).tolist() == [True, False, True]


def test_without_room_for_fours_nothing_beyond_is_touched():
    x, s, c = np.random.default_rng(4).uniform(-3.0, 3.0, 6), np.full(7, 9.0), np.full(6, 9.0)
    of_some.native(x, s, c, 6)
    np.testing.assert_allclose(s, [*np.sin(x), 9.0], rtol=1e-15)
    np.testing.assert_allclose(c, np.cos(x), rtol=1e-15)


def test_no_angles_at_all():
    assert [len(part) for part in found(np.zeros(0))] == [0, 0]
