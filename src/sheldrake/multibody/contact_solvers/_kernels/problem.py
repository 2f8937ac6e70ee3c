"""What one contact solve is made of: momentum, contacts, scalar rows; the arrays and the names of their columns.

The convex problem (Castro, Permenter, Han 2022, eq. 21) is

    minimise over v:  1/2 (v - v*)^T A (v - v*) + sum_i l_i(J_i v),      gamma_i = -dl_i/dvc_i,  G_i = d2l_i/dvc_i2

with A = M(q0) + dt D block diagonal by kinematic tree. A solver sees dofs, trees and rows, not bodies or joints.
"""

from typing import NamedTuple

import numpy as np

from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector


class SolverModel(NamedTuple):
    """Constants of a plant's contact solver.

    Attributes:
        option: Numbers of the solver, shape (7,), columns `DT` .. `ABSOLUTE_TOLERANCE`.
        setting: Choices of the solver, shape (4,), columns `APPROXIMATION` .. `SETTLE`.
        tree: First dof, number of dofs of each kinematic tree, shape (num_trees, 2).
        dof: Next dof towards the base or -1, number of ancestors, start of the packed row of each dof, shape (nv, 3).
    """

    option: Vector
    setting: IntVector
    tree: IntMatrix
    dof: IntMatrix


class Problem(NamedTuple):
    """The smooth part of one solve.

    Attributes:
        A: Momentum matrix, packed: entry of dof k and its ancestor j at A[dof[k, ROW_START] + dof[j, DEPTH_OF]].
        x: Vectors over the dofs, shape (10, nv), rows `V0` .. `MOBILITY`.
        tree: Who takes part, and in which island, shape (num_trees, 6), columns `ACTIVE` .. `ISLAND_ROWS`.
        count: Numbers of this solve, shape (16,), columns `NUM_CONTACTS` .. `ROWS_END`.
    """

    A: Vector
    x: Matrix
    tree: IntMatrix
    count: IntVector


class Contacts(NamedTuple):
    """Frictional contacts, three rows each (two tangents, normal) in the contact frame C.

    Attributes:
        index: Shape (capacity, 5 + width): `WIDTH` .. `SIXES`, then the dofs that move it.
        J: Shape (3 capacity, width): rows 3 c .. 3 c + 2, a column for each of those dofs.
        law: Numbers of the contact law, shape (capacity, 10), columns `STIFFNESS` .. `BACK`.
        state: Shape (capacity, 17): vc [m/s] (3), its change along the search direction (3), gamma [N s] (3),
            G = -dgamma/dvc [kg] as xx, xy, yy, xz, yz, zz (6), the dual of friction (2, see `friction_dual`).
    """

    index: IntMatrix
    J: Matrix
    law: Matrix
    state: Matrix


class Rows(NamedTuple):
    """Scalar constraint rows: joint limits, PD actuators, couplers, distances, each direction of a ball or weld.

    Attributes:
        index: Shape (capacity, 7 + width): as of contacts to `ORDER`, then `ROW_KIND`, `ROW_OWNER`, `ROW_GROUP`, dofs.
        J: Shape (capacity, width).
        law: Shape (capacity, 9), columns `ROW_R` .. `ROW_FORWARD`: gamma = clamp((vhat - vc) / R, lower, upper);
            `prepare` makes R and vhat from the columns behind them.
        state: Shape (capacity, 4): vc, its change along the search direction, gamma, G.
    """

    index: IntMatrix
    J: Matrix
    law: Matrix
    state: Matrix


