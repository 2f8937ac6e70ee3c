"""Generalized forces of a controller's own model of a plant, whose parameters are constant."""

from __future__ import annotations

from typing import NamedTuple

from sheldrake.common.kernel import Matrix, Vector, Vectors, kernel
from sheldrake.multibody.tree._kernels.dynamics import body_inertias
from sheldrake.multibody.tree._kernels.forces import ForceModel
from sheldrake.multibody.tree._kernels.kinematics import position_kinematics, velocity_kinematics
from sheldrake.multibody.tree._kernels.model import TreeModel, TreeWork
from sheldrake.multibody.tree._kernels.queries import calc_element_forces, calc_gravity, calc_inverse_dynamics


class Motion(NamedTuple):
    """Of the model, in a context of the controller.

    v: velocities, shape (nv,).
    vdot: accelerations, shape (nv,).
    force: generalized forces of force elements, shape (nv,).
    F_Bo_W: their spatial forces at the body origins, by row, shape (num_bodies, 6).
    A_WB: work, shape (num_bodies, 6).
    """

    v: Vector
    vdot: Vector
    force: Vector
    F_Bo_W: Matrix
    A_WB: Matrix


class Work(NamedTuple):
    """Scratch of a controller."""

    tree: TreeWork
    motion: Motion


class Stiffness(NamedTuple):
    """Of a controller that makes joints springs.

    kp, kd: stiffness and damping, shape (n,).
    to_actuators: actuation from generalized forces, shape (num_actuators, n).
    """

    kp: Vector
    kd: Vector
    to_actuators: Matrix


@kernel
def place(tree_model, p_model, tree, x):
    """Poses and inertias at the positions of a state x."""
    position_kinematics(tree_model, p_model, tree, x)
    body_inertias(tree_model, p_model, tree)


@kernel
def element_forces(tree_model, force_model, p_model, x, tree, motion):
    """Velocities of a state x, and the forces of all force elements there."""
    v, nq = motion.v, x.shape[0] - motion.v.shape[0]
    for k in range(v.shape[0]):
        v[k] = x[nq + k]
    velocity_kinematics(tree_model, p_model, tree, x, v)
    calc_element_forces(tree_model, force_model, p_model, tree, x, v, motion.F_Bo_W, motion.force)
    for k in range(v.shape[0]):
        motion.force[k] -= p_model[tree_model.dofs[k].damping] * v[k]


@kernel(top=True, short_loops=True)
def force_for_acceleration(
    tree_model: TreeModel,
    force_model: ForceModel,
    p_model: Vector,
    u: Vectors,
    tree: TreeWork,
    motion: Motion,
    tau: Vector,
) -> None:
    """Inverse dynamics; the inputs are the state and desired accelerations."""
    place(tree_model, p_model, tree, u[0])
    element_forces(tree_model, force_model, p_model, u[0], tree, motion)
    calc_inverse_dynamics(tree_model, p_model, tree, u[1], motion.F_Bo_W, motion.force, motion.A_WB, tau)


@kernel(top=True, short_loops=True)
def force_against_gravity(tree_model: TreeModel, p_model: Vector, u: Vectors, tree: TreeWork, tau: Vector) -> None:
    """What holds the plant against gravity; the input is the state."""
    place(tree_model, p_model, tree, u[0])
    calc_gravity(tree_model, tree, tau)
    for k in range(tau.shape[0]):
        tau[k] = -tau[k]


@kernel(top=True, short_loops=True)
def actuation_of_springs(
    tree_model: TreeModel,
    force_model: ForceModel,
    p_model: Vector,
    stiffness_model: Stiffness,
    u: Vectors,
    tree: TreeWork,
    motion: Motion,
    y: Vector,
) -> None:
    """Springs and dampers about a desired state; gravity and force elements compensated, Coriolis forces not."""
    x, desired = u[0], u[1]
    place(tree_model, p_model, tree, x)
    element_forces(tree_model, force_model, p_model, x, tree, motion)
    n = motion.v.shape[0]
    for k in range(n):
        motion.v[k] = 0.0
        motion.vdot[k] = 0.0
    velocity_kinematics(tree_model, p_model, tree, x, motion.v)
    calc_inverse_dynamics(tree_model, p_model, tree, motion.vdot, motion.F_Bo_W, motion.force, motion.A_WB, motion.v)
    for k in range(n):
        motion.v[k] += stiffness_model.kp[k] * (desired[k] - x[k])
        motion.v[k] += stiffness_model.kd[k] * (desired[n + k] - x[n + k])
    for i in range(y.shape[0]):
        y[i] = 0.0
        for k in range(n):
            y[i] += stiffness_model.to_actuators[i, k] * motion.v[k]
