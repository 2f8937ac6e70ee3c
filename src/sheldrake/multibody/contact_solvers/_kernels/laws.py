"""Laws of contact: material, normal force, regularised friction; of each approximation what its contacts do.

A law of the convex problem is the impulse gamma at a velocity vc, G = -dgamma/dvc, and the cost l(vc): those of
kLagged, kSimilar and kSap, one of which a model has chosen (at the end). kTamsi and continuous plants have the same
normal force, with friction that depends on the slip.
"""

import math

import numpy as np

from sheldrake.common._kernels.generic import atan, log, sqrt
from sheldrake.common._kernels.vec import dot3, mul_symmetric
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.problem import (
    ACTUATOR,
    DRY_FRICTION,
    contact_delassus,
    diagonal,
    largest_delassus,
)

# ---- material of a pair
#
# As Drake combines two geometries (its documentation on compliant point contact): k = kA kB / (kA + kB), springs in
# series, d = (kB dA + kA dB) / (kA + kB), tau = tauA + tauB, mu = 2 muA muB / (muA + muB). The contact is at
# (kA p_WCa + kB p_WCb) / (kA + kB). Along surfaces moduli stand for stiffnesses.

INFINITE_STIFFNESS = 1e300  # and more [N/m, Pa]


@kernel
def share(k, other):
    """A's share of the sum of two stiffnesses, kA / (kA + kB), which may be infinite: the weight of A's point."""
    if k > INFINITE_STIFFNESS:
        return 0.5 + 0.0 * k if other > INFINITE_STIFFNESS else 1.0 + 0.0 * other
    if other > INFINITE_STIFFNESS:
        return 0.0 * k
    if k + other > 0.0:
        return k / (k + other)
    return 0.5 + 0.0 * k


@kernel
def harmonic_mean(a, b):
    """Friction of two coefficients."""
    if a + b > 0.0:
        return 2.0 * a * b / (a + b)
    return 0.0 * a


@kernel
def combined_stiffness(A, B, w_A):
    """Of two geometries, of which A's share of the stiffness is w_A [N/m]."""
    return B.stiffness if A.stiffness > INFINITE_STIFFNESS else (1.0 - w_A) * A.stiffness


@kernel
def combined_losses(A, B, w_A):
    """(dissipation [s/m], relaxation time [s]) of two geometries, of which A's share of the stiffness is w_A."""
    return (1.0 - w_A) * A.dissipation + w_A * B.dissipation, A.relaxation_time + B.relaxation_time


# ---- normal forces
#
# Hunt and Crossley's law (1975) where there is dissipation.


@kernel
def hunt_crossley(elastic, d, v):
    """(elastic (1 - d v), 1 - d v) of an elastic force or impulse and a speed of separation; never pulls."""
    damping = 1.0 - d * v
    return (0.0 * v if elastic <= 0.0 else 0.0 * v if damping <= 0.0 else elastic * damping), damping


# ---- a spring without dissipation
#
# Normal impulse of a spring without dissipation, which gives back all the energy it has taken.
#
# A step is q1 = q0 + h v1. Half a step back, at s = q - h v / 2, the same motion is s1 = s0 + h (v0 + v1) / 2: a
# force whose work along s1 - s0 is the change of the spring's energy E(s) keeps kinetic energy, weight and E(s)
# together constant, whatever the step and the stiffness. That force is the slope of the secant of E (Gonzalez 1996,
# "Time integration and discrete Hamiltonian systems"). Since E is convex, it falls with v1, and the step's problem is
# convex.
#
# Names: f0, f1 are what the spring's force would be at s0 and s1, negative before it touches; fe0 at q0 [N].


@kernel
def secant_force(f0, f1):
    """(E1 - E0) / (s0 - s1) [N], and its derivative with respect to f1."""
    zero = 0.0 * f1
    if f0 > 0.0:
        if f1 >= 0.0:
            return 0.5 * (f0 + f1), 0.5 + zero
        part = f0 / (f0 - f1)
        return 0.5 * f0 * part, 0.5 * part * part
    if f1 <= 0.0:
        return zero, zero
    part = f1 / (f1 - f0)
    return 0.5 * f1 * part, part - 0.5 * part * part


@kernel(outline=True)
def elastic_impulse(k, fe0, back, dt, z):
    """n(z) [N s] and its derivative [kg], of normal velocity z at the end; `back` = f0 - fe0."""
    force, slope = secant_force(fe0 + back, fe0 - 0.5 * dt * k * z)
    return dt * force, -0.5 * dt * dt * k * slope


