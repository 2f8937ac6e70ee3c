"""From contact points to rows of the contact problem: material, frame, Jacobian over the dofs that move the pair."""

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import add3, cross3, dot3, neg3, scale3, store_column3, sub3
from sheldrake.common.kernel import kernel
from sheldrake.geometry._kernels.table import elastic_reach
from sheldrake.multibody.tree._kernels.frames import from_root
from sheldrake.multibody.tree._kernels.model import FREE


@kernel
def contact_frame(z):
    """Axes x, y, z of a frame about a unit vector z: x has a zero where z has its smallest component."""
    ax = z[0] * z[0]
    ay = z[1] * z[1]
    az = z[2] * z[2]
    zero = 0.0 * z[0]
    if ax <= ay and ax <= az:
        length = sqrt(1.0 - ax)
        r = 1.0 / length
        s = -r * z[0]
        return (zero, -r * z[2], r * z[1]), (length, s * z[1], s * z[2]), z
    if ay <= az:
        length = sqrt(1.0 - ay)
        r = 1.0 / length
        s = -r * z[1]
        return (r * z[2], zero, -r * z[0]), (s * z[0], length, s * z[2]), z
    length = sqrt(1.0 - az)
    r = 1.0 / length
    s = -r * z[2]
    return (-r * z[1], r * z[0], zero), (s * z[0], s * z[1], length), z


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
def harmonic_mean(a, b):
    if a + b > 0.0:
        return 2.0 * a * b / (a + b)
    return 0.0 * a


@kernel
def friction_scale(tree_model, p, geometry):
    """What the friction coefficients of a geometry are multiplied with: a parameter of its body."""
    at = tree_model.bodies[geometry.body].friction
    return p[at] if at >= 0 else 1.0


@kernel
def combined_losses(tree_model, p, A, B, w_A):
    """(dissipation, relaxation time, friction) of two geometries, of which A's share of the stiffness is w_A."""
    d = (1.0 - w_A) * A.dissipation + w_A * B.dissipation
    mu_A = A.friction_dynamic * friction_scale(tree_model, p, A)
    mu = harmonic_mean(mu_A, B.friction_dynamic * friction_scale(tree_model, p, B))
    return d, A.relaxation_time + B.relaxation_time, mu


@kernel
def combined_material(tree_model, geometry_model, p, a, b):
    """Of a pair of geometries the weight of A, and (stiffness, dissipation, relaxation time, friction).

    As Drake combines them (its documentation on compliant point contact): k = kA kB / (kA + kB), springs in series,
    d = (kB dA + kA dB) / (kA + kB), tau = tauA + tauB, mu = 2 muA muB / (muA + muB); the contact is at
    (kA p_WCa + kB p_WCb) / (kA + kB), so that the weight of A's point is kA / (kA + kB).
    """
    A, B = geometry_model[a], geometry_model[b]
    w_A = share(A.stiffness, B.stiffness)
    k = B.stiffness if A.stiffness > 1e300 else (1.0 - w_A) * A.stiffness
    d, tau, mu = combined_losses(tree_model, p, A, B, w_A)
    return w_A, (k, d, tau, mu)


@kernel
def common_dof(tree_model, a, b):
    """Last dof that moves both of two bodies' tip dofs, -1 for none."""
    while a != b:
        if a < 0 or b < 0:
            return -1
        if a > b:
            a = tree_model.dofs[a].parent
        else:
            b = tree_model.dofs[b].parent
    return a


@kernel
def put_path(tree_model, tree_work, contact, at, tip, stop, frame, p_RootC, sign):
    """Columns of a contact, from `at` on, for the dofs from `tip` to the base, `stop` excluded; the next column."""
    first = at if stop < 0 else at - (tree_model.dofs[stop].depth + 1)
    k = tip
    while k != stop:
        column = first + tree_model.dofs[k].depth
        w, v = tree_work.dofs[k].S
        u = scale3(add3(v, cross3(w, p_RootC)), sign)
        contact.dofs[column] = k
        store_column3(contact.J, 0, column, (dot3(frame[0], u), dot3(frame[1], u), dot3(frame[2], u)))
        k = tree_model.dofs[k].parent
    return first + tree_model.dofs[tip].depth + 1


