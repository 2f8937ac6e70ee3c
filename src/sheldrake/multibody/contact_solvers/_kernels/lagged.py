"""kLagged: Hunt-Crossley normal force, Coulomb friction bounded by the normal impulse of the step's start.

Castro, Han, Masterjohn 2023, "A theory of irrotational contact fields", section V-A.
"""

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.hunt_crossley import (
    normal_impulse,
    normal_impulse_integral,
)


@kernel
def lagged_cost(k, d, mu, fe0, back, n0, eps, dt, vc):
    """l(vc) = -N(vn) + mu n0 s(vt) [J]."""
    vx, vy, vn = vc
    slip = sqrt(vx * vx + vy * vy + eps * eps) - eps
    return mu * n0 * slip - normal_impulse_integral(k, d, fe0, back, dt, vn)


@kernel
def lagged_impulse(k, d, mu, fe0, back, n0, eps, dt, vc):
    """Impulse gamma [N s] and G = -dgamma/dvc [kg] as (xx, xy, yy, xz, yz, zz)."""
    vx, vy, vn = vc
    soft = 1.0 / sqrt(vx * vx + vy * vy + eps * eps)
    tx = vx * soft
    ty = vy * soft
    friction = mu * n0
    stiffness = friction * soft
    n, slope = normal_impulse(k, d, fe0, back, dt, vn)
    gamma = (-friction * tx, -friction * ty, n)
    zero = 0.0 * vn
    G = (
        stiffness * (1.0 - tx * tx),
        -stiffness * tx * ty,
        stiffness * (1.0 - ty * ty),
        zero,
        zero,
        -slope,
    )
    return gamma, G
