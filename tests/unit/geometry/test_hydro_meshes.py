"""Meshes of compliant and rigid shapes: their volume, their pressure, and what they refuse."""

import math

import numpy as np
import pytest

from sheldrake import geometry as g
from sheldrake.geometry._hydroelastic import meshes
from sheldrake.geometry._hydroelastic.representation import representation_of_shape
from sheldrake.geometry._kernels.hydro_depth import depths_below
from sheldrake.geometry._meshes.mesh_files import boundary_triangles
from sheldrake.math import RigidTransform


def volumes(mesh):
    a, b, c, d = (mesh.vertices[mesh.tetrahedra[:, k]] for k in range(4))
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6.0


def all_meshes(margin=0.0):
    yield meshes.sphere_mesh(1.3, 0.3, margin), 4.0 / 3.0 * math.pi * (1.3 + margin) ** 3
    yield (
        meshes.ellipsoid_mesh((1.0, 0.5, 2.0), 0.2, margin),
        4 / 3 * math.pi * np.prod(np.array([1, 0.5, 2]) + margin),
    )
    for length in (0.7, 2.0, 3.0):
        volume = math.pi * (1.0 + margin) ** 2 * (length + 2 * margin)
        yield meshes.cylinder_mesh(1.0, length, 0.1, margin), volume
    r = 1.0 + margin
    yield meshes.capsule_mesh(1.0, 2.0, 0.1, margin), math.pi * r**2 * (2.0 + 4.0 / 3.0 * r)


@pytest.mark.parametrize("margin", [0.0, 0.05])
def test_tetrahedra_fill_the_shape(margin):
    for mesh, volume in all_meshes(margin):
        assert volumes(mesh).min() > 0.0
        assert volumes(mesh).sum() == pytest.approx(volume, rel=0.03)  # inscribed: a little less
        assert volumes(mesh).sum() < volume


@pytest.mark.parametrize(
    "size", [(1, 2, 3), (3, 1, 2), (2, 3, 1), (2, 2, 1), (1, 2, 2), (2, 2, 3), (3, 2, 2), (2, 2, 2)]
)
def test_boxes_are_exact_and_their_pressure_is_the_distance_to_the_surface(size):
    half = np.array(size) / 2.0
    mesh = meshes.box_mesh(half)
    assert volumes(mesh).sum() == pytest.approx(np.prod(size), rel=1e-14)
    assert volumes(mesh).min() > 0.0
    rng = np.random.default_rng(1)
    weights = rng.dirichlet(np.ones(4), size=len(mesh.tetrahedra))
    points = np.einsum("tk,tkc->tc", weights, mesh.vertices[mesh.tetrahedra])
    pressure = np.einsum("tk,tk->t", weights, mesh.extent[mesh.tetrahedra])
    np.testing.assert_allclose(pressure, (half - np.abs(points)).min(axis=1) / half.min(), atol=1e-14)


def test_every_inner_triangle_has_two_sides():
    for mesh, _ in all_meshes():
        faces = np.sort(mesh.tetrahedra[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]].reshape(-1, 3), axis=1)
        outside = (mesh.extent[faces] == 0.0).all(axis=1)
        _, which, count = np.unique(faces, axis=0, return_inverse=True, return_counts=True)
        assert (count[which.ravel()] == np.where(outside, count[which.ravel()], 2)).all()
        assert count.max() == 2


def test_margin_moves_the_surface_and_keeps_the_level_of_zero_pressure():
    mesh = meshes.box_mesh(np.array([1.0, 2.0, 3.0]), 0.25)
    assert np.abs(mesh.vertices).max(axis=0) == pytest.approx([1.25, 2.25, 3.25])
    assert mesh.extent.min() == pytest.approx(-0.25)
    assert mesh.extent.max() == 1.0
    sphere = meshes.sphere_mesh(2.0, 0.5, 0.1)
    assert sphere.extent[1:] == pytest.approx(-0.05)


def properties(**what):
    p = g.ProximityProperties()
    g.AddCompliantHydroelasticProperties(what.pop("hint", 0.5), what.pop("modulus", 1e6), p)
    for name, value in what.items():
        p.AddProperty("hydroelastic", name, value)
    return p


def test_pressure_reaches_the_modulus():
    found = representation_of_shape(g.Sphere(1.0), properties(modulus=3e5))
    assert found.pressure.max() == 3e5
    assert not found.rigid
    assert isinstance(found.mesh(), g.VolumeMesh)


def test_no_representation_without_compliance_type():
    assert representation_of_shape(g.Sphere(1.0), g.ProximityProperties()) is None


