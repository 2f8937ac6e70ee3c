"""Hydroelastic meshes are Drake's, element for element."""

import itertools

import numpy as np
import pytest
from hydro_scenes import elements_of, library, mesh_of, write_files

from sheldrake.geometry._hydroelastic import meshes

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")

BOXES = [*itertools.permutations((2.0, 4.0, 6.0)), (4, 4, 2), (4, 2, 4), (2, 4, 4), (4, 4, 6), (4, 6, 4), (6, 4, 4)]
SHAPES = [
    *(("Box", size) for size in (*BOXES, (4, 4, 4))),
    ("Sphere", (1.0,)),
    ("Cylinder", (1.0, 1.0)),
    ("Cylinder", (1.0, 2.0)),
    ("Cylinder", (1.0, 3.0)),
    ("Capsule", (1.0, 2.0)),
    ("Ellipsoid", (1.0, 0.5, 2.0)),
]


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    return write_files(tmp_path_factory.mktemp("meshes"))


def assert_same(shape, arguments, what, tolerance=1e-14):
    ours = mesh_of(library("sheldrake"), shape, arguments, what)
    drakes = mesh_of(library("pydrake"), shape, arguments, what)
    assert type(ours).__name__ == type(drakes).__name__
    assert ours.num_vertices() == drakes.num_vertices()
    ours, drakes = elements_of(ours), elements_of(drakes)
    assert ours.shape == drakes.shape
    np.testing.assert_allclose(ours, drakes, rtol=0, atol=tolerance)


@pytest.mark.parametrize("what", [{"soft": 0}, {"soft": 0, "margin": 0.1}, {"rigid": 0}, {"rigid": 0, "margin": 0.1}],
                         ids=str)  # fmt: skip
@pytest.mark.parametrize("shape, arguments", SHAPES, ids=str)
def test_shapes(shape, arguments, what):
    for hint in (3.0,) if shape == "Box" else (100.0, 1.3, 0.6, 0.31):
        assert_same(shape, arguments, {k: hint if k in ("soft", "rigid") else v for k, v in what.items()})


@pytest.mark.parametrize("what", [{"soft": 1.0}, {"soft": 1.0, "margin": 0.1}, {"rigid": 1.0}], ids=str)
@pytest.mark.parametrize("shape", ["Mesh", "Convex"])
def test_surface_file(files, shape, what):
    if shape == "Convex" and "margin" in what:
        # The faces of the larger hull have more than three corners: where they are divided is Qhull's choice.
        meshes = [mesh_of(library(name), shape, (files["obj"], 0.5), what) for name in ("sheldrake", "pydrake")]
        ours, drakes = (np.array(sorted(np.round(m.vertices(), 12).tolist())) for m in meshes)
        np.testing.assert_allclose(ours, drakes, rtol=0, atol=1e-11)
        return
    assert_same(shape, (files["obj"], 0.5), what, 1e-7 if "margin" in what else 1e-14)  # Drake asks a QP solver


@pytest.mark.parametrize("what", [{"soft": 1.0}, {"soft": 1.0, "margin": 0.1}, {"rigid": 1.0}], ids=str)
@pytest.mark.parametrize("shape", ["Mesh", "Convex"])
def test_volume_file(files, shape, what):
    assert_same(shape, (files["vtk"], 2.0), what, 1e-7 if "margin" in what else 1e-14)


def test_half_space_has_no_mesh():
    for what in ({"rigid": 1.0}, {"slab": 0.1}):
        assert mesh_of(library("sheldrake"), "HalfSpace", (), what) is None


def test_a_margin_may_reach_the_radius():
    for margin in (1.0, 2.0):
        assert_same("Sphere", (1.0,), {"soft": 1.0, "margin": margin})


def test_both_refuse_a_half_space_without_thickness():
    messages = []
    for name in ("sheldrake", "pydrake"):
        with pytest.raises(RuntimeError) as error:
            mesh_of(library(name), "HalfSpace", (), {"soft": 1.0})
        messages.append(str(error.value))
    assert messages[0] == messages[1]


def test_a_mesh_divided_otherwise_is_noticed(monkeypatch):
    """The other diagonal of one quadrilateral: same vertices, same volume, another mesh."""
    pieces = list(meshes._FOUR_POINTS)
    name, centre, *triangles = pieces[2]
    triangles[triangles.index((8, 5, 1))] = (8, 0, 5)
    triangles[triangles.index((0, 8, 1))] = (0, 1, 5)
    monkeypatch.setattr(meshes, "_FOUR_POINTS", (*pieces[:2], (name, centre, *triangles), *pieces[3:]))
    with pytest.raises(AssertionError):
        assert_same("Box", (2.0, 4.0, 6.5), {"soft": 1.0})


@pytest.mark.parametrize("n", [5, 6, 8, 12, 30])
def test_refined_meshes(n):
    """Tetrahedra between random points: vertices and elements in Drake's order."""
    from scipy.spatial import Delaunay

    points = np.random.default_rng(n).normal(size=(n, 3))
    elements = Delaunay(points).simplices.copy()
    a, b, c, d = (points[elements[:, k]] for k in range(4))
    turned = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) < 0.0
    elements[turned] = elements[turned][:, [1, 0, 2, 3]]
    found = []
    for name in ("sheldrake", "pydrake"):
        g = library(name)["geometry"]
        mesh = g.VolumeMesh([g.VolumeElement(*map(int, e)) for e in elements], list(points))
        refined = g.RefineVolumeMesh(mesh)
        corners = [[e.vertex(k) for k in range(4)] for e in refined.tetrahedra()]
        found.append((np.array(refined.vertices()), corners))
    np.testing.assert_allclose(found[0][0], found[1][0], rtol=0, atol=1e-15)
    assert found[0][1] == found[1][1]


def test_quadrilaterals_of_files_are_divided_alike(tmp_path):
    """Along the shorter diagonal: the triangles of a rigid mesh."""
    rng, lines, corners = np.random.default_rng(2), [], 0
    for z in range(30):
        angles, radius = np.sort(rng.uniform(0.0, 2.0 * np.pi, 4)), rng.uniform(0.5, 1.0)
        lines += [f"v {radius * np.cos(a)} {radius * np.sin(a)} {z}" for a in angles]
        lines.append("f " + " ".join(str(corners + k) for k in (1, 2, 3, 4)))
        corners += 4
    path = tmp_path / "quads.obj"
    path.write_text("\n".join(lines) + "\n")
    found = []
    for name in ("sheldrake", "pydrake"):
        mesh = library(name)["geometry"].ReadObjToTriangleSurfaceMesh(str(path))
        found.append([[t.vertex(k) for k in range(3)] for t in mesh.triangles()])
    assert found[0] == found[1]
