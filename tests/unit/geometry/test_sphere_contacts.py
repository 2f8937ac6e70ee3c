import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from proximity_scenes import SHAPES, Scene, random_pose

from sheldrake import geometry as g
from sheldrake.geometry._kernels.distance import point_box, point_capsule, point_cylinder, point_ellipsoid, point_sphere
from sheldrake.math import RigidTransform

DISTANCES = {
    "sphere": lambda p: point_sphere(p, 0.4),
    "box": lambda p: point_box(p, (0.3, 0.4, 0.5)),
    "cylinder": lambda p: point_cylinder(p, 0.3, 0.45),
    "capsule": lambda p: point_capsule(p, 0.25, 0.35),
    "ellipsoid": lambda p: point_ellipsoid(p, (0.3, 0.5, 0.7)),
}
points = st.tuples(*[st.floats(-1.5, 1.5, allow_subnormal=False)] * 3)


def is_inside(name, p):
    x, y, z = p
    return {
        "sphere": np.linalg.norm(p) < 0.4,
        "box": abs(x) < 0.3 and abs(y) < 0.4 and abs(z) < 0.5,
        "cylinder": np.hypot(x, y) < 0.3 and abs(z) < 0.45,
        "capsule": np.linalg.norm([x, y, z - np.clip(z, -0.35, 0.35)]) < 0.25,
        "ellipsoid": (x / 0.3) ** 2 + (y / 0.5) ** 2 + (z / 0.7) ** 2 < 1,
    }[name]


@pytest.mark.parametrize("name", DISTANCES)
@settings(max_examples=200, deadline=None)
@given(p=points, q=points)
def test_signed_distance_laws(name, p, q):
    """Unit gradient towards the point, nearest point at the distance, sign by containment, 1-Lipschitz."""
    phi, gradient, nearest = DISTANCES[name](p)
    assert np.linalg.norm(gradient) == pytest.approx(1, abs=1e-12)
    assert np.array(nearest) + phi * np.array(gradient) == pytest.approx(p, abs=1e-9)
    assert abs(DISTANCES[name](nearest)[0]) < 1e-9
    if abs(phi) > 1e-9:
        assert (phi < 0) == is_inside(name, p)
    assert abs(DISTANCES[name](q)[0] - phi) <= np.linalg.norm(np.subtract(p, q)) + 1e-9


@pytest.mark.parametrize("name", DISTANCES)
def test_no_surface_point_is_nearer(name):
    rng = np.random.default_rng(0)
    surface = []
    for direction in rng.normal(size=(3000, 3)):
        direction = direction / np.linalg.norm(direction)
        low, high = 0.0, 2.0
        for _ in range(50):  # bisection along a ray from the centre, inside which every shape is star-shaped
            middle = (low + high) / 2
            low, high = (middle, high) if is_inside(name, middle * direction) else (low, middle)
        surface.append(low * direction)
    for p in rng.uniform(-0.9, 0.9, (60, 3)):
        phi, _, _ = DISTANCES[name](tuple(p))
        nearest = np.linalg.norm(surface - p, axis=1).min()
        assert abs(phi) <= nearest + 1e-12
        assert abs(phi) >= nearest - 0.05


@pytest.mark.parametrize(
    "name, p, phi, gradient",
    [
        ("sphere", (0, 0, 0), -0.4, (1, 0, 0)),
        ("box", (0.25, 0, 0), -0.05, (1, 0, 0)),
        ("cylinder", (0, 0, 0), -0.3, (1, 0, 0)),
        ("cylinder", (0, 0, 1.0), 0.55, (0, 0, 1)),
        ("capsule", (0, 0, 0.1), -0.25, (1, 0, 0)),
        ("ellipsoid", (0, 0, 0), -0.3, (1, 0, 0)),
        ("ellipsoid", (0, 0, 1.0), 0.3, (0, 0, 1)),
        ("ellipsoid", (0, -2.0, 0), 1.5, (0, -1, 0)),
    ],
)
def test_degenerate_points(name, p, phi, gradient):
    found = DISTANCES[name](tuple(float(x) for x in p))
    assert found[0] == pytest.approx(phi, abs=1e-12) and found[1] == pytest.approx(gradient, abs=1e-9)


@pytest.mark.parametrize("name", DISTANCES)
def test_contact_of_a_sphere_both_ways_round(name):
    """Witnesses are depth apart along the normal, on the surfaces; swapping the order swaps A, B and the normal."""
    rng = np.random.default_rng(2)
    first, second = Scene([g.Sphere(0.3), SHAPES[name]]), Scene([SHAPES[name], g.Sphere(0.3)])
    touched = 0
    for _ in range(60):
        X_WS, X_WG = random_pose(rng, 0.5), random_pose(rng, 0.3)
        rows, swapped = first.contacts(X_WS, X_WG), second.contacts(X_WG, X_WS)
        assert len(rows) == len(swapped) <= 1
        for row, other in zip(rows, swapped):
            touched += 1
            assert other[2:5] == pytest.approx(row[5:8]) and other[5:8] == pytest.approx(row[2:5])
            assert other[8:11] == pytest.approx(-row[8:11]) and other[11] == pytest.approx(row[11], abs=1e-15)
            assert row[5:8] - row[2:5] == pytest.approx(row[11] * row[8:11], abs=1e-12)
            assert np.linalg.norm(row[2:5] - X_WS.translation()) == pytest.approx(0.3)
    assert touched > 15


@pytest.mark.parametrize("name", DISTANCES)
def test_common_rigid_motion_changes_nothing(name):
    rng = np.random.default_rng(4)
    scene = Scene([g.Sphere(0.3), SHAPES[name]])
    for _ in range(20):
        X_WS, X_WG, X = random_pose(rng, 0.4), random_pose(rng, 0.3), random_pose(rng, 3)
        before, after = scene.contacts(X_WS, X_WG), scene.contacts(X @ X_WS, X @ X_WG)
        assert len(before) == len(after)
        for a, b in zip(before, after):
            assert b[11] == pytest.approx(a[11], abs=1e-13)
            assert b[2:5] == pytest.approx(X @ a[2:5], abs=1e-13)
            assert b[8:11] == pytest.approx(X.rotation() @ a[8:11], abs=1e-12)


def test_geometry_pose_in_its_body_counts():
    X_BG = [RigidTransform([0, 0, 1.0]), RigidTransform()]
    rows = Scene([g.Sphere(0.5), g.HalfSpace()], X_BG=X_BG).contacts(RigidTransform([0, 0, -0.6]), RigidTransform())
    assert rows[0, 11] == pytest.approx(0.1)
