"""Springs and dampers, on dofs and between bodies."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import (
    add3,
    add6,
    cross3,
    dot3,
    load3_at,
    load6,
    neg3,
    read3,
    rotate,
    scale3,
    store6,
    sub3,
)
from sheldrake.common.kernel import IntMatrix, Matrix, Vector, kernel
from sheldrake.multibody.tree._kernels.frames import load_pose
from sheldrake.multibody.tree._kernels.kinematics import velocity_at
from sheldrake.multibody.tree._kernels.model import ROOT, TreeModel, TreeWork

# Columns of ForceModel.spring: a spring on one dof; its parameters are stiffness and nominal position.
SPRING_DOF = np.int64(0)
SPRING_Q = np.int64(1)
SPRING_P = np.int64(2)

# Columns of ForceModel.strut: a linear spring and damper between a point P of body A and a point Q of body B; its
# parameters are p_AP (3), p_BQ (3), free length, stiffness, damping.
STRUT_A = np.int64(0)
STRUT_B = np.int64(1)
STRUT_P = np.int64(2)


class ForceModel(NamedTuple):
    """Force elements other than gravity; columns are named above.

    Attributes:
        spring: shape (num_springs, 3).
        strut: shape (num_struts, 3).
    """

    spring: IntMatrix
    strut: IntMatrix


@kernel
def add_dof_springs(force_model: ForceModel, p: Vector, q: Vector, tau: Vector) -> None:
    """Adds springs on dofs to tau, shape (nv,)."""
    for i in range(force_model.spring.shape[0]):
        at = force_model.spring[i, SPRING_P]
        stretch = q[force_model.spring[i, SPRING_Q]] - p[at + 1]
        tau[force_model.spring[i, SPRING_DOF]] -= p[at] * stretch


@kernel
def add_struts(model: TreeModel, force_model: ForceModel, p: Vector, work: TreeWork, F: Matrix) -> None:
    """Adds springs between points to F, spatial forces about `root`, shape (num_bodies, 6); needs velocities."""
    for i in range(force_model.strut.shape[0]):
        A = force_model.strut[i, STRUT_A]
        B = force_model.strut[i, STRUT_B]
        at = force_model.strut[i, STRUT_P]
        R_WA, p_WA = load_pose(work.X_WB, A)
        R_WB, p_WB = load_pose(work.X_WB, B)
        p_WP = add3(p_WA, rotate(R_WA, read3(p, at)))
        p_WQ = add3(p_WB, rotate(R_WB, read3(p, at + 3)))
        p_PQ = sub3(p_WQ, p_WP)
        length = sqrt(dot3(p_PQ, p_PQ))
        along = scale3(p_PQ, 1.0 / length)
        _, v_P = velocity_at(work, A, model.body[A, ROOT], p_WP)
        _, v_Q = velocity_at(work, B, model.body[B, ROOT], p_WQ)
        pull = p[at + 7] * (length - p[at + 6]) + p[at + 8] * dot3(sub3(v_Q, v_P), along)
        f_P = scale3(along, pull)
        add_point_force(model, work, F, A, p_WP, f_P)
        add_point_force(model, work, F, B, p_WQ, neg3(f_P))


@kernel
def add_point_force(model: TreeModel, work: TreeWork, F: Matrix, body: int, p_WP, f_P) -> None:
    """Adds a force through p_WP to the spatial force on a body, about `root`."""
    p_RootP = sub3(p_WP, load3_at(work.X_WB, model.body[body, ROOT], 9))
    store6(F, body, add6(load6(F, body), (cross3(p_RootP, f_P), f_P)))


@kernel
def add_body_forces(model: TreeModel, work: TreeWork, F_Bo_W: Matrix, F: Matrix) -> None:
    """Adds spatial forces at the body origins, shape (num_bodies, 6), to F, which is about `root`."""
    for body in range(1, model.body.shape[0]):
        t, f = load6(F_Bo_W, body)
        p_RootB = sub3(load3_at(work.X_WB, body, 9), load3_at(work.X_WB, model.body[body, ROOT], 9))
        store6(F, body, add6(load6(F, body), (add3(t, cross3(p_RootB, f)), f)))


@kernel
def add_at_body_origins(model: TreeModel, work: TreeWork, F: Matrix, F_Bo_W: Matrix) -> None:
    """Adds F, which is about `root`, to spatial forces at the body origins, shape (num_bodies, 6)."""
    for body in range(1, model.body.shape[0]):
        t, f = load6(F, body)
        p_RootB = sub3(load3_at(work.X_WB, body, 9), load3_at(work.X_WB, model.body[body, ROOT], 9))
        store6(F_Bo_W, body, add6(load6(F_Bo_W, body), (sub3(t, cross3(p_RootB, f)), f)))


def empty_force_model() -> ForceModel:
    """No force elements."""
    return ForceModel(np.zeros((0, 3), np.int64), np.zeros((0, 3), np.int64))
