"""Expressions as a list of operations on numbered floats, which one kernel walks along: nothing is compiled."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector, kernel
from sheldrake.common.record import Items, Record, integer, table

ADD, MULTIPLY, DIVIDE, POWER, CONSTANT_POWER, ATAN2, MIN, MAX = range(8)
LOG, ABS, EXP, SQRT, SIN, COS, TAN, ASIN, ACOS, ATAN, SINH, COSH, TANH, CEIL, FLOOR = range(8, 23)

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

    The numbers are: variables, then what each operation gives; constants are the last ones, from the end.
    """

    operation: Annotated[IntMatrix, Items("operations", Operation)]
    constant: Vector
    size: IntVector  # how many numbers there are
    used: IntVector  # variables that count
    result: IntVector  # which numbers the expressions are


@kernel(strict=True)
def unary(kind, x):
    """A function of one number."""
    if kind == SIN:
        return np.sin(x)
    if kind == COS:
        return np.cos(x)
    if kind == SQRT:
        return np.sqrt(x)
    if kind == EXP:
        return np.exp(x)
    if kind == LOG:
        return np.log(x)
    if kind == ABS:
        return abs(x)
    if kind == TAN:
        return np.tan(x)
    if kind == ASIN:
        return np.arcsin(x)
    if kind == ACOS:
        return np.arccos(x)
    if kind == ATAN:
        return np.arctan(x)
    if kind == SINH:
        return np.sinh(x)
    if kind == COSH:
        return np.cosh(x)
    if kind == TANH:
        return np.tanh(x)
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
    if kind == POWER or kind == CONSTANT_POWER:
        return x**y
    if kind == ATAN2:
        return np.arctan2(x, y)
    if kind == MIN:
        return min(x, y)
    return max(x, y)


@kernel
def in_domain(kind, x, y):
    """Whether there is a value, as Drake sees it."""
    if kind == DIVIDE:
        return y != 0.0
    if kind == POWER or kind == CONSTANT_POWER:
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
        x[tape.size[0] - 1 - k] = tape.constant[k]
    for i in range(len(tape.operations)):
        o = tape.operations[i]
        a, b = x[o.a], x[o.b]
        if not in_domain(o.kind, a, b):
            return NO_VALUE
        x[o.to] = binary(o.kind, a, b) if o.kind < LOG else unary(o.kind, a)
    for k in range(tape.result.shape[0]):
        out[k] = x[tape.result[k]]
    return 0


class Piece(Record):
    """Expressions of some variables: which operations these are, and where in lists is what they take and give."""

    begin = integer("the first operation")
    end = integer("where operations end")
    size = integer("how many numbers there are")
    variables = integer("how many of these are variables")
    constants = integer("how many are constants")
    outputs = integer("how many values there are")
    constant = integer("the first constant")
    column = integer("the first of its variables' places")
    result = integer("the number of the first value")
    value = integer("where values go")
    slope = integer("where derivatives go, value by value")


@table
class Tapes(NamedTuple):
    """Expressions of variables that are chosen from all, some of the same operations. Out of domains they are NaN."""

    operation: Annotated[IntMatrix, Items("operations", Operation)]
    piece: Annotated[IntMatrix, Items("pieces", Piece)]
    constant: Vector
    column: IntVector  # places of variables among all
    result: IntVector  # which numbers the values are
    number: Matrix  # scratch: numbers, adjoints, tangents, and tangents of adjoints


NUMBER, ADJOINT, TANGENT, ADJOINT_TANGENT = range(4)


@kernel(outline=True)
def run(tapes, p, x):
    """Computes the numbers of piece p."""
    piece, v = tapes.pieces[p], tapes.number
    for k in range(piece.variables):
        v[NUMBER, k] = x[tapes.column[piece.column + k]]
    for k in range(piece.constants):
        v[NUMBER, piece.size - 1 - k] = tapes.constant[piece.constant + k]
    for i in range(piece.begin, piece.end):
        o = tapes.operations[i]
        if o.kind < LOG:
            v[NUMBER, o.to] = binary(o.kind, v[NUMBER, o.a], v[NUMBER, o.b])
        else:
            v[NUMBER, o.to] = unary(o.kind, v[NUMBER, o.a])
    return 0


@kernel(outline=True)
def slope_of_unary(kind, x, z):
    """The derivative of z, a smooth function of x."""
    if kind == SIN:
        return np.cos(x)
    if kind == COS:
        return -np.sin(x)
    if kind == SQRT:
        return 0.5 / z
    if kind == EXP:
        return z
    if kind == LOG:
        return 1.0 / x
    if kind == TAN:
        return 1.0 + z * z
    if kind == ASIN:
        return 1.0 / np.sqrt(1.0 - x * x)
    if kind == ACOS:
        return -1.0 / np.sqrt(1.0 - x * x)
    if kind == ATAN:
        return 1.0 / (1.0 + x * x)
    if kind == SINH:
        return np.cosh(x)
    if kind == COSH:
        return np.sinh(x)
    return 1.0 - z * z


