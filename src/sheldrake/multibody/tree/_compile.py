"""From a list of bodies with their inboard joints to the constant arrays of the kernels."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

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


class _Tables(NamedTuple):
    """The numbers of a tree that are indices and kinds."""

    body: np.ndarray
    dof: np.ndarray
    frame: np.ndarray
    tree: np.ndarray
    actuator: np.ndarray
    turn: np.ndarray


_tables: dict[tuple, _Tables] = {}
_MOST_TABLES = 64


def compile_tree(description: TreeDescription) -> m.TreeModel:
    """The arrays of a tree. Positions and velocities are numbered in the order of the mobilizers.

    Trees that are connected alike share what numbers their bodies: those arrays are read-only.

    Raises:
        ValueError: if a body comes before its inboard body, or the bodies of a tree are not contiguous.
    """
    mobilizers = description.mobilizers
    alike = [
        (b.parent, b.type_name, b.inertia, b.frame_F, b.frame_M, _along(b), b.damping, b.gravity, b.added_gravity,
         b.friction, len(b.path)) for b in mobilizers
    ]  # fmt: skip
    key = tuple(alike), tuple(description.frames), tuple(description.actuators), description.friction_of_world
    tables = _tables.get(key)
    if tables is None:
        tables = _number(description)
        for table in tables:
            table.flags.writeable = False
        if len(_tables) >= _MOST_TABLES:
            _tables.clear()
        _tables[key] = tables
    width, nothing = m.JointPose.SIZE, ()
    rows: Iterable[tuple[float, ...]] = (
        nothing,
        *(b.constants for b in mobilizers),
        *(r for b in mobilizers for r in b.path),
    )
    joint = np.array([(*row, *(0.0,) * (width - len(row))) for row in rows], float)
    gravity = np.array([(0.0, 0.0, 0.0), *(b.gravity for b in mobilizers)], float)
    return m.TreeModel(tables.body, joint, tables.dof, tables.frame, tables.tree, tables.actuator, gravity, tables.turn)


def _number(description: TreeDescription) -> _Tables:
    """Numbers what a tree has."""
    nb = len(description.mobilizers) + 1
    bodies = [_body_row(parent=-1, tree=-1, frame_F=-1, frame_M=-1, tip=-1, gravity=-1,
                        friction=description.friction_of_world)]  # fmt: skip
    pieces = 0
    dofs: list[tuple[int, ...]] = []
    trees: list[list[int]] = []
    turns: list[int] = []
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
        root, tree = bodies[parent][_ROOT], bodies[parent][_TREE]
        if root == 0 and nv > 0:
            root, tree = row, len(trees)
            trees.append([row, 0, len(dofs), 0])
        if tree >= 0:
            if tree != len(trees) - 1:
                raise ValueError(f"compile_tree(): body row {row} is apart from the other bodies of its tree.")
            trees[tree][m.Tree.num_bodies] += 1
            trees[tree][m.Tree.num_dofs] += nv
        first_dof, first_piece = len(dofs), nb + pieces
        pieces += len(mobilizer.path)
        above = last_dof[parent]
        for k in range(nv):
            depth = dofs[above][_DEPTH] + 1 if above >= 0 else 0
            position = q + k if joint_type.v_is_qdot else -1
            run = dofs[above][_RUN] if 0 <= above == len(dofs) - 1 else len(dofs)
            dofs.append((above, row, tree, depth, packed, mobilizer.damping[k], position, run))
            packed += depth + 1
            above = len(dofs) - 1
        last_dof[row] = above
        turn = -1
        if kind in (m.REVOLUTE, m.SCREW):
            turn = len(turns)
            turns.append(q)
        frames = mobilizer.frame_F, mobilizer.frame_M
        carrier = row
        if kind == m.WELD and root > 0 and falls_like(description, row, parent):
            carrier = bodies[parent][_CARRIER]
        bodies.append(
            _body_row(
                parent=parent, kind=kind, root=root, tree=tree, first_q=q, first_dof=first_dof, num_dofs=nv,
                frame_F=frames[0], frame_M=frames[1], inertia=mobilizer.inertia, tip=above, along=_along(mobilizer),
                direct=all(f < 0 or description.frames[f][0] < 0 for f in frames),
                path=first_piece, path_end=nb + pieces, gravity=mobilizer.added_gravity,
                friction=mobilizer.friction, turn=turn, carrier=carrier,
            )
        )  # fmt: skip
        q += nq

    def table(rows: list, record: type[Record]) -> np.ndarray:
        return np.array(rows, np.int64).reshape(-1, record.SIZE)

    return _Tables(
        table(bodies, m.Body), table(dofs, m.Dof), table(description.frames, m.OffsetFrame), table(trees, m.Tree),
        table(description.actuators, m.Actuator), np.array(turns, np.int64),
    )  # fmt: skip


_BODY = {field.name: 0 for field in m.Body.FIELDS}
_ROOT, _TREE, _CARRIER = (list(_BODY).index(name) for name in ("root", "tree", "carrier"))
_DEPTH, _RUN = int(m.Dof.depth), int(m.Dof.run)


def falls_like(description: TreeDescription, row: int, other: int) -> bool:
    """Whether two bodies have the same gravity, and will when its vector or what parameters add to it changes."""
    a, b = (description.mobilizers[k - 1] for k in (row, other))
    return (a.gravity, a.added_gravity) == (b.gravity, b.added_gravity)


def _body_row(**numbers: int) -> list[int]:
    """A row of the table of bodies."""
    return list((_BODY | numbers).values())


def _along(mobilizer: Mobilizer) -> int:
    """1, 2, 3 for x, y, z, negative for their opposites, 0 for another direction; 1 for a weld that moves nothing."""
    kind = JOINT_TYPES[mobilizer.type_name].kind
    if kind == m.WELD:
        return int(tuple(mobilizer.constants) == (1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0))
    return _ALONG.get(tuple(mobilizer.constants[:3]), 0) if m.REVOLUTE <= kind <= m.SCREW else 0


_AXES: list[tuple[float, ...]] = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
_ALONG = {tuple(sign * x for x in axis): sign * k for k, axis in enumerate(_AXES, start=1) for sign in (1, -1)}
