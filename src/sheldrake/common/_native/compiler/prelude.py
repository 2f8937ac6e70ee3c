"""Operations of numbers that are more than an instruction, as kernels; and what generic maths is, by kinds.

The name of a function ends in the kind it is for. Those that raise are instructions.
Quotients and remainders are NumPy's: those of integers by 0 are 0, those of floats infinite or NaN.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sheldrake.common._kernels.generic import acos, asin, atan, atan2, cos, cosh, exp, log, sin, sinh, sqrt, tan, tanh


def quotient(x: Any, y: Any) -> Any:
    """x / y of integers without its fraction; y is neither 0 nor -1."""
    raise NotImplementedError


def remainder(x: Any, y: Any) -> Any:
    """x - y quotient(x, y)."""
    raise NotImplementedError


def floor_divide_int(x, y):
    if y == 0:
        return 0
    if y == -1:
        return -x
    q = quotient(x, y)
    r = remainder(x, y)
    return q - 1 if r != 0 and (r < 0) != (y < 0) else q


def modulo_int(x, y):
    if y == 0 or y == -1:
        return 0
    r = remainder(x, y)
    return r + y if r != 0 and (r < 0) != (y < 0) else r


def modulo_float(x, y):
    r = math.fmod(x, y)
    if r != 0.0:
        return r + y if (y < 0.0) != (r < 0.0) else r
    return math.copysign(0.0, y)


def floor_divide_float(x, y):
    if y == 0.0:
        return x / y
    r = math.fmod(x, y)
    q = (x - r) / y
    if r != 0.0 and (y < 0.0) != (r < 0.0):
        q = q - 1.0
    if q == 0.0:
        return math.copysign(0.0, x / y)
    whole = np.floor(q)
    return whole + 1.0 if q - whole > 0.5 else whole


def power_float(x, y):
    return math.pow(x, y)


def complex_product(z, w):
    return complex(z.real * w.real - z.imag * w.imag, z.real * w.imag + z.imag * w.real)


def complex_quotient(a, b):
    if abs(b.real) >= abs(b.imag):
        ratio = b.imag / b.real
        denominator = b.real + b.imag * ratio
        return complex((a.real + a.imag * ratio) / denominator, (a.imag - a.real * ratio) / denominator)
    ratio = b.real / b.imag
    denominator = b.real * ratio + b.imag
    return complex((a.real * ratio + a.imag) / denominator, (a.imag * ratio - a.real) / denominator)


COMPLEX = {
    "sin": lambda x: complex(sin(x.real), cos(x.real) * x.imag),
    "cos": lambda x: complex(cos(x.real), -sin(x.real) * x.imag),
    "tan": lambda x: complex(tan(x.real), (1.0 + tan(x.real) * tan(x.real)) * x.imag),
    "asin": lambda x: complex(asin(x.real), x.imag / sqrt(1.0 - x.real * x.real)),
    "acos": lambda x: complex(acos(x.real), -x.imag / sqrt(1.0 - x.real * x.real)),
    "atan": lambda x: complex(atan(x.real), x.imag / (1.0 + x.real * x.real)),
    "sinh": lambda x: complex(sinh(x.real), cosh(x.real) * x.imag),
    "cosh": lambda x: complex(cosh(x.real), sinh(x.real) * x.imag),
    "tanh": lambda x: complex(tanh(x.real), (1.0 - tanh(x.real) * tanh(x.real)) * x.imag),
    "exp": lambda x: complex(exp(x.real), exp(x.real) * x.imag),
    "log": lambda x: complex(log(x.real), x.imag / x.real),
    "sqrt": lambda x: complex(sqrt(x.real), 0.5 * x.imag / sqrt(x.real)),
    "atan2": lambda y, x: complex(
        atan2(y.real, x.real), (x.real * y.imag - y.real * x.imag) / (x.real * x.real + y.real * y.real)
    ),
    "floor": lambda x: complex(np.floor(x.real) + 0.0, 0.0),
}
"""Functions of a complex number, to first order in its imaginary part: see `common.kernel.ComplexKernel`."""

QUARTER_TURN = (1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21)
"""Pi / 2 in three parts, the first two of 33 bits: their products with whole numbers of turns are exact."""
SINE = (
    -0.16666666666666666, 0.008333333333330948, -0.00019841269836756774,
    2.7557316101617874e-06, -2.505113165023518e-08, 1.5918115263265974e-10,
)  # fmt: skip
COSINE = (
    0.041666666666666664, -0.0013888888888887398, 2.480158729876456e-05,
    -2.7557317271145144e-07, 2.087614614655861e-09, -1.1382623647474604e-11,
)  # fmt: skip
"""Near-minimax polynomials of y^2 up to (pi / 4)^2: sin y = y + y^3 SINE, cos y = 1 - y^2 / 2 + y^4 COSINE."""
MANY_TURNS = 1e5  # [rad] beyond, parts of a quarter turn have too few bits


def sine_and_cosine(x):
    """Of a float or of lanes, up to `MANY_TURNS`, without a branch; within 0.8 units in the last place."""
    quarters = np.floor(x * (2.0 / math.pi) + 0.5)
    whole, part = x - quarters * QUARTER_TURN[0], quarters * QUARTER_TURN[1]
    y = whole - part
    rest = whole - y - part - quarters * QUARTER_TURN[2]
    z = y * y
    w = 1.0 - 0.5 * z
    a0, a1, a2, a3, a4, a5 = SINE
    s = y + (y * z * (a0 + z * (a1 + z * (a2 + z * (a3 + z * (a4 + z * a5))))) + w * rest)
    b0, b1, b2, b3, b4, b5 = COSINE
    c = w + (1.0 - w - 0.5 * z + z * z * (b0 + z * (b1 + z * (b2 + z * (b3 + z * (b4 + z * b5))))) - y * rest)
    halves = np.floor(0.5 * quarters)
    odd = quarters - 2.0 * halves
    even = 1.0 - odd
    sign = 1.0 - 2.0 * (halves - 2.0 * np.floor(0.5 * halves))
    return sign * (s * even + c * odd), sign * (c * even - s * odd)


def four_sines_and_cosines(x: Any, s: Any, c: Any, k: Any) -> None:
    """`sine_and_cosine` of x[k] to x[k + 3]."""
    raise NotImplementedError


def largest(x, n):
    """The largest of the first n numbers without their signs."""
    most = abs(x[0])
    for k in range(1, n):
        most = max(most, abs(x[k]))
    return most


def sines_one_by_one(x, n, s, c):
    for k in range(n):
        s[k], c[k] = sin(x[k]), cos(x[k])


def are_angles_in_fours(x, n, s, c):
    """Whether `sine_and_cosine` holds for the first n numbers, and there is room for whole fours."""
    room = (n + 3) // 4 * 4
    has_room = room <= x.shape[0] and room <= s.shape[0] and room <= c.shape[0]
    return n > 0 and has_room and largest(x, n) <= MANY_TURNS


def sines_of_floats(x, n, s, c):
    if are_angles_in_fours(x, n, s, c):
        for k in range(0, n, 4):
            four_sines_and_cosines(x, s, c, k)
    else:
        sines_one_by_one(x, n, s, c)


def sines_of_lanes(x, n, s, c):
    """Each world gets the bits that it gets alone."""
    if are_angles_in_fours(x, n, s, c):
        for k in range(n):
            s[k], c[k] = sine_and_cosine(x[k])
    else:
        sines_one_by_one(x, n, s, c)


GENERIC = {
    "is_positive": lambda x: x.real > 0.0,
    "is_zero": lambda x: x == 0.0,
    "is_finite": lambda x: abs(x.real) < math.inf,
    "value_of": lambda x: x.real,
    "whole": lambda x: math.floor(x.real),
    "clip": lambda x, low, high: high if x > high else low if x < low else x,
}
"""What generic maths is of numbers."""

for _name, _kernel in (COMPLEX | GENERIC).items():
    _kernel.__name__ = _name


def mul_add(a, b, c):
    return a * b + c
