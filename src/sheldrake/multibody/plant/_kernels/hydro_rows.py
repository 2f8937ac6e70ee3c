"""From the faces of contact surfaces to rows of the contact problem.

A face of area A with pressure p0 at its centroid, where the pressure grows at g along the normal, is a contact point
with stiffness A g and depth p0 / g (Masterjohn, Guoy, Shepherd, Castro, Velocity level approximation of pressure field
contact patches, 2022). With g_M and g_N the growth into either body, 1/g = 1/g_M + 1/g_N.
"""

from sheldrake.common._kernels.vec import dot3, neg3
from sheldrake.common.kernel import Vector, kernel
from sheldrake.geometry._kernels.hydro_model import HydroModel, HydroTable
from sheldrake.geometry._kernels.model import ContactTable, GeometryModel
from sheldrake.multibody.contact_solvers._kernels.problem import Contacts, Problem
from sheldrake.multibody.contact_solvers._kernels.status import SOLVED
from sheldrake.multibody.plant._kernels.contact_rows import (
    combined_losses,
    contact_frame,
    put_contact,
    share,
    sides,
)
from sheldrake.multibody.plant._kernels.locks import lock_contacts
from sheldrake.multibody.plant._kernels.model import PlantModel
from sheldrake.multibody.tree._kernels.model import TreeModel, TreeWork

LEAST_AREA = 1e-14  # [m^2] smaller faces are not felt
LEAST_GROWTH = 1e-14  # [Pa/m] nor are those where the pressure does not grow into a body
RIGID = 1e300  # moduli above are infinite

HYDRO_UNSUPPORTED_PAIR = 131
HYDRO_CAPACITY = 132


@kernel
def growth(hydro_model, face, m, n, normal):
    """How fast pressure grows along the normal when the bodies approach [Pa/m]; zero where it does not."""
    none = 0.0 * normal[0]
    g_M = dot3(face.gradient_M, normal)
    g_N = -dot3(face.gradient_N, normal)
    if hydro_model[m].modulus > RIGID:
        return g_N if g_N >= LEAST_GROWTH else none
    if hydro_model[n].modulus > RIGID:
        return g_M if g_M >= LEAST_GROWTH else none
    if g_M < LEAST_GROWTH or g_N < LEAST_GROWTH:
        return none
    return 1.0 / (1.0 / g_M + 1.0 / g_N)


@kernel
def patch_losses(tree_model, geometry_model, p, hydro_model, m, n):
    """`combined_losses` of geometries that touch along a surface: shares are those of the moduli."""
    w_M = share(hydro_model[m].modulus, hydro_model[n].modulus)
    return combined_losses(tree_model, p, geometry_model[m], geometry_model[n], w_M)


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
            depth, reach = face.pressure / g, 0.0
            put_contact(tree_model, tree, contacts[c], body_a, body_b, moved, frame, face.p_WC, material, depth, reach)
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
