"""Contact surfaces: forces with known values, symmetries, and what the objects offer."""

import copy
import math

import numpy as np
import pytest
from tests.unit.geometry.hydro_properties import properties

from sheldrake import geometry as g
from sheldrake.geometry._compiled.hydroelastic import (
    boxes_of_tree,
    compile_hydro,
    find_surfaces,
    order_of_leaves,
)
from sheldrake.geometry._kernels.hydro_model import NO_ROOM, NUM_PARTS, Part, hydro_table
from sheldrake.geometry._query.query_object import _find_points
from sheldrake.math import RigidTransform, RollPitchYaw

KINDS = g.HydroelasticContactRepresentation


class Scene:
    """Geometries, each on its own frame."""

    def __init__(self, *geometries):
        self.scene_graph = g.SceneGraph()
        self.source = self.scene_graph.RegisterSource("source")
        self.frames = []
        for i, (shape, what) in enumerate(geometries):
            frame = self.scene_graph.RegisterFrame(self.source, g.GeometryFrame(f"frame{i}"))
            instance = g.GeometryInstance(RigidTransform(), shape, "geometry")
            instance.set_proximity_properties(properties(g, **what))
            self.scene_graph.RegisterGeometry(self.source, frame, instance)
            self.frames.append(frame)
        self.context = self.scene_graph.CreateDefaultContext()

    def query(self, *poses):
        vector = g.FramePoseVector()
        for frame, pose in zip(self.frames, poses):
            vector.set_value(frame, pose)
        self.scene_graph.get_source_pose_port(self.source).FixValue(self.context, vector)
        return self.scene_graph.get_query_output_port().Eval(self.context)

    def surfaces(self, *poses, kind=KINDS.kPolygon):
        return self.query(*poses).ComputeContactSurfaces(kind)


def force(surface):
    """Of the pressure on the geometry that the normals point into [N], shape (3,)."""
    field = surface.tri_e_MN() if surface.is_triangle() else surface.poly_e_MN()
    parts = [
        field.EvaluateCartesian(f, surface.centroid(f)) * surface.area(f) * surface.face_normal(f)
        for f in range(surface.num_faces())
    ]
    return np.sum(parts, axis=0)


def at(x=0.0, y=0.0, z=0.0, rpy=(0, 0, 0)):
    return RigidTransform(RollPitchYaw(rpy), [x, y, z])


@pytest.mark.parametrize("kind", [KINDS.kPolygon, KINDS.kTriangle])
@pytest.mark.parametrize(
    "shape, hint, expected",
    [
        (g.Box(0.2, 0.2, 0.2), 0.03, 396.0133),
        (g.Cylinder(0.1, 0.2), 0.03, 306.408),
        (g.Sphere(0.1), 0.03, 0.687),
    ],
)
def test_check_values_at_one_millimetre(shape, hint, expected, kind):
    scene = Scene((shape, {"soft": hint}), (g.HalfSpace(), {"rigid": 1.0}))
    (surface,) = scene.surfaces(at(z=0.099), at(), kind=kind)
    f = force(surface)
    assert f[2] == pytest.approx(expected, rel=2e-3 if expected < 1 else 2e-6)
    assert np.abs(f[:2]).max() < 1e-9


@pytest.mark.parametrize("rpy", [(0.02, 0.01, 0.5), (0.3, -0.2, 1.0)])
def test_rigid_box_in_compliant_half_space_feels_pressure_times_area(rpy):
    """p = E / t * depth wherever the box has a face below ground, and nothing above."""
    scene = Scene((g.Box(0.1, 0.2, 0.3), {"rigid": 1.0}), (g.HalfSpace(), {"slab": 0.5, "modulus": 1e5}))
    (surface,) = scene.surfaces(at(z=0.14, rpy=rpy), at())
    mesh, field = surface.poly_mesh_W(), surface.poly_e_MN()
    for v in range(mesh.num_vertices()):
        assert field.EvaluateAtVertex(v) == pytest.approx(-2e5 * mesh.vertex(v)[2], abs=1e-9)
    assert np.array([mesh.vertex(v) for v in range(mesh.num_vertices())])[:, 2].max() < 1e-15