@kernel(outline=True)
def elastic_integral(k, fe0, back, dt, z):
    """An antiderivative of n(z) [J]."""
    f0 = fe0 + back
    f1 = fe0 - 0.5 * dt * k * z
    total = 0.0 * f1
    if f0 > 0.0:
        if f1 >= 0.0:
            total = 0.5 * f0 * f1 + 0.25 * f1 * f1
        else:
            total = -0.5 * f0 * f0 * log(1.0 - f1 / f0)
    elif f1 > 0.0:
        total = 0.25 * f1 * f1 + 0.5 * f0 * f1
        if f0 < 0.0:
            total += 0.5 * f0 * f0 * log(1.0 - f1 / f0)
    return -2.0 / k * total


@kernel
def half_a_step_back(k, depth, dt, reach, vn0):
    """f0 - fe0 of a contact [N]; 0, for backward Euler, if the energy it has at s0 was given to nobody.

    That is where the last step did not see it, as it was farther than `reach` from touching.
    """
    if depth + 0.5 * dt * vn0 > 0.0 and depth + dt * vn0 <= -reach:
        return 0.0 * vn0
    return 0.5 * dt * k * vn0


# ---- normal impulse of a step
#
# Of a Hunt-Crossley spring-damper (Castro, Han, Masterjohn 2023, section IV), or of an elastic spring: `back` is zero
# for the former, see `half_a_step_back`.


@kernel
def normal_impulse(contact, dt, z):
    """n(z) = dt (fe0 - dt k z)+ (1 - d z)+ [N s] and its derivative, which is never positive [kg]."""
    k, d, fe0 = contact.stiffness, contact.dissipation, contact.fe0
    if contact.back != 0.0:
        return elastic_impulse(k, fe0, contact.back, dt, z)
    force = fe0 - dt * k * z  # of the spring at the end of the step
    n, damping = hunt_crossley(dt * force, d, z)
    return n, (0.0 * z if n <= 0.0 else -dt * (k * dt * damping + d * force))


@kernel
def normal_impulse_integral(contact, dt, z):
    """N(z), an antiderivative of `normal_impulse`, constant once contact is lost [J]."""
    k, d, fe0 = contact.stiffness, contact.dissipation, contact.fe0
    if contact.back != 0.0:
        return elastic_integral(k, fe0, contact.back, dt, z)
    open_spring = fe0 / dt / (k + 1e-20)
    open_damper = 1.0 / (d + 1e-20)
    s = open_spring if z > open_spring else z
    s = open_damper if s > open_damper else s
    change = -dt * k * s
    return dt * (s * (fe0 + 0.5 * change) - d * s * s * 0.5 * (fe0 + 2.0 / 3.0 * change))


# ---- regularisation of friction


@kernel
def soft_norm(x, y, eps2):
    """s = sqrt(x^2 + y^2 + eps^2), a norm that is smooth at zero: friction is no jump there."""
    return sqrt(x * x + y * y + eps2)


@kernel
def inverse_soft_norm(contact, x, y):
    """1 / s of the slip (x, y) of a contact [s/m]."""
    return 1.0 / soft_norm(x, y, contact.eps * contact.eps)


@kernel
def soft_slip(contact, x, y):
    """s - eps of the slip (x, y) of a contact: what friction works along [m/s]."""
    return soft_norm(x, y, contact.eps * contact.eps) - contact.eps


# ---- kLagged
#
# Hunt-Crossley normal force, Coulomb friction bounded by the normal impulse of the start of the step (Castro, Han,
# Masterjohn 2023, "A theory of irrotational contact fields", section V-A).


@kernel
def lagged_cost(contact, dt, vc):
    """l(vc) = -N(vn) + mu n0 s(vt) [J]."""
    vx, vy, vn = vc
    return contact.friction * contact.n0 * soft_slip(contact, vx, vy) - normal_impulse_integral(contact, dt, vn)


@kernel
def lagged_slope(contact, dt, vc, u):
    """First and second derivative of `lagged_cost` along a change u of vc [J]."""
    soft = inverse_soft_norm(contact, vc[0], vc[1])
    along = (vc[0] * u[0] + vc[1] * u[1]) * soft  # of the soft norm
    friction = contact.friction * contact.n0
    n, slope = normal_impulse(contact, dt, vc[2])
    curvature = friction * soft * (u[0] * u[0] + u[1] * u[1] - along * along) - slope * u[2] * u[2]
    return friction * along - n * u[2], curvature


