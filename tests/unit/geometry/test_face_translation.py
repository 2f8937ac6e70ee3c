"""Polyhedra simplified to fewer faces: inside, large enough, and still where they must be."""

import numpy as np
import pytest

from sheldrake.geometry.optimization import HPolyhedron, VPolytope

pytest.importorskip("clarabel")


def polyhedron(n=3, m=20, seed=3):
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(m, n))
    A /= np.linalg.norm(A, axis=1)[:, None]
    rows, bounds = np.vstack((A, np.eye(n), -np.eye(n))), np.append(rng.uniform(0.8, 1.2, m), 2 * np.ones(2 * n))
    return HPolyhedron(rows, bounds).ReduceInequalities()


def volume(h):
    return VPolytope(h).CalcVolume()


@pytest.mark.parametrize("ratio", [0.1, 0.5])
@pytest.mark.parametrize(("n", "m"), [(2, 16), (3, 20)])
def test_what_is_left_is_inside_and_large_enough(n, m, ratio):
    h = polyhedron(n, m)
    out = h.SimplifyByIncrementalFaceTranslation(min_volume_ratio=ratio, do_affine_transformation=False)
    assert out.ContainedIn(h) and len(out.b()) < len(h.b())
    assert volume(out) >= ratio * volume(h)


def test_stretching_makes_it_larger():
    h = polyhedron()
    plain = h.SimplifyByIncrementalFaceTranslation(do_affine_transformation=False)
    stretched = h.SimplifyByIncrementalFaceTranslation()
    assert stretched.ContainedIn(h, 1e-6) and len(stretched.b()) == len(plain.b())
    assert volume(stretched) > volume(plain)


def test_points_stay_inside():
    h, points = polyhedron(), 0.6 * np.hstack((np.eye(3), -np.eye(3)))
    out = h.SimplifyByIncrementalFaceTranslation(points_to_contain=points)
    assert all(out.PointInSet(p, 1e-6) for p in points.T)


def test_others_are_still_met():
    h = polyhedron()
    boxes = [HPolyhedron.MakeBox([low, -0.1, -0.1], [low + 0.3, 0.1, 0.1]) for low in (0.6, -0.9)]
    out = h.SimplifyByIncrementalFaceTranslation(intersecting_polytopes=boxes)
    assert all(out.IntersectsWith(box) for box in boxes)
    whole = h.SimplifyByIncrementalFaceTranslation(
        do_affine_transformation=False, intersecting_polytopes=boxes, keep_whole_intersection=True
    )
    for box in boxes:
        assert h.Intersection(box).ContainedIn(whole, 1e-6)


def test_a_box_stays_a_box():
    box = HPolyhedron.MakeBox([-1, -2], [1, 2])
    out = box.SimplifyByIncrementalFaceTranslation(min_volume_ratio=0.9, do_affine_transformation=False)
    assert len(out.b()) == 4 and volume(out) == pytest.approx(8.0)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"min_volume_ratio": 0.0}, "min_volume_ratio"),
        ({"max_iterations": 0}, "max_iterations"),
        ({"intersection_padding": -1.0}, "intersection_padding"),
        ({"points_to_contain": 5.0 * np.ones((3, 1))}, "outside"),
        ({"intersecting_polytopes": [HPolyhedron.MakeBox([5] * 3, [6] * 3)]}, "does not meet"),
    ],
)
def test_settings_out_of_range(wrong, message):
    with pytest.raises(RuntimeError, match=message):
        polyhedron().SimplifyByIncrementalFaceTranslation(**wrong)
    with pytest.raises(RuntimeError, match="unbounded"):
        HPolyhedron(np.eye(2), np.ones(2)).SimplifyByIncrementalFaceTranslation()