def test_a_volume_mesh_needs_a_vertex_inside(tmp_path):
    path = tmp_path / "one.vtk"
    path.write_text(
        "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
        "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n"
    )
    with pytest.raises(RuntimeError, match="interior vertices"):
        representation_of_shape(g.Mesh(str(path), 1.0), properties())


def test_what_is_missing_is_said_when_the_context_is_made():
    scene_graph = g.SceneGraph()
    config = g.SceneGraphConfig()
    config.default_proximity_properties.compliance_type = "compliant"
    config.default_proximity_properties.hydroelastic_modulus = None
    scene_graph.set_config(config)
    from sheldrake.math import RigidTransform

    instance = g.GeometryInstance(RigidTransform(), g.Box(1, 1, 1), "box")
    instance.set_proximity_properties(g.ProximityProperties())
    scene_graph.RegisterAnchoredGeometry(scene_graph.RegisterSource("source"), instance)
    with pytest.raises(RuntimeError, match=r"Cannot create soft Box; missing the \('hydroelastic', 'hydroelastic_mod"):
        scene_graph.CreateDefaultContext()


def test_refined_volumes_have_pressure_everywhere(tmp_path):
    """Two tetrahedra have no vertex inside; refined, they have one, and the volume stays."""
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]
    mesh = g.VolumeMesh([g.VolumeElement(0, 1, 2, 3), g.VolumeElement(1, 4, 2, 3)], points)
    refined = g.RefineVolumeMesh(mesh)
    assert refined.num_vertices() == 6
    assert refined.CalcVolume() == pytest.approx(mesh.CalcVolume())
    assert g.RefineVolumeMesh(refined).Equal(refined)
    path = tmp_path / "coarse.vtk"
    cells = "4 0 1 2 3\n4 1 4 2 3\n"
    path.write_text(
        "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n"
        + "\n".join(" ".join(map(str, p)) for p in points)
        + f"\nCELLS 2 10\n{cells}CELL_TYPES 2\n10\n10\n"
    )
    with pytest.raises(RuntimeError, match="interior vertices"):
        representation_of_shape(g.Mesh(str(path), 1.0), properties())
    fine = tmp_path / "fine.vtk"
    fine.write_text(g.RefineVolumeMeshIntoVtkFileContents(g.MeshSource(str(path))))
    found = representation_of_shape(g.Mesh(str(fine), 1.0), properties())
    assert found.mesh().Equal(refined)
    assert found.pressure.max() == 1e6
    with pytest.raises(RuntimeError, match=r"expected a \.vtk file"):
        g.RefineVolumeMeshIntoVtkFileContents(g.MeshSource(str(tmp_path / "box.obj")))


@pytest.mark.parametrize("native", [True, False])
def test_depths_are_distances_from_the_surface(native):
    """Of points in a box: to the nearest face."""
    rng = np.random.default_rng(5)
    box = meshes.box_mesh(np.array([0.5, 1.0, 1.5]))
    triangles = meshes_surface(box)
    points = rng.uniform(-1, 1, (20, 3)) * [0.5, 1.0, 1.5]
    vertices, inside = np.vstack([box.vertices, points]), len(box.vertices) + np.arange(20)
    depth = np.zeros(20)
    run = depths_below.native if native else depths_below
    run(vertices, inside, triangles, depth)
    np.testing.assert_allclose(depth, (np.array([0.5, 1.0, 1.5]) - np.abs(points)).min(axis=1), atol=1e-14)


def meshes_surface(mesh):
    return boundary_triangles(mesh.tetrahedra).astype(np.int64)


@pytest.mark.parametrize("shape", [g.Capsule(0.1, 1.0), g.Cylinder(0.1, 1.0), g.Capsule(1e300, 1.0)])
@pytest.mark.parametrize("add", [g.AddRigidHydroelasticProperties, g.AddCompliantHydroelasticProperties])
def test_a_hint_that_would_fill_the_memory_is_refused_at_once(shape, add):
    scene_graph, asked = g.SceneGraph(), g.ProximityProperties()
    add(1e-6, *((1e6,) if add is g.AddCompliantHydroelasticProperties else ()), asked)
    geometry = g.GeometryInstance(RigidTransform(), shape, "fine")
    geometry.set_proximity_properties(asked)
    with pytest.raises(RuntimeError, match=r"'resolution_hint'.* property 1e-06 its mesh would have some .* vertices"):
        scene_graph.RegisterAnchoredGeometry(scene_graph.RegisterSource("s"), geometry)
    assert scene_graph.model_inspector().num_geometries() == 0
