"""Generalized forces at the start of the step: gravity, damping, springs, inputs, TAMSI's limits; locked joints."""

import math

from sheldrake.common._kernels.generic import clip
from sheldrake.common.kernel import kernel
from sheldrake.multibody.tree._kernels.dynamics import project_forces
from sheldrake.multibody.tree._kernels.forces import add_bushings, add_dof_springs, add_hinges, add_struts, clear

INFINITY = math.inf

# ---- forces


@kernel
def element(u, port, i):
    """An element of an input port, 0 where nothing is connected."""
    if port >= 0:
        if u[port].shape[0] > 0:
            return u[port][i]
    return 0.0


@kernel
def put_passive_forces(tree_model, p, bias, v, force):
    """force = -bias - D v: gravity, Coriolis and gyroscopic terms, joint damping [N or N m]."""
    for k in range(force.shape[0]):
        force[k] = -bias[k] - p[tree_model.dofs[k].damping] * v[k]


@kernel
def add_applied_forces(plant_model, u, applied_force, force):
    """Adds the generalized forces of input ports, and those that applied spatial forces amount to."""
    for k in range(force.shape[0]):
        force[k] += applied_force[k]
    for i in range(plant_model.force_port.shape[0]):
        port = plant_model.force_port[i]
        for k in range(u[port].shape[0]):
            force[k] += u[port][k]


@kernel
def add_element_forces(tree_model, force_model, p, tree, q, v, tau_work, force):
    """Adds springs and hinges on dofs, struts and bushings between bodies; tau_work is scratch, shape (nv,)."""
    add_dof_springs(force_model, p, q, force)
    add_hinges(force_model, p, q, v, force)
    if len(force_model.struts) + len(force_model.bushings) > 0:
        clear(tree.F)
        add_struts(tree_model, force_model, p, tree, tree.F)
        add_bushings(tree_model, force_model, p, tree, tree.F)
        project_forces(tree_model, tree, tau_work)
        for k in range(force.shape[0]):
            force[k] += tau_work[k]


@kernel
def commanded_effort(plant_model, u, i):
    """What the inputs ask of actuator i [N m or N]."""
    actuator = plant_model.actuators[i]
    effort = element(u, actuator.port, actuator.element)
    return effort + element(u, actuator.instance_port, actuator.instance_element)


@kernel
def within_limit(plant_model, i, effort):
    """An effort of actuator i, clamped to its limit [N m or N]."""
    limit = plant_model.gains[i].effort_limit
    if limit < INFINITY:
        return clip(effort, -limit, limit)
    return effort


@kernel
def has_desired_state(plant_model, u, i):
    """Whether actuator i is under PD control and told where to go; an input port without a value holds NaN."""
    actuator = plant_model.actuators[i]
    port = actuator.desired_port
    if port >= 0:
        if u[port].shape[0] > 0:
            desired = u[port][actuator.desired_q]
            return desired == desired
    return False


@kernel
def gains_of(plant_model, p, i):
    """Proportional and derivative gain of actuator i."""
    actuator, gain = plant_model.actuators[i], plant_model.gains[i]
    if actuator.gains >= 0:
        return gain.p * p[actuator.gains], gain.d * p[actuator.gains + 1]
    return gain.p, gain.d


@kernel
def controlled_effort(plant_model, i, q, v, p, u):
    """Effort of actuator i, whose dof is at q and moves at v, with PD control, clamped to its limit [N m or N]."""
    actuator = plant_model.actuators[i]
    effort = commanded_effort(plant_model, u, i)
    if has_desired_state(plant_model, u, i):
        desired = u[actuator.desired_port]
        kp, kd = gains_of(plant_model, p, i)
        effort += kp * (desired[actuator.desired_q] - q)
        effort += kd * (desired[actuator.desired_v] - v)
    return within_limit(plant_model, i, effort)


