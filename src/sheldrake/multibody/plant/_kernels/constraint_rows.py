"""Rows of constraints: couplers of two joints, tendons, distances, ball joints and welds between bodies.

A constraint is g(q) = 0 with gdot = J v, as stiff as the time step resolves (Castro, Permenter, Han 2022, section V).
"""

import numpy as np

from sheldrake.common._kernels.generic import atan2, sqrt
from sheldrake.common._kernels.vec import (
    add3,
    compose,
    cross3,
    dot3,
    load3_at,
    load6,
    load9,
    read3,
    rotate,
    scale3,
    sub3,
    transpose,
)
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.problem import (
    HOLONOMIC,
    NUM_ROWS,
    ROW_DOFS,
    ROW_GAP,
    ROW_GROUP,
    ROW_KIND,
    ROW_LOWER,
    ROW_OWNER,
    ROW_RELAXATION,
    ROW_STIFFNESS,
    ROW_UPPER,
    TREE_A,
    TREE_B,
    WIDTH,
)
from sheldrake.multibody.plant._kernels.contact_rows import common_dof, side_tree
from sheldrake.multibody.plant._kernels.model import (
    BALL,
    CONSTRAINT_A,
    CONSTRAINT_ACTIVE,
    CONSTRAINT_B,
    CONSTRAINT_KIND,
    CONSTRAINT_P,
    CONSTRAINT_Q_A,
    CONSTRAINT_Q_B,
    COUPLER,
    DISTANCE,
    TENDON,
    TENDON_COEFFICIENT,
    TENDON_DOF,
    TENDON_Q,
)
from sheldrake.multibody.tree._kernels.frames import read9
from sheldrake.multibody.tree._kernels.model import DEPTH, DOF_PARENT, DOF_TREE, ROOT, TIP

INFINITE = np.float64(np.inf)
ONE = np.int64(1)
TWO = np.int64(2)
THREE = np.int64(3)
SIX = np.int64(6)
SMALL_SINE = np.float64(1e-9)  # below it an angle is its sine


@kernel
def rotation_vector(R):
    """Angle times axis of a rotation by less than 180 degrees [rad]."""
    sine = (0.5 * (R[7] - R[5]), 0.5 * (R[2] - R[6]), 0.5 * (R[3] - R[1]))
    cosine = 0.5 * (R[0] + R[4] + R[8] - 1.0)
    s2 = dot3(sine, sine)
    if s2 <= SMALL_SINE * SMALL_SINE:
        return sine
    s = sqrt(s2)
    return scale3(sine, atan2(s, cosine) / s)


@kernel
def put_row_law(rows, r, gap, stiffness, relaxation):
    rows.law[r, ROW_LOWER] = -INFINITE
    rows.law[r, ROW_UPPER] = INFINITE
    rows.law[r, ROW_GAP] = gap
    rows.law[r, ROW_STIFFNESS] = stiffness
    rows.law[r, ROW_RELAXATION] = relaxation


@kernel
def put_row_heads(rows, r, n, owner, width, tree_a, tree_b):
    """Index of n rows that share their dofs, which row r lists."""
    for i in range(r, r + n):
        rows.index[i, WIDTH] = width
        rows.index[i, TREE_A] = tree_a
        rows.index[i, TREE_B] = tree_b
        rows.index[i, ROW_KIND] = HOLONOMIC
        rows.index[i, ROW_OWNER] = owner
        rows.index[i, ROW_GROUP] = 0
        for a in range(width):
            rows.index[i, ROW_DOFS + a] = rows.index[r, ROW_DOFS + a]
    rows.index[r, ROW_GROUP] = n


@kernel
def put_motion(rows, r, n, column, first, w, v, along):
    """Writes (`first`) or adds the motion of a dof to a column of n rows: 1 along, 3 of v, or 6 of (w, v)."""
    if n == 1:
        put_number(rows.J, r, column, first, dot3(along, v))
    elif n == 3:
        put_three(rows.J, r, column, first, v)
    else:
        put_three(rows.J, r, column, first, w)
        put_three(rows.J, r + 3, column, first, v)


@kernel
def put_three(J, r, column, first, a):
    put_number(J, r, column, first, a[0])
    put_number(J, r + 1, column, first, a[1])
    put_number(J, r + 2, column, first, a[2])


@kernel
def put_number(J, r, column, first, value):
    if first:
        J[r, column] = value
    else:
        J[r, column] += value


