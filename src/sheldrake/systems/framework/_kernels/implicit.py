"""One implicit step of the continuous state: Newton's method with matrices that are used as long as they serve.

What the other arrays are says `program`. Criteria are those of Hairer and Wanner: Solving Ordinary Differential
Equations II (1996), IV.8.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector, kernel
from sheldrake.common.record import Items, Record, Stack, array, integer, number, table, vector
from sheldrake.common.rows import call_row
from sheldrake.systems.framework._kernels.integrate import Integrator, derivatives
from sheldrake.systems.framework._kernels.program import Program, Run, Side, inner, stage

# Equations of a step.
EULER, VELOCITIES, RADAU, TRAPEZOID = range(4)
RESULT, ESTIMATE = range(2)
# Rows in Python.
RATES, CHANGE, REFUSE = range(3)
NEWTON_STEPS = 10
FORWARD = float(np.sqrt(np.finfo(float).eps))  # difference for derivatives, of values of about 1
ROUNDING = 10 * float(np.finfo(float).eps)


class NewtonWords(Record):
    """What is known, and what the scheme is."""

    equation = integer("EULER, VELOCITIES or RADAU")
    stages = integer("of a Radau step, 1 in others")
    is_dense = integer("1: the trajectory is kept, to which slopes belong")
    mapped = integer("1: rates of positions are not just velocities")
    purpose = integer("what is computed: RESULT or ESTIMATE")
    has_jacobian = integer("1: there is a Jacobian")
    is_fresh = integer("1: it is of the very state from which the step begins")
    has_factors = array(2, "1: there are factors of the matrix of results, of that of the trapezoid", dtype=int)


class NewtonNumbers(Record):
    """What a step is made with."""

    kappa = number("by how much Newton's method is more exact than the step: below (8.11)")
    t = number("time at which an equation's step begins", "s")
    h = number("its length", "s")
    nodes = array(2, "of a Radau step: times of the stages, in parts of it")
    A = array((2, 2), "of a Radau step: coefficients of the stages")


class Counts(Record):
    """What is counted, once for the result and once for the estimate of its error."""

    derivative_evaluations = integer("of derivatives")
    jacobian_evaluations = integer("of Jacobians")
    derivative_evaluations_for_jacobian = integer("of derivatives for those")
    iteration_matrix_factorizations = integer("of matrices")
    newton_raphson_iterations = integer("of Newton's method")


class NewtonVectors(Stack):
    """Vectors as long as the state, or as all stages of a Radau step."""

    begin = vector("state at the beginning of an equation's step")
    slope = vector("derivatives there")
    guess = vector("where Newton's method begins")
    z = vector("its iterate: a state, or changes of the state in each stage")
    state = vector("state that follows from it")
    slopes = vector("derivatives of all stages, or those from which a Jacobian's differ")
    dz = vector("residual, then change of what Newton's method solves for")
    dx = vector("change of the state")
    moved = vector("what derivatives are asked for")
    whole = vector("state after the other kind of step")
    end = vector("state after the step")
    rate = vector("velocities, then rates of positions, where Python maps them")


@table
class Newton(NamedTuple):
    """Memory of implicit steps.

    Attributes:
        jacobian: of derivatives by the state, or by velocities and other variables.
        matrix: lower and upper factors of the matrix of results; below them, which row each pivot came from.
        trapezoid: the same of the implicit trapezoid.
        q: where positions are in the continuous state.
        unknown: where in it is what Newton's method solves for: everything, or velocities, then other variables.
    """

    word: Annotated[IntVector, NewtonWords]
    number: Annotated[Vector, NewtonNumbers]
    counted: Annotated[IntMatrix, Items("counts", Counts)]
    x: Annotated[Matrix, NewtonVectors]
    jacobian: Matrix
    matrix: Matrix
    trapezoid: Matrix
    q: IntVector
    unknown: IntVector


@inner
def factor(A, n):
    """Factors the first n rows with row pivots, which go below; whether the matrix is singular (Doolittle)."""
    for j in range(n):
        best = j
        for i in range(j + 1, n):
            if abs(A[i, j]) > abs(A[best, j]):
                best = i
        A[n, j] = float(best)
        if A[best, j] == 0.0:
            return 1
        if best != j:
            for k in range(n):
                a = A[j, k]
                A[j, k] = A[best, k]
                A[best, k] = a
        for i in range(j + 1, n):
            c = A[i, j] / A[j, j]
            A[i, j] = c
            if c != 0.0:
                for k in range(j + 1, n):
                    A[i, k] -= c * A[j, k]
    return 0


@inner
def solve(A, n, x):
    """x becomes A^-1 x, with the factors of A."""
    for j in range(n):
        best = int(A[n, j])
        c = x[best]
        x[best] = x[j]
        x[j] = c
    for i in range(n):
        c = x[i]
        for k in range(i):
            c -= A[i, k] * x[k]
        x[i] = c
    for r in range(n):
        i = n - 1 - r
        c = x[i]
        for k in range(i + 1, n):
            c -= A[i, k] * x[k]
        x[i] = c / A[i, i]


@stage
def evaluate(program, run, S, side, rows, newton, t, x):
    """Derivatives at time t [s] and state x, left in the slab and counted."""
    S[0] = t
    for i in range(program.num_xc):
        S[program.xc + i] = x[i]
    newton.counts[newton.purpose].derivative_evaluations += 1
    derivatives(program, run, S, side, S, rows, program.xdot)  # S for logs: derivatives write none


@stage
def find_positions(program, S, side, newton, own, at, y, out):
    """Positions h N(q) v after those at the beginning: q is that of the state `at`, v that of the state y."""
    q = newton.q
    for i in range(newton.unknown.shape[0]):
        newton.rate[i] = y[newton.unknown[i]]
    if newton.mapped != 0:
        for i in range(q.shape[0]):
            S[program.xc + q[i]] = at[q[i]]
        side.status = call_row(own, RATES, S[0], S, q, 0)
    for i in range(q.shape[0]):
        out[q[i]] = newton.begin[q[i]] + newton.h * newton.rate[i]


@stage
def change_norm(program, S, side, newton, own):
    """The largest change dx of a variable; of positions, only what velocities can change counts."""
    for i in range(program.num_xc):
        newton.rate[i] = newton.dx[i]
    if newton.mapped != 0:
        side.status = call_row(own, CHANGE, S[0], S, newton.q, 0)
    size = 0.0
    for i in range(program.num_xc):
        change = abs(newton.rate[i])
        if not change <= size and size == size:
            size = change
    return size


@stage
def find_jacobian(program, run, S, side, rows, newton, own):
    """Derivatives of derivatives at the beginning, by forward differences."""
    count, unknown, moved = newton.unknown.shape[0], newton.unknown, newton.moved
    for i in range(program.num_xc):
        moved[i] = newton.begin[i]
    for c in range(-1, count):
        value, difference = 0.0, 1.0
        if c >= 0:
            value = moved[unknown[c]]
            moved[unknown[c]] = value + FORWARD * max(1.0, abs(value))
            difference = moved[unknown[c]] - value
        if newton.equation == VELOCITIES:
            find_positions(program, S, side, newton, own, newton.begin, moved, moved)
        if side.status == 0:
            evaluate(program, run, S, side, rows, newton, newton.t, moved)
        if side.status != 0:
            return
        for i in range(count):
            f = S[program.xdot + unknown[i]]
            if c < 0:
                newton.slopes[i] = f
            else:
                newton.jacobian[i, c] = (f - newton.slopes[i]) / difference
        if c >= 0:
            moved[unknown[c]] = value
    newton.counts[newton.purpose].jacobian_evaluations += 1
    newton.counts[newton.purpose].derivative_evaluations_for_jacobian += count + 1


@inner
def is_finite(J):
    """Whether all entries are."""
    for i in range(J.shape[0]):
        for k in range(J.shape[1]):
            if not abs(J[i, k]) < np.inf:
                return False
    return True


@inner
def factor_again(newton, equation, M):
    """Factors the matrix of an equation, 1 - h A x J, for the Jacobian and the length of step."""
    J, n = newton.jacobian, newton.jacobian.shape[0]
    stages = newton.stages if equation == RADAU else 1
    for a in range(stages):
        for b in range(stages):
            c = newton.h
            if equation == RADAU:
                c = newton.h * newton.A[a, b]
            elif equation == TRAPEZOID:
                c = 0.5 * newton.h
            for i in range(n):
                for k in range(n):
                    M[a * n + i, b * n + k] = 0.0 - c * J[i, k]
                if a == b:
                    M[a * n + i, a * n + i] += 1.0
    newton.counts[newton.purpose].iteration_matrix_factorizations += 1
    newton.has_factors[int(equation == TRAPEZOID)] = 1 - factor(M, stages * n)


@stage
def freshen(program, run, S, side, rows, newton, own, equation, M, trial):
    """Makes the matrix for a trial: the old one, then one for this h, then one with a new Jacobian.

    Gives whether there is something new to try.
    """
    if newton.has_jacobian == 0 or trial == 3 or not is_finite(newton.jacobian):
        if newton.has_jacobian != 0 and trial == 3 and newton.is_fresh != 0:
            return False
        find_jacobian(program, run, S, side, rows, newton, own)
        if side.status != 0:
            return False
        newton.has_jacobian = 1
        newton.is_fresh = 1
    elif trial == 1 and newton.has_factors[int(equation == TRAPEZOID)] != 0:
        return True
    factor_again(newton, equation, M)
    return True


@stage
def find_residual(program, run, S, side, rows, newton, own, equation):
    """What the iterate z lacks, in dz."""
    n, h, z, dz = program.num_xc, newton.h, newton.z, newton.dz
    f = program.xdot
    if equation == RADAU:
        for a in range(newton.stages):
            for i in range(n):
                newton.moved[i] = newton.begin[i] + z[a * n + i]
            evaluate(program, run, S, side, rows, newton, newton.t + newton.nodes[a] * h, newton.moved)
            if side.status != 0:
                return
            for i in range(n):
                newton.slopes[a * n + i] = S[f + i]
        for a in range(newton.stages):
            for i in range(n):
                total = 0.0
                for b in range(newton.stages):
                    total += h * newton.A[a, b] * newton.slopes[b * n + i]
                dz[a * n + i] = total - z[a * n + i]
        return
    for i in range(n):
        newton.moved[i] = z[i]
    if equation == VELOCITIES:
        find_positions(program, S, side, newton, own, z, z, newton.moved)
    if side.status == 0:
        evaluate(program, run, S, side, rows, newton, newton.t + h, newton.moved)
    for i in range(newton.unknown.shape[0]):
        k = newton.unknown[i]
        if equation == TRAPEZOID:
            dz[i] = newton.begin[k] + 0.5 * h * (newton.slope[k] + S[f + k]) - z[k]
        else:
            dz[i] = newton.begin[k] + h * S[f + k] - z[k]


@stage
def iterate(program, run, S, side, rows, newton, own, equation, M):
    """The next iterate, its state and the change of that; gives how large this is."""
    n, z, dz, dx, state = program.num_xc, newton.z, newton.dz, newton.dx, newton.state
    find_residual(program, run, S, side, rows, newton, own, equation)
    if side.status != 0:
        return 0.0
    solve(M, M.shape[1], dz)
    if equation == RADAU:
        last = (newton.stages - 1) * n
        for i in range(M.shape[1]):
            z[i] += dz[i]
        for i in range(n):
            dx[i] = dz[last + i]
            state[i] = newton.begin[i] + z[last + i]
        return change_norm(program, S, side, newton, own)
    for i in range(newton.unknown.shape[0]):
        state[newton.unknown[i]] = z[newton.unknown[i]] + dz[i]
    if equation == VELOCITIES:
        find_positions(program, S, side, newton, own, z, state, state)
    squares = 0.0
    for i in range(n):
        dx[i] = state[i] - z[i] if equation == VELOCITIES else dz[i]
        squares += dx[i] * dx[i]
        z[i] = state[i]
    return sqrt(squares) if equation == VELOCITIES else change_norm(program, S, side, newton, own)


@inner
def is_rounding(dx, x, n):
    """Whether the change dx of x is nothing but rounding."""
    for i in range(n):
        if not abs(dx[i]) <= ROUNDING * max(1.0, abs(x[i])):
            return False
    return True


@stage
def solve_equation(program, run, integrator, S, side, rows, newton, own, equation, M):
    """Newton's method from `guess`; whether it found `state`, unless a row failed."""
    for trial in range(1, 4):
        if not freshen(program, run, S, side, rows, newton, own, equation, M, trial):
            return False
        if newton.has_factors[int(equation == TRAPEZOID)] == 0:
            continue
        for i in range(newton.guess.shape[0]):
            newton.z[i] = newton.guess[i]
        last = np.inf
        for i in range(NEWTON_STEPS):
            newton.counts[newton.purpose].newton_raphson_iterations += 1
            size = iterate(program, run, S, side, rows, newton, own, equation, M)
            if side.status != 0:
                return False
            if is_rounding(newton.dx, newton.state, program.num_xc):
                return True
            if i > 1:
                theta = size / last
                if not theta < 1.0:
                    break
                if theta / (1.0 - theta) * size < newton.kappa * integrator.accuracy:  # (8.10)
                    return True
            last = size
    return False


