"""Springs and dampers, on dofs and between bodies."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from sheldrake.common._kernels.generic import atan2, cos, sin, sqrt, tan, tanh
from sheldrake.common._kernels.vec import (
    add3,
    add6,
    compose,
    cross3,
    dot3,
    load6,
    neg3,
    read3,
    rotate,
    rotate_back,
    rotation_of_quaternion,
    scale3,
    store6,
    sub3,
    transpose,
)
from sheldrake.common.kernel import IntMatrix, Matrix, Vector, kernel
from sheldrake.common.record import Items, Record, integer, table
from sheldrake.multibody.tree._kernels.integrate import rpy_rate
from sheldrake.multibody.tree._kernels.kinematics import from_root, point_on, pose_of_frame, velocity_at
from sheldrake.multibody.tree._kernels.model import TreeModel, TreeWork


class DofSpring(Record):
    """A spring on one dof."""

    dof = integer("the dof")
    q = integer("its position")
    p = integer("where in p are stiffness and nominal position")


class Hinge(Record):
    """A door hinge on one dof."""

    dof = integer("the dof")
    q = integer("its position")
    p = integer(
        "where in p are spring constant, angle without torque, catch torque, catch width, dynamic and static friction "
        "torque, viscous friction, motion threshold"
    )


class Strut(Record):
    """A linear spring and damper between a point P of body A and a point Q of body B."""

    A = integer("row of body A")
    B = integer("row of body B")
    p = integer("where in p are p_AP (3), p_BQ (3), free length, stiffness, damping")


class Bushing(Record):
    """Between frame A on one body and frame C on another; frame -1 is the body frame."""

    A = integer("row of the body of A")
    frame_A = integer("a frame of the tree")
    C = integer("row of the body of C")
    frame_C = integer("a frame of the tree")
    p = integer("where in p are stiffness and damping of roll, pitch, yaw (3, 3) and of x, y, z (3, 3)")


@table
class ForceModel(NamedTuple):
    """Force elements other than gravity."""

    spring: Annotated[IntMatrix, Items("springs", DofSpring)]
    hinge: Annotated[IntMatrix, Items("hinges", Hinge)]
    strut: Annotated[IntMatrix, Items("struts", Strut)]
    bushing: Annotated[IntMatrix, Items("bushings", Bushing)]


@kernel
def add_dof_springs(force_model: ForceModel, p: Vector, q: Vector, tau: Vector) -> None:
    """Adds springs on dofs to tau, shape (nv,)."""
    for i in range(len(force_model.springs)):
        spring = force_model.springs[i]
        stretch = q[spring.q] - p[spring.p + 1]
        tau[spring.dof] -= p[spring.p] * stretch


@kernel
def doublet(x):
    """An odd pulse, about 0.77 high at 0.66; zero at 0 and far away."""
    s = tanh(x)
    return 2.0 * s * (1.0 - s * s)


@kernel
def hinge_torque(p, at, angle, rate):
    """Torque of a door hinge [N m]: spring, catch, and regularised friction."""
    torque = -p[at] * (angle - p[at + 1]) - p[at + 6] * rate
    if p[at + 3] > 0.0:
        half = 0.5 * p[at + 3]
        torque += p[at + 2] * doublet((angle - half) / half)
    if p[at + 7] > 0.0:
        x = rate / p[at + 7]
        torque -= p[at + 4] * tanh(x) + p[at + 5] * doublet(x)
    return torque


@kernel
def add_hinges(force_model: ForceModel, p: Vector, q: Vector, v: Vector, tau: Vector) -> None:
    """Adds door hinges to tau, shape (nv,)."""
    for i in range(len(force_model.hinges)):
        hinge = force_model.hinges[i]
        tau[hinge.dof] += hinge_torque(p, hinge.p, q[hinge.q], v[hinge.dof])


@kernel(outline=True)
def add_bushings(model: TreeModel, force_model: ForceModel, p: Vector, work: TreeWork, F: Matrix) -> None:
    """Adds bushings to F, spatial forces about `root`, shape (num_bodies, 6); needs velocities.

    Torques act on C at its origin, with components along the gimbal's axes of roll, pitch and yaw; the force acts at
    the point midway between the origins, with components along the axes of the frame halfway from A to C.
    """
    for i in range(len(force_model.bushings)):
        bushing = force_model.bushings[i]
        A, C, at = bushing.A, bushing.C, bushing.p
        R_WA, p_WA = pose_of_frame(model, p, work, A, bushing.frame_A)
        R_WC, p_WC = pose_of_frame(model, p, work, C, bushing.frame_C)
        w_WA, v_WCa = velocity_at(model, work, A, p_WC)
        w_WC, v_WCo = velocity_at(model, work, C, p_WC)
        R_AC = compose(transpose(R_WA), R_WC)
        w_AC = rotate_back(R_WA, sub3(w_WC, w_WA))
        p_AC = rotate_back(R_WA, sub3(p_WC, p_WA))
        v_AC = rotate_back(R_WA, sub3(v_WCo, v_WCa))
        angles = roll_pitch_yaw(R_AC)
        rates = rpy_rate(angles, w_AC)
        torque = (
            p[at] * angles[0] + p[at + 3] * rates[0],
            p[at + 1] * angles[1] + p[at + 4] * rates[1],
            p[at + 2] * angles[2] + p[at + 5] * rates[2],
        )
        t_C_W = rotate(R_WA, neg3(gimbal_torque(angles, torque)))
        R_AB = half_rotation(R_AC)
        x = rotate_back(R_AB, p_AC)
        xdot = rotate_back(R_AB, sub3(v_AC, cross3(scale3(w_AC, 0.5), p_AC)))
        f_B = (
            -p[at + 6] * x[0] - p[at + 9] * xdot[0],
            -p[at + 7] * x[1] - p[at + 10] * xdot[1],
            -p[at + 8] * x[2] - p[at + 11] * xdot[2],
        )
        f_C_W = rotate(R_WA, rotate(R_AB, f_B))
        middle = scale3(add3(p_WA, p_WC), 0.5)
        add_point_force(model, work, F, C, middle, f_C_W)
        add_point_force(model, work, F, A, middle, neg3(f_C_W))
        add_force(F, C, (t_C_W, scale3(t_C_W, 0.0)))
        add_force(F, A, (neg3(t_C_W), scale3(t_C_W, 0.0)))


@kernel
def roll_pitch_yaw(R):
    """Angles of Rz(yaw) Ry(pitch) Rx(roll)."""
    cos_pitch = sqrt(R[0] * R[0] + R[3] * R[3])
    return (atan2(R[7], R[8]), atan2(-R[6], cos_pitch), atan2(R[3], R[0]))


@kernel
def gimbal_torque(rpy, torque):
    """Torque with given components along the gimbal's axes: the transpose of `rpy_rate`."""
    c1, c2, s2 = cos(rpy[1]), cos(rpy[2]), sin(rpy[2])
    ahead = torque[0] / c1 + torque[2] * tan(rpy[1])
    return (c2 * ahead - s2 * torque[1], s2 * ahead + c2 * torque[1], torque[2])


