"""Sequential quadratic programming: quadratic programs, what of their steps is good, and what is learned of them."""

from __future__ import annotations

from typing import NamedTuple

from sheldrake.common._kernels.generic import is_finite
from sheldrake.common.kernel import IntVector, Matrix, Vector, kernel
from sheldrake.common.record import Record, number
from sheldrake.common.rows import call_row
from sheldrake.solvers._kernels.active_set import (
    INFEASIBLE,
    Quadratic,
    prepare,
    solve_by_rows,
    solve_prepared,
    solve_quadratic,
)

INFINITE = float("inf")
REACH = 0.5  # of one step, relative to the point and 1
LONGEST = 1e3  # of what is still a step
FIRST_PENALTY, LAST_PENALTY = 10.0, 1e8  # for linearized constraints that are missed, relative to the cost's gradient
SHORTEST = 1e-4  # part of a step
GAIN = 1e-10  # of the cost that is not worth a step, relative to it or 1
LEFT = 1e-9  # what linearized constraints may be missed by


class Sequence(NamedTuple):
    """A point, a trial point, and the step from one to the other.

    Attributes:
        y: The point, shape (n,).
        trial: The other.
        f_trial: The cost there, shape (1,).
        g: Gradient of the cost.
        g_trial: There.
        rows: Values of the constraints, shape (m,).
        rows_trial: There.
        J: Their derivatives, shape (m, n).
        J_trial: There.
        lower: Bounds of rows.
        upper: Likewise.
        x_lower: Bounds of variables.
        x_upper: Likewise.
        sides: Which rows are bounded: the number of a row plus 1 for an upper bound, minus that for a lower one.
        x_sides: The same of the variables.
        first: The Hessian of the cost at the first point.
        B: The Lagrangian's Hessian, as learned.
        V: Scratch, shape (n, n).
        d: The step.
        weights: Multipliers of `sides`, not negative.
        s: Scratch, shape (n,).
        r: Scratch, shape (n,).
    """

    y: Vector
    trial: Vector
    f_trial: Vector
    g: Vector
    g_trial: Vector
    rows: Vector
    rows_trial: Vector
    J: Matrix
    J_trial: Matrix
    lower: Vector
    upper: Vector
    x_lower: Vector
    x_upper: Vector
    sides: IntVector
    x_sides: IntVector
    first: Matrix
    B: Matrix
    V: Matrix
    d: Vector
    weights: Vector
    s: Vector
    r: Vector


class Progress(Record):
    """Where the iterations are."""

    f = number("cost")
    violation = number("the largest of a row")
    violation_trial = number("the same at the trial point; infinite where something is not finite")
    penalty = number("what violations are weighed with")
    left = number("by how much linearized constraints are still missed after the step")
    gain = number("what the step may bring")
    slope = number("of the penalty function along the step")
    longest = number("the largest change of a variable")
    alpha = number("the part of the step that is tried")
    held = number("how many rows held with equality at the last step")
    stage = number("what comes next")
    steps = number("how many quadratic programs there were")
    most = number("how many there may be")
    feasibility = number("the violation that is allowed")
    stalls = number("1 after a first Hessian from which no step has been found yet")
    shows = number("1 if each point is to be shown")


@kernel
def beyond(work, rows, a):
    """How far a row is beyond its bound; negative inside."""
    side = work.sides[a]
    if side > 0:
        return rows[side - 1] - work.upper[side - 1]
    return work.lower[-side - 1] - rows[-side - 1]


@kernel
def slope_of(work, J, a, j):
    """How that changes with a variable."""
    side = work.sides[a]
    return J[side - 1, j] if side > 0 else -J[-side - 1, j]


@kernel
def violation_of(work, rows):
    """The largest violation; infinite where a value is not finite."""
    most, total = 0.0, 0.0
    for a in range(len(work.sides)):
        over = beyond(work, rows, a)
        most = max(most, over)
        total += over
    return most if is_finite(total) else INFINITE


@kernel
def is_finite_at(work, progress):
    """Whether cost, gradient and rows are finite at the point."""
    total = progress.f + progress.violation
    for k in range(len(work.g)):
        total += work.g[k]
    return is_finite(total)


@kernel
def largest(v, n):
    most = 0.0
    for k in range(n):
        most = max(most, abs(v[k]))
    return most


@kernel
def product(a, b):
    total = 0.0
    for k in range(len(a)):
        total += a[k] * b[k]
    return total