@kernel(outline=True)
def curvature_of_unary(kind, x, z):
    """The second derivative."""
    if kind == SIN or kind == COS:
        return -z
    if kind == SQRT:
        return -0.25 / (z * x)
    if kind == EXP or kind == SINH or kind == COSH:
        return z
    if kind == LOG:
        return -1.0 / (x * x)
    if kind == TAN:
        return 2.0 * z * (1.0 + z * z)
    if kind == ASIN:
        return x / (1.0 - x * x) ** 1.5
    if kind == ACOS:
        return -x / (1.0 - x * x) ** 1.5
    if kind == ATAN:
        return -2.0 * x / ((1.0 + x * x) * (1.0 + x * x))
    return -2.0 * z * (1.0 - z * z)


@kernel
def times_power(c, x, y):
    """c x^y, also where c is 0 and x^y infinite."""
    return c * x**y if c != 0.0 else 0.0


@kernel(outline=True)
def slopes_of_binary(kind, x, y, z):
    """Derivatives of z, a smooth function of x and y."""
    if kind == ADD:
        return 1.0, 1.0
    if kind == MULTIPLY:
        return y, x
    if kind == DIVIDE:
        return 1.0 / y, -z / y
    if kind == CONSTANT_POWER:
        return times_power(y, x, y - 1.0), 0.0
    if kind == POWER:
        return times_power(y, x, y - 1.0), z * np.log(x)
    square = x * x + y * y
    return y / square, -x / square


@kernel(outline=True)
def curvatures_of_binary(kind, x, y, z):
    """Second derivatives: by x, by both, by y."""
    if kind == ADD:
        return 0.0, 0.0, 0.0
    if kind == MULTIPLY:
        return 0.0, 1.0, 0.0
    if kind == DIVIDE:
        return 0.0, -1.0 / (y * y), 2.0 * z / (y * y)
    if kind == CONSTANT_POWER:
        return times_power(y * (y - 1.0), x, y - 2.0), 0.0, 0.0
    if kind == POWER:
        log = np.log(x)
        return times_power(y * (y - 1.0), x, y - 2.0), x ** (y - 1.0) * (1.0 + y * log), z * log * log
    square = x * x + y * y
    turn = 2.0 * x * y / (square * square)
    return -turn, (x * x - y * y) / (square * square), turn


@kernel
def scaled(slope, change):
    """What a change brings; none brings nothing, however steep it is."""
    return slope * change if change != 0.0 else 0.0


@kernel
def clear(numbers, row, n):
    for k in range(n):
        numbers[row, k] = 0.0


@kernel(outline=True)
def sweep_back(tapes, p):
    """Completes adjoints of the numbers of piece p, those of some having been set."""
    piece, v = tapes.pieces[p], tapes.number
    for k in range(piece.end - piece.begin):
        o = tapes.operations[piece.end - 1 - k]
        adjoint = v[ADJOINT, o.to]
        if adjoint != 0.0:
            if o.kind < LOG:
                by_a, by_b = slopes_of_binary(o.kind, v[NUMBER, o.a], v[NUMBER, o.b], v[NUMBER, o.to])
                v[ADJOINT, o.a] += adjoint * by_a
                v[ADJOINT, o.b] += adjoint * by_b
            else:
                v[ADJOINT, o.a] += adjoint * slope_of_unary(o.kind, v[NUMBER, o.a], v[NUMBER, o.to])
    return 0


@kernel(outline=True)
def sweep_tangents(tapes, p):
    """Completes tangents of the numbers of piece p, those of variables having been set."""
    piece, v = tapes.pieces[p], tapes.number
    for i in range(piece.begin, piece.end):
        o = tapes.operations[i]
        a, b = v[TANGENT, o.a], v[TANGENT, o.b]
        if a == 0.0 and b == 0.0:
            v[TANGENT, o.to] = 0.0
        elif o.kind < LOG:
            by_a, by_b = slopes_of_binary(o.kind, v[NUMBER, o.a], v[NUMBER, o.b], v[NUMBER, o.to])
            v[TANGENT, o.to] = scaled(by_a, a) + scaled(by_b, b)
        else:
            v[TANGENT, o.to] = a * slope_of_unary(o.kind, v[NUMBER, o.a], v[NUMBER, o.to])
    return 0


