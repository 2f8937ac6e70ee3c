"""What joints transmit: Newton and Euler on each body, from the tips to the base."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import (
    add3,
    add6,
    cross3,
    dot3,
    load3,
    load6,
    neg3,
    rotate_back,
    scale3,
    scale6,
    store6,
    sub3,
    sub6,
)
from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector, kernel
from sheldrake.common.record import Items, Record, integer, table
from sheldrake.multibody.contact_solvers._kernels.problem import HOLONOMIC, Problem, Rows
from sheldrake.multibody.plant._kernels.model import COUPLER, PlantModel
from sheldrake.multibody.tree._kernels import dynamics, forces
from sheldrake.multibody.tree._kernels.forces import ForceModel
from sheldrake.multibody.tree._kernels.kinematics import point_on, pose_of_frame
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


@kernel
def point_in(tree, b, p, at):
    """p_WP of a point fixed to body b, whose p_BP is p[at:at + 3]."""
    return point_on(tree, b, (p[at], p[at + 1], p[at + 2]))


@kernel
def three_forces(rows, r, dt):
    """Forces of three rows, the first of which is r."""
    return rows[r].gamma / dt, rows[r + 1].gamma / dt, rows[r + 2].gamma / dt


@kernel(top=True, short_loops=True)
def add_constraint_forces(
    model: TreeModel,
    plant_model: PlantModel,
    p: Vector,
    tree: TreeWork,
    rows: Rows,
    problem: Problem,
    dt: float,
    F: Matrix,
) -> None:
    """Adds to F, about `root`, what distance, ball and weld constraints exert on both bodies in a step of dt [s].

    Couplers act along joints.
    """
    for r in range(problem.num_rows):
        n = rows[r].group
        if rows[r].kind != HOLONOMIC or n == 0:
            continue
        constraint = plant_model.constraints[rows[r].owner]
        if constraint.kind == COUPLER:
            continue
        a, b, at = constraint.A, constraint.B, constraint.p
        if n == 6:  # a weld, whose positions follow its rotations
            torque, force = three_forces(rows, r, dt), three_forces(rows, r + 3, dt)
            forces.add_force(F, b, (torque, (0.0, 0.0, 0.0)))
            forces.add_force(F, a, (neg3(torque), (0.0, 0.0, 0.0)))
            middle = scale3(add3(point_in(tree, a, p, at + 9), point_in(tree, b, p, at + 21)), 0.5)
            forces.add_point_force(model, tree, F, b, middle, force)
            forces.add_point_force(model, tree, F, a, middle, neg3(force))
            continue
        p_WP, p_WQ = point_in(tree, a, p, at), point_in(tree, b, p, at + 3)
        if n == 1:
            p_PQ = sub3(p_WQ, p_WP)
            force = scale3(p_PQ, rows[r].gamma / (dt * sqrt(dot3(p_PQ, p_PQ))))
        else:
            force = three_forces(rows, r, dt)
        forces.add_point_force(model, tree, F, b, p_WQ, force)
        forces.add_point_force(model, tree, F, a, p_WP, neg3(force))


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
