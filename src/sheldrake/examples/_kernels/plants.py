"""Equations of motion of the examples, as a textbook writes them (Tedrake, Underactuated Robotics).

`xc` is the continuous state, `xd` the discrete one, `p` the parameters in the order of the example's parameter vector,
`u` the inputs; an input that is not connected is empty and counts as zero.
"""

from sheldrake.common._kernels.generic import cos, sin
from sheldrake.common.kernel import Matrix, Vector, Vectors, kernel


@kernel
def first_input(u):
    """The first element of the first input, or zero."""
    if u[0].shape[0] == 0:
        return 0.0
    return u[0][0]


@kernel(top=True)
def pendulum(p: Vector, xc: Vector, u: Vectors, xdot: Vector) -> None:
    """m l^2 theta'' = tau - b theta' - m g l sin(theta); p = m, l, b, g."""
    m, l, b, g = p[0], p[1], p[2], p[3]
    xdot[0] = xc[1]
    xdot[1] = (first_input(u) - m * g * l * sin(xc[0]) - b * xc[1]) / (m * l * l)


@kernel(top=True)
def van_der_pol(p: Vector, xc: Vector, xdot: Vector) -> None:
    """q'' = -mu (q^2 - 1) q' - q."""
    xdot[0] = xc[1]
    xdot[1] = -p[0] * (xc[0] * xc[0] - 1.0) * xc[1] - xc[0]


@kernel
def acrobot_mass(p, theta2):
    """The elements 11, 12, 22 of the mass matrix; p = m1, m2, l1, l2, lc1, lc2, Ic1, Ic2, b1, b2, g."""
    I1 = p[6] + p[0] * p[4] * p[4]
    I2 = p[7] + p[1] * p[5] * p[5]
    h = p[1] * p[2] * p[5] * cos(theta2)
    return I1 + I2 + p[1] * p[2] * p[2] + 2.0 * h, I2 + h, I2


@kernel
def acrobot_bias(p, theta1, theta2, w1, w2):
    """Coriolis, gravity and damping: what stands on the left beside M q''."""
    h = p[1] * p[2] * p[5] * sin(theta2)
    s1, s12 = sin(theta1), sin(theta1 + theta2)
    b1 = -2.0 * h * w2 * w1 - h * w2 * w2
    b2 = h * w1 * w1
    b1 += p[10] * (p[0] * p[4] * s1 + p[1] * (p[2] * s1 + p[5] * s12))
    b2 += p[10] * p[1] * p[5] * s12
    return b1 + p[8] * w1, b2 + p[9] * w2


@kernel(top=True)
def acrobot(p: Vector, xc: Vector, u: Vectors, xdot: Vector) -> None:
    """M q'' = (0, tau) - bias; x = theta1, theta2 and their rates."""
    m11, m12, m22 = acrobot_mass(p, xc[1])
    b1, b2 = acrobot_bias(p, xc[0], xc[1], xc[2], xc[3])
    f1, f2 = -b1, first_input(u) - b2
    det = m11 * m22 - m12 * m12
    xdot[0] = xc[2]
    xdot[1] = xc[3]
    xdot[2] = (m22 * f1 - m12 * f2) / det
    xdot[3] = (m11 * f2 - m12 * f1) / det


@kernel(top=True)
def compass_gait(p: Vector, xc: Vector, u: Vectors, xdot: Vector) -> None:
    """Two legs with point masses (Goswami et al. 1996); p = m_hip, m_leg, l, b, g, slope; x = stance, swing, rates."""
    mh, m, l, b, g = p[0], p[1], p[2], p[3], p[4]
    a = l - b
    c, s = cos(xc[1] - xc[0]), sin(xc[0] - xc[1])
    m11, m12, m22 = mh * l * l + m * (l * l + a * a), -m * l * b * c, m * b * b
    tau = first_input(u)
    f1 = -tau + m * l * b * xc[3] * xc[3] * s + (mh * l + m * (a + l)) * g * sin(xc[0])
    f2 = tau - m * l * b * xc[2] * xc[2] * s - m * b * g * sin(xc[1])
    det = m11 * m22 - m12 * m12
    xdot[0] = xc[2]
    xdot[1] = xc[3]
    xdot[2] = (m22 * f1 - m12 * f2) / det
    xdot[3] = (m11 * f2 - m12 * f1) / det


@kernel(top=True)
def quadrotor(inertia_model: Matrix, model: Vector, xc: Vector, u: Vectors, xdot: Vector) -> None:
    """Four rotors in a cross on a rigid body; x = position, roll-pitch-yaw, and the rates of both.

    inertia_model: the inertia about the centre and its inverse, one above the other, shape (6, 3).
    model: mass, arm, force and moment constants of a rotor, gravity.
    """
    m, L, kF, kM, g = model[0], model[1], model[2], model[3], model[4]
    f0, f1, f2, f3 = 0.0 * kF, 0.0 * kF, 0.0 * kF, 0.0 * kF
    if u[0].shape[0] == 4:
        f0, f1, f2, f3 = u[0][0], u[0][1], u[0][2], u[0][3]
    cr, sr = cos(xc[3]), sin(xc[3])
    cp, sp = cos(xc[4]), sin(xc[4])
    cy, sy = cos(xc[5]), sin(xc[5])
    dr, dp, dy = xc[9], xc[10], xc[11]
    for i in range(6):
        xdot[i] = xc[6 + i]
    lift = kF * (f0 + f1 + f2 + f3) / m
    xdot[6] = (cy * sp * cr + sy * sr) * lift
    xdot[7] = (sy * sp * cr - cy * sr) * lift
    xdot[8] = cp * cr * lift - g
    # Angular velocity and torque about the centre, in the body's frame; I alpha = M - w x I w.
    wx, wy, wz = dr - dy * sp, dp * cr + dy * sr * cp, dy * cr * cp - dp * sr
    A = inertia_model
    hx = A[0, 0] * wx + A[0, 1] * wy + A[0, 2] * wz
    hy = A[1, 0] * wx + A[1, 1] * wy + A[1, 2] * wz
    hz = A[2, 0] * wx + A[2, 1] * wy + A[2, 2] * wz
    tx = L * kF * (f1 - f3) - (wy * hz - wz * hy)
    ty = L * kF * (f2 - f0) - (wz * hx - wx * hz)
    tz = kM * (f0 - f1 + f2 - f3) - (wx * hy - wy * hx)
    ax = A[3, 0] * tx + A[3, 1] * ty + A[3, 2] * tz
    ay = A[4, 0] * tx + A[4, 1] * ty + A[4, 2] * tz
    az = A[5, 0] * tx + A[5, 1] * ty + A[5, 2] * tz
    # w = N(rpy) rpy', so rpy'' = N^-1 (alpha - N' rpy').
    ax += dy * dp * cp
    ay -= -dp * dr * sr + dy * dr * cr * cp - dy * dp * sr * sp
    az -= -dp * dr * cr - dy * dr * sr * cp - dy * dp * cr * sp
    ddy = (sr * ay + cr * az) / cp
    xdot[9] = ax + sp * ddy
    xdot[10] = cr * ay - sr * az
    xdot[11] = ddy
