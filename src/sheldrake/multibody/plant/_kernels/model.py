"""What the discrete step works on beside tree and geometry: constants of the plant, and the work of a context."""

from typing import NamedTuple

import numpy as np

from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector
from sheldrake.geometry._kernels.cells import Cells
from sheldrake.geometry._kernels.hydro_model import HydroTable
from sheldrake.geometry._kernels.model import ContactTable
from sheldrake.multibody.contact_solvers._kernels.problem import Contacts, Factor, Problem, Rows
from sheldrake.multibody.tree._kernels.model import TreeWork

# PlantModel.actuator
ACTUATOR_DOF = np.int64(0)
ACTUATOR_Q = np.int64(1)  # position of the dof; only needed for PD control
ACTUATOR_PORT = np.int64(2)  # vector input port with one element an actuator of the plant, -1 for none
ACTUATOR_ELEMENT = np.int64(3)
INSTANCE_PORT = np.int64(4)  # the same for the port of the actuator's model instance
INSTANCE_ELEMENT = np.int64(5)
DESIRED_PORT = np.int64(6)  # desired state of the model instance; -1 when the actuator has no PD gains
DESIRED_Q = np.int64(7)  # element of the desired position
DESIRED_V = np.int64(8)  # element of the desired velocity
NUM_ACTUATOR_COLUMNS = 9

# PlantModel.gain
EFFORT_LIMIT = np.int64(0)  # [N m or N], may be infinite
GAIN_P = np.int64(1)
GAIN_D = np.int64(2)
NUM_GAIN_COLUMNS = 3

# PlantModel.limit
LIMIT_DOF = np.int64(0)
LIMIT_Q = np.int64(1)
NUM_LIMIT_COLUMNS = 2

# PlantModel.tendon
TENDON_DOF = np.int64(0)
TENDON_Q = np.int64(1)
TENDON_COEFFICIENT = np.int64(2)  # its number among the tendon's coefficients in p
NUM_TENDON_COLUMNS = 3

# PlantModel.bound
LOWER = np.int64(0)  # [m or rad]
UPPER = np.int64(1)
LIMIT_STIFFNESS = np.int64(2)  # of TAMSI's penalty [N/m or N m/rad]
LIMIT_DAMPING = np.int64(3)  # of TAMSI's penalty
NUM_BOUND_COLUMNS = 4

# PlantModel.constraint
CONSTRAINT_KIND = np.int64(0)
CONSTRAINT_A = np.int64(1)  # dof of a coupler, first row of a tendon, else body row
CONSTRAINT_B = np.int64(2)  # of a tendon: the row after its last
CONSTRAINT_Q_A = np.int64(3)  # position of a coupler's dof
CONSTRAINT_Q_B = np.int64(4)
CONSTRAINT_P = np.int64(5)  # where in p its numbers start
CONSTRAINT_ACTIVE = np.int64(6)  # where in p a positive number says that it acts
NUM_CONSTRAINT_COLUMNS = 7

# Kinds of constraints, and their numbers in p
COUPLER = np.int64(0)  # gear ratio, offset
DISTANCE = np.int64(1)  # p_AP, p_BQ, length, stiffness (may be infinite), damping
BALL = np.int64(2)  # p_AP, p_BQ
TENDON = np.int64(4)  # offset, lower, upper, stiffness, damping, a coefficient for each joint
WELD = np.int64(3)  # X_AP, X_BQ: nine numbers of R row-major, then p, each


class PlantModel(NamedTuple):
    """Constants of the step that are neither tree nor geometry nor solver.

    Attributes:
        actuator: Where each actuator acts and where its input comes from, shape (num_actuators, 9).
        gain: Effort limit and PD gains of each actuator, shape (num_actuators, 3).
        limit: Dof and position of each one-dof joint with a position limit, shape (num_limits, 2).
        bound: Lower and upper position limit and TAMSI's penalty, shape (num_limits, 4).
        force_port: Vector input ports that hold generalized forces [N or N m], shape (num_force_ports,).
        constraint: Holonomic constraints, shape (num_constraints, 7).
        tendon: Joints that tendons lie on, those of a tendon together and in the order of dofs, shape (n, 3).
        friction: Dofs with dry friction, shape (num_frictions,).
        friction_effort: Its largest effort on each [N m or N], shape (num_frictions,).
        lock: Where in p the lock flag of each dof's joint is, shape (nv,); empty when no joint can be locked.
    """

    actuator: IntMatrix
    gain: Matrix
    limit: IntMatrix
    bound: Matrix
    force_port: IntVector
    constraint: IntMatrix
    tendon: IntMatrix
    friction: IntVector
    friction_effort: Vector
    lock: IntVector


class StepVectors(NamedTuple):
    """What stages of the step hand on, and ports report.

    Attributes:
        v: velocities at the step's start, shape (nv,).
        v_next: velocities at its end, shape (nv,).
        force: generalized forces without constraints [N or N m], shape (nv,).
        net_actuation: [N or N m], shape (num_actuators,).
        applied_force: generalized forces that applied spatial forces amount to, shape (nv,).
    """

    v: Vector
    v_next: Vector
    force: Vector
    net_actuation: Vector
    applied_force: Vector


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