@kernel
def room_of(work, a):
    """How far a variable may go until its bound."""
    side = work.x_sides[a]
    if side > 0:
        return work.x_upper[side - 1] - work.y[side - 1]
    return work.y[-side - 1] - work.x_lower[-side - 1]


@kernel
def fill(work, program):
    """The quadratic program of the point, of as many variables or one more."""
    n, k = len(work.y), len(work.sides)
    for i in range(n):
        program.q[i] = work.g[i]
        for j in range(n):
            program.Q[i, j] = work.B[i, j]
    for a in range(k):
        program.b[a] = -beyond(work, work.rows, a)
        for j in range(n):
            program.A[a, j] = slope_of(work, work.J, a, j)
    for a in range(len(work.x_sides)):
        program.b[k + a] = room_of(work, a)
        for j in range(n):
            program.A[k + a, j] = 0.0
        side = work.x_sides[a]
        program.A[k + a, abs(side) - 1] = 1.0 if side > 0 else -1.0


@kernel
def take(work, program, count):
    """Step and multipliers from a program that is solved."""
    for j in range(len(work.y)):
        work.d[j] = program.x[j]
    for a in range(len(work.sides)):
        work.weights[a] = 0.0
    for i in range(count):
        if program.active[i] < len(work.sides):
            work.weights[program.active[i]] = max(0.0, program.multipliers[i])


@kernel(outline=True)
def least_miss(work, missed, progress):
    """Takes a step that may miss all linearized constraints by the same amount; 1 if no program was solved."""
    n, k = len(work.y), len(work.sides)
    last = k + len(work.x_sides)
    fill(work, missed)
    for i in range(n):
        missed.Q[i, n], missed.Q[n, i] = 0.0, 0.0
    for a in range(last):
        missed.A[a, n] = -1.0 if a < k else 0.0
    for j in range(n):
        missed.A[last, j] = 0.0
    missed.Q[n, n], missed.A[last, n], missed.b[last] = 1e-6, -1.0, 0.0
    scale = max(1.0, largest(work.g, n))
    penalty, weight = FIRST_PENALTY, prepare(missed)
    while True:
        missed.q[n] = penalty * scale
        count = solve_prepared(missed, 0, weight)
        if count < 0:
            return 1
        progress.left = max(0.0, missed.x[n])
        if progress.left <= 0.9 * progress.violation or penalty >= LAST_PENALTY:
            break
        penalty *= 10.0
    progress.penalty = max(progress.penalty, penalty * scale)
    take(work, missed, count)
    return 0


NOT_FINITE = 2


@kernel(outline=True)
def take_step(work, plain, missed, progress):
    """Finds the step, its multipliers, and what they say; 1 if there is none, 2 if the point is not finite."""
    n = len(work.y)
    progress.violation = violation_of(work, work.rows)
    if not is_finite_at(work, progress):
        return NOT_FINITE
    fill(work, plain)
    progress.left = 0.0
    count = INFEASIBLE
    if progress.held > 0.0:  # near the solution these stay the same
        count = solve_by_rows(plain, 0, int(progress.held))
    if count < 0:
        count = solve_quadratic(plain, 0)
    progress.held = max(0.0, count)
    if count >= 0 and largest(plain.x, n) < LONGEST:
        take(work, plain, count)
    elif least_miss(work, missed, progress) != 0:
        return 1
    wanted, curvature = 0.0, 0.0
    for a in range(len(work.sides)):
        wanted += 1.5 * work.weights[a]
    for i in range(n):
        for j in range(n):
            curvature += work.d[i] * work.B[i, j] * work.d[j]
    progress.penalty = max(wanted, 0.5 * (progress.penalty + wanted))
    along = product(work.g, work.d)
    progress.gain = abs(along) + progress.penalty * progress.violation
    progress.slope = min(along - progress.penalty * (progress.violation - progress.left), -0.5 * curvature)
    progress.longest = largest(work.d, n)
    progress.alpha = min(1.0, REACH * (1.0 + largest(work.y, n)) / max(progress.longest, 1e-300))
    return 0


@kernel
def set_trial(work, alpha, d):
    """The trial point: a part of a step, inside of the bounds of the variables."""
    for k in range(len(work.y)):
        work.trial[k] = min(max(work.y[k] + alpha * d[k], work.x_lower[k]), work.x_upper[k])


