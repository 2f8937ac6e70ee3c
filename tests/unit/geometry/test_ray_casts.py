"""Rays against shapes: the point met is on the surface, nothing comes before it, the normal leads out."""

from __future__ import annotations

import pathlib

import numpy as np
import pytest
from proximity_scenes import HULL_POINTS, SHAPES, random_pose

import sheldrake.geometry as g
from sheldrake.math import RigidTransform


def write_obj(path, vertices, triangles):
    lines = [f"v {x!r} {y!r} {z!r}\n" for x, y, z in np.asarray(vertices).tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in triangles]
    path.write_text("".join(lines))
    return path


@pytest.fixture(scope="module")
def dented(tmp_path_factory) -> pathlib.Path:
    """A cube of edge 1 whose top is a pit: its hull is the cube."""
    v = [[x, y, z] for z in (-0.5, 0.5) for y in (-0.5, 0.5) for x in (-0.5, 0.5)] + [[0.0, 0.0, 0.0]]
    f = [(0, 2, 3), (0, 3, 1), (0, 1, 5), (0, 5, 4), (1, 3, 7), (1, 7, 5), (3, 2, 6), (3, 6, 7), (2, 0, 4), (2, 4, 6)]
    f += [(4, 5, 8), (5, 7, 8), (7, 6, 8), (6, 4, 8)]
    return write_obj(tmp_path_factory.mktemp("rays") / "dented.obj", v, f)


@pytest.fixture(scope="module")
def hull(tmp_path_factory) -> pathlib.Path:
    return write_obj(tmp_path_factory.mktemp("rays") / "hull.obj", HULL_POINTS, [(0, 1, 2)])


def query_of(shapes, poses):
    """A QueryObject of anchored shapes, and their ids."""
    scene_graph = g.SceneGraph()
    source, ids = scene_graph.RegisterSource("test"), []
    for k, (shape, X_WG) in enumerate(zip(shapes, poses)):
        instance = g.GeometryInstance(X_WG, shape, f"shape{k}")
        instance.set_proximity_properties(g.ProximityProperties())
        ids.append(scene_graph.RegisterAnchoredGeometry(source, instance))
    context = scene_graph.CreateDefaultContext()
    return scene_graph.get_query_output_port().Eval(context), ids


def shape_of(name, hull, dented):
    return {"convex": g.Convex(hull), "mesh": g.Mesh(dented), **SHAPES}[name]


NAMES = [*SHAPES, "convex", "mesh"]


def random_rays(rng, n, target, spread=0.3):
    """Rays from a few metres away, towards about a point; shape (3, n) each."""
    p = rng.normal(size=(3, n)) * 2.0
    return p, target[:, None] + rng.normal(size=(3, n)) * spread - p


@pytest.mark.parametrize("name", NAMES)
def test_the_point_met_is_on_the_surface_and_nothing_comes_before(name, hull, dented):
    rng = np.random.default_rng(3)
    X_WG = random_pose(rng, 0.3)
    query, _ = query_of([shape_of(name, hull, dented)], [X_WG])
    p, d = random_rays(rng, 80, X_WG.translation())
    found = query.ComputeRayIntersections(p, d)
    unit, hits = d / np.linalg.norm(d, axis=0), 0
    for k in range(p.shape[1]):
        start = query.ComputeSignedDistanceToPoint(p[:, k])[0].distance
        if np.isinf(found.distance[k]):
            assert found.id_G[k] is None and np.isnan(found.p_WC[:, k]).all() and np.isnan(found.nhat_W[:, k]).all()
            low = np.linalg.norm(p[:, k]) + 3.0
        else:
            hits += 1
            np.testing.assert_allclose(found.p_WC[:, k], p[:, k] + found.distance[k] * unit[:, k], atol=1e-13)
            at = query.ComputeSignedDistanceToPoint(found.p_WC[:, k])[0]
            assert abs(at.distance) < 1e-12
            outside = query.ComputeSignedDistanceToPoint(found.p_WC[:, k] + 1e-7 * found.nhat_W[:, k])[0].distance
            assert outside == pytest.approx(1e-7, rel=1e-4)  # the normal leads out, the shortest way
            low = found.distance[k] * (1.0 - 1e-9)
        for t in np.linspace(0.0, low, 30)[1:-1]:  # on the way, the side is that of the origin
            assert query.ComputeSignedDistanceToPoint(p[:, k] + t * unit[:, k])[0].distance * start > -1e-12
    assert hits > 15


