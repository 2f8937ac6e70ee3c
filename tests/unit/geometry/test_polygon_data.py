"""The numbers that faces are given as."""

import numpy as np
import pytest

from sheldrake.geometry import PolygonSurfaceMesh
from sheldrake.geometry._compiled.hulls import _faces_around, _feet, _neighbours

CORNERS = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]


@pytest.mark.parametrize("data", [[-1], [0], [3, 0, 1], [3, 0, 1, 2, 4, 0, 1, 2], [2**62], [3, 0, 1, 2, -3, 0, 1, 2]])
def test_faces_that_do_not_end_where_the_numbers_do_are_refused(data):
    """Minus one corner was a step back, for ever."""
    with pytest.raises(ValueError, match="numbers follow"):
        PolygonSurfaceMesh(data, CORNERS)


def test_faces_of_one_size_and_of_several():
    mesh = PolygonSurfaceMesh([3, 0, 1, 2, 3, 0, 2, 3], CORNERS)
    assert [mesh.element(f).num_vertices() for f in range(mesh.num_faces())] == [3, 3]
    mesh = PolygonSurfaceMesh([4, 0, 1, 2, 3, 3, 0, 2, 1], CORNERS)
    assert mesh._faces == [(0, 1, 2, 3), (0, 2, 1)] and mesh.face_data() == [4, 0, 1, 2, 3, 3, 0, 2, 1]
    assert PolygonSurfaceMesh([], CORNERS).num_faces() == 0


def test_what_is_next_to_what():
    flat, sizes = np.array([0, 1, 2, 3, 0, 2, 1]), np.array([4, 3])
    lengths, numbers = _neighbours(flat, sizes, 5)
    assert np.split(numbers, np.cumsum(lengths)[:-1])[0].tolist() == [1, 2, 3]
    assert lengths.tolist() == [3, 2, 3, 2, 0] and numbers.tolist() == [1, 2, 3, 0, 2, 0, 1, 3, 0, 2]
    lengths, numbers = _faces_around(flat, sizes, 5)
    assert lengths.tolist() == [2, 2, 2, 1, 0] and numbers.tolist() == [0, 1, 0, 1, 0, 1, 0]


def test_feet_of_a_face_with_very_many_corners_span_it():
    """All pairs of its corners would take 10 GB."""
    angle = 2.0 * np.pi * np.arange(20_000) / 20_000
    circle = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    feet = circle[_feet(circle, list(range(20_000)))]
    assert np.linalg.norm(feet[2] - feet[0]) > 1.9999 and np.linalg.norm(feet[3] - feet[1]) > 1.9999
    assert abs((feet[2] - feet[0]) @ (feet[3] - feet[1])) < 0.02
