"""Friction of a contact that slides as a primal-dual Newton method sees it, for faster convergence.

The cost of regularised friction, mu n0 (sqrt(|v|^2 + eps^2) - eps) of the slip v, is a soft norm: where |v| >> eps it
has no curvature along v, and Newton's steps go far beyond the point where the contact sticks. As Chan, Golub and Mulet
(1999) do for total variation, its gradient is written mu n0 w with w s = v, s = sqrt(|v|^2 + eps^2), and this equation
is linearised instead: w is an iterate of its own, |w| <= 1. The tangential block of G becomes

    G_t = mu n0 / s (I - (w t^T + t w^T) / 2),   t = v / s,

which is Newton's where w = t, and positive semidefinite. Gradient and solution are the same. With kSimilar the normal
impulse n of the iterate stands for n0, and what n does to friction is left as it is; kSap has another law.
"""

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import load3_at
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.problem import (
    APPROXIMATION,
    CONTACTS_BEGIN,
    CONTACTS_END,
    DUAL_X,
    DUAL_Y,
    DVC,
    EPS,
    FRICTION,
    G_XX,
    G_XY,
    G_YY,
    GAMMA,
    LAGGED,
    N0,
    ORDER,
    VC,
)


@kernel
def inverse_soft_norm(contacts, c, x, y):
    """1 / s of the slip (x, y) of contact c [s/m]."""
    eps = contacts.law[c, EPS]
    return 1.0 / sqrt(x * x + y * y + eps * eps)


@kernel
def put_dual(model, contacts, c, wx, wy):
    """Takes w for the contact's dual; the G of the law at the present slip becomes that with w."""
    state = contacts.state
    x, y, _ = load3_at(state, c, VC)
    soft = inverse_soft_norm(contacts, c, x, y)
    tx = x * soft
    ty = y * soft
    n = contacts.law[c, N0] if model.setting[APPROXIMATION] == LAGGED else state[c, GAMMA + 2]
    stiffness = contacts.law[c, FRICTION] * n * soft
    state[c, DUAL_X] = wx
    state[c, DUAL_Y] = wy
    state[c, G_XX] += stiffness * (tx - wx) * tx
    state[c, G_XY] += stiffness * (tx * ty - 0.5 * (wx * ty + wy * tx))
    state[c, G_YY] += stiffness * (ty - wy) * ty


@kernel(outline=True)
def guess_duals(model, problem, contacts, share):
    """First duals: this share of those with which the first step is Newton's; with none of them it is a secant's."""
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = contacts.index[place, ORDER]
        x, y, _ = load3_at(contacts.state, c, VC)
        soft = share * inverse_soft_norm(contacts, c, x, y)
        put_dual(model, contacts, c, x * soft, y * soft)


@kernel(outline=True)
def follow_duals(model, problem, contacts, alpha):
    """The duals' Newton step that belongs to the last step, of length alpha, of the velocities; back to |w| <= 1."""
    state = contacts.state
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = contacts.index[place, ORDER]
        x, y, _ = load3_at(state, c, VC)
        dx, dy, _ = load3_at(state, c, DVC)
        x -= alpha * dx  # where the step began
        y -= alpha * dy
        wx = state[c, DUAL_X]
        wy = state[c, DUAL_Y]
        soft = inverse_soft_norm(contacts, c, x, y)
        along = (x * dx + y * dy) * soft
        wx += alpha * (soft * (x + dx - wx * along) - wx)
        wy += alpha * (soft * (y + dy - wy * along) - wy)
        w2 = wx * wx + wy * wy
        if w2 > 1.0:
            scale = 1.0 / sqrt(w2)
            wx *= scale
            wy *= scale
        put_dual(model, contacts, c, wx, wy)
