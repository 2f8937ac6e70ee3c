"""Hydroelastic properties that do not do are refused where a geometry gets them, and nothing has changed then."""

import pytest
from tests.libraries import modules_of

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")

OURS, THEIRS = (modules_of(name, "geometry", "math") for name in ("sheldrake", "pydrake"))


def compliant(g, without=None, **other):
    out = g.ProximityProperties()
    g.AddCompliantHydroelasticProperties(0.5, 1e5, out)
    if without is not None:
        out.RemoveProperty("hydroelastic", without)
    for name, value in other.items():
        out.UpdateProperty("hydroelastic", name, value)
    return out


def rigid_without_hint(g):
    out = g.ProximityProperties()
    g.AddRigidHydroelasticProperties(out)
    return out


CASES = {
    "no modulus": (lambda g: compliant(g, "hydroelastic_modulus"), lambda g: g.Sphere(1)),
    "no hint": (lambda g: compliant(g, "resolution_hint"), lambda g: g.Sphere(1)),
    "a box needs no hint": (lambda g: compliant(g, "resolution_hint"), lambda g: g.Box(1, 1, 1)),
    "negative modulus": (lambda g: compliant(g, hydroelastic_modulus=-1.0), lambda g: g.Sphere(1)),
    "negative margin": (lambda g: compliant(g, margin=-1.0), lambda g: g.Box(1, 1, 1)),
    "no thickness": (compliant, lambda g: g.HalfSpace()),
    "thickness": (lambda g: compliant(g, slab_thickness=1.0), lambda g: g.HalfSpace()),
    "rigid without hint": (rigid_without_hint, lambda g: g.Cylinder(1, 1)),
    "rigid": (rigid_without_hint, lambda g: g.Box(1, 1, 1)),
}


def outcomes(L, make_properties, make_shape):
    """What registering, assigning, replacing and changing the shape end with, and how much there is afterwards."""
    g, X = L.geometry, L.math.RigidTransform()
    scene_graph = g.SceneGraph()
    source = scene_graph.RegisterSource("source")
    frame = scene_graph.RegisterFrame(source, g.GeometryFrame("frame"))

    def instance(name, shape, properties=None):
        out = g.GeometryInstance(X, shape, name)
        if properties is not None:
            out.set_proximity_properties(properties)
        return out

    bare = scene_graph.RegisterGeometry(source, frame, instance("bare", make_shape(g)))
    plain = scene_graph.RegisterGeometry(source, frame, instance("plain", make_shape(g), g.ProximityProperties()))
    box = scene_graph.RegisterGeometry(source, frame, instance("box", g.Box(1, 1, 1), compliant(g, "resolution_hint")))
    calls = [
        lambda: scene_graph.RegisterGeometry(source, frame, instance("new", make_shape(g), make_properties(g))),
        lambda: scene_graph.AssignRole(source, bare, make_properties(g)),
        lambda: scene_graph.AssignRole(source, plain, make_properties(g), g.RoleAssign.kReplace),
        lambda: scene_graph.ChangeShape(source, box, make_shape(g)),
    ]
    found = []
    inspector = scene_graph.model_inspector()
    for call in calls:
        try:
            call()
            found.append("done")
        except RuntimeError as error:
            found.append(str(error).split(";")[0])
        found += [inspector.num_geometries(), inspector.NumGeometriesWithRole(g.Role.kProximity)]
    return found


@pytest.mark.parametrize("case", CASES)
def test_properties_are_checked_where_they_are_given(case):
    mine, theirs = (outcomes(L, *CASES[case]) for L in (OURS, THEIRS))
    # Of a refused call Drake keeps what it had done before it found out; here nothing has changed.
    assert mine[::3] == theirs[::3]
    for k, ended in enumerate(mine[::3]):
        before = mine[3 * k - 2 : 3 * k] if k else [3, 2]
        after = mine[3 * k + 1 : 3 * k + 3]
        assert after == before if ended != "done" else after >= before


def test_what_is_refined_is_a_volume_mesh():
    for L in (OURS, THEIRS):
        for other in (L.geometry.Box(1, 1, 1), None, "mesh.vtk"):
            with pytest.raises(TypeError):
                L.geometry.RefineVolumeMesh(other)
