"""What numba must know before the first compile: the scalar-generic maths and the indirect call. Imports numba."""

from __future__ import annotations

import functools
import math
import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

from sheldrake.common import rows
from sheldrake.common._kernels import generic
from sheldrake.common._native.arrays import INT_VECTOR, VECTOR


@functools.cache
def register() -> None:
    """Tells numba how each generic function is compiled; once per process."""
    for name in generic.UNARY:
        _unary(getattr(generic, name), getattr(math, name), _TO_FIRST_ORDER[name])
    overload(generic.atan2)(_atan2)
    overload(generic.is_positive)(_is_positive)
    overload(generic.is_zero)(lambda x: lambda x: x == 0.0)
    overload(generic.is_finite)(lambda x: lambda x: abs(x.real) < math.inf)
    overload(generic.whole)(lambda x: lambda x: math.floor(x.real))
    overload(generic.clip)(_clip)
    overload(generic.floor)(_floor)
    overload(generic.mul_add)(_mul_add)
    for compare in (operator.gt, operator.ge, operator.lt, operator.le):
        _of_real_parts(compare)
    overload(rows.call_row)(_call_row)


def _unary(function: Any, real: Any, first_order: Any) -> None:
    @overload(function)
    def choose(x):  # numba wants the same bare signature here and in what is returned
        if isinstance(x, types.Complex):
            return first_order
        return lambda x: real(x)


def _of_real_parts(compare: Any) -> None:
    @overload(compare)
    def choose(a, b):
        if isinstance(a, types.Complex) or isinstance(b, types.Complex):
            return lambda a, b: compare(a.real, b.real)
        return None


# Functions of a complex number, to first order in its imaginary part: see `common.kernel.ComplexKernel`.
_TO_FIRST_ORDER: dict[str, Any] = {
    "sin": lambda x: complex(math.sin(x.real), math.cos(x.real) * x.imag),
    "cos": lambda x: complex(math.cos(x.real), -math.sin(x.real) * x.imag),
    "tan": lambda x: complex(math.tan(x.real), (1.0 + math.tan(x.real) * math.tan(x.real)) * x.imag),
    "asin": lambda x: complex(math.asin(x.real), x.imag / math.sqrt(1.0 - x.real * x.real)),
    "acos": lambda x: complex(math.acos(x.real), -x.imag / math.sqrt(1.0 - x.real * x.real)),
    "atan": lambda x: complex(math.atan(x.real), x.imag / (1.0 + x.real * x.real)),
    "sinh": lambda x: complex(math.sinh(x.real), math.cosh(x.real) * x.imag),
    "cosh": lambda x: complex(math.cosh(x.real), math.sinh(x.real) * x.imag),
    "tanh": lambda x: complex(math.tanh(x.real), (1.0 - math.tanh(x.real) * math.tanh(x.real)) * x.imag),
    "exp": lambda x: complex(math.exp(x.real), math.exp(x.real) * x.imag),
    "log": lambda x: complex(math.log(x.real), x.imag / x.real),
    "sqrt": lambda x: complex(math.sqrt(x.real), 0.5 * x.imag / math.sqrt(x.real)),
}


def _atan2(y, x):
    if isinstance(y, types.Complex) or isinstance(x, types.Complex):
        return lambda y, x: complex(
            math.atan2(y.real, x.real),
            (x.real * y.imag - y.real * x.imag) / (x.real * x.real + y.real * y.real),
        )
    return lambda y, x: math.atan2(y, x)


def _clip(x, low, high):
    if isinstance(x, types.Complex):
        return lambda x, low, high: complex(high) if x.real > high else complex(low) if x.real < low else x
    return lambda x, low, high: high if x > high else low if x < low else x


def _floor(x):
    if isinstance(x, types.Complex):
        return lambda x: complex(math.floor(x.real))
    return lambda x: float(math.floor(x))


@intrinsic
def _fused(context, a, b, c):
    """LLVM's `fmuladd`: fused where that is the faster way."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        double = ir.DoubleType()
        kind = ir.FunctionType(double, [double] * 3)
        return builder.call(builder.module.declare_intrinsic("llvm.fmuladd", [double], kind), args)

    return types.float64(types.float64, types.float64, types.float64), generate


def _mul_add(a, b, c):
    if isinstance(a, types.Float) and isinstance(b, types.Float) and isinstance(c, types.Float):
        return lambda a, b, c: _fused(a, b, c)
    return lambda a, b, c: a * b + c


def _is_positive(x):
    if isinstance(x, types.Complex):
        return lambda x: x.real > 0.0
    return lambda x: x > 0.0


ROW = ir.FunctionType(ir.IntType(64), [ir.DoubleType(), ir.DoubleType().as_pointer(), ir.IntType(64).as_pointer()])


@intrinsic
def _call_address(context, table, r, t, slab, words, at):
    """Calls the native function whose address is table[r] on `slab` and on `words` from index `at`."""

    def generate(context: Any, b: Any, signature: Any, args: Any) -> Any:
        def data(i: int) -> Any:
            return b.extract_value(args[i], 0)

        address = b.load(b.gep(data(0), [args[1]]))
        return b.call(b.inttoptr(address, ROW.as_pointer()), [args[2], data(3), b.gep(data(4), [args[5]])])

    return types.int64(INT_VECTOR, types.int64, types.float64, VECTOR, INT_VECTOR, types.int64), generate


def _call_row(table, r, t, slab, words, at):
    return lambda table, r, t, slab, words, at: _call_address(table, r, t, slab, words, at)
