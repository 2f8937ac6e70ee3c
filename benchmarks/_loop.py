"""A compiled loop around a query, as a C++ program would have it."""

from __future__ import annotations

from sheldrake.common.kernel import Matrix, Vector, kernel
from sheldrake.multibody.tree._kernels import queries
from sheldrake.multibody.tree._kernels.model import TreeModel, TreeWork


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
        status += queries.calc_forward_dynamics(model, p, work, q, v, tau, 0.0, vdot)
    return status
