"""Newton on the convex cost of an island: as Drake's SAP solver does it, or so that what can rest comes to rest.

The former is of Castro, Permenter, Han 2022, algorithm 2. Convergence is tested before the first iteration, starting at
v0: a body at rest costs no factorisation. Only trees touched by a constraint take part, in the search and in the norms
that stop it.
"""

from sheldrake.common._kernels.generic import has_slopes, in_any, sqrt
from sheldrake.common._kernels.vec import SIX, add_six, dot3, dot_six, load_six, magnitude, neg3, store_six, times_six
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.cost import (
    advance,
    along_direction,
    constraint_cost,
    constraint_slope,
    drop_slopes,
    evaluate,
    evaluate_v,
    full_step,
    keep_slopes,
    momentum_along_direction,
    newton_direction,
    optimality,
    put_iterate,
    put_v0,
    weigh_gradient,
    whole_cost,
)
from sheldrake.multibody.contact_solvers._kernels.delassus import (
    evaluate_impulse,
    evaluate_impulses,
    factorise_impulses,
    few_contacts,
    go_to_impulse,
    no_factor,
    put_velocities,
    start_impulse,
    start_impulses,
    step_of_impulse,
    step_of_impulses,
    touches_once,
)
from sheldrake.multibody.contact_solvers._kernels.factor import CONTACTS, symbolic_factor, trees_touched
from sheldrake.multibody.contact_solvers._kernels.laws import (
    LAGGED,
    closing_speed,
    friction_load,
    glide,
    inverse_soft_norm,
)
from sheldrake.multibody.contact_solvers._kernels.problem import (
    DVC,
    FACTOR_CAPACITY,
    ITERATION_LIMIT,
    LINE_SEARCH_FAILED,
    SOLVED,
    VC,
    add_generalized_impulse,
    contact_velocities,
    contacts_of_island,
    dofs_of_island,
    dofs_of_tree,
    is_tree_with_joints,
    island_of_constraint,
    island_of_tree,
    mul_A,
    multiply_A,
    other_dofs_of_island,
    put_velocity,
    row_velocities,
    rows_of_island,
    sixes_of_island,
    trees_of_island,
    with_drift,
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
FULL_STEP, FULL_STEP_OF_TREE = 0.1, 0.3  # times the slope, at most, at the end of a full step; of one tree with joints
SEARCHED = 1e-2  # times the slope, at most, where a step of the latter that went farther is shortened to
STEPS_OF_NEWTON = 5  # to there; if they do not do, the line is bisected
COST_ABSOLUTE = 1e-30
COST_RELATIVE = 1e-15


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
    n = friction_load(model, contact, contact.gamma)
    stiffness = contact.friction * n * soft
    contact.dual = (wx, wy)
    xx, xy, yy = contact.G_t
    changed = (
        xx + stiffness * (tx - wx) * tx,
        xy + stiffness * (tx * ty - 0.5 * (wx * ty + wy * tx)),
        yy + stiffness * (ty - wy) * ty,
    )
    contact.G_t = changed if n > 0.0 else contact.G_t


@kernel
def may_rub(model, contact):
    """Whether friction can act in this solve: under kLagged only where the contact presses at v0."""
    return model.law != LAGGED or in_any(contact.n0 > 0.0)


@kernel(outline=True)
def drop_duals(model, problem, contacts, tangents):
    """No duals, with which the first step is a secant's; where `tangents` is 1 (in lanes) it stays Newton's."""
    for contact in contacts_of_island(problem, contacts):
        if not may_rub(model, contact):
            continue
        x, y, _ = contact.vc
        newton = contact.G_t
        put_dual(model, contact, 0.0 * x, 0.0 * y)
        contact.G_t = newton if tangents > 0.0 else contact.G_t


@kernel(outline=True)
def update_duals(model, problem, contacts, alpha, tangents):
    """The duals' Newton step that belongs to the last step, of length alpha, of the velocities; back to |w| <= 1.

    Where `tangents` is 1 they have been t so far, which nobody wrote.
    """
    for contact in contacts_of_island(problem, contacts):
        if not may_rub(model, contact):
            continue
        x, y, _ = contact.vc
        dx, dy, _ = contact.dvc
        x -= alpha * dx  # where the step began
        y -= alpha * dy
        soft = inverse_soft_norm(contact, x, y)
        wx, wy = (x * soft, y * soft) if tangents > 0.0 else contact.dual
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
FAR, FAR_OF_TREE = 1e-4, 1e-2  # (gradient over momentum or impulse)^2 from which on v0 tells little of who slides how
STALLED = 0.1  # times the last one: an excess above it got no smaller for round-off, if little is left
STALLED_DECREMENT = 1e-22  # as `DECREMENT`, of steps that gain nothing
CHORDS = 2  # steps with the factor of an earlier one that are worth a new factor; of one tree with joints only one is


@kernel(outline=True)
def newton(model, problem, contacts, rows, factor, fresh):
    """Newton's direction dv and A dv; a status. With a new factor if `fresh` is 1, else with the last one."""
    status = newton_direction(model, problem, contacts, rows, factor, fresh)
    if status == SOLVED:
        multiply_A(model, problem, problem.dv, problem.a_dv)
    return status


@kernel(outline=True)
def search(model, problem, contacts, rows, slope):
    """Step length, and whether one was found, from an iterate whose cost is not known; see `line_search`."""
    slope_A, curvature_A = momentum_along_direction(model, problem)
    momentum, cost = whole_cost(model, problem, contacts, rows)
    return line_search(model, problem, contacts, rows, slope, slope_A, curvature_A, momentum, cost)


@kernel(outline=True)
def shorten(model, problem, contacts, rows, slope, slope_there, size):
    """How much less than a full step, at whose end the iterate is, to go; and whether that was found.

    Until the slope is a hundredth of what it was at the beginning: by Newton's method from where a straight line
    between the slopes at both ends is zero, safeguarded with bisection. Nothing less where slopes are round-off of
    `size` [J].
    """
    if -slope <= COST_RELATIVE * size:
        return 0.0 * slope, 1
    slope_A, curvature_A = momentum_along_direction(model, problem)
    low, high = -1.0 + 0.0 * slope, 0.0 * slope
    x = slope_there / (slope - slope_there)
    for k in range(EVALUATIONS):
        slope_x, curvature = constraint_slope(model, problem, contacts, rows, x)
        slope_x += slope_A + x * curvature_A
        if magnitude(slope_x) <= -SEARCHED * slope or high - low < TOLERANCE:
            return x, 1
        if slope_x < 0.0:
            low = x
        else:
            high = x
        x -= slope_x / (curvature + curvature_A)
        if k >= STEPS_OF_NEWTON or x <= low or x >= high:
            x = 0.5 * (low + high)
    return x, 0


@kernel(outline=True)
def iterate(model, problem, contacts, rows, factor):
    """Drake's Newton iterations, from an iterate whose `optimality` is known; a status.

    The line is searched in every iteration; they stop also when the cost stalls.
    """
    if symbolic_factor(model, problem, contacts, rows, factor) != SOLVED:
        return FACTOR_CAPACITY
    momentum, cost = whole_cost(model, problem, contacts, rows)
    for _ in range(model.max_iterations):
        status = newton(model, problem, contacts, rows, factor, 1)
        if status != SOLVED:
            return status
        contact_velocities(problem, contacts, problem.dv, DVC)
        row_velocities(problem, rows, problem.dv, DVC)
        slope = along_direction(model, problem)
        slope_A, curvature_A = momentum_along_direction(model, problem)
        alpha, found = line_search(model, problem, contacts, rows, slope, slope_A, curvature_A, momentum, cost)
        if found == 0:
            return LINE_SEARCH_FAILED
        advance(model, problem, contacts, rows, alpha)
        problem.iterations += 1
        excess, _, _ = evaluate(model, problem, contacts, rows)
        if excess <= 1.0:
            return SOLVED
        before = cost
        momentum, cost = whole_cost(model, problem, contacts, rows)
        size = 0.5 * (magnitude(before) + magnitude(cost))
        if magnitude(before - cost) < COST_ABSOLUTE + COST_RELATIVE * size and alpha > 0.5:
            return SOLVED
    return ITERATION_LIMIT


# ---- parts of an island
#
# In a heap, after a step or two, most of the gradient is on few bodies: those with contacts that begin to slide, stick
# or part. Newton's next steps, of thousands of bodies, would be for their sake. So between two steps of all, those that
# are far from equilibrium move first, with their neighbours, all others being held: the cost falls, and what is left is
# nearly quadratic (nonlinear elimination: Lanzkron, Rose, Wilkes 1996, "An analysis of approximate nonlinear
# elimination"). A part has the island's order and memory of the factor: what is held is left out. It has places at the
# beginning of the island's, which are put in order again afterwards.

PARTS = 4  # that move, at most, between two steps of all
MANY_TREES = 300  # of an island that has parts; of fewer, steps of all take no longer
FAR_OFF = 0.03  # times the mean of (gradient of a tree)^2, from which on it moves
LARGEST_PART = 0.4  # of the trees
HELD, JOINS = 1, 2  # Block.held


@kernel
def has_parts(model, problem, soft):
    """Whether an island is worth it; one with rows never is."""
    trees = problem.trees_end - problem.trees_begin
    return soft and trees >= MANY_TREES and problem.rows_begin == problem.rows_end and model.sides == 1


@kernel
def gradient_of_tree(model, problem, t):
    """Its square, weighted by the mobilities [J]."""
    tree = model.trees[t]
    if tree.num_dofs == SIX:
        g = load_six(problem.gradient, tree.first_dof)
        return dot_six(times_six(g, load_six(problem.mobility, tree.first_dof)), g)
    square = 0.0
    for k in dofs_of_tree(model, t):
        square += problem.gradient[k] * problem.gradient[k] * problem.mobility[k]
    return square


@kernel
def block_of_tree(factor, t):
    return factor.blocks[factor.place[t]]


@kernel
def may_move(factor, t):
    """Whether there is a tree t that is not held."""
    return t >= 0 and block_of_tree(factor, t).held == 0


@kernel
def contacts_of_tree(factor, t):
    """The numbers of the contacts that touch tree t, as `list_constraints` left them."""
    block = block_of_tree(factor, t)
    for i in range(block.constraints_begin, block.ends[CONTACTS]):
        yield factor.graph[i]


@kernel(outline=True)
def choose_part(model, problem, contacts, factor, residual):
    """Holds all trees but those that are far off and their neighbours; how many these are."""
    far = FAR_OFF * residual / (problem.trees_end - problem.trees_begin)
    for t in trees_of_island(problem):
        block = block_of_tree(factor, t)
        block.held = HELD
        if gradient_of_tree(model, problem, t) > far:
            block.held = 0
    for t in trees_of_island(problem):
        if may_move(factor, t):
            for c in contacts_of_tree(factor, t):
                for u in trees_touched(contacts[c]):
                    if block_of_tree(factor, u).held == HELD:
                        block_of_tree(factor, u).held = JOINS
    count = 0
    for t in trees_of_island(problem):
        block = block_of_tree(factor, t)
        if block.held == JOINS:
            block.held = 0
        if block.held == 0:
            count += 1
    return count


@kernel(outline=True)
def narrow_to_part(model, problem, contacts, factor):
    """The island at hand becomes the trees that are not held and their contacts; dv of the others there is zero."""
    end = problem.trees_begin
    for place in range(problem.trees_begin, problem.trees_end):
        t = problem.trees[place].order
        if may_move(factor, t):
            problem.trees[place].order = problem.trees[end].order
            problem.trees[end].order = t
            end += 1
    problem.trees_end = end
    end = problem.contacts_begin
    for place in range(problem.contacts_begin, problem.contacts_end):
        c = contacts[place].order
        a, b = contacts[c].tree_a, contacts[c].tree_b
        if may_move(factor, a) or may_move(factor, b):
            contacts[place].order = contacts[end].order
            contacts[end].order = c
            end += 1
            for t in (a, b):
                if t >= 0 and not may_move(factor, t):
                    for k in dofs_of_tree(model, t):
                        problem.dv[k] = 0.0
    problem.contacts_end = end


@kernel(outline=True)
def order_island_again(problem, contacts, factor):
    """Trees and contacts of the island in their order, as before `narrow_to_part`; nothing is held."""
    island = problem.trees[problem.trees[problem.trees_begin].order].root
    place = problem.trees_begin
    for t in range(len(problem.trees)):
        if island_of_tree(problem, problem.trees[t]) == island:
            problem.trees[place].order = t
            place += 1
    place = problem.contacts_begin
    for c in range(problem.num_contacts):
        if island_of_constraint(problem, contacts[c]) == island:
            contacts[place].order = c
            place += 1
    for k in range(problem.columns):
        factor.blocks[k].held = 0


@kernel(outline=True)
def take_impulses_off(problem, contacts):
    """j_gamma -= J^T gamma: then `optimality` of a part leaves the right one, also along dofs that are held."""
    for contact in contacts_of_island(problem, contacts):
        add_generalized_impulse(problem.j_gamma, contact, neg3(contact.gamma))


@kernel(outline=True)
def move_part(model, problem, contacts, rows, factor):
    """A Newton step of the trees that are not held; a status, and where that is not SOLVED nothing has moved."""
    status = newton(model, problem, contacts, rows, factor, 1)
    if status != SOLVED:
        return status
    slope = along_direction(model, problem)
    alpha = 1.0 + 0.0 * slope
    take_impulses_off(problem, contacts)
    full_step(model, problem, contacts, rows)
    if not along_direction(model, problem) <= -FULL_STEP * slope:
        advance(model, problem, contacts, rows, -alpha)
        alpha, found = search(model, problem, contacts, rows, slope)
        if found == 0:
            alpha = 0.0 * slope
            status = LINE_SEARCH_FAILED
        advance(model, problem, contacts, rows, alpha)
        take_impulses_off(problem, contacts)
        evaluate(model, problem, contacts, rows)
    update_duals(model, problem, contacts, alpha, 0.0)
    return status


@kernel(outline=True)
def settle_parts(model, problem, contacts, rows, factor):
    """`optimality` after parts of the island, one after the other, have moved towards their equilibrium."""
    trees_end, contacts_end = problem.trees_end, problem.contacts_end
    trees = trees_end - problem.trees_begin
    moved = 0
    residual, excess, momentum, impulse = weigh_gradient(model, problem)
    for _ in range(PARTS):
        if excess <= 1.0 or choose_part(model, problem, contacts, factor, residual) > LARGEST_PART * trees:
            break
        narrow_to_part(model, problem, contacts, factor)
        status = move_part(model, problem, contacts, rows, factor)
        problem.trees_end, problem.contacts_end = trees_end, contacts_end
        moved += 1
        residual, excess, momentum, impulse = weigh_gradient(model, problem)
        if status != SOLVED:
            break
    order_island_again(problem, contacts, factor)
    if moved > 0 and excess <= 1.0:
        return evaluate(model, problem, contacts, rows)
    return excess, momentum, impulse


ENOUGH = 1e-2  # excess of what converges on impulses: what is left is looked at again for v
WORSE = 100.0  # (what a second step with a factor leaves over what the first one left)^2 is not more than this greater
FULL_STEPS = 20  # on impulses; from where they end lines are searched
SHRINKS = 0.25  # times the last excess, at most, or full steps lead nowhere


@kernel(outline=True)
def iterate_on_impulses(
    model, problem, contacts, rows, factor, n, excess, left, start, factorise, step, remaining, end
):
    """Full steps with the impulses of n contacts as unknowns; the excess they leave.

    `left` is the decrement that is round-off [J]. Rows that meet a bound on the way leave an excess. Where one more
    step with the last factor will do, it has that. How steps are taken the kernels say that come last.
    """
    scale = excess / start(model, problem, contacts, factor, n)
    fresh = 1
    goes_on = 1.0  # in lanes, worlds wait for each other
    for k in range(min(FULL_STEPS, model.max_iterations) if n > 0 else 0):
        if fresh == 1:
            factorise(problem, contacts, factor, n)
        gain = step(problem, contacts, factor, n, goes_on)
        problem.iterations += 1
        before = excess
        there = scale * remaining(model, problem, contacts, factor, n)
        excess = there if goes_on > 0.0 else excess
        goes_on = 0.0 if excess <= ENOUGH else goes_on
        if k > 0:
            least = left if excess < STALLED * before else left * STALLED_DECREMENT / DECREMENT
            goes_on = 0.0 if excess > SHRINKS * before else 0.0 if gain <= least else goes_on
        if not in_any(goes_on > 0.0):
            break
        if k > 0:
            fresh = 1 - will_do_once_more(goes_on, excess, before)
    end(model, problem, contacts, rows, factor, n)
    excess, _, _ = evaluate(model, problem, contacts, rows)
    return excess


@kernel
def go_to_impulses(model, problem, contacts, rows, factor, n):
    """The iterate whose velocities are those of the impulses."""
    put_velocities(model, problem, contacts, factor, n)
    put_iterate(model, problem, contacts, rows)


@kernel
def iterate_on_few(model, problem, contacts, rows, factor, n, excess, left):
    """`iterate_on_impulses`: of a free body's only contact, or of few contacts of any tree."""
    if n == 1 and touches_once(problem, contacts):
        return iterate_on_impulses(
            model, problem, contacts, rows, factor, n, excess, left,
            start_impulse, no_factor, step_of_impulse, evaluate_impulse, go_to_impulse,
        )  # fmt: skip
    return iterate_on_impulses(
        model, problem, contacts, rows, factor, n, excess, left,
        start_impulses, factorise_impulses, step_of_impulses, evaluate_impulses, go_to_impulses,
    )  # fmt: skip


@kernel
def will_do_once_more(goes_on, excess, before):
    """Whether one more step with the same factor will do, 1 or 0: for all worlds that go on, or for none."""
    good = 1.0 if WORSE * excess / before * excess <= ENOUGH else 0.0
    good = good if goes_on > 0.0 else 0.0
    some = 1.0 if in_any(good > 0.0) else 0.0
    good = good if goes_on > 0.0 else some
    return 1 if good > 0.0 else 0


@kernel
def will_do(model, problem, excess, momentum, impulse):
    """Whether an iterate is as good as what rests needs; or, of one tree with joints, as what moves does.

    The slower it moves, the nearer the latter comes to the former. For free bodies it would save little.
    """
    if excess <= 1.0 or problem.along_branches == 0:
        return excess <= 1.0
    relative, moving = model.relative_tolerance, model.moving_tolerance
    return excess * relative * relative * max(momentum, impulse) <= moving * moving * momentum


@kernel(outline=True)
def iterate_to_rest(model, problem, contacts, rows, factor, excess, size, soft):
    """Iterations until what can rest does, from an iterate whose `optimality` is known; a status.

    The full step is taken where it leaves a part of the slope; else the line is searched, less thoroughly of one tree
    with joints, whose next step costs little more. What a step can still gain being round-off is the other reason to
    stop: gradient^T H^-1 gradient against momentum and impulse, less strictly so where the gradient has ceased to
    shrink. Where a step was so good that `CHORDS` more like it would do, the next one has its factor: a new one costs
    twice as much as the rest, of one tree with joints as much. `soft` tells whether friction has duals.
    """
    relative = excess * model.relative_tolerance * model.relative_tolerance
    tangents = 1.0
    if soft:
        far = FAR_OF_TREE if is_tree_with_joints(model, problem) else FAR
        tangents = 0.0 if relative > far else 1.0
        if in_any(tangents < 1.0):
            drop_duals(model, problem, contacts, tangents)
    n = few_contacts(model, problem, contacts, rows, factor, relative)
    if n >= 0:
        excess = iterate_on_few(model, problem, contacts, rows, factor, n, excess, DECREMENT * size)
        if excess <= 1.0:
            return SOLVED
        tangents = 1.0
    if symbolic_factor(model, problem, contacts, rows, factor) != SOLVED:
        return FACTOR_CAPACITY
    most = FULL_STEP if problem.along_branches == 0 else FULL_STEP_OF_TREE
    fresh = 1
    parts = has_parts(model, problem, soft)
    for k in range(model.max_iterations):
        status = newton(model, problem, contacts, rows, factor, fresh)
        if status != SOLVED:
            return status
        slope = along_direction(model, problem)
        alpha = 1.0 + 0.0 * slope
        before = excess
        problem.iterations += 1
        excess, momentum, impulse = full_step(model, problem, contacts, rows)
        slope_there = along_direction(model, problem)
        if not (will_do(model, problem, excess, momentum, impulse) or slope_there <= -most * slope):
            if problem.along_branches == 0:
                advance(model, problem, contacts, rows, -alpha)
                alpha, found = search(model, problem, contacts, rows, slope)
                change = alpha
            else:
                change, found = shorten(model, problem, contacts, rows, slope, slope_there, momentum + impulse)
                alpha += change
            if found == 0:
                return LINE_SEARCH_FAILED
            advance(model, problem, contacts, rows, change)
            excess, momentum, impulse = evaluate(model, problem, contacts, rows)
        left = DECREMENT if excess < STALLED * before else STALLED_DECREMENT
        if will_do(model, problem, excess, momentum, impulse) or -slope <= left * (momentum + impulse):
            return SOLVED
        ratio = excess / before
        chords = ratio**CHORDS if problem.along_branches == 0 else ratio
        fresh = 0 if will_do(model, problem, excess * chords, momentum, impulse) else 1
        if fresh == 1 and soft:
            update_duals(model, problem, contacts, alpha, tangents)
            tangents = 0.0
        if fresh == 1 and parts and k > 0:
            excess, momentum, impulse = settle_parts(model, problem, contacts, rows, factor)
            if will_do(model, problem, excess, momentum, impulse):
                return SOLVED
    return ITERATION_LIMIT


@kernel(outline=True)
def differentiate(model, problem, contacts, rows, factor):
    """Gives the solution its derivatives, however it was found; a status. Its value stays.

    They are those of the implicit function theorem: of gradient(v, data) = 0, one Newton step on what v lacks.
    """
    if symbolic_factor(model, problem, contacts, rows, factor) != SOLVED:
        return FACTOR_CAPACITY
    drop_slopes(model, problem)
    evaluate_v(model, problem, contacts, rows)
    keep_slopes(model, problem)
    status = newton(model, problem, contacts, rows, factor, 1)
    if status == SOLVED:
        full_step(model, problem, contacts, rows)
    return status


@kernel
def with_slopes(model, problem, contacts, rows, factor, excess):
    """`differentiate` where numbers have derivatives, as the `excess` of the solution tells; a status."""
    if has_slopes(excess):
        return differentiate(model, problem, contacts, rows, factor)
    return SOLVED


# ---- the slip of the end of the step
#
# kSap until it rests: what slides is expected to slide at the end of the step, too.
#
# The cone of kSap lets what slides at vt glide away from the surface at mu vt, until the gap is (dt + tau) mu vt and
# the contact is lost: a box that slides would hop. So mu times the slip at the end of the step is taken off the
# velocity that closes the penetration (de Saxce and Feng 1998, "The bipotential method"). A guess of the slip makes
# the first problem; each solution makes the next, about mu^2 times as far from its own slip. What hardly slides keeps
# its cone.

SLIPS = 5  # times that a problem of kSap is solved for the slip of its solution
SAME_SLIP = 0.1  # change of friction times slip, over the stiction tolerance, that is none


@kernel
def count_contacts(problem, contacts):
    """How many contacts each tree has."""
    for t in range(len(problem.trees)):
        problem.trees[t].num_contacts = 0
    for c in range(problem.num_contacts):
        for t in (contacts[c].tree_a, contacts[c].tree_b):
            if t >= 0:
                problem.trees[t].num_contacts += 1


@kernel
def contacts_beside(problem, contact):
    """How many contacts share what stops the trees of a contact."""
    n = 1
    for t in (contact.tree_a, contact.tree_b):
        if t >= 0 and problem.trees[t].num_contacts > n:
            n = problem.trees[t].num_contacts
    return n


@kernel(outline=True)
def predict_slip(model, problem, contacts):
    """Takes the guessed slip off all contacts: that of v*, less friction of impulses that are elastic.

    Or of what stops the contact if that is less; of its part of that if it does not touch.
    """
    count_contacts(problem, contacts)
    for k in range(len(problem.dv)):
        problem.dv[k] = problem.v_star[k]
    for c in range(problem.num_contacts):
        contact = contacts[c]
        vx, vy, _ = contact.vc
        slip2 = vx * vx + vy * vy
        if slip2 > 0.0:
            put_velocity(contact, problem.v_star, DVC, True)
            n = model.dt * contact.stiffness * contact.depth
            stops = (contact.vhat_n - contact.dvc[2]) / (contact.R_n + contact.delassus)
            if n <= 0.0:
                n = stops / contacts_beside(problem, contact)
            if stops < n:
                n = stops
            if n < 0.0:
                n = 0.0 * n
            f = n * contact.friction / sqrt(slip2)
            for a in range(contact.width):
                k = contact.dofs[a]
                problem.dv[k] -= f * problem.mobility[k] * (contact.J[0, a] * vx + contact.J[1, a] * vy)
    for c in range(problem.num_contacts):
        contact = contacts[c]
        put_velocity(contact, problem.dv, DVC, True)
        contact.vhat_n -= glide(model, contact, contact.vc, contact.dvc)


@kernel(outline=True)
def update_slip(model, problem, contacts):
    """Takes the slip of the iterate off the island's contacts instead; by how much one changes at most [m/s]."""
    most = 0.0
    for contact in contacts_of_island(problem, contacts):
        put_velocity(contact, problem.v0, DVC, True)
        v0, v1 = contact.dvc, contact.vc
        vhat = closing_speed(contact, model.dt) - glide(model, contact, v0, v1)
        change = magnitude(vhat - contact.vhat_n)
        if change > most:
            most = change
        contact.vhat_n = vhat
    return most


@kernel
def iterate_on_slip(model, problem, contacts, rows, factor):
    """Solves kSap's problem anew with the slip of its solution, until that is the slip it had; a status."""
    for _ in range(SLIPS):
        if update_slip(model, problem, contacts) <= SAME_SLIP * model.stiction:
            return SOLVED
        excess, momentum, impulse = evaluate(model, problem, contacts, rows)
        if not excess <= 1.0:
            status = iterate_to_rest(model, problem, contacts, rows, factor, excess, momentum + impulse, False)
            if status != SOLVED:
                return status
        status = with_slopes(model, problem, contacts, rows, factor, excess)
        if status != SOLVED:
            return status
    return SOLVED


# ---- an island

AT_REST = 10.0  # times the stiction tolerance: slower contacts may be at rest
STUCK = 0.5  # times the slip speed: the regularisation speed of what sticks
TIGHT = 0.03  # times Drake's regularisation speed: the least one, for the sake of the condition of H
NEARLY_STILL = 1e-8  # (momentum over impulse of a step)^2 below which rest is tried


@kernel
def start(model, problem, rows):
    """The first iterate v0 with its momenta and the velocities of the rows; completes p* = A v*.

    The velocities of the contacts `prepare` has made.
    """
    put_v0(model, problem)
    mul_A(model, problem, problem.v, problem.p)
    row_velocities(problem, rows, problem.v, VC)
    for k in sixes_of_island(model, problem):
        store_six(problem.p_star, k, add_six(load_six(problem.p_star, k), load_six(problem.p, k)))
    for k in other_dofs_of_island(model, problem):
        problem.p_star[k] += problem.p[k]


@kernel(outline=True)
def try_rest(model, problem, contacts, rows):
    """Replaces an accepted v0 by zero where zero is as good, so that what is at rest does not creep at tolerance."""
    for k in dofs_of_island(model, problem):
        problem.v[k] = problem.v0[k] - problem.v0[k]
        problem.p[k] = problem.v[k]
    zero = (0.0, 0.0, 0.0)
    for contact in contacts_of_island(problem, contacts):
        contact.vc = with_drift(contact, zero, True)
    for row in rows_of_island(problem, rows):
        row.vc = 0.0
    excess, _, _ = evaluate(model, problem, contacts, rows)
    if not excess <= 1.0:
        put_v0(model, problem)
        evaluate_v(model, problem, contacts, rows)


@kernel
def reduce_regularisation(model, problem, contacts):
    """Regularises friction less in an island whose contacts are nearly still.

    With Drake's regularisation, what friction holds creeps for ever, at a speed that grows with the load. Here what
    slips slowly gets less of it, step by step: while friction bears less than 89 % of what it can, each step's slip
    is smaller than that of the step before. What moves has Drake's: a sharper law takes more iterations.
    """
    fast = AT_REST * model.stiction
    fastest2 = 0.0
    for contact in contacts_of_island(problem, contacts):
        vc0 = contact.vc
        fastest2 = max(fastest2, dot3(vc0, vc0))
    for contact in contacts_of_island(problem, contacts):
        eps = contact.eps
        contact.eps = eps if fastest2 > fast * fast else reduced(contact, eps)


@kernel
def reduced(contact, eps):
    """The regularisation speed of a contact that is nearly still, of one that may be fast [m/s]."""
    x, y, _ = contact.vc
    stuck2 = STUCK * STUCK * (x * x + y * y)
    return TIGHT * eps if stuck2 < TIGHT * TIGHT * eps * eps else sqrt(stuck2) if stuck2 < eps * eps else eps


@kernel
def reduce_to_rest(model, problem, contacts, rows, factor, soft):
    """(status, whether it took iterations): from a first iterate to the minimum, or to rest where rest is as good.

    `soft` as for `iterate_to_rest`.
    """
    excess, momentum, impulse = optimality(model, problem, contacts, rows, False)
    moves = not excess <= 1.0  # so is NaN
    status = SOLVED
    if moves:
        status = iterate_to_rest(model, problem, contacts, rows, factor, excess, momentum + impulse, soft)
    elif momentum > 0.0 and momentum <= NEARLY_STILL * impulse:
        try_rest(model, problem, contacts, rows)
    if status == SOLVED:
        status = with_slopes(model, problem, contacts, rows, factor, excess)
    return status, moves


# ---- how an island is solved, from its first iterate v0 on; each gives a status


@kernel
def as_drake(model, problem, contacts, rows, factor):
    """Drake's iterates."""
    start(model, problem, rows)
    excess, _, _ = optimality(model, problem, contacts, rows, False)
    status = SOLVED
    if not excess <= 1.0:  # so is NaN
        status = iterate(model, problem, contacts, rows, factor)
    if status == SOLVED:
        status = with_slopes(model, problem, contacts, rows, factor, excess)
    return status


@kernel
def to_rest(model, problem, contacts, rows, factor):
    """Until what can rest does, friction being soft."""
    start(model, problem, rows)
    reduce_regularisation(model, problem, contacts)
    status, _ = reduce_to_rest(model, problem, contacts, rows, factor, True)
    return status


@kernel
def to_rest_on_cones(model, problem, contacts, rows, factor):
    """Until what can rest does, and slides at the speed that the cones were made for."""
    start(model, problem, rows)
    status, moves = reduce_to_rest(model, problem, contacts, rows, factor, False)
    if status == SOLVED and moves:
        status = iterate_on_slip(model, problem, contacts, rows, factor)
    return status