@kernel(outline=True)
def sweep_tangents_back(tapes, p):
    """Completes tangents of adjoints of the numbers of piece p, adjoints and tangents being there."""
    piece, v = tapes.pieces[p], tapes.number
    for k in range(piece.end - piece.begin):
        o = tapes.operations[piece.end - 1 - k]
        adjoint, change = v[ADJOINT, o.to], v[ADJOINT_TANGENT, o.to]
        if adjoint != 0.0 or change != 0.0:
            x, y, z = v[NUMBER, o.a], v[NUMBER, o.b], v[NUMBER, o.to]
            a, b = v[TANGENT, o.a], v[TANGENT, o.b]
            if o.kind < LOG:
                by_a, by_b = slopes_of_binary(o.kind, x, y, z)
                by_aa, by_ab, by_bb = curvatures_of_binary(o.kind, x, y, z)
                v[ADJOINT_TANGENT, o.a] += scaled(by_a, change) + adjoint * (scaled(by_aa, a) + scaled(by_ab, b))
                v[ADJOINT_TANGENT, o.b] += scaled(by_b, change) + adjoint * (scaled(by_ab, a) + scaled(by_bb, b))
            else:
                bend = scaled(curvature_of_unary(o.kind, x, z), a)
                v[ADJOINT_TANGENT, o.a] += scaled(slope_of_unary(o.kind, x, z), change) + adjoint * bend
    return 0


@kernel
def put_slopes(tapes, p, slopes):
    """Derivatives of the values of piece p, whose numbers are there, by its variables."""
    piece, v = tapes.pieces[p], tapes.number
    for k in range(piece.outputs):
        clear(v, ADJOINT, piece.size)
        v[ADJOINT, tapes.result[piece.result + k]] = 1.0
        sweep_back(tapes, p)
        for j in range(piece.variables):
            slopes[piece.slope + k * piece.variables + j] = v[ADJOINT, j]


@kernel
def begin_hessian(tapes, p, weights, rows):
    """Adjoints of the weighted sum of the values of piece p, whose numbers are there; whether any weight counts.

    Args:
        tapes: the expressions.
        p: which piece.
        weights: of all values that there are.
        rows: which of these the values of pieces are.
    """
    piece, v = tapes.pieces[p], tapes.number
    clear(v, ADJOINT, piece.size)
    any_counts = False
    for k in range(piece.outputs):
        weight = weights[rows[piece.value + k]]
        if weight != 0.0:
            v[ADJOINT, tapes.result[piece.result + k]] += weight
            any_counts = True
    if any_counts:
        sweep_back(tapes, p)
        clear(v, TANGENT, piece.size)
    return any_counts


@kernel(outline=True)
def hessian_row(tapes, p, j):
    """After that: row j of the Hessian becomes the tangents of the adjoints of variables."""
    v, size = tapes.number, tapes.pieces[p].size
    v[TANGENT, j] = 1.0
    sweep_tangents(tapes, p)
    clear(v, ADJOINT_TANGENT, size)
    sweep_tangents_back(tapes, p)
    v[TANGENT, j] = 0.0
    return 0


@kernel
def put_hessian(tapes, p, weights, rows, H, begin):
    """The Hessian of the weighted sum, row by row, from `begin` on in H; where it ends there."""
    n = tapes.pieces[p].variables
    any_counts = begin_hessian(tapes, p, weights, rows)
    for j in range(n):
        if any_counts:
            hessian_row(tapes, p, j)
        for i in range(n):
            H[begin + j * n + i] = tapes.number[ADJOINT_TANGENT, i] if any_counts else 0.0
    return begin + n * n


@kernel(top=True)
def at_points(tapes: Tapes, x: Vector, values: Vector, slopes: Vector, with_slopes: int) -> None:
    """Values of all pieces, and their derivatives if these are wanted.

    Args:
        tapes: the expressions.
        x: all variables.
        values: filled by pieces.
        slopes: likewise.
        with_slopes: whether they are wanted.
    """
    for p in range(len(tapes.pieces)):
        piece = tapes.pieces[p]
        run(tapes, p, x)
        for k in range(piece.outputs):
            values[piece.value + k] = tapes.number[NUMBER, tapes.result[piece.result + k]]
        if with_slopes:
            put_slopes(tapes, p, slopes)


@kernel(top=True)
def hessians_at_points(tapes: Tapes, x: Vector, weights: Vector, rows: IntVector, H: Vector) -> None:
    """Hessians of the weighted sums of the values of each piece.

    Args:
        tapes: the expressions.
        x: all variables.
        weights: of all values.
        rows: places in `weights` of the values of pieces.
        H: filled by pieces, row by row.
    """
    end = 0
    for p in range(len(tapes.pieces)):
        run(tapes, p, x)
        end = put_hessian(tapes, p, weights, rows, H, end)
