"""A spring from a body to the mouse, as a stage of a plant's step or derivatives."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from sheldrake.common._kernels.vec import add3, rotate, scale3, sub3
from sheldrake.common.kernel import IntVector, Matrix, Vector, kernel
from sheldrake.common.record import Record, number, numbers, table
from sheldrake.multibody.plant._kernels.derivatives import DerivativeVectors
from sheldrake.multibody.plant._kernels.model import StepVectors
from sheldrake.multibody.tree._kernels.dynamics import project_forces
from sheldrake.multibody.tree._kernels.forces import add_point_force, clear
from sheldrake.multibody.tree._kernels.kinematics import position_kinematics, velocity_at, velocity_kinematics
from sheldrake.multibody.tree._kernels.model import TreeModel, TreeWork


class SpringNumbers(Record):
    """A spring and a damper from a point Q of a body B to a point T of the world."""

    p_BQ = numbers(3, "where it holds the body", "m")
    p_WT = numbers(3, "where it pulls to", "m")
    stiffness = number("force per length", "N/m")
    damping = number("force per speed of Q", "N s/m")


@table
class Hold(NamedTuple):
    """What the mouse holds."""

    spring: Annotated[Matrix, SpringNumbers]  # one
    body: IntVector  # row of the body, 0 (the world) while nothing is held


@kernel
def put_spring_force(x, p, tree, tree_model, hold, v, tau):
    """Generalized forces of the spring, for positions at the beginning of x and velocities at its end."""
    b = hold.body[0]
    if b == 0:
        for k in range(tau.shape[0]):
            tau[k] = 0.0
    else:
        nq = x.shape[0] - v.shape[0]
        for k in range(v.shape[0]):
            v[k] = x[nq + k]
        position_kinematics(tree_model, p, tree, x)
        velocity_kinematics(tree_model, p, tree, x, v)
        spring = hold[0]
        p_WQ = add3(tree[b].p_WB, rotate(tree[b].R_WB, spring.p_BQ))
        _, v_WQ = velocity_at(tree_model, tree, b, p_WQ)
        pull = scale3(sub3(spring.p_WT, p_WQ), spring.stiffness)
        clear(tree.F)
        add_point_force(tree_model, tree, tree.F, b, p_WQ, sub3(pull, scale3(v_WQ, spring.damping)))
        project_forces(tree_model, tree, tau)


@kernel(top=True, short_loops=True)
def mouse_spring_of_step(
    xd: Vector, p: Vector, tree: TreeWork, tree_model: TreeModel, hold_model: Hold, step: StepVectors
) -> None:
    """The spring's force among the applied ones of a step."""
    put_spring_force(xd, p, tree, tree_model, hold_model, step.v, step.applied_force)


@kernel(top=True, short_loops=True)
def mouse_spring_of_derivatives(
    xc: Vector, p: Vector, tree: TreeWork, tree_model: TreeModel, hold_model: Hold, flow: DerivativeVectors
) -> None:
    """The spring's force among the applied ones of derivatives."""
    put_spring_force(xc, p, tree, tree_model, hold_model, flow.v, flow.applied_force)
