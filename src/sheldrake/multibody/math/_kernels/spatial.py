"""Spatial vectors and inertias by themselves, in the order of operations of the methods that they are short ways for.

Vectors have 6 numbers, the angular part first; unit inertias are matrices by rows.
"""

from __future__ import annotations

from sheldrake.common._kernels.generic import mul_add
from sheldrake.common._kernels.poses import product, row_times, turned
from sheldrake.common._kernels.vec import cross3, magnitude, read3, read9, transpose, write3, write9
from sheldrake.common.kernel import Vector, kernel

NOT_PLAUSIBLE = 1
"""Status: numbers that need a closer look, and words if they are wrong."""
_SLACK = 16 * 2.220446049250313e-16  # as in `_rotational_inertia.py`


@kernel(top=True)
def join_spatial(top: Vector, bottom: Vector, out: Vector) -> None:
    """Both parts."""
    for i in range(3):
        out[i], out[3 + i] = top[i], bottom[i]


@kernel(top=True, strict=True)
def add_spatial(a: Vector, b: Vector, out: Vector) -> None:
    """The sum."""
    for i in range(6):
        out[i] = a[i] + b[i]


@kernel(top=True, strict=True)
def subtract_spatial(a: Vector, b: Vector, out: Vector) -> None:
    """The difference."""
    for i in range(6):
        out[i] = a[i] - b[i]


@kernel(top=True, strict=True)
def dot_spatial(a: Vector, b: Vector, out: Vector) -> None:
    """The product of two vectors, as BLAS sums it."""
    total = a[0] * b[0]
    for i in range(1, 6):
        total = mul_add(a[i], b[i], total)
    out[0] = total


@kernel(top=True, strict=True)
def rotate_spatial(a: Vector, R: Vector, out: Vector) -> None:
    """Both parts turned by R."""
    for part in range(2):
        x, y, z = read3(a, 3 * part)
        for i in range(3):
            out[3 * part + i] = row_times(R[3 * i], R[3 * i + 1], R[3 * i + 2], x, y, z)


@kernel(strict=True)
def moved(a, p):
    """The translational part of a velocity at another point."""
    around = cross3(read3(a, 0), p)
    return (a[3] + around[0], a[4] + around[1], a[5] + around[2])


@kernel(top=True, strict=True)
def shift_motion(a: Vector, offset: Vector, out: Vector) -> None:
    """The velocity of another point."""
    write3(out, 0, read3(a, 0))
    write3(out, 3, moved(a, read3(offset, 0)))


@kernel(top=True, strict=True)
def compose_velocities(a: Vector, offset: Vector, b: Vector, out: Vector) -> None:
    """The velocity of what moves with b on what moves with a."""
    v = moved(a, read3(offset, 0))
    write3(out, 0, (a[0] + b[0], a[1] + b[1], a[2] + b[2]))
    write3(out, 3, (v[0] + b[3], v[1] + b[4], v[2] + b[5]))


@kernel(top=True, strict=True)
def shift_force(a: Vector, offset: Vector, out: Vector) -> None:
    """The force, or momentum, about another point."""
    lever = cross3(read3(offset, 0), read3(a, 3))
    write3(out, 0, (a[0] - lever[0], a[1] - lever[1], a[2] - lever[2]))
    write3(out, 3, read3(a, 3))


@kernel(top=True)
def inertia_of_moments(xx: float, yy: float, zz: float, out: Vector) -> None:
    """A rotational inertia without products."""
    write9(out, 0, (xx, 0.0, 0.0, 0.0, yy, 0.0, 0.0, 0.0, zz))


@kernel(top=True)
def inertia_of_numbers(xx: float, yy: float, zz: float, xy: float, xz: float, yz: float, out: Vector) -> None:
    """A rotational inertia."""
    write9(out, 0, (xx, xy, xz, xy, yy, yz, xz, yz, zz))


@kernel(strict=True)
def unit_particle(p):
    """Inertia of a unit mass at p about the origin."""
    x, y, z = p
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, -x * y, -x * z, -y * z
    return (yy + zz, xy, xz, xy, xx + zz, yz, xz, yz, xx + yy)


@kernel(strict=True)
def minus(a, b):
    return (
        a[0] - b[0], a[1] - b[1], a[2] - b[2],
        a[3] - b[3], a[4] - b[4], a[5] - b[5],
        a[6] - b[6], a[7] - b[7], a[8] - b[8],
    )  # fmt: skip


