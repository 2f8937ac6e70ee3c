"""A step of CENIC in the event loop: convex problems whole and in halves, and how far apart they end.

P, S, I, Z: see `systems/framework/_kernels`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common.kernel import IntVector, Vector, Vectors, kernel
from sheldrake.common.rows import call_row
from sheldrake.multibody.contact_solvers._kernels.problem import DT, RELATIVE_TOLERANCE
from sheldrake.multibody.plant._kernels.forces import add_actuation, add_applied_forces
from sheldrake.multibody.plant._kernels.model import PlantModel, StepVectors
from sheldrake.multibody.tree._kernels.integrate import integrate_positions
from sheldrake.multibody.tree._kernels.model import DAMPING, TreeModel
from sheldrake.systems.framework._kernels.integrate import ACCURACY, FIXED, H_ERROR, H_TRY
from sheldrake.systems.framework._kernels.program import (
    CONTINUOUS,
    DERIV,
    NUM_XC,
    RK,
    ROW,
    STATUS,
    XC,
    XDOT,
    Program,
    call,
    changed,
    refresh,
)

KAPPA = np.float64(1e-3)  # tolerance of the solver over accuracy
DIFFERENCE = np.float64(1e-6)  # by how much velocities are changed to see what forces do [m/s or rad/s]

# Calls.plant
BEGIN = np.int64(0)  # of the plant's state in the whole continuous state
NUM_Q = np.int64(1)
NUM_V = np.int64(2)
FED = np.int64(3)  # 1 if other systems give forces
SPATIAL = np.int64(4)  # number of the row that finds what applied spatial forces amount to, -1 for none
ROW_BEGIN = np.int64(5)  # the plant's own derivatives in the program, which the step does without
ROW_END = np.int64(6)
NUM_PLANT = 7


class Convex(NamedTuple):
    """Memory of the step, beside that of its stages.

    Attributes:
        xd: the plant's state at the beginning, as the stages read it, shape (nq + nv,).
        out: at the end, shape (nq + nv,).
        whole: at the end of a step that was not halved, shape (nq + nv,).
        p: the plant's parameters, as the stages read them.
        gain: how much forces of ports brake, shape (nv,).
        option: the solver's numbers.
        tolerance: least relative tolerance of the solver, shape (1,).
    """

    xd: Vector
    out: Vector
    whole: Vector
    p: Vector
    gain: Vector
    option: Vector
    tolerance: Vector


class Calls(NamedTuple):
    """What the step calls.

    Attributes:
        stage: the stages of a discrete step in turn, then what else is called.
        words: their arguments.
        at: where each one's arguments begin; its length is the number of stages and one.
        plant: shape (7,), columns `BEGIN` .. `ROW_END`.
        quaternion: where quaternions begin in the plant's state.
    """

    stage: IntVector
    words: IntVector
    at: IntVector
    plant: IntVector
    quaternion: IntVector


@kernel
def read_forces(program_model, plant_model, S, I, row_table, step, calls, u, tau):
    """Brings the input ports up to date; their generalized forces into tau."""
    changed(I, CONTINUOUS)
    refresh(program_model, S, I, row_table, program_model.size[DERIV])
    for k in range(tau.shape[0]):
        step.applied_force[k] = 0.0
        tau[k] = 0.0
    spatial = calls.plant[SPATIAL]
    if spatial >= 0 and I[STATUS] == 0:
        I[STATUS] = call_row(calls.stage, spatial, S[0], S, calls.words, 0)
    add_applied_forces(plant_model, u, step.applied_force, tau)
    add_actuation(plant_model, u, tau, step.net_actuation, True)


@kernel
def lead(tree_model, program_model, S, convex, calls, v, h):
    """Puts velocities v into the slab, and the positions to which those lead from xd within h."""
    begin = program_model.size[XC] + calls.plant[BEGIN]
    nq = calls.plant[NUM_Q]
    integrate_positions(tree_model, convex.xd, v, h, convex.out)
    for i in range(nq):
        S[begin + i] = convex.out[i]
    for k in range(calls.plant[NUM_V]):
        S[begin + nq + k] = v[k]


@kernel(outline=True)
def linearize(program_model, tree_model, plant_model, S, I, row_table, convex, step, calls, u, h):
    """Reads the ports where the step leads with its first velocity, and adds damping for what they brake.

    tau(v) = tau0 - K (v - v0): K goes to the joints' damping, which is implicit, and K v0 to the applied force.
    Vectors of the stages hold v, tau0 and tau until these run.
    """
    nq = calls.plant[NUM_Q]
    v = step.v_next
    tau0 = step.v
    tau = step.force
    for k in range(v.shape[0]):
        v[k] = convex.xd[nq + k]
    lead(tree_model, program_model, S, convex, calls, v, h)
    read_forces(program_model, plant_model, S, I, row_table, step, calls, u, tau0)
    for k in range(v.shape[0]):
        v0 = v[k]
        v[k] += DIFFERENCE * (abs(v0) if abs(v0) > 1.0 else 1.0)
        lead(tree_model, program_model, S, convex, calls, v, h)
        read_forces(program_model, plant_model, S, I, row_table, step, calls, u, tau)
        gain = (tau0[k] - tau[k]) / (v[k] - v0)
        convex.gain[k] = gain if gain > 0.0 else 0.0
        v[k] = v0
    lead(tree_model, program_model, S, convex, calls, v, h)
    read_forces(program_model, plant_model, S, I, row_table, step, calls, u, tau)
    begin = program_model.size[XC] + calls.plant[BEGIN]
    for i in range(convex.xd.shape[0]):
        S[begin + i] = convex.xd[i]
    changed(I, CONTINUOUS)
    for k in range(v.shape[0]):
        convex.p[tree_model.dof[k, DAMPING]] += convex.gain[k]
        step.applied_force[k] += convex.gain[k] * v[k]


@kernel
def move_others(program_model, S, I, row_table, calls, h):
    """Explicit Euler for the continuous states of other systems."""
    P = program_model
    deriv = P.size[DERIV]
    first = calls.plant[BEGIN]
    end = first + calls.plant[NUM_Q] + calls.plant[NUM_V]
    refresh(P, S, I, row_table, deriv)
    for j in range(P.act_ptr[deriv], P.act_ptr[deriv + 1]):
        r = P.act[j]
        if I[STATUS] == 0 and (r < calls.plant[ROW_BEGIN] or r >= calls.plant[ROW_END]):
            call(P, S, I, row_table, r)
    if I[STATUS] == 0:
        for i in range(P.size[NUM_XC]):
            if i < first or i >= end:
                S[P.size[XC] + i] += h * S[P.size[XDOT] + i]


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
def convex_step(program_model, tree_model, plant_model, S, I, row_table, convex, step, calls, u, p, h):
    """From the slab's state to that a step of h later, without an estimate; a bad status is left in I."""
    P = program_model
    begin = P.size[XC] + calls.plant[BEGIN]
    n = calls.plant[NUM_Q] + calls.plant[NUM_V]
    for i in range(n):
        convex.xd[i] = S[begin + i]
    for i in range(p.shape[0]):
        convex.p[i] = p[i]
    convex.option[DT] = h
    if calls.plant[FED] == 1:
        linearize(P, tree_model, plant_model, S, I, row_table, convex, step, calls, u, h)
    else:
        changed(I, CONTINUOUS)
        refresh(P, S, I, row_table, P.size[DERIV])
    for s in range(calls.at.shape[0] - 1):
        if I[STATUS] == 0:
            I[STATUS] = call_row(calls.stage, s, S[0], S, calls.words, calls.at[s])
            I[ROW] = calls.plant[ROW_BEGIN]
    if I[STATUS] == 0 and P.size[NUM_XC] > n:
        move_others(P, S, I, row_table, calls, h)
    if I[STATUS] == 0:
        normalize_quaternions(convex, calls)
        for i in range(n):
            S[begin + i] = convex.out[i]
        changed(I, CONTINUOUS)


