"""Expressions as a list of operations on numbered floats, which one kernel walks along: nothing is compiled."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np

from sheldrake.common.kernel import IntMatrix, IntVector, Vector, kernel
from sheldrake.common.record import Items, Record, integer, table

ADD, MULTIPLY, DIVIDE, POWER, ATAN2, MIN, MAX = range(7)
LOG, ABS, EXP, SQRT, SIN, COS, TAN, ASIN, ACOS, ATAN, SINH, COSH, TANH, CEIL, FLOOR = range(7, 22)

NO_VALUE = 1
"""Status: a variable is NaN, a division by zero, or a function is asked outside its domain."""


class Operation(Record):
    """What is computed of one number or two."""

    kind = integer("what is done")
    a = integer("the first number")
    b = integer("the second number")
    to = integer("the number that it gives")


@table
class Tape(NamedTuple):
    """Expressions of variables.

    The numbers are: variables, then constants, then what each operation gives.
    """

    operation: Annotated[IntMatrix, Items("operations", Operation)]
    constant: Vector
    begin: IntVector  # the number of the first constant
    used: IntVector  # variables that count
    result: IntVector  # which numbers the expressions are


@kernel(strict=True)
def unary(kind, x):
    """A function of one number."""
    if kind == SIN:
        return math.sin(x)
    if kind == COS:
        return math.cos(x)
    if kind == SQRT:
        return math.sqrt(x)
    if kind == EXP:
        return math.exp(x)
    if kind == LOG:
        return math.log(x)
    if kind == ABS:
        return abs(x)
    if kind == TAN:
        return math.tan(x)
    if kind == ASIN:
        return math.asin(x)
    if kind == ACOS:
        return math.acos(x)
    if kind == ATAN:
        return math.atan(x)
    if kind == SINH:
        return math.sinh(x)
    if kind == COSH:
        return math.cosh(x)
    if kind == TANH:
        return math.tanh(x)
    if kind == CEIL:
        return 0.0 - np.floor(-x)
    return np.floor(x)


@kernel(strict=True)
def binary(kind, x, y):
    """A function of two numbers."""
    if kind == ADD:
        return x + y
    if kind == MULTIPLY:
        return x * y
    if kind == DIVIDE:
        return x / y
    if kind == POWER:
        return math.pow(x, y)
    if kind == ATAN2:
        return math.atan2(x, y)
    if kind == MIN:
        return min(x, y)
    return max(x, y)


@kernel
def in_domain(kind, x, y):
    """Whether there is a value, as Drake sees it."""
    if kind == DIVIDE:
        return y != 0.0
    if kind == POWER:
        return x >= 0.0 or y == np.floor(y) or x - x != 0.0 or y - y != 0.0
    if kind == SQRT or kind == LOG:
        return not x < 0.0
    if kind == ASIN or kind == ACOS:
        return x >= -1.0 and x <= 1.0
    return True


@kernel(strict=True)
def evaluate(tape, x, out):
    """Values of the expressions; a status.

    Args:
        tape: the expressions.
        x: all numbers, of which variables are there.
        out: the values.
    """
    for k in range(tape.used.shape[0]):
        if x[tape.used[k]] != x[tape.used[k]]:
            return NO_VALUE
    for k in range(tape.constant.shape[0]):
        x[tape.begin[0] + k] = tape.constant[k]
    for i in range(len(tape.operations)):
        o = tape.operations[i]
        a, b = x[o.a], x[o.b]
        if not in_domain(o.kind, a, b):
            return NO_VALUE
        x[o.to] = binary(o.kind, a, b) if o.kind < LOG else unary(o.kind, a)
    for k in range(tape.result.shape[0]):
        out[k] = x[tape.result[k]]
    return 0
