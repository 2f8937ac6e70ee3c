"""Mutated mesh files, and files that promise more than they hold: a mesh or an error that names the file."""

from __future__ import annotations

import json
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tools.torture.documents import fuzz_settings
from tools.torture.meshes import DAE, KINDS, VTK, damage, read, seed

BILLION = 10**9


@pytest.mark.parametrize("extension", KINDS)
def test_damaged_files_give_meshes_or_errors(extension):
    data = seed(extension)
    assert len(read(data, extension).triangles) >= 1

    @fuzz_settings(150)
    @given(st.randoms(use_true_random=False))
    def check(chance):
        read(damage(chance, data), extension)

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
