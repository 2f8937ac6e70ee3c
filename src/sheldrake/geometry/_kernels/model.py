"""What the contact kernels read and fill: the constant model of all proximity geometry, and the table of contacts.

Names: body B, geometry frame G, world W. Geometries are numbered in the order of their ids, so that in every pair A < B
means id_A < id_B.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector
from sheldrake.common.record import Items, Record, array, integer, integers, number, numbers, table

# Shapes, in the order in which pair kernels take them: the lower one comes first.
SPHERE, BOX, CYLINDER, CAPSULE, ELLIPSOID, HULL, HALF_SPACE = range(7)

# Axes of a frame
X_AXIS, Y_AXIS, Z_AXIS = range(3)

# Families of pairs: each has an entry kernel of its own, so that nobody compiles what no pair needs
HALF_SPACES, SPHERES, BOXES, CONVEX = range(4)

# Status of a search
CAPACITY_EXCEEDED = 1

# Directions from the middle of a hull go through the six sides of a cube with so many cells along each edge; few
# vertices are lowest along any direction through a cell. A cell in which DIVIDED or more are, as opposite to a flat
# side of many vertices, is divided into as many parts along each edge.
CELLS = 8
DIVIDED = 16

MAX_POINTS = 6  # contact points of one pair (of a cap; four of other faces)


class Geometry(Record):
    """A shape on a body."""

    kind = integer("SPHERE, BOX, ...")
    body = integer("the body that it is on")
    multi_point = integer("1: pairs of such touch in several points, 0: in one")
    first_vertex = integer("of a hull, in `vertices`")
    num_vertices = integer("of a hull")
    first_face = integer("of a hull, in `faces` and `loops`")
    num_faces = integer("of a hull")
    first_cell = integer("of a hull: place in `topology` where the vertices of each cell start, see CELLS")


class Size(Record):
    """Measures of a shape, and the smallest sphere about it that is known."""

    radius = number("of a sphere, cylinder or capsule", "m")
    radius_y = number("the same again", "m")
    half_length = number("of a cylinder or capsule", "m")
    centre_G = numbers(3, "centre of the bounding sphere in G", "m")
    bound = number("radius of the bounding sphere; infinite for a half space", "m")
    half_sizes = numbers(3, "half extents of a box, ellipsoid or hull", "m", same_as=radius)
    half_along = array(3, "the same, of an axis chosen at run time", "m", same_as=radius)


class Material(Record):
    """What is felt of a geometry in a contact point; NaN where the plant has to supply a value."""

    stiffness = number("of one contact point", "N/m")
    dissipation = number("of Hunt and Crossley", "s/m")
    relaxation_time = number("of linear dissipation", "s")
    friction_static = number("coefficient of friction at rest")
    friction_dynamic = number("coefficient of friction in motion")


class PoseInBody(Record):
    """Pose of a geometry in its body."""

    R_BG = numbers(9, "rotation, row-major")
    p_BG = numbers(3, "position", "m")


class BodyPose(Record):
    """Where a body is."""

    R_WB = numbers(9, "rotation, row-major")
    p_WB = numbers(3, "origin", "m")
    X_WB = numbers((9, 3), "both", "-, m", same_as=R_WB)


@table
class BodyPoses(NamedTuple):
    """Where bodies are."""

    X_WB: Annotated[Matrix, BodyPose]


class Pair(Record):
    """Two geometries that may touch, a < b."""

    a = integer("the first")
    b = integer("the second")


class Margins(Record):
    """How far ahead contact points are seen; see `least_depth`."""

    several_margin = number("of pairs with several points", "m")
    elastic_margin = number("of pairs without dissipation, beside that", "m")
    skin = number("pairs of bounding spheres nearer than this are listed as near, see `near`", "m")


class Families(Record):
    """First pair of each family of pair kernels, in `pairs`."""

    half_space_pairs = integer("a half space and anything")
    sphere_pairs = integer("a sphere and another round or flat shape")
    box_pairs = integer("two boxes")
    convex_pairs = integer("all other pairs")
    end_of_pairs = integer("number of pairs")


class HullVertex(Record):
    """Of a hull."""

    p_GV = numbers(3, "position in G", "m")


class HullFace(Record):
    """Plane of a face of a hull: normal . x <= offset inside."""

    normal = numbers(3, "outward unit normal in G")
    offset = number("of the plane", "m")


class FaceLoop(Record):
    """Where the corners of a face of a hull are."""

    first_corner = integer("place in `topology` of its vertices, counter-clockwise seen from outside")
    num_corners = integer("of the face")
    first_foot = integer("place in `topology` of the four corners that span it best; -1 for a triangle")


class Grid(Record):
    """What close pairs are sought in at each step, see `spatial_hash`."""

    cell_width = number("width of a cell", "m")


@table
class GeometryModel(NamedTuple):
    """All rigid proximity geometry of a scene, constant. `model[g]` is geometry g.

    Attributes:
        cell: of no size when all pairs are listed; else only those with half spaces are, and the others are found in
            cells.
        topology: vertex numbers (rows of `vertex`): per vertex v, `topology[v]` is where its neighbours start and
            `topology[v + 1]` where they end; the same for the faces around v (rows of `face`) from num_vertices + 1 on;
            then neighbours, faces, face corners, feet, and of each hull what `lowest_vertex` reads.
        partner: with cells, `partner[partner[a]:partner[a + 1]]` are the geometries b > a on other bodies that a must
            not touch.
    """

    geometry: Annotated[IntMatrix, Geometry]
    size: Annotated[Matrix, Size]
    material: Annotated[Matrix, Material]
    X_BG: Annotated[Matrix, PoseInBody]
    pair: Annotated[IntMatrix, Items("pairs", Pair)]
    margin: Annotated[Vector, Margins]
    family: Annotated[IntVector, Families]
    vertex: Annotated[Matrix, Items("vertices", HullVertex)]
    face: Annotated[Matrix, Items("faces", HullFace)]
    loop: Annotated[IntMatrix, Items("loops", FaceLoop)]
    topology: IntVector
    cell: Annotated[Vector, Grid]
    partner: IntVector


class ContactPair(Record):
    """Who touches in a contact."""

    geometry_A = integer("the first geometry")
    geometry_B = integer("the second geometry")
    body_A = integer("body of the first")
    body_B = integer("body of the second")
    who = integers(4, "all of these", same_as=geometry_A)


class ContactPoint(Record):
    """Where they touch."""

    p_WCa = numbers(3, "deepest point of A", "m")
    p_WCb = numbers(3, "deepest point of B", "m")
    nhat_BA_W = numbers(3, "unit normal out of B into A")
    depth = number("of the overlap; negative before they touch", "m")
    where = numbers(10, "all of these", same_as=p_WCa)


class Found(Record):
    """How a search went."""

    num_contacts = integer("how many were found")
    status = integer("0 is fine")


class PlacedGeometry(Record):
    """Where a geometry is."""

    R_WG = numbers(9, "rotation, row-major")
    p_WG = numbers(3, "position", "m")
    centre_W = numbers(3, "centre of the bounding sphere", "m")


class Corner(Record):
    """Scratch: of a polygon."""

    p_W = numbers(3, "position", "m")


class Candidate(Record):
    """Scratch: what may become a contact point."""

    p_W = numbers(3, "position", "m")
    depth = number("under a face", "m")
    both = numbers((3, 1), "these", same_as=p_W)


class SimplexVertex(Record):
    """Scratch of GJK and EPA: a vertex of the difference of two shapes."""

    w = numbers(3, "a - b", "m")
    a = numbers(3, "point of the first shape", "m")
    b = numbers(3, "point of the second shape", "m")
    whose = numbers(2, "number of either point among the vertices of its shape")
    points = numbers((3, 3, 3, 2), "all of these", "m, m, m, -", same_as=w)
    weight = number("of a vertex, in a row of its own", same_as=w)


class PolytopeFace(Record):
    """Scratch of EPA: a face of the polytope."""

    normal = numbers(3, "outward unit normal")
    offset = number("distance from the origin", "m")
    exists = number("more than 0 while it does: 1, or its number among those that are kept")


class ShownEdge(Record):
    """Scratch of `polish`: an edge of a shape's feature."""

    edge = numbers(3, "from its farthest point to the other end; of the second shape reversed", "m")
    sign = number("1.0 of the first shape, -1.0 of the second")


