"""What the contact kernels read and fill: the constant model of all proximity geometry, and the table of contacts.

Names: body B, geometry frame G, world W. Row i of `geometry`, `size`, `material` and `X_BG` is geometry i; geometries
are numbered in the order of their ids, so that in every pair A < B means id_A < id_B.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector

# Shapes, in the order in which pair kernels take them: the lower one comes first.
SPHERE = np.int64(0)
BOX = np.int64(1)
CYLINDER = np.int64(2)
CAPSULE = np.int64(3)
ELLIPSOID = np.int64(4)
HULL = np.int64(5)
HALF_SPACE = np.int64(6)

# Axes of a frame, and small numbers that kernels pass on (a literal would be compiled once per value)
X_AXIS = np.int64(0)
Y_AXIS = np.int64(1)
Z_AXIS = np.int64(2)
POSITION = np.int64(9)  # column of p in a pose
CENTRE_W = np.int64(12)  # column of the bounding sphere's centre in ContactTable.X_WG

# Columns of GeometryModel.geometry
KIND = np.int64(0)
BODY = np.int64(1)
MULTI_POINT = np.int64(2)  # 1 or 0
FIRST_VERTEX = np.int64(3)  # hulls: rows of `vertex`
NUM_VERTICES = np.int64(4)
FIRST_FACE = np.int64(5)  # hulls: rows of `face` and of `loop`
NUM_FACES = np.int64(6)
FIRST_CELL = np.int64(7)  # hulls: index in `topology` of where the vertices of each cell start, see CELLS
GEOMETRY_COLUMNS = 8

# Columns of GeometryModel.size
RADIUS = np.int64(0)  # [m] sphere, cylinder, capsule
HALF_LENGTH = np.int64(2)  # [m] cylinder, capsule; a box, ellipsoid and hull have half their extents in 0, 1, 2
CENTRE = np.int64(3)  # centre of the bounding sphere in G [m], 3 columns
BOUND = np.int64(6)  # radius of the bounding sphere [m]; infinite for a half space
SIZE_COLUMNS = 7

# Columns of GeometryModel.material
STIFFNESS = np.int64(0)  # of one contact point [N/m]; NaN where the plant has to supply a value
DISSIPATION = np.int64(1)  # Hunt-Crossley [s/m]; NaN as above
RELAXATION_TIME = np.int64(2)  # [s]; NaN as above
FRICTION_STATIC = np.int64(3)
FRICTION_DYNAMIC = np.int64(4)
MATERIAL_COLUMNS = 5

# Directions from the middle of a hull go through the six sides of a cube with so many cells along each edge; few
# vertices are lowest along any direction through a cell.
CELLS = np.int64(8)

# GeometryModel.margin
SEVERAL = np.int64(0)
ELASTIC = np.int64(1)

# Columns of GeometryModel.loop: a face of a hull
FIRST_CORNER = np.int64(0)  # index in `topology` of its vertices, counter-clockwise seen from outside
NUM_CORNERS = np.int64(1)
FIRST_FOOT = np.int64(2)  # index in `topology` of the four corners that span it best; -1 for a triangle

# Columns of ContactTable.pair and .point
GEOMETRY_A = np.int64(0)
GEOMETRY_B = np.int64(1)
BODY_A = np.int64(2)
BODY_B = np.int64(3)
P_WCA = np.int64(0)
P_WCB = np.int64(3)
NHAT_BA_W = np.int64(6)
DEPTH = np.int64(9)

MAX_POINTS = np.int64(6)  # contact points of one pair (of a cap; four of other faces)

# Families of pairs: each has an entry kernel of its own, so that nobody compiles what no pair needs
HALF_SPACES = np.int64(0)  # a half space and anything
SPHERES = np.int64(1)  # a sphere and another round or flat shape
BOXES = np.int64(2)  # two boxes
CONVEX = np.int64(3)  # all other pairs
NUM_FAMILIES = 4

# Status of a search, in ContactTable.count[1]
CAPACITY_EXCEEDED = np.int64(1)


class GeometryModel(NamedTuple):
    """All rigid proximity geometry of a scene, constant.

    Attributes:
        geometry: kind, body and where the hull's data is, shape (n, GEOMETRY_COLUMNS).
        size: measures [m] and bounding sphere, shape (n, SIZE_COLUMNS).
        material: shape (n, MATERIAL_COLUMNS).
        X_BG: pose in the body, R row-major then p [m], shape (n, 12).
        pair: geometries A < B that may touch, by family and then by A and B, shape (num_pairs, 2).
        margin: distance from which on pairs with several points are seen before they touch [m], and those without
            dissipation, shape (2,); see `least_depth`.
        family: first pair of each family of pair kernels, and the number of pairs, shape (NUM_FAMILIES + 1,).
        vertex: hull vertices in G [m], shape (num_vertices, 3).
        face: outward unit normal and offset [m] of hull faces in G (normal . x <= offset inside), shape (num_faces, 4).
        loop: where the corners and feet of hull faces are, shape (num_faces, 3).
        topology: vertex numbers (rows of `vertex`): per vertex v, `topology[v]` is where its neighbours start and
            `topology[v + 1]` where they end; the same for the faces around v (rows of `face`) from num_vertices + 1 on;
            then neighbours, faces, face corners, feet, and of each hull where the vertices of its cells start and they.
        cell: width of the cells in which close pairs are sought at each step [m], shape (1,), see `cells`; then only
            pairs with half spaces are listed in `pair`. Of no size when all pairs are listed.
        partner: with cells, `partner[partner[a]:partner[a + 1]]` are the geometries b > a on other bodies that a must
            not touch.
    """

    geometry: IntMatrix
    size: Matrix
    material: Matrix
    X_BG: Matrix
    pair: IntMatrix
    margin: Vector
    family: IntVector
    vertex: Matrix
    face: Matrix
    loop: IntMatrix
    topology: IntVector
    cell: Vector
    partner: IntVector


class ContactTable(NamedTuple):
    """Contacts found, and scratch to find them. Make one with `contact_table()`.

    Attributes:
        pair: geometry A, geometry B, body A, body B, shape (capacity, 4).
        point: p_WCa, p_WCb [m], nhat_BA_W, depth [m], shape (capacity, 10).
        count: number of contacts, and the status of the search (0 is fine), shape (2,).
        X_WG: poses of all geometries and centres of their bounding spheres [m], shape (num_geometries, 15).
        work: scratch of the pair kernels.
        iwork: integer scratch of the pair kernels.
        order: scratch of the sort, two permutations of the contacts, shape (capacity, 2).
    """

    pair: IntMatrix
    point: Matrix
    count: IntVector  # type: ignore[assignment]
    X_WG: Matrix
    work: Matrix
    iwork: IntVector
    order: IntMatrix


# Rows of ContactTable.work (a position in columns 0 to 2 unless said otherwise)
POLYGON_A = np.int64(0)  # three polygons of at most MAX_CORNERS corners
POLYGON_B = np.int64(64)
POLYGON_C = np.int64(128)
CANDIDATE = np.int64(192)  # contact candidates; depth in column 3
SIMPLEX = np.int64(256)  # vertices of GJK and EPA: a - b, a, b
ON_I = np.int64(3)  # columns of a
ON_J = np.int64(6)  # columns of b
FACE = np.int64(384)  # faces of EPA: unit normal, distance from the origin, 1.0 while it exists
WORK_ROWS = 384 + 256
MAX_CORNERS = 60
MAX_VERTICES = 128
MAX_FACES = 256
# Parts of ContactTable.iwork
CORNER = np.int64(0)  # three vertices per face of EPA
ACROSS = np.int64(768)  # faces across the three edges of each face
HORIZON = np.int64(1536)  # edges: two vertices, the face that stays and the one that is new
STACK = np.int64(2048)  # faces
IWORK_SIZE = 2048 + 256
MAX_EDGES = 127  # in HORIZON


def contact_table(model: GeometryModel, capacity: int | None = None) -> ContactTable:
    """An empty table for a model.

    Args:
        model: the geometry.
        capacity: most contacts it can hold; by default enough for every pair to touch, at most 65536 or 16 a
            geometry.
    """
    if capacity is None:
        n = len(model.geometry)
        pairs = len(model.pair) + (n * (n - 1) // 2 if len(model.cell) else 0)
        capacity = min(MAX_POINTS * pairs, max(65536, 16 * n))
    return ContactTable(
        pair=np.zeros((capacity, 4), np.int64),
        point=np.zeros((capacity, 10)),
        count=np.zeros(2, np.int64),
        X_WG=np.zeros((model.geometry.shape[0], 15)),
        work=np.zeros((WORK_ROWS, 9)),
        iwork=np.zeros(IWORK_SIZE, np.int64),
        order=np.zeros((capacity, 2), np.int64),
    )


def empty_geometry_model() -> GeometryModel:
    """A model without geometry, for a plant that has no SceneGraph."""
    return GeometryModel(
        geometry=np.zeros((0, GEOMETRY_COLUMNS), np.int64),
        size=np.zeros((0, SIZE_COLUMNS)),
        material=np.zeros((0, MATERIAL_COLUMNS)),
        X_BG=np.zeros((0, 12)),
        pair=np.zeros((0, 2), np.int64),
        margin=np.zeros(2),
        family=np.zeros(NUM_FAMILIES + 1, np.int64),
        vertex=np.zeros((0, 3)),
        face=np.zeros((0, 4)),
        loop=np.zeros((0, 3), np.int64),
        topology=np.zeros(2, np.int64),
        cell=np.zeros(0),
        partner=np.zeros(0, np.int64),
    )
