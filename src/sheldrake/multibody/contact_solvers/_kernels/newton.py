"""Newton on the convex cost of an island: as Drake's SAP solver does it, or so that what can rest comes to rest.

The former is of Castro, Permenter, Han 2022, algorithm 1.
"""

import numpy as np

from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.elimination import lay_out
from sheldrake.multibody.contact_solvers._kernels.friction_dual import follow_duals, guess_duals
from sheldrake.multibody.contact_solvers._kernels.gradient import evaluate, multiply_A
from sheldrake.multibody.contact_solvers._kernels.hessian import newton_direction, renew_factor
from sheldrake.multibody.contact_solvers._kernels.line_search import (
    COST_ABSOLUTE,
    COST_RELATIVE,
    FULL_STEP,
    constraint_cost,
    line_search,
    magnitude,
)
from sheldrake.multibody.contact_solvers._kernels.problem import (
    A_DV,
    APPROXIMATION,
    DV,
    DVC,
    FIRST_DOF,
    GRADIENT,
    ITERATIONS,
    MAX_ITERATIONS,
    NUM_DOFS,
    ORDER,
    P_STAR,
    POLISH,
    RELATIVE_TOLERANCE,
    ROW_DVC,
    ROW_VC,
    ROWS_BEGIN,
    ROWS_END,
    SAP,
    TREE_ORDER,
    TREES_BEGIN,
    TREES_END,
    V_STAR,
    P,
    V,
)
from sheldrake.multibody.contact_solvers._kernels.status import (
    FACTOR_CAPACITY,
    HESSIAN_NOT_POSITIVE,
    ITERATION_LIMIT,
    LINE_SEARCH_FAILED,
    SOLVED,
)
from sheldrake.multibody.contact_solvers._kernels.velocity import contact_velocities, move, row_velocities

DECREMENT = np.float64(1e-28)  # (relative error in the norm of H)^2 that is round-off
FAR = np.float64(1e-4)  # (gradient over momentum or impulse)^2 from which on v0 tells little of who slides how
STALLED = np.float64(0.1)  # times the last one: an excess above it got no smaller for round-off, if little is left
STALLED_DECREMENT = np.float64(1e-22)  # as `DECREMENT`, of steps that gain nothing
CHORDS = 2  # steps with the factor of an earlier one that are worth a new factor


@kernel
def momentum_cost(model, problem):
    """1/2 (v - v*)^T A (v - v*) [J]."""
    x = problem.x
    s = 0.0
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        for k in range(first, first + model.tree[t, NUM_DOFS]):
            s += (x[V, k] - x[V_STAR, k]) * (x[P, k] - x[P_STAR, k])
    return 0.5 * s


@kernel
def along_direction(model, problem):
    """(slope of the cost, slope of the momentum cost, dv^T A dv) at the iterate along dv [J]."""
    x = problem.x
    slope = 0.0
    slope_A = 0.0
    curvature_A = 0.0
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        for k in range(first, first + model.tree[t, NUM_DOFS]):
            slope += x[DV, k] * x[GRADIENT, k]
            slope_A += x[DV, k] * (x[P, k] - x[P_STAR, k])
            curvature_A += x[DV, k] * x[A_DV, k]
    return slope, slope_A, curvature_A


@kernel
def advance(model, problem, contacts, rows, alpha):
    """v += alpha dv, and with it momenta and constraint velocities."""
    move(model, problem, contacts, alpha)
    for place in range(problem.count[ROWS_BEGIN], problem.count[ROWS_END]):
        r = rows.index[place, ORDER]
        rows.state[r, ROW_VC] += alpha * rows.state[r, ROW_DVC]


@kernel
def direction(model, problem, contacts, rows, factor):
    """The factor's Newton direction in x[DV], A dv, and the change of the constraint velocities along it."""
    newton_direction(model, problem, factor)
    multiply_A(model, problem, DV, A_DV)
    contact_velocities(problem, contacts, DV, DVC)
    row_velocities(problem, rows, DV, ROW_DVC)


@kernel(outline=True)
def newton(model, problem, contacts, rows, factor, fresh):
    """`direction`, with a new factor if `fresh` is 1, else with the last one; a status."""
    if fresh == 1:
        if renew_factor(model, problem, contacts, rows, factor) != 0:
            return HESSIAN_NOT_POSITIVE
    direction(model, problem, contacts, rows, factor)
    return SOLVED


@kernel
def whole_cost(model, problem, contacts, rows):
    """(momentum cost, cost of momentum and constraints) at the iterate [J]."""
    momentum = momentum_cost(model, problem)
    return momentum, momentum + constraint_cost(model, problem, contacts, rows, 0.0)


