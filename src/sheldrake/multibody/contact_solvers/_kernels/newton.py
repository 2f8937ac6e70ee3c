"""Newton on the convex cost of an island: as Drake's SAP solver does it, or so that what can rest comes to rest.

The former is of Castro, Permenter, Han 2022, algorithm 2.
"""

from sheldrake.common._kernels.generic import has_slopes, sqrt, value_of
from sheldrake.common._kernels.vec import add3, dot3, mul_symmetric, scale3
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.elimination import lay_out
from sheldrake.multibody.contact_solvers._kernels.gradient import (
    contact_velocities,
    evaluate,
    magnitude,
    move,
    multiply_A,
    row_velocities,
)
from sheldrake.multibody.contact_solvers._kernels.hessian import newton_direction, renew_factor
from sheldrake.multibody.contact_solvers._kernels.laws import (
    contact_cost,
    contact_impulse,
    inverse_soft_norm,
    row_cost,
    row_impulse,
)
from sheldrake.multibody.contact_solvers._kernels.problem import (
    DVC,
    LAGGED,
    SAP,
    VC,
    contacts_of_island,
    dofs_of_island,
    rows_of_island,
)
from sheldrake.multibody.contact_solvers._kernels.status import (
    FACTOR_CAPACITY,
    HESSIAN_NOT_POSITIVE,
    ITERATION_LIMIT,
    LINE_SEARCH_FAILED,
    SOLVED,
)

# ---- line search
#
# Exact line search on the convex cost: a root of its slope, by Newton safeguarded with bisection.
#
# The derivatives are those of Castro, Permenter, Han 2022, section IV-C. Bracket, first guess and stopping tests are
# Drake's, so that iterates agree to round-off.

ALPHA_MAX = 1.5
TOLERANCE = 1e-8
EVALUATIONS = 100
FULL_STEP = 0.1
COST_ABSOLUTE = 1e-30
COST_RELATIVE = 1e-15


@kernel(outline=True)
def constraint_cost(model, problem, contacts, rows, alpha):
    """Sum of all l_i at vc + alpha dvc [J]."""
    total = 0.0
    for contact in contacts_of_island(problem, contacts):
        vc = add3(contact.vc, scale3(contact.dvc, alpha))
        total += contact_cost(model, contact, vc)
    for row in rows_of_island(problem, rows):
        vc_r = row.vc + alpha * row.dvc
        total += row_cost(row, vc_r)
    return total


@kernel(outline=True)
def constraint_slope(model, problem, contacts, rows, alpha):
    """First and second derivative of `constraint_cost` with respect to alpha."""
    slope = 0.0
    curvature = 0.0
    for contact in contacts_of_island(problem, contacts):
        dvc = contact.dvc
        vc = add3(contact.vc, scale3(dvc, alpha))
        gamma, G = contact_impulse(model, contact, vc)
        G_dvc = mul_symmetric((G[0], G[2], G[5], G[1], G[3], G[4]), dvc)
        slope -= dot3(dvc, gamma)
        curvature += dot3(dvc, G_dvc)
    for row in rows_of_island(problem, rows):
        dvc_r = row.dvc
        vc_r = row.vc + alpha * dvc_r
        gamma_r, G_r = row_impulse(row, vc_r)
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


# ---- a dual of friction
#
# Friction of a contact that slides as a primal-dual Newton method sees it, for faster convergence.
#
# The cost of regularised friction, mu n0 (sqrt(|v|^2 + eps^2) - eps) of the slip v, is a soft norm: where |v| >> eps
# it has no curvature along v, and Newton's steps go far beyond the point where the contact sticks. As Chan, Golub and
# Mulet (1999) do for total variation, its gradient is written mu n0 w with w s = v, s = sqrt(|v|^2 + eps^2), and this
# equation is linearised instead: w is an iterate of its own, |w| <= 1. The tangential block of G becomes
#
# G_t = mu n0 / s (I - (w t^T + t w^T) / 2), t = v / s,
#
# which is Newton's where w = t, and positive semidefinite. Gradient and solution are the same. With kSimilar the
# normal impulse n of the iterate stands for n0, and what n does to friction is left as it is; kSap has another law.


@kernel
def put_dual(model, contact, wx, wy):
    """Takes w for the contact's dual; the G of the law at the present slip becomes that with w."""
    x, y, _ = contact.vc
    soft = inverse_soft_norm(contact, x, y)
    tx, ty = x * soft, y * soft
    n = contact.n0 if model.approximation == LAGGED else contact.gamma[2]
    stiffness = contact.friction * n * soft
    contact.dual = (wx, wy)
    xx, xy, yy = contact.G_t
    contact.G_t = (
        xx + stiffness * (tx - wx) * tx,
        xy + stiffness * (tx * ty - 0.5 * (wx * ty + wy * tx)),
        yy + stiffness * (ty - wy) * ty,
    )


@kernel(outline=True)
def guess_duals(model, problem, contacts, share):
    """First duals: this share of those with which the first step is Newton's; with none of them it is a secant's."""
    for contact in contacts_of_island(problem, contacts):
        x, y, _ = contact.vc
        soft = share * inverse_soft_norm(contact, x, y)
        put_dual(model, contact, x * soft, y * soft)


@kernel(outline=True)
def follow_duals(model, problem, contacts, alpha):
    """The duals' Newton step that belongs to the last step, of length alpha, of the velocities; back to |w| <= 1."""
    for contact in contacts_of_island(problem, contacts):
        x, y, _ = contact.vc
        dx, dy, _ = contact.dvc
        x -= alpha * dx  # where the step began
        y -= alpha * dy
        wx, wy = contact.dual
        soft = inverse_soft_norm(contact, x, y)
        along = (x * dx + y * dy) * soft
        wx += alpha * (soft * (x + dx - wx * along) - wx)
        wy += alpha * (soft * (y + dy - wy * along) - wy)
        w2 = wx * wx + wy * wy
        if w2 > 1.0:
            scale = 1.0 / sqrt(w2)
            wx *= scale
            wy *= scale
        put_dual(model, contact, wx, wy)


