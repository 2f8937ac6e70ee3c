"""One step of the continuous state: explicit Runge-Kutta methods and the control of their error.

What the arrays are says `program`.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from sheldrake.common._kernels.generic import value_of
from sheldrake.common._kernels.vec import copy_numbers
from sheldrake.common.kernel import IntVector, Vector, kernel
from sheldrake.common.record import Record, array, number, table
from sheldrake.systems.framework._kernels.program import (
    CONTINUOUS,
    DISCRETE,
    PYTHON_STEP,
    Program,
    Run,
    Side,
    changed,
    fire,
    inner,
    refresh,
    special,
    stage,
)

# Schemes.
EULER, RK2, RK3, TABLEAU, PYTHON = range(1, 6)
STRETCH = 1.001  # times a step: an end no farther away is reached with it


class IntegratorNumbers(Record):
    """What to do and what was done."""

    scheme = number("EULER, RK2, ...")
    fixed = number("1: steps have the largest length, whatever their error")
    h_max = number("largest step", "s")
    accuracy = number("that error control aims at")
    h_initial = number("first step with error control", "s")
    h_min = number("smallest step of error control", "s")
    h_ideal = number("step to try next; 0 before the first", "s")
    h_first = number("the first step that was taken", "s")
    h_smallest = number("the smallest that error control took", "s")
    h_largest = number("the largest that was taken", "s")
    h_previous = number("the last that was taken", "s")
    order = number("of the scheme")
    throw_on_min = number("1: it is an error when accuracy asks for less than h_min")
    t_break = number("time at which Python looks in", "s")
    stages = number("of the tableau (J. Butcher), 7 at most")
    nodes = array(7, "of the tableau: times of the stages, in parts of a step")
    rows = array((7, 7), "of the tableau: coefficients of the stages")
    weights = array(7, "of the tableau")
    errors = array(7, "of the tableau: weights less those of lower order")
    h_try = number("length of a step, which one made in Python may shorten", "s")
    h_error = number("norm of its error")
    coefficients = array((8, 7), "`rows`, then `weights`", same_as=rows)


@table
class Integrator(NamedTuple):
    """The numbers of an integrator."""

    number: Annotated[Vector, IntegratorNumbers]


WEIGHTS = 7  # row of `coefficients`
MIN_STEP_STATUS = -1001


@inner
def derivatives(program, run, S, side, L, rows, out):
    """Time derivatives at the slab's t and xc, copied to S[out:]."""
    changed(side, CONTINUOUS)
    run.evals += 1
    refresh(program, S, side, rows, program.derivatives)
    fire(program, S, side, L, rows, program.derivatives)
    copy_numbers(S, out, S, program.xdot, program.num_xc)


@kernel(top=True, strict=True, short_loops=True)
def derivatives_now(program_model: Program, S: Vector, side: Side, L: Vector, rows: IntVector) -> int:
    """Time derivatives at the slab's t and xc between steps; a status, which the side has not kept."""
    program = program_model
    refresh(program, S, side, rows, program.derivatives)
    fire(program, S, side, L, rows, program.derivatives)
    status = int(side.status)
    side.status = 0
    if status == 0:
        for j in range(program.calls_begin[program.derivatives], program.calls_begin[program.derivatives + 1]):
            side.word[program.stamps + program.calls[j]] = side.word[CONTINUOUS]
    return status


@kernel(top=True, strict=True, short_loops=True)
def updates_now(program_model: Program, S: Vector, side: Side, L: Vector, rows: IntVector) -> int:
    """Periodic discrete updates of one timing between steps, from x into x+; a status, which the side has not kept."""
    program = program_model
    for g in range(program.num_groups):
        if program.groups[g].kind == DISCRETE and program.groups[g].clock >= 0:
            refresh(program, S, side, rows, g)
            fire(program, S, side, L, rows, g)
    status = int(side.status)
    side.status = 0
    return status


@inner
def derivatives_again(program, run, S, side, L, rows, first, out):
    """The same in a later stage of a step: a copy of those at S[first:] if neither time nor xc has any influence."""
    if program.steady == 0:
        derivatives(program, run, S, side, L, rows, out)
    else:
        changed(side, CONTINUOUS)
        run.evals += 1
        copy_numbers(S, out, S, first, program.num_xc)


@inner
def set_back(program, S, side, t):
    """Back to the state at the beginning of the step."""
    S[0] = t
    copy_numbers(S, program.xc, S, program.x0, program.num_xc)
    changed(side, CONTINUOUS)


