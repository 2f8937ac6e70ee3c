"""Equations of motion of the examples, as a textbook writes them (Tedrake, Underactuated Robotics).

`xc` is the continuous state, `xd` the discrete one, `p` the parameters, `u` the inputs; an input that is not connected
is empty and counts as zero.
"""

import math
from typing import NamedTuple

from sheldrake.common._kernels.generic import clip, cos, sin, whole
from sheldrake.common._kernels.vec import cross3, dot3, load3, sub3
from sheldrake.common.kernel import Matrix, Vector, Vectors, kernel
from sheldrake.common.record import Record, number, numbers


@kernel
def first_input(u):
    """The first element of the first input, or zero."""
    if u[0].shape[0] == 0:
        return 0.0
    return u[0][0]


@kernel
def accelerations(m11, m12, m22, f1, f2):
    """M^-1 f of two coordinates."""
    det = m11 * m22 - m12 * m12
    return (m22 * f1 - m12 * f2) / det, (m11 * f2 - m12 * f1) / det


# ---- pendulum


class Pendulum(Record):
    """A point mass on a massless rod."""

    m = number("mass", "kg")
    l = number("length", "m")
    b = number("damping", "N m s/rad")
    g = number("gravity", "m/s^2")


class PendulumState(Record):
    """One angle."""

    theta = number("from hanging straight down", "rad")
    thetadot = number("its rate", "rad/s")


@kernel(top=True)
def pendulum(p: Pendulum, xc: PendulumState, u: Vectors, xdot: PendulumState) -> None:
    """m l^2 theta'' = tau - b theta' - m g l sin(theta)."""
    m, l, b, g = p.m, p.l, p.b, p.g
    xdot.theta = xc.thetadot
    xdot.thetadot = (first_input(u) - m * g * l * sin(xc.theta) - b * xc.thetadot) / (m * l * l)


@kernel(top=True)
def pendulum_kinetic_energy(p: Pendulum, xc: PendulumState, energy: Vector) -> None:
    """m (l theta')^2 / 2."""
    speed = p.l * xc.thetadot
    energy[0] = 0.5 * p.m * speed * speed


@kernel(top=True)
def pendulum_potential_energy(p: Pendulum, xc: PendulumState, energy: Vector) -> None:
    """Zero at the height of the pivot."""
    energy[0] = -p.m * p.g * p.l * cos(xc.theta)


@kernel(top=True)
def van_der_pol(p: Vector, xc: Vector, xdot: Vector) -> None:
    """q'' = -mu (q^2 - 1) q' - q; p = mu."""
    xdot[0] = xc[1]
    xdot[1] = -p[0] * (xc[0] * xc[0] - 1.0) * xc[1] - xc[0]


# ---- rimless wheel


class RimlessWheel(Record):
    """Spokes without a rim."""

    m = number("mass", "kg")
    l = number("length of a spoke", "m")
    g = number("gravity", "m/s^2")
    spokes = number("how many")
    slope = number("of the ground", "rad")


class Stance(NamedTuple):
    """How the wheel stands."""

    on_two: Vector  # one number: 1.0 on two spokes, else 0.0


@kernel(top=True)
def rimless_wheel(p: RimlessWheel, xc: PendulumState, stance: Stance, xdot: PendulumState) -> None:
    """theta'' = g / l sin(theta); nothing moves on two spokes."""
    if stance.on_two[0] != 0.0:
        xdot.theta = 0.0
        xdot.thetadot = 0.0
    else:
        xdot.theta = xc.thetadot
        xdot.thetadot = sin(xc.theta) * p.g / p.l


@kernel(top=True)
def wheel_until_step_forward(p: RimlessWheel, xc: PendulumState, w: Vector) -> None:
    """The angle that is left until the next spoke ahead touches the ground [rad]."""
    w[0] = p.slope + math.pi / p.spokes - xc.theta


@kernel(top=True)
def wheel_until_step_backward(p: RimlessWheel, xc: PendulumState, w: Vector) -> None:
    """The angle that is left until the spoke behind touches the ground [rad]."""
    w[0] = xc.theta - p.slope + math.pi / p.spokes


# ---- acrobot


class Acrobot(Record):
    """Two links."""

    m1 = number("mass of the upper link", "kg")
    m2 = number("mass of the lower link", "kg")
    l1 = number("length of the upper link", "m")
    l2 = number("length of the lower link", "m")
    lc1 = number("from the shoulder to the upper link's centre of mass", "m")
    lc2 = number("from the elbow to the lower link's centre of mass", "m")
    Ic1 = number("inertia of the upper link about its centre of mass", "kg m^2")
    Ic2 = number("inertia of the lower link about its centre of mass", "kg m^2")
    b1 = number("damping of the shoulder", "N m s/rad")
    b2 = number("damping of the elbow", "N m s/rad")
    g = number("gravity", "m/s^2")


class TwoLinkState(Record):
    """Two angles and their rates."""

    theta1 = number("of the upper link, from hanging down; of the stance leg, from upright", "rad")
    theta2 = number("of the lower link, from the upper; of the swing leg, from upright", "rad")
    w1 = number("rate of theta1", "rad/s")
    w2 = number("rate of theta2", "rad/s")