@kernel
def lagged_impulse(contact, dt, vc):
    """Impulse gamma [N s] and G = -dgamma/dvc [kg] as (xx, xy, yy, xz, yz, zz)."""
    vx, vy, vn = vc
    soft = inverse_soft_norm(contact, vx, vy)
    tx, ty = vx * soft, vy * soft
    friction = contact.friction * contact.n0
    stiffness = friction * soft
    n, slope = normal_impulse(contact, dt, vn)
    gamma = (-friction * tx, -friction * ty, n)
    zero = 0.0 * vn
    G = (stiffness * (1.0 - tx * tx), -stiffness * tx * ty, stiffness * (1.0 - ty * ty), zero, zero, -slope)
    return gamma, G


# ---- kSimilar
#
# Normal impulse and friction share one argument, so that dissipation acts with a Coulomb cone coupled to it (the same,
# section V-B).


@kernel
def similar_cost(contact, dt, vc):
    """l(vc) = -N(vn - mu s(vt)) [J]."""
    vx, vy, vn = vc
    return -normal_impulse_integral(contact, dt, vn - contact.friction * soft_slip(contact, vx, vy))


@kernel
def similar_slope(contact, dt, vc, u):
    """First and second derivative of `similar_cost` along a change u of vc [J]."""
    mu = contact.friction
    soft = inverse_soft_norm(contact, vc[0], vc[1])
    along = (vc[0] * u[0] + vc[1] * u[1]) * soft  # of the soft norm
    n, slope = normal_impulse(contact, dt, vc[2] - mu * soft_slip(contact, vc[0], vc[1]))
    change = u[2] - mu * along
    curvature = mu * n * soft * (u[0] * u[0] + u[1] * u[1] - along * along) - slope * change * change
    return -n * change, curvature


@kernel
def similar_impulse(contact, dt, vc):
    """Impulse gamma [N s] and G = -dgamma/dvc [kg] as (xx, xy, yy, xz, yz, zz)."""
    vx, vy, vn = vc
    mu, eps = contact.friction, contact.eps
    norm = soft_norm(vx, vy, eps * eps)
    tx, ty = vx / norm, vy / norm
    z = vn - mu * (norm - eps)
    n, slope = normal_impulse(contact, dt, z)
    gamma = (-mu * n * tx, -mu * n * ty, n)
    along = -mu * mu * slope
    across = mu * n / norm
    G = (
        along * tx * tx + across * (1.0 - tx * tx),
        (along - across) * tx * ty,
        along * ty * ty + across * (1.0 - ty * ty),
        mu * slope * tx,
        mu * slope * ty,
        -slope,
    )
    return gamma, G


# ---- kSap
#
# Linear compliance with a relaxation time and the exact friction cone, regularised (Castro, Permenter, Han 2022, "An
# unconstrained convex formulation of compliant contact", sections III and V).


@kernel
def sap_cone_impulse(contact, vc):
    """Impulse gamma = P(R^-1 (vhat - vc)) [N s] (eqs. 23, 27) and G = -dgamma/dvc [kg] as (xx, xy, yy, xz, yz, zz)."""
    mu, Rt, Rn = contact.friction, contact.R_t, contact.R_n
    yx = -vc[0] / Rt
    yy = -vc[1] / Rt
    yn = (contact.vhat_n - vc[2]) / Rn
    yr = soft_norm(yx, yy, 1e-14)  # (1e-7 N s)^2
    zero = 0.0 * yn
    gamma = (zero, zero, zero)
    G = (zero, zero, zero, zero, zero, zero)
    mu_hat = mu * Rt / Rn
    if yr <= mu * yn:
        gamma = (yx, yy, yn)
        G = (1.0 / Rt + zero, zero, 1.0 / Rt + zero, zero, zero, 1.0 / Rn + zero)
    elif -mu_hat * yr < yn:
        tx, ty = yx / yr, yy / yr
        f = 1.0 / (1.0 + mu * mu_hat)
        gn = (yn + mu_hat * yr) * f
        across = mu * gn / yr
        along = mu * mu_hat * f
        gamma = (mu * gn * tx, mu * gn * ty, gn)
        G = (
            (across * (1.0 - tx * tx) + along * tx * tx) / Rt,
            (along - across) * tx * ty / Rt,
            (across * (1.0 - ty * ty) + along * ty * ty) / Rt,
            mu * f * tx / Rn,
            mu * f * ty / Rn,
            f / Rn,
        )
    return gamma, G


