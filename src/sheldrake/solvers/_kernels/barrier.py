"""Steps of an interior point method: how far from optimal a point is, Newton's system there, what is kept of a step.

Equation numbers are those of A. Waechter and L. T. Biegler (Mathematical Programming 106, 2006). Bounds that are not
there are infinite.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.common.kernel import IntVector, Vector, kernel
from sheldrake.common.record import Record, number
from sheldrake.solvers._kernels.ldl import factor_ldl, solve_ldl

SMALLEST_MU = 1e-11
FIRST_REGULARIZATION, LARGEST_REGULARIZATION = 1e-4, 1e20
EXACT = 1e-6  # Largest residual of a solution, relative to the right side.
FAR = 1e10  # Factor between multipliers of bounds and those of the barrier.
LEAST_GAP = 2.220446049250313e-16**0.75  # Relative to numbers above one.
INFINITE = 1e300


class System(NamedTuple):
    """Newton's matrix [[W + diagonal, J'], [J, -gamma]], its factors, and room for both; laid out once.

    Attributes:
        W_slots: Which of `entries` each entry of the Hessian adds to; -1 for those of its other half.
        diagonal_slots: The same of the diagonal, shape (n,).
        J_slots: The same of the Jacobian.
        gamma_slots: The same of the diagonal below, shape (m,).
        starts: Of each column, as in `ldl`, which has the other fields too.
        cols: Column of each of `entries`.
        order: Which row and column is eliminated when.
        scale: What rows and columns are multiplied with.
        largest: Scratch.
    """

    W_slots: IntVector
    diagonal_slots: IntVector
    J_slots: IntVector
    gamma_slots: IntVector
    starts: IntVector
    rows: IntVector
    cols: IntVector
    entries: Vector
    shift: Vector
    parent: IntVector
    L_starts: IntVector
    L_rows: IntVector
    L: Vector
    D: Vector
    filled: IntVector
    flag: IntVector
    pattern: IntVector
    y: Vector
    order: IntVector
    scale: Vector
    largest: Vector
    b: Vector
    x: Vector
    info: Vector


class Iterate(NamedTuple):
    """A point, what is known there, and the step from it.

    Attributes:
        z: The point; the next one, if it is taken, is `trial`.
        lower: Bounds of z; they give way where rounding puts z onto them.
        zL: Multipliers of the lower bounds.
        lam: Multipliers of the rows.
        g: Gradient of the cost.
        c: Residuals of the rows.
        c_trial: Those at `trial`.
        c_corrected: Those that a correction of second order is for.
        J: Entries of the Jacobian, at (J_rows, J_cols).
        W: Entries of the Hessian.
        sigma: Diagonal of the barrier.
        slope: Gradient of the barrier problem.
        right: Of Newton's system.
        found: Steps of z, and the next multipliers themselves.
        corrected: The same of a correction.
        step_L: Steps of zL.
    """

    z: Vector
    trial: Vector
    lower: Vector
    upper: Vector
    zL: Vector
    zU: Vector
    lam: Vector
    g: Vector
    c: Vector
    c_trial: Vector
    c_corrected: Vector
    J: Vector
    J_rows: IntVector
    J_cols: IntVector
    W: Vector
    sigma: Vector
    slope: Vector
    right: Vector
    found: Vector
    corrected: Vector
    step_L: Vector
    step_U: Vector


class Progress(Record):
    """Where the iterations are."""

    mu = number("barrier parameter")
    tolerance = number("of the conditions of optimality")
    delta = number("the last regularization that was needed")
    f = number("cost")
    f_trial = number("cost at the trial point")
    error = number("of the conditions of optimality")
    theta = number("sum of residuals")
    phi = number("barrier function")
    descent = number("of the barrier function along the step")
    longest = number("the part of the step that leaves a share of all gaps")
    relative = number("largest change of a variable along the step, relative to those above one")
    alpha = number("the part of the step that is tried")
    theta_trial = number("sum of residuals at the trial point")
    phi_trial = number("barrier function at the trial point")


@kernel(outline=True)
def factorize(system, W, diagonal, delta, J, gamma):
    """Factors the matrix with more on its diagonal."""
    entries, scale, largest = system.entries, system.scale, system.largest
    for k in range(len(entries)):
        entries[k] = 0.0
    for k in range(len(W)):
        if system.W_slots[k] >= 0:
            entries[system.W_slots[k]] += W[k]
    for k in range(len(diagonal)):
        entries[system.diagonal_slots[k]] += diagonal[k] + delta
    for k in range(len(J)):
        entries[system.J_slots[k]] += J[k]
    for k in range(len(system.gamma_slots)):
        entries[system.gamma_slots[k]] -= gamma
    # Rows and columns are scaled alike, to largest entries of about one; that leaves the inertia as it is.
    for i in range(len(scale)):
        scale[i] = 1.0
    for _ in range(2):
        for i in range(len(scale)):
            largest[i] = 0.0
        for k in range(len(entries)):
            i, j = system.rows[k], system.cols[k]
            size = abs(entries[k]) * scale[i] * scale[j]
            largest[i] = max(largest[i], size)
            largest[j] = max(largest[j], size)
        for i in range(len(scale)):
            if largest[i] > 0.0:
                scale[i] /= largest[i] ** 0.5
    for k in range(len(entries)):
        entries[k] *= scale[system.rows[k]] * scale[system.cols[k]]
    return factor_ldl(
        system.starts, system.rows, entries, system.shift, system.parent, system.L_starts, system.L_rows, system.L,
        system.D, system.filled, system.flag, system.pattern, system.y,
    )  # fmt: skip


@kernel(outline=True)
def solve_factored(system, right, found):
    """Solves, by the factors."""
    for i in range(len(system.b)):
        system.b[i] = right[system.order[i]] * system.scale[i]
    solve_ldl(
        system.starts, system.rows, system.entries, system.L_starts, system.L_rows, system.L, system.D, system.b,
        system.x, system.y, system.info,
    )  # fmt: skip
    for i in range(len(system.b)):
        found[system.order[i]] = system.x[i] * system.scale[i]
        system.y[i] = 0.0


@kernel(outline=True)
def optimality_error(it, progress):
    """How far from optimal the point is, eq. (5), and the next barrier parameters that it is good for, eq. (7).

    Gives 1 if there is another barrier parameter.
    """
    n, m = len(it.z), len(it.lam)
    for i in range(n):
        it.right[i] = it.g[i] - it.zL[i] + it.zU[i]
    for k in range(len(it.J)):
        it.right[it.J_cols[k]] += it.J[k] * it.lam[it.J_rows[k]]
    both, dual, rows, residual = 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        both += abs(it.zL[i]) + abs(it.zU[i])
        dual = max(dual, abs(it.right[i]))
    for j in range(m):
        rows += abs(it.lam[j])
        residual = max(residual, abs(it.c[j]))
    s_d = max(100.0, (rows + both) / max(1, m + n)) / 100.0
    s_c = max(100.0, both / max(1, n)) / 100.0
    others = max(dual / s_d, residual)
    progress.error = max(others, gap_error(it, 0.0) / s_c)
    lowered = 0
    while progress.mu > SMALLEST_MU and max(others, gap_error(it, progress.mu) / s_c) <= 10.0 * progress.mu:
        mu = progress.mu
        progress.mu = max(min(SMALLEST_MU, 0.1 * progress.tolerance), min(0.2 * mu, mu**1.5))
        lowered = 1
    return lowered


@kernel
def gap_error(it, mu):
    """By how much gaps times multipliers are not mu."""
    most = 0.0
    for i in range(len(it.z)):
        if it.lower[i] > -INFINITE:
            most = max(most, abs((it.z[i] - it.lower[i]) * it.zL[i] - mu))
        if it.upper[i] < INFINITE:
            most = max(most, abs((it.upper[i] - it.z[i]) * it.zU[i] - mu))
    return most


@kernel(outline=True)
def newton_step(system, it, progress):
    """Steps of z and of the multipliers, eq. (13), with as much regularization as a step of descent takes.

    Gives 1 where there is none.
    """
    n, m, mu = len(it.z), len(it.lam), progress.mu
    for i in range(n):
        sigma, slope = 0.0, it.g[i]
        if it.lower[i] > -INFINITE:
            low = it.z[i] - it.lower[i]
            sigma += it.zL[i] / low
            slope -= mu / low
        if it.upper[i] < INFINITE:
            high = it.upper[i] - it.z[i]
            sigma += it.zU[i] / high
            slope += mu / high
        it.sigma[i], it.slope[i], it.right[i] = sigma, slope, -slope
    for j in range(m):
        it.right[n + j] = -it.c[j]
    delta, gamma = 0.0, 0.0
    while delta <= LARGEST_REGULARIZATION:
        if factorize(system, it.W, it.sigma, delta, it.J, gamma) == m:
            solve_factored(system, it.right, it.found)
            if system.info[0] < EXACT:
                if delta > 0.0:
                    progress.delta = delta
                measure_step(it, progress)
                return 0
            if gamma == 0.0:  # rows that depend on each other
                gamma = 1e-8 * mu**0.25
                continue
        if delta > 0.0:
            delta *= 8.0
        elif progress.delta > 0.0:
            delta = max(1e-20, progress.delta / 3.0)
        else:
            delta = FIRST_REGULARIZATION
    return 1


@kernel(outline=True)
def least_multipliers(system, it):
    """Multipliers that leave least of the gradient, eq. (36); none if they are very large."""
    n, m = len(it.z), len(it.lam)
    for k in range(len(it.W)):
        it.W[k] = 0.0
    for i in range(n):
        it.sigma[i], it.right[i] = 1.0, -(it.g[i] - it.zL[i] + it.zU[i])
    for j in range(m):
        it.right[n + j], it.lam[j] = 0.0, 0.0
    factorize(system, it.W, it.sigma, 0.0, it.J, 1e-10)
    solve_factored(system, it.right, it.found)
    largest = 0.0
    for j in range(m):
        largest = max(largest, abs(it.found[n + j]))
    if system.info[0] < EXACT and largest <= 1e3:
        for j in range(m):
            it.lam[j] = it.found[n + j]
    return 0


@kernel(outline=True)
def measure_step(it, progress):
    """What the line search has to know of a step."""
    progress.theta = sum_of_sizes(it.c)
    progress.phi = barrier_of(it, it.z, progress.f, progress.mu)
    descent, relative = 0.0, 0.0
    for i in range(len(it.z)):
        descent += it.slope[i] * it.found[i]
        relative = max(relative, abs(it.found[i]) / (1.0 + abs(it.z[i])))
    progress.descent, progress.relative = descent, relative
    progress.longest = longest_of(it, it.found, progress.mu)


@kernel
def sum_of_sizes(c):
    total = 0.0
    for j in range(len(c)):
        total += abs(c[j])
    return total


@kernel
def barrier_of(it, z, f, mu):
    """The barrier function at z."""
    total = 0.0
    for i in range(len(z)):
        if it.lower[i] > -INFINITE:
            total += np.log(z[i] - it.lower[i])
        if it.upper[i] < INFINITE:
            total += np.log(it.upper[i] - z[i])
    return f - mu * total


@kernel
def longest_of(it, d, mu):
    """The part of a step d that leaves a share of all gaps, eq. (15a)."""
    tau, part = max(0.99, 1.0 - mu), 1.0
    for i in range(len(it.z)):
        if it.lower[i] > -INFINITE and d[i] < 0.0:
            part = min(part, -tau * (it.z[i] - it.lower[i]) / d[i])
        if it.upper[i] < INFINITE and d[i] > 0.0:
            part = min(part, tau * (it.upper[i] - it.z[i]) / d[i])
    return part


@kernel(outline=True)
def set_trial_point(it, progress):
    """The trial point: `alpha` times the step."""
    for i in range(len(it.z)):
        it.trial[i] = it.z[i] + progress.alpha * it.found[i]


@kernel(outline=True)
def evaluate_trial_point(it, progress):
    """Residuals and barrier function at the trial point, of which `c_trial` and `f_trial` are known."""
    progress.theta_trial = sum_of_sizes(it.c_trial)
    progress.phi_trial = barrier_of(it, it.trial, progress.f_trial, progress.mu)


@kernel(outline=True)
def second_order_correction(system, it, progress):
    """The trial point of a correction of second order, eq. (27), and its `alpha`; 1 where there is none."""
    n = len(it.z)
    for i in range(n):
        it.right[i] = -it.slope[i]
    for j in range(len(it.lam)):
        it.right[n + j] = -it.c_corrected[j]
    solve_factored(system, it.right, it.corrected)
    if not (system.info[0] < EXACT):
        return 1
    progress.alpha = longest_of(it, it.corrected, progress.mu)
    for i in range(n):
        it.trial[i] = it.z[i] + progress.alpha * it.corrected[i]
    return 0


@kernel(outline=True)
def accept_trial_point(it, progress):
    """The trial point becomes the point; multipliers follow, and stay near those of the barrier, eq. (16)."""
    n, mu = len(it.z), progress.mu
    share, tau = 1.0, max(0.99, 1.0 - mu)
    for i in range(n):
        it.step_L[i] = 0.0
        it.step_U[i] = 0.0
        if it.lower[i] > -INFINITE:
            low = it.z[i] - it.lower[i]
            it.step_L[i] = mu / low - it.zL[i] - it.zL[i] / low * it.found[i]
            if it.step_L[i] < 0.0:
                share = min(share, -tau * it.zL[i] / it.step_L[i])
        if it.upper[i] < INFINITE:
            high = it.upper[i] - it.z[i]
            it.step_U[i] = mu / high - it.zU[i] + it.zU[i] / high * it.found[i]
            if it.step_U[i] < 0.0:
                share = min(share, -tau * it.zU[i] / it.step_U[i])
    for j in range(len(it.lam)):
        it.lam[j] += progress.alpha * (it.found[n + j] - it.lam[j])
    for i in range(n):
        z = it.trial[i]
        it.z[i] = z
        little = LEAST_GAP * max(1.0, abs(z))
        if it.lower[i] > -INFINITE:
            if z - it.lower[i] < 1e-4 * little:  # rounding has put it onto its bound, section 3.5
                it.lower[i] = z - little
            low = z - it.lower[i]
            it.zL[i] = max(mu / low / FAR, min(it.zL[i] + share * it.step_L[i], mu / low * FAR))
        if it.upper[i] < INFINITE:
            if it.upper[i] - z < 1e-4 * little:
                it.upper[i] = z + little
            high = it.upper[i] - z
            it.zU[i] = max(mu / high / FAR, min(it.zU[i] + share * it.step_U[i], mu / high * FAR))


OPTIMALITY_ERROR, NEWTON_STEP, SET_TRIAL_POINT, EVALUATE_TRIAL_POINT = range(4)
SECOND_ORDER_CORRECTION, ACCEPT_TRIAL_POINT, LEAST_MULTIPLIERS = range(4, 7)


@kernel(top=True)
def interior_point_step(system: System, it: Iterate, progress: Progress, what: int) -> int:
    """One of the above; its answer, or 0. They have one entry, so that all of them are bound at once."""
    if what == OPTIMALITY_ERROR:
        return optimality_error(it, progress)
    if what == NEWTON_STEP:
        return newton_step(system, it, progress)
    if what == SECOND_ORDER_CORRECTION:
        return second_order_correction(system, it, progress)
    if what == LEAST_MULTIPLIERS:
        return least_multipliers(system, it)
    if what == SET_TRIAL_POINT:
        set_trial_point(it, progress)
    elif what == EVALUATE_TRIAL_POINT:
        evaluate_trial_point(it, progress)
    else:
        accept_trial_point(it, progress)
    return 0
