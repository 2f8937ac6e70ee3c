import copy
import pickle

import numpy as np
import pytest

from sheldrake import geometry as g

SHAPES = [
    (g.Sphere(1.5), "Sphere(radius=1.5)"),
    (g.Box(1, 2, 3), "Box(width=1, depth=2, height=3)"),
    (g.Cylinder(1, 2), "Cylinder(radius=1, length=2)"),
    (g.Capsule(1, 2), "Capsule(radius=1, length=2)"),
    (g.Ellipsoid(1, 2, 3), "Ellipsoid(a=1, b=2, c=3)"),
    (g.HalfSpace(), "HalfSpace()"),
    (g.MeshcatCone(1, 2, 3), "MeshcatCone(height=1, a=2, b=3)"),
]


@pytest.mark.parametrize("shape, text", SHAPES, ids=[text for _, text in SHAPES])
def test_repr_reads_back_and_copies_are_equal(shape, text):
    assert repr(shape) == text
    for other in (shape.Clone(), copy.copy(shape), copy.deepcopy(shape), pickle.loads(pickle.dumps(shape))):
        assert type(other) is type(shape)
        assert repr(other) == text
    assert repr(eval(text, vars(g))) == text


def test_measures_as_array_or_keywords():
    assert repr(g.Box([1, 2, 3])) == repr(g.Box(measures=np.array([1, 2, 3]))) == repr(g.Box(1, depth=2, height=3))
    assert g.Box(1, 2, 3).size().tolist() == [1, 2, 3]
    assert repr(g.MeshcatCone(1.0)) == "MeshcatCone(height=1, a=1, b=1)"


@pytest.mark.parametrize(
    "make, names",
    [
        (lambda x: g.Sphere(x), "radius"),
        (lambda x: g.Box(1, x, 1), "depth"),
        (lambda x: g.Cylinder(1, x), "length"),
        (lambda x: g.Capsule(x, 1), "radius"),
        (lambda x: g.Ellipsoid(1, 1, x), "c"),
        (lambda x: g.MeshcatCone(x), "height"),
    ],
)
@pytest.mark.parametrize("bad", [-1.0, np.inf, np.nan])
def test_bad_measure_is_named(make, names, bad):
    with pytest.raises(RuntimeError, match=names):
        make(bad)


def test_zero_is_a_point_for_a_sphere_only():
    assert g.Sphere(0).radius() == 0
    with pytest.raises(RuntimeError):
        g.Cylinder(0, 1)
    with pytest.raises(TypeError):
        g.Sphere("a")
    with pytest.raises(TypeError):
        g.Box(1, 2)


def test_mesh_scale_and_source(tmp_path):
    mesh = g.Mesh("dir/a.OBJ", scale=2.0)
    assert mesh.extension() == ".obj"
    assert mesh.scale() == 2.0
    assert mesh.source().path().is_absolute()
    assert repr(mesh).endswith("dir/a.OBJ', scale3=[2.0, 2.0, 2.0])")
    tall = g.Convex("a.obj", scale3=[1, -2, 3])
    assert tall.scale3().tolist() == [1, -2, 3]
    with pytest.raises(RuntimeError, match=r"uniform scaling.*\[1 -2 3\]"):
        tall.scale()
    with pytest.raises(RuntimeError, match=r"scale. cannot be < 1e-8"):
        g.Mesh("a.obj", [1, 0, 1])
    with pytest.raises(RuntimeError, match="empty"):
        g.Mesh("")
    with pytest.raises(RuntimeError, match="file"):
        mesh.source().in_memory()
    assert repr(pickle.loads(pickle.dumps(tall))) == repr(tall)


def test_convex_of_points_wants_a_label():
    points = np.array([[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    for call in (lambda: g.Convex(points), lambda: g.Convex(points, 2.0), lambda: g.Convex(points=points, scale=2.0)):
        with pytest.raises(TypeError, match=r"Convex\(\): .*expected \(points, label: str, scale=1.0 \| scale3\)"):
            call()
    assert g.Convex(points=points, label="corner", scale=2.0).scale() == 2.0
