"""From the faces of contact surfaces to rows of the contact problem.

A face of area A with pressure p0 at its centroid, where the pressure grows at g along the normal, is a contact point
with stiffness A g and depth p0 / g (Masterjohn, Guoy, Shepherd, Castro, Velocity level approximation of pressure field
contact patches, 2022). With g_M and g_N the growth into either body, 1/g = 1/g_M + 1/g_N.
"""

import numpy as np

from sheldrake.common._kernels.vec import dot3, load3_at, neg3
from sheldrake.common.kernel import Vector, kernel
from sheldrake.geometry._kernels import hydro_model as hydro
from sheldrake.geometry._kernels import model as geometry
from sheldrake.geometry._kernels.hydro_model import HydroModel, HydroTable
from sheldrake.geometry._kernels.model import ContactTable, GeometryModel
from sheldrake.multibody.contact_solvers._kernels.problem import (
    BACK,
    DEPTH,
    DISSIPATION,
    FRICTION,
    NUM_CONTACTS,
    RELAXATION,
    STIFFNESS,
    TREE_A,
    TREE_B,
    WIDTH,
    Contacts,
    Problem,
)
from sheldrake.multibody.contact_solvers._kernels.status import SOLVED
from sheldrake.multibody.plant._kernels.contact_rows import (
    NO_COLUMNS,
    common_dof,
    contact_frame,
    put_side,
    share,
    side_tree,
)
from sheldrake.multibody.plant._kernels.locks import lock_contacts
from sheldrake.multibody.plant._kernels.model import PlantModel
from sheldrake.multibody.tree._kernels import model as tree_columns
from sheldrake.multibody.tree._kernels.model import TreeModel, TreeWork

AREA = hydro.AREA
CENTROID = hydro.CENTROID
GEOMETRY_M = hydro.GEOMETRY_M
GEOMETRY_N = hydro.GEOMETRY_N
GRADIENT_M = hydro.GRADIENT_M
GRADIENT_N = hydro.GRADIENT_N
MODULUS = hydro.MODULUS
NORMAL = hydro.NORMAL
NUM_FACES = hydro.NUM_FACES
PRESSURE = hydro.PRESSURE
STATUS = hydro.STATUS
SURFACE = hydro.SURFACE
BODY = geometry.BODY
POINT_DEPTH = geometry.DEPTH
MATERIAL_DISSIPATION = geometry.DISSIPATION
RELAXATION_TIME = geometry.RELAXATION_TIME
FRICTION_DYNAMIC = geometry.FRICTION_DYNAMIC
TIP = tree_columns.TIP

LEAST_AREA = np.float64(1e-14)  # [m^2] smaller faces are not felt
LEAST_GROWTH = np.float64(1e-14)  # [Pa/m] nor are those where the pressure does not grow into a body
RIGID = np.float64(1e300)  # moduli above are infinite

HYDRO_UNSUPPORTED_PAIR = 131
HYDRO_CAPACITY = 132


@kernel
def harmonic_mean(a, b):
    if a + b > 0.0:
        return 2.0 * a * b / (a + b)
    return 0.0 * a


@kernel
def growth(hydro_model, surfaces, f, m, n, normal):
    """How fast pressure grows along the normal when the bodies approach [Pa/m]; zero where it does not."""
    none = 0.0 * normal[0]
    g_M = dot3(load3_at(surfaces.value, f, GRADIENT_M), normal)
    g_N = -dot3(load3_at(surfaces.value, f, GRADIENT_N), normal)
    if hydro_model.number[m, MODULUS] > RIGID:
        return g_N if g_N >= LEAST_GROWTH else none
    if hydro_model.number[n, MODULUS] > RIGID:
        return g_M if g_M >= LEAST_GROWTH else none
    if g_M < LEAST_GROWTH or g_N < LEAST_GROWTH:
        return none
    return 1.0 / (1.0 / g_M + 1.0 / g_N)


@kernel
def put_faces(tree_model, geometry_model, hydro_model, tree, surfaces, problem, contacts):
    """A contact for every face that is felt; False if there is no room."""
    c = problem.count[NUM_CONTACTS]
    at_hand = np.int64(-1)
    body_a = np.int64(0)
    body_b = np.int64(0)
    m = np.int64(0)
    n = np.int64(0)
    tree_a = np.int64(-1)
    tree_b = np.int64(-1)
    stop = np.int64(-1)
    d = 0.0
    tau = 0.0
    mu = 0.0
    for f in range(surfaces.count[NUM_FACES]):
        s = surfaces.face[f, SURFACE]
        if s != at_hand:
            at_hand = s
            m = surfaces.surface[s, GEOMETRY_M]
            n = surfaces.surface[s, GEOMETRY_N]
            body_a = geometry_model.geometry[m, BODY]
            body_b = geometry_model.geometry[n, BODY]
            material = geometry_model.material
            w = share(hydro_model.number[m, MODULUS], hydro_model.number[n, MODULUS])
            d = (1.0 - w) * material[m, MATERIAL_DISSIPATION] + w * material[n, MATERIAL_DISSIPATION]
            tau = material[m, RELAXATION_TIME] + material[n, RELAXATION_TIME]
            mu = harmonic_mean(material[m, FRICTION_DYNAMIC], material[n, FRICTION_DYNAMIC])
            tree_a = side_tree(tree_model, body_a)
            tree_b = side_tree(tree_model, body_b)
            stop = np.int64(-1)
            if tree_a >= 0 and tree_a == tree_b:
                stop = common_dof(tree_model, tree_model.body[body_a, TIP], tree_model.body[body_b, TIP])
        area = surfaces.value[f, AREA]
        normal = load3_at(surfaces.value, f, NORMAL)
        g = growth(hydro_model, surfaces, f, m, n, normal)
        surfaces.contact[f] = -1
        if area > LEAST_AREA and g > 0.0:
            if c >= contacts.law.shape[0]:
                return False
            z = neg3(normal)
            x, y = contact_frame(z)
            frame = (x, y, z)
            p_WC = load3_at(surfaces.value, f, CENTROID)
            width = put_side(tree_model, tree, contacts, c, NO_COLUMNS, body_a, stop, frame, p_WC, -1.0)
            width = put_side(tree_model, tree, contacts, c, width, body_b, stop, frame, p_WC, 1.0)
            contacts.index[c, WIDTH] = width
            contacts.index[c, TREE_A] = tree_a
            contacts.index[c, TREE_B] = tree_b
            contacts.law[c, STIFFNESS] = area * g
            contacts.law[c, DISSIPATION] = d
            contacts.law[c, RELAXATION] = tau
            contacts.law[c, FRICTION] = mu
            contacts.law[c, DEPTH] = surfaces.value[f, PRESSURE] / g
            contacts.law[c, BACK] = 0.0
            surfaces.contact[f] = c
            c += 1
    problem.count[NUM_CONTACTS] = c
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
    if surfaces.count[STATUS] != 0:
        return HYDRO_CAPACITY
    if not put_faces(tree_model, geometry_model, hydro_model, tree, surfaces, problem, contacts):
        return HYDRO_CAPACITY
    lock_contacts(plant_model, p, contacts, problem.count)
    return SOLVED


@kernel(top=True)
def refuse_points(table: ContactTable) -> int:
    """A status if geometries overlap that can have no contact surface; forgets points that do not touch yet."""
    for c in range(table.count[0]):
        if table.point[c, POINT_DEPTH] > 0.0:
            return HYDRO_UNSUPPORTED_PAIR
    table.count[0] = 0
    return SOLVED