def test_two_compliant_boxes_share_the_depth_by_their_stiffness():
    """p = depth / (h1 / E1 + h2 / E2) in the middle of flat faces."""
    one, two = {"soft": 1.0, "modulus": 1e6}, {"soft": 1.0, "modulus": 4e6}
    scene = Scene((g.Box(2, 2, 0.4), one), (g.Box(3, 3, 0.2), two))
    (surface,) = scene.surfaces(at(z=0.29), at())
    field = surface.poly_e_MN()
    expected = 0.01 / (0.2 / 1e6 + 0.1 / 4e6)
    pressures = [field.EvaluateAtVertex(v) for v in range(surface.num_vertices())]
    assert max(pressures) == pytest.approx(expected, rel=1e-12)
    assert force(surface)[2] == pytest.approx(expected * 4.0, rel=0.05)  # less at the rim
    largest = max(range(surface.num_faces()), key=surface.area)
    assert surface.face_normal(largest)[2] == pytest.approx(1.0, abs=1e-12)


def test_areas_of_slices_are_those_of_the_box():
    scene = Scene((g.Box(1, 2, 3), {"soft": 1.0}), (g.HalfSpace(), {"rigid": 1.0}))
    for z in np.linspace(-1.45, 1.45, 7):
        (surface,) = scene.surfaces(at(z=z), at())
        assert surface.total_area() == pytest.approx(2.0, rel=1e-12)
        np.testing.assert_allclose(surface.centroid(), 0.0, atol=1e-12)
    (surface,) = scene.surfaces(at(rpy=(0, math.pi / 4, 0)), at())
    assert surface.total_area() == pytest.approx(math.sqrt(2.0) * 2.0, rel=1e-12)


@pytest.mark.parametrize("kind", [KINDS.kPolygon, KINDS.kTriangle])
@pytest.mark.parametrize("second", [{"rigid": 0.5}, {"soft": 0.5, "modulus": 2e6}])
def test_order_of_registration_only_turns_the_normals(second, kind):
    poses = at(0.1, 0.2, 1.4, (0.1, 0.2, 0.3)), at(rpy=(0.4, 0, 0))
    a, b = (g.Sphere(1.0), {"soft": 0.5}), (g.Box(1.2, 1.3, 1.4), second)
    (one,) = Scene(a, b).surfaces(*poses, kind=kind)
    (other,) = Scene(b, a).surfaces(*poses[::-1], kind=kind)
    assert one.num_faces() == other.num_faces()
    assert one.total_area() == pytest.approx(other.total_area(), rel=1e-12)
    np.testing.assert_allclose(force(one), -force(other), rtol=0, atol=1e-9 * np.abs(force(one)).max())
    for f in range(one.num_faces()):
        mesh = one.tri_mesh_W() if one.is_triangle() else one.poly_mesh_W()
        assert mesh.face_normal(f) @ one.face_normal(f) > 0.999999
        assert mesh.area(f) == pytest.approx(one.area(f), rel=1e-9)


def test_moving_both_bodies_moves_the_surface():
    scene = Scene((g.Capsule(0.5, 1.0), {"soft": 0.3}), (g.Ellipsoid(1, 0.7, 0.5), {"soft": 0.4, "modulus": 5e6}))
    poses = at(0.1, 0.2, 0.8, (0.1, 0.2, 0.3)), at(rpy=(0.4, 0, 0))
    (here,) = scene.surfaces(*poses)
    X = at(3.0, -2.0, 1.0, (1.0, 2.0, 3.0))
    (there,) = scene.surfaces(*(X @ pose for pose in poses))
    assert here.num_faces() == there.num_faces()
    np.testing.assert_allclose(force(there), X.rotation() @ force(here), atol=1e-9 * np.abs(force(here)).max())
    np.testing.assert_allclose(there.centroid(), X @ here.centroid(), atol=1e-12)


def test_force_is_continuous_through_contact():
    scene = Scene((g.Sphere(1.0), {"soft": 0.3}), (g.Box(3, 3, 1), {"soft": 1.0, "modulus": 1e6}))
    heights = np.linspace(1.51, 1.2, 63)
    forces = []
    for z in heights:
        found = scene.surfaces(at(z=z, rpy=(0.3, 0.2, 0.1)), at())
        forces.append(force(found[0])[2] if found else 0.0)
    forces = np.array(forces)
    assert forces[0] == 0.0
    assert (np.diff(forces) >= 0.0).all()
    assert np.abs(np.diff(forces, 2)).max() < 0.1 * forces.max()


