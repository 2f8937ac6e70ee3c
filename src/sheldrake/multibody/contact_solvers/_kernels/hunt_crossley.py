"""Normal impulse of a Hunt-Crossley spring-damper (Castro, Han, Masterjohn 2023, section IV), or of an elastic spring.

`back` is zero for the former, see `elastic.half_a_step_back`.
"""

from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.elastic import elastic_impulse, elastic_integral


@kernel
def elastic_force(k, fe0, dt, z):
    """Spring force at the end of a step with normal velocity z [N]."""
    return fe0 - dt * k * z


@kernel
def normal_impulse(k, d, fe0, back, dt, z):
    """n(z) = dt (fe0 - dt k z)+ (1 - d z)+ [N s] and its derivative, which is never positive [kg]."""
    if back != 0.0:
        return elastic_impulse(k, fe0, back, dt, z)
    force = elastic_force(k, fe0, dt, z)
    damping = 1.0 - d * z
    if force <= 0.0 or damping <= 0.0:
        return 0.0 * z, 0.0 * z
    return dt * force * damping, -dt * (k * dt * damping + d * force)


@kernel
def normal_impulse_integral(k, d, fe0, back, dt, z):
    """N(z), an antiderivative of `normal_impulse`, constant once contact is lost [J]."""
    if back != 0.0:
        return elastic_integral(k, fe0, back, dt, z)
    open_spring = fe0 / dt / (k + 1e-20)
    open_damper = 1.0 / (d + 1e-20)
    s = z
    if s > open_spring:
        s = open_spring
    if s > open_damper:
        s = open_damper
    change = -dt * k * s
    return dt * (s * (fe0 + 0.5 * change) - d * s * s * 0.5 * (fe0 + 2.0 / 3.0 * change))
