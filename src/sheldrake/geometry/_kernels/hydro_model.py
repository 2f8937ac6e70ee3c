"""What the kernels of hydroelastic contact read and fill: meshes with their trees, and the contact surfaces found.

Names: geometries M and N of a surface with id_M < id_N, frame G of a geometry, world W. Rows of `geometry` and `number`
are those of `GeometryModel`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.common.kernel import IntMatrix, IntVector, Matrix

# Columns of HydroModel.geometry
FIRST_ELEMENT = np.int64(0)  # rows of `element` and `field`
FIRST_VERTEX = np.int64(1)  # rows of `vertex`
FIRST_NODE = np.int64(2)  # rows of `node`: node k has the children 2 k + 1 and 2 k + 2
FIRST_LEAF = np.int64(3)  # of `leaf`
NUM_LEAVES = np.int64(4)  # a power of two: nodes from NUM_LEAVES - 1 on are leaves
GEOMETRY_COLUMNS = 5

# Columns of HydroModel.number
MODULUS = np.int64(0)  # hydroelastic modulus [Pa], infinite for rigid geometry
SLOPE = np.int64(1)  # of a compliant half space: pressure over depth [Pa/m]
MARGIN = np.int64(2)  # of a compliant half space [m]
BOUND = np.int64(3)  # radius of a sphere about the geometry's bounding centre that holds the mesh [m]
NUMBER_COLUMNS = 4

# Columns of HydroModel.field
GRADIENT = np.int64(0)  # tetrahedron: gradient of pressure [Pa/m]; triangle: unit normal
AT_ORIGIN = np.int64(3)  # tetrahedron: the linear pressure's value at Go [Pa]
PLANES = np.int64(4)  # tetrahedron: outward unit normal and offset [m] of its four faces
FIELD_COLUMNS = 20

# Columns of HydroModel.node
CENTRE = np.int64(0)  # of an axis-aligned box in G [m]
HALF = np.int64(3)  # its half sizes [m]; negative for a box of nothing

# Families of pairs: a compliant mesh and a rigid half space, ...
MESH_ON_RIGID_HALF_SPACE = np.int64(0)
RIGID_MESH_ON_HALF_SPACE = np.int64(1)
COMPLIANT_AND_RIGID = np.int64(2)
COMPLIANT_AND_COMPLIANT = np.int64(3)
NUM_FAMILIES = 4

# HydroModel.setting
TRIANGLES = np.int64(0)  # 1: surfaces of triangles, 0: of polygons
NUM_SETTINGS = 1

# Columns of HydroTable
GEOMETRY_M = np.int64(0)  # surface
GEOMETRY_N = np.int64(1)
FIRST_FACE = np.int64(2)
SURFACE = np.int64(0)  # face
CORNERS = np.int64(1)  # number of corners
CORNER = np.int64(2)  # first corner; a polygon's others follow it, a triangle's are in the next two columns
NORMAL = np.int64(0)  # value: unit normal, out of N into M
AREA = np.int64(3)  # [m^2]
CENTROID = np.int64(4)  # p_WC [m]
PRESSURE = np.int64(7)  # at the centroid [Pa]
GRADIENT_M = np.int64(8)  # of the pressure of M and of N, in W [Pa/m]; zero where rigid
GRADIENT_N = np.int64(11)
NUM_VALUES = 14

# HydroTable.count
NUM_SURFACES = np.int64(0)
NUM_FACES = np.int64(1)
NUM_VERTICES = np.int64(2)
STATUS = np.int64(3)  # 1: there was no room for all
NUM_COUNTS = 4

NO_ROOM = np.int64(1)

# Rows of HydroTable.work
FIRST_POLYGON = np.int64(0)
SECOND_POLYGON = np.int64(16)
WORK_ROWS = 32
STACK_SIZE = 512


class HydroModel(NamedTuple):
    """Hydroelastic representations of a scene's geometry, constant.

    Attributes:
        geometry: where the data of each geometry is, shape (n, GEOMETRY_COLUMNS).
        number: moduli and half spaces, shape (n, NUMBER_COLUMNS).
        vertex: positions in G [m] and pressure [Pa], shape (num_vertices, 4).
        element: vertices of each triangle (-1 in the last column) or tetrahedron, shape (num_elements, 4).
        field: shape (num_elements, FIELD_COLUMNS).
        node: boxes of the trees, shape (num_nodes, 6).
        leaf: element of each leaf (row of `element`), -1 for none, shape (num_leaves,).
        pair: geometry of each kind in the order of the family's name, shape (num_pairs, 2).
        family: first pair of each family, and the number of pairs, shape (NUM_FAMILIES + 1,).
        setting: choices, shape (NUM_SETTINGS,).
    """

    geometry: IntMatrix
    number: Matrix
    vertex: Matrix
    element: IntMatrix
    field: Matrix
    node: Matrix
    leaf: IntVector
    pair: IntMatrix
    family: IntVector
    setting: IntVector


class HydroTable(NamedTuple):
    """Contact surfaces found, and scratch to find them. Make one with `hydro_table()`.

    Attributes:
        count: numbers of surfaces, faces and vertices, and a status, shape (NUM_COUNTS,).
        surface: geometry M, geometry N, first face, shape (num_pairs, 3).
        face: surface, number of corners, corners, shape (capacity, 5).
        value: shape (capacity, NUM_VALUES).
        vertex: positions in W [m] and pressure [Pa], shape (vertex capacity, 4).
        contact: number of the contact that a plant makes of a face, -1 for none, shape (capacity,).
        work: polygons at hand [m].
        stack: pairs of tree nodes still to be looked at.
    """

    count: IntVector  # type: ignore[assignment]
    surface: IntMatrix
    face: IntMatrix
    value: Matrix
    vertex: Matrix
    contact: IntVector
    work: Matrix
    stack: IntVector


def hydro_table(model: HydroModel, capacity: int) -> HydroTable:
    """An empty table for a model with room for a number of faces."""
    if len(model.pair) == 0:
        capacity = 0
    vertices = 2 * capacity if model.setting[TRIANGLES] else 6 * capacity
    some = int(len(model.pair) > 0)
    return HydroTable(
        count=np.zeros(NUM_COUNTS, np.int64),
        surface=np.zeros((len(model.pair), 3), np.int64),
        face=np.zeros((capacity, 5), np.int64),
        value=np.zeros((capacity, NUM_VALUES)),
        vertex=np.zeros((vertices, 4)),
        contact=np.zeros(capacity, np.int64),
        work=np.zeros((some * WORK_ROWS, 3)),
        stack=np.zeros(some * STACK_SIZE, np.int64),
    )


def empty_hydro_model() -> HydroModel:
    """A model without hydroelastic geometry."""
    return HydroModel(
        geometry=np.zeros((0, GEOMETRY_COLUMNS), np.int64),
        number=np.zeros((0, NUMBER_COLUMNS)),
        vertex=np.zeros((0, 4)),
        element=np.zeros((0, 4), np.int64),
        field=np.zeros((0, FIELD_COLUMNS)),
        node=np.zeros((0, 6)),
        leaf=np.zeros(0, np.int64),
        pair=np.zeros((0, 2), np.int64),
        family=np.zeros(NUM_FAMILIES + 1, np.int64),
        setting=np.zeros(NUM_SETTINGS, np.int64),
    )
