"""From contact points to rows of the contact problem: material, frame, Jacobian over the dofs that move the pair."""

import numpy as np

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import add3, cross3, dot3, load3_at, load6, scale3, store_column3, sub3
from sheldrake.common.kernel import kernel
from sheldrake.geometry._kernels import model as geometry
from sheldrake.geometry._kernels.table import elastic_reach
from sheldrake.multibody.contact_solvers._kernels.problem import (
    BACK,
    DEPTH,
    DISSIPATION,
    DOFS,
    FRICTION,
    RELAXATION,
    STIFFNESS,
    TREE_A,
    TREE_B,
    WIDTH,
)
from sheldrake.multibody.tree._kernels import model as tree

BODY_A = geometry.BODY_A
BODY_B = geometry.BODY_B
GEOMETRY_A = geometry.GEOMETRY_A
GEOMETRY_B = geometry.GEOMETRY_B
NHAT_BA_W = geometry.NHAT_BA_W
P_WCA = geometry.P_WCA
P_WCB = geometry.P_WCB
PAIR_DEPTH = geometry.DEPTH
POINT_STIFFNESS = geometry.STIFFNESS
POINT_DISSIPATION = geometry.DISSIPATION
RELAXATION_TIME = geometry.RELAXATION_TIME
FRICTION_DYNAMIC = geometry.FRICTION_DYNAMIC
ROOT = tree.ROOT
TIP = tree.TIP
TREE = tree.TREE
DOF_PARENT = tree.DOF_PARENT
DOF_DEPTH = tree.DEPTH
KIND = tree.KIND
FREE = tree.FREE

NO_COLUMNS = np.int64(0)


@kernel
def contact_frame(z):
    """Tangents x, y to a unit vector z: x has a zero where z has its smallest component."""
    ax = z[0] * z[0]
    ay = z[1] * z[1]
    az = z[2] * z[2]
    zero = 0.0 * z[0]
    if ax <= ay and ax <= az:
        length = sqrt(1.0 - ax)
        r = 1.0 / length
        s = -r * z[0]
        return (zero, -r * z[2], r * z[1]), (length, s * z[1], s * z[2])
    if ay <= az:
        length = sqrt(1.0 - ay)
        r = 1.0 / length
        s = -r * z[1]
        return (r * z[2], zero, -r * z[0]), (s * z[0], length, s * z[2])
    length = sqrt(1.0 - az)
    r = 1.0 / length
    s = -r * z[2]
    return (-r * z[1], r * z[0], zero), (s * z[0], s * z[1], length)


@kernel
def share(k, other):
    """Part of the way from B's to A's point that belongs to A: kA / (kA + kB), also for infinite stiffnesses."""
    if k > 1e300:
        return 0.5 + 0.0 * k if other > 1e300 else 1.0 + 0.0 * other
    if other > 1e300:
        return 0.0 * k
    if k + other > 0.0:
        return k / (k + other)
    return 0.5 + 0.0 * k


@kernel
def combine(k_A, k_B, w_A):
    """Stiffness of two springs in series [N/m]."""
    if k_A > 1e300:
        return k_B
    return (1.0 - w_A) * k_A


@kernel
def combined_material(material, a, b):
    """(weight of A, stiffness, dissipation, relaxation time, friction) of a pair of geometries."""
    k_A = material[a, POINT_STIFFNESS]
    k_B = material[b, POINT_STIFFNESS]
    w_A = share(k_A, k_B)
    mu_A = material[a, FRICTION_DYNAMIC]
    mu_B = material[b, FRICTION_DYNAMIC]
    mu = 0.0 * mu_A
    if mu_A + mu_B > 0.0:
        mu = 2.0 * mu_A * mu_B / (mu_A + mu_B)
    d = (1.0 - w_A) * material[a, POINT_DISSIPATION] + w_A * material[b, POINT_DISSIPATION]
    tau = material[a, RELAXATION_TIME] + material[b, RELAXATION_TIME]
    return w_A, combine(k_A, k_B, w_A), d, tau, mu


@kernel
def common_dof(tree_model, a, b):
    """Last dof that moves both of two bodies' tip dofs, -1 for none."""
    while a != b:
        if a < 0 or b < 0:
            return np.int64(-1)
        if a > b:
            a = tree_model.dof[a, DOF_PARENT]
        else:
            b = tree_model.dof[b, DOF_PARENT]
    return a


@kernel
def put_path(tree_model, tree_work, contacts, c, at, tip, stop, frame, p_RootC, sign):
    """Columns of contact c, from `at` on, for the dofs from `tip` to the base, `stop` excluded; the next column."""
    first = at
    if stop >= 0:
        first -= tree_model.dof[stop, DOF_DEPTH] + 1
    k = tip
    while k != stop:
        column = first + tree_model.dof[k, DOF_DEPTH]
        w, v = load6(tree_work.S, k)
        u = scale3(add3(v, cross3(w, p_RootC)), sign)
        contacts.index[c, DOFS + column] = k
        store_column3(contacts.J, 3 * c, column, (dot3(frame[0], u), dot3(frame[1], u), dot3(frame[2], u)))
        k = tree_model.dof[k, DOF_PARENT]
    return first + tree_model.dof[tip, DOF_DEPTH] + 1