@kernel(strict=True)
def plus(a, b):
    return (
        a[0] + b[0], a[1] + b[1], a[2] + b[2],
        a[3] + b[3], a[4] + b[4], a[5] + b[5],
        a[6] + b[6], a[7] + b[7], a[8] + b[8],
    )  # fmt: skip


@kernel(strict=True)
def is_plausible(I):
    """Whether moments so far apart from each other as the products can make them are those of a body (Weyl 1912)."""
    x, y, z = I[0], I[4], I[8]
    trace, spare = x + y + z, magnitude(I[1]) + magnitude(I[2]) + magnitude(I[5])
    slack = _SLACK * max(1.0, magnitude(trace) / 2)
    low, high = min(x, y), max(x, y)
    a, b, c = min(low, z), max(low, min(high, z)), max(high, z)
    return trace + spare < 1e300 and a + slack >= spare and a + b + slack >= c + 3.0 * spare


@kernel(strict=True)
def put_plausible(mass, p, G, mass_out, p_out, G_out):
    """Writes an inertia that is clearly one of a body."""
    x, y, z = p
    if not (0.0 <= mass and mass < 1e300 and magnitude(x) < 1e150 and magnitude(y) < 1e150 and magnitude(z) < 1e150):
        return NOT_PLAUSIBLE
    if not is_plausible(minus(G, unit_particle(p))):
        return NOT_PLAUSIBLE
    mass_out[0] = mass
    write3(p_out, 0, p)
    write9(G_out, 0, G)
    return 0


@kernel(top=True, strict=True)
def plausible_inertia(mass: float, p: Vector, G: Vector, mass_out: Vector, p_out: Vector, G_out: Vector) -> int:
    """The same numbers, if they are clearly those of a body."""
    return put_plausible(mass, read3(p, 0), read9(G, 0), mass_out, p_out, G_out)


@kernel(top=True, strict=True)
def inertia_of_central(mass: float, p: Vector, I: Vector, mass_out: Vector, p_out: Vector, G_out: Vector) -> int:
    """The inertia of a body whose rotational inertia about its centre of mass is I."""
    if not mass > 0.0:
        return NOT_PLAUSIBLE
    particle = unit_particle(read3(p, 0))
    G = (
        I[0] / mass + particle[0], I[1] / mass + particle[1], I[2] / mass + particle[2],
        I[3] / mass + particle[3], I[4] / mass + particle[4], I[5] / mass + particle[5],
        I[6] / mass + particle[6], I[7] / mass + particle[7], I[8] / mass + particle[8],
    )  # fmt: skip
    return put_plausible(mass, read3(p, 0), G, mass_out, p_out, G_out)


@kernel(top=True, strict=True)
def turn_inertia(mass: float, p: Vector, G: Vector, R: Vector, mass_out: Vector, p_out: Vector, G_out: Vector) -> None:
    """An inertia in another frame, exactly symmetric: each product is rounded once."""
    M = read9(R, 0)
    I = product(product(M, read9(G, 0)), transpose(M))
    mass_out[0] = mass
    write3(p_out, 0, turned(M, read3(p, 0)))
    write9(G_out, 0, (I[0], I[3], I[6], I[3], I[4], I[7], I[6], I[7], I[8]))


@kernel(top=True, strict=True)
def shift_inertia(
    mass: float, p: Vector, G: Vector, offset: Vector, mass_out: Vector, p_out: Vector, G_out: Vector
) -> None:
    """An inertia about another point."""
    before = read3(p, 0)
    now = (p[0] - offset[0], p[1] - offset[1], p[2] - offset[2])
    mass_out[0] = mass
    write3(p_out, 0, now)
    write9(G_out, 0, plus(read9(G, 0), minus(unit_particle(now), unit_particle(before))))


@kernel
def is_length(x):
    """Whether a length or mass is positive, and its square finite."""
    return x > 0.0 and x < 1e150


@kernel(strict=True)
def box(x, y, z):
    """Unit inertia of a box about its centre."""
    xx, yy, zz = x * x, y * y, z * z
    return ((yy + zz) / 12.0, 0.0, 0.0, 0.0, (xx + zz) / 12.0, 0.0, 0.0, 0.0, (xx + yy) / 12.0)


