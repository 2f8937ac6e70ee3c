"""Newton's method on the direction between curved shapes: what it finds is exact, and it finds nearly all."""

import itertools

import numpy as np
import pytest
from proximity_scenes import HULL_POINTS, SHAPES, Scene, random_pose, row_of
from test_half_space_contacts import PointHull

from sheldrake import geometry as g
from sheldrake.geometry._kernels import separation as stage
from sheldrake.geometry._kernels.model import POLYGON_A, BodyPoses
from sheldrake.geometry._kernels.polish import NARROW, SQUARE, edge_over_cap, face_against, nearby, polish
from sheldrake.geometry._kernels.support import best_face, shown_face, support, within_face, within_polygon
from sheldrake.geometry._kernels.table import place_geometry
from sheldrake.math import RigidTransform, RollPitchYaw

CONVEX = {name: SHAPES[name] for name in ("box", "cylinder", "capsule", "ellipsoid")} | {"hull": PointHull(HULL_POINTS)}
CURVED = ("cylinder", "ellipsoid")
PAIRS = [p for p in itertools.combinations_with_replacement(CONVEX, 2) if set(p) & set(CURVED)]


def placed(first, second, X, Y):
    scene = Scene([first, second])
    scene.X_WB[1], scene.X_WB[2] = row_of(X), row_of(Y)
    place_geometry(scene.model, BodyPoses(scene.X_WB), scene.table)
    return scene


def extent(scene, d):
    """Of the difference of the two shapes' cores along d."""
    a = support(scene.model, scene.table, 0, tuple(d))
    b = support(scene.model, scene.table, 1, tuple(-np.asarray(d)))
    return float(np.dot(np.subtract(a, b), d))


@pytest.mark.parametrize("first, second", PAIRS)
def test_an_answer_is_a_minimum_with_points_that_show_it(first, second, monkeypatch):
    """Points lie apart by the depth along the direction, and no direction nearby has less of it."""
    rng = np.random.default_rng(11)
    answers = []

    def kept(find):
        def call(*args):
            found = find(*args)
            answers.append(found)
            return found

        return call

    monkeypatch.setattr("sheldrake.geometry._kernels.polish.polish", kept(polish))
    found = asked = 0
    for _ in range(25):
        scene = placed(CONVEX[first], CONVEX[second], random_pose(rng, 0.35), random_pose(rng, 0.35))
        answers.clear()
        stage.separation(scene.model, scene.table, 0, 1, 1e9)
        if not answers:
            continue
        asked += 1
        exact, d, depth, p_A, p_B = answers[-1]
        if not exact:
            continue
        found += 1
        assert np.linalg.norm(d) == pytest.approx(1.0, abs=1e-14)
        assert depth == pytest.approx(extent(scene, d), abs=1e-13)
        np.testing.assert_allclose(np.subtract(p_A, p_B), depth * np.asarray(d), atol=3e-12)
        for turn in rng.normal(size=(30, 3)) * 1e-4:
            near = (np.asarray(d) + turn) / np.linalg.norm(np.asarray(d) + turn)
            assert extent(scene, near) >= depth - 1e-12
    assert asked >= 4
    assert found >= 0.7 * asked


def test_a_rim_against_an_edge_touches_where_the_textbook_says():
    """A cylinder lies with its rim on a box: the distance is that of the lowest point of a circle."""
    radius, tilt = 0.3, 0.4
    X = RigidTransform(RollPitchYaw(0.0, tilt, 0.0), [0.0, 0.0, 0.9])
    scene = placed(g.Cylinder(radius, 0.2), g.Box(2.0, 0.2, 0.5), X, RigidTransform())
    down = (0.0, 0.0, -1.0)
    exact, d, depth, p_A, _p_B = polish(scene.model, scene.table, 0, 1, 1.0, down, SQUARE)
    rim = 0.9 - 0.1 * np.cos(tilt) - radius * np.sin(tilt)
    assert exact
    assert depth == pytest.approx(-(rim - 0.25), abs=1e-14)
    np.testing.assert_allclose(d, down, atol=1e-14)
    assert p_A[2] == pytest.approx(rim, abs=1e-14)


