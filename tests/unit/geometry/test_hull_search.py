"""Lowest vertices and steepest faces of hulls; boxes around shapes that rule pairs out."""

import itertools

import numpy as np
import pytest
from proximity_scenes import HULL_POINTS, SHAPES, Scene, random_pose, row_of
from test_half_space_contacts import PointHull

from sheldrake.geometry._compiled.hulls import lowest_in_cells, lowest_in_parts
from sheldrake.geometry._kernels.contacts import axis_between, half_extents
from sheldrake.geometry._kernels.model import CELLS, DIVIDED, BodyPoses
from sheldrake.geometry._kernels.separation import separation
from sheldrake.geometry._kernels.support import cell_of, lowest_vertex, steepest_face
from sheldrake.geometry._kernels.table import place_geometry

ON_SPHERE = np.random.default_rng(3).normal(size=(200, 3))
ROUND = PointHull(ON_SPHERE / np.linalg.norm(ON_SPHERE, axis=1)[:, None] * [0.1, 0.2, 0.3])
CONVEX = {**{name: shape for name, shape in SHAPES.items() if name != "half_space"}, "hull": PointHull(HULL_POINTS)}


@pytest.fixture(scope="module")
def hulls():
    return Scene([ROUND, SHAPES["box"], PointHull(HULL_POINTS)])


