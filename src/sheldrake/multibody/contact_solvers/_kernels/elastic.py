"""Normal impulse of a spring without dissipation, which gives back all the energy it has taken.

A step is q1 = q0 + h v1. Half a step back, at s = q - h v / 2, the same motion is s1 = s0 + h (v0 + v1) / 2: a force
whose work along s1 - s0 is the change of the spring's energy E(s) keeps kinetic energy, weight and E(s) together
constant, whatever the step and the stiffness. That force is the slope of the secant of E (Gonzalez 1996, "Time
integration and discrete Hamiltonian systems"). Since E is convex, it falls with v1, and the step's problem is convex.

Names: f0, f1 are what the spring's force would be at s0 and s1, negative before it touches; fe0 at q0 [N].
"""

from sheldrake.common._kernels.generic import log
from sheldrake.common.kernel import kernel


@kernel
def secant_force(f0, f1):
    """(E1 - E0) / (s0 - s1) [N], and its derivative with respect to f1."""
    zero = 0.0 * f1
    if f0 > 0.0:
        if f1 >= 0.0:
            return 0.5 * (f0 + f1), 0.5 + zero
        part = f0 / (f0 - f1)
        return 0.5 * f0 * part, 0.5 * part * part
    if f1 <= 0.0:
        return zero, zero
    part = f1 / (f1 - f0)
    return 0.5 * f1 * part, part - 0.5 * part * part


@kernel(outline=True)
def elastic_impulse(k, fe0, back, dt, z):
    """n(z) [N s] and its derivative [kg], of normal velocity z at the end; `back` = f0 - fe0."""
    force, slope = secant_force(fe0 + back, fe0 - 0.5 * dt * k * z)
    return dt * force, -0.5 * dt * dt * k * slope


@kernel(outline=True)
def elastic_integral(k, fe0, back, dt, z):
    """An antiderivative of n(z) [J]."""
    f0 = fe0 + back
    f1 = fe0 - 0.5 * dt * k * z
    total = 0.0 * f1
    if f0 > 0.0:
        if f1 >= 0.0:
            total = 0.5 * f0 * f1 + 0.25 * f1 * f1
        else:
            total = -0.5 * f0 * f0 * log(1.0 - f1 / f0)
    elif f1 > 0.0:
        total = 0.25 * f1 * f1 + 0.5 * f0 * f1
        if f0 < 0.0:
            total += 0.5 * f0 * f0 * log(1.0 - f1 / f0)
    return -2.0 / k * total


@kernel
def half_a_step_back(k, depth, dt, reach, vn0):
    """f0 - fe0 of a contact [N]; 0, for backward Euler, if the energy it has at s0 was given to nobody.

    That is where the last step did not see it, as it was farther than `reach` from touching.
    """
    if depth + 0.5 * dt * vn0 > 0.0 and depth + dt * vn0 <= -reach:
        return 0.0 * vn0
    return 0.5 * dt * k * vn0
