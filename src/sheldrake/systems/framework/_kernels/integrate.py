"""One step of the continuous state: explicit Runge-Kutta methods and the control of their error.

Z: the integrator's numbers; the other arrays are those of `program`.
"""

from __future__ import annotations

import numpy as np

from sheldrake.common.kernel import IntVector, Vector
from sheldrake.systems.framework._kernels.program import (
    CONTINUOUS,
    DERIV,
    EVALS,
    NUM_XC,
    PYTHON_STEP,
    RK,
    ROW,
    SHRINKS_ERROR,
    STATUS,
    STEADY,
    XC,
    XC_STEPS,
    XDOT,
    Program,
    changed,
    fire,
    i64,
    inner,
    refresh,
    special,
    stage,
)

# Z: what to do and what was done, steps in s.
SCHEME, FIXED, H_MAX, ACCURACY, H_INITIAL, H_MIN, H_IDEAL = i64(0), i64(1), i64(2), i64(3), i64(4), i64(5), i64(6)
H_FIRST, H_SMALLEST, H_LARGEST, H_PREVIOUS, AT_MINIMUM, ORDER = i64(7), i64(8), i64(9), i64(10), i64(11), i64(12)
THROW_ON_MIN, T_BREAK = i64(13), i64(14)
H_TRY, H_ERROR = i64(87), i64(88)  # length of a step, which one made in Python may shorten; its error
EULER, RK2, RK3, TABLEAU, PYTHON = i64(1), i64(2), i64(3), i64(4), i64(5)
# A Butcher tableau in Z: number of stages, nodes, rows of coefficients, weights, weights minus those of lower order.
STAGES, NODES, ROWS, WEIGHTS, ERRORS, WIDTH, NUM_Z = i64(16), i64(17), i64(24), i64(73), i64(80), i64(7), i64(89)

MIN_STEP_STATUS = i64(-1001)


@inner
def derivatives(P, N, S, I, L, rows, out):
    """Time derivatives at the slab's t and xc, copied to S[out:]."""
    changed(I, CONTINUOUS)
    N[EVALS] += 1
    refresh(P, S, I, rows, P.size[DERIV])
    fire(P, S, I, L, rows, P.size[DERIV])
    for i in range(P.size[NUM_XC]):
        S[out + i] = S[P.size[XDOT] + i]


@inner
def derivatives_again(P, N, S, I, L, rows, first, out):
    """The same in a later stage of a step: a copy of those at S[first:] if neither time nor xc has any influence."""
    if P.size[STEADY] == 0:
        derivatives(P, N, S, I, L, rows, out)
    else:
        changed(I, CONTINUOUS)
        N[EVALS] += 1
        for i in range(P.size[NUM_XC]):
            S[out + i] = S[first + i]


@inner
def set_back(P, S, I, t):
    """Back to the state at the beginning of the step."""
    S[0] = t
    for i in range(P.size[NUM_XC]):
        S[P.size[XC] + i] = S[P.size[RK] + i]
    changed(I, CONTINUOUS)


@inner
def combine(P, Z, S, h, first, count, out):
    """x0 + h (coefficients Z[first:first + count] times the stages so far), into S[out:]."""
    n, x0 = P.size[NUM_XC], P.size[RK]
    for i in range(n):
        S[out + i] = 1.0 * S[x0 + i]
    for k in range(count):
        c = h * Z[first + k]
        if c != 0.0:
            for i in range(n):
                S[out + i] = S[out + i] + c * S[x0 + (k + 1) * n + i]


@stage
def tableau_step(
    P: Program, N: IntVector, Z: Vector, S: Vector, I: IntVector, L: Vector, rows: IntVector, h: float
) -> float:
    """One step by the tableau in Z; x0 is in place. Gives the norm of the error estimate."""
    n, x0, xc = P.size[NUM_XC], P.size[RK], P.size[XC]
    t = S[0]
    stages = int(Z[STAGES])
    for s in range(stages):
        if s > 0:
            S[0] = t + h * Z[NODES + s]
            combine(P, Z, S, h, ROWS + s * WIDTH, s, xc)
        derivatives(P, N, S, I, L, rows, x0 + (s + 1) * n)
        if I[STATUS] != 0:
            return 0.0
    combine(P, Z, S, h, WEIGHTS, stages, xc)
    error = 0.0
    for i in range(n):
        e = 0.0
        for s in range(stages):
            e = e + h * Z[ERRORS + s] * S[x0 + (s + 1) * n + i]
        if not abs(e) <= error:
            error = abs(e)
    return error


