"""A step of CENIC in the event loop: convex problems whole and in halves, and how far apart they end.

S: see `systems/framework/_kernels`.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common.kernel import IntVector, Vector, Vectors, kernel
from sheldrake.common.record import Record, integer, number, table
from sheldrake.common.rows import call_row
from sheldrake.multibody.contact_solvers._kernels.problem import Options
from sheldrake.multibody.plant._kernels.forces import add_actuation, add_applied_forces
from sheldrake.multibody.plant._kernels.model import PlantModel, StepVectors
from sheldrake.multibody.tree._kernels.integrate import integrate_positions
from sheldrake.multibody.tree._kernels.model import TreeModel
from sheldrake.systems.framework._kernels.integrate import Integrator
from sheldrake.systems.framework._kernels.program import CONTINUOUS, Program, Side, call, changed, refresh

KAPPA = 1e-3  # tolerance of the solver over accuracy
DIFFERENCE = 1e-6  # by how much velocities are changed to see what forces do [m/s or rad/s]


class Tolerances(Record):
    """Numbers of CENIC, beside those of the solver."""

    least_tolerance = number("least relative tolerance of the solver")


class PlantPlace(Record):
    """Where a plant is in its diagram."""

    state_begin = integer("of its state in the whole continuous state")
    num_q = integer("its positions")
    num_v = integer("its velocities")
    is_fed = integer("1 if other systems give forces")
    spatial = integer("number of the row that finds what applied spatial forces amount to, -1 for none")
    surfaces = integer("number of the row that finds how fast surfaces run, -1 for none")
    row_begin = integer("its own derivatives in the program, which the step does without, from here")
    row_end = integer("to here")


@table
class Convex(NamedTuple):
    """Memory of the step, beside that of its stages.

    Attributes:
        xd: the plant's state at the beginning, as the stages read it, shape (nq + nv,).
        out: at the end, shape (nq + nv,).
        whole: at the end of a step that was not halved, shape (nq + nv,).
        p: the plant's parameters, as the stages read them.
        gain: how much forces of ports brake, shape (nv,).
        option: the solver's numbers.
        tolerance: what bounds one of them.
    """

    xd: Vector
    out: Vector
    whole: Vector
    p: Vector
    gain: Vector
    option: Annotated[Vector, Options]
    tolerance: Annotated[Vector, Tolerances]


@table
class Calls(NamedTuple):
    """What the step calls.

    Attributes:
        stage: the stages of a discrete step in turn, then what else is called.
        words: their arguments.
        at: where each one's arguments begin; its length is the number of stages and one.
        plant: where the plant is.
        quaternion: where quaternions begin in the plant's state.
    """

    stage: IntVector
    words: IntVector
    at: IntVector
    plant: Annotated[IntVector, PlantPlace]
    quaternion: IntVector


@kernel
def forces_at(program, tree_model, plant_model, S, side, row_table, convex, step, calls, u, v, h, tau):
    """Puts velocities v into the slab, and the positions to which those lead from xd within h; the ports' forces there.

    These are generalized forces, in tau.
    """
    q_begin = program.xc + calls.state_begin
    v_begin = q_begin + calls.num_q
    integrate_positions(tree_model, convex.xd, v, h, convex.out)
    for i in range(calls.num_q):
        S[q_begin + i] = convex.out[i]
    for k in range(calls.num_v):
        S[v_begin + k] = v[k]
    changed(side, CONTINUOUS)
    refresh(program, S, side, row_table, program.derivatives)
    for k in range(calls.num_v):
        step.applied_force[k] = 0.0
        tau[k] = 0.0
    if calls.spatial >= 0 and side.status == 0:
        side.status = call_row(calls.stage, calls.spatial, S[0], S, calls.words, 0)
    add_applied_forces(plant_model, u, step.applied_force, tau)
    add_actuation(plant_model, u, tau, step.net_actuation, True)


@kernel(outline=True)
def linearize(program, tree_model, plant_model, S, side, row_table, convex, step, calls, u, h):
    """Reads the ports where the step leads with its first velocity, and adds damping for what they brake.

    tau(v) = tau0 - K (v - v0): K goes to the joints' damping, which is implicit, and K v0 to the applied force.
    Vectors of the stages hold v, tau0 and tau until these run.
    """
    v, tau0, tau = step.v_next, step.v, step.force
    for k in range(v.shape[0]):
        v[k] = convex.xd[calls.num_q + k]
    forces_at(program, tree_model, plant_model, S, side, row_table, convex, step, calls, u, v, h, tau0)
    for k in range(v.shape[0]):
        v0 = v[k]
        v[k] += DIFFERENCE * max(1.0, abs(v0))
        forces_at(program, tree_model, plant_model, S, side, row_table, convex, step, calls, u, v, h, tau)
        convex.gain[k] = max(0.0, (tau0[k] - tau[k]) / (v[k] - v0))
        v[k] = v0
    forces_at(program, tree_model, plant_model, S, side, row_table, convex, step, calls, u, v, h, tau)
    begin = program.xc + calls.state_begin
    for i in range(convex.xd.shape[0]):
        S[begin + i] = convex.xd[i]
    changed(side, CONTINUOUS)
    for k in range(v.shape[0]):
        convex.p[tree_model.dofs[k].damping] += convex.gain[k]
        step.applied_force[k] += convex.gain[k] * v[k]


@kernel
def move_others(program, S, side, row_table, step, calls, h):
    """Explicit Euler for the continuous states of other systems, and for how far surfaces have come."""
    deriv = program.derivatives
    first = calls.state_begin
    behind = first + calls.num_q + calls.num_v
    end = behind + step.surface_speed.shape[0]
    for k in range(step.surface_speed.shape[0]):
        S[program.xc + behind + k] += h * step.surface_speed[k]
    refresh(program, S, side, row_table, deriv)
    for j in range(program.calls_begin[deriv], program.calls_begin[deriv + 1]):
        r = program.calls[j]
        if side.status == 0 and (r < calls.row_begin or r >= calls.row_end):
            call(program, S, side, row_table, r)
    if side.status == 0:
        for i in range(program.num_xc):
            if i < first or i >= end:
                S[program.xc + i] += h * S[program.xdot + i]


@kernel
def normalize_quaternions(convex, calls):
    """Quaternions of length one at the end of the step."""
    x = convex.out
    for i in range(calls.quaternion.shape[0]):
        at = calls.quaternion[i]
        scale = 1.0 / sqrt(x[at] * x[at] + x[at + 1] * x[at + 1] + x[at + 2] * x[at + 2] + x[at + 3] * x[at + 3])
        for k in range(4):
            x[at + k] *= scale


@kernel(outline=True)
def convex_step(program, tree_model, plant_model, S, side, row_table, convex, step, calls, u, p, h):
    """From the slab's state to that a step of h later, without an estimate; a bad status is left in the side."""
    begin = program.xc + calls.state_begin
    n = calls.num_q + calls.num_v
    for i in range(n):
        convex.xd[i] = S[begin + i]
    for i in range(p.shape[0]):
        convex.p[i] = p[i]
    convex.dt = h
    if calls.is_fed == 1:
        linearize(program, tree_model, plant_model, S, side, row_table, convex, step, calls, u, h)
    else:
        changed(side, CONTINUOUS)
        refresh(program, S, side, row_table, program.derivatives)
    if calls.surfaces >= 0 and side.status == 0:
        side.status = call_row(calls.stage, calls.surfaces, S[0], S, calls.words, 0)
    for s in range(calls.at.shape[0] - 1):
        if side.status == 0:
            side.status = call_row(calls.stage, s, S[0], S, calls.words, calls.at[s])
            side.row = calls.row_begin
    if side.status == 0 and program.num_xc > n:
        move_others(program, S, side, row_table, step, calls, h)
    if side.status == 0:
        normalize_quaternions(convex, calls)
        for i in range(n):
            S[begin + i] = convex.out[i]
        changed(side, CONTINUOUS)


