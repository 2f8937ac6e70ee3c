"""Surfaces that run around their bodies, as belts do: bodies stand still, what touches them is dragged along.

At a point with outward normal n the surface of a body runs at s (a x n), s being its speed and a its axis. So what B
moves at against A, where nhat points out of B into A, is (s_A a_A + s_B a_B) x nhat more than what the bodies do.
"""

from sheldrake.common._kernels.vec import add3, cross3, dot3, load3, neg3, rotate, scale3, store3
from sheldrake.common.kernel import kernel
from sheldrake.geometry._kernels.hydro_model import HydroTable
from sheldrake.geometry._kernels.model import ContactTable, GeometryModel
from sheldrake.multibody.contact_solvers._kernels.problem import Contacts
from sheldrake.multibody.plant._kernels.contacts import contact_frame
from sheldrake.multibody.plant._kernels.model import PlantModel, StepVectors
from sheldrake.multibody.tree._kernels.model import TreeWork


@kernel
def put_turns(plant_model, tree, speed, turn):
    """s a of the bodies with belts, in W [m/s]; that of others is zero."""
    for k in range(len(plant_model.belts)):
        row = plant_model.belts[k].body
        store3(turn, row, scale3(rotate(tree[row].R_WB, plant_model.belt_axes[k].axis_B), speed[k]))


@kernel
def surface_drift(turn, body_A, body_B, nhat):
    """What B's surface on B moves at against that of A on A, along the surface [m/s]."""
    return cross3(add3(load3(turn, body_A), load3(turn, body_B)), nhat)


@kernel
def put_drift(contact, turn, body_A, body_B, nhat):
    """The drift of a contact, in its frame."""
    x, y, _ = contact_frame(neg3(nhat))
    drift = surface_drift(turn, body_A, body_B, nhat)
    contact.drift = (dot3(x, drift), dot3(y, drift))


@kernel(top=True)
def contact_drifts(
    tree: TreeWork,
    table: ContactTable,
    surfaces: HydroTable,
    contacts: Contacts,
    step: StepVectors,
    geometry_model: GeometryModel,
    plant_model: PlantModel,
) -> None:
    """What belts run at where something touches them: slip that bodies at rest have."""
    put_turns(plant_model, tree, step.surface_speed, step.surface_turn)
    for c in range(table.num_contacts):
        found = table[c]
        put_drift(contacts[c], step.surface_turn, found.body_A, found.body_B, found.nhat_BA_W)
    for f in range(surfaces.num_faces):
        c = surfaces.contact[f]
        if c >= 0:
            patch = surfaces.patches[surfaces[f].surface]
            body_A, body_B = geometry_model[patch.geometry_M].body, geometry_model[patch.geometry_N].body
            put_drift(contacts[c], step.surface_turn, body_A, body_B, surfaces[f].normal)
