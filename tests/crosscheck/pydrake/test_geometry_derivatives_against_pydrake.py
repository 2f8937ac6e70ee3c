"""Geometry queries at poses that carry derivatives equal Drake's, values and derivatives."""

import importlib
import types

import numpy as np
import pytest

from sheldrake.geometry._query import scene

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")

SHAPES = {
    "sphere": ("Sphere", (0.5,)),
    "box": ("Box", (1.0, 1.2, 0.8)),
    "cylinder": ("Cylinder", (0.5, 1.0)),
    "capsule": ("Capsule", (0.4, 0.8)),
    "half space": ("HalfSpace", ()),
}


def library(name):
    return types.SimpleNamespace(
        g=importlib.import_module(f"{name}.geometry"),
        m=importlib.import_module(f"{name}.math"),
        a=importlib.import_module(f"{name}.autodiffutils"),
    )


LIBRARIES = library("sheldrake"), library("pydrake")


def query(lib, first, second, position, properties=lambda lib, k: lib.g.ProximityProperties()):
    """Of two geometries; the position of the first is what derivatives are with respect to."""
    A = lib.a.AutoDiffXd
    scene_graph = lib.g.SceneGraph_[A]()
    source, poses = scene_graph.RegisterSource("source"), lib.g.FramePoseVector_[A]()
    R = lib.m.RotationMatrix_[A](lib.m.RollPitchYaw_[A]([A(0.3), A(0.2), A(0.1)]))
    X = lib.m.RigidTransform_[A](R, lib.a.InitializeAutoDiff(np.array(position)).ravel()), lib.m.RigidTransform_[A]()
    for k, (kind, arguments) in enumerate((first, second)):
        frame = scene_graph.RegisterFrame(source, lib.g.GeometryFrame(f"frame{k}"))
        instance = lib.g.GeometryInstance(lib.m.RigidTransform(), getattr(lib.g, kind)(*arguments), "geometry")
        instance.set_proximity_properties(properties(lib, k))
        scene_graph.RegisterGeometry(source, frame, instance)
        poses.set_value(frame, X[k])
    context = scene_graph.CreateDefaultContext()
    scene_graph.get_source_pose_port(source).FixValue(context, poses)
    return scene_graph.get_query_output_port().Eval(context), (scene_graph, context)


def numbers(lib, array):
    """Values, then derivatives: none counts as zeros."""
    array = np.atleast_1d(np.array(array, dtype=object)).ravel()
    values = [x.value() if hasattr(x, "value") else float(x) for x in array]
    slopes = [x.derivatives() if hasattr(x, "value") and x.derivatives().size else np.zeros(3) for x in array]
    return np.concatenate([values, np.ravel(slopes)])


@pytest.mark.parametrize("height", [0.7, 1.5])
@pytest.mark.parametrize("other", SHAPES)
def test_spheres_and_others(other, height):
    rows = []
    for lib in LIBRARIES:
        q, _kept = query(lib, SHAPES["sphere"], SHAPES[other], [0.1, 0.2, height])
        row = [np.array([float(q.HasCollisions()), len(q.FindCollisionCandidates())])]
        if other in ("sphere", "box", "half space"):  # others Drake knows for floats only
            for pair in q.ComputeSignedDistancePairwiseClosestPoints():
                row += [numbers(lib, x) for x in (pair.distance, pair.p_ACa, pair.p_BCb, pair.nhat_BA_W)]
        for pair in q.ComputePointPairPenetration():
            row.append(numbers(lib, [pair.depth]))
        if other != "cylinder":
            at = lib.a.InitializeAutoDiff(np.array([0.3, 0.1, 0.9])).ravel()
            for one in q.ComputeSignedDistanceToPoint(at):
                row += [numbers(lib, x) for x in (one.distance, one.p_GN, one.grad_W)]
        rows.append(np.concatenate(row))
    np.testing.assert_allclose(*rows, rtol=0, atol=1e-9)


@pytest.mark.parametrize("other", ["sphere", "box", "half space"])
def test_constants_among_derivatives_are_duals(other):
    """The normal of a plane that stands still, for one."""
    for lib in LIBRARIES:
        q, _kept = query(lib, SHAPES["sphere"], SHAPES[other], [0.1, 0.2, 0.4])
        found = [x for p in q.ComputeSignedDistancePairwiseClosestPoints() for x in (p.p_ACa, p.p_BCb, p.nhat_BA_W)]
        at = np.array([lib.a.AutoDiffXd(x) for x in (0.3, 0.1, 1.9)])
        found += [x for p in q.ComputeSignedDistanceToPoint(at) for x in (p.p_GN, p.grad_W)]
        assert all(isinstance(x, lib.a.AutoDiffXd) for x in np.ravel(found))
    for pair in query(LIBRARIES[0], SHAPES["sphere"], SHAPES[other], [0.1, 0.2, 0.4])[0].ComputePointPairPenetration():
        assert all(hasattr(x, "derivatives") for x in (*pair.p_WCa, *pair.p_WCb, *pair.nhat_BA_W, pair.depth))


@pytest.mark.parametrize("other", ["sphere", "box", "half space"])
@pytest.mark.parametrize("swapped", [False, True])
def test_a_pair_has_the_smaller_id_first(other, swapped):
    rows = []
    for lib in LIBRARIES:
        q, _kept = query(lib, SHAPES["sphere"], SHAPES[other], [0.1, 0.2, 1.5])
        ids = sorted(q.inspector().GetAllGeometryIds(), key=lambda i: i.get_value())
        pair = q.ComputeSignedDistancePairClosestPoints(*(ids[::-1] if swapped else ids))
        assert (pair.id_A, pair.id_B) == tuple(ids)
        row = [numbers(lib, x) for x in (pair.distance, pair.p_ACa, pair.p_BCb, pair.nhat_BA_W)]
        rows.append(np.concatenate(row))
    np.testing.assert_allclose(*rows, rtol=0, atol=1e-9)


