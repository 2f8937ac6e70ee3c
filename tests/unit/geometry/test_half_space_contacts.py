import numpy as np
import pytest
from proximity_scenes import HULL_POINTS, SHAPES, Scene, height_of, random_pose, row_of

from sheldrake import geometry as g
from sheldrake.geometry._compiled.search import find_contacts
from sheldrake.geometry._kernels.model import CAPACITY_EXCEEDED, contact_table
from sheldrake.math import RigidTransform, RollPitchYaw


def PointHull(points):
    return g.Convex(np.asarray(points, dtype=float).T, "points")


def support_depth(shape, X_GH):
    """Depth of the lowest point of a shape below the plane of H, from its support function alone."""
    n_G = X_GH.rotation().matrix()[:, 2]
    if isinstance(shape, g.Sphere):
        reach = shape.radius()
    elif isinstance(shape, g.Box):
        reach = np.abs(n_G) @ shape.size() / 2
    elif isinstance(shape, g.Cylinder):
        reach = np.hypot(*n_G[:2]) * shape.radius() + abs(n_G[2]) * shape.length() / 2
    elif isinstance(shape, g.Capsule):
        reach = shape.radius() + abs(n_G[2]) * shape.length() / 2
    elif isinstance(shape, g.Ellipsoid):
        reach = np.linalg.norm(n_G * [shape.a(), shape.b(), shape.c()])
    else:
        reach = -(shape.GetConvexHull()._vertices @ n_G).min()
    return reach + X_GH.translation() @ n_G


ROUND = {**{k: v for k, v in SHAPES.items() if k != "half_space"}, "hull": PointHull(HULL_POINTS)}


@pytest.mark.parametrize("name", ROUND)
@pytest.mark.parametrize("order", ["shape first", "plane first"])
def test_deepest_contact_is_the_support_point(name, order):
    """Every algorithm and order of registration: depth of the support function, witnesses on plane and surface."""
    rng = np.random.default_rng(3)
    shape = ROUND[name]
    shapes = [shape, g.HalfSpace()] if order == "shape first" else [g.HalfSpace(), shape]
    scenes = [Scene(shapes, algorithm) for algorithm in ("single_point", "multi_point")]
    touched = 0
    for _ in range(40):
        X_WG, X_WH = random_pose(rng, 0.4), random_pose(rng, 0.2)
        depth = support_depth(shape, X_WG.inverse() @ X_WH)
        single, multi = (s.contacts(*((X_WG, X_WH) if order == "shape first" else (X_WH, X_WG))) for s in scenes)
        if depth <= 0:
            assert len(single) == len(multi) == 0
            continue
        touched += 1
        nhat = X_WH.rotation().matrix()[:, 2] * (1 if order == "shape first" else -1)
        assert len(single) == 1 and single[0, 11] == pytest.approx(depth, abs=1e-14)
        assert 1 <= len(multi) <= 5 and multi[:, 11].max() == pytest.approx(depth, abs=1e-14)
        for row in (*single, *multi):
            p_WCa, p_WCb = row[2:5], row[5:8]
            assert row[8:11] == pytest.approx(nhat, abs=1e-15)
            assert p_WCb - p_WCa == pytest.approx(row[11] * row[8:11], abs=1e-14)
            on_plane = p_WCb if order == "shape first" else p_WCa
            if name != "ellipsoid":
                assert height_of(X_WH, on_plane) == pytest.approx(0, abs=1e-14)
    assert touched > 5


@pytest.mark.parametrize(
    "shape, count, arms",
    [
        (g.Box(0.6, 0.8, 1.0), 4, [0.5]),
        (g.Cylinder(0.3, 0.9), 5, [0.3]),
        (PointHull([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]), 4, [np.sqrt(2)]),
        (PointHull([[np.cos(a), np.sin(a), z] for a in np.arange(12) * np.pi / 6 for z in (-1, 1)]), 4, [1.0]),
    ],
    ids=["box", "cylinder", "cube hull", "prism hull"],
)
@pytest.mark.parametrize("tilt", [0.0, 1e-9, 1e-7, 1e-5])
def test_standing_shape_has_points_that_balance_it(shape, count, arms, tilt):
    """Four corners, and the middle of a cap: their mean is the centre, and they push back against any tilt."""
    scene = Scene([shape, g.HalfSpace()])
    for direction in np.linspace(0, 2 * np.pi, 9):
        R = RollPitchYaw(tilt * np.cos(direction), tilt * np.sin(direction), 0.0).ToRotationMatrix()
        low = support_depth(shape, RigidTransform(R, [0, 0, 0]).inverse())
        X_WG = RigidTransform(R, [0, 0, low - 1e-4])
        rows = scene.contacts(X_WG, RigidTransform())
        assert len(rows) == count
        arm = rows[:, 2:4]
        assert np.sort(np.linalg.norm(arm, axis=1))[-4:] == pytest.approx(arms * 4, rel=1e-3)
        assert arm.mean(axis=0) == pytest.approx([0, 0], abs=1e-4)
        stiffness = arm.T @ arm
        assert np.linalg.eigvalsh(stiffness).min() > 0.5 * arms[0] ** 2


