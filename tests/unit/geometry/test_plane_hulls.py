"""Hulls in the plane have the corners, edges and areas that Qhull finds."""

import subprocess
import sys

import numpy as np
import pytest

from sheldrake.geometry.optimization import HPolyhedron, VPolytope
from sheldrake.geometry.optimization import _plane_hulls as plane

spatial = pytest.importorskip("scipy.spatial")


def clouds():
    rng = np.random.default_rng(4)
    for n in (3, 4, 10, 100):
        yield rng.normal(size=(n, 2))
        yield 1e-6 * rng.normal(size=(n, 2)) + [3.0, -5.0]
        yield 1e6 * rng.normal(size=(n, 2))
        yield np.vstack((rng.integers(0, 4, (n, 2)), [[0, 0], [3, 0], [0, 3]])).astype(float)
    angles = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    yield np.column_stack((np.cos(angles), np.sin(angles)))
    yield np.repeat(rng.normal(size=(7, 2)), 3, axis=0)


@pytest.mark.parametrize("k", range(len(list(clouds()))))
def test_corners_edges_and_area_are_qhulls(k):
    points = list(clouds())[k]
    hull, found = spatial.ConvexHull(points), plane.corners(points)
    assert {tuple(points[i]) for i in found} == {tuple(points[i]) for i in hull.vertices}
    at = points[found]
    step = np.roll(at, -1, axis=0) - at
    turn = step[:, 0] * np.roll(step[:, 1], -1) - step[:, 1] * np.roll(step[:, 0], -1)
    assert (turn > 0.0).all()  # counter-clockwise, no corner on an edge
    np.testing.assert_allclose(plane.area(points), hull.volume, rtol=1e-8)
    A, b = plane.edges(points)
    assert len(A) == len(found)
    size = np.abs(points).max()
    np.testing.assert_allclose((A @ points.T - b[:, None]).max(axis=1), 0.0, atol=1e-13 * size)


@pytest.mark.parametrize("seed", range(20))
def test_half_planes_meet_where_qhull_says(seed):
    rng = np.random.default_rng(seed)
    A = np.vstack((rng.normal(size=(int(rng.integers(1, 30)), 2)), np.eye(2), -np.eye(2), [[1.0, 0.0], [0.0, 0.0]]))
    inside = rng.normal(size=2)
    b = A @ inside + np.concatenate((rng.uniform(0.1, 2.0, len(A) - 2), [0.7, 1.0]))
    found = plane.meetings(A, b, inside)
    wanted = spatial.HalfspaceIntersection(np.column_stack((A[:-1], -b[:-1])), inside).intersections
    wanted = np.unique(np.round(wanted, 8), axis=0)
    assert len(found) == len(wanted)
    assert np.abs(found[:, None] - wanted).max(axis=2).min(axis=1).max() < 2e-8


def test_points_on_a_line_have_no_area():
    assert plane.area(np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]])) == 0.0
    assert VPolytope(np.array([[0.0, 1.0, 2.0], [0.0, 1.0, 2.0]])).CalcVolume() == 0.0


def test_corners_of_a_flat_polygon_in_space():
    turned = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    square = turned @ np.array([[0, 2, 2, 0, 1], [0, 0, 2, 2, 1], [0.5] * 5], float)
    assert VPolytope(square).GetMinimalRepresentation().vertices().shape == (3, 4)
    H = HPolyhedron(VPolytope(square))
    assert H.PointInSet(square[:, 4], 1e-9) and not H.PointInSet(square[:, 4] + 0.1 * turned[:, 2])
    assert not H.PointInSet(1.2 * square[:, 2] - 0.2 * square[:, 4])


def test_what_is_plotted_in_the_plane_loads_no_scipy_spatial():
    program = """
import sys
import numpy as np
from sheldrake.geometry.optimization import HPolyhedron, VPolytope
box = HPolyhedron.MakeBox([0, 0], [1, 2]).Intersection(HPolyhedron(np.array([[1.0, 1.0]]), [2.0]))
corners = VPolytope(box)
assert corners.vertices().shape == (2, 4) and abs(corners.CalcVolume() - 1.5) < 1e-12
assert HPolyhedron(corners.GetMinimalRepresentation()).A().shape == (4, 2)
print("scipy.spatial" in sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120)
    assert done.stdout.strip() == "False", done.stderr
