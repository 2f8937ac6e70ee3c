"""What the tree kernels work on: the constant `TreeModel` and the per-context `TreeWork`.

Bodies are numbered by *row*: row 0 is the world, and every other body comes after its inboard body (depth first, as
the generalized coordinates are ordered). Each body has one inboard joint; a joint has 0 to 6 degrees of freedom (dof).

Spatial quantities (`S`, `V`, `A`, `inertia`, `F`) are expressed in W and taken about the point `root`: the origin of
the base body of the body's tree, for all bodies of that tree. So they add without shifting, and stay accurate far from
the world's origin. Bodies welded to the world have row 0 as their root and belong to no tree.

The mass matrix is stored packed. Row `k` has one entry for each dof on the path from the base to `k`, the entry of
dof `j` at `M[dof[k, ROW] + dof[j, DEPTH]]`. The ancestors of an ancestor come first, so inner loops run over
contiguous memory and branches cost nothing (branch-induced sparsity, Featherstone 2008, section 6.5).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.common.kernel import IntMatrix, Matrix, Vector

# Columns of TreeModel.body.
PARENT = np.int64(0)  # row of the inboard body
KIND = np.int64(1)  # kind of the inboard joint, below
ROOT = np.int64(2)  # row of the body whose origin is the reference point
TREE = np.int64(3)  # tree number, -1 when welded to the world
Q = np.int64(4)  # first position of the inboard joint
V = np.int64(5)  # first velocity of the inboard joint
NV = np.int64(6)  # velocities of the inboard joint
FRAME_F = np.int64(7)  # joint frame on the inboard body: row of TreeModel.frame, -1 is the body frame
FRAME_M = np.int64(8)  # joint frame on this body: row of TreeModel.frame, -1 is the body frame
INERTIA = np.int64(9)  # where in p its ten inertia numbers start
TIP = np.int64(10)  # last dof that moves the body, -1 when none does; its ancestors are the others
AXIS = np.int64(11)  # the axis of F that is the axis of the joint: 1, 2, 3, negative when opposite; 0 when none is
DIRECT = np.int64(12)  # 1 when the joint's frames are fixed to their bodies, not to other frames
PATH = np.int64(13)  # row of TreeModel.joint where the path of a curvilinear joint starts
PATH_END = np.int64(14)  # the row after its last piece
BODY_COLUMNS = 15

# Kinds of joints.
WELD = np.int64(0)
REVOLUTE = np.int64(1)
PRISMATIC = np.int64(2)
SCREW = np.int64(3)
CURVILINEAR = np.int64(4)
FREE = np.int64(5)  # quaternion floating from the world, both frames being body frames
QUATERNION = np.int64(6)  # quaternion floating between any frames
RPY = np.int64(7)
BALL = np.int64(8)
PLANAR = np.int64(9)
UNIVERSAL = np.int64(10)

# Columns of TreeModel.joint: an axis in F (0 to 2) and the lead [m/rad] (3), or the pose X_FM of a weld (12 numbers),
# or X_FM where the path of a curvilinear joint begins. Below the rows of the bodies are the pieces of such paths.
LEAD = np.int64(3)
PIECE_START = np.int64(0)  # distance at which a piece begins [m]
PIECE_RATE = np.int64(1)  # how fast M turns along it [1/m]
PIECE_X = np.int64(2)  # where it begins, in the plane of the path, from the path's beginning and tangent there
PIECE_Y = np.int64(3)
PIECE_COS = np.int64(4)  # its direction there
PIECE_SIN = np.int64(5)
PIECE_PERIOD = np.int64(6)  # length after which the path begins anew, 0 when it does not [m]
JOINT_COLUMNS = 12

# Columns of TreeModel.dof.
DOF_PARENT = np.int64(0)  # the dof next to it towards the base, -1 at the base
DOF_BODY = np.int64(1)
DOF_TREE = np.int64(2)
DEPTH = np.int64(3)  # number of ancestors
ROW = np.int64(4)  # where its row of a packed matrix starts
DAMPING = np.int64(5)  # where in p its damping is
DOF_Q = np.int64(6)  # its position when the joint has as many positions as velocities and qdot = v, else -1
RUN = np.int64(7)  # where the run that it ends begins: dofs each of which is the parent of the next
DOF_COLUMNS = 8

# Columns of TreeModel.frame: frames fixed to a body, other than body frames.
FRAME_PARENT = np.int64(0)  # the frame it is fixed to, -1 is the body frame
FRAME_POSE = np.int64(1)  # where in p its pose starts: nine numbers of R, row-major, then p
FRAME_COLUMNS = 2

# Columns of TreeModel.tree.
TREE_BODY = np.int64(0)  # first body row; bodies of a tree are contiguous
TREE_NUM_BODIES = np.int64(1)
TREE_DOF = np.int64(2)  # first dof; dofs of a tree are contiguous
TREE_NV = np.int64(3)
TREE_COLUMNS = 4

# Columns of TreeModel.actuator: one actuator a row.
ACTUATOR_DOF = np.int64(0)
ROTOR = np.int64(1)  # where in p its rotor inertia is
GEAR = np.int64(2)  # where in p its gear ratio is
ACTUATOR_COLUMNS = 3


class TreeModel(NamedTuple):
    """Constant arrays of a tree of bodies; columns are named above.

    Attributes:
        body: shape (num_bodies, BODY_COLUMNS).
        joint: constants of the inboard joints, then pieces of paths, shape (num_bodies + num_pieces, JOINT_COLUMNS).
        dof: shape (nv, DOF_COLUMNS).
        frame: shape (num_offset_frames, FRAME_COLUMNS).
        tree: shape (num_trees, TREE_COLUMNS).
        actuator: shape (num_actuators, ACTUATOR_COLUMNS).
        gravity: gravity that acts on each body, in W [m/s²], shape (num_bodies, 3).
    """

    body: IntMatrix
    joint: Matrix
    dof: IntMatrix
    frame: IntMatrix
    tree: IntMatrix
    actuator: IntMatrix
    gravity: Matrix


class TreeWork(NamedTuple):
    """Results of the stages, in the order in which they become valid; rows are bodies or dofs.

    Attributes:
        X_WB: poses, nine numbers of R_WB row-major, then p_WB [m], shape (num_bodies, 12).
        S: motion of each dof at unit speed, about `root`, shape (nv, 6).
        V: spatial velocity V_WB about `root` [rad/s, m/s], shape (num_bodies, 6).
        A: spatial acceleration at zero vdot, about `root`, shape (num_bodies, 6). It is the acceleration of the
            velocity field, not of a point (Featherstone 2008, section 2.11).
        inertia: mass [kg], first moment [kg m], second moments [kg m²], about `root`, shape (num_bodies, 10).
        composite: the same of a body and all outboard of it, shape (num_bodies, 10).
        F: spatial forces of the recursions, about `root`, shape (num_bodies, 6).
        M: packed mass matrix, shape (num_packed,).
        L: packed factor of M, or of M + dt D, shape (num_packed,).
        bias: generalized bias forces, shape (nv,).
    """

    X_WB: Matrix
    S: Matrix
    V: Matrix
    A: Matrix
    inertia: Matrix
    composite: Matrix
    F: Matrix
    M: Vector
    L: Vector
    bias: Vector


def num_packed(model: TreeModel) -> int:
    """How many numbers a packed matrix has."""
    return int(np.sum(model.dof[:, DEPTH] + 1))


def make_work(model: TreeModel, dtype: type = float) -> TreeWork:
    """A workspace in the state every stage expects: the world's row is set, and the rows of S that never change."""
    nb, nv, packed = len(model.body), len(model.dof), num_packed(model)

    def zeros(*shape: int) -> np.ndarray:
        return np.zeros(shape) if dtype is float else np.full(shape, 0.0, dtype=dtype)

    work = TreeWork(
        X_WB=zeros(nb, 12), S=zeros(nv, 6), V=zeros(nb, 6), A=zeros(nb, 6), inertia=zeros(nb, 10),
        composite=zeros(nb, 10), F=zeros(nb, 6), M=zeros(packed), L=zeros(packed), bias=zeros(nv),
    )  # fmt: skip
    work.X_WB[0, [0, 4, 8]] = 1.0
    for row in np.flatnonzero(model.body[:, KIND] == FREE):
        v = model.body[row, V]
        work.S[v : v + 6] = np.eye(6)
    return work
