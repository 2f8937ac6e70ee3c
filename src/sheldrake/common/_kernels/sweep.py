"""Derivatives by complex steps: rows of machine code run once for each direction."""

from __future__ import annotations

from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector, kernel
from sheldrake.common.rows import call_row

STEP = 2.0**-200  # its square is nothing beside 1, and far from where numbers get lost


@kernel(top=True)
def sweep(
    t: float,
    memory: Vector,
    rows: IntVector,
    words: IntVector,
    at: IntVector,
    resets: IntMatrix,
    copies: IntMatrix,
    places: IntVector,
    by_inputs: Matrix,
    outputs: IntVector,
    slopes: Matrix,
) -> int:
    """Runs rows on complex numbers, for derivatives of `outputs`; the first status that is not 0, or 0.

    Directions are those of single inputs, whose derivatives are then put together, or those of `by_inputs`, whichever
    are fewer. Their real parts stay as they are; so do the outputs' when no input has a derivative.

    Args:
        t: Time, for the rows.
        memory: All of it, from address 0.
        rows: Address of each row.
        words: Words of all rows.
        at: Where in `words` each row's begin.
        resets: Where to, where from and how many words: what is copied at the beginning.
        copies: The same, before each run.
        places: Imaginary parts of the inputs.
        by_inputs: Derivatives of each input.
        outputs: Imaginary parts of the outputs.
        slopes: Derivatives of each output.
    """
    inputs = places.shape[0]
    n = by_inputs.shape[1]
    alone = inputs <= n
    ran = 0
    copy_all(memory, resets)
    for i in range(outputs.shape[0]):
        for j in range(n):
            slopes[i, j] = 0.0
    for k in range(inputs if alone else n):
        moves = is_used(by_inputs, k, alone)
        if not moves and (ran == 1 or k + 1 < (inputs if alone else n)):
            continue
        ran = 1
        for i in range(inputs):
            memory[places[i]] = 0.0 if alone else STEP * by_inputs[i, k]
        if alone:
            memory[places[k]] = STEP
        status = run_rows(t, memory, rows, words, at, copies)
        if status != 0:
            return status
        for j in range(n if alone else k + 1):
            share = by_inputs[k, j] if alone else (1.0 if j == k else 0.0)
            if share != 0.0:
                for i in range(outputs.shape[0]):
                    slopes[i, j] += share * (memory[outputs[i]] / STEP)
    if ran == 0:
        return run_rows(t, memory, rows, words, at, copies)
    return 0


@kernel
def is_used(A, k, rows):
    """Whether a row (`rows`) or column has a number other than 0."""
    for i in range(A.shape[1] if rows else A.shape[0]):
        if (A[k, i] if rows else A[i, k]) != 0.0:
            return True
    return False


@kernel(outline=True)
def run_rows(t, memory, rows, words, at, copies):
    """One run of all rows."""
    copy_all(memory, copies)
    status = 0
    for r in range(rows.shape[0]):
        if status == 0:
            status = call_row(rows, r, t, memory, words, at[r])
    return status


@kernel
def copy_all(memory, copies):
    """Copies parts of memory: where to, where from and how many words."""
    for c in range(copies.shape[0]):
        for i in range(copies[c, 2]):
            memory[copies[c, 0] + i] = memory[copies[c, 1] + i]


@kernel(top=True)
def sweep_points(
    t: float,
    memory: Vector,
    rows: IntVector,
    words: IntVector,
    at: IntVector,
    starts: IntMatrix,
    copies: IntMatrix,
    places: IntVector,
    points: Matrix,
    outputs: IntVector,
    values: Matrix,
    slopes: Matrix,
) -> int:
    """Values and derivatives of `outputs` at many points; the first status that is not 0, or 0.

    Args:
        t: Time, for the rows.
        memory: All of it, from address 0.
        rows: Address of each row.
        words: Words of all rows.
        at: Where in `words` each row's begin.
        starts: Where to, where from and how many words: what is copied at the beginning.
        copies: The same, before each run.
        places: Imaginary parts of the inputs.
        points: Values of the inputs, one row for each point.
        outputs: Imaginary parts of the outputs.
        values: Of the outputs, one row for each point.
        slopes: One row for each point: output after output, by each input. Without columns: not wanted.
    """
    inputs = places.shape[0]
    runs = inputs if slopes.shape[1] > 0 else 0
    copy_all(memory, starts)
    for p in range(points.shape[0]):
        for i in range(inputs):
            memory[places[i] - 1] = points[p, i]
            memory[places[i]] = 0.0
        for k in range(max(runs, 1)):
            if runs > 0:
                memory[places[k]] = STEP
            status = run_rows(t, memory, rows, words, at, copies)
            if status != 0:
                return status
            if runs > 0:
                memory[places[k]] = 0.0
                for i in range(outputs.shape[0]):
                    slopes[p, i * inputs + k] = memory[outputs[i]] / STEP
        for i in range(outputs.shape[0]):
            values[p, i] = memory[outputs[i] - 1]
    return 0