class Factor(NamedTuple):
    """Work of a sparse block factor, Cholesky's or (kTamsi) L U: one block row and column for each tree of an island.

    Attributes:
        slot: Place of each dof in `rhs`, shape (nv,).
        block: Shape (num_trees, 7), columns `BLOCK_TREE` .. `DIAGONAL` by place in the order; `PLACE` by tree.
        below: Blocks below the diagonal, column after column, rows ascending: place of the row, address in L,
            shape (capacity, 2).
        graph: Who is coupled to whom, a bit for each pair of trees, shape (num_trees, words).
        L: The blocks, each column after column, shape (capacity,); for kTamsi behind each one below the diagonal the
            transpose of the one above.
        rhs: Right-hand side and solution, shape (nv,).
        branch: Of an island of one tree the path of each dof, shape (nv, 3), columns `BRANCH_PARENT` .. `BRANCH_START`.
    """

    slot: IntVector
    block: IntMatrix
    below: IntMatrix
    graph: IntMatrix
    L: Vector
    rhs: Vector
    branch: IntMatrix


# SolverModel.option
DT = np.int64(0)  # time step [s]
STICTION = np.int64(1)  # regularisation speed v_s [m/s]
SIGMA = np.int64(2)  # tangential regularisation relative to the Delassus estimate [-]
NEAR_RIGID = np.int64(3)  # beta of kSap's contacts [-]
NEAR_RIGID_ROWS = np.int64(4)  # beta of scalar rows [-]
RELATIVE_TOLERANCE = np.int64(5)
ABSOLUTE_TOLERANCE = np.int64(6)
NUM_OPTIONS = 7

# SolverModel.setting
APPROXIMATION = np.int64(0)
MAX_ITERATIONS = np.int64(1)
POLISH = np.int64(2)  # full Newton steps after success; 1 carries derivatives of duals through the solution
SETTLE = np.int64(3)  # 1: rest exactly where rest is a solution; full steps where they do; 0: Drake's iterates
NUM_SETTINGS = 4

# values of setting[APPROXIMATION]
LAGGED = np.int64(0)
SIMILAR = np.int64(1)
SAP = np.int64(2)
TAMSI = np.int64(3)

# SolverModel.tree
FIRST_DOF = np.int64(0)
NUM_DOFS = np.int64(1)

# SolverModel.dof
PARENT_DOF = np.int64(0)
DEPTH_OF = np.int64(1)
ROW_START = np.int64(2)

# Problem.x
V0 = np.int64(0)  # v at the start of the step
V_STAR = np.int64(1)  # v without constraints
V = np.int64(2)  # the iterate; in the end v_next
P_STAR = np.int64(3)  # A v*; the plant leaves A (v* - v0) here
P = np.int64(4)  # A v
J_GAMMA = np.int64(5)  # J^T gamma
GRADIENT = np.int64(6)  # A (v - v*) - J^T gamma
DV = np.int64(7)  # search direction
A_DV = np.int64(8)  # A dv
MOBILITY = np.int64(9)  # 1 / diag(A)
NUM_VECTORS = 10

# Problem.count
NUM_CONTACTS = np.int64(0)
NUM_ROWS = np.int64(1)
ITERATIONS = np.int64(2)
PARTICIPATING = np.int64(3)  # dofs of the last island that needed a factor
SUBSTEPS = np.int64(4)
NUM_ISLANDS = np.int64(5)
TREES_BEGIN = np.int64(6)  # the island at hand: places in the orders of trees, contacts and rows
TREES_END = np.int64(7)
CONTACTS_BEGIN = np.int64(8)
CONTACTS_END = np.int64(9)
ROWS_BEGIN = np.int64(10)
ROWS_END = np.int64(11)
FACTOR_SIZE = np.int64(12)  # numbers in the island's factor
ALONG_BRANCHES = np.int64(13)  # 1 if they are rows along the branches of a tree, 0 if blocks
NUM_COUNTS = 16

# Problem.tree: rows are trees, then places, then islands
ACTIVE = np.int64(0)  # 1 for a tree touched by a constraint, else 0
ROOT_TREE = np.int64(1)  # towards the first tree of its island; then the number of the island
TREE_ORDER = np.int64(2)  # the tree at a place: islands one after the other
ISLAND_TREES = np.int64(3)  # where an island's trees end
ISLAND_CONTACTS = np.int64(4)  # where an island's contacts end
ISLAND_ROWS = np.int64(5)  # where an island's rows end
NUM_TREE_COLUMNS = 6