@kernel
def add_controlled_actuation(plant_model, q, v, p, u, force, net_actuation):
    """Adds actuation, PD control at q and v included; fills net_actuation [N m or N]."""
    for i in range(len(plant_model.actuators)):
        actuator = plant_model.actuators[i]
        effort = controlled_effort(plant_model, i, q[actuator.q], v[actuator.dof], p, u)
        net_actuation[i] = effort
        force[actuator.dof] += effort


@kernel
def add_actuation(plant_model, u, force, net_actuation, pd):
    """Adds actuation clamped to the effort limits; fills net_actuation [N m or N]; whether no input holds NaN.

    With `pd`, an actuator that has gains adds nothing here: the solver does. Without a desired state it does nothing at
    all; its net actuation is reported as if it did, as Drake reports it.
    """
    unknown = 0
    for i in range(len(plant_model.actuators)):
        actuator = plant_model.actuators[i]
        effort = commanded_effort(plant_model, u, i)
        if effort != effort:
            unknown = 1
        effort = within_limit(plant_model, i, effort)
        net_actuation[i] = effort
        if not pd or actuator.desired_port < 0:
            force[actuator.dof] += effort
    return unknown == 0


@kernel
def add_limit_penalties(plant_model, q, v, force):
    """TAMSI's joint limits: spring and damper beyond the limit, pushing back only [N or N m]."""
    for i in range(len(plant_model.limits)):
        limit, bound = plant_model.limits[i], plant_model.bounds[i]
        dof, k, d = limit.dof, bound.stiffness, bound.damping
        above = q[limit.q] - bound.upper
        below = q[limit.q] - bound.lower
        if above > 0.0:
            push = -k * above - d * v[dof]
            if push < 0.0:
                force[dof] += push
        elif below < 0.0:
            push = -k * below - d * v[dof]
            if push > 0.0:
                force[dof] += push


# ---- locked joints
#
# Locked joints: their dofs are taken out of the step by cutting them off from all others.
#
# A locked dof has no force, a momentum of its own and no part in any constraint, so its velocity stays zero. Who calls
# these asks first whether any is (`any_locked`): mostly none is.


@kernel
def is_locked(plant_model, p, dof):
    """Whether the joint of a dof is locked."""
    if plant_model.lock.shape[0] > 0:
        return p[plant_model.lock[dof]] != 0.0
    return False


@kernel
def any_locked(plant_model, p):
    found = False
    for k in range(plant_model.lock.shape[0]):
        if is_locked(plant_model, p, k):
            found = True
    return found


@kernel
def lock_motion(plant_model, p, v, force):
    """No velocity and no force on locked dofs."""
    for k in range(plant_model.lock.shape[0]):
        if is_locked(plant_model, p, k):
            v[k] = 0.0
            force[k] = 0.0


@kernel
def lock_mass_matrix(tree_model, plant_model, p, M):
    """Rows and columns of locked dofs become those of the unit matrix."""
    for k in range(len(tree_model.dofs)):
        row = tree_model.dofs[k].row
        locked = is_locked(plant_model, p, k)
        if locked:
            M[row + tree_model.dofs[k].depth] = 1.0
        i = tree_model.dofs[k].parent
        while i >= 0:
            if locked or is_locked(plant_model, p, i):
                M[row + tree_model.dofs[i].depth] = 0.0
            i = tree_model.dofs[i].parent


@kernel
def lock_contacts(plant_model, p, problem, contacts):
    """Contacts do not move locked dofs."""
    for c in range(problem.num_contacts):
        contact = contacts[c]
        for i in range(contact.width):
            if is_locked(plant_model, p, contact.dofs[i]):
                for r in range(3):
                    contact.J[r, i] = 0.0


@kernel
def lock_rows(plant_model, p, problem, rows):
    """Rows do not move locked dofs; a row that moves nothing else pulls at nothing."""
    for r in range(problem.num_rows):
        row = rows[r]
        for i in range(row.width):
            if is_locked(plant_model, p, row.dofs[i]):
                row.J[i] = 0.0
