"""A spring from a body to the mouse, among the stages that add up the forces on a plant's bodies."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from sheldrake.common._kernels.vec import add3, rotate, scale3, sub3
from sheldrake.common.kernel import IntVector, Matrix, kernel
from sheldrake.common.record import Record, number, numbers, table
from sheldrake.multibody.tree._kernels.forces import add_point_force
from sheldrake.multibody.tree._kernels.kinematics import velocity_at
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


@kernel(top=True, short_loops=True)
def add_spring_force(tree_model: TreeModel, hold_model: Hold, tree: TreeWork) -> None:
    """The spring's force on the body that is held."""
    b = hold_model.body[0]
    if b != 0:
        spring = hold_model[0]
        p_WQ = add3(tree[b].p_WB, rotate(tree[b].R_WB, spring.p_BQ))
        _, v_WQ = velocity_at(tree_model, tree, b, p_WQ)
        pull = scale3(sub3(spring.p_WT, p_WQ), spring.stiffness)
        add_point_force(tree_model, tree, tree.F, b, p_WQ, sub3(pull, scale3(v_WQ, spring.damping)))
