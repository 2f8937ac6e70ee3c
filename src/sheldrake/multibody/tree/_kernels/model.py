"""What the tree kernels work on: the constant `TreeModel` and the per-context `TreeWork`.

Bodies are numbered by *row*: row 0 is the world, and every other body comes after its inboard body (depth first, as
the generalized coordinates are ordered). Each body has one inboard joint; a joint has 0 to 6 degrees of freedom (dof).

Spatial quantities (`S`, `V`, `A`, `inertia`, `F`) are expressed in W and taken about the point `root`: the origin of
the base body of the body's tree, for all bodies of that tree. So they add without shifting, and stay accurate far from
the world's origin. Bodies welded to the world have row 0 as their root and belong to no tree.

The mass matrix is stored packed. Row `k` has one entry for each dof on the path from the base to `k`, the entry of
dof `j` at `M[dofs[k].row + dofs[j].depth]`. The ancestors of an ancestor come first, so inner loops run over
contiguous memory and branches cost nothing (branch-induced sparsity, Featherstone 2008, section 6.5).
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector
from sheldrake.common.record import Items, Record, integer, number, numbers, table
from sheldrake.geometry._kernels.model import BodyPose

# Kinds of joints.
WELD = 0
REVOLUTE = 1
PRISMATIC = 2
SCREW = 3
CURVILINEAR = 4
FREE = 5  # quaternion floating from the world, both frames being body frames
QUATERNION = 6  # quaternion floating between any frames
RPY = 7
BALL = 8
PLANAR = 9
UNIVERSAL = 10


class Body(Record):
    """A body and its inboard joint, between a frame F on the inboard body and a frame M on this one."""

    parent = integer("row of the inboard body")
    kind = integer("kind of the inboard joint: WELD, REVOLUTE ...")
    root = integer("row of the body whose origin is the reference point")
    tree = integer("its tree, -1 when welded to the world")
    first_q = integer("first position of the inboard joint")
    first_dof = integer("first dof of the inboard joint")
    num_dofs = integer("dofs of the inboard joint")
    frame_F = integer("a frame of the model, -1 is the frame of the inboard body")
    frame_M = integer("a frame of the model, -1 is the frame of this body")
    inertia = integer("where in p are mass, centre of mass in B, unit inertia about Bo in B: 1 + 3 + 6 numbers")
    tip = integer("last dof that moves the body, -1 when none does; its ancestors are the others")
    along = integer(
        "the axis of F that is the axis of the joint: 1, 2, 3, negative when opposite; of a weld 1 when M is F; else 0"
    )
    direct = integer("1 when F and M are fixed to the bodies themselves, not to other frames")
    path = integer("first piece of the path of a curvilinear joint")
    path_end = integer("the piece after its last")
    gravity = integer("where in p is what is added to its gravity, three numbers; -1 for nothing")
    friction = integer("where in p is what its friction coefficients are multiplied with; -1 for nothing")
    turn = integer("place of its angle among `turn`, -1 when it has none")
    carrier = integer("row of the body that it is welded to, directly or through others, and falls with; else its own")


class JointAxis(Record):
    """Of a revolute, prismatic or screw joint."""

    axis_F = numbers(3, "unit vector")
    lead = number("how far a screw moves along the axis", "m/rad")


class JointPose(Record):
    """Of a weld; of a curvilinear joint, where its path begins."""

    X_FM = numbers((9, 3), "rotation and position", "-, m")


class PathPiece(Record):
    """Of the path of a curvilinear joint, in the plane through its beginning: x along the tangent there."""

    start = number("distance at which it begins", "m")
    rate = number("how fast M turns along it", "1/m")
    x = number("where it begins", "m")
    y = number("where it begins", "m")
    cos = number("of its direction there")
    sin = number("of its direction there")
    period = number("length after which the path begins anew, 0 when it does not", "m")


class Dof(Record):
    """A degree of freedom."""

    parent = integer("the dof next to it towards the base, -1 at the base")
    body = integer("row of the body whose inboard joint has it")
    tree = integer("its tree")
    depth = integer("number of ancestors")
    row = integer("where its row of a packed matrix starts")
    damping = integer("where in p its damping is")
    q = integer("its position when the joint has as many positions as velocities and qdot = v, else -1")
    run = integer("where the run that it ends begins: dofs each of which is the parent of the next")


class OffsetFrame(Record):
    """A frame fixed to a body, other than the body frame."""

    parent = integer("the frame it is fixed to, -1 is the body frame")
    pose = integer("where in p its pose is: nine numbers of R, row-major, then p")


class Tree(Record):
    """What moves together; its bodies are contiguous, so are its dofs."""

    first_body = integer("its base")
    num_bodies = integer("how many it has")
    first_dof = integer("its first dof")
    num_dofs = integer("how many it has")


class Actuator(Record):
    """What drives a dof."""

    dof = integer("the dof")
    rotor = integer("where in p its rotor inertia is")
    gear = integer("where in p its gear ratio is")


class Gravity(Record):
    """What acts on a body."""

    g_W = numbers(3, "gravity", "m/s²")


@table
class TreeModel(NamedTuple):
    """Constant arrays of a tree of bodies; below the bodies' rows of `joint` are the pieces of paths.

    `turn` tells the positions that are the angles of revolute and screw joints.
    """

    body: Annotated[IntMatrix, Items("bodies", Body)]
    joint: Annotated[Matrix, Items("axes", JointAxis), Items("poses", JointPose), Items("pieces", PathPiece)]
    dof: Annotated[IntMatrix, Items("dofs", Dof)]
    frame: Annotated[IntMatrix, Items("frames", OffsetFrame)]
    tree: Annotated[IntMatrix, Items("trees", Tree)]
    actuator: Annotated[IntMatrix, Items("actuators", Actuator)]
    gravity: Annotated[Matrix, Items("gravities", Gravity)]
    turn: IntVector


class BodyVelocity(Record):
    """About `root`."""

    V_WB = numbers((3, 3), "spatial velocity", "rad/s, m/s")


class BodyAcceleration(Record):
    """About `root`: of the velocity field, not of a point (Featherstone 2008, section 2.11)."""

    A_WB = numbers((3, 3), "spatial acceleration at zero vdot", "rad/s², m/s²")


class BodyInertia(Record):
    """About `root`."""

    mass = number("mass", "kg")
    first_moment = numbers(3, "mass times centre of mass", "kg m")
    second_moment = numbers(6, "xx, yy, zz, xy, xz, yz", "kg m²")
    inertia = numbers((1, 3, 6), "all three", "kg, kg m, kg m²", same_as=mass)


class BodyGravity(Record):
    """What acts on a body besides the model's gravity."""

    added_g_W = numbers(3, "gravity that a parameter adds", "m/s²")