@kernel
def half_rotation(R):
    """The rotation whose square is R, by less than 90 degrees."""
    w = 0.5 * sqrt(1.0 + R[0] + R[4] + R[8])
    s = 0.25 / w
    v = (s * (R[7] - R[5]), s * (R[2] - R[6]), s * (R[3] - R[1]))
    return rotation_of_quaternion((1.0 + w, v[0], v[1], v[2]))


@kernel
def add_struts(model: TreeModel, force_model: ForceModel, p: Vector, work: TreeWork, F: Matrix) -> None:
    """Adds springs between points to F, spatial forces about `root`, shape (num_bodies, 6); needs velocities."""
    for i in range(len(force_model.struts)):
        strut = force_model.struts[i]
        A, B, at = strut.A, strut.B, strut.p
        p_WP = point_on(work, A, read3(p, at))
        p_WQ = point_on(work, B, read3(p, at + 3))
        p_PQ = sub3(p_WQ, p_WP)
        length = sqrt(dot3(p_PQ, p_PQ))
        along = scale3(p_PQ, 1.0 / length)
        _, v_P = velocity_at(model, work, A, p_WP)
        _, v_Q = velocity_at(model, work, B, p_WQ)
        pull = p[at + 7] * (length - p[at + 6]) + p[at + 8] * dot3(sub3(v_Q, v_P), along)
        f_P = scale3(along, pull)
        add_point_force(model, work, F, A, p_WP, f_P)
        add_point_force(model, work, F, B, p_WQ, neg3(f_P))


@kernel
def hinge_energy(p, at, angle):
    """Energy of a door hinge's spring and catch [J], zero at zero."""
    energy = p[at] * (0.5 * angle - p[at + 1]) * angle
    if p[at + 3] > 0.0:
        half = 0.5 * p[at + 3]
        at_zero, s = tanh(1.0), tanh((angle - half) / half)
        energy += p[at + 2] * half * (at_zero * at_zero - s * s)
    return energy


