"""Generalized forces at the start of the step: bias and gravity, joint damping, springs, inputs, TAMSI's limits."""

from sheldrake.common.kernel import kernel
from sheldrake.multibody.plant._kernels.model import (
    ACTUATOR_DOF,
    ACTUATOR_ELEMENT,
    ACTUATOR_PORT,
    DESIRED_PORT,
    EFFORT_LIMIT,
    INSTANCE_ELEMENT,
    INSTANCE_PORT,
    LIMIT_DAMPING,
    LIMIT_DOF,
    LIMIT_Q,
    LIMIT_STIFFNESS,
    LOWER,
    UPPER,
)
from sheldrake.multibody.tree._kernels.dynamics import project_forces
from sheldrake.multibody.tree._kernels.forces import (
    add_bushings,
    add_dof_springs,
    add_hinges,
    add_struts,
    has_body_forces,
)
from sheldrake.multibody.tree._kernels.model import DAMPING


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
        force[k] = -bias[k] - p[tree_model.dof[k, DAMPING]] * v[k]


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
    if has_body_forces(force_model):
        for body in range(tree.F.shape[0]):
            for c in range(6):
                tree.F[body, c] = 0.0
        add_struts(tree_model, force_model, p, tree, tree.F)
        add_bushings(tree_model, force_model, p, tree, tree.F)
        project_forces(tree_model, tree, tau_work)
        for k in range(force.shape[0]):
            force[k] += tau_work[k]


@kernel
def commanded_effort(plant_model, u, i):
    """What the inputs ask of actuator i [N m or N]."""
    effort = element(u, plant_model.actuator[i, ACTUATOR_PORT], plant_model.actuator[i, ACTUATOR_ELEMENT])
    return effort + element(u, plant_model.actuator[i, INSTANCE_PORT], plant_model.actuator[i, INSTANCE_ELEMENT])


@kernel
def add_actuation(plant_model, u, force, net_actuation, pd):
    """Adds actuation clamped to the effort limits; fills net_actuation [N m or N].

    With `pd`, an actuator that has gains adds nothing here: the solver does. Without a desired state it does nothing at
    all; its net actuation is reported as if it did, as Drake reports it.
    """
    for i in range(plant_model.actuator.shape[0]):
        effort = commanded_effort(plant_model, u, i)
        limit = plant_model.gain[i, EFFORT_LIMIT]
        if effort > limit:
            effort = limit
        if effort < -limit:
            effort = -limit
        net_actuation[i] = effort
        if not pd or plant_model.actuator[i, DESIRED_PORT] < 0:
            force[plant_model.actuator[i, ACTUATOR_DOF]] += effort


@kernel
def add_limit_penalties(plant_model, q, v, force):
    """TAMSI's joint limits: spring and damper beyond the limit, pushing back only [N or N m]."""
    for i in range(plant_model.limit.shape[0]):
        dof = plant_model.limit[i, LIMIT_DOF]
        k = plant_model.bound[i, LIMIT_STIFFNESS]
        d = plant_model.bound[i, LIMIT_DAMPING]
        above = q[plant_model.limit[i, LIMIT_Q]] - plant_model.bound[i, UPPER]
        below = q[plant_model.limit[i, LIMIT_Q]] - plant_model.bound[i, LOWER]
        if above > 0.0:
            push = -k * above - d * v[dof]
            if push < 0.0:
                force[dof] += push
        elif below < 0.0:
            push = -k * below - d * v[dof]
            if push > 0.0:
                force[dof] += push
