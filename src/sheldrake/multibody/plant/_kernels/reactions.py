"""What joints transmit: Newton and Euler on each body, from the tips to the base."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from sheldrake.common._kernels.vec import (
    add3,
    add6,
    cross3,
    load3,
    load6,
    neg3,
    rotate_back,
    scale6,
    store6,
    sub3,
    sub6,
)
from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector, kernel
from sheldrake.common.record import Items, Record, integer, table
from sheldrake.multibody.tree._kernels import dynamics, forces
from sheldrake.multibody.tree._kernels.forces import ForceModel
from sheldrake.multibody.tree._kernels.kinematics import pose_of_frame
from sheldrake.multibody.tree._kernels.model import TreeModel, TreeWork


class JointEnd(Record):
    """Frame M of the joint inboard of a body."""

    body = integer("row of its body")
    frame = integer("a frame of the tree; -1 is the body frame")
    sign = integer("-1 where the joint's child is the inboard body")


@table
class JointEnds(NamedTuple):
    """By row of the body; the world's says nothing."""

    end: Annotated[IntMatrix, Items("ends", JointEnd)]


@kernel(top=True, short_loops=True)
def calc_reactions(
    model: TreeModel,
    force_model: ForceModel,
    p: Vector,
    work: TreeWork,
    vdot: Vector,
    touching: IntVector,
    points: Matrix,
    forces_B_W: Matrix,
    other: Matrix,
    joints: JointEnds,
    A_WB: Matrix,
    F: Matrix,
    reactions: Matrix,
) -> None:
    """Spatial forces of the inboard joints on their children, at M and expressed in M, by row of the body.

    What moves a body at the accelerations vdot, less what acts on it otherwise, comes through its inboard joint.

    Args:
        model: The tree.
        force_model: Its force elements.
        p: Parameters.
        work: Its workspace with positions, velocities and inertias.
        vdot: Generalized accelerations.
        touching: Rows of bodies A and B of each point of contact, then, as its last item, how many there are.
        points: Where they are in W [m], as many rows as there is room for.
        forces_B_W: Forces on B there [N].
        other: Spatial forces about `root` of what else acts on bodies [N m, N], by row; those of contacts and force
            elements are added.
        joints: Their frames M.
        A_WB: Filled with accelerations about `root`.
        F: Filled with what the inboard joints transmit, about `root`.
        reactions: Filled, shape (num_bodies, 6); the world's row stays.
    """
    dynamics.accelerations(model, work, vdot, A_WB)
    forces.add_struts(model, force_model, p, work, other)
    forces.add_bushings(model, force_model, p, work, other)
    for i in range(touching[touching.shape[0] - 1]):
        point, force = load3(points, i), load3(forces_B_W, i)
        forces.add_point_force(model, work, other, touching[2 * i + 1], point, force)
        forces.add_point_force(model, work, other, touching[2 * i], point, neg3(force))
    for b in range(1, len(model.bodies)):
        inertial = dynamics.inertial_force(model, work, b, work[b].inertia, load6(A_WB, b), 1.0)
        store6(F, b, sub6(inertial, load6(other, b)))
    for b in range(len(model.bodies) - 1, 0, -1):
        parent = model.bodies[b].parent
        p_WRoot = work[model.bodies[b].root].p_WB
        torque, force = load6(F, b)
        arm = sub3(p_WRoot, work[model.bodies[parent].root].p_WB)
        if parent > 0:
            store6(F, parent, add6(load6(F, parent), (add3(torque, cross3(arm, force)), force)))
        end = joints.ends[b]
        R_WM, p_WM = pose_of_frame(model, p, work, end.body, end.frame)
        torque = add3(torque, cross3(sub3(p_WRoot, p_WM), force))
        store6(reactions, b, scale6((rotate_back(R_WM, torque), rotate_back(R_WM, force)), 1.0 * end.sign))