@kernel
def add_potential_energy(force_model: ForceModel, p: Vector, work: TreeWork, q: Vector, energy: Vector) -> None:
    """Adds what springs, hinges and struts store to energy, shape (1,); needs poses."""
    for i in range(len(force_model.springs)):
        spring = force_model.springs[i]
        stretch = q[spring.q] - p[spring.p + 1]
        energy[0] += 0.5 * p[spring.p] * stretch * stretch
    for i in range(len(force_model.hinges)):
        hinge = force_model.hinges[i]
        energy[0] += hinge_energy(p, hinge.p, q[hinge.q])
    for i in range(len(force_model.struts)):
        strut = force_model.struts[i]
        at = strut.p
        p_PQ = sub3(point_on(work, strut.B, read3(p, at + 3)), point_on(work, strut.A, read3(p, at)))
        stretch = sqrt(dot3(p_PQ, p_PQ)) - p[at + 6]
        energy[0] += 0.5 * p[at + 7] * stretch * stretch


@kernel
def add_powers(
    model: TreeModel, force_model: ForceModel, p: Vector, work: TreeWork, q: Vector, v: Vector, power: Vector
) -> None:
    """Adds those of the conservative and of the dissipative forces of springs, hinges, struts; needs velocities."""
    for i in range(len(force_model.springs)):
        spring = force_model.springs[i]
        power[0] -= p[spring.p] * (q[spring.q] - p[spring.p + 1]) * v[spring.dof]
    for i in range(len(force_model.hinges)):
        hinge = force_model.hinges[i]
        angle, rate = q[hinge.q], v[hinge.dof]
        at_rest = hinge_torque(p, hinge.p, angle, 0.0 * rate)
        power[0] += at_rest * rate
        power[1] += (hinge_torque(p, hinge.p, angle, rate) - at_rest) * rate
    for i in range(len(force_model.struts)):
        strut = force_model.struts[i]
        at = strut.p
        p_WP, p_WQ = point_on(work, strut.A, read3(p, at)), point_on(work, strut.B, read3(p, at + 3))
        p_PQ = sub3(p_WQ, p_WP)
        length = sqrt(dot3(p_PQ, p_PQ))
        _, v_P = velocity_at(model, work, strut.A, p_WP)
        _, v_Q = velocity_at(model, work, strut.B, p_WQ)
        rate = dot3(p_PQ, sub3(v_Q, v_P)) / length
        power[0] -= p[at + 7] * (length - p[at + 6]) * rate
        power[1] -= p[at + 8] * rate * rate


@kernel
def clear(F):
    """No force on any body."""
    for b in range(F.shape[0]):
        store6(F, b, ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))


@kernel
def copy_rows6(F, G):
    """F becomes a copy of G: spatial forces by body."""
    for b in range(F.shape[0]):
        store6(F, b, load6(G, b))


@kernel
def add_force(F, b, F_B):
    """Adds to the spatial force on body b."""
    store6(F, b, add6(load6(F, b), F_B))


@kernel
def add_point_force(model: TreeModel, work: TreeWork, F: Matrix, b: int, p_WP, f_P) -> None:
    """Adds a force through p_WP to the spatial force on body b, about `root`."""
    add_force(F, b, (cross3(from_root(model, work, b, p_WP), f_P), f_P))


@kernel
def add_body_forces(model: TreeModel, work: TreeWork, F_Bo_W: Matrix, F: Matrix) -> None:
    """Adds spatial forces at the body origins, shape (num_bodies, 6), to F, which is about `root`."""
    for b in range(1, len(model.bodies)):
        t, f = load6(F_Bo_W, b)
        add_force(F, b, (add3(t, cross3(from_root(model, work, b, work[b].p_WB), f)), f))


@kernel
def add_at_body_origins(model: TreeModel, work: TreeWork, F_Bo_W: Matrix) -> None:
    """Adds `F`, which is about `root`, to spatial forces at the body origins, shape (num_bodies, 6)."""
    for b in range(1, len(model.bodies)):
        t, f = work[b].F
        add_force(F_Bo_W, b, (sub3(t, cross3(from_root(model, work, b, work[b].p_WB), f)), f))


def empty_force_model() -> ForceModel:
    """No force elements."""
    return ForceModel(*(np.zeros((0, record.SIZE), np.int64) for record in (DofSpring, Hinge, Strut, Bushing)))