@kernel
def sap_cone_cost(contact, vc):
    """l(vc) = 1/2 gamma^T R gamma [J], a term of eq. 24."""
    gamma, _ = sap_cone_impulse(contact, vc)
    return 0.5 * (contact.R_t * (gamma[0] * gamma[0] + gamma[1] * gamma[1]) + contact.R_n * gamma[2] * gamma[2])


# ---- friction coefficients by the slip
#
# What does not solve a convex problem takes friction along the slip, with a coefficient that rises with its speed.

NO_SLIP = 0.01  # slip below this fraction of the stiction tolerance counts as none
TWO_OVER_PI = 2.0 / math.pi
HALF_WAY = 10.0  # slip, in stiction tolerances, half way from static to dynamic friction


@kernel
def tamsi_friction(mu, vt, vs):
    """kTamsi: (slip direction, friction coefficient at that slip, its derivative over the slip [s/m], slip [m/s])."""
    small = NO_SLIP * vs
    slip = soft_norm(vt[0], vt[1], small * small)
    s = slip / vs
    direction = (vt[0] / slip, vt[1] / slip)
    if s >= 1.0:
        return direction, mu + 0.0 * slip, 0.0 * slip, slip
    return direction, mu * s * (2.0 - s), 2.0 * mu * (1.0 - s) / vs, slip


@kernel
def put_tamsi_impulse(model, contact, h):
    """Impulse h f of a sub-step, and K = -d(h f)/dvc with rows (xx, xy, xz), (xy, yy, yz), (0, 0, zz), at its vc."""
    vx, vy, vn = contact.vc
    k, d = contact.stiffness, contact.dissipation
    force = contact.fe0 - h * k * vn
    fn, damping = hunt_crossley(force, d, vn)
    slope = 0.0 * vn
    if force >= 0.0 and damping > 0.0:
        slope -= h * k * damping
    if damping >= 0.0 and force > 0.0:
        slope -= d * force
    (tx, ty), mu, dmu, slip = tamsi_friction(contact.friction, (vx, vy), model.stiction)
    contact.gamma = (-h * mu * tx * fn, -h * mu * ty * fn, h * fn)
    across = h * fn * mu / slip
    along = h * fn * dmu
    contact.G = (
        across + (along - across) * tx * tx,
        (along - across) * tx * ty,
        across + (along - across) * ty * ty,
        h * mu * tx * slope,
        h * mu * ty * slope,
        -h * slope,
    )


@kernel
def step_to_one(x):
    """x³ (10 - 15 x + 6 x²): from 0 at 0 to 1 at 1 with zero slope and curvature at both ends."""
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


@kernel
def stribeck(mu_static, mu_dynamic, s):
    """Continuous plants: friction coefficient at slip s, in stiction tolerances: Drake's Stribeck curve."""
    if s >= 3.0:
        return mu_dynamic
    if s >= 1.0:
        return mu_static - (mu_static - mu_dynamic) * step_to_one(0.5 * (s - 1.0))
    return mu_static * step_to_one(s)


@kernel
def surface_friction(largest, s):
    """Continuous plants, contact surfaces: friction at slip s, in stiction tolerances (Elandt et al. 2019)."""
    return largest * TWO_OVER_PI * atan(s)


@kernel
def sigmoid(x):
    return x / sqrt(1.0 + x * x)


@kernel
def static_share(s):
    """Part of static friction, the rest being dynamic, at slip s, in stiction tolerances (Kurtz and Castro 2025)."""
    return 0.5 * (1.0 - sigmoid(s - HALF_WAY) / sigmoid(HALF_WAY))


# ---- scalar rows
#
# One-row constraints: a regularised multiplier between bounds (limits, holonomic rows, actuators).


@kernel
def row_impulse(row, vc):
    """gamma = clamp(push - resistance vc, lower, upper) and G = -dgamma/dvc."""
    y = row.push - row.resistance * vc
    lower, upper = row.lower, row.upper
    gamma = lower + 0.0 * y if y <= lower else upper + 0.0 * y if y >= upper else y
    G = 0.0 * y if y <= lower else 0.0 * y if y >= upper else row.resistance + 0.0 * y
    return gamma, G


@kernel
def row_cost(row, vc):
    """R y^2 / 2 between the bounds, linear beyond them."""
    y = row.push - row.resistance * vc
    if y <= row.lower:
        return -row.lower * vc
    if y >= row.upper:
        return -row.upper * vc
    return 0.5 * y * y / row.resistance


