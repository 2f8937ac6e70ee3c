"""Mutated mesh files, and files that promise more than they hold: a mesh or an error that names the file."""

from __future__ import annotations

import json
import struct
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mutated_models import LIMIT, fuzz_settings

from sheldrake.common import MemoryFile
from sheldrake.geometry import InMemoryMesh
from sheldrake.geometry._meshes.mesh_files import read_mesh
from sheldrake.geometry._meshes.mesh_source import MeshSource

BILLION = 10**9
VTK = (
    "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
    "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n"
)
DAE = """<COLLADA><asset><up_axis>Z_UP</up_axis></asset><library_geometries><geometry id="g"><mesh>
<source id="s"><float_array>0 0 0 1 0 0 0 1 0</float_array><technique_common><accessor stride="3"/></technique_common>
</source><vertices id="v"><input semantic="POSITION" source="#s"/></vertices>
<triangles><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry>
</library_geometries><library_visual_scenes><visual_scene><node id="n"><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes></COLLADA>"""


def seed(extension: str) -> bytes:
    import trimesh

    if extension in (".vtk", ".dae"):
        return (VTK if extension == ".vtk" else DAE).encode()
    data = trimesh.creation.box().export(file_type=extension[1:])
    return data if isinstance(data, bytes) else data.encode()


def read(data: bytes, extension: str):
    """The mesh, or None after a RuntimeError that names it; in time."""
    source, start = MeshSource(InMemoryMesh(mesh_file=MemoryFile(data, extension, "shape"))), time.process_time()
    try:
        mesh = read_mesh(source)
    except RuntimeError as error:
        assert "shape" in str(error)
        mesh = None
    else:
        assert np.all(np.isfinite(mesh.vertices))
        assert mesh.triangles.size == 0 or 0 <= mesh.triangles.min() <= mesh.triangles.max() < len(mesh.vertices)
    assert time.process_time() - start < LIMIT
    return mesh


@st.composite
def damaged(draw, data: bytes) -> bytes:
    """Bytes after one to three changes: some are overwritten, left out, doubled, or the end is missing."""
    for _ in range(draw(st.integers(1, 3))):
        start = draw(st.integers(0, len(data)))
        end = min(len(data), start + draw(st.integers(0, 20)))
        new = draw(st.sampled_from([b"", b"9" * 9, b"-1", b"nan", b"\xff\xff\xff\x7f", data[start:end] * 2]))
        data = data[:start] + new + (b"" if draw(st.integers(0, 9)) == 0 else data[end:])
    return data


@pytest.mark.parametrize("extension", [".obj", ".stl", ".ply", ".glb", ".dae", ".vtk"])
def test_damaged_files_give_meshes_or_errors(extension):
    data = seed(extension)
    assert len(read(data, extension).triangles) >= 1

    @fuzz_settings(150)
    @given(damaged(data))
    def check(text):
        read(text, extension)

    check()


def ply(form: str, vertices: int, faces: int) -> bytes:
    return (
        f"ply\nformat {form} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {faces}\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    ).encode()


def gltf(**accessor) -> bytes:
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 3, "uri": "data:application/octet-stream;base64,AAAA"}],
        "bufferViews": [{"buffer": 0, "byteLength": 3}],
        "accessors": [{"componentType": 5126, "count": BILLION, "type": "VEC3", **accessor}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
    }
    return json.dumps(document).encode()


LAUGHTER = "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 9}">' for i in range(1, 30))
NODES = "".join(f'<node id="n{i}">{f"""<instance_node url="#n{i + 1}"/>""" * 2}</node>' for i in range(60))


@pytest.mark.parametrize(
    ("data", "extension"),
    {
        "binary STL": (bytes(80) + struct.pack("<I", BILLION) + bytes(100), ".stl"),
        "ASCII STL": (b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n", ".stl"),
        "ASCII PLY": (ply("ascii", 3, BILLION), ".ply"),
        "ASCII PLY, vertices": (ply("ascii", BILLION, 1), ".ply"),
        "binary PLY": (ply("binary_little_endian", BILLION, BILLION), ".ply"),
        "OBJ": (b"v 0 0 0\nf 1000000000 1 1\n", ".obj"),
        "VTK, points": (VTK.replace("POINTS 4", f"POINTS {BILLION}").encode(), ".vtk"),
        "VTK, cells": (VTK.replace("CELLS 1", f"CELLS {BILLION}").encode(), ".vtk"),
        "VTK, backwards": (VTK.replace("CELLS 1 5\n4", f"CELLS {BILLION} 5\n-1").encode(), ".vtk"),
        "glTF": (gltf(bufferView=0), ".gltf"),
        "glTF, no data": (gltf(), ".gltf"),
        "DAE, entities": (f'<!DOCTYPE a [<!ENTITY e0 "x">{LAUGHTER}]><COLLADA>&e29;</COLLADA>'.encode(), ".dae"),
        "DAE, files": (b'<!DOCTYPE a [<!ENTITY e SYSTEM "file:///etc/passwd">]><COLLADA>&e;</COLLADA>', ".dae"),
        "DAE, nodes": (DAE.replace('<node id="n">', f'{NODES}<node id="n60"/><node id="n">').encode(), ".dae"),
    }.values(),
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_files_that_promise_a_billion_are_refused(data, extension):
    import tracemalloc

    tracemalloc.start()
    try:
        assert read(data, extension) is None
        assert tracemalloc.get_traced_memory()[1] < 200e6  # [bytes]
    finally:
        tracemalloc.stop()
