"""Hydroelastic contact surfaces are Drake's, face for face."""

import numpy as np
import pytest
from hydro_scenes import Pair, library, write_files

from sheldrake.geometry._compiled import hydroelastic

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")

TILTED = (0.1, 0.2, 0.3)
SHAPES = {
    "sphere": ("Sphere", (1.0,), 0.4),  # and a height at which it dips into the ground
    "box": ("Box", (1, 2, 3), 1.2),
    "flat cylinder": ("Cylinder", (1.0, 1.0), 0.4),
    "long cylinder": ("Cylinder", (0.7, 2.0), 0.9),
    "capsule": ("Capsule", (1.0, 2.0), 1.5),
    "ellipsoid": ("Ellipsoid", (1, 2, 0.7), 0.3),
    "obj": ("Mesh", ("obj", 2.0), -0.5),
    "vtk": ("Mesh", ("vtk", 2.0), -0.3),
    "convex": ("Convex", ("obj", 2.0), -0.5),
}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    return write_files(tmp_path_factory.mktemp("surfaces"))


def shape(name, files):
    kind, arguments, _ = SHAPES[name]
    return kind, tuple(files.get(a, a) if isinstance(a, str) else a for a in arguments)


def placed(name):
    """Poses at which a shape overlaps all others."""
    corner_at_origin = name in ("obj", "vtk", "convex")
    return (*TILTED, 0, 0.1, 0.2 if corner_at_origin else 1.0), (0.3, 0.1, -0.2, 0.3, 0.2, 0.1)


def rows(surface):
    """Centroid, area, normal, pressure and gradients of every face that has an area, shape (n, 14)."""
    field = surface.tri_e_MN() if surface.is_triangle() else surface.poly_e_MN()
    found = []
    for f in range(surface.num_faces()):
        gradients = [
            evaluate(f) if has() else np.zeros(3)
            for has, evaluate in (
                (surface.HasGradE_M, surface.EvaluateGradE_M_W),
                (surface.HasGradE_N, surface.EvaluateGradE_N_W),
            )
        ]
        c = surface.centroid(f)
        found.append([*c, surface.area(f), *surface.face_normal(f), field.EvaluateCartesian(f, c) / 1e6])
        found[-1] += [*(gradients[0] / 1e6), *(gradients[1] / 1e6)]
    found = np.array(found)
    return found[found[:, 3] > 1e-12]


def assert_same_faces(ours, drakes, tolerance):
    ours, drakes = rows(ours), rows(drakes)
    assert ours.shape == drakes.shape
    apart = np.abs(ours[:, None] - drakes[None]).max(axis=2)
    nearest = apart.argmin(axis=1)
    assert len(set(nearest.tolist())) == len(ours), "every face has its own partner"
    assert apart.min(axis=1).max() < tolerance


def force(surface):
    found = rows(surface)
    return found[:, 7:8].T @ (found[:, 3:4] * found[:, 4:7])


def assert_same(first, second, poses, triangles, tolerance=1e-9, faces=True):
    ours, drakes = (
        Pair(library(name), first, second).surfaces(*poses, triangles=triangles) for name in ("sheldrake", "pydrake")
    )
    assert len(ours) == len(drakes) == 1
    (ours,), (drakes,) = ours, drakes
    assert (ours.id_M() < ours.id_N()) and (drakes.id_M() < drakes.id_N())
    assert ours.HasGradE_M() == drakes.HasGradE_M() and ours.HasGradE_N() == drakes.HasGradE_N()
    assert ours.is_triangle() == drakes.is_triangle() == triangles
    assert ours.total_area() == pytest.approx(drakes.total_area(), rel=tolerance)
    np.testing.assert_allclose(ours.centroid(), drakes.centroid(), atol=tolerance)
    np.testing.assert_allclose(force(ours), force(drakes), atol=tolerance * np.abs(force(drakes)).max())
    if faces:
        assert_same_faces(ours, drakes, tolerance)
    return ours, drakes


@pytest.mark.parametrize("triangles", [False, True], ids=["polygons", "triangles"])
@pytest.mark.parametrize("name", SHAPES)
def test_on_half_spaces(name, triangles, files):
    what, pose = shape(name, files), (*TILTED, 0.1, 0.2, SHAPES[name][2])
    for mine, ground in (({"soft": 0.5}, {"rigid": 1.0}), ({"rigid": 0.5}, {"slab": 0.1})):
        body, half_space = (*what, mine), ("HalfSpace", (), ground)
        ours, drakes = assert_same(body, half_space, (pose, (0,) * 6), triangles)
        assert (ours.num_faces(), ours.num_vertices()) == (drakes.num_faces(), drakes.num_vertices())
        assert_same(half_space, body, ((0.02, -0.03, 0, 0, 0, 0), pose), triangles)