@kernel(top=True, strict=True)
def unit_inertia_of_box(x: float, y: float, z: float, G: Vector) -> int:
    """A box of unit mass."""
    if not (x >= 0.0 and y >= 0.0 and z >= 0.0):
        return NOT_PLAUSIBLE
    write9(G, 0, box(x, y, z))
    return 0


@kernel(top=True, strict=True)
def inertia_of_box(mass: float, x: float, y: float, z: float, mass_out: Vector, p_out: Vector, G_out: Vector) -> int:
    """A box about its centre."""
    if not (is_length(mass) and is_length(x) and is_length(y) and is_length(z)):
        return NOT_PLAUSIBLE
    mass_out[0] = mass
    write3(p_out, 0, (0.0, 0.0, 0.0))
    write9(G_out, 0, box(x, y, z))
    return 0


@kernel(top=True, strict=True)
def inertia_of_sphere(mass: float, radius: float, mass_out: Vector, p_out: Vector, G_out: Vector) -> int:
    """A ball about its centre."""
    if not (is_length(mass) and is_length(radius)):
        return NOT_PLAUSIBLE
    moment = 0.4 * radius * radius
    mass_out[0] = mass
    write3(p_out, 0, (0.0, 0.0, 0.0))
    write9(G_out, 0, (moment, 0.0, 0.0, 0.0, moment, 0.0, 0.0, 0.0, moment))
    return 0


@kernel(top=True, strict=True)
def matrix_of_inertia(mass: float, p: Vector, G: Vector, matrix: Vector) -> None:
    """The matrix that maps accelerations to forces, shape (6, 6), row by row; all none where the mass is none."""
    x, y, z, zero = p[0] * mass, p[1] * mass, p[2] * mass, 0.0 * mass
    for i in range(3):
        for j in range(3):
            matrix[6 * i + j] = G[3 * i + j] * mass
            matrix[6 * (3 + i) + 3 + j] = mass if i == j else zero
        matrix[6 * i + 3 + i] = zero
        matrix[6 * (3 + i) + i] = zero
    matrix[4], matrix[5], matrix[9], matrix[11], matrix[15], matrix[16] = -z, y, z, -x, -y, x
    matrix[19], matrix[20], matrix[24], matrix[26], matrix[30], matrix[31] = z, -y, -z, x, y, -x


@kernel(top=True)
def no_inertia(mass_out: Vector, p_out: Vector, G_out: Vector) -> None:
    """That of nothing."""
    mass_out[0] = 0.0
    write3(p_out, 0, (0.0, 0.0, 0.0))
    write9(G_out, 0, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))


@kernel(top=True, strict=True)
def is_inertia_none(mass: float, p: Vector, G: Vector, answer: Vector) -> None:
    """Whether a number is NaN."""
    none = 1.0 if mass != mass else 0.0
    for i in range(3):
        none = 1.0 if p[i] != p[i] else none
    for i in range(9):
        none = 1.0 if G[i] != G[i] else none
    answer[0] = none


@kernel(top=True, strict=True)
def is_inertia_zero(mass: float, p: Vector, G: Vector, answer: Vector) -> None:
    """Whether there is neither mass nor inertia."""
    zero = 1.0 if mass == 0.0 else 0.0
    for i in range(9):
        zero = zero if G[i] == 0.0 else 0.0
    answer[0] = zero


@kernel(top=True, strict=True)
def turn_rotational_inertia(I: Vector, R: Vector, out: Vector) -> None:
    """A rotational inertia in another frame, exactly symmetric: each product is rounded once."""
    M = read9(R, 0)
    J = product(product(M, read9(I, 0)), transpose(M))
    write9(out, 0, (J[0], J[3], J[6], J[3], J[4], J[7], J[6], J[7], J[8]))


@kernel(top=True)
def inertia_of_ten(ten: Vector, mass_out: Vector, p_out: Vector, G_out: Vector) -> None:
    """That of mass, centre of mass, and moments and products of unit inertia."""
    xx, yy, zz, xy, xz, yz = ten[4], ten[5], ten[6], ten[7], ten[8], ten[9]
    mass_out[0] = ten[0]
    write3(p_out, 0, read3(ten, 1))
    write9(G_out, 0, (xx, xy, xz, xy, yy, yz, xz, yz, zz))