@kernel(outline=True)
def put_body_rows(tree_model, tree, rows, r, n, owner, body_a, body_b, p_WP, p_WQ, along):
    """Jacobian of the motion of Q on B against P on A, in n rows from row r on (see `put_motion`)."""
    tip_a = tree_model.body[body_a, TIP]
    tip_b = tree_model.body[body_b, TIP]
    tree_a = side_tree(tree_model, body_a)
    tree_b = side_tree(tree_model, body_b)
    stop = np.int64(-1)
    if tree_a >= 0 and tree_a == tree_b:
        stop = common_dof(tree_model, tip_a, tip_b)
    width = np.int64(0)
    if tip_a >= 0:
        width += tree_model.dof[tip_a, DEPTH] + 1
        p_RootP = sub3(p_WP, load3_at(tree.X_WB, tree_model.body[body_a, ROOT], 9))
        k = tip_a
        while k >= 0:
            w, v = load6(tree.S, k)
            column = tree_model.dof[k, DEPTH]
            rows.index[r, ROW_DOFS + column] = k
            v = scale3(add3(v, cross3(w, p_RootP)), -1.0)
            put_motion(rows, r, n, column, True, scale3(w, -1.0), v, along)
            k = tree_model.dof[k, DOF_PARENT]
    if tip_b >= 0:
        shared = np.int64(0)
        if stop >= 0:
            shared += tree_model.dof[stop, DEPTH] + 1
        own = width - shared
        width = own + tree_model.dof[tip_b, DEPTH] + 1
        p_RootQ = sub3(p_WQ, load3_at(tree.X_WB, tree_model.body[body_b, ROOT], 9))
        k = tip_b
        while k >= 0:
            w, v = load6(tree.S, k)
            depth = tree_model.dof[k, DEPTH]
            new = depth >= shared
            column = own + depth if new else depth
            rows.index[r, ROW_DOFS + column] = k
            put_motion(rows, r, n, column, new, w, add3(v, cross3(w, p_RootQ)), along)
            k = tree_model.dof[k, DOF_PARENT]
    put_row_heads(rows, r, n, owner, width, tree_a, tree_b)


@kernel
def put_coupler(tree_model, rows, r, owner, a, b, gap, ratio):
    """q_a - ratio q_b - offset = 0."""
    rows.index[r, ROW_DOFS] = a
    rows.index[r, ROW_DOFS + 1] = b
    rows.J[r, 0] = 1.0
    rows.J[r, 1] = -ratio
    put_row_heads(rows, r, ONE, owner, TWO, tree_model.dof[a, DOF_TREE], tree_model.dof[b, DOF_TREE])
    put_row_law(rows, r, gap, INFINITE, 0.0)


@kernel
def put_tendon(tree_model, plant_model, problem, rows, p, q, owner, at):
    """lower <= sum of a q + offset <= upper: as in Drake, a spring and damper beyond a limit, nothing before it."""
    begin = plant_model.constraint[owner, CONSTRAINT_A]
    end = plant_model.constraint[owner, CONSTRAINT_B]
    length = p[at]
    for i in range(begin, end):
        a = p[at + 5 + plant_model.tendon[i, TENDON_COEFFICIENT]]
        length += a * q[plant_model.tendon[i, TENDON_Q]]
    if length < p[at + 1]:
        put_tendon_limit(tree_model, plant_model, problem, rows, p, owner, at, 1.0, length - p[at + 1])
    if length > p[at + 2]:
        put_tendon_limit(tree_model, plant_model, problem, rows, p, owner, at, -1.0, p[at + 2] - length)


@kernel
def put_tendon_limit(tree_model, plant_model, problem, rows, p, owner, at, sign, gap):
    """A row that pushes where the gap closes, in the direction of `sign` times the tendon's coefficients."""
    r = problem.count[NUM_ROWS]
    problem.count[NUM_ROWS] = r + 1
    begin = plant_model.constraint[owner, CONSTRAINT_A]
    end = plant_model.constraint[owner, CONSTRAINT_B]
    for i in range(begin, end):
        rows.index[r, ROW_DOFS + i - begin] = plant_model.tendon[i, TENDON_DOF]
        rows.J[r, i - begin] = sign * p[at + 5 + plant_model.tendon[i, TENDON_COEFFICIENT]]
    tree_a = tree_model.dof[plant_model.tendon[begin, TENDON_DOF], DOF_TREE]
    tree_b = tree_model.dof[plant_model.tendon[end - 1, TENDON_DOF], DOF_TREE]
    put_row_heads(rows, r, ONE, owner, end - begin, tree_a, tree_b)
    put_row_law(rows, r, gap, p[at + 3], p[at + 4] / p[at + 3])
    rows.law[r, ROW_LOWER] = 0.0