def directions(count, seed=0):
    n = np.random.default_rng(seed).normal(size=(count, 3))
    n[: count // 3] = np.sign(np.round(n[: count // 3]))  # along axes, edges and corners of the cells
    n = n[np.linalg.norm(n, axis=1) > 0]
    return n / np.linalg.norm(n, axis=1)[:, None]


@pytest.fixture(scope="module")
def cube():
    """A hull whose vertices are all tried, and whose edges lie along the cells' own."""
    return Scene([PointHull(np.array(list(itertools.product([-0.1, 0.1], repeat=3)))), SHAPES["box"]])


def test_of_equally_low_vertices_the_first_is_found(cube):
    model = cube.model
    for n in itertools.product([-1.0, 0.0, 1.0], repeat=3):
        if any(n):
            found = lowest_vertex(model, 0, n)
            heights = model.vertex[:8] @ n
            assert found == np.flatnonzero(heights == heights.min())[0]


def test_few_vertices_of_a_cell_may_be_lowest_and_a_missing_one_is_noticed(hulls):
    model = hulls.model
    vertices = model.vertex[: model[0].num_vertices]
    may = lowest_in_cells(vertices)
    assert len(may) == 6 * CELLS**2 and max(may.sum(axis=1)) < 20 and np.mean(may.sum(axis=1)) < 5
    assert may.any(axis=0).all()
    cells = [np.flatnonzero(row) for row in may]
    lowest = [(vertices @ n).argmin() for n in directions(2000)]
    cell = [cell_of(tuple(n))[0] for n in directions(2000)]
    assert all(v in cells[c] for v, c in zip(lowest, cell))
    assert not all(v in cells[c][1:] for v, c in zip(lowest, cell))


@pytest.fixture(scope="module")
def prism():
    """A hull with two flat sides of many vertices, which nearly all are lowest along some direction near the axis."""
    angle = 2.0 * np.pi * np.arange(64) / 64
    rim = np.stack([0.1 * np.cos(angle), 0.1 * np.sin(angle), np.full(64, 0.05)], axis=1)
    return Scene([PointHull(np.concatenate([rim, rim * [1.0, 1.0, -1.0]])), SHAPES["box"]])


def test_a_cell_opposite_to_a_flat_side_is_divided(prism):
    model = prism.model
    vertices = model.vertex[:128]
    cells = lowest_in_cells(vertices)
    crowded = np.flatnonzero(cells.sum(axis=1) >= DIVIDED)
    assert 0 < len(crowded) < 20
    parts = {}
    for cell in crowded:
        those = np.flatnonzero(cells[cell])
        may = lowest_in_parts(vertices[those], cell, 0.0)
        assert len(may) == CELLS**2 and may.sum(axis=1).mean() < 0.4 * len(those)
        parts[cell] = [those[row] for row in may]
    tilts = np.random.default_rng(5).normal(size=(500, 3)) * [0.1, 0.1, 0.0] + [0.0, 0.0, 1.0]
    reached = set()
    for n in [*tilts, *-tilts]:
        cell, part = cell_of(tuple(n))
        reached.add(cell)
        if cell in parts:
            assert (vertices @ n).argmin() in parts[cell][part]
        assert vertices[lowest_vertex(model, 0, tuple(n))] @ n == pytest.approx((vertices @ n).min(), abs=1e-15)
    assert reached & set(parts)


@pytest.mark.parametrize("g", [0, 2])
def test_no_vertex_is_lower_than_the_one_that_is_found(hulls, g):
    model = hulls.model
    first = model[g].first_vertex
    vertices = model.vertex[first : first + model[g].num_vertices]
    assert len(vertices) == (200 if g == 0 else 15)
    for n in directions(300):
        found = lowest_vertex(model, g, tuple(n))
        assert model.vertex[found] @ n == pytest.approx((vertices @ n).min(), abs=1e-15)


@pytest.mark.parametrize("g", [0, 2])
def test_the_steepest_face_has_the_vertex_as_a_corner_and_no_other_of_its_faces_is_steeper(hulls, g):
    model = hulls.model
    first = model[g].first_face
    faces = model.face[first : first + model[g].num_faces]
    for n in directions(200):
        v = lowest_vertex(model, g, tuple(-n))
        around = np.abs(faces[:, :3] @ model.vertex[v] - faces[:, 3]) < 1e-12
        assert around.sum() >= 3
        found = steepest_face(model, v, tuple(n)) - first
        assert around[found]
        assert faces[found, :3] @ n == pytest.approx((faces[around, :3] @ n).max(), abs=1e-15)


@pytest.mark.parametrize("first, second", [*itertools.combinations_with_replacement(CONVEX, 2)])
def test_boxes_are_never_apart_where_shapes_are_near(first, second):
    rng = np.random.default_rng(5)
    scene = Scene([CONVEX[first], CONVEX[second]])
    scene.model.margin[0] = 1e-3
    apart = {False: 0, True: 0}
    for _ in range(60):
        scene.X_WB[1], scene.X_WB[2] = row_of(random_pose(rng, 1.0)), row_of(random_pose(rng, 1.0))
        place_geometry(scene.model, BodyPoses(scene.X_WB), scene.table)
        found = axis_between(scene.model, scene.table, 0, 1) >= 0
        apart[bool(found)] += 1
        if found:
            assert separation(scene.model, scene.table, 0, 1, 1e9)[0] > 1e-3
    assert min(apart.values()) > 3


def test_the_box_around_a_shape_fits(hulls):
    """It reaches no farther than the bounding sphere, and as far as the hull."""
    for g in (0, 2):
        model = hulls.model
        first = model[g].first_vertex
        vertices = model.vertex[first : first + model[g].num_vertices]
        extents = vertices.max(axis=0) - vertices.min(axis=0)
        np.testing.assert_allclose(half_extents(model, g), extents / 2, atol=1e-15)
        assert max(half_extents(model, g)) <= model[g].bound


def test_cells_of_many_vertices_are_those_of_all_at_once(monkeypatch):
    """Leaving out beforehand what is lowest nowhere in a quarter of a grid changes no cell."""
    vertices = np.random.default_rng(4).normal(size=(3000, 3)) * (1.0, 0.4, 2.0)
    vertices /= np.linalg.norm(vertices, axis=1)[:, None]
    by_quarters = lowest_in_cells(vertices)
    monkeypatch.setattr("sheldrake.geometry._compiled.hulls._MANY", len(vertices) + 1)
    assert np.array_equal(by_quarters, lowest_in_cells(vertices))
