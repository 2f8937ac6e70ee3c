"""What the kernels of hydroelastic contact read and fill: meshes with their trees, and the contact surfaces found.

Names: geometries M and N of a surface with id_M < id_N, frame G of a geometry, world W. Geometries are numbered as in
`GeometryModel`.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from sheldrake.common.kernel import IntMatrix, IntVector, Matrix
from sheldrake.common.record import Items, Record, array, integer, integers, number, numbers, table

# Families of pairs: a compliant mesh and a rigid half space, ...
MESH_ON_RIGID_HALF_SPACE, RIGID_MESH_ON_HALF_SPACE, COMPLIANT_AND_RIGID, COMPLIANT_AND_COMPLIANT = range(4)

NO_ROOM = 1  # status of a search


class Mesh(Record):
    """Where the mesh of a geometry is."""

    first_element = integer("in `elements` and `fields`")
    first_vertex = integer("in `vertices`")
    first_node = integer(
        "in `nodes`: the root; node k after it has the children 2 k + 1 and 2 k + 2; then as many of each thinner part"
    )
    first_leaf = integer("in `leaf`")
    num_leaves = integer("a power of two: nodes from num_leaves - 1 on are leaves; 0 of a half space")


class Compliance(Record):
    """How soft a geometry is."""

    modulus = number("hydroelastic modulus, infinite for rigid geometry", "Pa")
    slope = number("of a compliant half space: pressure over depth", "Pa/m")
    margin = number("of a compliant half space", "m")
    bound = number(
        "radius of a sphere about the geometry's bounding centre that holds it, infinite of a half space", "m"
    )


class MeshVertex(Record):
    """Of a triangle or tetrahedron."""

    p_GV = numbers(3, "position in G", "m")
    pressure = number("there", "Pa")


class Element(Record):
    """A triangle or tetrahedron."""

    corners = integers(4, "its vertices; -1 the last of a triangle")
    corner = array(4, "the same, chosen at run time", dtype=int, same_as=corners)


class Field(Record):
    """What is in an element: of a tetrahedron a pressure gradient . p_GQ + at_origin."""

    gradient = numbers(3, "of the pressure in a tetrahedron", "Pa/m")
    at_origin = number("pressure of a tetrahedron at Go", "Pa")
    planes = array((4, 4), "of the faces of a tetrahedron: outward unit normal, and offset [m]")
    pressure = numbers(4, "gradient and value at Go", "Pa/m, Pa", same_as=gradient)
    normal = numbers(3, "outward unit normal of a triangle", same_as=gradient)


class Node(Record):
    """An axis-aligned box in G."""

    centre = numbers(3, "of the box", "m")
    half_sizes = numbers(3, "of the box; negative of a box of nothing", "m")


NUM_PARTS = 4


class Part(Record):
    """What of a compliant mesh has at most some pressure, and the core about which it lies. The first part is all."""

    pressure = number("the most there is in it", "Pa")
    reach = number("radius of a sphere about the geometry's bounding centre that holds the core", "m")
    centre = numbers(3, "of a box in G that holds the core", "m")
    half_sizes = numbers(3, "of that box; negative if there is no core", "m")


class Pair(Record):
    """Two geometries whose surface is sought."""

    i = integer("of the kind that comes first in the family's name")
    j = integer("of the other")


class Families(Record):
    """First pair of each family, in `pairs`."""

    on_rigid_half_space = integer("a compliant mesh and a rigid half space")
    on_half_space = integer("a rigid mesh and a compliant half space")
    with_rigid = integer("a compliant and a rigid mesh")
    with_compliant = integer("two compliant meshes")
    end_of_pairs = integer("number of pairs")


class Choices(Record):
    """What is made."""

    triangles = integer("1: surfaces of triangles, 0: of polygons")


@table
class HydroModel(NamedTuple):
    """Hydroelastic representations of a scene's geometry, constant. `model[g]` is geometry g.

    Attributes:
        part: those of geometry g from row `NUM_PARTS` g on.
        leaf: element of each leaf, -1 for none, shape (num_leaves,).
    """

    geometry: Annotated[IntMatrix, Mesh]
    number: Annotated[Matrix, Compliance]
    part: Annotated[Matrix, Items("parts", Part)]
    vertex: Annotated[Matrix, Items("vertices", MeshVertex)]
    element: Annotated[IntMatrix, Items("elements", Element)]
    field: Annotated[Matrix, Items("fields", Field)]
    node: Annotated[Matrix, Items("nodes", Node)]
    leaf: IntVector
    pair: Annotated[IntMatrix, Items("pairs", Pair)]
    family: Annotated[IntVector, Families]
    setting: Annotated[IntVector, Choices]


class Found(Record):
    """How a search went."""

    num_surfaces = integer("how many were found")
    num_faces = integer("of all surfaces")
    num_vertices = integer("of all faces")
    status = integer("0 is fine; NO_ROOM")


class Surface(Record):
    """The contact surface of two geometries."""

    geometry_M = integer("the first geometry")
    geometry_N = integer("the second geometry")
    first_face = integer("the others follow it")


class Face(Record):
    """A polygon or triangle of a surface."""

    surface = integer("of which it is a face, in `patches`")
    num_corners = integer("of the face")
    corners = integers(3, "its first corners; a polygon's others follow the first")


class FaceValue(Record):
    """What is measured of a face."""

    normal = numbers(3, "unit normal in W, out of N into M")
    area = number("of the face", "m^2")
    p_WC = numbers(3, "its centroid", "m")
    pressure = number("at the centroid", "Pa")
    gradient_M = numbers(3, "of the pressure of M, in W; zero where rigid", "Pa/m")
    gradient_N = numbers(3, "of the pressure of N, in W; zero where rigid", "Pa/m")


class FaceVertex(Record):
    """A corner of faces."""

    p_WV = numbers(3, "position", "m")
    pressure = number("there", "Pa")


class Corner(Record):
    """Scratch: of a polygon at hand."""

    p = numbers(3, "position in the frame of a mesh", "m")


class Cut(Record):
    """Scratch: a plane that cuts the polygon at hand."""

    normal = numbers(3, "of the plane, outward")
    offset = number("normal . x in the plane", "m")
    side = number("of its normal along the polygon's; the sign counts")


class NodePair(Record):
    """Scratch: two nodes still to be looked at."""

    nodes = integers(2, "of the trees of two geometries, 0 is the root")


# Where polygons begin in HydroTable.work
FIRST_POLYGON = 0
SECOND_POLYGON = 16
WORK_ROWS = 32
STACK_SIZE = 256


@table
class HydroTable(NamedTuple):
    """Contact surfaces found, and scratch to find them. `table[f]` is a face. Make one with `hydro_table()`.

    Attributes:
        contact: number of the contact that a plant makes of a face, -1 for none, shape (capacity,).
    """

    count: Annotated[IntVector, Found]  # type: ignore[assignment]
    surface: Annotated[IntMatrix, Items("patches", Surface)]
    face: Annotated[IntMatrix, Face]
    value: Annotated[Matrix, FaceValue]
    vertex: Annotated[Matrix, Items("vertices", FaceVertex)]
    contact: IntVector
    work: Annotated[Matrix, Items("corners", Corner)]
    plane: Annotated[Matrix, Items("cuts", Cut)]
    stack: Annotated[IntMatrix, Items("waiting", NodePair)]


def hydro_table(model: HydroModel, capacity: int) -> HydroTable:
    """An empty table for a model with room for a number of faces."""
    if len(model.pair) == 0:
        capacity = 0
    vertices = 2 * capacity if model.setting[Choices.triangles] else 6 * capacity
    some = int(len(model.pair) > 0)
    return HydroTable(
        count=np.zeros(Found.SIZE, np.int64),
        surface=np.zeros((len(model.pair), Surface.SIZE), np.int64),
        face=np.zeros((capacity, Face.SIZE), np.int64),
        value=np.zeros((capacity, FaceValue.SIZE)),
        vertex=np.zeros((vertices, FaceVertex.SIZE)),
        contact=np.zeros(capacity, np.int64),
        work=np.zeros((some * WORK_ROWS, Corner.SIZE)),
        plane=np.zeros((some * 4, Cut.SIZE)),
        stack=np.zeros((some * STACK_SIZE, NodePair.SIZE), np.int64),
    )


def empty_hydro_model() -> HydroModel:
    """A model without hydroelastic geometry."""
    return HydroModel(
        geometry=np.zeros((0, Mesh.SIZE), np.int64),
        number=np.zeros((0, Compliance.SIZE)),
        part=np.zeros((0, Part.SIZE)),
        vertex=np.zeros((0, MeshVertex.SIZE)),
        element=np.zeros((0, Element.SIZE), np.int64),
        field=np.zeros((0, Field.SIZE)),
        node=np.zeros((0, Node.SIZE)),
        leaf=np.zeros(0, np.int64),
        pair=np.zeros((0, Pair.SIZE), np.int64),
        family=np.zeros(Families.SIZE, np.int64),
        setting=np.zeros(Choices.SIZE, np.int64),
    )