class Bend(Record):
    """Scratch of `polish`: radii of curvature of the difference of two shapes."""

    radii = numbers(3, "xx, yy, zz; in the next row xy, xz, yz", "m")


# Rows of ContactTable.work where its parts begin: polygons of at most MAX_CORNERS corners, contact candidates, vertices
# of GJK and EPA (`vertices`; from WEIGHTS on their weights), faces of EPA (`polytope`). `polish` uses the first ones.
POLYGON_A = 0
POLYGON_B = 64
POLYGON_C = 128
CANDIDATE = 192
SIMPLEX = 256
WEIGHTS = 264
FACE = 384
WORK_ROWS = 384 + 256
MAX_CORNERS = 60
MAX_VERTICES = 128
MAX_FACES = 256
MAX_EDGES = 127


class FaceLinks(Record):
    """Scratch of EPA: what is next to a face of the polytope."""

    corners = integers(3, "its vertices, counter-clockwise seen from outside")
    neighbours = integers(3, "faces across its edges, the first edge from corner 0 to corner 1")
    corner = array(3, "the corners, chosen at run time", dtype=int, same_as=corners)
    across = array(3, "the neighbours, chosen at run time", dtype=int, same_as=neighbours)


class HoleEdge(Record):
    """Scratch of EPA: an edge around a hole in the polytope."""

    start = integer("its first vertex")
    end = integer("its second vertex")
    outside = integer("the face that stays")
    inside = integer("the face that is new")


