"""What distances and contacts of any two shapes must be like, wherever they are."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.unit.geometry.proximity_scenes import HULL_POINTS, SHAPES, Scene, row_of

import sheldrake.geometry as g
from sheldrake.common.eigen_geometry import Quaternion
from sheldrake.geometry._kernels.model import BodyPoses
from sheldrake.geometry._kernels.pair_distance import find_distances
from sheldrake.math import RigidTransform, RotationMatrix

ALL = {**SHAPES, "hull": g.Convex(HULL_POINTS.T, "hull")}
PAIRS = [pair for pair in itertools.combinations_with_replacement(ALL, 2) if pair != ("half_space", "half_space")]
NEEDLE = g.Box(1.0, 1e-4, 1e-4)

numbers = st.floats(-1.0, 1.0)
rotations = (
    st.tuples(numbers, numbers, numbers, numbers)
    .filter(lambda q: np.linalg.norm(q) > 1e-3)
    .map(lambda q: RotationMatrix(Quaternion(np.array(q) / np.linalg.norm(q))))
)
coordinates = st.floats(-1.2, 1.2)
positions = st.tuples(coordinates, coordinates, coordinates).map(np.array)
poses = st.builds(RigidTransform, rotations, positions)
examples = settings(max_examples=20, deadline=None)


ITERATED = 1e-5
"""Of shapes of half a metre, deep in one another [m]."""


class Pair:
    """Two shapes, and the signed distance between them."""

    def __init__(self, *shapes):
        self.scene = Scene(shapes)

    def __repr__(self):
        return "a pair"

    def __call__(self, *poses):
        """(distance [m], nhat_BA_W, p_WCa, p_WCb)."""
        for body, X in enumerate(poses, 1):
            self.scene.X_WB[body] = row_of(X)
        assert find_distances.native(self.scene.model, BodyPoses(self.scene.X_WB), math.inf, self.scene.table) == 0
        assert np.isfinite(self.scene.table.point[0]).all()
        found = self.scene.table[0]
        return -found.depth, *map(np.array, (found.nhat_BA_W, found.p_WCa, found.p_WCb))


@pytest.fixture(scope="module")
def pairs():
    return {names: (Pair(*(ALL[n] for n in names)), Pair(*(ALL[n] for n in names[::-1]))) for names in PAIRS}


def exact(names):
    """Whether a pair is solved in closed form or by faces and edges; others are iterated."""
    return not {"cylinder", "capsule", "ellipsoid"} & set(names) or "sphere" in names or "half_space" in names


@pytest.mark.parametrize("names", PAIRS, ids="-".join)
@examples
@given(X=poses, Y=poses)
def test_a_to_b_is_as_far_as_b_to_a(pairs, names, X, Y):
    one, other = pairs[names]
    (phi, nhat, p_a, p_b), (phi2, nhat2, p_a2, p_b2) = one(X, Y), other(Y, X)
    tolerance = 1e-12 if exact(names) else ITERATED
    assert phi2 == pytest.approx(phi, abs=tolerance)
    assert np.linalg.norm(nhat) == pytest.approx(1.0, abs=1e-12)
    if phi > 1e-3 and names[0] != names[1]:  # apart, the nearest points of what is round are unique
        if "sphere" in names:
            np.testing.assert_allclose(nhat2, -nhat, atol=1e-9)
            np.testing.assert_allclose([p_b2, p_a2], [p_a, p_b], atol=1e-9)
    assert abs(np.linalg.norm(p_a - p_b) - abs(phi)) < max(tolerance, 1e-9)


@pytest.mark.parametrize("names", PAIRS, ids="-".join)
@examples
@given(X=poses, Y=poses, Z=poses)
def test_a_common_motion_changes_no_distance(pairs, names, X, Y, Z):
    pair = pairs[names][0]
    phi, moved = pair(X, Y)[0], pair(Z @ X, Z @ Y)[0]
    assert moved == pytest.approx(phi, abs=1e-12 if exact(names) else ITERATED)


@pytest.mark.parametrize("names", PAIRS, ids="-".join)
@examples
@given(X=poses, Y=poses, step=positions, scale=st.sampled_from([1e-9, 1e-6, 1e-3, 1e-1]))
def test_the_distance_changes_by_no_more_than_the_shift(pairs, names, X, Y, step, scale):
    """So it is continuous: also where shapes begin to touch, and while they overlap."""
    pair = pairs[names][0]
    phi = pair(X, Y)[0]
    shifted = pair(RigidTransform(X.rotation(), X.translation() + scale * step), Y)[0]
    assert abs(shifted - phi) <= scale * np.linalg.norm(step) + (1e-12 if exact(names) else ITERATED)


@pytest.mark.parametrize("names", PAIRS, ids="-".join)
@examples
@given(X=poses, Y=poses)
def test_the_force_begins_at_zero(pairs, names, X, Y):
    """Brought together along their normal until they just touch, shapes have contacts of no depth; before, none."""
    pair = pairs[names][0]
    pair.scene.model.geometry[:, 2] = 1
    phi, nhat, _, _ = pair(X, Y)
    if phi < 1e-3:
        return

    def depths(gap):
        """Of the deepest contact, and of the pair."""
        moved = RigidTransform(X.rotation(), X.translation() - (phi - gap) * nhat)
        rows = pair.scene.contacts(moved, Y, native=True)
        return (rows[:, 11].max() if len(rows) else 0.0), -pair(moved, Y)[0]

    tolerance = 1e-12 if exact(names) else ITERATED
    assert depths(1e-5)[0] <= tolerance
    deepest, depth = depths(-1e-6)
    assert 0.94 * depth - tolerance <= deepest  # boxes prefer faces to edges that are up to 5 % less deep
    assert deepest <= 1e-6 / np.cos(0.02) + tolerance  # a face may be so far off the normal


def test_a_shape_without_extent_is_refused():
    for make in (
        lambda: g.Box(1.0, 0.0, 1.0),
        lambda: g.Cylinder(0.0, 1.0),
        lambda: g.Capsule(0.1, 0.0),
        lambda: g.Ellipsoid(0.1, 0.2, 0.0),
        lambda: g.Box(1.0, np.nan, 1.0),
        lambda: g.Sphere(np.inf),
    ):
        with pytest.raises(RuntimeError, match="must be finite"):
            make()


SOLID = [name for name in ALL if name != "half_space"]


@pytest.mark.parametrize("names", list(itertools.combinations_with_replacement(SOLID, 2)), ids="-".join)
def test_coincident_centres_give_numbers(names):
    pair = Pair(*(ALL[n] for n in names))
    for X in (RigidTransform(), RigidTransform(RotationMatrix.MakeXRotation(0.3))):
        phi, nhat, _, _ = pair(RigidTransform(), X)
        assert phi < 0.0 and np.linalg.norm(nhat) == pytest.approx(1.0)
        rows = pair.scene.contacts(RigidTransform(), X, native=True)
        assert np.isfinite(rows).all() and len(rows) >= 1


@pytest.mark.parametrize("name", ALL)
@examples
@given(X=poses, Y=poses)
def test_a_needle_gives_numbers(name, X, Y):
    pair = Pair(ALL[name], NEEDLE)
    phi, nhat, p_a, p_b = pair(X, Y)
    assert np.linalg.norm(nhat) == pytest.approx(1.0, abs=1e-9)
    assert np.linalg.norm(p_a - p_b) == pytest.approx(abs(phi), abs=ITERATED)
    assert np.isfinite(pair.scene.contacts(X, Y, native=True)).all()


@pytest.mark.parametrize("name", SOLID)
def test_what_is_deep_below_the_ground_is_pushed_up(name):
    pair = Pair(ALL[name], g.HalfSpace())
    phi, nhat, _, _ = pair(RigidTransform([0.3, 0.2, -1e3]), RigidTransform())
    assert phi < -1e3 and nhat == pytest.approx([0.0, 0.0, 1.0])
    rows = pair.scene.contacts(RigidTransform([0.3, 0.2, -1e3]), RigidTransform(), native=True)
    assert len(rows) >= 1 and (rows[:, 11] > 999.0).all()


@pytest.mark.parametrize("names", PAIRS, ids="-".join)
@examples
@given(X=poses, Y=poses)
def test_far_from_the_origin_only_digits_are_lost(pairs, names, X, Y):
    """At 1e6 m a position has 1e-10 m of round-off."""
    pair, far = pairs[names][0], RigidTransform([1e6, -1e6, 1e6])
    assert pair(far @ X, far @ Y)[0] == pytest.approx(pair(X, Y)[0], abs=1e-8 if exact(names) else ITERATED)


def test_coplanar_points_make_a_hull_or_an_error():
    square = np.array([[0, 1, 1, 0], [0, 0, 1, 1], [0, 0, 0, 0]], float)
    try:
        pair = Pair(g.Convex(square, "square"), g.Sphere(0.1))
    except (RuntimeError, ValueError) as error:
        assert "square" in str(error) or "plane" in str(error)
    else:
        assert pair(RigidTransform(), RigidTransform([0.5, 0.5, 0.3]))[0] == pytest.approx(0.2, abs=1e-3)