@inner
def combine(program, integrator, S, h, row, count, out):
    """x0 + h (a row of coefficients times the `count` stages so far), into S[out:]."""
    n, x0 = program.num_xc, program.x0
    for i in range(n):
        S[out + i] = 1.0 * S[x0 + i]
    for k in range(count):
        c = h * integrator.coefficients[row, k]
        if c != 0.0:
            for i in range(n):
                S[out + i] = S[out + i] + c * S[x0 + (k + 1) * n + i]


@stage
def tableau_step(
    program: Program, run: Run, integrator: Integrator, S: Vector, side: Side, L: Vector, rows: IntVector, h: float
) -> float:
    """One step by the tableau; x0 is in place. Gives the norm of the error estimate."""
    n, x0, xc = program.num_xc, program.x0, program.xc
    t = S[0]
    stages = int(integrator.stages)
    for s in range(stages):
        if s > 0:
            S[0] = t + h * integrator.nodes[s]
            combine(program, integrator, S, h, s, s, xc)
        derivatives(program, run, S, side, L, rows, x0 + (s + 1) * n)
        if side.status != 0:
            return 0.0
    combine(program, integrator, S, h, WEIGHTS, stages, xc)
    error = 0.0
    for i in range(n):
        e = 0.0
        for s in range(stages):
            e = e + h * integrator.errors[s] * S[x0 + (s + 1) * n + i]
        if not abs(e) <= error:
            error = abs(e)
    return error


@inner
def euler_step(program, run, S, side, L, rows, h):
    """Explicit Euler."""
    n, x0, xc = program.num_xc, program.x0, program.xc
    k1 = x0 + n
    derivatives(program, run, S, side, L, rows, k1)
    if side.status == 0:
        for i in range(n):
            S[xc + i] = S[x0 + i] + h * S[k1 + i]


@inner
def heun_step(program, run, S, side, L, rows, h):
    """Heun's method of order 2: an Euler step, then the mean of the slopes at its ends."""
    n, x0, xc = program.num_xc, program.x0, program.xc
    k1, k2 = x0 + n, x0 + 2 * n
    t = S[0]
    euler_step(program, run, S, side, L, rows, h)
    if side.status == 0:
        S[0] = t + h
        derivatives_again(program, run, S, side, L, rows, k1, k2)
        for i in range(n):
            S[xc + i] = S[xc + i] + h * 0.5 * S[k2 + i] - h * 0.5 * S[k1 + i]


@inner
def kutta_step(program, run, S, side, L, rows, h):
    """Kutta's method of order 3; gives the norm of its difference from the midpoint rule, which is of order 2."""
    n, x0, xc = program.num_xc, program.x0, program.xc
    k1, k2, k3 = x0 + n, x0 + 2 * n, x0 + 3 * n
    t = S[0]
    error = 0.0
    derivatives(program, run, S, side, L, rows, k1)
    if side.status == 0:
        for i in range(n):
            S[xc + i] = S[x0 + i] + h * 0.5 * S[k1 + i]
        S[0] = t + h * 0.5
        derivatives_again(program, run, S, side, L, rows, k1, k2)
    if side.status == 0:
        for i in range(n):
            S[xc + i] = S[x0 + i] - h * S[k1 + i] + 2.0 * h * S[k2 + i]
        S[0] = t + h
        derivatives_again(program, run, S, side, L, rows, k1, k3)
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
    program: Program, run: Run, integrator: Integrator, S: Vector, side: Side, L: Vector, rows: IntVector, h: float
) -> float:
    """One step of length h [s] by the integrator's scheme; gives the norm of its error estimate.

    Memory at S[x0:]: x0, then the stages k1, k2, ... On a bad status the state is what it was.
    """
    n, x0, xc = program.num_xc, program.x0, program.xc
    t, error = S[0], 0.0
    integrator.h_try = h
    copy_numbers(S, x0, S, xc, n)
    if integrator.scheme == TABLEAU:
        error = tableau_step(program, run, integrator, S, side, L, rows, h)
    elif integrator.scheme == PYTHON:
        special(program, S, side, rows, PYTHON_STEP)
        h, error = integrator.h_try, integrator.h_error
    elif integrator.scheme == EULER:
        euler_step(program, run, S, side, L, rows, h)
    elif integrator.scheme == RK2:
        heun_step(program, run, S, side, L, rows, h)
    else:
        error = kutta_step(program, run, S, side, L, rows, h)
    if side.status != 0:
        set_back(program, S, side, t)
    else:
        S[0] = t + h
        changed(side, CONTINUOUS)
    return value_of(error)  # steps have no derivatives where states have


