"""Sharp edges of meshes have vertices of their own on either side; nothing that is not needed is loaded for it."""

import io
import subprocess
import sys

import numpy as np
import pytest

from sheldrake.geometry._meshcat.sharp_edges import split_at_edges
from sheldrake.geometry._meshcat.stage import _png

trimesh = pytest.importorskip("trimesh")
MESHES = {
    "box": trimesh.creation.box(),
    "capsule": trimesh.creation.capsule(0.3, 0.1),
    "prism of 8 sides": trimesh.creation.cylinder(0.1, 0.4, sections=8),
    "prism of 16 sides": trimesh.creation.cylinder(0.1, 0.4, sections=16),
    "cone": trimesh.creation.cone(0.1, 0.3),
    "ball": trimesh.creation.icosphere(2),
}


@pytest.mark.parametrize("name", MESHES)
def test_as_trimesh_splits(name):
    mesh = MESHES[name]
    vertices, faces = mesh.triangles.reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3)
    split, corners = split_at_edges(vertices, faces)
    np.testing.assert_allclose(split[corners].reshape(-1, 3), vertices, atol=1e-8)
    assert len(split) == len(trimesh.graph.smooth_shade(mesh, angle=0.5).vertices)


def test_an_edge_is_sharp_from_an_angle_on():
    def bent_by(angle):
        vertices = [[0, 0, 0], [1, 0, 0], [0.5, -1, 0], [0.5, np.cos(angle), np.sin(angle)]]
        return len(split_at_edges(np.array(vertices, float), np.array([[0, 2, 1], [0, 1, 3]]))[0])

    assert bent_by(0.0) == bent_by(0.005) == 4
    assert bent_by(0.6) == 6


def test_faces_without_area_and_edges_of_three_are_split_too():
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0]])
    faces = np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4], [0, 1, 5], [3, 3, 3]])
    split, corners = split_at_edges(vertices, faces)
    np.testing.assert_array_equal(split[corners], vertices[faces])


def test_a_mesh_that_was_split_before_is_remembered():
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    first, again = (split_at_edges(vertices.copy(), faces.copy()) for _ in range(2))
    assert first[0] is again[0] and not first[0].flags.writeable
    other, _ = split_at_edges(2.0 * vertices, faces)
    np.testing.assert_allclose(np.sort(other, axis=0), np.sort(2.0 * first[0], axis=0))


def test_a_picture_is_written_as_png():
    from PIL import Image

    picture = np.random.default_rng(1).integers(0, 256, (7, 5, 3)).astype(np.uint8)
    with Image.open(io.BytesIO(_png(picture))) as read:
        assert read.format == "PNG"
        np.testing.assert_array_equal(np.asarray(read), picture)


def test_a_drawn_and_recorded_capsule_loads_neither_scipy_nor_other_readers_of_files():
    program = """
import sys
from sheldrake.geometry import Capsule, Meshcat, Rgba
from sheldrake.math import RigidTransform
meshcat = Meshcat()
meshcat.SetObject("capsule", Capsule(0.1, 0.3), Rgba(1, 0, 0, 1))
meshcat.StartRecording()
meshcat.SetTransform("capsule", RigidTransform([0, 0, 1]), 0.1)
meshcat.PublishRecording()
assert len(meshcat.StaticHtml()) > 100_000
print(sorted({"trimesh", "scipy", "imageio"} & set(sys.modules)))
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip().splitlines()[-1] == "[]"