@pytest.mark.parametrize("lean", [4e-5, 2e-4, 1e-3, 1e-2])
def test_a_rim_meets_the_side_of_a_cylinder_that_is_nearly_parallel(lean):
    """Two cylinders overlap side by side, and one leans towards the other: its rim is where they overlap least.

    Their axes are nearest to each other far beyond their ends, so that the direction square to both says nothing.
    """
    upright, leaning = 0.07, 0.055
    X = RigidTransform(RollPitchYaw(0.0, -lean, 0.0), [0.088, 0.08, -0.05])
    scene = placed(g.Cylinder(upright, 0.14), g.Cylinder(leaning, 0.14), RigidTransform(), X)
    out = np.array([0.745, 0.667, 0.0]) / np.hypot(0.745, 0.667)  # square to the upright side, as EPA leaves it
    found, d, depth, _p_A, p_B = nearby(scene.model, scene.table, 0, 1, 0.2, tuple(out), extent(scene, out))

    def across(angle):
        """How far a point of the upper rim is from the axis of the upright cylinder."""
        return np.hypot(*(X @ [leaning * np.cos(angle), leaning * np.sin(angle), 0.07])[:2])

    middle, width = np.arctan2(0.08, 0.088) + np.pi, 0.1
    while width > 1e-9:  # thirds: the distance is convex there
        left, right = middle - width / 3.0, middle + width / 3.0
        middle, width = (left if across(left) < across(right) else right), width * 2.0 / 3.0
    assert found
    assert depth == pytest.approx(upright - across(middle), abs=1e-14)
    assert d[2] == pytest.approx(0.0, abs=1e-15)
    assert p_B[2] == pytest.approx((X @ [leaning * np.cos(middle), leaning * np.sin(middle), 0.07])[2], abs=1e-8)


def test_a_cap_overhanging_a_table_is_no_face_against_a_point():
    """The lowest point of a cap that is tilted towards a table's border is beside the table: the face is refused."""
    X = RigidTransform(RollPitchYaw(0.0, 1e-3, 0.0), [0.45, 0.0, 0.6])
    table, can = g.Box(1.0, 1.0, 1.0), g.Cylinder(0.2, 0.2)
    scene = placed(table, can, RigidTransform(), X)
    assert not face_against(scene.model, scene.table, 0, 1, (0.0, 0.0, 1.0))[0]
    inside = placed(table, can, RigidTransform(), RigidTransform(X.rotation(), [0.1, 0.0, 0.6]))
    met, n, depth, p_table, p_can = face_against(inside.model, inside.table, 0, 1, (0.0, 1e-4, 1.0))
    assert met
    np.testing.assert_allclose(n, (0.0, 0.0, 1.0), atol=1e-15)
    assert depth == pytest.approx(0.5 - (0.6 - 0.1 * np.cos(1e-3) - 0.2 * np.sin(1e-3)), abs=1e-14)
    np.testing.assert_allclose(np.subtract(p_table, p_can), (0.0, 0.0, depth), atol=1e-14)


def test_from_any_direction_it_finds_a_minimum_or_says_that_it_has_none():
    rng = np.random.default_rng(2)
    scene = placed(SHAPES["ellipsoid"], SHAPES["cylinder"], RigidTransform(), RigidTransform([0.7, 0.5, 0.6]))
    outcomes = {True: 0, False: 0}
    for start in rng.normal(scale=0.5, size=(60, 3)) + np.array([0.7, 0.5, 0.6]):
        exact, d, depth, p_A, p_B = polish(
            scene.model, scene.table, 0, 1, 1.0, tuple(start / np.linalg.norm(start)), NARROW
        )
        outcomes[bool(exact)] += 1
        if exact:
            np.testing.assert_allclose(np.subtract(p_A, p_B), depth * np.asarray(d), atol=3e-12)
            for turn in rng.normal(size=(20, 3)) * 1e-4:
                near = (np.asarray(d) + turn) / np.linalg.norm(np.asarray(d) + turn)
                assert extent(scene, near) >= depth - 1e-12
    assert min(outcomes.values()) > 0


@pytest.mark.parametrize("beyond", [-0.05, 0.02, 0.15, 0.25])
def test_a_face_meets_the_part_of_a_cylinders_side_that_lies_over_it(beyond):
    """A rod of half length 0.2 lies across the edge of a table at x = 0, its middle beyond it or not."""
    table, rod = g.Box(1.0, 1.0, 0.1), g.Cylinder(0.03, 0.4)
    lying = RollPitchYaw(0.0, np.pi / 2, 0.0)
    scene = placed(table, rod, RigidTransform([-0.5, 0.0, -0.05]), RigidTransform(lying, [beyond, 0.1, 0.02]))
    met, n, depth, p_table, p_rod = face_against(scene.model, scene.table, 0, 1, (1e-3, 0.0, 1.0))
    assert met == (beyond < 0.2)
    if met:
        over = min(beyond + 0.2, 0.0)  # what lies over the table ends at its edge
        np.testing.assert_allclose(n, [0, 0, 1], atol=1e-12)
        assert depth == pytest.approx(0.01, abs=1e-12)
        np.testing.assert_allclose(p_table, [0.5 * (beyond - 0.2 + over), 0.1, 0.0], atol=1e-12)
        np.testing.assert_allclose(p_rod, np.subtract(p_table, [0, 0, 0.01]), atol=1e-12)


