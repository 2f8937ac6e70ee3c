"""Jacobians of velocities with respect to v, by walking from a body to the base of its tree."""

from __future__ import annotations

from sheldrake.common._kernels.vec import (
    add3,
    column3,
    cross3,
    load3_at,
    load6,
    rotate,
    rotate_back,
    scale3,
    store_column3,
    sub3,
)
from sheldrake.common.kernel import IntVector, Matrix, Vector, kernel
from sheldrake.multibody.tree._kernels.frames import pose_of_frame, relative_pose, store_pose
from sheldrake.multibody.tree._kernels.model import DOF_PARENT, ROOT, TIP, TreeModel, TreeWork


@kernel
def add_body_jacobian(model: TreeModel, work: TreeWork, body: int, p_WQ, sign: float, J: Matrix) -> None:
    """Adds sign times the spatial velocity Jacobian of the body-fixed point at p_WQ to J, shape (6, nv)."""
    p_RootQ = sub3(p_WQ, load3_at(work.X_WB, model.body[body, ROOT], 9))
    k = model.body[body, TIP]
    while k >= 0:
        w, u = load6(work.S, k)
        u = add3(u, cross3(w, p_RootQ))
        J[0, k] += sign * w[0]
        J[1, k] += sign * w[1]
        J[2, k] += sign * w[2]
        J[3, k] += sign * u[0]
        J[4, k] += sign * u[1]
        J[5, k] += sign * u[2]
        k = model.dof[k, DOF_PARENT]


@kernel(top=True, short_loops=True)
def calc_relative_jacobian(model: TreeModel, work: TreeWork, bodies: IntVector, point: Vector, J: Matrix) -> None:
    """Spatial velocity Jacobian of a point Q of body B measured in body A, expressed in W; needs `calc_positions`.

    Args:
        model: The tree.
        work: Its workspace.
        bodies: Rows of B and A.
        point: p_WQ [m], shape (3,).
        J: Filled, shape (6, nv).
    """
    for k in range(model.dof.shape[0]):
        for r in range(6):
            J[r, k] = 0.0
    p_WQ = (point[0], point[1], point[2])
    add_body_jacobian(model, work, bodies[0], p_WQ, 1.0, J)
    add_body_jacobian(model, work, bodies[1], p_WQ, -1.0, J)


@kernel(top=True, short_loops=True)
def calc_frame_jacobian(model: TreeModel, p: Vector, work: TreeWork, ends: IntVector, point: Vector, J: Matrix) -> None:
    """Spatial velocity Jacobian of a point of frame B measured in frame A, expressed in E; needs `calc_positions`.

    Args:
        model: The tree.
        p: Parameters.
        work: Its workspace.
        ends: Body row and frame row of B, body row of A, body row and frame row of E; frame row -1 is a body frame.
        point: p_BoBp_B [m], shape (3,).
        J: Filled, shape (6, nv).
    """
    for k in range(model.dof.shape[0]):
        for r in range(6):
            J[r, k] = 0.0
    R_WB, p_WB = pose_of_frame(model, p, work.X_WB, ends[0], ends[1])
    p_WQ = add3(p_WB, rotate(R_WB, (point[0], point[1], point[2])))
    add_body_jacobian(model, work, ends[0], p_WQ, 1.0, J)
    add_body_jacobian(model, work, ends[2], p_WQ, -1.0, J)
    if ends[3] > 0 or ends[4] >= 0:
        R_WE, _ = pose_of_frame(model, p, work.X_WB, ends[3], ends[4])
        for k in range(model.dof.shape[0]):
            store_column3(J, 0, k, rotate_back(R_WE, column3(J, 0, k)))
            store_column3(J, 3, k, rotate_back(R_WE, column3(J, 3, k)))


@kernel(top=True, short_loops=True)
def calc_relative_pose(model: TreeModel, p: Vector, work: TreeWork, ends: IntVector, X: Matrix) -> None:
    """X_AB of frame B in frame A, shape (1, 12); needs `calc_positions`.

    `ends` holds body row and frame row of A, then of B.
    """
    X_WA = pose_of_frame(model, p, work.X_WB, ends[0], ends[1])
    R_AB, p_AB = relative_pose(X_WA, pose_of_frame(model, p, work.X_WB, ends[2], ends[3]))
    store_pose(X, 0, R_AB, p_AB)


@kernel(top=True, short_loops=True)
def calc_momentum_jacobian(model: TreeModel, work: TreeWork, mask: IntVector, J: Matrix) -> None:
    """Jacobian of the linear momentum of the masked bodies, in W [kg, kg m], shape (3, nv); needs `calc_positions`."""
    for k in range(model.dof.shape[0]):
        for r in range(3):
            J[r, k] = 0.0
    for body in range(1, model.body.shape[0]):
        if mask[body] != 0:
            mass = work.inertia[body, 0]
            h = load3_at(work.inertia, body, 1)
            k = model.body[body, TIP]
            while k >= 0:
                w, u = load6(work.S, k)
                column = add3(scale3(u, mass), cross3(w, h))
                J[0, k] += column[0]
                J[1, k] += column[1]
                J[2, k] += column[2]
                k = model.dof[k, DOF_PARENT]