def compiled(*geometries, kind=KINDS.kPolygon):
    scene = Scene(*geometries)
    state = scene.scene_graph._geometry_state(scene.context)
    compiled = scene.scene_graph._compile_for_queries(state)
    model, ids = compiled.model, compiled.ids
    return scene, compile_hydro(state, model, ids, kind).model


def placed(query):
    """The table with all geometry of a query where it is."""
    scene_graph, _ = query._required()
    pairs = scene_graph._hydro_for_queries(query._state, KINDS.kPolygon)
    return _find_points(pairs.points, query._placed()[2])


@pytest.mark.parametrize(
    "first, second",
    [
        ({"soft": 1.0}, None),
        ({"rigid": 1.0}, None),
        ({"soft": 1.0}, {"rigid": 1.0}),
        ({"soft": 1.0}, {"soft": 1.0, "modulus": 3e6}),
    ],
)
def test_python_source_and_native_code_agree(first, second):
    ground = {"slab": 0.3} if "rigid" in first else {"rigid": 1.0}
    other = (g.HalfSpace(), ground) if second is None else (g.Box(1, 1, 1), second)
    scene, model = compiled((g.Sphere(1.0), first), other)
    query = scene.query(at(0.1, 0.2, 0.8, (0.1, 0.2, 0.3)), at())
    table = placed(query)
    native, twin = find_surfaces(model, table), find_surfaces(model, table, native=False)
    assert native.num_faces == twin.num_faces > 0
    for a, b in zip(native[:5], twin[:5]):
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-9)


def test_a_table_that_is_too_small_says_so():
    scene, model = compiled((g.Sphere(1.0), {"soft": 0.3}), (g.HalfSpace(), {"rigid": 1.0}))
    table = placed(scene.query(at(), at()))
    from sheldrake.common.chain import Chain
    from sheldrake.geometry._compiled.hydroelastic import hydro_kernels

    surfaces = hydro_table(model, 5)
    Chain(hydro_kernels(model)).native(hydro_model=model, table=table, surfaces=surfaces)
    assert surfaces.status == NO_ROOM
    assert surfaces.num_faces <= 5
    assert find_surfaces(model, table).num_faces > 5


def test_tree_holds_every_element_once_and_boxes_hold_what_is_below():
    rng = np.random.default_rng(3)
    for n in (1, 2, 3, 37, 64):
        corners = rng.normal(size=(4, n, 3))
        leaf = order_of_leaves(corners)
        node = boxes_of_tree(corners, leaf)
        assert sorted(leaf[leaf >= 0].tolist()) == list(range(n))
        first = len(leaf) - 1
        for k, element in enumerate(leaf):
            if element < 0:
                continue
            at_node = first + k
            while True:
                low, high = node[at_node, :3] - node[at_node, 3:], node[at_node, :3] + node[at_node, 3:]
                assert (corners[:, element] >= low - 1e-12).all() and (corners[:, element] <= high + 1e-12).all()
                if at_node == 0:
                    break
                at_node = (at_node - 1) // 2


SOFT = (
    (g.Sphere(0.1), {"soft": 0.03}),
    (g.Box(0.2, 0.16, 0.1), {"soft": 0.1, "modulus": 3e6}),
    (g.Cylinder(0.08, 0.2), {"soft": 0.05}),
    (g.Ellipsoid(0.1, 0.07, 0.05), {"soft": 0.04, "modulus": 3e5}),
    (g.Capsule(0.06, 0.1), {"soft": 0.04}),
)


def with_parts(model, **values):
    """A model whose thin parts have other values."""
    changed = model._replace(part=model.part.copy())
    for name, value in values.items():
        column = getattr(Part, name)
        changed.part.reshape(-1, NUM_PARTS, Part.SIZE)[:, 1:, getattr(column, "columns", column)] = value
    return changed


def faces_of(model, table):
    """What is measured of all faces, in an order of their own."""
    surfaces = find_surfaces(model, table)
    values = surfaces.value[: surfaces.num_faces]
    return values[np.lexsort(values.T)]


