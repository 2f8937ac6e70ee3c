"""What the renderer's kernels read and fill: surfaces, how they look, and the pictures.

Frames: geometry G of an item, camera C (x right, y down, z forward). An item is a registered geometry; its surface is
made of triangles (`face`) and of exact curved patches: bands of quadrics x^2/a^2 + y^2/b^2 + (z - z0)^2/c^2 = 1 (the
last term may be absent) and discs.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector
from sheldrake.common.record import Items, Record, integer, integers, number, numbers, table

QUADRIC, DISC = range(2)  # kinds of patches
DIRECTIONAL, POINT, SPOT = range(3)  # kinds of lights
DEPTHS, LABELS, COLOURS = range(3)  # what a picture shows


class ItemParts(Record):
    """Where a registered geometry is in the arrays; the next row tells where it ends."""

    first_vertex = integer("in `vertices`")
    first_face = integer("in `faces`")
    first_patch = integer("in `patches`")
    label = integer("what label pictures show")


class Face(Record):
    """A triangle."""

    corners = integers(3, "in `vertices`")
    item = integer("of which it is")
    material = integer("of `materials`")


class Vertex(Record):
    """Of triangles."""

    p_GV = numbers(3, "position in G", "m")
    normal = numbers(3, "in G, of any length")
    texture = numbers(2, "u and v, v upwards")
    colour = numbers(3, "red, green, blue in [0, 1]")


class Patch(Record):
    """A curved patch."""

    squares = numbers(3, "quadric: 1/a^2, 1/b^2, 1/c^2 or 0", "1/m^2")
    z0 = number("height of the quadric's centre, or of the disc", "m")
    low = number("quadric: least z", "m")
    high = number("quadric: largest z; disc: radius", "m")
    half_x = number("half size of a box about the axis that holds the patch", "m")
    half_y = number("half size of that box", "m")
    bottom = number("least z of that box", "m")
    top = number("largest z of that box", "m")
    wrap_from = number("z from which on a texture is wrapped about the axis", "m")
    wrap_to = number("z where that ends; equal: it lies by longitude and latitude", "m")


class PatchKind(Record):
    """What a patch is."""

    kind = integer("QUADRIC or DISC")
    item = integer("of which it is")
    material = integer("of `materials`")


class Paint(Record):
    """How a surface looks."""

    diffuse = numbers(3, "red, green, blue")
    opacity = number("1: nothing is seen through it")
    first_texel = number("in `texel`; negative without texture")
    texture_width = number("texels")
    texture_height = number("texels")
    smooth = number("1: normals of the vertices, 0: of the triangles")
    repeat = number("1: the texture repeats beyond its edges")
    even = number("1: a triangle of it has one colour and one normal")


class Light(Record):
    """A source of light."""

    kind = number("DIRECTIONAL, POINT or SPOT")
    colour = numbers(3, "red, green, blue, times intensity")
    p_CL = numbers(3, "position in C", "m")
    direction = numbers(3, "unit vector in C")
    attenuation = numbers(3, "factors of the distance to the powers 0, 1, 2")
    cone = number("cosine of half of a spot's opening")


class Camera(Record):
    """What is seen where, and how far."""

    focal_x = number("focal length", "pixels")
    focal_y = number("focal length", "pixels")
    centre_x = number("principal point", "pixels")
    centre_y = number("principal point", "pixels")
    near = number("clipping plane", "m")
    far = number("clipping plane", "m")
    least = number("least depth that is measured", "m")
    most = number("largest depth that is measured", "m")


class PoseInCamera(Record):
    """Where an item is."""

    R_CG = numbers(9, "rotation, row-major")
    p_CG = numbers(3, "position", "m")


class PlacedVertex(Record):
    """Where a vertex is."""

    p_CV = numbers(3, "position", "m")


class Nothing(Record):
    """What is not there."""

    empty_pixel = integer("what a pixel without anything is, a label or a packed colour")


@table
class Surfaces(NamedTuple):
    """Surfaces in their geometries' frames. `item` has one row more than there are items."""

    item: Annotated[IntMatrix, Items("items", ItemParts)]
    face: Annotated[IntMatrix, Items("faces", Face)]
    vertex: Annotated[Matrix, Items("vertices", Vertex)]
    patch: Annotated[Matrix, Items("patches", Patch)]
    patch_kind: Annotated[IntMatrix, Items("patch_kinds", PatchKind)]


@table
class Look(NamedTuple):
    """Materials, and the texels of all textures, row by row from the top, as r + 256 g + 65536 b."""

    material: Annotated[Matrix, Items("materials", Paint)]
    texel: IntVector


@table
class Scene(NamedTuple):
    """What differs from one picture to the next.

    Attributes:
        opaque: Items to draw, in any order.
        translucent: Items to draw over them, the farthest first.
        corner: Filled: vertices in C.
    """

    camera: Annotated[Vector, Camera]
    X_CG: Annotated[Matrix, Items("poses", PoseInCamera)]
    light: Annotated[Matrix, Items("lights", Light)]
    opaque: IntVector
    translucent: IntVector
    empty: Annotated[IntVector, Nothing]
    corner: Annotated[Matrix, Items("corners", PlacedVertex)]


class Screen(NamedTuple):
    """A picture in the making, shape (height, width) each.

    Attributes:
        nearness: 1 / z of what is seen [1/m]; in the end, of a depth picture, z itself [m].
        seen: Row of `face`, or number of faces plus row of `patch`, or -1; in the end labels, or colours as
            r + 256 g + 65536 b + 16777216 a.
    """

    nearness: Matrix
    seen: IntMatrix