@pytest.mark.parametrize("other", ["box", "flat cylinder", "ellipsoid", "obj", "vtk"])
@pytest.mark.parametrize("name", SHAPES)
def test_compliant_and_rigid_meshes(name, other, files):
    poses = placed(name)
    one, two = shape(name, files), shape(other, files)
    for first, second in (({"soft": 0.5}, {"rigid": 0.6}), ({"rigid": 0.5}, {"soft": 0.6, "modulus": 3e6})):
        assert_same((*one, first), (*two, second), poses, False)
    assert_same((*one, {"soft": 0.5}), (*two, {"rigid": 0.6}), poses, True)


@pytest.mark.parametrize("other", ["box", "flat cylinder", "ellipsoid", "obj", "vtk"])
@pytest.mark.parametrize("name", SHAPES)
def test_compliant_meshes(name, other, files):
    poses = placed(name)
    one, two = (*shape(name, files), {"soft": 0.5}), (*shape(other, files), {"soft": 0.6, "modulus": 3e6})
    assert_same(one, two, poses, False)
    # Rounding gives some of Drake's polygons a corner in the middle of an edge: its fans have a triangle more.
    assert_same(one, two, poses, True, faces=False)


@pytest.mark.parametrize("name", ["sphere", "box", "flat cylinder", "long cylinder", "capsule", "ellipsoid"])
def test_margins(name, files):
    what, pose = (*shape(name, files), {"soft": 0.5, "margin": 0.05}), (*TILTED, 0.1, 0.2, SHAPES[name][2])
    assert_same(what, ("HalfSpace", (), {"rigid": 1.0}), (pose, (0,) * 6), False)
    box = ("Box", (1.0, 1.1, 1.2), {"soft": 1.0, "modulus": 2e6, "margin": 0.1})
    assert_same(what, box, (pose, (0.1, 0, 0, 0.2, 0.1, -0.2)), False)
    rigid = (*shape(name, files), {"rigid": 0.5})
    assert_same(rigid, ("HalfSpace", (), {"slab": 0.1, "margin": 0.05}), (pose, (0,) * 6), False)


def test_margin_of_a_mesh(files):
    """Drake moves the vertices by a numerical optimum."""
    pose = (*TILTED, 0.1, 0.2, -0.3)
    for name in ("obj", "vtk"):
        what = (*shape(name, files), {"soft": 0.5, "margin": 0.05})
        assert_same(what, ("HalfSpace", (), {"rigid": 1.0}), (pose, (0,) * 6), False, tolerance=1e-6)


def test_back_sides_have_no_pressure(files):
    """A rigid box deep in a compliant half space: all faces but the one that looks up."""
    box, ground = ("Box", (1, 2, 3), {"rigid": 1.0}), ("HalfSpace", (), {"slab": 0.1})
    ours, drakes = assert_same(box, ground, ((*TILTED, 0, 0, -5), (0,) * 6), False)
    assert ours.num_faces() == drakes.num_faces() == 20


CONTRADICTIONS = {
    "two rigid": (("Box", (1, 2, 3), {"rigid": 1.0}), ("Box", (1, 1, 1), {"rigid": 1.0})),
    "rigid half space": (("Box", (1, 2, 3), {"rigid": 1.0}), ("HalfSpace", (), {"rigid": 1.0})),
    "soft half space": (("Box", (1, 2, 3), {"soft": 1.0}), ("HalfSpace", (), {"slab": 1.0})),
    "nothing": (("Box", (1, 2, 3), {"soft": 1.0}), ("Box", (1, 1, 1), {})),
}


@pytest.mark.parametrize("case", CONTRADICTIONS)
def test_what_has_no_surface_is_refused_or_touches_in_points(case):
    for name in ("sheldrake", "pydrake"):
        lib = library(name)
        pair, kinds = Pair(lib, *CONTRADICTIONS[case]), lib["geometry"].HydroelasticContactRepresentation
        with pytest.raises(RuntimeError, match="Requested"):
            pair.surfaces((*TILTED, 0, 0, 0.1), (0,) * 6)
        query = pair.query((*TILTED, 0, 0, 0.1), (0,) * 6)
        surfaces, points = query.ComputeContactSurfacesWithFallback(kinds.kPolygon)
        assert (len(surfaces), len(points)) == (0, 1)
        assert pair.surfaces((*TILTED, 0, 0, 100), (0,) * 6) == []


def test_faces_too_large_by_a_millionth_are_noticed(monkeypatch):
    arrays = hydroelastic._tetrahedron_arrays

    def larger(found):
        vertex, element, field = arrays(found)
        field[:, 7::4] += 1e-6
        return vertex, element, field

    monkeypatch.setattr(hydroelastic, "_tetrahedron_arrays", larger)
    one, two = ("Sphere", (1.0,), {"soft": 0.5}), ("Box", (1, 2, 3), {"rigid": 1.0})
    with pytest.raises(AssertionError):
        assert_same(one, two, ((*TILTED, 0, 0.1, 1.0), (0.3, 0.1, -0.2, 0.3, 0.2, 0.1)), False)
