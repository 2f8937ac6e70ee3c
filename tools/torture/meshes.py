"""Mesh files with faults: what they are made of, and what reading one has to keep to."""

from __future__ import annotations

import functools
import random
import time

import numpy as np
from tools.torture.documents import LIMIT, expand

from sheldrake.common import MemoryFile
from sheldrake.geometry import InMemoryMesh
from sheldrake.geometry._meshes.mesh_files import MeshData, read_mesh
from sheldrake.geometry._meshes.mesh_source import MeshSource

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
KINDS = (".obj", ".stl", ".ply", ".gltf", ".glb", ".dae", ".vtk")

_NUMBERS = {
    "x": ["0", "1", "-1", "0.5", "1e-3", "2.5e3", "-0", ".5", "1e308", "1e999", "nan", "inf", "x", ""],
    "i": ["1", "2", "3", "4", "0", "-1", "-9", "7", "99999999999999999999", "2147483648", "1.5", "x"],
    "n": ["0", "1", "2", "3", "4", "5", "9", "1000000000", "-1", "x"],
    "p": ["$x $x $x\n"],
    "points": ["", "$p$points", "$p$points", "$p$points"],
}
RULES: dict[str, dict[str, list[str]]] = {
    ".obj": _NUMBERS | {
        "file": ["$box", "$box$lines"],
        "box": ["v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"],
        "lines": ["$line", "$line$lines", "$line$lines", "$line$lines", "$line$lines"],
        "line": ["f $c $c $c\n", "f $c $c $c $c\n", "f $c\n", "v $p", "v $x $x\n", "v $x $x $x $x $x $x\n",
                 "vn $p", "vt $x $x\n", "o $i\n", "g\n", "usemtl $i\n", "mtllib none.mtl\n", "l $i $i\n", "s off\n",
                 "# $x\n", "\\\n", "f 1 2 \\\n 3\n", "curv $x\n"],
        "c": ["$i", "$i/$i", "$i//$i", "$i/$i/$i", "$i/", "/"],
    },
    ".stl": _NUMBERS | {
        "file": ["solid a\n${facets}endsolid a\n", "solid\n$facets", "$facets",
                 "solid a\n${facets}endsolid\nsolid b\n"],
        "facets": ["", "$facet$facets", "$facet$facets", "$facet$facets"],
        "facet": ["facet normal ${p}outer loop\n$v$v${v}endloop\nendfacet\n", "facet\nouter loop\n$v${v}endloop\n"],
        "v": ["vertex $p", "vertex $p", "vertex $x\n"],
    },
    ".ply": _NUMBERS | {
        "file": ["ply\nformat ascii 1.0\n${elements}end_header\n$points$faces", "ply\n${elements}end_header\n"],
        "elements": ["", "$element$elements", "$element$elements"],
        "element": ["element vertex $n\n$xyz", "element face $n\nproperty list uchar int vertex_indices\n",
                    "element $x $n\n", "comment $x\n", "property list $type $type $x\n"],
        "xyz": ["property float x\nproperty float y\nproperty float z\n", "property $type x\n"],
        "type": ["float", "double", "int", "uchar", "quad"],
        "faces": ["", "3 $i $i $i\n$faces", "$n $i $i $i\n$faces"],
    },
    ".vtk": _NUMBERS | {
        "file": ["# vtk DataFile Version $x\nt\n$form\nDATASET $set\n$parts"],
        "form": ["ASCII", "ASCII", "ASCII", "BINARY", ""],
        "set": ["UNSTRUCTURED_GRID", "UNSTRUCTURED_GRID", "POLYDATA", "$x"],
        "parts": ["", "$part$parts", "$part$parts", "$part$parts"],
        "part": ["POINTS $n $type\n$points", "CELLS $n $n\n$cells", "CELL_TYPES $n\n10\n10\n", "CELL_TYPES $n\n$n\n",
                 "POINTS 4 double\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n", "CELLS 1 5\n4 0 1 2 3\n", "CELL_TYPES 1\n10\n",
                 "POINT_DATA $n\nSCALARS $x $type\n", "METADATA\n\n"],
        "cells": ["", "4 $i $i $i $i\n$cells", "$n $i $i\n$cells"],
        "type": ["double", "float", "int", "bit"],
    },
    ".gltf": _NUMBERS | {
        "file": ['{"asset": {"version": "2.0"}, "scene": $n, "scenes": [{"nodes": [$n]}], "nodes": [$nodes], '
                 '"meshes": [$meshes], "accessors": [$accessor, $accessor], "bufferViews": [$view, $view], '
                 '"buffers": [$buffer]}'],
        "nodes": ['{"mesh": $n}', '{"mesh": 0, "children": [$n]}', '{"children": [$n]}, {"mesh": 0}',
                  '{"mesh": 0, "matrix": [$n, $n]}', '{"mesh": 0, "rotation": [$n, 0, 0, $n]}', "null"],
        "meshes": ['{"primitives": [{"attributes": {"POSITION": $n}, "indices": $n}]}', "{}",
                   '{"primitives": [{"attributes": {"POSITION": 0}, "mode": $n}]}', '{"primitives": [$n]}'],
        "accessor": ['{"bufferView": $n, "componentType": 5126, "count": $n, "type": "VEC3"}', "null",
                     '{"bufferView": $n, "componentType": 5125, "count": $n, "type": "SCALAR"}',
                     '{"bufferView": 0, "byteOffset": $n, "componentType": $n, "count": $n, "type": "VEC$n"}'],
        "view": ['{"buffer": $n, "byteLength": $n}', '{"buffer": 0, "byteOffset": $n, "byteLength": 36}',
                 '{"buffer": 0, "byteLength": 12, "byteStride": $n}', "[]"],
        "buffer": ['{"byteLength": $n, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAA"}',
                   '{"byteLength": 36, "uri": "none.bin"}', '{"byteLength": 36, "uri": "../../../etc/passwd"}', "{}"],
        "n": ["0", "1", "2", "3", "36", "-1", "1000000000", "1.5", '"0"', "null", "true", "[]"],
    },
}  # fmt: skip