@inner
def euler_step(P, N, S, I, L, rows, h):
    """Explicit Euler."""
    n, x0, xc = P.size[NUM_XC], P.size[RK], P.size[XC]
    k1 = x0 + n
    derivatives(P, N, S, I, L, rows, k1)
    if I[STATUS] == 0:
        for i in range(n):
            S[xc + i] = S[x0 + i] + h * S[k1 + i]


@inner
def heun_step(P, N, S, I, L, rows, h):
    """Heun's method of order 2: an Euler step, then the mean of the slopes at its ends."""
    n, x0, xc = P.size[NUM_XC], P.size[RK], P.size[XC]
    k1, k2 = x0 + n, x0 + 2 * n
    t = S[0]
    euler_step(P, N, S, I, L, rows, h)
    if I[STATUS] == 0:
        S[0] = t + h
        derivatives_again(P, N, S, I, L, rows, k1, k2)
        for i in range(n):
            S[xc + i] = S[xc + i] + h * 0.5 * S[k2 + i] - h * 0.5 * S[k1 + i]


@inner
def kutta_step(P, N, S, I, L, rows, h):
    """Kutta's method of order 3; gives the norm of its difference from the midpoint rule, which is of order 2."""
    n, x0, xc = P.size[NUM_XC], P.size[RK], P.size[XC]
    k1, k2, k3 = x0 + n, x0 + 2 * n, x0 + 3 * n
    t = S[0]
    error = 0.0
    derivatives(P, N, S, I, L, rows, k1)
    if I[STATUS] == 0:
        for i in range(n):
            S[xc + i] = S[x0 + i] + h * 0.5 * S[k1 + i]
        S[0] = t + h * 0.5
        derivatives_again(P, N, S, I, L, rows, k1, k2)
    if I[STATUS] == 0:
        for i in range(n):
            S[xc + i] = S[x0 + i] - h * S[k1 + i] + 2.0 * h * S[k2 + i]
        S[0] = t + h
        derivatives_again(P, N, S, I, L, rows, k1, k3)
        for i in range(n):
            S[xc + i] = (
                S[x0 + i] + h * (1.0 / 6.0) * S[k1 + i] + h * (2.0 / 3.0) * S[k2 + i] + h * (1.0 / 6.0) * S[k3 + i]
            )
            e = abs(S[xc + i] - S[x0 + i] - h * S[k2 + i])
            if not e <= error:
                error = e
    return error


@stage
def explicit_step(
    P: Program, N: IntVector, Z: Vector, S: Vector, I: IntVector, L: Vector, rows: IntVector, h: float
) -> float:
    """One step of length h [s] by the scheme in Z; gives the norm of its error estimate.

    Memory at S[RK:]: x0, then the stages k1, k2, ... On a bad status the state is what it was.
    """
    n, x0, xc = P.size[NUM_XC], P.size[RK], P.size[XC]
    t, error = S[0], 0.0
    Z[H_TRY] = h
    for i in range(n):
        S[x0 + i] = S[xc + i]
    if Z[SCHEME] == TABLEAU:
        error = tableau_step(P, N, Z, S, I, L, rows, h)
    elif Z[SCHEME] == PYTHON:
        special(P, S, I, rows, PYTHON_STEP)
        h, error = Z[H_TRY], Z[H_ERROR]
    elif Z[SCHEME] == EULER:
        euler_step(P, N, S, I, L, rows, h)
    elif Z[SCHEME] == RK2:
        heun_step(P, N, S, I, L, rows, h)
    else:
        error = kutta_step(P, N, S, I, L, rows, h)
    if I[STATUS] != 0:
        set_back(P, S, I, t)
    else:
        S[0] = t + h
        changed(I, CONTINUOUS)
    return error


