"""From a list of bodies with their inboard joints to the constant arrays of the kernels."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sheldrake.common.record import Record
from sheldrake.multibody.tree._joint_types import JOINT_TYPES
from sheldrake.multibody.tree._kernels import model as m


@dataclass
class Mobilizer:
    """A body and its inboard joint, as the kernels need them.

    Attributes:
        parent: row of the inboard body; smaller than the own row.
        type_name: the joint's type, as pydrake's `type_name()`.
        inertia: where in p the ten inertia numbers of the body start.
        frame_F: the joint's frame on the inboard body, an index of `frames`, -1 for the body frame.
        frame_M: the joint's frame on the body, likewise.
        constants: axis in F and lead [m/rad], or the pose X_FM (nine numbers of R row-major, then p) of a weld, or
            where a path begins.
        damping: where in p the damping of each velocity is.
        gravity: gravity that acts on the body, in W [m/s²], shape (3,).
        added_gravity: where in p is what is added to it; -1 for nothing.
        friction: where in p is what the body's friction coefficients are multiplied with; -1 for nothing.
        path: pieces of the path of a curvilinear joint, rows of `TreeModel.joint`.
    """

    parent: int
    type_name: str
    inertia: int
    frame_F: int = -1
    frame_M: int = -1
    constants: tuple[float, ...] = ()
    damping: tuple[int, ...] = ()
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    added_gravity: int = -1
    friction: int = -1
    path: list[tuple[float, ...]] = field(default_factory=list)


@dataclass
class TreeDescription:
    """All of a tree; row 0, the world, is not among the mobilizers."""

    mobilizers: list[Mobilizer] = field(default_factory=list)
    frames: list[tuple[int, int]] = field(default_factory=list)
    """Frames fixed to bodies: (frame it is fixed to or -1, where in p its pose starts)."""
    actuators: list[tuple[int, int, int]] = field(default_factory=list)
    """(dof, where in p its rotor inertia is, where in p its gear ratio is)."""
    friction_of_world: int = -1
    """As `friction` of the others."""


def compile_tree(description: TreeDescription) -> m.TreeModel:
    """The arrays of a tree. Positions and velocities are numbered in the order of the mobilizers.

    Raises:
        ValueError: if a body comes before its inboard body, or the bodies of a tree are not contiguous.
    """
    nb = len(description.mobilizers) + 1
    body = np.zeros((nb, m.Body.SIZE), np.int64)
    for field_of_world in (m.Body.parent, m.Body.tree, m.Body.frame_F, m.Body.frame_M, m.Body.tip):
        body[0, field_of_world] = -1
    body[0, m.Body.gravity], body[0, m.Body.friction] = -1, description.friction_of_world
    joint = np.zeros((nb, m.JointPose.SIZE))
    gravity = np.zeros((nb, 3))
    pieces: list[tuple[float, ...]] = []
    dofs: list[tuple[int, ...]] = []
    trees: list[list[int]] = []
    last_dof = {0: -1}
    packed = q = 0
    for row, mobilizer in enumerate(description.mobilizers, start=1):
        parent, joint_type = mobilizer.parent, JOINT_TYPES[mobilizer.type_name]
        kind = joint_type.kind
        if not 0 <= parent < row:
            raise ValueError(f"compile_tree(): body row {row} comes before its inboard body row {parent}.")
        if kind == m.QUATERNION and parent == 0 and mobilizer.frame_F < 0 and mobilizer.frame_M < 0:
            kind = m.FREE
        nq, nv = len(joint_type.positions), len(joint_type.velocities)
        root, tree = body[parent, m.Body.root], body[parent, m.Body.tree]
        if root == 0 and nv > 0:
            root, tree = row, len(trees)
            trees.append([row, 0, len(dofs), 0])
        if tree >= 0:
            if tree != len(trees) - 1:
                raise ValueError(f"compile_tree(): body row {row} is apart from the other bodies of its tree.")
            trees[tree][m.Tree.num_bodies] += 1
            trees[tree][m.Tree.num_dofs] += nv
        body[row, : m.Body.tip.at] = (parent, kind, root, tree, q, len(dofs), nv, mobilizer.frame_F, mobilizer.frame_M,
                              mobilizer.inertia)  # fmt: skip
        joint[row, : len(mobilizer.constants)] = mobilizer.constants
        body[row, m.Body.path], body[row, m.Body.path_end] = nb + len(pieces), nb + len(pieces) + len(mobilizer.path)
        pieces += mobilizer.path
        body[row, m.Body.along] = _axis_of_frame(mobilizer.constants[:3]) if m.REVOLUTE <= kind <= m.SCREW else 0
        if kind == m.WELD:
            body[row, m.Body.along] = np.array_equal(mobilizer.constants, (1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0))
        body[row, m.Body.direct] = all(
            f < 0 or description.frames[f][m.OffsetFrame.parent] < 0 for f in (mobilizer.frame_F, mobilizer.frame_M)
        )
        gravity[row] = mobilizer.gravity
        body[row, m.Body.gravity], body[row, m.Body.friction] = mobilizer.added_gravity, mobilizer.friction
        above = last_dof[parent]
        for k in range(nv):
            depth = dofs[above][m.Dof.depth] + 1 if above >= 0 else 0
            position = q + k if joint_type.v_is_qdot else -1
            run = dofs[above][m.Dof.run] if 0 <= above == len(dofs) - 1 else len(dofs)
            dofs.append((above, row, int(tree), depth, packed, mobilizer.damping[k], position, run))
            packed += depth + 1
            above = len(dofs) - 1
        body[row, m.Body.tip] = last_dof[row] = above
        q += nq

    def table(rows: list, record: type[Record]) -> np.ndarray:
        return np.array(rows, np.int64).reshape(-1, record.SIZE)

    paths = np.zeros((len(pieces), m.JointPose.SIZE))
    for row, piece in enumerate(pieces):
        paths[row, : len(piece)] = piece
    return m.TreeModel(
        body, np.concatenate([joint, paths]), table(dofs, m.Dof), table(description.frames, m.OffsetFrame),
        table(trees, m.Tree), table(description.actuators, m.Actuator), gravity,
    )  # fmt: skip


def _axis_of_frame(axis: tuple[float, ...]) -> int:
    """1, 2, 3 for x, y, z, negative for their opposites; 0 for another direction."""
    along = int(np.abs(axis).argmax())
    sign = int(np.sign(axis[along]))
    return sign * (along + 1) if np.array_equal(axis, sign * np.eye(3)[along]) else 0
