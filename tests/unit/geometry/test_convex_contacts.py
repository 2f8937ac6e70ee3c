import itertools

import numpy as np
import pytest
from proximity_scenes import HULL_POINTS, SHAPES, Scene, random_pose, row_of
from test_half_space_contacts import PointHull

from sheldrake import geometry as g
from sheldrake.geometry._kernels.model import BodyPoses
from sheldrake.geometry._kernels.separation import separation
from sheldrake.geometry._kernels.support import margin_of, support
from sheldrake.geometry._kernels.table import place_geometry
from sheldrake.math import RigidTransform, RollPitchYaw

CONVEX = {name: shape for name, shape in SHAPES.items() if name != "half_space"}
CONVEX["hull"] = PointHull(HULL_POINTS)
PAIRS = list(itertools.combinations_with_replacement(CONVEX, 2))
CURVED = {"cylinder", "ellipsoid"}


def phi_of(scene, X, Y, reach=1e9):
    scene.X_WB[1], scene.X_WB[2] = row_of(X), row_of(Y)
    place_geometry(scene.model, BodyPoses(scene.X_WB), scene.table)
    return separation(scene.model, scene.table, 0, 1, reach)


def moved(X, p):
    return RigidTransform(X.rotation(), X.translation() + p)


def support_of_difference(scene, n):
    """Extent of A - B along n: how far A must move along -n to be free of B."""
    a = support(scene.model, scene.table, 0, tuple(n))
    b = support(scene.model, scene.table, 1, tuple(-n))
    return np.dot(np.subtract(a, b), n) + margin_of(scene.model, 0) + margin_of(scene.model, 1)


