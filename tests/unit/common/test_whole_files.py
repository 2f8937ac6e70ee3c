"""Files that are there whole or not at all, and files that never end: pipes, devices, absurd sizes."""

import os
import stat
import threading

import pytest
from tools.torture.files import full_disk

from sheldrake.common import MemoryFile
from sheldrake.common._files import regular_bytes, whole_file
from sheldrake.common.yaml import yaml_dump, yaml_load_file
from sheldrake.geometry import Mesh, Rgba
from sheldrake.geometry._meshes.mesh_files import read_mesh
from sheldrake.geometry._meshes.mesh_source import MeshSource
from sheldrake.multibody.parsing import LoadModelDirectives, Parser
from sheldrake.multibody.plant import MultibodyPlant

pytestmark = pytest.mark.skipif(os.name == "nt", reason="makes pipes and devices as POSIX has them")


def test_a_file_is_replaced_when_all_of_it_is_written(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    with whole_file(path, encoding="utf-8") as file:
        file.write("new")
        file.flush()
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_it_stays_as_it_was_when_something_goes_wrong(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text("old")
    with pytest.raises(KeyError), whole_file(path) as file:
        file.write(b"half")
        raise KeyError("x")
    with pytest.raises(OSError, match="too large"), full_disk(100):
        yaml_dump({"a": list(range(1000))}, filename=path)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.yaml"]


def test_it_has_the_mode_that_any_new_file_has_and_links_stay_links(tmp_path):
    target, link = tmp_path / "target", tmp_path / "link"
    target.write_text("old")
    link.symlink_to(target)
    with whole_file(link) as file:
        file.write(b"new")
    assert link.is_symlink()
    assert target.read_text() == "new"
    (tmp_path / "plain").write_text("")
    assert stat.S_IMODE(target.stat().st_mode) == stat.S_IMODE((tmp_path / "plain").stat().st_mode)


def test_a_pipe_is_written_as_it_is(tmp_path):
    path, found = tmp_path / "pipe", []
    os.mkfifo(path)
    reader = threading.Thread(target=lambda: found.append(path.read_bytes()))
    reader.start()
    with whole_file(path) as file:
        file.write(b"through")
    reader.join()
    assert found == [b"through"]


@pytest.fixture(params=["pipe", "device", "huge", "folder"])
def endless(request, tmp_path):
    """Makes something of a name that is no file to read."""

    def make(name):
        path = tmp_path / name
        if request.param == "pipe":
            os.mkfifo(path)
        elif request.param == "device":
            path.symlink_to("/dev/zero")
        elif request.param == "folder":
            path.mkdir()
        else:
            path.touch()
            os.truncate(path, 1 << 40)
        return path

    return make


@pytest.mark.parametrize("kind", [".obj", ".stl", ".gltf", ".vtk", ".dae", ".ply"])
def test_meshes_that_never_end(endless, kind):
    path = endless(f"mesh{kind}")
    with pytest.raises(RuntimeError, match=r"no regular file|bytes"):
        read_mesh(MeshSource(path))


def test_files_that_a_mesh_names(endless, tmp_path):
    endless("data.bin")
    mesh = tmp_path / "a.gltf"
    mesh.write_text(
        '{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 36, "uri": "data.bin"}], "bufferViews": [{"buffer": '
        '0, "byteLength": 36}], "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}], '
        '"meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "nodes": [{"mesh": 0}], "scene": 0, "scenes": '
        '[{"nodes": [0]}]}'
    )
    with pytest.raises(RuntimeError, match=r"no regular file|bytes"):
        read_mesh(MeshSource(mesh))


def test_meshes_that_the_viewer_is_given(endless, meshcat):
    with pytest.raises(RuntimeError, match=r"no regular file|bytes"):
        meshcat.SetObject("/a", Mesh(str(endless("mesh.glb"))), Rgba(1, 0, 0, 1))


def test_models_directives_and_settings(endless):
    parser = Parser(MultibodyPlant(0.0))
    for kind, read in (
        ("urdf", parser.AddModels),
        ("sdf", parser.AddModels),
        ("xml", parser.AddModels),
        ("dmd.yaml", LoadModelDirectives),
    ):
        with pytest.raises(RuntimeError, match=r"no regular file|refused|does not exist|is a folder"):
            read(str(endless(f"model.{kind}")))
    with pytest.raises(OSError, match=r"no regular file|bytes"):
        yaml_load_file(endless("a.yaml"))
    with pytest.raises(RuntimeError, match=r"no regular file|bytes"):
        MemoryFile.Make(endless("a.bin"))


def test_a_file_is_read_whole(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(bytes(range(256)) * 100)
    assert regular_bytes(path) == path.read_bytes()
    with pytest.raises(FileNotFoundError):
        regular_bytes(tmp_path / "none")
    with pytest.raises(OSError, match="25600 bytes"):
        regular_bytes(path, 25_599)