@kernel(top=True)
def cenic_step(
    program_model: Program,
    tree_model: TreeModel,
    plant_model: PlantModel,
    integrator: Integrator,
    S: Vector,
    side: Side,
    row_table: IntVector,
    convex: Convex,
    step: StepVectors,
    calls: Calls,
    u: Vectors,
    p: Vector,
) -> None:
    """Steps by `h_try` [s], and leaves the norm of the error in `h_error`; a bad status stays in the side.

    The step is made once whole and once in two halves; the positions' difference is the estimate of the error, and the
    halves are kept. The state at the beginning is at S[x0:].
    """
    program = program_model
    h = integrator.h_try
    t = S[0]
    convex.relative_tolerance = convex.least_tolerance
    if integrator.fixed == 0.0:
        convex.relative_tolerance = max(convex.least_tolerance, KAPPA * integrator.accuracy)
    convex_step(program, tree_model, plant_model, S, side, row_table, convex, step, calls, u, p, h)
    error = 0.0
    if integrator.fixed == 0.0 and side.status == 0:
        for i in range(convex.out.shape[0]):
            convex.whole[i] = convex.out[i]
        for i in range(program.num_xc):
            S[program.xc + i] = S[program.x0 + i]
        convex_step(program, tree_model, plant_model, S, side, row_table, convex, step, calls, u, p, 0.5 * h)
        if side.status == 0:
            S[0] = t + 0.5 * h
            convex_step(program, tree_model, plant_model, S, side, row_table, convex, step, calls, u, p, 0.5 * h)
            S[0] = t
        for i in range(calls.num_q):
            e = abs(convex.out[i] - convex.whole[i])
            if not e <= error:
                error = e
    integrator.h_error = error