@inner
def euler(program, run, integrator, S, side, rows, newton, own, t, h):
    """One implicit Euler step from `begin`; whether it was made."""
    newton.t = t
    newton.h = h
    if newton.equation == VELOCITIES:
        newton.is_fresh = 0  # its Jacobian belongs to a length of step
    return solve_equation(program, run, integrator, S, side, rows, newton, own, newton.equation, newton.matrix)


@stage
def step_in_halves(program, run, integrator, S, side, rows, newton, own, t, h):
    """Two implicit Euler steps of half the length; one of the whole length, in `whole`, gives the error estimate."""
    n = program.num_xc
    newton.purpose = ESTIMATE
    for i in range(n):
        newton.guess[i] = newton.begin[i]
    if not euler(program, run, integrator, S, side, rows, newton, own, t, h):
        return False
    newton.purpose = RESULT
    for i in range(n):
        newton.whole[i] = newton.state[i]
        newton.guess[i] = 0.5 * (newton.begin[i] + newton.whole[i])
    if not euler(program, run, integrator, S, side, rows, newton, own, t, 0.5 * h):
        return False
    for i in range(n):
        newton.begin[i] = newton.state[i]
        newton.guess[i] = newton.whole[i]
    newton.is_fresh = 0
    made = euler(program, run, integrator, S, side, rows, newton, own, t + 0.5 * h, 0.5 * h)
    newton.is_fresh = 0
    for i in range(n):
        newton.end[i] = newton.state[i]
    return made