@kernel
def row_group_delassus(problem, rows, r, n):
    """w = |J diag(1/A) J^T|_F / n of n rows with the same dofs."""
    row = rows[r]
    total = 0.0
    for i in range(n):
        for j in range(n):
            s = 0.0
            for a in range(row.width):
                s += rows[r + i].J[a] * problem.mobility[row.dofs[a]] * rows[r + j].J[a]
            total += s * s
    return sqrt(total) / n


@kernel
def prepare_spring_row(row, dt, part, mass):
    """A spring of stiffness k (may be infinite) and relaxation time tau, no stiffer than the time step resolves."""
    k = row.stiffness
    row.resistance = dt * (dt + row.relaxation) * k
    row.push = -dt * k * row.gap
    if row.resistance * part > mass:
        row.resistance = mass / part
        row.push = -row.gap / (2.0 * dt) * row.resistance  # tau = dt


@kernel
def prepare_actuator_row(row, dt, part, mass):
    """An implicit PD controller: gains too stiff for the time step are scaled down, keeping their ratio."""
    kp, kd = row.stiffness, row.relaxation
    if dt * (dt * kp + kd) * part > mass:
        most = mass / part
        if dt * kp > kd:
            tau = kd / kp
            kp = most / (dt * (dt + tau))
            kd = tau * kp
        else:
            ratio = kp / kd
            kd = most / (dt * (1.0 + dt * ratio))
            kp = ratio * kd
    row.resistance = dt * (dt * kp + kd)
    row.push = dt * (kd * row.rate - kp * row.gap + row.forward)


FOUR_PI_SQUARED = 4.0 * np.pi**2


@kernel
def rigid_part(model):
    """What w of a row is multiplied with to be the least 1 / resistance: beta^2 / 4 pi^2."""
    return model.near_rigid_rows * model.near_rigid_rows / FOUR_PI_SQUARED


@kernel
def prepare_row(row, dt, part, mass):
    """Resistance and push of a row that resists no more than mass / part, a quotient that most have no need of."""
    if row.kind == ACTUATOR or row.kind == DRY_FRICTION:
        prepare_actuator_row(row, dt, part, mass)
    else:
        prepare_spring_row(row, dt, part, mass)
    row.dvc = 0.0 * row.resistance


@kernel
def put_rows_ahead(model, problem, rows, impulse):
    """Adds what the rows there are, each of one dof, do linearly at v0 to L, which is A as yet, and to an impulse."""
    count, dt, rigid = problem.num_rows, model.dt, rigid_part(model)
    problem.rows_ahead = count
    for r in range(count):
        row = rows[r]
        k, J = row.dofs[0], row.J[0]
        at = diagonal(model, k)
        prepare_row(row, dt, rigid * J * J, problem.A[at])
        row.gamma, row.G = row_impulse(row, J * problem.v0[k])
        problem.L[at] += J * row.G * J
        impulse[k] += J * row.gamma


# ---- what contacts need before the first iteration

LEAST = 1.0 - 1e-9  # of what must not be taken for smaller than it is
SLIDING = 10.0  # slip over the stiction tolerance from which on it is sliding


@kernel
def closing_speed(contact, dt):
    """The velocity that would close the penetration within dt + tau [m/s] (Castro, Permenter, Han 2022, section V-A).

    A point that does not touch yet (see `least_depth`) may come as fast as it touches at the end of the step; a face
    within the margins of hydroelastic bodies is as slow as one that touches.
    """
    if contact.depth < 0.0:
        return contact.depth / (dt + contact.lag)
    return contact.depth / (dt + contact.relaxation)


@kernel
def glide(model, contact, v0, v1):
    """Speed at which a contact would leave the surface that it slides along, with these velocities [m/s]."""
    slip2 = v0[0] * v0[0] + v0[1] * v0[1]
    if not slip2 > 0.0:
        return 0.0 * slip2
    along = (v0[0] * v1[0] + v0[1] * v1[1]) / sqrt(slip2)
    if not along > 0.0:
        return 0.0 * slip2
    sliding = slip2 / (SLIDING * SLIDING * model.stiction * model.stiction)
    if sliding < 1.0:
        along *= sliding
    return contact.friction * along


@kernel
def put_regularisation(model, problem, contact):
    """Regularisation speed max(v_s, mu sigma w n0) of friction (Castro, Han, Masterjohn 2023, section V).

    It hardly ever depends on w: mostly it is the stiction tolerance for the largest w, too.
    """
    usual = model.stiction + 0.0 * contact.n0
    slip = contact.friction * model.sigma * contact.n0
    most = slip * largest_delassus(problem, contact) if slip > 0.0 else 0.0 * slip
    contact.eps = max(usual, slip * contact_delassus(problem, contact)) if most >= LEAST * model.stiction else usual