@pytest.mark.parametrize("tilt", [3e-9, 6e-8, 1e-6])
@pytest.mark.parametrize("aside", [0.0, 0.036, -0.045])
def test_side_that_is_nearly_in_the_plane_of_a_cap_passes_over_its_rim(tilt, aside):
    """The direction found has the least extent, also against directions that differ by less than the tilt."""
    cap, rod = g.Cylinder(0.05, 0.1), g.Cylinder(0.066, 0.4)
    X = RigidTransform(RollPitchYaw(np.pi / 2 + tilt, 0.0, 0.4), [aside, 0.02, 0.05 + 0.066 - 0.0025])
    scene = placed(cap, rod, RigidTransform(), X)
    found, d, depth, p_A, p_B = edge_over_cap(scene.model, scene.table, 0, 1, 0.3, (1e-4, 0.0, np.sqrt(1.0 - 1e-8)))
    assert found
    np.testing.assert_allclose(np.subtract(p_A, p_B), depth * np.array(d), atol=1e-12)
    assert abs(extent(scene, np.array(d)) - depth) < 1e-15
    rng = np.random.default_rng(3)
    for scale in 10.0 ** rng.uniform(-11.0, -1.0, 1000):
        other = d + scale * rng.normal(size=3)
        assert extent(scene, other / np.linalg.norm(other)) > depth - 1e-15
    asked = stage.separation(scene.model, scene.table, 0, 1, 1e9)
    assert asked[0] == -depth


def test_a_side_far_from_the_plane_of_a_cap_is_left_to_others():
    X = RigidTransform(RollPitchYaw(np.pi / 2 + 0.1, 0.0, 0.0), [0.0, 0.0, 0.11])
    scene = placed(g.Cylinder(0.05, 0.1), g.Cylinder(0.066, 0.4), RigidTransform(), X)
    assert not edge_over_cap(scene.model, scene.table, 0, 1, 0.3, (0.0, 0.0, 1.0))[0]


def test_a_cap_all_but_flat_on_another_touches_with_its_face():
    """Also where another direction seems to be better by half a billionth of the size, as rounding may have it."""
    scene = placed(
        g.Cylinder(0.06, 0.24), g.Cylinder(0.06, 0.12), RigidTransform(), RigidTransform([0.03, 0.0, 0.18001])
    )
    size, up = scene.model[0].bound + scene.model[1].bound, (0.0, 0.0, 1.0)
    for nearer, expected in ((5e-10, True), (5e-9, False)):
        found, n, depth, *_ = nearby(scene.model, scene.table, 0, 1, size, up, -1e-5 - nearer * size)
        assert found == expected
        if found:
            assert n == up and abs(depth + 1e-5) < 1e-15


@pytest.mark.parametrize("far", [0.0, 1e3])
def test_newtons_method_ends_where_rounding_lets_it(far):
    """The rim of a cylinder over the side of another: far from the origin they meet alike, but for rounding."""
    shift = np.array([far, -far, far])
    X = RigidTransform(RollPitchYaw(0.0, np.pi / 2, 0.0), shift)
    Y = RigidTransform(RollPitchYaw(0.3, 0.6, 0.0), np.add(shift, [0.05, 0.04, 0.3]))
    scene = placed(g.Cylinder(0.1, 0.8), g.Cylinder(0.2, 0.3), X, Y)
    _, nhat_ji, _, _ = stage.separation(scene.model, scene.table, 0, 1, 1e9)
    d = tuple(RollPitchYaw(2e-3, -1e-3, 1e-3).ToRotationMatrix() @ np.negative(nhat_ji))
    size = scene.model[0].bound + scene.model[1].bound
    found, d, depth, p_A, p_B = polish(scene.model, scene.table, 0, 1, size, d, SQUARE)
    assert found
    assert extent(scene, d) == pytest.approx(depth, abs=1e-13 + 4e-16 * far)
    # Both points are on the line along d, of which no slope is left.
    assert np.subtract(p_A, p_B) == pytest.approx(depth * np.array(d), abs=1e-13 + 1e-15 * far)


