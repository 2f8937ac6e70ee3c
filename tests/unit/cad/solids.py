"""Solids with known volume and inertia, and writers of mesh files, for tests."""

from __future__ import annotations

import io
import struct
import zipfile

import numpy as np


def extruded(outline, height, holes=()):
    """A prism over a polygon (counter-clockwise, shape (n, 2)) with holes (clockwise), as vertices and triangles.

    Walls are exact; the ends are fans that are only good for star-shaped outlines, or rings when there is a hole of as
    many corners as the outline.
    """
    outline = np.asarray(outline, dtype=float)
    n = len(outline)
    if not holes:
        ring = np.concatenate([outline, outline]), np.repeat([0.0, height], n)
        vertices = np.column_stack(ring)
        vertices = np.concatenate([vertices, [[*outline.mean(axis=0), 0.0], [*outline.mean(axis=0), height]]])
        i = np.arange(n)
        j = (i + 1) % n
        walls = [np.stack([i, j, j + n], 1), np.stack([i, j + n, i + n], 1)]
        ends = [np.stack([j, i, np.full(n, 2 * n)], 1), np.stack([i + n, j + n, np.full(n, 2 * n + 1)], 1)]
        return vertices, np.concatenate(walls + ends)
    (hole,) = holes
    assert len(hole) == n
    vertices = np.concatenate([np.column_stack([p, np.full(n, z)]) for z in (0.0, height) for p in (outline, hole)])
    i = np.arange(n)
    j = (i + 1) % n
    a, b, c, d = 0, n, 2 * n, 3 * n  # outline and hole below, outline and hole above
    quads = [(a + i, a + j, c + j, c + i), (b + j, b + i, d + i, d + j), (a + j, a + i, b + i, b + j),
             (c + i, c + j, d + j, d + i)]  # fmt: skip
    triangles = [t for q in quads for t in (np.stack([q[0], q[1], q[2]], 1), np.stack([q[0], q[2], q[3]], 1))]
    return vertices, np.concatenate(triangles)


def box(x, y, z):
    """A box with one corner in the origin."""
    vertices, triangles = extruded([[0, 0], [x, 0], [x, y], [0, y]], z)
    return vertices, triangles


def polygon(n, radius):
    angles = 2.0 * np.pi * np.arange(n) / n
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])


def ascii_stl(*named):
    lines = []
    for name, (vertices, triangles) in named:
        lines.append(f"solid {name}")
        for corners in vertices[triangles]:
            lines += ["facet normal 0 0 0", "outer loop"]
            lines += ["vertex {!r} {!r} {!r}".format(*map(float, corner)) for corner in corners]
            lines += ["endloop", "endfacet"]
        lines.append(f"endsolid {name}")
    return "\n".join(lines).encode()


def binary_stl(vertices, triangles, header=b"", count=None):
    data = header.ljust(80, b" ") + struct.pack("<I", len(triangles) if count is None else count)
    for corners in vertices[triangles]:
        data += struct.pack("<12fH", 0, 0, 0, *corners.reshape(-1), 0)
    return data


def obj(vertices, triangles, comment=""):
    lines = [f"# {comment}"] + ["v {!r} {!r} {!r}".format(*v) for v in np.asarray(vertices).tolist()]
    return "\n".join(lines + ["f {} {} {}".format(*(t + 1)) for t in triangles]).encode()


def ply(vertices, triangles, count=None):
    lines = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    lines += [f"property double {axis}" for axis in "xyz"]
    lines += [f"element face {len(triangles) if count is None else count}"]
    lines += ["property list uchar int vertex_indices", "end_header"]
    lines += ["{!r} {!r} {!r}".format(*v) for v in np.asarray(vertices).tolist()]
    return "\n".join(lines + ["3 {} {} {}".format(*t) for t in triangles] + [""]).encode()


def dae(vertices, triangles, meter="0.001"):
    numbers = " ".join(repr(float(x)) for x in np.asarray(vertices).reshape(-1))
    corners = " ".join(str(int(t)) for t in np.asarray(triangles).reshape(-1))
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="{meter}" name="unit"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="{3 * len(vertices)}">{numbers}</float_array>
<technique_common><accessor source="#a" count="{len(vertices)}" stride="3"/></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="{len(triangles)}"><input semantic="VERTEX" source="#v" offset="0"/><p>{corners}</p></triangles>
</mesh></geometry></library_geometries></COLLADA>""".encode()


def threemf(vertices, triangles, unit='unit="inch"', transform=""):
    points = "".join('<vertex x="{!r}" y="{!r}" z="{!r}"/>'.format(*v) for v in np.asarray(vertices).tolist())
    corners = "".join('<triangle v1="{}" v2="{}" v3="{}"/>'.format(*t) for t in triangles)
    model = f"""<?xml version="1.0"?><model {unit} xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<resources><object id="1" type="model">
<mesh><vertices>{points}</vertices><triangles>{corners}</triangles></mesh></object>
<object id="2" type="model"><components><component objectid="1" {transform}/></components></object></resources>
<build><item objectid="2"/></build></model>"""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/3dmodel.model", model)
    return file.getvalue()


def write_box(path, *sides):
    """A .obj file of a box with a corner at the origin; returns its path."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * sides
    faces = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
    lines = ["v {} {} {}".format(*corner) for corner in corners] + [f"f {face}" for face in faces]
    path.write_text("\n".join(lines))
    return str(path)
