"""From contact points, and the faces of contact surfaces, to rows of the contact problem."""

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import SIX, add3, cross3, dot3, neg3, scale3, store_column3, sub3
from sheldrake.common.kernel import Vector, kernel
from sheldrake.geometry._kernels.hydro_model import HydroModel, HydroTable
from sheldrake.geometry._kernels.model import ContactTable, GeometryModel
from sheldrake.geometry._kernels.table import elastic_reach
from sheldrake.multibody.contact_solvers._kernels.laws import (
    INFINITE_STIFFNESS,
    combined_losses,
    combined_stiffness,
    harmonic_mean,
    share,
    static_share,
)
from sheldrake.multibody.contact_solvers._kernels.problem import (
    SOLVED,
    VC,
    Contacts,
    Problem,
    SolverModel,
    put_sixes,
    put_velocity,
)
from sheldrake.multibody.plant._kernels.forces import any_locked, lock_contacts
from sheldrake.multibody.plant._kernels.model import PlantModel
from sheldrake.multibody.tree._kernels.dynamics import dofs_beyond_base
from sheldrake.multibody.tree._kernels.kinematics import from_root
from sheldrake.multibody.tree._kernels.model import FREE, TreeModel, TreeWork

# ---- Jacobian


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


# ---- material


@kernel
def friction_scale(tree_model, p, geometry):
    """What the friction coefficients of a geometry are multiplied with: a parameter of its body."""
    at = tree_model.bodies[geometry.body].friction
    return p[at] if at >= 0 else 1.0


@kernel
def friction_of_pair(tree_model, p, A, B, mu_A, mu_B):
    """Friction of two geometries that have these coefficients."""
    return harmonic_mean(mu_A * friction_scale(tree_model, p, A), mu_B * friction_scale(tree_model, p, B))


@kernel
def losses_of_pair(tree_model, p, A, B, w_A):
    """(dissipation, relaxation time, dynamic friction) of two geometries; w_A is A's share of the stiffness."""
    d, tau = combined_losses(A, B, w_A)
    return d, tau, friction_of_pair(tree_model, p, A, B, A.friction_dynamic, B.friction_dynamic)


@kernel
def material_of_pair(tree_model, p, A, B):
    """Of two geometries A's share of the stiffness, and (stiffness, dissipation, relaxation time, friction)."""
    w_A = share(A.stiffness, B.stiffness)
    k = combined_stiffness(A, B, w_A)
    d, tau, mu = losses_of_pair(tree_model, p, A, B, w_A)
    return w_A, (k, d, tau, mu)


# ---- columns of the dofs that move a pair


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
def put_free_path(contact, at, first, frame, p_RootC, sign):
    """`put_path` of a free body: columns r x e, then e, of the axes e of the contact frame; the next column."""
    r = scale3(p_RootC, sign)
    for k in range(SIX):
        contact.dofs[at + k] = first + k
    put_free_row(contact.J, 0, at, r, frame[0], sign)
    put_free_row(contact.J, 1, at, r, frame[1], sign)
    put_free_row(contact.J, 2, at, r, frame[2], sign)
    return at + SIX


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
        return put_free_path(contact, at, body.first_dof, frame, p_RootC, sign)
    first, begin, _end = dofs_beyond_base(tree_model, body.tree)
    if begin > first and stop < 0:
        at = put_free_path(contact, at, first, frame, p_RootC, sign)
        stop = begin - 1
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


# ---- points


@kernel
def put_contact(tree_model, tree_work, contact, body_a, body_b, moved, frame, p_WC, material, gap, reach):
    """Index, Jacobian and material of a contact whose `sides` are `moved`; material as in `material_of_pair`.

    gap is (depth, lag).
    """
    tree_a, tree_b, stop = moved
    width = put_side(tree_model, tree_work, contact, 0, body_a, stop, frame, p_WC, -1.0)
    contact.width = put_side(tree_model, tree_work, contact, width, body_b, stop, frame, p_WC, 1.0)
    contact.tree_a, contact.tree_b = tree_a, tree_b
    contact.stiffness, contact.dissipation, contact.relaxation, contact.friction = material
    contact.depth, contact.lag = gap
    contact.reach = reach


@kernel
def put_contacts(tree_model, geometry_model, p, tree_work, table, contacts, count):
    """Index, Jacobian and material of all contacts.

    Contacts of one pair of geometries follow each other: they share the material, and the frame while the normal is the
    same. Pairs of geometries of the same two bodies mostly do so as well: they share the dofs.
    """
    a, b, body_a, body_b = -1, -1, -1, -1
    moved = (-1, -1, -1)
    w_A, material, reach = 0.0, (0.0, 0.0, 0.0, 0.0), 0.0
    nhat = (0.0, 0.0, 0.0)
    frame = (nhat, nhat, nhat)
    for c in range(count):
        found = table[c]
        if found.body_A != body_a or found.body_B != body_b:
            body_a, body_b = found.body_A, found.body_B
            moved = sides(tree_model, body_a, body_b)
        if found.geometry_A != a or found.geometry_B != b:
            a, b = found.geometry_A, found.geometry_B
            w_A, material = material_of_pair(tree_model, p, geometry_model[a], geometry_model[b])
            reach = elastic_reach(geometry_model, a, b)
        n = found.nhat_BA_W
        if n[0] != nhat[0] or n[1] != nhat[1] or n[2] != nhat[2]:
            nhat = n
            frame = contact_frame(neg3(n))
        p_WCb = found.p_WCb
        p_WC = add3(p_WCb, scale3(sub3(found.p_WCa, p_WCb), w_A))
        gap = (found.depth, 0.0)
        put_contact(tree_model, tree_work, contacts[c], body_a, body_b, moved, frame, p_WC, material, gap, reach)