@stage
def radau_step(program, run, integrator, S, side, rows, newton, own, t, h):
    """A Radau IIA step (IV.5), whose error is estimated by the implicit trapezoid, in `whole`."""
    n = program.num_xc
    newton.t = t
    newton.h = h
    evaluate(program, run, S, side, rows, newton, t, newton.begin)
    for i in range(n):
        newton.slope[i] = S[program.xdot + i]
    for i in range(newton.guess.shape[0]):
        newton.guess[i] = 0.0
    if side.status != 0 or not solve_equation(
        program, run, integrator, S, side, rows, newton, own, RADAU, newton.matrix
    ):
        return False
    newton.purpose = ESTIMATE
    for i in range(n):
        newton.end[i] = newton.state[i]
        newton.guess[i] = newton.state[i]
    made = solve_equation(program, run, integrator, S, side, rows, newton, own, TRAPEZOID, newton.trapezoid)
    for i in range(n):
        newton.whole[i] = newton.state[i]
    return made


@stage
def explicit_halves(program, run, S, side, rows, newton, t, h):
    """Two explicit Euler steps, for a sliver of time before an event; one, in `whole`, gives the error."""
    n, end = program.num_xc, newton.end
    evaluate(program, run, S, side, rows, newton, t, newton.begin)
    if side.status != 0:
        return
    for i in range(n):
        f = S[program.xdot + i]
        newton.whole[i] = newton.begin[i] + h * f
        end[i] = newton.begin[i] + 0.5 * h * f
    evaluate(program, run, S, side, rows, newton, t + 0.5 * h, end)
    for i in range(n):
        end[i] = end[i] + 0.5 * h * S[program.xdot + i]