class Remembered(Record):
    """What is remembered of a pair of convex shapes, see `memory`."""

    how = integer("0: nothing; -1: a direction that separates it; -2: that along which it is nearest; n: slot n - 1")
    axis = integer("along which the boxes around the shapes were apart: of the first (0 to 2) or second (3 to 5)")


class Separating(Record):
    """The direction that is remembered, and where a pair was when it was last measured along it."""

    axis_G = numbers(3, "unit vector out of the second shape into the first, in the frame of the first")
    gap = number("how far apart the cores were along it", "m")
    R_AB = numbers(9, "rotation of the second shape in the frame of the first")
    p_AB = numbers(3, "centre of its bounding sphere in that frame", "m")


class NearPairs(Record):
    """Where the families of near pairs begin, see `near`; spheres are the first."""

    near_known = integer("1: there is such a list")
    near_boxes = integer("begin of the family of boxes")
    near_convex = integer("begin of all others")
    end_of_near = integer("number of near pairs")
    near_held = integer("for how many searches the list has held")
    near_doublings = integer("how often the skin is doubled")


class Seen(Record):
    """Where a geometry was when near pairs were listed."""

    centre_W = numbers(3, "centre of the bounding sphere", "m")


# What meets where two shapes overlap least; more than a vertex is an edge or a face in the plane of the face; of curved
# shapes the direction alone is known
NO_FEATURE, FACE_AND_VERTEX, VERTEX_AND_FACE, TWO_EDGES, FACE_ON_MORE, MORE_ON_FACE, BY_DIRECTION = range(7)

SLOT_VERTICES = 32  # of a polytope that is worth remembering
SLOT_FACES = 2 * SLOT_VERTICES - 4