def test_one_pair_of_several_geometries_is_as_among_all_pairs(monkeypatch):
    """Ours alone, by the Python sources: that all pairs are as Drake's, and machine code as these, others test."""
    monkeypatch.setattr(scene._DualDistances, "can", staticmethod(lambda calls: False))
    lib = LIBRARIES[0]
    A = lib.a.AutoDiffXd
    scene_graph, poses = lib.g.SceneGraph_[A](), lib.g.FramePoseVector_[A]()
    source = scene_graph.RegisterSource("source")
    places = lib.a.InitializeAutoDiff(np.random.default_rng(3).uniform(-2.0, 2.0, (len(SHAPES), 3)))
    for (kind, arguments), place in zip(reversed(SHAPES.values()), places):
        frame = scene_graph.RegisterFrame(source, lib.g.GeometryFrame(kind))
        X = lib.m.RigidTransform([0.1, 0.2, 0.3])
        instance = lib.g.GeometryInstance(X, getattr(lib.g, kind)(*arguments), kind)
        instance.set_proximity_properties(lib.g.ProximityProperties())
        scene_graph.RegisterGeometry(source, frame, instance)
        poses.set_value(frame, lib.m.RigidTransform_[A](lib.m.RotationMatrix_[A](), place))
    context = scene_graph.CreateDefaultContext()
    scene_graph.get_source_pose_port(source).FixValue(context, poses)
    q = scene_graph.get_query_output_port().Eval(context)
    found = q.ComputeSignedDistancePairwiseClosestPoints()
    assert len(found) == 10
    for pair in found:
        alone = q.ComputeSignedDistancePairClosestPoints(pair.id_B, pair.id_A)
        assert (alone.id_A, alone.id_B) == (pair.id_A, pair.id_B)
        for name in ("distance", "p_ACa", "p_BCb", "nhat_BA_W"):
            one, other = (np.atleast_1d(getattr(p, name)).astype(object) for p in (alone, pair))
            for x, y in zip(one, other):
                assert x.value() == y.value()
                np.testing.assert_array_equal(x.derivatives(), y.derivatives())


def hydro(rigid_second):
    def properties(lib, k):
        p = lib.g.ProximityProperties()
        if k and rigid_second:
            lib.g.AddRigidHydroelasticProperties(0.5, p)
        else:
            lib.g.AddCompliantHydroelasticProperties(0.3, 1e6 * (1 + k), p)
        return p

    return properties


@pytest.mark.parametrize("triangles", [False, True])
@pytest.mark.parametrize("other, height", [("half space", 0.45), ("box", 0.8)])
def test_contact_surfaces(other, height, triangles):
    rows = []
    for lib in LIBRARIES:
        kinds = lib.g.HydroelasticContactRepresentation
        q, _kept = query(lib, SHAPES["sphere"], SHAPES[other], [0.1, 0.2, height], hydro(True))
        (surface,) = q.ComputeContactSurfaces(kinds.kTriangle if triangles else kinds.kPolygon)
        field = surface.tri_e_MN() if triangles else surface.poly_e_MN()
        force = np.zeros(3)
        for f in range(surface.num_faces()):
            pressure = field.EvaluateCartesian(f, surface.centroid(f))
            force = force + surface.face_normal(f) * (pressure * surface.area(f) * 1e-5)
        mesh = surface.tri_mesh_W() if triangles else surface.poly_mesh_W()
        row = [numbers(lib, x) for x in (surface.total_area(), surface.centroid(), force, mesh.total_area())]
        rows.append(np.concatenate(row))
    np.testing.assert_allclose(*rows, rtol=0, atol=1e-8)


def test_surface_of_two_compliant_bodies():
    """Values are Drake's, derivatives those of finite differences (Drake's are a few per cent off)."""

    def measure(lib, position):
        q, _kept = query(lib, SHAPES["sphere"], SHAPES["box"], position, hydro(False))
        kinds = lib.g.HydroelasticContactRepresentation
        (surface,) = q.ComputeContactSurfaces(kinds.kPolygon)
        return numbers(lib, [surface.total_area(), *surface.centroid()])

    ours, drakes = (measure(lib, [0.1, 0.2, 0.8]) for lib in LIBRARIES)
    np.testing.assert_allclose(ours[:4], drakes[:4], rtol=0, atol=1e-12)
    for k, step in enumerate(1e-6 * np.eye(3)):
        ends = [measure(LIBRARIES[0], [0.1, 0.2, 0.8] + sign * step)[:4] for sign in (-1, 1)]
        np.testing.assert_allclose(ours[4:].reshape(4, 3)[:, k], (ends[1] - ends[0]) / 2e-6, rtol=0, atol=1e-6)


def test_other_derivatives_are_noticed(monkeypatch):
    from sheldrake.geometry._kernels import hydro_polygon

    pressure_at = hydro_polygon.pressure_at.py_func
    monkeypatch.setattr(hydro_polygon.pressure_at, "py_func", lambda field, p: 1.00001 * pressure_at(field, p))
    with pytest.raises(AssertionError):
        test_contact_surfaces("box", 0.8, False)
