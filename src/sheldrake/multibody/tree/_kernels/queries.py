"""Entries for queries from Python: stages composed, one call each."""

from __future__ import annotations

from sheldrake.common.kernel import Matrix, Vector, kernel
from sheldrake.multibody.tree._kernels import dynamics, factor, kinematics
from sheldrake.multibody.tree._kernels.model import DAMPING, TreeModel, TreeWork


@kernel(top=True)
def calc_positions(model: TreeModel, p: Vector, work: TreeWork, q: Vector) -> None:
    """`X_WB`, `S`, and `inertia`."""
    kinematics.position_kinematics(model, p, work, q)
    dynamics.body_inertias(model, p, work)


@kernel(top=True)
def calc_velocities(model: TreeModel, p: Vector, work: TreeWork, q: Vector, v: Vector) -> None:
    """`V` and `A`; needs `calc_positions`."""
    kinematics.velocity_kinematics(model, p, work, q, v)


@kernel(top=True)
def calc_mass_matrix(model: TreeModel, p: Vector, work: TreeWork, M: Matrix) -> None:
    """`work.M` and the dense mass matrix, shape (nv, nv), zeroed before; needs `calc_positions`."""
    dynamics.mass_matrix(model, p, work)
    factor.unpack(model, work.M, M)


@kernel(top=True)
def calc_bias(model: TreeModel, work: TreeWork, gravity_scale: float, bias: Vector) -> None:
    """C(q, v) v - gravity_scale * tau_g(q), shape (nv,); needs `calc_velocities`."""
    dynamics.bias_term(model, work, gravity_scale)
    for k in range(bias.shape[0]):
        bias[k] = work.bias[k]


@kernel(top=True)
def calc_inverse_dynamics(
    model: TreeModel, p: Vector, work: TreeWork, vdot: Vector, gravity_scale: float, A_work: Matrix, tau: Vector
) -> None:
    """M vdot + C v - gravity_scale * tau_g; needs `calc_velocities`."""
    dynamics.inverse_dynamics(model, p, work, vdot, gravity_scale, A_work, tau)


@kernel(top=True)
def calc_forward_dynamics(
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
    dynamics.mass_matrix(model, p, work)
    dynamics.damped_mass_matrix(model, p, work, dt)
    bad = factor.ltdl(model, work.L)
    for k in range(vdot.shape[0]):
        vdot[k] = tau[k] - work.bias[k] - p[model.dof[k, DAMPING]] * v[k]
    factor.ltdl_solve(model, work.L, vdot)
    return bad + 1
