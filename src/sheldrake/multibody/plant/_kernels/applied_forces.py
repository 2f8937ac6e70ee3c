"""Forces from outside as stages of a plant's step or derivatives: begun, added up on bodies, made generalized forces.

Between the first and the last stage are those of the systems that feed the plant: propellers, wings, springs.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from sheldrake.common._kernels.generic import is_positive, sqrt
from sheldrake.common._kernels.vec import add3, dot3, rotate, scale3, sub3
from sheldrake.common.kernel import IntVector, Matrix, Vector, kernel
from sheldrake.common.record import Record, number, numbers, table
from sheldrake.multibody.plant._kernels.derivatives import DerivativeVectors
from sheldrake.multibody.plant._kernels.model import StepVectors
from sheldrake.multibody.tree._kernels.dynamics import project_forces
from sheldrake.multibody.tree._kernels.forces import add_force, add_point_force, clear, copy_rows6
from sheldrake.multibody.tree._kernels.kinematics import position_kinematics, velocity_at, velocity_kinematics
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


class WingNumbers(Record):
    """A wing on a body B."""

    p_BW = numbers(3, "aerodynamic centre", "m")
    x_B = numbers(3, "unit vector along the chord")
    z_B = numbers(3, "unit vector up")
    area = number("of its surface", "m²")


@table
class Wings(NamedTuple):
    """One wing on a body of a plant."""

    number: Annotated[Matrix, WingNumbers]
    body: IntVector  # its row


@kernel
def begin_forces(x, p, tree_model, tree, v):
    """Where bodies are and how they move, for a state x of positions and velocities; no force on any."""
    nq = x.shape[0] - v.shape[0]
    for k in range(v.shape[0]):
        v[k] = x[nq + k]
    position_kinematics(tree_model, p, tree, x)
    velocity_kinematics(tree_model, p, tree, x, v)
    clear(tree.F)


@kernel(top=True, short_loops=True)
def begin_forces_of_step(xd: Vector, p: Vector, tree_model: TreeModel, tree: TreeWork, step: StepVectors) -> None:
    """Before forces are added up in a step."""
    begin_forces(xd, p, tree_model, tree, step.v)


@kernel(top=True, short_loops=True)
def begin_forces_of_derivatives(
    xc: Vector, p: Vector, tree_model: TreeModel, tree: TreeWork, flow: DerivativeVectors
) -> None:
    """Before forces are added up in derivatives."""
    begin_forces(xc, p, tree_model, tree, flow.v)


@kernel(top=True, short_loops=True)
def end_forces_of_step(tree_model: TreeModel, tree: TreeWork, step: StepVectors) -> None:
    """What was added up, among the applied forces of a step."""
    copy_rows6(step.body_force, tree.F)
    project_forces(tree_model, tree, step.applied_force)


@kernel(top=True, short_loops=True)
def end_forces_of_derivatives(tree_model: TreeModel, tree: TreeWork, flow: DerivativeVectors) -> None:
    """What was added up, among the applied forces of derivatives."""
    project_forces(tree_model, tree, flow.applied_force)


@kernel(top=True, short_loops=True)
def add_propeller_forces(tree_model: TreeModel, propeller_model: Propellers, command: Vector, tree: TreeWork) -> None:
    """Thrusts and moments of propellers on their bodies."""
    for i in range(command.shape[0]):
        propeller, b = propeller_model[i], propeller_model.body[i]
        R_WB = tree[b].R_WB
        z_W = rotate(R_WB, propeller.z_B)
        p_WP = add3(tree[b].p_WB, rotate(R_WB, propeller.p_BP))
        moment = scale3(z_W, command[i] * propeller.moment_ratio)
        add_point_force(tree_model, tree, tree.F, b, p_WP, scale3(z_W, command[i] * propeller.thrust_ratio))
        add_force(tree.F, b, (moment, (0.0, 0.0, 0.0)))


@kernel(top=True, short_loops=True)
def add_wing_force(tree_model: TreeModel, wing_model: Wings, wind: Vector, density: Vector, tree: TreeWork) -> None:
    """Lift and drag of a wing on its body.

    With its coefficients both add up to a force along z: 2 sin a, times the dynamic pressure. As Drake has it, the wing
    moves like the body's origin: how the body turns makes no wind.
    """
    wing, b = wing_model[0], wing_model.body[0]
    R_WB, p_WB = tree[b].X_WB
    _, v_WBo = velocity_at(tree_model, tree, b, p_WB)
    x_W, z_W = rotate(R_WB, wing.x_B), rotate(R_WB, wing.z_B)
    air = sub3((wind[0], wind[1], wind[2]), v_WBo)
    forward, up = dot3(air, x_W), dot3(air, z_W)
    squared = forward * forward + up * up
    speed = sqrt(squared) if is_positive(squared) else 0.0 * squared
    force = scale3(z_W, density[0] * wing.area * speed * up)
    add_point_force(tree_model, tree, tree.F, b, add3(p_WB, rotate(R_WB, wing.p_BW)), force)