@kernel
def prepare_hunt_crossley(model, problem, contact):
    """kLagged and kSimilar: elastic force, normal impulse and regularisation speed, all at the start of the step."""
    vn0 = contact.vc[2]
    fe0 = contact.stiffness * contact.depth
    n0, _ = hunt_crossley(model.dt * fe0, contact.dissipation, vn0)
    contact.fe0 = fe0
    contact.n0 = n0
    put_regularisation(model, problem, contact)
    if contact.back > 0.0:
        contact.back = half_a_step_back(contact.stiffness, contact.depth, model.dt, contact.back, vn0)


@kernel
def prepare_sap_cone(model, problem, contact):
    """kSap: regularisation (Castro, Permenter, Han 2022, eqs. 29 and 30), and the velocity that would close the gap."""
    dt, beta = model.dt, model.near_rigid
    w = contact_delassus(problem, contact)
    rigid = beta * beta / FOUR_PI_SQUARED * w
    Rn = 1.0 / (dt * contact.stiffness * (dt + contact.relaxation))
    contact.delassus = w
    contact.R_t = model.sigma * w
    contact.R_n = rigid if Rn < rigid else Rn
    contact.vhat_n = closing_speed(contact, dt)


# ---- the chosen one
#
# What contacts do under the approximation of a model; `APPROXIMATIONS` of `solve` tells what else it is made of.

LAGGED, SIMILAR, SAP = 0, 1, 2  # Settings.law
HOLDS = 0.95  # of what friction can bear, where it is sure to hold


@kernel
def contact_impulse(model, contact, vc):
    """Impulse gamma [N s] and G = -dgamma/dvc [kg] as (xx, xy, yy, xz, yz, zz) of a contact at velocity vc [m/s]."""
    if model.law == LAGGED:
        return lagged_impulse(contact, model.dt, vc)
    if model.law == SIMILAR:
        return similar_impulse(contact, model.dt, vc)
    return sap_cone_impulse(contact, vc)


@kernel
def contact_cost(model, contact, vc):
    """Cost l(vc) of a contact [J]."""
    if model.law == LAGGED:
        return lagged_cost(contact, model.dt, vc)
    if model.law == SIMILAR:
        return similar_cost(contact, model.dt, vc)
    return sap_cone_cost(contact, vc)


@kernel
def contact_slope(model, contact, vc, u):
    """First and second derivative of `contact_cost` along a change u of vc [J]: -u^T gamma and u^T G u."""
    if model.law == LAGGED:
        return lagged_slope(contact, model.dt, vc, u)
    if model.law == SIMILAR:
        return similar_slope(contact, model.dt, vc, u)
    gamma, G = contact_impulse(model, contact, vc)
    return -dot3(u, gamma), dot3(u, mul_symmetric((G[0], G[2], G[5], G[1], G[3], G[4]), u))


@kernel
def friction_load(model, contact, gamma):
    """The normal impulse that bounds friction, where friction is load times the soft norm of the slip [N s]."""
    return contact.n0 if model.law == LAGGED else gamma[2]


@kernel
def holding_velocity(model, contact, gamma, w):
    """Velocity of a contact [m/s] with the slip at which friction is that of gamma, if it holds; else as it is.

    It holds where friction that takes the slip off as well, w being what an impulse makes of it [1/kg], can be borne
    (Alart and Curnier 1991, the projection of an augmented Lagrangian).
    """
    x, y, _ = gamma
    vx, vy, vn = contact.vc
    bound = contact.friction * friction_load(model, contact, gamma)
    held_x, held_y = w * x - vx, w * y - vy
    most = HOLDS * HOLDS * bound * bound
    load2 = x * x + y * y if held_x * held_x + held_y * held_y < most * w * w else most
    slip = held_slip(model, contact, bound, x, y) if load2 < most else 0.0 * bound
    return ((-slip * x, -slip * y, vn) if load2 < most else contact.vc) if bound > 0.0 else contact.vc


@kernel
def held_slip(model, contact, bound, x, y):
    """Over the impulse (x, y), the slip at which friction up to a bound is that [1/kg]."""
    return contact.R_t if model.law == SAP else contact.eps / sqrt(bound * bound - x * x - y * y)