@kernel(top=True)
def static_friction(
    p: Vector,
    tree_model: TreeModel,
    geometry_model: GeometryModel,
    solver_model: SolverModel,
    table: ContactTable,
    problem: Problem,
    contacts: Contacts,
) -> None:
    """Raises friction coefficients from dynamic to static for points that slip slowly (Kurtz and Castro 2025)."""
    for c in range(table.num_contacts):
        A, B = geometry_model[table[c].geometry_A], geometry_model[table[c].geometry_B]
        contact = contacts[c]
        put_sixes(solver_model, contact)
        put_velocity(contact, problem.v0, VC, True)
        x, y, _ = contact.vc
        part = static_share(sqrt(x * x + y * y) / solver_model.stiction)
        mu = friction_of_pair(tree_model, p, A, B, A.friction_static, B.friction_static)
        contact.friction += part * (mu - contact.friction)


# ---- surfaces
#
# A face of area A with pressure p0 at its centroid, where the pressure grows at g along the normal, is a contact point
# with stiffness A g and depth p0 / g (Masterjohn, Guoy, Shepherd, Castro, Velocity level approximation of pressure
# field contact patches, 2022). With g_M and g_N the growth into either body, 1/g = 1/g_M + 1/g_N.

LEAST_AREA = 1e-14  # [m^2] smaller faces are not felt
LEAST_GROWTH = 1e-14  # [Pa/m] nor are those where the pressure does not grow into a body
HYDRO_UNSUPPORTED_PAIR = 131
HYDRO_CAPACITY = 132


@kernel
def growth(hydro_model, face, m, n, normal):
    """How fast pressure grows along the normal when the bodies approach [Pa/m]; zero where it does not."""
    none = 0.0 * normal[0]
    g_M = dot3(face.gradient_M, normal)
    g_N = -dot3(face.gradient_N, normal)
    if hydro_model[m].modulus > INFINITE_STIFFNESS:
        return g_N if g_N >= LEAST_GROWTH else none
    if hydro_model[n].modulus > INFINITE_STIFFNESS:
        return g_M if g_M >= LEAST_GROWTH else none
    if g_M < LEAST_GROWTH or g_N < LEAST_GROWTH:
        return none
    return 1.0 / (1.0 / g_M + 1.0 / g_N)


@kernel
def patch_losses(tree_model, geometry_model, p, hydro_model, m, n):
    """`losses_of_pair` of geometries that touch along a surface: shares are those of the moduli."""
    w_M = share(hydro_model[m].modulus, hydro_model[n].modulus)
    return losses_of_pair(tree_model, p, geometry_model[m], geometry_model[n], w_M)


@kernel
def put_faces(tree_model, geometry_model, p, hydro_model, tree, surfaces, problem, contacts):
    """A contact for every face that is felt; False if there is no room."""
    c = problem.num_contacts
    at_hand = -1
    m, n, body_a, body_b = 0, 0, 0, 0
    moved = (-1, -1, -1)
    d, tau, mu = 0.0, 0.0, 0.0
    for f in range(surfaces.num_faces):
        face = surfaces[f]
        if face.surface != at_hand:
            at_hand = face.surface
            patch = surfaces.patches[at_hand]
            m, n = patch.geometry_M, patch.geometry_N
            body_a, body_b = geometry_model[m].body, geometry_model[n].body
            d, tau, mu = patch_losses(tree_model, geometry_model, p, hydro_model, m, n)
            moved = sides(tree_model, body_a, body_b)
        area = face.area
        normal = face.normal
        g = growth(hydro_model, face, m, n, normal)
        surfaces.contact[f] = -1
        if area > LEAST_AREA and g > 0.0:
            if c >= contacts.law.shape[0]:
                return False
            frame = contact_frame(neg3(normal))
            material = (area * g, d, tau, mu)
            gap, reach = (face.pressure / g, tau), 0.0
            put_contact(tree_model, tree, contacts[c], body_a, body_b, moved, frame, face.p_WC, material, gap, reach)
            surfaces.contact[f] = c
            c += 1
    problem.num_contacts = c
    return True


@kernel(top=True)
def hydro_constraints(
    p: Vector,
    tree: TreeWork,
    surfaces: HydroTable,
    problem: Problem,
    contacts: Contacts,
    tree_model: TreeModel,
    geometry_model: GeometryModel,
    hydro_model: HydroModel,
    plant_model: PlantModel,
) -> int:
    """The contact surfaces found as rows of the problem, behind those of points; a status of `contact_solvers`."""
    if surfaces.status != 0:
        return HYDRO_CAPACITY
    if not put_faces(tree_model, geometry_model, p, hydro_model, tree, surfaces, problem, contacts):
        return HYDRO_CAPACITY
    if any_locked(plant_model, p):
        lock_contacts(plant_model, p, problem, contacts)
    return SOLVED


@kernel(top=True)
def refuse_points(table: ContactTable) -> int:
    """A status if geometries overlap that can have no contact surface; forgets points that do not touch yet."""
    for c in range(table.num_contacts):
        if table[c].depth > 0.0:
            return HYDRO_UNSUPPORTED_PAIR
    table.num_contacts = 0
    return SOLVED