@inner
def try_step(program, run, integrator, S, side, rows, newton, own, t, h, h_min):
    """A step of h [s] to `end`, and the same of another kind to `whole`; whether it was made."""
    for i in range(program.num_xc):
        newton.begin[i] = S[program.x0 + i]
    newton.purpose = RESULT
    if h < h_min:
        explicit_halves(program, run, S, side, rows, newton, t, h)
        return True
    if newton.equation == RADAU:
        made = radau_step(program, run, integrator, S, side, rows, newton, own, t, h)
    else:
        made = step_in_halves(program, run, integrator, S, side, rows, newton, own, t, h)
    if made:
        newton.is_fresh = 0
    return made


@kernel(top=True, strict=True)
def implicit_step(
    program_model: Program,
    run: Run,
    integrator: Integrator,
    S: Vector,
    side: Side,
    row_table: IntVector,
    newton: Newton,
    own_table: IntVector,
) -> None:
    """Steps by `h_try` [s], or less if Newton's method fails; leaves length, state and error as `explicit_step` wants.

    A bad status stays in the side. The state at the beginning is at S[x0:].
    """
    program, rows = program_model, row_table
    t, h = S[0], integrator.h_try
    h_min = max(integrator.h_min, 1e-14 * max(1.0, abs(t)))
    if newton.is_dense != 0:
        derivatives(program, run, S, side, S, rows, program.x0 + program.num_xc)
        run.evals -= 1  # which is no part of the step
        if side.status != 0:
            return
    while not try_step(program, run, integrator, S, side, rows, newton, own_table, t, h, h_min):
        h *= 0.5
        integrator.h_try = h
        if side.status == 0 and h < h_min:
            side.status = call_row(own_table, REFUSE, t, S, newton.q, 0)
            side.row = -1
        if side.status != 0:
            return
        run.failures += 1
        run.shrinks_failure += 1
    if side.status != 0:
        return
    for i in range(program.num_xc):
        newton.dx[i] = newton.end[i] - newton.whole[i]
    integrator.h_error = change_norm(program, S, side, newton, own_table)
    for i in range(program.num_xc):
        S[program.xc + i] = newton.end[i]