@pytest.mark.parametrize("first, second", PAIRS)
def test_depth_separates_and_nothing_less_does(first, second):
    """Moving A by the depth along the normal just frees it; no sampled direction frees it sooner."""
    rng = np.random.default_rng(1)
    scene = Scene([CONVEX[first], CONVEX[second]])
    directions = rng.normal(size=(150, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    overlapping = 0
    for _ in range(8):
        X, Y = random_pose(rng, 0.35), random_pose(rng, 0.25)
        phi, nhat, p_A, p_B = phi_of(scene, X, Y)
        assert np.linalg.norm(nhat) == pytest.approx(1, abs=1e-12)
        if phi >= 0:
            continue
        overlapping += 1
        assert support_of_difference(scene, -np.array(nhat)) == pytest.approx(-phi, abs=1e-9)
        assert min(support_of_difference(scene, n) for n in directions) >= -phi - 1e-9
        assert np.dot(np.subtract(p_B, p_A), nhat) == pytest.approx(
            -phi, abs=1e-4 if CURVED & {first, second} else 1e-9
        )
        free = phi_of(scene, moved(X, (1e-6 - phi) * np.array(nhat)), Y)[0]
        assert free == pytest.approx(1e-6, abs=5e-7 if CURVED & {first, second} else 1e-9)
    assert overlapping > 2


@pytest.mark.parametrize("first, second", PAIRS)
def test_distance_is_between_witnesses_and_lipschitz(first, second):
    rng = np.random.default_rng(2)
    scene = Scene([CONVEX[first], CONVEX[second]])
    for _ in range(6):
        X, Y = random_pose(rng, 1.5), random_pose(rng, 0.3)
        phi, nhat, p_A, p_B = phi_of(scene, X, Y)
        if phi > 1e-3:
            assert np.linalg.norm(np.subtract(p_A, p_B)) == pytest.approx(phi, abs=1e-12)
            assert support_of_difference(scene, -np.array(nhat)) == pytest.approx(-phi, abs=1e-12)
        step = rng.normal(size=3) * 0.1
        assert abs(phi_of(scene, moved(X, step), Y)[0] - phi) <= np.linalg.norm(step) + 1e-9


@pytest.mark.parametrize("first, second", PAIRS)
def test_swap_and_rigid_motion(first, second):
    rng = np.random.default_rng(3)
    scene, swapped = Scene([CONVEX[first], CONVEX[second]]), Scene([CONVEX[second], CONVEX[first]])
    tolerance = 1e-6 if CURVED & {first, second} else 1e-10
    for _ in range(6):
        X, Y, Z = random_pose(rng, 0.5), random_pose(rng, 0.3), random_pose(rng, 2.0)
        phi = phi_of(scene, X, Y)[0]
        assert phi_of(scene, Z @ X, Z @ Y)[0] == pytest.approx(phi, abs=tolerance)
        assert phi_of(swapped, Y, X)[0] == pytest.approx(phi, abs=tolerance)
        ab, ba = scene.contacts(X, Y), swapped.contacts(Y, X)
        assert (len(ab) > 0) == (len(ba) > 0) == (phi < -2.3e-16)


def test_minimality_test_notices_a_fault():
    """Planted fault: a depth 1 % too large is freed sooner by some direction."""
    scene = Scene([CONVEX["box"], CONVEX["hull"]])
    phi, nhat, _, _ = phi_of(scene, RigidTransform([0.1, 0, 0]), RigidTransform())
    assert support_of_difference(scene, -np.array(nhat)) < -1.01 * phi - 1e-9


def resting(lower, upper, X_upper, depth=1e-4, shift=(0.0, 0.0)):
    """Contacts of `upper`, in orientation X_upper, pressed by `depth` onto the top of `lower` at the origin."""
    scene = Scene([lower, upper])
    X = RigidTransform(X_upper, [*shift, 3.0])
    gap = phi_of(scene, RigidTransform(), X)[0]
    for _ in range(3):  # the gap is vertical when a face is touched
        X = moved(X, [0, 0, -(gap + depth)])
        gap = phi_of(scene, RigidTransform(), X)[0]
        if abs(gap + depth) < 1e-12:
            break
    return scene.contacts(RigidTransform(), X)


UP = RollPitchYaw(0, 0, 0.3).ToRotationMatrix()
LYING = RollPitchYaw(np.pi / 2, 0, 0.3).ToRotationMatrix()
TABLE = g.Box(4, 4, 1)


@pytest.mark.parametrize(
    "lower, upper, rotation, count",
    [
        (TABLE, g.Box(0.6, 0.8, 1.0), UP, 4),
        (TABLE, g.Cylinder(0.3, 0.9), UP, 5),
        (TABLE, g.Cylinder(0.3, 0.9), LYING, 2),
        (TABLE, g.Capsule(0.25, 0.7), LYING, 2),
        (TABLE, g.Capsule(0.25, 0.7), UP, 1),
        (TABLE, g.Ellipsoid(0.3, 0.5, 0.7), UP, 1),
        (TABLE, PointHull([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]), UP, 4),
        (g.Cylinder(0.5, 1.0), g.Box(2, 2, 1), UP, 5),
        (g.Cylinder(0.5, 1.0), g.Cylinder(0.3, 1.0), UP, 5),
        (PointHull([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]), g.Box(4, 0.5, 0.5), UP, 4),
    ],
    ids=lambda value: repr(value)[:24] if isinstance(value, g.Shape) else None,
)
def test_resting_shapes_touch_at_corners_of_the_common_face(lower, upper, rotation, count):
    rows = resting(lower, upper, rotation)
    assert len(rows) == count
    assert np.abs(rows[:, 10]) == pytest.approx(np.ones(count), abs=1e-9)
    assert rows[:, 11] == pytest.approx(np.full(count, 1e-4), abs=1e-9)
    if count >= 4:
        arm = rows[:, 2:4] - rows[:, 2:4].mean(axis=0)
        assert np.linalg.eigvalsh(arm.T @ arm).min() > 0.05


@pytest.mark.parametrize("lower", [TABLE, g.HalfSpace()], ids=["table", "plane"])
@pytest.mark.parametrize("name", ["box", "cylinder", "prism"])
def test_margin_shows_the_corners_of_a_face_before_they_touch(lower, name):
    """With a margin the four points (a cap's five) are there while the face is still above, with negative depths."""
    prism = PointHull([[np.cos(a), np.sin(a), z] for a in np.arange(12) * np.pi / 6 for z in (-0.5, 0.5)])
    shape = {"box": g.Box(0.6, 0.8, 1.0), "cylinder": g.Cylinder(0.3, 1.0), "prism": prism}[name]
    scene = Scene([lower, shape])
    scene.model.margin[0] = 1e-4
    top = 0.5 if lower is TABLE else 0.0
    count = 5 if name == "cylinder" else 4
    for tilt in (0.0, 1e-5):
        R = RollPitchYaw(tilt, tilt / 2, 0.3).ToRotationMatrix()
        for gap in (9e-5, 5e-5, 1e-5, -1e-5):
            rows = scene.contacts(RigidTransform(), RigidTransform(R, [0, 0, top + 0.5 + gap]))
            if gap + 2 * tilt < 1e-4:
                assert len(rows) == count, (tilt, gap)
            assert rows[:, 11] == pytest.approx(np.full(len(rows), -gap), abs=2.2 * tilt + 1e-12)
    assert len(scene.contacts(RigidTransform(), RigidTransform([0, 0, top + 0.5 + 1.1e-4]))) == 0


@pytest.mark.parametrize("lower, upper", [("hull", "hull"), ("box", "hull"), ("box", "box"), ("hull", "cylinder")])
def test_nearly_parallel_faces_always_show_four_points(lower, upper):
    """Although the exact normal of slightly tilted faces is often that of two crossing edges."""
    cube = PointHull([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    shapes = {"hull": cube, "box": g.Box(1, 1, 1), "cylinder": g.Cylinder(0.5, 1.0)}
    scene = Scene([shapes[lower], shapes[upper]])
    scene.model.margin[0] = 1e-4
    rng = np.random.default_rng(8)
    for _ in range(40):
        tilt = rng.uniform(-3e-5, 3e-5, 2)
        R = RollPitchYaw(*tilt, rng.uniform(-np.pi, np.pi)).ToRotationMatrix()
        gap = rng.uniform(-4e-5, 4e-5)
        rows = scene.contacts(RigidTransform(), RigidTransform(R, [*rng.uniform(-0.05, 0.05, 2), 1.0 + gap]))
        assert len(rows) == 4
        arm = rows[:, 2:4] - rows[:, 2:4].mean(axis=0)
        assert np.linalg.eigvalsh(arm.T @ arm).min() > 0.2
        assert rows[:, 11] == pytest.approx(np.full(4, -gap), abs=6e-5)


def test_parallel_cylinders_side_by_side_touch_at_two_points():
    rows = Scene([g.Cylinder(0.3, 2.0), g.Cylinder(0.2, 1.0)]).contacts(
        RigidTransform(), RigidTransform([0.4999, 0, 0.8])
    )
    assert sorted(rows[:, 4]) == pytest.approx([0.3, 1.0], abs=1e-6)
    assert rows[:, 11] == pytest.approx([1e-4, 1e-4], abs=1e-9)


def test_partly_overlapping_boxes_share_a_rectangle():
    rows = Scene([g.Box(1, 1, 1), g.Box(1, 1, 1)]).contacts(RigidTransform(), RigidTransform([0.6, 0.7, 0.999]))
    assert sorted(map(tuple, np.round(rows[:, 2:4], 12))) == [(0.1, 0.2), (0.1, 0.5), (0.5, 0.2), (0.5, 0.5)]


@pytest.mark.parametrize("lower", ["box", "hull"])
@pytest.mark.parametrize("tilt", [-0.012, -0.001, 0.001, 0.012])
def test_the_end_of_a_capsule_at_an_edge_is_as_deep_as_it_is(lower, tilt):
    """Seen along the face's normal the lowest point of its ball is beyond the edge, and so would be cut off."""
    cube = PointHull([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    scene = Scene([g.Box(1, 1, 1) if lower == "box" else cube, g.Capsule(0.3, 0.4)])
    R = RollPitchYaw(0, -0.9, 0).ToRotationMatrix()  # rising over the face
    depth = 4e-3
    low_end = np.array([0.5, 0.1, 0.5]) + (0.3 - depth) * np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    rows = scene.contacts(RigidTransform(), RigidTransform(R, low_end + R.multiply([0, 0, 0.2])))
    exact = depth if tilt > 0 else 0.3 - (0.3 - depth) * np.cos(tilt)
    assert rows[:, 11].max() == pytest.approx(exact, rel=0.01)


@pytest.mark.parametrize("overlap", [1e-3, 0.01, 0.1, 0.25])
@pytest.mark.parametrize("aside", [0.0, 1e-9, 1e-3, 0.02])
@pytest.mark.parametrize("seed", range(3))
def test_capsules_end_to_end_are_as_deep_as_they_are(overlap, aside, seed):
    R = RollPitchYaw(np.random.default_rng(seed).normal(size=3)).ToRotationMatrix()
    apart = np.array([aside, 0.0, 0.7 + 0.4 - overlap])  # of the middles; 0.4 - overlap of the ends
    rows = Scene([g.Capsule(0.2, 0.7)] * 2).contacts(
        RigidTransform(R, [1, 2, 3]), RigidTransform(R, [1, 2, 3] + R @ apart)
    )
    assert len(rows) == 1
    assert rows[0, 11] == pytest.approx(0.4 - np.hypot(aside, 0.4 - overlap), abs=1e-9)


@pytest.mark.parametrize("tilt", [0.0, 1e-6, 5e-3])
def test_capsules_side_by_side_touch_in_two_points(tilt):
    lying = RollPitchYaw(0, np.pi / 2, 0).ToRotationMatrix()
    tilted = RollPitchYaw(0, np.pi / 2 + tilt, 0).ToRotationMatrix()
    shapes = [g.Capsule(0.2, 0.7)] * 2
    rows = Scene(shapes).contacts(RigidTransform(lying, [0, 0, 0]), RigidTransform(tilted, [0.2, 0, 0.395]))
    assert len(rows) == 2 and np.ptp(rows[:, 2]) == pytest.approx(0.5, abs=0.01)


def test_crossed_edges_touch_at_one_point():
    X = RigidTransform(RollPitchYaw(np.pi / 4, 0, 0).ToRotationMatrix(), [0, 0, 0])
    Y = RigidTransform(RollPitchYaw(0, np.pi / 4, 0).ToRotationMatrix(), [0, 0, np.sqrt(2) - 1e-3])
    rows = Scene([g.Box(3, 1, 1), g.Box(1, 3, 1)]).contacts(X, Y)
    assert len(rows) == 1 and rows[0, 11] == pytest.approx(1e-3)
    assert rows[0, 8:11] == pytest.approx([0, 0, -1])


@pytest.mark.parametrize("first, second", PAIRS)
@pytest.mark.parametrize("at", [0.0, 1e6])
def test_coincident_centres_have_a_finite_answer(first, second, at):
    X = RigidTransform([at, at, 0])
    rows = Scene([CONVEX[first], CONVEX[second]]).contacts(X, X)
    assert len(rows) >= 1 and np.all(np.isfinite(rows))
    assert rows[:, 11].max() > 0.1


def test_needles_and_plates():
    needle, plate = g.Box(1.0, 1e-4, 1e-4), g.Cylinder(1.0, 1e-4)
    rng = np.random.default_rng(5)
    for a, b in ((needle, needle), (needle, plate), (plate, plate), (plate, g.Sphere(0.0))):
        for algorithm in ("single_point", "multi_point"):
            scene = Scene([a, b], algorithm)
            for _ in range(10):
                rows = scene.contacts(random_pose(rng, 0.2), random_pose(rng, 0.2))
                assert np.all(np.isfinite(rows)) and np.all(rows[:, 11] >= 0)


@pytest.mark.parametrize("first, second", [p for p in PAIRS if not CURVED & set(p)])
def test_native_code_gives_what_the_source_says(first, second):
    rng = np.random.default_rng(6)
    scene = Scene([CONVEX[first], CONVEX[second]])
    for _ in range(8):
        poses = random_pose(rng, 0.4), random_pose(rng, 0.3)
        native, source = scene.contacts(*poses, native=True), scene.contacts(*poses)
        assert native[:, 8:] == pytest.approx(source[:, 8:], abs=1e-11)