@inner
def grows_most(error, accuracy, order):
    """Whether the formula of `next_step_size` gives 5 h or more; without its root, which takes 25 ns."""
    for _ in range(int(order)):
        error = error * (5.0 / 0.9)
    return error < accuracy


@inner
def next_step_size(integrator, h, error):
    """The step to try next: larger than h if the error allows, smaller if it must be repeated.

    Hairer, Norsett, Wanner: Solving Ordinary Differential Equations I, eq. (II.4.13), with what lies close to h left
    at h.
    """
    if not error < np.inf:  # also not a number
        h_new = 0.1 * h
    elif grows_most(error, integrator.accuracy, integrator.order):
        h_new = 5.0 * h
    else:
        h_new = 0.9 * h * (integrator.accuracy / error) ** (1.0 / integrator.order)
    if h_new > h:
        if h_new < 1.2 * h:
            h_new = h
    elif h_new < h:
        h_new = h if error <= integrator.accuracy else min(h_new, 0.9 * h)
    return min(max(min(h_new, 5.0 * h), 0.1 * h), integrator.h_max)


@stage
def controlled_step(
    program: Program, run: Run, integrator: Integrator, S: Vector, side: Side, L: Vector, rows: IntVector, h_most: float
) -> None:
    """One step of at most h_most [s], repeated smaller until it is accurate; integrator.h_try is its length."""
    t = S[0]
    h = integrator.h_ideal if integrator.h_ideal > 0.0 else integrator.h_initial
    while True:
        limited = 0
        if h_most < 0.95 * h:
            limited = 1
            h = h_most
        elif h_most < STRETCH * h:
            h = h_most
        h = min(h, integrator.h_max)
        error = explicit_step(program, run, integrator, S, side, L, rows, h)
        if side.status != 0:
            return
        h = integrator.h_try
        h_new = next_step_size(integrator, h, error)
        h_min = max(integrator.h_min, 1e-14 * max(1.0, abs(t)))
        accepted = h_new >= h
        if h_new < h_min:
            if integrator.throw_on_min != 0.0 and not accepted:
                set_back(program, S, side, t)
                side.status = MIN_STEP_STATUS
                side.row = -1
                return
            accepted = accepted or h <= STRETCH * h_min
            h_new = h_min
        if accepted:
            if limited == 0:
                integrator.h_ideal = h_new
            if not integrator.h_smallest > 0.0 or (h < integrator.h_smallest and h < h_most):
                integrator.h_smallest = h
            return
        run.shrinks_error += 1
        set_back(program, S, side, t)
        h = h_new


@stage
def integrate(
    program: Program,
    run: Run,
    integrator: Integrator,
    S: Vector,
    side: Side,
    L: Vector,
    rows: IntVector,
    t_event: float,
    T: float,
) -> None:
    """One step of the continuous state, to the next event or the boundary T at most; moves time."""
    t_target = min(t_event, T)
    if program.num_xc == 0:
        S[0] = t_target
        changed(side, CONTINUOUS)
        return
    t = S[0]
    boundary = T < t_event
    if (boundary and t + integrator.h_max < t_target) or (not boundary and t + integrator.h_max * 1.01 < t_target):
        t_target = t + integrator.h_max
    if integrator.fixed != 0.0:
        explicit_step(program, run, integrator, S, side, L, rows, t_target - t)
    else:
        controlled_step(program, run, integrator, S, side, L, rows, t_target - t)
    full = integrator.h_try == t_target - t
    if side.status != 0:
        return
    run.xc_steps += 1
    h = S[0] - t
    if not integrator.h_first > 0.0:
        integrator.h_first = h
    if not integrator.h_largest >= h:
        integrator.h_largest = h
    integrator.h_previous = h
    if full or S[0] >= t_target:
        S[0] = t_target
        changed(side, CONTINUOUS)


@inner
def integrate_until(program, run, integrator, S, side, L, rows, T):
    """Steps of the continuous state alone until time T [s], whatever happens meanwhile, or a bad status."""
    while S[0] < T and side.status == 0:
        integrate(program, run, integrator, S, side, L, rows, np.inf, T)