class Slot(Record):
    """What is remembered of a pair that overlaps: a polytope, and what met."""

    owner = integer("number of its pair plus 1; 0 if the slot is free")
    num_vertices = integer("of the polytope; 0 if there is none")
    num_faces = integer("of the polytope")
    feature = integer("FACE_AND_VERTEX of first and second shape, ..., see above")
    face = integer("number of the face, if there is one")
    who = integers(4, "numbers of vertices: of the vertex; or of the edges, the lower one first")


class Tracked(Record):
    """Where a pair was when its polytope was last looked at, and what of that was near; see `tracking`."""

    R_AB = numbers(9, "rotation of the second shape in the frame of the first")
    p_AB = numbers(3, "centre of its bounding sphere in that frame", "m")
    out_A = numbers(3, "direction out of first - second that met")
    turn_A = numbers(3, "how it changed in the last step; 0 where what meets tells it")
    least = number("distance of every face, at least", "m")
    path = number("how far a point of the second, or `out`, may have gone since EPA left the polytope", "m")
    beyond = number("distance of faces that do not look along `out`, at least, where they are not remembered", "m")
    level = array(SLOT_FACES, "path plus distance of each face, when last measured; or - path while it is alike", "m")


class KeptVertex(Record):
    """A vertex of a polytope that is remembered: a vertex of the first shape less one of the second."""

    a = integer("number among the vertices of the first shape")
    b = integer("number among the vertices of the second shape")


class KeptPoint(Record):
    """The same: a point of the first shape less one of the second, each in the frame of its shape."""

    p_AP = numbers(3, "of the first", "m")
    p_BP = numbers(3, "of the second", "m")


MOST_NUMBERED = 2097152  # geometries and contacts: three numbers below it are one integer, see `order`
MANY_PAIRS = 48  # from so many on, near ones are listed
SLOTS = 64  # polytopes that are remembered, at most


@table
class ContactTable(NamedTuple):
    """Contacts found, and scratch to find them. `table[c]` is a contact. Make one with `contact_table()`.

    What is remembered from one search for the next makes it faster and changes nothing in what it finds, but a last
    digit in one of some ten thousand random pairs: it may be set to 0 at any time.

    Attributes:
        remembered: one row a pair of convex shapes; no rows where pairs are found in cells.
        stack: scratch of EPA, faces to be looked at, shape (MAX_FACES,); of no size, as all scratch, without contacts.
        order: scratch of the sort, two permutations of the contacts, shape (capacity, 2).
        near: numbers of the near pairs, see `near`; of no size where that is not worth while.
    """

    pair: Annotated[IntMatrix, ContactPair]
    point: Annotated[Matrix, ContactPoint]
    count: Annotated[IntVector, Found]  # type: ignore[assignment]
    X_WG: Annotated[Matrix, Items("poses", PlacedGeometry)]
    work: Annotated[
        Matrix,
        Items("corners", Corner),
        Items("candidates", Candidate),
        Items("vertices", SimplexVertex),
        Items("polytope", PolytopeFace),
        Items("edges", ShownEdge),
        Items("bends", Bend),
    ]
    link: Annotated[IntMatrix, Items("links", FaceLinks)]
    hole: Annotated[IntMatrix, Items("hole_edges", HoleEdge)]
    stack: IntVector
    order: IntMatrix
    near: IntVector
    near_count: Annotated[IntVector, NearPairs]  # type: ignore[assignment]
    seen: Annotated[Matrix, Items("sights", Seen)]
    remembered: Annotated[IntMatrix, Items("memories", Remembered)]
    separating: Annotated[Matrix, Items("separators", Separating)]
    slot: Annotated[IntMatrix, Items("slots", Slot)]
    tracked: Annotated[Matrix, Items("tracks", Tracked)]
    kept_vertex: Annotated[IntMatrix, Items("kept_vertices", KeptVertex)]
    kept_point: Annotated[Matrix, Items("kept_points", KeptPoint)]
    kept_link: Annotated[IntMatrix, Items("kept_links", FaceLinks)]