@kernel
def acrobot_mass(p, theta2):
    """The elements 11, 12, 22 of the mass matrix."""
    I1 = p.Ic1 + p.m1 * p.lc1 * p.lc1
    I2 = p.Ic2 + p.m2 * p.lc2 * p.lc2
    h = p.m2 * p.l1 * p.lc2 * cos(theta2)
    return I1 + I2 + p.m2 * p.l1 * p.l1 + 2.0 * h, I2 + h, I2


@kernel
def acrobot_bias(p, theta1, theta2, w1, w2):
    """Coriolis, gravity and damping: what stands on the left beside M q''."""
    h = p.m2 * p.l1 * p.lc2 * sin(theta2)
    s1, s12 = sin(theta1), sin(theta1 + theta2)
    bias1 = -2.0 * h * w2 * w1 - h * w2 * w2
    bias2 = h * w1 * w1
    bias1 += p.g * (p.m1 * p.lc1 * s1 + p.m2 * (p.l1 * s1 + p.lc2 * s12))
    bias2 += p.g * p.m2 * p.lc2 * s12
    return bias1 + p.b1 * w1, bias2 + p.b2 * w2


@kernel(top=True)
def acrobot(p: Acrobot, xc: TwoLinkState, u: Vectors, xdot: TwoLinkState) -> None:
    """M q'' = (0, tau) - bias."""
    m11, m12, m22 = acrobot_mass(p, xc.theta2)
    bias1, bias2 = acrobot_bias(p, xc.theta1, xc.theta2, xc.w1, xc.w2)
    f1, f2 = -bias1, first_input(u) - bias2
    xdot.theta1, xdot.theta2 = xc.w1, xc.w2
    xdot.w1, xdot.w2 = accelerations(m11, m12, m22, f1, f2)


@kernel(top=True)
def acrobot_kinetic_energy(p: Acrobot, xc: TwoLinkState, energy: Vector) -> None:
    """q'^T M q' / 2."""
    m11, m12, m22 = acrobot_mass(p, xc.theta2)
    w1, w2 = xc.w1, xc.w2
    energy[0] = 0.5 * (m11 * w1 * w1 + m22 * w2 * w2) + m12 * w1 * w2


@kernel(top=True)
def acrobot_potential_energy(p: Acrobot, xc: TwoLinkState, energy: Vector) -> None:
    """Zero at the height of the shoulder."""
    c1, c12 = cos(xc.theta1), cos(xc.theta1 + xc.theta2)
    energy[0] = -p.g * (p.m1 * p.lc1 * c1 + p.m2 * (p.l1 * c1 + p.lc2 * c12))


class Spong(Record):
    """Gains of a swing-up."""

    k_e = number("of the energy")
    k_p = number("of the elbow's angle")
    k_d = number("of the elbow's rate")
    threshold = number("cost below which the regulator takes over")


MOST_TORQUE = 20.0  # of the swing-up [N m]


@kernel
def acrobot_excess(p, theta1, theta2, w1, w2):
    """Energy above that of rest upright [J]."""
    m11, m12, m22 = acrobot_mass(p, theta2)
    kinetic = 0.5 * (w1 * (m11 * w1 + m12 * w2) + w2 * (m12 * w1 + m22 * w2))
    c1, c12 = cos(theta1), cos(theta1 + theta2)
    above = p.m1 * p.lc1 * (1.0 + c1) + p.m2 * (p.l1 * (1.0 + c1) + p.lc2 * (1.0 + c12))
    return kinetic - p.g * above


@kernel
def swing_up(p, gains, theta1, theta2, w1, w2):
    """Energy shaping, plus a linear motion of the elbow (partial feedback linearization)."""
    m11, m12, m22 = acrobot_mass(p, theta2)
    bias1, bias2 = acrobot_bias(p, theta1, theta2, w1, w2)
    wanted = -gains.k_p * theta2 - gains.k_d * w2
    partial = (wanted * (m11 * m22 - m12 * m12) - m12 * bias1) / m11 + bias2
    return partial - gains.k_e * acrobot_excess(p, theta1, theta2, w1, w2) * w2


@kernel(top=True)
def spong(acrobot_model: Acrobot, regulator_model: Matrix, p: Spong, u: Vectors, y: Vector) -> None:
    """Swings up, and regulates where that costs little; `regulator_model`: its cost S, then its gain K, (5, 4)."""
    theta1, theta2, w1, w2 = u[0][0], u[0][1], u[0][2], u[0][3]
    turn = 2.0 * math.pi
    e1 = theta1 - turn * whole(theta1 / turn) - math.pi
    e2 = theta2 - turn * whole((theta2 + math.pi) / turn)
    error = (e1, e2, w1, w2)
    cost, torque = 0.0 * e1, 0.0 * e1
    for i in range(4):
        torque -= regulator_model[4, i] * error[i]
        for j in range(4):
            cost += error[i] * regulator_model[i, j] * error[j]
    if not cost < p.threshold:
        torque = swing_up(acrobot_model, p, theta1, theta2, w1, w2)
    y[0] = clip(torque, -MOST_TORQUE, MOST_TORQUE)