@kernel
def point_on(tree, body, p_BP):
    """p_WP of a point fixed to a body [m]."""
    return add3(load3_at(tree.X_WB, body, 9), rotate(load9(tree.X_WB, body), p_BP))


@kernel
def put_distance(tree_model, tree, p, rows, r, owner, body_a, body_b, at):
    """|PQ| - length = 0, with a spring and damper if the stiffness is finite."""
    p_WP = point_on(tree, body_a, read3(p, at))
    p_WQ = point_on(tree, body_b, read3(p, at + 3))
    p_PQ = sub3(p_WQ, p_WP)
    length = sqrt(dot3(p_PQ, p_PQ))
    put_body_rows(tree_model, tree, rows, r, ONE, owner, body_a, body_b, p_WP, p_WQ, scale3(p_PQ, 1.0 / length))
    put_row_law(rows, r, length - p[at + 6], p[at + 7], p[at + 8] / p[at + 7])


@kernel
def put_ball(tree_model, tree, p, rows, r, owner, body_a, body_b, at):
    """p_WQ - p_WP = 0."""
    p_WP = point_on(tree, body_a, read3(p, at))
    p_WQ = point_on(tree, body_b, read3(p, at + 3))
    gap = sub3(p_WQ, p_WP)
    put_body_rows(tree_model, tree, rows, r, THREE, owner, body_a, body_b, p_WP, p_WQ, gap)
    put_row_law(rows, r, gap[0], INFINITE, 0.0)
    put_row_law(rows, r + 1, gap[1], INFINITE, 0.0)
    put_row_law(rows, r + 2, gap[2], INFINITE, 0.0)


@kernel
def put_weld(tree_model, tree, p, rows, r, owner, body_a, body_b, at):
    """(rotation vector of R_PQ in W, p_WQ - p_WP) = 0, moved at the point midway between P and Q."""
    R_WP = compose(load9(tree.X_WB, body_a), read9(p, at))
    R_WQ = compose(load9(tree.X_WB, body_b), read9(p, at + 12))
    p_WP = point_on(tree, body_a, read3(p, at + 9))
    p_WQ = point_on(tree, body_b, read3(p, at + 21))
    turn = rotate(R_WP, rotation_vector(compose(transpose(R_WP), R_WQ)))
    gap = sub3(p_WQ, p_WP)
    middle = scale3(add3(p_WP, p_WQ), 0.5)
    put_body_rows(tree_model, tree, rows, r, SIX, owner, body_a, body_b, middle, middle, gap)
    put_row_law(rows, r, turn[0], INFINITE, 0.0)
    put_row_law(rows, r + 1, turn[1], INFINITE, 0.0)
    put_row_law(rows, r + 2, turn[2], INFINITE, 0.0)
    put_row_law(rows, r + 3, gap[0], INFINITE, 0.0)
    put_row_law(rows, r + 4, gap[1], INFINITE, 0.0)
    put_row_law(rows, r + 5, gap[2], INFINITE, 0.0)


@kernel
def put_constraints(tree_model, plant_model, problem, rows, tree, p, q):
    """Rows of all active constraints."""
    for i in range(plant_model.constraint.shape[0]):
        if p[plant_model.constraint[i, CONSTRAINT_ACTIVE]] > 0.0:
            kind = plant_model.constraint[i, CONSTRAINT_KIND]
            a = plant_model.constraint[i, CONSTRAINT_A]
            b = plant_model.constraint[i, CONSTRAINT_B]
            at = plant_model.constraint[i, CONSTRAINT_P]
            r = problem.count[NUM_ROWS]
            if kind == COUPLER:
                q_a = q[plant_model.constraint[i, CONSTRAINT_Q_A]]
                gap = q_a - p[at] * q[plant_model.constraint[i, CONSTRAINT_Q_B]] - p[at + 1]
                put_coupler(tree_model, rows, r, i, a, b, gap, p[at])
                problem.count[NUM_ROWS] = r + 1
            elif kind == DISTANCE:
                put_distance(tree_model, tree, p, rows, r, i, a, b, at)
                problem.count[NUM_ROWS] = r + 1
            elif kind == TENDON:
                put_tendon(tree_model, plant_model, problem, rows, p, q, i, at)
            elif kind == BALL:
                put_ball(tree_model, tree, p, rows, r, i, a, b, at)
                problem.count[NUM_ROWS] = r + 3
            else:
                put_weld(tree_model, tree, p, rows, r, i, a, b, at)
                problem.count[NUM_ROWS] = r + 6