def _num_between_solids(model: GeometryModel) -> int:
    """How many pairs have no half space."""
    return int(model.family[Families.end_of_pairs] - model.family[Families.sphere_pairs])


def is_watched(model: GeometryModel) -> bool:
    """Whether near pairs are listed."""
    return len(model.cell) == 0 and _num_between_solids(model) >= MANY_PAIRS


def contact_table(model: GeometryModel, capacity: int | None = None, slots: int = SLOTS) -> ContactTable:
    """An empty table for a model.

    Args:
        model: the geometry.
        capacity: most contacts it can hold; by default enough for every pair to touch, at most 65536 or 16 a
            geometry. Without room for any there is no scratch to find them.
        slots: most polytopes that it can remember.

    Raises:
        ValueError: if there are more than MOST_NUMBERED geometries or contacts.
    """
    if capacity is None:
        n = len(model.geometry)
        pairs = len(model.pair) + (n * (n - 1) // 2 if len(model.cell) else 0)
        capacity = min(MAX_POINTS * pairs, max(65536, 16 * n))
    convex = int(model.family[Families.end_of_pairs] - model.family[Families.convex_pairs])
    if max(len(model.geometry), capacity) > MOST_NUMBERED:
        raise ValueError(
            f"contact_table(): there is room for {MOST_NUMBERED} geometries and contacts, "
            f"not for {len(model.geometry)} and {capacity}."
        )
    slots = min(convex, slots)
    searched = int(capacity > 0)  # the scratch takes 75 kB, in each context
    watched = _num_between_solids(model) if is_watched(model) else 0
    return ContactTable(
        pair=np.zeros((capacity, ContactPair.SIZE), np.int64),
        point=np.zeros((capacity, ContactPoint.SIZE)),
        count=np.zeros(Found.SIZE, np.int64),
        X_WG=np.zeros((model.geometry.shape[0], PlacedGeometry.SIZE)),
        work=np.zeros((searched * WORK_ROWS, SimplexVertex.SIZE)),
        link=np.zeros((searched * MAX_FACES, FaceLinks.SIZE), np.int64),
        hole=np.zeros((searched * MAX_EDGES, HoleEdge.SIZE), np.int64),
        stack=np.zeros(searched * MAX_FACES, np.int64),
        order=np.zeros((capacity, 2), np.int64),
        near=np.zeros(watched, np.int64),
        near_count=np.zeros(NearPairs.SIZE, np.int64),
        seen=np.zeros((len(model.geometry) if watched else 0, Seen.SIZE)),
        remembered=np.zeros((convex, Remembered.SIZE), np.int64),
        separating=np.zeros((convex, Separating.SIZE)),
        slot=np.zeros((slots, Slot.SIZE), np.int64),
        tracked=np.zeros((slots, Tracked.SIZE)),
        kept_vertex=np.zeros((slots * SLOT_VERTICES, KeptVertex.SIZE), np.int64),
        kept_point=np.zeros((slots * SLOT_VERTICES, KeptPoint.SIZE)),
        kept_link=np.zeros((slots * SLOT_FACES, FaceLinks.SIZE), np.int64),
    )


def empty_geometry_model() -> GeometryModel:
    """A model without geometry, for a plant that has no SceneGraph."""
    return GeometryModel(
        geometry=np.zeros((0, Geometry.SIZE), np.int64),
        size=np.zeros((0, Size.SIZE)),
        material=np.zeros((0, Material.SIZE)),
        X_BG=np.zeros((0, PoseInBody.SIZE)),
        pair=np.zeros((0, Pair.SIZE), np.int64),
        margin=np.zeros(Margins.SIZE),
        family=np.zeros(Families.SIZE, np.int64),
        vertex=np.zeros((0, HullVertex.SIZE)),
        face=np.zeros((0, HullFace.SIZE)),
        loop=np.zeros((0, FaceLoop.SIZE), np.int64),
        topology=np.zeros(2, np.int64),
        cell=np.zeros(0),
        partner=np.zeros(0, np.int64),
    )