@functools.cache
def seed(kind: str) -> bytes:
    """A file that is fine: a box, a triangle, a tetrahedron."""
    import trimesh

    if kind in (".vtk", ".dae"):
        return (VTK if kind == ".vtk" else DAE).encode()
    if kind == ".gltf":
        return trimesh.exchange.gltf.export_gltf(trimesh.Scene(trimesh.creation.box()), embed_buffers=True)[
            "model.gltf"
        ]
    data = trimesh.creation.box().export(file_type=kind[1:])
    return data if isinstance(data, bytes) else data.encode()


def read(data: bytes, kind: str) -> MeshData | None:
    """The mesh, or None after a RuntimeError that names it; in time."""
    source, start = MeshSource(InMemoryMesh(mesh_file=MemoryFile(data, kind, "shape"))), time.process_time()
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


def damage(chance: random.Random, data: bytes) -> bytes:
    """Bytes after one to three changes: some are overwritten, left out, doubled, or the end is missing."""
    for _ in range(chance.randint(1, 3)):
        start = chance.randint(0, len(data))
        end = min(len(data), start + chance.randint(0, 20))
        new = chance.choice([b"", b"9" * 9, b"-1", b"nan", b"\xff\xff\xff\x7f", data[start:end] * 2])
        data = data[:start] + new + (b"" if chance.randint(0, 9) == 0 else data[end:])
    return data


def some_file(chance: random.Random) -> tuple[bytes, str]:
    """A file and its kind: one that is fine with some bytes changed, or one made by the rules of its kind."""
    kind = chance.choice(KINDS)
    if kind in RULES and chance.random() < 0.6:
        data = expand(chance, RULES[kind], "file").encode()
        return (damage(chance, data) if chance.random() < 0.2 else data), kind
    return damage(chance, seed(kind)), kind
