"""How far a TAMSI iteration may move the slip velocity of one contact (Castro et al. 2020, section V)."""

import numpy as np

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.gradient import root

COS_MAX = np.float64(0.5)  # a slip velocity may turn by 60 degrees in one iteration
TOLERANCE = np.float64(0.01)  # slip below this fraction of the stiction tolerance counts as none


@kernel
def step_limit(vt, dvt, vs):
    """Largest step in (0, 1] along dvt that does not jump over the stiction region; -1 when there is none."""
    small = TOLERANCE * vs
    v1 = (vt[0] + dvt[0], vt[1] + dvt[1])
    d2 = dvt[0] * dvt[0] + dvt[1] * dvt[1]
    if d2 < small * small:
        return 1.0 + 0.0 * d2
    d = sqrt(d2)
    vv = vt[0] * vt[0] + vt[1] * vt[1]
    vv1 = v1[0] * v1[0] + v1[1] * v1[1]
    slip = root(vv) / vs
    slip1 = root(vv1) / vs
    if slip < TOLERANCE and slip1 > 1.0:
        return 0.5 * vs / d
    if slip > 1.0 and slip1 < TOLERANCE:
        return 1.0 - 0.5 * vs / d
    if slip < 1.0 or slip1 < 1.0:
        return 1.0 + 0.0 * d2
    along = vt[0] * dvt[0] + vt[1] * dvt[1]
    if along < 0.0:
        closest = -along / d2
        if closest < 1.0:
            wx = vt[0] + closest * dvt[0]
            wy = vt[1] + closest * dvt[1]
            least = wx * wx + wy * wy
            if least < small * small:
                return closest - 0.5 * vs / d
            if least < vs * vs:
                return closest
    cosine = (vt[0] * v1[0] + vt[1] * v1[1]) / (slip * slip1 * vs * vs)
    if cosine > COS_MAX:
        return 1.0 + 0.0 * d2
    return turn_limit(slip * slip, along / (vs * vs), d / vs)


@kernel
def turn_limit(x2, x_dx, dx):
    """Smallest positive step at which the slip velocity has turned by the largest allowed angle."""
    c2 = COS_MAX * COS_MAX
    A = x2 * dx * dx * c2 - x_dx * x_dx
    B = 2.0 * x2 * x_dx * (c2 - 1.0)
    C = x2 * x2 * (c2 - 1.0)
    if A < 2.220446049250313e-16 and A > -2.220446049250313e-16:
        return -C / B
    discriminant = B * B - 4.0 * A * C
    if not discriminant > 0.0:
        return -1.0 + 0.0 * A
    s = sqrt(discriminant)
    if B > 0.0:
        numerator = -0.5 * (B + s)
    else:
        numerator = -0.5 * (B - s)
    first = numerator / A
    second = C / numerator
    if first > 0.0 and second > 0.0:
        return first if first < second else second
    return first if first > second else second
