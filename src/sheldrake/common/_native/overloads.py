"""What numba must know before the first compile: the scalar-generic maths and the indirect call. Imports numba."""

from __future__ import annotations

import cmath
import functools
import math
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
        _unary(getattr(generic, name), getattr(math, name), getattr(cmath, name, None))
    overload(generic.atan2)(lambda y, x: lambda y, x: math.atan2(y, x))
    overload(generic.is_positive)(lambda x: lambda x: x > 0.0)
    overload(rows.call_row)(_call_row)


def _unary(function: Any, real: Any, complex_: Any) -> None:
    @overload(function)
    def choose(x):  # numba wants the same bare signature here and in what is returned
        if isinstance(x, types.Complex):
            return lambda x: complex_(x)
        return lambda x: real(x)


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