@inner
def grows_most(error, accuracy, order):
    """Whether the formula of `next_step_size` gives 5 h or more; without its root, which takes 25 ns."""
    for _ in range(int(order)):
        error = error * (5.0 / 0.9)
    return error < accuracy


@inner
def next_step_size(Z, h, error):
    """The step to try next: larger than h if the error allows, smaller if it must be repeated.

    Hairer, Norsett, Wanner: Solving Ordinary Differential Equations I, eq. (II.4.13), with what lies close to h left
    at h.
    """
    if not error < np.inf:  # also not a number
        h_new = 0.1 * h
    elif grows_most(error, Z[ACCURACY], Z[ORDER]):
        h_new = 5.0 * h
    else:
        h_new = 0.9 * h * (Z[ACCURACY] / error) ** (1.0 / Z[ORDER])
    if h_new > h:
        if h_new < 1.2 * h:
            h_new = h
    elif h_new < h:
        h_new = h if error <= Z[ACCURACY] else min(h_new, 0.9 * h)
    return min(max(min(h_new, 5.0 * h), 0.1 * h), Z[H_MAX])


@stage
def controlled_step(
    P: Program, N: IntVector, Z: Vector, S: Vector, I: IntVector, L: Vector, rows: IntVector, h_most: float
) -> None:
    """One step of at most h_most [s], repeated smaller until it is accurate; Z[H_TRY] is its length."""
    t = S[0]
    h = Z[H_IDEAL] if Z[H_IDEAL] > 0.0 else Z[H_INITIAL]
    while True:
        limited = 0
        if h_most < 0.95 * h:
            limited = 1
            h = h_most
        elif h_most < 1.001 * h:
            h = h_most
        h = min(h, Z[H_MAX])
        error = explicit_step(P, N, Z, S, I, L, rows, h)
        if I[STATUS] != 0:
            return
        h = Z[H_TRY]
        h_new = next_step_size(Z, h, error)
        h_min = max(Z[H_MIN], 1e-14 * max(1.0, abs(t)))
        accepted = h_new >= h
        if h_new < h_min:
            if Z[THROW_ON_MIN] != 0.0 and not accepted:
                set_back(P, S, I, t)
                I[STATUS] = MIN_STEP_STATUS
                I[ROW] = -1
                return
            accepted = accepted or h <= h_min
            h_new = h_min
        if accepted:
            if limited == 0:
                Z[H_IDEAL] = h_new
            if not Z[H_FIRST] > 0.0:
                Z[H_FIRST] = h
            if not Z[H_SMALLEST] > 0.0 or (h < Z[H_SMALLEST] and h < h_most):
                Z[H_SMALLEST] = h
            return
        N[SHRINKS_ERROR] += 1
        set_back(P, S, I, t)
        h = h_new


@stage
def integrate(
    P: Program, N: IntVector, Z: Vector, S: Vector, I: IntVector, L: Vector, rows: IntVector, t_event: float, T: float
) -> None:
    """One step of the continuous state, to the next event or the boundary T at most; moves time."""
    t_target = min(t_event, T)
    if P.size[NUM_XC] == 0:
        S[0] = t_target
        changed(I, CONTINUOUS)
        return
    t = S[0]
    boundary = T < t_event
    if (boundary and t + Z[H_MAX] < t_target) or (not boundary and t + Z[H_MAX] * 1.01 < t_target):
        t_target = t + Z[H_MAX]
    if Z[FIXED] != 0.0:
        explicit_step(P, N, Z, S, I, L, rows, t_target - t)
    else:
        controlled_step(P, N, Z, S, I, L, rows, t_target - t)
    full = Z[H_TRY] == t_target - t
    if I[STATUS] != 0:
        return
    N[XC_STEPS] += 1
    h = S[0] - t
    if not Z[H_LARGEST] >= h:
        Z[H_LARGEST] = h
    Z[H_PREVIOUS] = h
    if full or S[0] >= t_target:
        S[0] = t_target
        changed(I, CONTINUOUS)