@kernel
def put_free_row(J, row, at, r, e, sign):
    m = cross3(r, e)
    J[row, at] = m[0]
    J[row, at + 1] = m[1]
    J[row, at + 2] = m[2]
    J[row, at + 3] = sign * e[0]
    J[row, at + 4] = sign * e[1]
    J[row, at + 5] = sign * e[2]


@kernel
def put_free_path(contacts, c, at, tip, frame, p_RootC, sign):
    """`put_path` of a free body: columns r x e, then e, of the axes e of the contact frame; the next column."""
    r = scale3(p_RootC, sign)
    for k in range(6):
        contacts.index[c, DOFS + at + k] = tip - 5 + k
    put_free_row(contacts.J, 3 * c, at, r, frame[0], sign)
    put_free_row(contacts.J, 3 * c + 1, at, r, frame[1], sign)
    put_free_row(contacts.J, 3 * c + 2, at, r, frame[2], sign)
    return at + 6


@kernel
def put_side(tree_model, tree_work, contacts, c, at, body, stop, frame, p_WC, sign):
    """Columns of contact c for one of its bodies; the next column.

    There are none where all that moves the body moves the other one too, as a floating base its own limbs.
    """
    tip = tree_model.body[body, TIP]
    if tip < 0 or tip == stop:
        return at
    p_RootC = sub3(p_WC, load3_at(tree_work.X_WB, tree_model.body[body, ROOT], 9))
    if tree_model.body[body, KIND] == FREE:
        return put_free_path(contacts, c, at, tip, frame, p_RootC, sign)
    return put_path(tree_model, tree_work, contacts, c, at, tip, stop, frame, p_RootC, sign)


@kernel
def side_tree(tree_model, body):
    """Tree of a body, -1 when nothing moves it."""
    if tree_model.body[body, TIP] < 0:
        return np.int64(-1)
    return tree_model.body[body, TREE]


@kernel
def put_contacts(tree_model, geometry_model, tree_work, table, contacts, count):
    """Index, Jacobian and material of all contacts.

    Contacts of one pair of geometries follow each other: they share material and dofs, and the frame while the normal
    is the same.
    """
    a = np.int64(-1)
    b = np.int64(-1)
    tree_a = np.int64(-1)
    tree_b = np.int64(-1)
    stop = np.int64(-1)
    material = (0.0, 0.0, 0.0, 0.0, 0.0)
    reach = 0.0
    nhat = (0.0, 0.0, 0.0)
    frame = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    for c in range(count):
        body_a = table.pair[c, BODY_A]
        body_b = table.pair[c, BODY_B]
        if table.pair[c, GEOMETRY_A] != a or table.pair[c, GEOMETRY_B] != b:
            a = table.pair[c, GEOMETRY_A]
            b = table.pair[c, GEOMETRY_B]
            material = combined_material(geometry_model.material, a, b)
            reach = elastic_reach(geometry_model, a, b)
            tree_a = side_tree(tree_model, body_a)
            tree_b = side_tree(tree_model, body_b)
            stop = np.int64(-1)
            if tree_a >= 0 and tree_a == tree_b:
                stop = common_dof(tree_model, tree_model.body[body_a, TIP], tree_model.body[body_b, TIP])
        n = load3_at(table.point, c, NHAT_BA_W)
        if n[0] != nhat[0] or n[1] != nhat[1] or n[2] != nhat[2]:
            nhat = n
            z = (-n[0], -n[1], -n[2])
            x, y = contact_frame(z)
            frame = (x, y, z)
        w_A, k, d, tau, mu = material
        p_WCb = load3_at(table.point, c, P_WCB)
        p_WC = add3(p_WCb, scale3(sub3(load3_at(table.point, c, P_WCA), p_WCb), w_A))
        width = put_side(tree_model, tree_work, contacts, c, NO_COLUMNS, body_a, stop, frame, p_WC, -1.0)
        width = put_side(tree_model, tree_work, contacts, c, width, body_b, stop, frame, p_WC, 1.0)
        contacts.index[c, WIDTH] = width
        contacts.index[c, TREE_A] = tree_a
        contacts.index[c, TREE_B] = tree_b
        contacts.law[c, STIFFNESS] = k
        contacts.law[c, DISSIPATION] = d
        contacts.law[c, RELAXATION] = tau
        contacts.law[c, FRICTION] = mu
        contacts.law[c, DEPTH] = table.point[c, PAIR_DEPTH]
        contacts.law[c, BACK] = reach
