"""Cost and rows of a program: linear and quadratic forms and formulas, with derivatives, in one call."""

from __future__ import annotations

from typing import NamedTuple

from sheldrake.common.kernel import IntVector, Matrix, Vector, kernel
from sheldrake.symbolic._kernels.tape import (
    ADJOINT_TANGENT,
    NUMBER,
    Tapes,
    begin_hessian,
    hessian_row,
    put_hessian,
    put_slopes,
    run,
)


class Functions(NamedTuple):
    """Rows, the cost being the first: forms b'y + y'Qy/2 + c, formulas, and what Python adds.

    Derivatives are entries: of quadratic forms, of linear ones, where they never change, then of formulas; those at one
    place add up.

    Attributes:
        c: Constants, shape (rows,).
        row: Rows of the entries.
        col: Their columns.
        of_cost: Which entries are those of the cost.
        b: Of each entry of a quadratic form.
        i: Entries whose derivatives have a term `Q` times the variable of entry `j`.
        j: See `i`.
        Q: See `i`.
        linear: Where entries of linear forms end, shape (1,).
        value_row: Rows of the values of formulas.
        scale: Units of the variables.
        x: Scratch: the variables, unscaled.
        entry: The entries.
    """

    c: Vector
    row: IntVector
    col: IntVector
    of_cost: IntVector
    b: Vector
    i: IntVector
    j: IntVector
    Q: Vector
    linear: IntVector
    value_row: IntVector
    scale: Vector
    x: Vector
    entry: Vector


@kernel
def unscale(f, y):
    for k in range(len(y)):
        f.x[k] = y[k] * f.scale[k]


@kernel
def add_forms(f, y, rows):
    """Rows get their forms; entries of these are computed."""
    count = len(f.b)
    for k in range(count):
        f.entry[k] = f.b[k]
    for k in range(len(f.Q)):
        f.entry[f.i[k]] += f.Q[k] * y[f.col[f.j[k]]]
    for k in range(count):
        rows[f.row[k]] += 0.5 * (f.b[k] + f.entry[k]) * y[f.col[k]]
    own, total = 0, 0.0  # of entries in a row, to wait for no memory
    for k in range(count, f.linear[0]):
        if f.row[k] != own:
            rows[own] += total
            own, total = f.row[k], 0.0
        total += f.entry[k] * y[f.col[k]]
    rows[own] += total


@kernel
def compute(f, tapes, y, rows, with_slopes):
    """Rows, and entries if these are wanted; those of forms always."""
    for k in range(len(rows)):
        rows[k] = f.c[k]
    add_forms(f, y, rows)
    unscale(f, y)
    for p in range(len(tapes.pieces)):
        piece = tapes.pieces[p]
        run(tapes, p, f.x)
        for k in range(piece.outputs):
            rows[f.value_row[piece.value + k]] += tapes.number[NUMBER, tapes.result[piece.result + k]]
        if with_slopes:
            put_slopes(tapes, p, f.entry)
    return 0


@kernel
def finish(f, J):
    """Entries in units of y, none of them NaN; their sums by row and column."""
    for k in range(f.linear[0], len(f.entry)):
        slope = f.entry[k] * f.scale[f.col[k]]
        f.entry[k] = slope if slope == slope else 0.0
    for i in range(J.shape[0]):
        for k in range(J.shape[1]):
            J[i, k] = 0.0
    if J.shape[0] == 1:
        for k in range(len(f.of_cost)):
            J[0, f.col[f.of_cost[k]]] += f.entry[f.of_cost[k]]
    else:
        for k in range(len(f.entry)):
            J[f.row[k], f.col[k]] += f.entry[k]
    return 0


@kernel(top=True, short_loops=True)
def values(
    functions_model: Functions, tapes_model: Tapes, y: Vector, rows: Vector, J: Matrix, weights: Vector, H: Vector
) -> None:
    """Fills the rows.

    Args:
        functions_model: What there is.
        tapes_model: Formulas.
        y: The point.
        rows: Values, the cost first.
        J: Derivatives; of the cost alone where there is but one row.
        weights: Of rows.
        H: Second derivatives.
    """
    compute(functions_model, tapes_model, y, rows, False)


@kernel(top=True, short_loops=True)
def entries(
    functions_model: Functions, tapes_model: Tapes, y: Vector, rows: Vector, J: Matrix, weights: Vector, H: Vector
) -> None:
    """The same with the entries, which may be NaN, and of the unscaled variables: before Python adds its own."""
    compute(functions_model, tapes_model, y, rows, True)


@kernel(top=True, short_loops=True)
def sums(
    functions_model: Functions, tapes_model: Tapes, y: Vector, rows: Vector, J: Matrix, weights: Vector, H: Vector
) -> None:
    """After that: entries of scaled variables, none of them NaN, and J filled with their sums."""
    finish(functions_model, J)


@kernel(top=True, short_loops=True)
def slopes(
    functions_model: Functions, tapes_model: Tapes, y: Vector, rows: Vector, J: Matrix, weights: Vector, H: Vector
) -> None:
    """Both at once, where Python has nothing to add."""
    compute(functions_model, tapes_model, y, rows, True)
    finish(functions_model, J)


@kernel(top=True, short_loops=True)
def hessian(
    functions_model: Functions, tapes_model: Tapes, y: Vector, rows: Vector, J: Matrix, weights: Vector, H: Vector
) -> None:
    """Entries of the Hessian of weights' rows: of forms, then, by the unscaled variables, of formulas."""
    f, tapes = functions_model, tapes_model
    unscale(f, y)
    for k in range(len(f.Q)):
        H[k] = f.Q[k] * weights[f.row[f.i[k]]]
    end = len(f.Q)
    for p in range(len(tapes.pieces)):
        run(tapes, p, f.x)
        end = put_hessian(tapes, p, weights, f.value_row, H, end)


@kernel
def add_second(f, H, n, i, j, value):
    """Adds a second derivative to its place; NaN counts as none."""
    if value == value:
        H[i * n + j] += value * f.scale[i] * f.scale[j]


@kernel(top=True, short_loops=True)
def cost_hessian(
    functions_model: Functions, tapes_model: Tapes, y: Vector, rows: Vector, J: Matrix, weights: Vector, H: Vector
) -> None:
    """The Hessian of the cost, whose weight is 1 and that of the rows 0, as a matrix by the scaled variables."""
    f, tapes, n = functions_model, tapes_model, len(y)
    unscale(f, y)
    for k in range(n * n):
        H[k] = 0.0
    for k in range(len(f.Q)):
        if f.row[f.i[k]] == 0:
            H[f.col[f.i[k]] * n + f.col[f.j[k]]] += f.Q[k]
    for p in range(len(tapes.pieces)):
        piece = tapes.pieces[p]
        run(tapes, p, f.x)
        if begin_hessian(tapes, p, weights, f.value_row):
            for i in range(piece.variables):
                hessian_row(tapes, p, i)
                for j in range(piece.variables):
                    row, col = tapes.column[piece.column + i], tapes.column[piece.column + j]
                    add_second(f, H, n, row, col, tapes.number[ADJOINT_TANGENT, j])
