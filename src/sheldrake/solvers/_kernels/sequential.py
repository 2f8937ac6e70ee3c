"""Sequential quadratic programming: quadratic programs, what of their steps is good, and what is learned of them."""

from __future__ import annotations

from typing import NamedTuple

from sheldrake.common._kernels.generic import is_finite
from sheldrake.common.kernel import IntVector, Matrix, Vector, kernel
from sheldrake.common.record import Record, number
from sheldrake.solvers._kernels.active_set import INFEASIBLE, Quadratic, solve_by_rows, solve_quadratic

INFINITE = float("inf")
REACH = 0.5  # of one step, relative to the point and 1
LONGEST = 1e3  # of what is still a step
FIRST_PENALTY, LAST_PENALTY = 10.0, 1e8  # for linearized constraints that are missed, relative to the cost's gradient


class Sequence(NamedTuple):
    """A point, a trial point, and the step from one to the other.

    Attributes:
        y: The point, shape (n,).
        trial: The other.
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
        B: The Lagrangian's Hessian, as learned.
        d: The step.
        weights: Multipliers of `sides`, not negative.
        s: Scratch, shape (n,).
        r: Scratch, shape (n,).
    """

    y: Vector
    trial: Vector
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
    B: Matrix
    d: Vector
    weights: Vector
    s: Vector
    r: Vector


class Progress(Record):
    """Where the iterations are."""

    f = number("cost")
    f_trial = number("cost at the trial point")
    violation = number("the largest of a row")
    violation_trial = number("the same at the trial point; infinite where something is not finite")
    penalty = number("what violations are weighed with")
    left = number("by how much linearized constraints are still missed after the step")
    gain = number("what the step may bring")
    slope = number("of the penalty function along the step")
    longest = number("the largest change of a variable")
    alpha = number("the part of the step that is tried")
    held = number("how many rows held with equality at the last step")


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
    penalty = FIRST_PENALTY
    while True:
        missed.q[n] = penalty * scale
        count = solve_quadratic(missed, 0)
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
    return 1 if progress.f_trial + progress.penalty * progress.violation_trial <= enough else 0


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
    progress.f = progress.f_trial
    for j in range(len(work.y)):
        work.y[j], work.g[j] = work.trial[j], work.g_trial[j]
    for i in range(len(work.rows)):
        work.rows[i] = work.rows_trial[i]
        for j in range(len(work.y)):
            work.J[i, j] = work.J_trial[i, j]


GO, STEP, TRY, JUDGE, CORRECT, LEARN_AND_GO = range(6)


@kernel(top=True)
def sequential_step(work: Sequence, plain: Quadratic, missed: Quadratic, progress: Progress, what: int) -> int:
    """One of the above; its answer, or 0.

    Args:
        work: The points.
        plain: Memory for the quadratic program.
        missed: Memory for one in which linearized constraints may be missed.
        progress: Where the iterations are.
        what: What to do.
    """
    if what == STEP:
        return take_step(work, plain, missed, progress)
    if what == JUDGE:
        return is_good(work, progress)
    if what == CORRECT:
        return correct(work, plain, progress)
    if what == TRY:
        set_trial(work, progress.alpha, work.d)
        return 0
    if what == LEARN_AND_GO:
        learn(work)
    go(work, progress)
    return 0
