"""The table of shapes: what a row says of a shape agrees with the surface that it draws."""

import numpy as np
import pytest

import sheldrake.geometry as g
from sheldrake.geometry._mass_properties import mass_properties
from sheldrake.geometry._meshes.mass_properties import of_triangles
from sheldrake.geometry._shape_types import SHAPE_TYPES, type_of

SHAPES = (
    g.Box(0.2, 0.3, 0.5),
    g.Sphere(0.3),
    g.Cylinder(0.2, 0.7),
    g.Capsule(0.2, 0.7),
    g.Ellipsoid(0.2, 0.3, 0.5),
    g.Convex(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0], [1, 1, 1]]).T, "p"),
    g.MeshcatCone(0.5, 0.2, 0.3),
)


def test_every_public_shape_has_a_row_and_a_kind_of_its_own():
    public = {c for c in vars(g).values() if isinstance(c, type) and issubclass(c, g.Shape)}
    assert set(SHAPE_TYPES) == public
    kinds = [row.kind for row in SHAPE_TYPES.values() if row.kind is not None and row.hull is None]
    assert len(kinds) == len(set(kinds))


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.type_name())
def test_bounds_hold_the_surface_and_touch_it(shape):
    row = type_of(shape)
    vertices, faces = row.surface(shape)
    box = g.CalcObb(shape)
    p_BV = box.pose().inverse() @ vertices.T
    reach = np.abs(p_BV).max(axis=1)
    assert np.all(reach <= box.half_width() * (1 + 1e-12) + 1e-12)
    assert np.all(reach >= 0.98 * box.half_width())
    if row.kind is not None and row.hull is None:
        farthest = np.linalg.norm(vertices, axis=1).max()
        assert 0.98 * row.bound(shape) <= farthest <= row.bound(shape) * (1 + 1e-12)
    assert of_triangles(vertices, faces).volume > 0.0  # triangles wind outwards


@pytest.mark.parametrize("shape", SHAPES[:-1], ids=lambda shape: shape.type_name())
def test_mass_is_that_of_the_surface(shape):
    exact, facets = mass_properties(shape), of_triangles(*type_of(shape).surface(shape))
    assert facets.volume == pytest.approx(exact.volume, rel=0.03)  # facets are inscribed
    np.testing.assert_allclose(facets.p_GoGcm, exact.p_GoGcm, atol=1e-6)
    np.testing.assert_allclose(facets.I_GGcm, exact.I_GGcm, atol=0.05 * np.abs(exact.I_GGcm).max())


def test_a_shape_of_others_does_nothing_that_nobody_said():
    class Blob(g.Shape):
        pass

    row = type_of(Blob())
    assert (row.kind, row.mass, row.surface, row.urdf, row.sdf, row.mjcf) == (None, None, None, (), (), None)
    with pytest.raises(NotImplementedError, match="no bounding box"):
        g.CalcObb(Blob())
    with pytest.raises(ValueError, match="Blob is not yet supported"):
        mass_properties(Blob())


def test_a_class_derived_from_a_shape_has_its_row():
    class Ball(g.Sphere):
        pass

    assert type_of(Ball(0.1)) is SHAPE_TYPES[g.Sphere]
