"""What a mesh in memory names and has not is said, as for meshes on disk."""

import logging

from sheldrake.common import MemoryFile
from sheldrake.geometry import InMemoryMesh, Mesh
from sheldrake.geometry._meshes.mesh_looks import load_mesh

OBJ = "mtllib m.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"


def load(supporting_files, caplog):
    mesh = InMemoryMesh(mesh_file=MemoryFile(OBJ, ".obj", "q.obj"), supporting_files=supporting_files)
    with caplog.at_level(logging.WARNING, "drake"):
        return load_mesh(Mesh(mesh)), caplog.text


def test_a_missing_file_is_named_with_those_there_are(caplog):
    loaded, said = load({"n.mtl": MemoryFile("newmtl a\nKd 1 0 0\n", ".mtl", "n.mtl")}, caplog)
    assert len(loaded.faces) == 1 and not loaded.has_materials
    assert "q.obj: the mesh names 'm.mtl', which is not among its supporting files: ['n.mtl']. It is drawn" in said


def test_a_file_that_is_not_on_disk_is_named(caplog, tmp_path):
    _, said = load({"m.mtl": tmp_path / "m.mtl"}, caplog)
    assert "the mesh names the file 'm.mtl': No such file or directory. It is drawn without." in said


def test_nothing_is_said_of_what_is_there(caplog):
    loaded, said = load({"m.mtl": MemoryFile("newmtl a\nKd 1 0 0\n", ".mtl", "m.mtl")}, caplog)
    assert loaded.has_materials and not said
    assert tuple(loaded.parts[0].diffuse)[:3] == (1.0, 0.0, 0.0)