@kernel
def is_good(work, progress):
    """Whether the penalty function falls enough at the trial point; rounding may let it rise."""
    progress.violation_trial = violation_of(work, work.rows_trial)
    merit = progress.f + progress.penalty * progress.violation
    enough = merit + 1e-4 * progress.alpha * progress.slope + 1e-14 * abs(merit)
    return 1 if work.f_trial[0] + progress.penalty * progress.violation_trial <= enough else 0


@kernel(outline=True)
def correct(work, plain, progress):
    """The trial point of a full step that heeds how rows curve, by what they are beyond bounds there; 1 if none."""
    for a in range(len(work.sides)):
        ahead = 0.0
        for j in range(len(work.y)):
            ahead += plain.A[a, j] * work.d[j]
        plain.b[a] = ahead - beyond(work, work.rows_trial, a)
    count = solve_quadratic(plain, 0)
    progress.held = max(0.0, count)
    if count < 0:
        return 1
    set_trial(work, 1.0, plain.x)
    return 0


@kernel(outline=True)
def learn(work):
    """Learns from how the Lagrangian's gradient changed on the way to the trial point, so that B stays definite."""
    B, s, r = work.B, work.s, work.r
    n = len(s)
    for j in range(n):
        s[j] = work.trial[j] - work.y[j]
        r[j] = work.g_trial[j] - work.g[j]
        for a in range(len(work.sides)):
            if work.weights[a] > 0.0:
                r[j] += work.weights[a] * (slope_of(work, work.J_trial, a, j) - slope_of(work, work.J, a, j))
    sBs, sr = 0.0, product(s, r)
    for i in range(n):
        work.d[i] = 0.0
        for j in range(n):
            work.d[i] += B[i, j] * s[j]
        sBs += s[i] * work.d[i]
    if not (sBs > 1e-30) or not is_finite(sr):
        return 0
    if sr < 0.2 * sBs:
        part = 0.8 * sBs / (sBs - sr)
        for j in range(n):
            r[j] = part * r[j] + (1.0 - part) * work.d[j]
        sr = 0.2 * sBs
    for i in range(n):
        for j in range(n):
            B[i, j] += r[i] * r[j] / sr - work.d[i] * work.d[j] / sBs
    return 0


@kernel
def go(work, progress):
    """The trial point becomes the point."""
    progress.f = work.f_trial[0]
    for j in range(len(work.y)):
        work.y[j], work.g[j] = work.trial[j], work.g_trial[j]
    for i in range(len(work.rows)):
        work.rows[i] = work.rows_trial[i]
        for j in range(len(work.y)):
            work.J[i, j] = work.J_trial[i, j]


@kernel
def turn(A, p, q, c, s):
    """Rows p and q of A become those turned by an angle of this cosine and sine."""
    for k in range(A.shape[1]):
        a, b = A[p, k], A[q, k]
        A[p, k], A[q, k] = c * a - s * b, s * a + c * b


@kernel(outline=True)
def eigenvectors(A, V):
    """Turns a symmetric A into its eigenvalues, on the diagonal, and V into rows of eigenvectors (Jacobi, 1846)."""
    n = A.shape[0]
    for i in range(n):
        for j in range(n):
            V[i, j] = 1.0 if i == j else 0.0
    for _ in range(30):
        aside = 0.0
        for p in range(n):
            for q in range(p + 1, n):
                if abs(A[p, q]) > 1e-15 * (abs(A[p, p]) + abs(A[q, q])):
                    aside = 1.0
                    tau = (A[q, q] - A[p, p]) / (2.0 * A[p, q])
                    t = (1.0 if tau >= 0.0 else -1.0) / (abs(tau) + (1.0 + tau * tau) ** 0.5)
                    c = 1.0 / (1.0 + t * t) ** 0.5
                    turn(A, p, q, c, t * c)
                    for k in range(n):
                        a, b = A[k, p], A[k, q]
                        A[k, p], A[k, q] = c * a - t * c * b, t * c * a + c * b
                    turn(V, p, q, c, t * c)
        if aside == 0.0:
            break
    return 0


LEAST_CURVATURE = 0.1  # of the first Hessian, relative to the largest or 1, and where there is none