def test_a_point_is_within_a_cap_as_it_is_within_its_polygon():
    """Points inside and outside of the circles around and within the polygon, and between them, with all margins."""
    scene = placed(
        g.Cylinder(0.3, 0.8), g.Sphere(0.1), RigidTransform(RollPitchYaw(0.3, -0.5, 0.7), [1, 2, 3]), RigidTransform()
    )
    model, table = scene.model, scene.table
    face, n = best_face(model, table, 0, (0.1, 0.2, 1.0))
    X_WG = RigidTransform(RollPitchYaw(0.3, -0.5, 0.7), [1, 2, 3])
    rng = np.random.default_rng(3)
    answers = set()
    for _ in range(300):
        turn, rho, margin = rng.uniform(0, 2 * np.pi), 0.3 * rng.uniform(0.8, 1.2), rng.choice([-0.03, 0.0, 0.03, 0.4])
        x = tuple(X_WG @ np.array([rho * np.cos(turn), rho * np.sin(turn), 0.4]))
        sides = shown_face(model, table, 0, face, n, POLYGON_A)
        expected = within_polygon(table, sides, n, x, margin)
        assert within_face(model, table, 0, face, n, x, margin) == expected
        answers.add((bool(expected), rho < 0.3 * np.cos(np.pi / 16), rho < 0.3))
    assert len(answers) == 6


@pytest.mark.parametrize("axis", range(3))
def test_a_direction_with_a_part_that_is_nothing_has_the_same_bits_from_either_side(axis):
    """An ellipsoid beside a capsule, both along the world's axes: one part of the direction between them is 0."""
    place = np.array([0.5, 0.4, 0.3])
    place[axis] = 0.0
    scene = placed(g.Ellipsoid(0.2, 0.15, 0.1), g.Capsule(0.05, 0.1), RigidTransform(), RigidTransform(place))
    _, nhat_ji, _, _ = stage.separation(scene.model, scene.table, 0, 1, 1e9)
    answers = set()
    for aside in (-1e-3, -1e-5, -1e-8, -1e-15, -1e-20, 0.0, 1e-20, 1e-15, 1e-8, 1e-5, 1e-3):
        d = -np.array(nhat_ji)
        d[axis] += aside
        found, d, depth, *_ = nearby(scene.model, scene.table, 0, 1, 1.0, tuple(d / np.linalg.norm(d)), 0.0)
        assert found
        answers.add((*d, depth))
    assert len(answers) == 1


def test_depth_along_a_direction_square_to_two_edges_is_that_of_the_farthest_points():
    """Rods beside long hulls: square to a rod and to an edge of one vertex, another vertex may be farthest."""
    found = 0
    for seed in (3, 20, 22, 41, 53, 58):
        rng = np.random.default_rng(seed)
        hull, aside = PointHull(rng.normal(size=(10, 3)) * [0.02, 0.02, 1.0]), rng.normal(size=3) * [0.02, 0.02, 0.0]
        scene = placed(hull, g.Cylinder(0.1, 6.0), RigidTransform(), RigidTransform(aside))
        size = scene.model[0].bound + scene.model[1].bound
        for angle in np.linspace(0.0, 2.0 * np.pi, 60):
            start = (np.cos(angle), np.sin(angle), 0.0)
            known, d, depth, *_ = polish(scene.model, scene.table, 0, 1, size, start, SQUARE)
            if known:
                found += 1
                assert depth == pytest.approx(extent(scene, d), abs=1e-12)
    assert found >= 5


def test_small_shapes_a_metre_away_are_found_in_spite_of_the_rounding_of_positions():
    """From a direction whose depth seems to be less, by last digits of the metre, than that of the best one."""
    rng, there = np.random.default_rng(5), np.array([0.9, -0.8, 0.7])
    ellipsoid, capsule = g.Ellipsoid(2e-3, 1e-3, 5e-4), g.Capsule(5e-4, 2e-3)
    for _ in range(40):
        X, Y = (RigidTransform(RollPitchYaw(*rng.uniform(-3, 3, 3)), there + rng.normal(size=3) * 2e-3) for _ in "ab")
        scene = placed(ellipsoid, capsule, X, Y)
        phi, nhat_ji, *_ = stage.separation(scene.model, scene.table, 0, 1, 1e9)
        if phi + 5e-4 < 1e-4:
            continue
        size = scene.model[0].bound + scene.model[1].bound
        start = np.negative(nhat_ji) + 1e-8 * rng.normal(size=3)
        start /= np.linalg.norm(start)
        found, d, depth, *_ = nearby(scene.model, scene.table, 0, 1, size, tuple(start), extent(scene, start) - 2e-16)
        assert found
        assert depth == pytest.approx(extent(scene, d), abs=1e-15)
