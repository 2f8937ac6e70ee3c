"""Inertia of solids of uniform density, and what has none."""

import numpy as np
import pytest

from sheldrake.geometry import Box, HalfSpace, MeshcatCone, SurfaceTriangle, TriangleSurfaceMesh
from sheldrake.multibody.tree import CalcSpatialInertia

CORNERS = np.array([[0.1, 0.2, 0.3], [1.1, 0.2, 0.3], [0.1, 1.2, 0.3], [0.1, 0.2, 1.3]])
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def surface(faces):
    return TriangleSurfaceMesh([SurfaceTriangle(*face) for face in faces], CORNERS)


def test_a_tetrahedron_has_a_sixth_of_its_cube_and_its_centroid():
    M = CalcSpatialInertia(mesh=surface(FACES), density=100.0)
    assert M.get_mass() == pytest.approx(100 / 6, rel=1e-14)
    assert M.get_com() == pytest.approx(CORNERS.mean(axis=0), rel=1e-14)


def test_an_open_mesh_is_closed_towards_the_origin_of_its_frame():
    """As in Drake. Without its lowest face, of 0.5 m² and 0.3 m up, a pyramid down to the origin comes along."""
    M = CalcSpatialInertia(mesh=surface(FACES[1:]), density=100.0)
    solid, pyramid = 1.0 / 6.0, 0.5 * 0.3 / 3.0
    assert M.get_mass() == pytest.approx(100.0 * (solid + pyramid), rel=1e-13)
    apex = (CORNERS[0] + CORNERS[1] + CORNERS[2]) / 4.0
    centre = (solid * CORNERS.mean(axis=0) + pyramid * apex) / (solid + pyramid)
    assert M.get_com() == pytest.approx(centre, rel=1e-13)


@pytest.mark.parametrize(
    ("solid", "density", "error", "text"),
    [
        (surface([face[::-1] for face in FACES]), 1.0, ValueError, "is -0.166667 m³. The mesh may be open"),
        (HalfSpace(), 1.0, ValueError, "mass of a HalfSpace"),
        (MeshcatCone(1.0, 1.0, 1.0), 1.0, ValueError, "MeshcatCone is not yet supported"),
        (Box(1.0, 1.0, 1.0), 0.0, RuntimeError, "density is not positive and finite: 0"),
        (Box(1.0, 1.0, 1.0), float("nan"), RuntimeError, "density is not positive and finite: nan"),
    ],
)
def test_what_has_no_inertia_says_why(solid, density, error, text):
    with pytest.raises(error, match=text):
        CalcSpatialInertia(solid, density)
