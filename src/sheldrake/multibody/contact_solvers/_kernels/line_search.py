"""Exact line search on the convex cost: a root of its slope, by Newton safeguarded with bisection.

Bracket, first guess and stopping tests are those of Drake's SAP solver, so that iterates agree to round-off.
"""

import numpy as np

from sheldrake.common._kernels.vec import add3, dot3, load3_at, mul_symmetric, scale3
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.contact_law import contact_cost, contact_impulse
from sheldrake.multibody.contact_solvers._kernels.problem import (
    CONTACTS_BEGIN,
    CONTACTS_END,
    DVC,
    ORDER,
    ROW_DVC,
    ROW_LOWER,
    ROW_R,
    ROW_UPPER,
    ROW_VC,
    ROW_VHAT,
    ROWS_BEGIN,
    ROWS_END,
    VC,
)
from sheldrake.multibody.contact_solvers._kernels.scalar_row import row_cost, row_impulse

ALPHA_MAX = np.float64(1.5)
TOLERANCE = np.float64(1e-8)
EVALUATIONS = np.int64(100)
FULL_STEP = np.float64(0.1)
COST_ABSOLUTE = np.float64(1e-30)
COST_RELATIVE = np.float64(1e-15)


@kernel
def magnitude(x):
    """|x| of a number or a dual."""
    if x < 0.0:
        return -x
    return x


@kernel(outline=True)
def constraint_cost(model, problem, contacts, rows, alpha):
    """Sum of all l_i at vc + alpha dvc [J]."""
    total = 0.0
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = contacts.index[place, ORDER]
        vc = add3(load3_at(contacts.state, c, VC), scale3(load3_at(contacts.state, c, DVC), alpha))
        total += contact_cost(model, contacts.law, c, vc)
    law = rows.law
    for place in range(problem.count[ROWS_BEGIN], problem.count[ROWS_END]):
        r = rows.index[place, ORDER]
        vc_r = rows.state[r, ROW_VC] + alpha * rows.state[r, ROW_DVC]
        total += row_cost(law[r, ROW_R], law[r, ROW_VHAT], law[r, ROW_LOWER], law[r, ROW_UPPER], vc_r)
    return total


@kernel(outline=True)
def constraint_slope(model, problem, contacts, rows, alpha):
    """First and second derivative of `constraint_cost` with respect to alpha."""
    slope = 0.0
    curvature = 0.0
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = contacts.index[place, ORDER]
        dvc = load3_at(contacts.state, c, DVC)
        vc = add3(load3_at(contacts.state, c, VC), scale3(dvc, alpha))
        gamma, G = contact_impulse(model, contacts.law, c, vc)
        G_dvc = mul_symmetric((G[0], G[2], G[5], G[1], G[3], G[4]), dvc)
        slope -= dot3(dvc, gamma)
        curvature += dot3(dvc, G_dvc)
    law = rows.law
    for place in range(problem.count[ROWS_BEGIN], problem.count[ROWS_END]):
        r = rows.index[place, ORDER]
        dvc_r = rows.state[r, ROW_DVC]
        vc_r = rows.state[r, ROW_VC] + alpha * dvc_r
        gamma_r, G_r = row_impulse(law[r, ROW_R], law[r, ROW_VHAT], law[r, ROW_LOWER], law[r, ROW_UPPER], vc_r)
        slope -= dvc_r * gamma_r
        curvature += dvc_r * G_r * dvc_r
    return slope, curvature


@kernel(outline=True)
def line_search(model, problem, contacts, rows, slope0, slope_A, curvature_A, momentum_cost, cost0):
    """Step length in (0, 1.5].

    Args:
        slope0: derivative of the whole cost at alpha = 0 [J].
        slope_A: derivative of the momentum cost at alpha = 0 [J].
        curvature_A: dv^T A dv [J].
        momentum_cost: momentum cost at alpha = 0 [J].
        cost0: whole cost at alpha = 0 [J].

    Returns:
        (alpha, found); found is 0 when the root was not bracketed to tolerance within the evaluations allowed.
    """
    high = ALPHA_MAX + 0.0 * slope0
    slope, curvature = constraint_slope(model, problem, contacts, rows, high)
    f_high = slope + slope_A + high * curvature_A
    if f_high <= 0.0:
        return high, 1
    scale = -slope0
    # The cost at alpha = 1.5 decides; it is convex, so its tangent there bounds it from above without evaluating it.
    if scale < COST_ABSOLUTE + COST_RELATIVE * (cost0 + high * f_high):
        cost = constraint_cost(model, problem, contacts, rows, high)
        cost += momentum_cost + high * slope_A + 0.5 * high * high * curvature_A
        if scale < COST_ABSOLUTE + COST_RELATIVE * cost:
            return 1.0 + 0.0 * slope0, 1
    x = scale / (curvature + curvature_A)
    if x > high:
        x = high
    x_tolerance = TOLERANCE * x
    f_high = f_high / scale
    if f_high < TOLERANCE:
        return high, 1
    low = 0.0 * slope0
    step = low - high
    step_before = step
    for _ in range(EVALUATIONS):
        slope, curvature = constraint_slope(model, problem, contacts, rows, x)
        f = (slope + slope_A + x * curvature_A) / scale
        df = (curvature + curvature_A) / scale
        if f < 0.0:
            low = x
        else:
            high = x
        if magnitude(f) < TOLERANCE:
            return x, 1
        slow = 2.0 * magnitude(f) > magnitude(step_before * df)
        step_before = step
        if not slow:
            step = f / df
            new = x - step
            if new < low or new > high:
                slow = True
            else:
                x = new
        if slow:
            step = 0.5 * (low - high)
            x = low - step
        if magnitude(step) < x_tolerance:
            return x, 1
    return x, 0
