"""Propellers as a stage of a plant's step or derivatives: generalized forces of their thrusts and moments."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from sheldrake.common._kernels.vec import add3, rotate, scale3
from sheldrake.common.kernel import IntVector, Matrix, Vector, kernel
from sheldrake.common.record import Record, number, numbers, table
from sheldrake.multibody.plant._kernels.derivatives import DerivativeVectors
from sheldrake.multibody.plant._kernels.model import StepVectors
from sheldrake.multibody.tree._kernels.dynamics import project_forces
from sheldrake.multibody.tree._kernels.forces import add_force, add_point_force, clear
from sheldrake.multibody.tree._kernels.kinematics import position_kinematics
from sheldrake.multibody.tree._kernels.model import TreeModel, TreeWork


class PropellerNumbers(Record):
    """A propeller P on a body B."""

    p_BP = numbers(3, "origin", "m")
    z_B = numbers(3, "unit vector of its axis")
    thrust_ratio = number("force along z per command", "N")
    moment_ratio = number("moment about z per command", "N m")


@table
class Propellers(NamedTuple):
    """Propellers on the bodies of a plant."""

    number: Annotated[Matrix, PropellerNumbers]
    body: IntVector  # rows


@kernel
def put_propeller_forces(x, p, tree, tree_model, propellers, command, tau):
    """Generalized forces of propellers, for positions at the beginning of x."""
    position_kinematics(tree_model, p, tree, x)
    clear(tree.F)
    for i in range(command.shape[0]):
        propeller, b = propellers[i], propellers.body[i]
        R_WB = tree[b].R_WB
        z_W = rotate(R_WB, propeller.z_B)
        p_WP = add3(tree[b].p_WB, rotate(R_WB, propeller.p_BP))
        moment = scale3(z_W, command[i] * propeller.moment_ratio)
        add_point_force(tree_model, tree, tree.F, b, p_WP, scale3(z_W, command[i] * propeller.thrust_ratio))
        add_force(tree.F, b, (moment, (0.0, 0.0, 0.0)))
    project_forces(tree_model, tree, tau)


@kernel(top=True, short_loops=True)
def propellers_of_step(
    xd: Vector,
    p: Vector,
    tree: TreeWork,
    tree_model: TreeModel,
    propeller_model: Propellers,
    command: Vector,
    step: StepVectors,
) -> None:
    """The propellers' forces among the applied ones of a step."""
    put_propeller_forces(xd, p, tree, tree_model, propeller_model, command, step.applied_force)


@kernel(top=True, short_loops=True)
def propellers_of_derivatives(
    xc: Vector,
    p: Vector,
    tree: TreeWork,
    tree_model: TreeModel,
    propeller_model: Propellers,
    command: Vector,
    flow: DerivativeVectors,
) -> None:
    """The propellers' forces among the applied ones of derivatives."""
    put_propeller_forces(xc, p, tree, tree_model, propeller_model, command, flow.applied_force)
