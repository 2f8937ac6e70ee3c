"""What the discrete step works on beside tree and geometry: constants of the plant, and the work of a context."""

from typing import Annotated, NamedTuple

from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector
from sheldrake.common.record import Items, Record, integer, number, numbers, table
from sheldrake.geometry._kernels.hydro_model import HydroTable
from sheldrake.geometry._kernels.model import ContactTable
from sheldrake.geometry._kernels.spatial_hash import Cells
from sheldrake.multibody.contact_solvers._kernels.problem import Contacts, Factor, Problem, Rows
from sheldrake.multibody.tree._kernels.model import TreeWork

# Kinds of constraints.
COUPLER = 0
DISTANCE = 1
BALL = 2
WELD = 3
TENDON = 4


class Actuator(Record):
    """Where an actuator acts, and where its input comes from; ports are vector inputs, -1 for none."""

    dof = integer("the dof")
    q = integer("its position; only needed for PD control")
    port = integer("port with one element an actuator of the plant")
    element = integer("which one")
    instance_port = integer("the same for the port of the actuator's model instance")
    instance_element = integer("which one")
    desired_port = integer("desired state of the model instance; -1 when the actuator has no PD gains")
    desired_q = integer("element of the desired position")
    desired_v = integer("element of the desired velocity")
    gains = integer("where in p is what its gains are multiplied with, two numbers; -1 for nothing")


class Gain(Record):
    """Of an actuator."""

    effort_limit = number("largest effort, may be infinite", "N m or N")
    p = number("proportional gain")
    d = number("derivative gain")


class Belt(Record):
    """A body whose surface runs around an axis."""

    body = integer("row of the body")


class BeltAxis(Record):
    """Of a body whose surface runs."""

    axis_B = numbers(3, "unit vector: the surface runs along axis x outward normal")


class Limit(Record):
    """The joint of one dof that has a position limit."""

    dof = integer("the dof")
    q = integer("its position")


class Bound(Record):
    """Of a position limit."""

    lower = number("least position", "m or rad")
    upper = number("largest position", "m or rad")
    stiffness = number("of TAMSI's penalty", "N/m or N m/rad")
    damping = number("of TAMSI's penalty", "N s/m or N m s/rad")


class Constraint(Record):
    """A holonomic constraint.

    Its numbers in p: of a coupler gear ratio and offset; of a distance p_AP, p_BQ, length, stiffness (may be infinite),
    damping; of a ball p_AP, p_BQ; of a weld X_AP, X_BQ, each nine numbers of R, row-major, then p; of a tendon offset,
    lower, upper, stiffness, damping, a coefficient for each joint.
    """

    kind = integer("COUPLER, DISTANCE ...")
    A = integer("dof of a coupler, first joint of a tendon, else body row")
    B = integer("the same; of a tendon the joint after its last")
    q_A = integer("position of a coupler's dof")
    q_B = integer("position of a coupler's dof")
    p = integer("where in p its numbers start")
    active = integer("where in p a positive number says that it acts")


class TendonJoint(Record):
    """A joint that a tendon lies on; those of a tendon are together and in the order of dofs."""

    dof = integer("the dof")
    q = integer("its position")
    coefficient = integer("its number among the tendon's coefficients in p")


@table
class PlantModel(NamedTuple):
    """Constants of the step that are neither tree nor geometry nor solver.

    Attributes:
        force_port: Vector input ports that hold generalized forces [N or N m], shape (num_force_ports,).
        friction: Dofs with dry friction, shape (num_frictions,).
        friction_effort: Its largest effort on each [N m or N], shape (num_frictions,).
        lock: Where in p the lock flag of each dof's joint is, shape (nv,); empty when no joint can be locked.
    """

    actuator: Annotated[IntMatrix, Items("actuators", Actuator)]
    gain: Annotated[Matrix, Items("gains", Gain)]
    limit: Annotated[IntMatrix, Items("limits", Limit)]
    bound: Annotated[Matrix, Items("bounds", Bound)]
    force_port: IntVector
    constraint: Annotated[IntMatrix, Items("constraints", Constraint)]
    tendon: Annotated[IntMatrix, Items("tendon_joints", TendonJoint)]
    friction: IntVector
    friction_effort: Vector
    lock: IntVector
    belt: Annotated[IntMatrix, Items("belts", Belt)]
    belt_axis: Annotated[Matrix, Items("belt_axes", BeltAxis)]


class StepVectors(NamedTuple):
    """What stages of the step hand on, and ports report.

    Attributes:
        v: velocities at the step's start, shape (nv,).
        v_next: velocities at its end, shape (nv,).
        force: generalized forces without constraints [N or N m], shape (nv,).
        net_actuation: [N or N m], shape (num_actuators,).
        applied_force: generalized forces that applied spatial forces amount to, shape (nv,).
        surface_speed: of the plant's belts [m/s], shape (num_belts,).
        surface_turn: by body, what the surface runs at is the cross product of this [m/s] with the outward normal;
            shape (num_bodies, 3), empty where no surface runs.
        body_force: applied spatial forces about `root` [N m, N], shape (num_bodies, 6), empty where none are applied.
    """

    v: Vector
    v_next: Vector
    force: Vector
    net_actuation: Vector
    applied_force: Vector
    surface_speed: Vector
    surface_turn: Matrix
    body_force: Matrix


class StepWork(NamedTuple):
    """Scratch of the step: the work of every stage, and what the last step left for ports to report."""

    tree: TreeWork
    table: ContactTable
    problem: Problem
    contacts: Contacts
    rows: Rows
    factor: Factor
    step: StepVectors
    surfaces: HydroTable
    cells: Cells