# Contacts.index and the first columns of Rows.index
WIDTH = np.int64(0)
TREE_A = np.int64(1)  # -1 for none
TREE_B = np.int64(2)
ORDER = np.int64(3)  # the contact or row at this place: islands one after the other
SIXES = np.int64(4)  # how many trees of six dofs all its columns belong to; 0 if there are others; `prepare` finds it
DOFS = np.int64(5)
ROW_KIND = np.int64(4)
ROW_OWNER = np.int64(5)
ROW_GROUP = np.int64(6)  # n in the first of n rows that share their dofs and one Delassus estimate, 0 in the others
ROW_DOFS = np.int64(7)

# Contacts.law: the material, then what `prepare` derives (Hunt-Crossley | kSap)
STIFFNESS = np.int64(0)  # k [N/m]
DISSIPATION = np.int64(1)  # d [s/m]
RELAXATION = np.int64(2)  # tau [s]
FRICTION = np.int64(3)  # mu [-]
DEPTH = np.int64(4)  # -phi0 [m]
FE0 = np.int64(5)  # elastic force at q0 [N]         | Rt [1/kg]
N0 = np.int64(6)  # normal impulse at v0 [N s]       | Rn [1/kg]
EPS = np.int64(7)  # regularisation speed [m/s]      | vhat_n [m/s]
R_T = FE0
R_N = N0
VHAT_N = EPS
DELASSUS = np.int64(8)  #                                 | w [1/kg]
BACK = np.int64(9)  # elastic contacts: how much larger the force was half a step back [N], see `elastic`; else 0.
# The plant leaves there how far ahead an elastic contact is seen [m], else 0.
NUM_LAW = 10

# Contacts.state
VC = np.int64(0)
DVC = np.int64(3)
GAMMA = np.int64(6)
G_XX = np.int64(9)
G_XY = np.int64(10)
G_YY = np.int64(11)
G_XZ = np.int64(12)
G_YZ = np.int64(13)
G_ZZ = np.int64(14)
DUAL_X = np.int64(15)
DUAL_Y = np.int64(16)
NUM_STATE = 17

# Rows.law
ROW_R = np.int64(0)
ROW_VHAT = np.int64(1)
ROW_LOWER = np.int64(2)
ROW_UPPER = np.int64(3)
ROW_GAP = np.int64(4)  # violation g at q0                | q0 - q_desired of an actuator
ROW_STIFFNESS = np.int64(5)  # k, may be infinite         | proportional gain
ROW_RELAXATION = np.int64(6)  # tau [s]                   | derivative gain
ROW_RATE = np.int64(7)  #                                 | v_desired
ROW_FORWARD = np.int64(8)  #                              | feed-forward effort
NUM_ROW_LAW = 9

# Rows.state
ROW_VC = np.int64(0)
ROW_DVC = np.int64(1)
ROW_GAMMA = np.int64(2)
ROW_G = np.int64(3)
NUM_ROW_STATE = 4

# Rows.index[ROW_KIND]
LIMIT = np.int64(0)
ACTUATOR = np.int64(1)
HOLONOMIC = np.int64(2)
DRY_FRICTION = np.int64(3)

# Factor.block
BLOCK_TREE = np.int64(0)
FIRST_SLOT = np.int64(1)
SIZE = np.int64(2)  # dofs of the tree
BELOW_BEGIN = np.int64(3)  # rows of `below`
BELOW_END = np.int64(4)
DIAGONAL = np.int64(5)  # address of the diagonal block in L
PLACE = np.int64(6)  # by tree: its place in the elimination order
NUM_BLOCK_COLUMNS = 7

# Factor.branch: as in `SolverModel.dof`, with what constraints add
BRANCH_PARENT = np.int64(0)
BRANCH_DEPTH = np.int64(1)
BRANCH_START = np.int64(2)  # where its row of L starts

# Factor.below
BELOW_PLACE = np.int64(0)
ADDRESS = np.int64(1)