@kernel(top=True)
def cenic_step(
    program_model: Program,
    tree_model: TreeModel,
    plant_model: PlantModel,
    Z: Vector,
    S: Vector,
    I: IntVector,
    row_table: IntVector,
    convex: Convex,
    step: StepVectors,
    calls: Calls,
    u: Vectors,
    p: Vector,
) -> None:
    """Steps by Z[H_TRY] [s], and leaves the norm of the error in Z[H_ERROR]; a bad status stays in I.

    The step is made once whole and once in two halves; the positions' difference is the estimate of the error, and the
    halves are kept. The state at the beginning is at S[RK:].
    """
    P = program_model
    h = Z[H_TRY]
    t = S[0]
    tolerance = convex.tolerance[0]
    if Z[FIXED] == 0.0 and KAPPA * Z[ACCURACY] > tolerance:
        tolerance = KAPPA * Z[ACCURACY]
    convex.option[RELATIVE_TOLERANCE] = tolerance
    convex_step(P, tree_model, plant_model, S, I, row_table, convex, step, calls, u, p, h)
    error = 0.0
    if Z[FIXED] == 0.0 and I[STATUS] == 0:
        for i in range(convex.out.shape[0]):
            convex.whole[i] = convex.out[i]
        for i in range(P.size[NUM_XC]):
            S[P.size[XC] + i] = S[P.size[RK] + i]
        convex_step(P, tree_model, plant_model, S, I, row_table, convex, step, calls, u, p, 0.5 * h)
        if I[STATUS] == 0:
            S[0] = t + 0.5 * h
            convex_step(P, tree_model, plant_model, S, I, row_table, convex, step, calls, u, p, 0.5 * h)
            S[0] = t
        for i in range(calls.plant[NUM_Q]):
            e = abs(convex.out[i] - convex.whole[i])
            if not e <= error:
                error = e
    Z[H_ERROR] = error
