"""Signed distance phi of a point to a shape (negative inside), its gradient and the nearest surface point.

Everything is in the frame G of the shape. Where the gradient is not unique, one is chosen by rule: the first axis, the
first of equally near faces.
"""

from __future__ import annotations

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import dot3, scale3, sub3
from sheldrake.common.kernel import kernel

from .table import absolute

_NEWTON_STEPS = 64


@kernel
def clamp(x, limit):
    if x > limit:
        return limit
    return -limit if x < -limit else x


@kernel
def signed(size, x):
    """`size` with the sign of x (plus for zero)."""
    return -size if x < 0.0 else size


@kernel
def point_sphere(p, radius):
    distance = sqrt(dot3(p, p))
    gradient = (1.0, 0.0, 0.0)
    if distance > 1e-14:
        gradient = scale3(p, 1.0 / distance)
    return distance - radius, gradient, scale3(gradient, radius)


@kernel
def point_box(p, h):
    q = (clamp(p[0], h[0]), clamp(p[1], h[1]), clamp(p[2], h[2]))
    r = sub3(p, q)
    distance2 = dot3(r, r)
    if distance2 > 0.0:
        distance = sqrt(distance2)
        return distance, scale3(r, 1.0 / distance), q
    gap0 = absolute(p[0]) - h[0]
    gap1 = absolute(p[1]) - h[1]
    gap2 = absolute(p[2]) - h[2]
    if gap0 >= gap1 and gap0 >= gap2:
        return gap0, (signed(1.0, p[0]), 0.0, 0.0), (signed(h[0], p[0]), p[1], p[2])
    if gap1 >= gap2:
        return gap1, (0.0, signed(1.0, p[1]), 0.0), (p[0], signed(h[1], p[1]), p[2])
    return gap2, (0.0, 0.0, signed(1.0, p[2])), (p[0], p[1], signed(h[2], p[2]))


@kernel
def point_cylinder(p, radius, half_length):
    rho = sqrt(p[0] * p[0] + p[1] * p[1])
    ex, ey = 1.0, 0.0
    if rho > 1e-14 * radius:
        ex, ey = p[0] / rho, p[1] / rho
    z_end = signed(half_length, p[2])
    out = rho - radius
    above = absolute(p[2]) - half_length
    if out <= 0.0 and above > out:
        return above, (0.0, 0.0, signed(1.0, p[2])), (p[0], p[1], z_end)
    if above <= 0.0:
        return out, (ex, ey, 0.0), (radius * ex, radius * ey, p[2])
    distance = sqrt(out * out + above * above)
    gradient = (ex * out / distance, ey * out / distance, signed(above, p[2]) / distance)
    return distance, gradient, (radius * ex, radius * ey, z_end)


@kernel
def point_capsule(p, radius, half_length):
    z = clamp(p[2], half_length)
    r = (p[0], p[1], p[2] - z)
    distance = sqrt(dot3(r, r))
    gradient = (1.0, 0.0, 0.0)
    if distance > 1e-14 * radius:
        gradient = scale3(r, 1.0 / distance)
    nearest = (radius * gradient[0], radius * gradient[1], z + radius * gradient[2])
    return distance - radius, gradient, nearest


@kernel(outline=True)
def point_ellipsoid(p, a):
    """The nearest point x solves x_i = a_i^2 p_i / (t + a_i^2), sum (x_i / a_i)^2 = 1 (Eberly 2013).

    With s = t + min a^2 the function is convex and falls on s > 0; Newton's method from its left side is monotone.
    """
    least = min(a[0], a[1], a[2])
    tiny = 1e-30 * least
    y0 = absolute(p[0]) + tiny
    y1 = absolute(p[1]) + tiny
    y2 = absolute(p[2]) + tiny
    d0 = (a[0] - least) * (a[0] + least)
    d1 = (a[1] - least) * (a[1] + least)
    d2 = (a[2] - least) * (a[2] + least)
    s = max(a[0] * y0 - d0, a[1] * y1 - d1, a[2] * y2 - d2)
    for _ in range(_NEWTON_STEPS):
        r0 = a[0] * y0 / (s + d0)
        r1 = a[1] * y1 / (s + d1)
        r2 = a[2] * y2 / (s + d2)
        value = r0 * r0 + r1 * r1 + r2 * r2 - 1.0
        slope = -2.0 * (r0 * r0 / (s + d0) + r1 * r1 / (s + d1) + r2 * r2 / (s + d2))
        step = -value / slope
        s += step
        if step <= 1e-16 * s:
            break
    x = (
        signed(a[0] * a[0] * y0 / (s + d0), p[0]),
        signed(a[1] * a[1] * y1 / (s + d1), p[1]),
        signed(a[2] * a[2] * y2 / (s + d2), p[2]),
    )
    m = (x[0] / (a[0] * a[0]), x[1] / (a[1] * a[1]), x[2] / (a[2] * a[2]))
    gradient = scale3(m, 1.0 / sqrt(dot3(m, m)))
    return dot3(sub3(p, x), gradient), gradient, x