@pytest.mark.parametrize("name", NAMES)
def test_from_inside_a_ray_meets_the_far_side(name, hull, dented):
    rng = np.random.default_rng(4)
    X_WG = random_pose(rng, 0.3)
    query, _ = query_of([shape_of(name, hull, dented)], [X_WG])
    down = 0.2 * X_WG.rotation().matrix()[:, 2] if name in ("half_space", "mesh") else 0.0
    p, d = X_WG.translation() - down, rng.normal(size=(3, 50))
    assert query.ComputeSignedDistanceToPoint(p)[0].distance < 0.0
    found = query.ComputeRayIntersections(p, d)
    met = np.isfinite(found.distance)
    assert met.sum() == (50 if name != "half_space" else (X_WG.rotation().matrix()[:, 2] @ d > 0.0).sum())
    assert (np.einsum("kn,kn->n", d, found.nhat_W)[met] > 0.0).all()


def test_numbers_one_can_do_in_the_head():
    poses = [RigidTransform([x, 0, 0]) for x in (0, 2, 4, 6, 8)]
    shapes = [g.Sphere(0.5), g.Box(1, 1, 1), g.Cylinder(0.5, 1), g.Capsule(0.5, 1), g.Ellipsoid(0.5, 0.5, 0.25)]
    query, ids = query_of([*shapes, g.HalfSpace()], [*poses, RigidTransform([0, 0, -1])])
    p = np.array([[0, 2.2, 4.3, 6, 8, 10], [0.3, 0.1, 0, 0, 0, 0], [3, 3, 3, 3, 3, 3]])
    found = query.ComputeRayIntersections(p, [0, 0, -7.0])
    np.testing.assert_allclose(found.distance, [2.6, 2.5, 2.5, 2.0, 2.75, 4.0], rtol=1e-15)
    assert found.id_G == ids
    np.testing.assert_allclose(found.nhat_W[:, 0], [0, 0.6, 0.8], atol=1e-15)
    np.testing.assert_array_equal(found.nhat_W[:, 1:], np.tile([[0], [0], [1]], 5))
    along = query.ComputeRayIntersections([-3, 0, 0], [1, 0, 0])
    assert along.id_G == [ids[0]] and along.distance == pytest.approx([2.5], rel=1e-15)


def test_the_nearest_of_several_is_met_and_what_is_excluded_is_not():
    query, ids = query_of([g.Sphere(0.5), g.Box(1, 1, 1)], [RigidTransform([0, 0, 0]), RigidTransform([3, 0, 0])])
    assert query.ComputeRayIntersections([-2, 0, 0], [1, 0, 0]).id_G == [ids[0]]
    beyond = query.ComputeRayIntersections([-2, 0, 0], [1, 0, 0], excluded=[ids[0]])
    assert beyond.id_G == [ids[1]] and beyond.distance[0] == pytest.approx(4.5)
    for reach, met in ((1.4, None), (1.6, ids[0])):
        assert query.ComputeRayIntersections([-2, 0, 0], [1, 0, 0], max_distance=reach).id_G == [met]


def test_a_mesh_is_met_as_it_is_and_convex_as_its_hull(dented):
    for shape, depth in ((g.Mesh(dented), 1.0), (g.Convex(dented), 0.5)):
        query, _ = query_of([shape], [RigidTransform()])
        assert query.ComputeRayIntersections([0, 0.01, 1], [0, 0, -1]).distance == pytest.approx([depth], abs=0.02)


def test_rays_through_corners_edges_and_along_faces_meet_or_miss_without_nan():
    query, _ = query_of([g.Box(2, 2, 2)], [RigidTransform()])
    p = np.array([[3, 0, 0], [3, 3, 3], [3, 1, 0], [3, 1, 1], [3, 1.0000001, 0], [1, 0, -3]], float).T
    d = np.array([[-1, 0, 0], [-1, -1, -1], [-1, 0, 0], [-1, 0, 0], [-1, 0, 0], [0, 0, 1]], float).T
    distance = query.ComputeRayIntersections(p, d).distance
    np.testing.assert_allclose(distance, [2, 2 * np.sqrt(3), 2, 2, np.inf, 2])


@pytest.mark.parametrize(
    ("p", "d", "message"),
    [
        ([0, 0], [0, 0, 1], r"p_WO has shape \(2,\)"),
        (np.zeros((3, 2)), np.ones((3, 4)), "2 origins, but 4 directions"),
        ([0, 0, 0], [0, 0, 0], "ray 0 goes"),
        ([0, 0, np.nan], [0, 0, 1], "ray 0 goes"),
    ],
)
def test_wrong_rays_are_named(p, d, message):
    query, _ = query_of([g.Sphere(1.0)], [RigidTransform()])
    with pytest.raises(ValueError, match=message):
        query.ComputeRayIntersections(p, d)


def test_no_rays_and_no_geometry_give_nothing():
    query, _ = query_of([g.Sphere(1.0)], [RigidTransform()])
    assert query.ComputeRayIntersections(np.zeros((3, 0)), [0, 0, 1]).distance.shape == (0,)
    query, _ = query_of([], [])
    assert query.ComputeRayIntersections([0, 0, 0], [0, 0, 1]).id_G == [None]
