"""kSap: linear compliance with a relaxation time and the exact friction cone, regularised.

Castro, Permenter, Han 2022, "An unconstrained convex formulation of compliant contact", sections III and V.
"""

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common.kernel import kernel


@kernel
def sap_cone_impulse(mu, Rt, Rn, vhat, vc):
    """Impulse gamma = P(R^-1 (vhat - vc)) [N s] and G = -dgamma/dvc [kg] as (xx, xy, yy, xz, yz, zz)."""
    yx = -vc[0] / Rt
    yy = -vc[1] / Rt
    yn = (vhat - vc[2]) / Rn
    yr = sqrt(yx * yx + yy * yy + 1e-14)  # soft norm; (1e-7 N s)^2
    zero = 0.0 * yn
    gamma = (zero, zero, zero)
    G = (zero, zero, zero, zero, zero, zero)
    mu_hat = mu * Rt / Rn
    if yr <= mu * yn:
        gamma = (yx, yy, yn)
        G = (1.0 / Rt + zero, zero, 1.0 / Rt + zero, zero, zero, 1.0 / Rn + zero)
    elif -mu_hat * yr < yn:
        tx = yx / yr
        ty = yy / yr
        f = 1.0 / (1.0 + mu * mu_hat)
        gn = (yn + mu_hat * yr) * f
        across = mu * gn / yr
        along = mu * mu_hat * f
        gamma = (mu * gn * tx, mu * gn * ty, gn)
        G = (
            (across * (1.0 - tx * tx) + along * tx * tx) / Rt,
            (along - across) * tx * ty / Rt,
            (across * (1.0 - ty * ty) + along * ty * ty) / Rt,
            mu * f * tx / Rn,
            mu * f * ty / Rn,
            f / Rn,
        )
    return gamma, G


@kernel
def sap_cone_cost(mu, Rt, Rn, vhat, vc):
    """l(vc) = 1/2 gamma^T R gamma [J]."""
    gamma, _ = sap_cone_impulse(mu, Rt, Rn, vhat, vc)
    return 0.5 * (Rt * (gamma[0] * gamma[0] + gamma[1] * gamma[1]) + Rn * gamma[2] * gamma[2])
