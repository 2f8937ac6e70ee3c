"""What the renderer's kernels read and fill: surfaces, how they look, and the pictures.

Frames: geometry G of an item, camera C (x right, y down, z forward). An item is a registered geometry; its surface is
made of triangles (`face`) and of exact curved patches: bands of quadrics x^2/a^2 + y^2/b^2 + (z - z0)^2/c^2 = 1 (the
last term may be absent) and discs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector

# Columns of Surfaces.item
FIRST_VERTEX = np.int64(0)
FIRST_FACE = np.int64(1)
FIRST_PATCH = np.int64(2)  # the next row tells where each ends
LABEL = np.int64(3)
ITEM_COLUMNS = 4

# Columns of Surfaces.face: three vertices, then
FACE_ITEM = np.int64(3)
FACE_MATERIAL = np.int64(4)
FACE_COLUMNS = 5

# Columns of Surfaces.vertex
NORMAL = np.int64(3)  # after the position in G [m]
TEXTURE = np.int64(6)  # (u, v), v upwards
COLOUR = np.int64(8)  # red, green, blue in [0, 1]
VERTEX_COLUMNS = 11

# Columns of Surfaces.patch
X2 = np.int64(0)  # quadric: 1/a^2, 1/b^2, 1/c^2 or 0 [1/m^2]
Z0 = np.int64(3)  # height of the quadric's centre, or of the disc [m]
LOW = np.int64(4)  # quadric: least and largest z [m]; disc: -, radius
HIGH = np.int64(5)
HALF_X = np.int64(6)  # half sizes of a box about the axis that holds the patch [m]
HALF_Y = np.int64(7)
BOTTOM = np.int64(8)  # and its extent in z [m]
TOP = np.int64(9)
WRAP_FROM = np.int64(10)  # z between which a texture is wrapped about the axis; equal: by longitude and latitude
WRAP_TO = np.int64(11)
PATCH_COLUMNS = 12

# Columns of Surfaces.patch_kind
KIND = np.int64(0)
PATCH_ITEM = np.int64(1)
PATCH_MATERIAL = np.int64(2)
PATCH_KIND_COLUMNS = 3
QUADRIC = np.int64(0)
DISC = np.int64(1)

# Columns of Look.material
DIFFUSE = np.int64(0)  # red, green, blue, opacity
FIRST_TEXEL = np.int64(4)  # of `texel`; negative without texture
TEXTURE_WIDTH = np.int64(5)
TEXTURE_HEIGHT = np.int64(6)
SMOOTH = np.int64(7)  # 1: normals of the vertices, 0: of the triangles
REPEAT = np.int64(8)  # 1: the texture repeats beyond its edges
EVEN = np.int64(9)  # 1: a triangle of it has one colour and one normal
MATERIAL_COLUMNS = 10

# Columns of Look.light
LIGHT_KIND = np.int64(0)
LIGHT_COLOUR = np.int64(1)  # times intensity
LIGHT_POSITION = np.int64(4)  # in C [m]
LIGHT_DIRECTION = np.int64(7)  # unit vector in C
ATTENUATION = np.int64(10)  # of the distance to the powers 0, 1, 2
CONE = np.int64(13)  # cosine of half of a spot's opening
LIGHT_COLUMNS = 14
DIRECTIONAL, POINT, SPOT = np.int64(0), np.int64(1), np.int64(2)

# Camera
FOCAL = np.int64(0)  # x and y [pixels]
CENTRE = np.int64(2)  # principal point [pixels]
NEAR = np.int64(4)  # clipping planes [m]
FAR = np.int64(5)
LEAST = np.int64(6)  # depths that are measured [m]
MOST = np.int64(7)
CAMERA_NUMBERS = 8

# What a picture shows
DEPTHS, LABELS, COLOURS = np.int64(0), np.int64(1), np.int64(2)


class Surfaces(NamedTuple):
    """Surfaces in their geometries' frames; see the columns above. `item` has one row more than there are items."""

    item: IntMatrix
    face: IntMatrix
    vertex: Matrix
    patch: Matrix
    patch_kind: IntMatrix


class Look(NamedTuple):
    """Materials, and the texels of all textures, row by row from the top, as r + 256 g + 65536 b."""

    material: Matrix
    texel: IntVector


class Scene(NamedTuple):
    """What differs from one picture to the next.

    Attributes:
        camera: See CAMERA_NUMBERS.
        X_CG: Poses of the items, R_CG row-major then p_CG [m], shape (items, 12).
        light: Lights in C.
        opaque: Items to draw, in any order.
        translucent: Items to draw over them, the farthest first.
        empty: One number: what a pixel without anything is, a label or a packed colour.
        corner: Filled: positions of the vertices in C [m], shape (vertices, 3).
    """

    camera: Vector
    X_CG: Matrix
    light: Matrix
    opaque: IntVector
    translucent: IntVector
    empty: IntVector
    corner: Matrix


class Screen(NamedTuple):
    """A picture in the making, shape (height, width) each.

    Attributes:
        nearness: 1 / z of what is seen [1/m]; in the end, of a depth picture, z itself [m].
        seen: Row of `face`, or number of faces plus row of `patch`, or -1; in the end labels, or colours as
            r + 256 g + 65536 b + 16777216 a.
    """

    nearness: Matrix
    seen: IntMatrix
