"""Static and dynamic friction in the convex problem: the coefficient is that of the slip at the start of the step."""

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common.kernel import Vector, kernel
from sheldrake.geometry._kernels.model import ContactTable, GeometryModel
from sheldrake.multibody.contact_solvers._kernels.gradient import put_velocity
from sheldrake.multibody.contact_solvers._kernels.laws import static_share
from sheldrake.multibody.contact_solvers._kernels.problem import VC, Contacts, Problem, SolverModel
from sheldrake.multibody.plant._kernels.contact_rows import friction_scale, harmonic_mean
from sheldrake.multibody.tree._kernels.model import TreeModel


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
        a = A.friction_static * friction_scale(tree_model, p, A)
        b = B.friction_static * friction_scale(tree_model, p, B)
        if a + b > 0.0:
            contact = contacts[c]
            put_velocity(contact, problem.v0, VC)
            x, y, _ = contact.vc
            share = static_share(sqrt(x * x + y * y) / solver_model.stiction)
            contact.friction += share * (harmonic_mean(a, b) - contact.friction)
