"""What the last discrete step left in its scratch, for the plant's output ports."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sheldrake.geometry._kernels.hydro_model import FaceValue, HydroModel
from sheldrake.multibody.contact_solvers._kernels.problem import ContactState, Participation
from sheldrake.multibody.plant._contact.hydroelastic import HydroelasticContactInfo, infos_of
from sheldrake.multibody.plant._kernels.contact_report import PointContact, PointContacts, Who, report_points
from sheldrake.multibody.plant._kernels.contacts import contact_frame
from sheldrake.multibody.plant._kernels.model import StepWork
from sheldrake.multibody.tree._kernels.model import TreeModel

if TYPE_CHECKING:
    pass


class StepContacts(NamedTuple):
    """Point contacts of the last step, in the order of the solver (sorted by pair of geometries).

    Attributes:
        pair: rows of the geometry model (A, B), then body rows (A, B), shape (n, 4).
        p_WCa: point on A's surface [m], shape (n, 3).
        p_WCb: point on B's surface [m], shape (n, 3).
        nhat_BA_W: unit normal from B into A, shape (n, 3).
        depth: penetration at the step's start [m], shape (n,).
        p_WC: contact point [m], shape (n, 3).
        f_Bc_W: contact force on B at C [N], shape (n, 3).
        slip_speed: tangential speed of B against A at the step's end [m/s], shape (n,).
        separation_speed: normal speed at the step's end, positive when separating [m/s], shape (n,).
    """

    pair: np.ndarray
    p_WCa: np.ndarray
    p_WCb: np.ndarray
    nhat_BA_W: np.ndarray
    depth: np.ndarray
    p_WC: np.ndarray
    f_Bc_W: np.ndarray
    slip_speed: np.ndarray
    separation_speed: np.ndarray


class ContactRoom(NamedTuple):
    """Where the contacts of a step are put together, and a call that does it, bound to the scratch of the step."""

    work: StepWork
    found: PointContacts
    run: Callable[[], int]


def contact_room(work: StepWork, stiffness: np.ndarray, dt: float) -> ContactRoom:
    """Room for all contacts that the scratch of a step may hold.

    Args:
        work: the scratch.
        stiffness: point stiffness of each geometry, shape (num_geometries,), as in `GeometryModel.material`.
        dt: time step [s].
    """
    room, is_float = len(work.table.pair), work.contacts.state.dtype != object
    numbers = np.full((room, PointContact.SIZE), 0.0, work.contacts.state.dtype)
    found = PointContacts(np.zeros((room, Who.SIZE), np.int64), numbers, np.zeros(1, np.int64))
    given = work.table, work.contacts, np.array(stiffness, float), float(dt), found
    return ContactRoom(work, found, report_points.bind(*given) if is_float else partial(report_points, *given))


def step_contacts(room: ContactRoom) -> StepContacts:
    """Contacts of the last step; none before the first."""
    room.run()
    n = int(room.found.total[0])
    if n == 0:
        return _NO_CONTACTS
    how, c = room.found.how[:n].copy(), PointContact
    vectors = (how[:, field.columns] for field in (c.p_WCa, c.p_WCb, c.nhat_BA_W, c.p_WC, c.f_Bc_W))
    p_WCa, p_WCb, nhat_BA_W, p_WC, f_Bc_W = vectors
    depth, slip, separation = (how[:, field] for field in (c.depth, c.slip_speed, c.separation_speed))
    return StepContacts(room.found.who[:n].copy(), p_WCa, p_WCb, nhat_BA_W, depth, p_WC, f_Bc_W, slip, separation)


_NO_VECTORS, _NO_NUMBERS = np.zeros((0, 3)), np.zeros(0)
_NO_CONTACTS = StepContacts(
    pair=np.zeros((0, 4), np.int64), p_WCa=_NO_VECTORS, p_WCb=_NO_VECTORS, nhat_BA_W=_NO_VECTORS, depth=_NO_NUMBERS,
    p_WC=_NO_VECTORS, f_Bc_W=_NO_VECTORS, slip_speed=_NO_NUMBERS, separation_speed=_NO_NUMBERS,
)  # fmt: skip


def step_surfaces(
    work: StepWork, hydro_model: HydroModel, ids: list, dt: float, scalar: type = float
) -> list[HydroelasticContactInfo]:
    """Contact surfaces of the last step, with the forces at its end."""
    surfaces = work.surfaces
    if surfaces.num_surfaces == 0:
        return []
    F_B_W = np.full((int(surfaces.num_faces), 6), 0.0, dtype=work.contacts.state.dtype)
    for f, c in enumerate(surfaces.contact[: len(F_B_W)].tolist()):
        if c >= 0:
            z = -surfaces.value[f, FaceValue.normal.columns]
            x, y, _ = contact_frame(tuple(z))
            gamma = work.contacts[c].gamma
            F_B_W[f, 3:] = (gamma[0] * np.array(x) + gamma[1] * np.array(y) + gamma[2] * z) / dt
    return infos_of(surfaces, hydro_model, ids, F_B_W, scalar)


def generalized_contact_forces(work: StepWork, dt: float) -> np.ndarray:
    """J^T f over all contacts of the last step [N or N m], shape (nv,)."""
    tau = np.zeros(len(work.step.v), dtype=work.step.v.dtype)
    for c in range(int(work.problem.num_contacts)):
        contact = work.contacts[c]
        dofs = contact.dofs[: contact.width]
        gamma = work.contacts.state[c, ContactState.gamma.columns]
        tau[dofs] += gamma @ contact.J[:, : contact.width] / dt
    return tau


def bodies_at_hand(work: StepWork, tree_model: TreeModel) -> list[int]:
    """Body rows of the island that the solver worked on last: where it gave up, if it did."""
    trees = work.problem.tree[work.problem.trees_begin : work.problem.trees_end, Participation.order]
    islands = [tree_model.trees[t] for t in np.sort(trees)]
    return [int(b) for t in islands for b in range(t.first_body, t.first_body + t.num_bodies)]


def accelerations(work: StepWork, dt: float) -> np.ndarray:
    """Change of the generalized velocities over the last step, per time [rad/s² or m/s²], shape (nv,)."""
    return (work.step.v_next - work.step.v) / dt