# ---- iterations

DECREMENT = 1e-28  # (relative error in the norm of H)^2 that is round-off
FAR = 1e-4  # (gradient over momentum or impulse)^2 from which on v0 tells little of who slides how
STALLED = 0.1  # times the last one: an excess above it got no smaller for round-off, if little is left
STALLED_DECREMENT = 1e-22  # as `DECREMENT`, of steps that gain nothing
CHORDS = 2  # steps with the factor of an earlier one that are worth a new factor


@kernel
def whole_cost(model, problem, contacts, rows):
    """(cost of momentum 1/2 (v - v*)^T A (v - v*), that and the cost of constraints) at the iterate [J]."""
    s = 0.0
    for k in dofs_of_island(model, problem):
        s += (problem.v[k] - problem.v_star[k]) * (problem.p[k] - problem.p_star[k])
    momentum = 0.5 * s
    return momentum, momentum + constraint_cost(model, problem, contacts, rows, 0.0)


@kernel
def along_direction(model, problem):
    """(slope of the cost, slope of the momentum cost, dv^T A dv) at the iterate along dv [J]."""
    slope = 0.0
    slope_A = 0.0
    curvature_A = 0.0
    for k in dofs_of_island(model, problem):
        slope += problem.dv[k] * problem.gradient[k]
        slope_A += problem.dv[k] * (problem.p[k] - problem.p_star[k])
        curvature_A += problem.dv[k] * problem.a_dv[k]
    return slope, slope_A, curvature_A


@kernel
def advance(model, problem, contacts, rows, alpha):
    """v += alpha dv, and with it momenta and constraint velocities."""
    move(model, problem, contacts, alpha)
    for row in rows_of_island(problem, rows):
        row.vc += alpha * row.dvc


@kernel(outline=True)
def newton(model, problem, contacts, rows, factor, fresh):
    """Newton's direction dv, A dv, and the change of the constraint velocities along it; a status.

    With a new factor if `fresh` is 1, else with the last one.
    """
    if fresh == 1 and renew_factor(model, problem, contacts, rows, factor) != SOLVED:
        return HESSIAN_NOT_POSITIVE
    newton_direction(model, problem, factor)
    multiply_A(model, problem, problem.dv, problem.a_dv)
    contact_velocities(problem, contacts, problem.dv, DVC)
    row_velocities(problem, rows, problem.dv, DVC)
    return SOLVED


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
    if lay_out(model, problem, contacts, rows, factor) != SOLVED:
        return FACTOR_CAPACITY
    for _ in range(model.max_iterations):
        status = newton(model, problem, contacts, rows, factor, 1)
        if status != SOLVED:
            return status
        slope, slope_A, curvature_A = along_direction(model, problem)
        alpha, found, before = search(model, problem, contacts, rows, slope, slope_A, curvature_A)
        if found == 0:
            return LINE_SEARCH_FAILED
        advance(model, problem, contacts, rows, alpha)
        problem.iterations += 1
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
    if lay_out(model, problem, contacts, rows, factor) != SOLVED:
        return FACTOR_CAPACITY
    soft = model.approximation != SAP
    if soft:
        relative = excess * model.relative_tolerance * model.relative_tolerance
        guess_duals(model, problem, contacts, 0.0 if relative > FAR else 1.0)
    fresh = 1
    for _ in range(model.max_iterations):
        status = newton(model, problem, contacts, rows, factor, fresh)
        if status != SOLVED:
            return status
        slope, slope_A, curvature_A = along_direction(model, problem)
        alpha = 1.0 + 0.0 * slope
        before = excess
        problem.iterations += 1
        advance(model, problem, contacts, rows, alpha)
        excess, momentum, impulse = evaluate(model, problem, contacts, rows)
        slope_there, _, _ = along_direction(model, problem)
        if not (excess <= 1.0 or slope_there <= -FULL_STEP * slope):
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
        fresh = 0 if excess * ratio**CHORDS <= 1.0 else 1
        if fresh == 1 and soft:
            follow_duals(model, problem, contacts, alpha)
    return ITERATION_LIMIT


@kernel(outline=True)
def differentiate(model, problem, contacts, rows, factor):
    """Gives the solution its derivatives, however it was found; a status. Its value stays.

    They are those of the implicit function theorem: of gradient(v, data) = 0, one Newton step on what v lacks.
    """
    if lay_out(model, problem, contacts, rows, factor) != SOLVED:
        return FACTOR_CAPACITY
    for k in dofs_of_island(model, problem):
        problem.v[k] = value_of(problem.v[k])
    multiply_A(model, problem, problem.v, problem.p)
    contact_velocities(problem, contacts, problem.v, VC)
    row_velocities(problem, rows, problem.v, VC)
    evaluate(model, problem, contacts, rows)
    for k in dofs_of_island(model, problem):
        problem.gradient[k] -= value_of(problem.gradient[k])
    status = newton(model, problem, contacts, rows, factor, 1)
    if status == SOLVED:
        advance(model, problem, contacts, rows, 1.0)
        evaluate(model, problem, contacts, rows)
    return status


@kernel
def with_slopes(model, problem, contacts, rows, factor, excess):
    """`differentiate` where numbers have derivatives, as the `excess` of the solution tells; a status."""
    if has_slopes(excess):
        return differentiate(model, problem, contacts, rows, factor)
    return SOLVED