@kernel
def slope_here(model, problem):
    """Slope of the cost along the last direction, at the iterate where the gradient is now [J]."""
    x = problem.x
    slope = 0.0
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        for k in range(first, first + model.tree[t, NUM_DOFS]):
            slope += x[DV, k] * x[GRADIENT, k]
    return slope


@kernel(outline=True)
def search(model, problem, contacts, rows, slope, slope_A, curvature_A):
    """(step length, whether one was found, whole cost at the iterate [J])."""
    momentum, cost = whole_cost(model, problem, contacts, rows)
    alpha, found = line_search(model, problem, contacts, rows, slope, slope_A, curvature_A, momentum, cost)
    return alpha, found, cost


@kernel(outline=True)
def iterate(model, problem, contacts, rows, factor):
    """Drake's Newton iterations, from an iterate that `judge` has judged; a status.

    The line is searched in every iteration; they stop also when the cost stalls.
    """
    if lay_out(model, problem, contacts, rows, factor) != 0:
        return FACTOR_CAPACITY
    for _ in range(model.setting[MAX_ITERATIONS]):
        status = newton(model, problem, contacts, rows, factor, 1)
        if status != SOLVED:
            return status
        slope, slope_A, curvature_A = along_direction(model, problem)
        alpha, found, before = search(model, problem, contacts, rows, slope, slope_A, curvature_A)
        if found == 0:
            return LINE_SEARCH_FAILED
        advance(model, problem, contacts, rows, alpha)
        problem.count[ITERATIONS] += 1
        excess, _, _ = evaluate(model, problem, contacts, rows)
        if excess <= 1.0:
            return SOLVED
        _, cost = whole_cost(model, problem, contacts, rows)
        size = 0.5 * (magnitude(before) + magnitude(cost))
        if magnitude(before - cost) < COST_ABSOLUTE + COST_RELATIVE * size and alpha > 0.5:
            return SOLVED
    return ITERATION_LIMIT


@kernel(outline=True)
def iterate_to_rest(model, problem, contacts, rows, factor, excess):
    """Iterations of a step that is to settle, from an iterate that `judge` has judged; a status.

    The full step is taken where it leaves a tenth of the slope, else the line is searched. What a step can still gain
    being round-off is the other reason to stop: gradient^T H^-1 gradient against momentum and impulse, less strictly so
    where the gradient has ceased to shrink. Where a step was so good that `CHORDS` more like it would do, the next one
    has its factor: a new one costs twice as much as the rest.
    """
    if lay_out(model, problem, contacts, rows, factor) != 0:
        return FACTOR_CAPACITY
    soft = model.setting[APPROXIMATION] != SAP
    if soft:
        relative = excess * model.option[RELATIVE_TOLERANCE] * model.option[RELATIVE_TOLERANCE]
        guess_duals(model, problem, contacts, 0.0 if relative > FAR else 1.0)
    fresh = np.int64(1)
    for _ in range(model.setting[MAX_ITERATIONS]):
        status = newton(model, problem, contacts, rows, factor, fresh)
        if status != SOLVED:
            return status
        slope, slope_A, curvature_A = along_direction(model, problem)
        alpha = 1.0 + 0.0 * slope
        before = excess
        problem.count[ITERATIONS] += 1
        advance(model, problem, contacts, rows, alpha)
        excess, momentum, impulse = evaluate(model, problem, contacts, rows)
        if not (excess <= 1.0 or slope_here(model, problem) <= -FULL_STEP * slope):
            advance(model, problem, contacts, rows, -alpha)
            alpha, found, _ = search(model, problem, contacts, rows, slope, slope_A, curvature_A)
            if found == 0:
                return LINE_SEARCH_FAILED
            advance(model, problem, contacts, rows, alpha)
            excess, momentum, impulse = evaluate(model, problem, contacts, rows)
        left = DECREMENT if excess < STALLED * before else STALLED_DECREMENT
        if excess <= 1.0 or -slope <= left * (momentum + impulse):
            return SOLVED
        ratio = excess / before
        fresh = np.int64(0 if excess * ratio**CHORDS <= 1.0 else 1)
        if fresh == 1 and soft:
            follow_duals(model, problem, contacts, alpha)
    return ITERATION_LIMIT


@kernel(outline=True)
def polish(model, problem, contacts, rows, factor):
    """Full Newton steps at the solution: they carry the derivatives of duals; values move within tolerance."""
    if lay_out(model, problem, contacts, rows, factor) != 0:
        return FACTOR_CAPACITY
    for _ in range(model.setting[POLISH]):
        status = newton(model, problem, contacts, rows, factor, 1)
        if status != SOLVED:
            return status
        advance(model, problem, contacts, rows, 1.0)
        evaluate(model, problem, contacts, rows)
    return SOLVED
