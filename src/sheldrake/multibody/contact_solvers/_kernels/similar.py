"""kSimilar: normal impulse and friction share one argument, so that dissipation acts with a Coulomb cone coupled to it.

Castro, Han, Masterjohn 2023, "A theory of irrotational contact fields", section V-B.
"""

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.hunt_crossley import (
    normal_impulse,
    normal_impulse_integral,
)


@kernel
def similar_cost(k, d, mu, fe0, back, eps, dt, vc):
    """l(vc) = -N(vn - mu s(vt)) [J]."""
    vx, vy, vn = vc
    slip = sqrt(vx * vx + vy * vy + eps * eps) - eps
    return -normal_impulse_integral(k, d, fe0, back, dt, vn - mu * slip)


@kernel
def similar_impulse(k, d, mu, fe0, back, eps, dt, vc):
    """Impulse gamma [N s] and G = -dgamma/dvc [kg] as (xx, xy, yy, xz, yz, zz)."""
    vx, vy, vn = vc
    norm = sqrt(vx * vx + vy * vy + eps * eps)
    tx = vx / norm
    ty = vy / norm
    z = vn - mu * (norm - eps)
    n, slope = normal_impulse(k, d, fe0, back, dt, z)
    gamma = (-mu * n * tx, -mu * n * ty, n)
    along = -mu * mu * slope
    across = mu * n / norm
    G = (
        along * tx * tx + across * (1.0 - tx * tx),
        (along - across) * tx * ty,
        along * ty * ty + across * (1.0 - ty * ty),
        mu * slope * tx,
        mu * slope * ty,
        -slope,
    )
    return gamma, G
