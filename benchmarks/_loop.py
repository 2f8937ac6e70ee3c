"""Forward dynamics, and a compiled loop around it, as a C++ program would have it."""

from __future__ import annotations

from sheldrake.common.kernel import Matrix, Vector, kernel
from sheldrake.multibody.tree._kernels import dynamics, kinematics
from sheldrake.multibody.tree._kernels.model import TreeModel, TreeWork


@kernel(top=True, short_loops=True)
def forward_dynamics(
    model: TreeModel, p: Vector, work: TreeWork, q: Vector, v: Vector, tau: Vector, dt: float, vdot: Vector
) -> int:
    """vdot for applied forces tau, joint damping implicit over dt (0: explicit); all stages.

    Returns:
        0, or 1 + the dof at which the mass matrix is not positive definite.
    """
    kinematics.position_kinematics(model, p, work, q)
    dynamics.body_inertias(model, p, work)
    kinematics.velocity_kinematics(model, p, work, q, v)
    dynamics.bias_term(model, work, 1.0)
    dynamics.mass_matrix(model, p, work, work.M)
    for k in range(work.M.shape[0]):
        work.L[k] = work.M[k]
    for k in range(len(model.dofs)):
        dof = model.dofs[k]
        work.L[dof.row + dof.depth] += dt * p[dof.damping]
    bad = dynamics.ltdl(model, work.L)
    for k in range(vdot.shape[0]):
        vdot[k] = tau[k] - work.bias[k] - p[model.dofs[k].damping] * v[k]
    dynamics.ltdl_solve(model, work.L, vdot)
    return bad + 1


@kernel(top=True)
def repeat_forward_dynamics(
    model: TreeModel,
    p: Vector,
    work: TreeWork,
    states: Matrix,
    q: Vector,
    v: Vector,
    tau: Vector,
    vdot: Vector,
) -> int:
    """Forward dynamics for each row of `states`: q, v, tau."""
    nq = q.shape[0]
    nv = v.shape[0]
    status = 0
    for row in range(states.shape[0]):
        for k in range(nq):
            q[k] = states[row, k]
        for k in range(nv):
            v[k] = states[row, nq + k]
            tau[k] = states[row, nq + nv + k]
        status += forward_dynamics(model, p, work, q, v, tau, 0.0, vdot)
    return status