@pytest.mark.parametrize("second", [(g.Box(0.16, 0.16, 0.16), {"rigid": 1.0}), *SOFT])
@pytest.mark.parametrize("first", SOFT)
def test_thin_parts_leave_out_no_face(first, second):
    """The surface is that of all of both meshes, to the bit, at depths from a touch to the middle."""
    scene, model = compiled(first, second)
    whole = with_parts(model, pressure=-1.0, reach=np.inf, half_sizes=1e3)  # no part is ever enough
    wrong = with_parts(model, reach=0.0, half_sizes=0.0)  # as if nothing were in the core
    rng = np.random.default_rng(5)
    num_faces, num_lost = 0, 0
    for distance in np.concatenate([rng.uniform(0.0, 0.25, 15), rng.uniform(0.1, 0.16, 15)]):
        direction = rng.normal(size=3)
        p = distance * direction / np.linalg.norm(direction)
        table = placed(scene.query(at(), at(*p, rng.uniform(-3, 3, 3))))
        expected = faces_of(whole, table)
        np.testing.assert_array_equal(faces_of(model, table), expected)
        num_faces += len(expected)
        num_lost += len(expected) - len(faces_of(wrong, table))
    assert num_faces > 100 and num_lost > 10


def test_what_a_surface_offers():
    scene = Scene((g.Sphere(1.0), {"soft": 0.5}), (g.HalfSpace(), {"rigid": 1.0}))
    (surface,) = scene.surfaces(at(z=0.5), at())
    assert not surface.is_triangle()
    assert surface.representation() == KINDS.kPolygon
    assert surface.HasGradE_M() and not surface.HasGradE_N()
    with pytest.raises(RuntimeError, match="no gradient values"):
        surface.EvaluateGradE_N_W(0)
    with pytest.raises(RuntimeError, match="polygons"):
        surface.tri_mesh_W()
    with pytest.raises(IndexError):
        surface.area(1000)
    with pytest.raises(TypeError, match="No constructor defined"):
        g.ContactSurface()
    with pytest.raises(TypeError, match="No constructor defined"):
        g.PolygonSurfaceMeshFieldLinear()
    assert copy.copy(surface).Equal(surface)
    assert copy.deepcopy(surface).Equal(scene.surfaces(at(z=0.5), at())[0])
    assert not surface.Equal(scene.surfaces(at(z=0.4), at())[0])
    field = surface.poly_e_MN()
    np.testing.assert_array_equal(field.EvaluateGradient(0), surface.EvaluateGradE_M_W(0))
    (triangles,) = scene.surfaces(at(z=0.5), at(), kind=KINDS.kTriangle)
    f = triangles.tri_e_MN()
    corners = triangles.tri_mesh_W().element(0)
    mean = np.mean([f.EvaluateAtVertex(corners.vertex(k)) for k in range(3)])
    assert f.Evaluate(0, [1 / 3] * 3) == pytest.approx(mean)
    assert f.EvaluateCartesian(0, triangles.centroid(0)) == pytest.approx(mean)
    assert g.ContactSurface_[float] is g.ContactSurface
    assert g.PolygonSurfaceMeshFieldLinear_[float, float] is g.PolygonSurfaceMeshFieldLinear
    with pytest.raises(TypeError, match="HydroelasticContactRepresentation"):
        scene.query(at(), at()).ComputeContactSurfaces(3)


def test_filtered_pairs_have_no_surface():
    scene = Scene((g.Sphere(1.0), {"soft": 0.5}), (g.HalfSpace(), {"rigid": 1.0}))
    ids = g.GeometrySet(list(scene.scene_graph.model_inspector().GetAllGeometryIds()))
    manager = scene.scene_graph.collision_filter_manager(scene.context)
    manager.Apply(g.CollisionFilterDeclaration().ExcludeWithin(ids))
    assert scene.surfaces(at(), at()) == []


def test_surfaces_do_not_depend_on_what_was_asked_before():
    scene, _ = compiled((g.Sphere(1.0), {"soft": 0.1}), (g.Box(1, 1, 1), {"rigid": 0.3}))
    kept, found = [], []
    for height in (1.2, 0.4, 3.0, 1.2):  # a surface, another, none, and the first again
        query = scene.query(at(0.1, 0.2, height), at())
        surfaces = query.ComputeContactSurfaces(KINDS.kPolygon)
        kept.append([surface.total_area() for surface in surfaces])
        found.append(surfaces)
    assert [len(surfaces) for surfaces in found] == [1, 1, 0, 1]
    assert found[0][0].Equal(found[3][0])
    assert [[surface.total_area() for surface in surfaces] for surfaces in found] == kept
    assert kept[1] != kept[0]