@kernel(outline=True)
def begin_hessian(work):
    """B becomes the first Hessian without eigenvalues near zero or below, with which steps would go anywhere."""
    n, B = len(work.y), work.B
    total, most = 0.0, 0.0
    for i in range(n):
        for j in range(n):
            B[i, j] = 0.5 * (work.first[i, j] + work.first[j, i])
            total += B[i, j]
            most = max(most, abs(B[i, j]))
    if most == 0.0 or not is_finite(total):
        for i in range(n):
            for j in range(n):
                B[i, j] = 0.0 if i != j else LEAST_CURVATURE if most == 0.0 else 1.0
        return 0
    eigenvectors(B, work.V)
    most = 1.0
    for i in range(n):
        work.s[i] = abs(B[i, i])
        most = max(most, work.s[i])
    for i in range(n):
        work.s[i] = max(work.s[i], LEAST_CURVATURE * most)
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total += work.s[k] * work.V[k, i] * work.V[k, j]
            B[i, j] = total
    return 0


START, FIRST, CURVED, AGAIN, STEP, FULL, CORRECTED, SHORTENED, ACCEPTED = range(9)
"""Stages. The first point is to be evaluated; it is; its Hessian is there; that is to be taken once more; the next step
is to be found. Or the trial point of a full step is evaluated, of a corrected or a shortened one; that was accepted."""

VALUES, SLOPES, HESSIAN, SHOW, SOLVED, SPENT, NO_STEP, NO_PROGRAM = range(10, 18)
"""What is wanted at the trial point; or that the point is new, or the last; that no step, or no quadratic program leads
further."""


@kernel
def judge(work, plain, progress):
    """What follows from the values at the trial point of a step: `ACCEPTED`, or what is wanted at the next one."""
    if is_good(work, progress):
        if progress.stage != SHORTENED:
            return ACCEPTED
        progress.stage = ACCEPTED
        return SLOPES
    # Most of the work of derivatives is that of values: where the next step may begin, they are computed at once.
    may_correct = progress.stage == FULL and progress.alpha == 1.0 and progress.left == 0.0
    if may_correct and progress.violation_trial < INFINITE and correct(work, plain, progress) == 0:
        progress.stage = CORRECTED
        return SLOPES
    progress.alpha *= 0.5 if progress.alpha > 0.1 else 0.2
    if progress.alpha < SHORTEST:
        return NO_STEP
    set_trial(work, progress.alpha, work.d)
    progress.stage = SHORTENED
    return VALUES


@kernel
def begin_step(work, plain, missed, progress):
    """Finds the step from a point, or that it is the last; what is wanted at the trial point."""
    if progress.steps >= progress.most:
        return SPENT
    progress.steps += 1.0
    status = take_step(work, plain, missed, progress)
    if status != 0:
        return NOT_FINITE if status == NOT_FINITE else NO_PROGRAM
    is_feasible = progress.violation <= 0.5 * progress.feasibility
    if is_feasible and progress.left <= LEFT and progress.gain <= GAIN * max(1.0, abs(progress.f)):
        return SOLVED
    set_trial(work, progress.alpha, work.d)
    progress.stage = FULL
    return SLOPES


@kernel(outline=True)
def advance(work, plain, missed, progress):
    """What comes after the last evaluation."""
    stage = progress.stage
    if stage == START:
        progress.stage = FIRST
        return SLOPES
    if stage == FIRST:
        progress.stage = CURVED
        return HESSIAN
    if stage == FULL or stage == CORRECTED or stage == SHORTENED:
        found = judge(work, plain, progress)
        if found != ACCEPTED:
            return found
        stage = ACCEPTED
    if stage == ACCEPTED:
        learn(work)
        progress.stalls = 0.0
    if stage == CURVED or stage == AGAIN:
        begin_hessian(work)
    progress.stage = STEP
    if stage == CURVED or stage == ACCEPTED:
        go(work, progress)
        if progress.shows > 0.0:
            return SHOW
    return begin_step(work, plain, missed, progress)


@kernel(top=True)
def sequential(
    t: float,
    memory: Vector,
    work: Sequence,
    plain: Quadratic,
    missed: Quadratic,
    progress: Progress,
    functions: IntVector,
    words: IntVector,
) -> int:
    """Iterates until Python is needed: one of the above, or `NOT_FINITE`.

    Args:
        t: Of no importance.
        memory: All of it, from address 0.
        work: The points.
        plain: Memory for the quadratic program.
        missed: Memory for one in which linearized constraints may be missed.
        progress: Where the iterations are.
        functions: Addresses of what gives values, also with slopes, and `work.first`, at the trial point; 0 if Python.
        words: Of these.
    """
    while True:
        wanted = advance(work, plain, missed, progress)
        if functions[0] == 0 or wanted > HESSIAN or wanted < VALUES:
            return wanted
        call_row(functions, wanted - VALUES, t, memory, words, 0)
