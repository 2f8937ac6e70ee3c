"""One-row constraints: a regularised multiplier between bounds (limits, holonomic rows, actuators)."""

from sheldrake.common.kernel import kernel


@kernel
def row_impulse(R, vhat, lower, upper, vc):
    """gamma = clamp((vhat - vc) / R, lower, upper) and G = -dgamma/dvc."""
    y = (vhat - vc) / R
    if y <= lower:
        return lower + 0.0 * y, 0.0 * y
    if y >= upper:
        return upper + 0.0 * y, 0.0 * y
    return y, 1.0 / R + 0.0 * y


@kernel
def row_cost(R, vhat, lower, upper, vc):
    """R y^2 / 2 between the bounds, linear beyond them."""
    y = (vhat - vc) / R
    if y <= lower:
        return -lower * vc
    if y >= upper:
        return -upper * vc
    return 0.5 * R * y * y
