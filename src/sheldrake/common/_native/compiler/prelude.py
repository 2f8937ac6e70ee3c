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
