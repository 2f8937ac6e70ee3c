"""Planes through points and their neighbours."""

from __future__ import annotations

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, kernel

_SWEEPS = 16
"""Many more than there are before nothing is left beside the diagonal."""


@kernel
def rotation_for(app, aqq, apq):
    """Tangent of the angle that makes the element beside the diagonal zero (Golub and Van Loan, section 8.5.2)."""
    theta = (aqq - app) / (2.0 * apq)
    size = abs(theta) + sqrt(theta * theta + 1.0)
    return 1.0 / size if theta >= 0.0 else -1.0 / size


@kernel
def rotate_pair(x, y, s, tau):
    return x - s * (y + tau * x), y + s * (x - tau * y)


@kernel
def turn(app, aqq, apq, arp, arq, u, v):
    """One of Jacobi's rotations in the plane of two axes: the matrix, and the axes u and v themselves."""
    if apq == 0.0:
        return app, aqq, arp, arq, u, v
    t = rotation_for(app, aqq, apq)
    c = 1.0 / sqrt(t * t + 1.0)
    s = t * c
    tau = s / (1.0 + c)
    arp, arq = rotate_pair(arp, arq, s, tau)
    u0, v0 = rotate_pair(u[0], v[0], s, tau)
    u1, v1 = rotate_pair(u[1], v[1], s, tau)
    u2, v2 = rotate_pair(u[2], v[2], s, tau)
    return app - t * apq, aqq + t * apq, arp, arq, (u0, u1, u2), (v0, v1, v2)


@kernel
def least_axis(xx, yy, zz, xy, xz, yz):
    """Unit eigenvector of the smallest eigenvalue of a symmetric matrix, by Jacobi's rotations."""
    u, v, w = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    for _ in range(_SWEEPS):
        if abs(xy) + abs(xz) + abs(yz) <= 1e-300:
            break
        xx, yy, xz, yz, u, v = turn(xx, yy, xy, xz, yz, u, v)
        xy = 0.0
        xx, zz, xy, yz, u, w = turn(xx, zz, xz, xy, yz, u, w)
        xz = 0.0
        yy, zz, xy, xz, v, w = turn(yy, zz, yz, xy, xz, v, w)
        yz = 0.0
    if xx <= yy and xx <= zz:
        return u
    return v if yy <= zz else w


@kernel(top=True)
def normals_of_planes(points: Matrix, near: IntMatrix, counts: IntVector, normals: Matrix) -> None:
    """Unit normals of the planes that the neighbours of points are closest to; of points with two or more of them.

    Args:
        points: Shape (n, 3).
        near: Numbers of neighbours, in no order; n stands for none.
        counts: How many each has, shape (n,); filled.
        normals: Shape (n, 3); filled.
    """
    n, most = near.shape
    for i in range(n):
        count = 0
        x = y = z = 0.0
        for k in range(most):
            j = near[i, k]
            if j < n:
                count += 1
                x, y, z = x + points[j, 0], y + points[j, 1], z + points[j, 2]
        counts[i] = count
        if count < 2:
            continue
        x, y, z = x / count, y / count, z / count
        xx = yy = zz = xy = xz = yz = 0.0
        for k in range(most):
            j = near[i, k]
            if j < n:
                a, b, c = points[j, 0] - x, points[j, 1] - y, points[j, 2] - z
                xx, yy, zz = xx + a * a, yy + b * b, zz + c * c
                xy, xz, yz = xy + a * b, xz + a * c, yz + b * c
        normal = least_axis(xx, yy, zz, xy, xz, yz)
        normals[i, 0], normals[i, 1], normals[i, 2] = normal