# ---- compass gait


class Compass(Record):
    """Two legs with point masses."""

    mh = number("mass of the hip", "kg")
    m = number("mass of a leg", "kg")
    l = number("length of a leg", "m")
    b = number("from the hip to the mass of a leg", "m")
    g = number("gravity", "m/s^2")
    slope = number("of the ground", "rad")


@kernel(top=True)
def compass_gait(p: Compass, xc: TwoLinkState, u: Vectors, xdot: TwoLinkState) -> None:
    """Two legs with point masses (Goswami et al. 1996); angles of stance and swing."""
    mh, m, l, b, g = p.mh, p.m, p.l, p.b, p.g
    a = l - b
    c, s = cos(xc.theta2 - xc.theta1), sin(xc.theta1 - xc.theta2)
    m11, m12, m22 = mh * l * l + m * (l * l + a * a), -m * l * b * c, m * b * b
    tau = first_input(u)
    f1 = -tau + m * l * b * xc.w2 * xc.w2 * s + (mh * l + m * (a + l)) * g * sin(xc.theta1)
    f2 = tau - m * l * b * xc.w1 * xc.w1 * s - m * b * g * sin(xc.theta2)
    xdot.theta1, xdot.theta2 = xc.w1, xc.w2
    xdot.w1, xdot.w2 = accelerations(m11, m12, m22, f1, f2)


@kernel(top=True)
def height_of_swing_foot(p: Compass, xc: TwoLinkState, w: Vector) -> None:
    """Positive above the slope, and while the swing leg is behind: legs of one length scuff in passing."""
    w[0] = max(2.0 * p.slope - xc.theta1 - xc.theta2, xc.theta2 - xc.theta1)


# ---- quadrotor


class Quadrotor(Record):
    """Four rotors in a cross."""

    m = number("mass", "kg")
    L = number("distance of a rotor from the centre", "m")
    kF = number("force of a rotor for one unit of its command", "N")
    kM = number("torque of a rotor for one unit of its command", "N m")
    g = number("gravity", "m/s^2")


class QuadrotorState(Record):
    """Where a quadrotor is and how it moves."""

    p_WB = numbers(3, "position", "m")
    rpy = numbers(3, "roll, pitch and yaw", "rad")
    v_WB = numbers(3, "rate of the position", "m/s")
    rpydot = numbers(3, "rates of roll, pitch and yaw", "rad/s")


@kernel
def three_rows(A, r, v):
    """The product of rows r, r + 1, r + 2 of A with a vector."""
    return dot3(load3(A, r), v), dot3(load3(A, r + 1), v), dot3(load3(A, r + 2), v)


@kernel(top=True)
def quadrotor(inertia_model: Matrix, model: Quadrotor, xc: QuadrotorState, u: Vectors, xdot: QuadrotorState) -> None:
    """Four rotors in a cross on a rigid body.

    inertia_model: the inertia about the centre and its inverse, one above the other, shape (6, 3).
    """
    m, L, kF, kM, g = model.m, model.L, model.kF, model.kM, model.g
    f0, f1, f2, f3 = 0.0 * kF, 0.0 * kF, 0.0 * kF, 0.0 * kF
    if u[0].shape[0] == 4:
        f0, f1, f2, f3 = u[0][0], u[0][1], u[0][2], u[0][3]
    roll, pitch, yaw = xc.rpy
    cr, sr = cos(roll), sin(roll)
    cp, sp = cos(pitch), sin(pitch)
    cy, sy = cos(yaw), sin(yaw)
    dr, dp, dy = xc.rpydot
    xdot.p_WB = xc.v_WB
    xdot.rpy = (dr, dp, dy)
    lift = kF * (f0 + f1 + f2 + f3) / m
    xdot.v_WB = ((cy * sp * cr + sy * sr) * lift, (sy * sp * cr - cy * sr) * lift, cp * cr * lift - g)
    # Angular velocity and torque about the centre, in the body's frame; I alpha = M - w x I w.
    w = (dr - dy * sp, dp * cr + dy * sr * cp, dy * cr * cp - dp * sr)
    torque = (L * kF * (f1 - f3), L * kF * (f2 - f0), kM * (f0 - f1 + f2 - f3))
    ax, ay, az = three_rows(inertia_model, 3, sub3(torque, cross3(w, three_rows(inertia_model, 0, w))))
    # w = N(rpy) rpy', so rpy'' = N^-1 (alpha - N' rpy').
    ax += dy * dp * cp
    ay -= -dp * dr * sr + dy * dr * cr * cp - dy * dp * sr * sp
    az -= -dp * dr * cr - dy * dr * sr * cp - dy * dp * cr * sp
    ddy = (sr * ay + cr * az) / cp
    xdot.rpydot = (ax + sp * ddy, cr * ay - sr * az, ddy)
