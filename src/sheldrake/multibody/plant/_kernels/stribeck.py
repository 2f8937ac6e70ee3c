"""Static and dynamic friction in the convex problem: the coefficient is that of the slip at the start of the step."""

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import load3_at
from sheldrake.common.kernel import kernel
from sheldrake.geometry._kernels import model as geometry
from sheldrake.geometry._kernels.model import ContactTable, GeometryModel
from sheldrake.multibody.contact_solvers._kernels.problem import (
    FRICTION,
    STICTION,
    V0,
    VC,
    Contacts,
    Problem,
    SolverModel,
)
from sheldrake.multibody.contact_solvers._kernels.velocity import contact_velocity

FRICTION_STATIC = geometry.FRICTION_STATIC

SLIPS = 10.0  # times the stiction tolerance: half way from static to dynamic friction


@kernel
def sigmoid(x):
    return x / sqrt(1.0 + x * x)


@kernel(top=True)
def static_friction(
    geometry_model: GeometryModel, solver_model: SolverModel, table: ContactTable, problem: Problem, contacts: Contacts
) -> None:
    """Raises friction coefficients from dynamic to static for points that slip slowly (Kurtz and Castro 2025)."""
    material = geometry_model.material
    for c in range(table.count[0]):
        a = material[table.pair[c, 0], FRICTION_STATIC]
        b = material[table.pair[c, 1], FRICTION_STATIC]
        dynamic = contacts.law[c, FRICTION]
        if a + b > 0.0:
            static = 2.0 * a * b / (a + b)
            contact_velocity(contacts, c, problem.x, V0, VC)
            x, y, _ = load3_at(contacts.state, c, VC)
            s = sqrt(x * x + y * y) / solver_model.option[STICTION]
            share = 0.5 * (1.0 - sigmoid(s - SLIPS) / sigmoid(SLIPS))
            contacts.law[c, FRICTION] = dynamic + share * (static - dynamic)