def test_lying_shapes_have_two_points():
    lying = RollPitchYaw(np.pi / 2, 0, 0.3).ToRotationMatrix()
    for shape, radius in ((g.Cylinder(0.3, 0.9), 0.3), (g.Capsule(0.25, 0.7), 0.25)):
        rows = Scene([shape, g.HalfSpace()]).contacts(RigidTransform(lying, [0, 0, radius - 1e-4]), RigidTransform())
        assert len(rows) == 2
        assert np.linalg.norm(rows[0, 2:5] - rows[1, 2:5]) == pytest.approx(shape.length())
        assert rows[:, 11] == pytest.approx([1e-4, 1e-4])


@pytest.mark.parametrize("name", ["box", "cylinder", "capsule", "hull"])
def test_points_enter_and_leave_with_depth_zero(name):
    """Rolling a shape in the plane, the vertical force of unit springs changes continuously while it is shallow."""
    shape = ROUND[name]
    scene = Scene([shape, g.HalfSpace()])
    last = None
    for angle in np.linspace(0.2, 2.7, 700):
        R = RollPitchYaw(angle, 0.35, 0.2).ToRotationMatrix()
        low = support_depth(shape, RigidTransform(R, [0, 0, 0]).inverse())
        total = scene.contacts(RigidTransform(R, [0, 0, low - 1e-3]), RigidTransform())[:, 11].sum()
        if last is not None:
            assert abs(total - last) < 1.5e-3 * 0.99 and abs(total - last) < 1.3e-3
        last = total


def test_continuity_test_notices_a_jump():
    """Planted fault: a table that shows only every other corner would jump by a whole depth."""
    scene = Scene([g.Box(0.6, 0.8, 1.0), g.HalfSpace()])
    depths = scene.contacts(RigidTransform([0, 0, 0.499]), RigidTransform())[:, 11]
    assert depths.sum() - depths[::2].sum() > 1.3e-3


def test_level_box_and_cylinder_single_point_is_the_face_centre():
    for shape, half in ((g.Box(0.6, 0.8, 1.0), 0.5), (g.Cylinder(0.3, 0.9), 0.45)):
        rows = Scene([shape, g.HalfSpace()], "single_point").contacts(
            RigidTransform([0.1, 0.2, half - 1e-3]), RigidTransform()
        )
        assert rows[0, 2:4] == pytest.approx([0.1, 0.2]) and rows[0, 11] == pytest.approx(1e-3)


def test_one_geometry_asking_for_single_point_decides():
    scene = Scene([g.Box(1, 1, 1), g.HalfSpace()])
    scene.model.geometry[1, 2] = 0
    assert len(scene.contacts(RigidTransform([0, 0, 0.4]), RigidTransform())) == 1


def test_exact_touching_counts_for_spheres_only():
    for shape, reach, count in ((g.Sphere(0.5), 0.5, 1), (g.Box(1, 1, 1), 0.5, 0), (g.Capsule(0.5, 1), 1.0, 0)):
        rows = Scene([shape, g.HalfSpace()]).contacts(RigidTransform([0, 0, reach]), RigidTransform())
        assert len(rows) == count


def test_overflow_is_reported():
    scene = Scene([g.Box(1, 1, 1), g.HalfSpace()])
    scene.X_WB[1, 11] = 0.4
    table = contact_table(scene.model, capacity=3)
    assert find_contacts(scene.model, scene.X_WB, table) == CAPACITY_EXCEEDED
    assert table.num_contacts == 3


def test_the_lowest_vertex_of_a_large_hull_is_found():
    rng = np.random.default_rng(5)
    points = rng.normal(size=(400, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    shape = PointHull(points)
    scene = Scene([shape, g.HalfSpace()], "single_point")
    for _ in range(200):
        X_WG = RigidTransform(random_pose(rng).rotation(), [0, 0, 0.9])
        row = scene.contacts(X_WG, RigidTransform())[0]
        assert row[11] == pytest.approx(support_depth(shape, X_WG.inverse()), abs=1e-15)


@pytest.mark.parametrize("name", ROUND)
def test_native_code_gives_what_the_source_says(name):
    rng = np.random.default_rng(11)
    scene = Scene([ROUND[name], g.HalfSpace()])
    for _ in range(10):
        poses = random_pose(rng, 0.3), random_pose(rng, 0.2)
        assert scene.contacts(*poses, native=True) == pytest.approx(scene.contacts(*poses), abs=1e-14)


def test_four_of_more_vertices_than_are_listed_are_those_of_a_longer_list():
    rng = np.random.default_rng(2)
    points = rng.normal(size=(400, 3))
    scene = Scene([PointHull(points / np.linalg.norm(points, axis=1)[:, None]), g.HalfSpace()])
    X_WB = np.array([row_of(X) for X in [RigidTransform(), RigidTransform([0.0, 0.0, -2.0]), RigidTransform()]])
    found = []
    for room in (len(scene.table.stack), 1000):
        table = contact_table(scene.model)._replace(stack=np.zeros(room, np.int64))
        assert find_contacts(scene.model, X_WB, table) == 0
        found.append(table.point[: table.num_contacts].copy())
    assert 300 < scene.model[0].num_vertices > len(scene.table.stack)
    assert len(found[0]) == 4
    np.testing.assert_array_equal(*found)