@kernel
def put_free_row(J, row, at, r, e, sign):
    J[row, at], J[row, at + 1], J[row, at + 2] = cross3(r, e)
    J[row, at + 3], J[row, at + 4], J[row, at + 5] = scale3(e, sign)


@kernel
def put_free_path(contact, at, tip, frame, p_RootC, sign):
    """`put_path` of a free body: columns r x e, then e, of the axes e of the contact frame; the next column."""
    r = scale3(p_RootC, sign)
    for k in range(6):
        contact.dofs[at + k] = tip - 5 + k
    put_free_row(contact.J, 0, at, r, frame[0], sign)
    put_free_row(contact.J, 1, at, r, frame[1], sign)
    put_free_row(contact.J, 2, at, r, frame[2], sign)
    return at + 6


@kernel
def put_side(tree_model, tree_work, contact, at, b, stop, frame, p_WC, sign):
    """Columns of a contact for one of its bodies; the next column.

    There are none where all that moves the body moves the other one too, as a floating base its own limbs.
    """
    body = tree_model.bodies[b]
    tip = body.tip
    if tip < 0 or tip == stop:
        return at
    p_RootC = from_root(tree_model, tree_work, b, p_WC)
    if body.kind == FREE:
        return put_free_path(contact, at, tip, frame, p_RootC, sign)
    return put_path(tree_model, tree_work, contact, at, tip, stop, frame, p_RootC, sign)


@kernel
def side_tree(tree_model, b):
    """Tree of a body, -1 when nothing moves it."""
    body = tree_model.bodies[b]
    return -1 if body.tip < 0 else body.tree


@kernel
def sides(tree_model, body_a, body_b):
    """Trees of two bodies, and the last dof that moves both; -1 for none."""
    tree_a = side_tree(tree_model, body_a)
    tree_b = side_tree(tree_model, body_b)
    stop = -1
    if tree_a >= 0 and tree_a == tree_b:
        stop = common_dof(tree_model, tree_model.bodies[body_a].tip, tree_model.bodies[body_b].tip)
    return tree_a, tree_b, stop


@kernel
def put_contact(tree_model, tree_work, contact, body_a, body_b, moved, frame, p_WC, material, depth, reach):
    """Index, Jacobian and material of a contact whose `sides` are `moved`; material as in `combined_material`."""
    tree_a, tree_b, stop = moved
    width = put_side(tree_model, tree_work, contact, 0, body_a, stop, frame, p_WC, -1.0)
    contact.width = put_side(tree_model, tree_work, contact, width, body_b, stop, frame, p_WC, 1.0)
    contact.tree_a, contact.tree_b = tree_a, tree_b
    contact.stiffness, contact.dissipation, contact.relaxation, contact.friction = material
    contact.depth, contact.reach = depth, reach


@kernel
def put_contacts(tree_model, geometry_model, p, tree_work, table, contacts, count):
    """Index, Jacobian and material of all contacts.

    Contacts of one pair of geometries follow each other: they share material and dofs, and the frame while the normal
    is the same.
    """
    a, b = -1, -1
    moved = (-1, -1, -1)
    w_A, material, reach = 0.0, (0.0, 0.0, 0.0, 0.0), 0.0
    nhat = (0.0, 0.0, 0.0)
    frame = (nhat, nhat, nhat)
    for c in range(count):
        found = table[c]
        body_a, body_b = found.body_A, found.body_B
        if found.geometry_A != a or found.geometry_B != b:
            a, b = found.geometry_A, found.geometry_B
            w_A, material = combined_material(tree_model, geometry_model, p, a, b)
            reach = elastic_reach(geometry_model, a, b)
            moved = sides(tree_model, body_a, body_b)
        n = found.nhat_BA_W
        if n[0] != nhat[0] or n[1] != nhat[1] or n[2] != nhat[2]:
            nhat = n
            frame = contact_frame(neg3(n))
        p_WCb = found.p_WCb
        p_WC = add3(p_WCb, scale3(sub3(found.p_WCa, p_WCb), w_A))
        depth = found.depth
        put_contact(tree_model, tree_work, contacts[c], body_a, body_b, moved, frame, p_WC, material, depth, reach)