class CompositeInertia(Record):
    """About `root`."""

    composite = numbers((1, 3, 6), "inertia of a carrier, all it carries and all outboard", "kg, kg m, kg m²")


class BodyForce(Record):
    """About `root`."""

    F = numbers((3, 3), "spatial force of a recursion", "N m, N")


class DofMotion(Record):
    """About `root`."""

    S = numbers((3, 3), "motion at unit speed")


@table
class TreeWork(NamedTuple):
    """Results of the stages, in the order in which they become valid: a row for each body, and `dofs`.

    `angle`, `sine` and `cosine` are of the joints that turn, with room for whole fours.
    `M` is the packed mass matrix, `L` the packed factor of M, or of M + dt D; `bias` has the generalized bias forces.
    """

    angle: Vector
    sine: Vector
    cosine: Vector
    X_WB: Annotated[Matrix, BodyPose]
    S: Annotated[Matrix, Items("dofs", DofMotion)]
    V: Annotated[Matrix, BodyVelocity]
    A: Annotated[Matrix, BodyAcceleration]
    inertia: Annotated[Matrix, BodyInertia]
    gravity: Annotated[Matrix, BodyGravity]
    composite: Annotated[Matrix, CompositeInertia]
    F: Annotated[Matrix, BodyForce]
    M: Vector
    L: Vector
    bias: Vector


def num_packed(model: TreeModel) -> int:
    """How many numbers a packed matrix has."""
    return int(np.sum(model.dof[:, Dof.depth] + 1))


def shapes_of_work(model: TreeModel) -> list[tuple[int, ...]]:
    """Of the arrays of a `TreeWork`."""
    nb, nv, packed = len(model.body), len(model.dof), num_packed(model)
    turns = 4 * -(-len(model.turn) // 4)
    of_bodies = [(nb, n) for n in (6, 6, BodyInertia.SIZE, 3, CompositeInertia.SIZE, 6)]
    return [*[(turns,)] * 3, (nb, BodyPose.SIZE), (nv, 6), *of_bodies, (packed,), (packed,), (nv,)]


def make_work(model: TreeModel, dtype: type = float) -> TreeWork:
    """A workspace in the state every stage expects: the world's row is set, and the rows of S that never change."""

    def zeros(shape: tuple[int, ...]) -> np.ndarray:
        return np.zeros(shape) if dtype is float else np.full(shape, 0.0, dtype=dtype)

    work = TreeWork(*map(zeros, shapes_of_work(model)))
    work.cosine[:] = 1.0  # of no angle: so it stays in the room behind the last joint
    work[0].R_WB = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    for row in np.flatnonzero(model.body[:, Body.kind] == FREE):
        dof = model.bodies[row].first_dof
        work.S[dof : dof + 6] = np.eye(6)
    return work
