"""What the last discrete step left in its scratch, for the plant's output ports; point contacts of derivatives too."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.geometry._kernels.hydro_model import FaceValue, HydroModel
from sheldrake.multibody.contact_solvers._kernels.problem import ContactState, Participation
from sheldrake.multibody.plant._contact.hydroelastic import HydroelasticContactInfo, infos_of
from sheldrake.multibody.plant._contact.results import PointContactArrays
from sheldrake.multibody.plant._kernels.contact_report import (
    PointContact,
    PointContacts,
    Who,
    report_forces,
    report_points,
)
from sheldrake.multibody.plant._kernels.contacts import contact_frame
from sheldrake.multibody.plant._kernels.model import StepWork
from sheldrake.multibody.tree._kernels.model import TreeModel

if TYPE_CHECKING:
    from sheldrake.common.kernel import Kernel
    from sheldrake.multibody.plant._kernels.derivatives import DerivativeWork
    from sheldrake.multibody.tree import BodyIndex


class ContactRoom(NamedTuple):
    """Where contacts are put together, and a call that does it, bound to the scratch of a step or of derivatives."""

    work: Any
    found: PointContacts
    run: Callable[[], int]


def contact_room(work: StepWork, stiffness: np.ndarray, dt: float) -> ContactRoom:
    """Room for all contacts that the scratch of a step may hold.

    Args:
        work: the scratch.
        stiffness: point stiffness of each geometry, shape (num_geometries,), as in `GeometryModel.material`.
        dt: time step [s].
    """
    given = work.table, work.contacts, np.array(stiffness, float), float(dt)
    return _room(work, work.contacts.state.dtype, report_points, *given)


def room_of_derivatives(work: DerivativeWork) -> ContactRoom:
    """The same of derivatives."""
    return _room(work, work.flow.contact.dtype, report_forces, work.table, work.flow)


def _room(work: Any, dtype: np.dtype, kernel: Kernel, *given: Any) -> ContactRoom:
    room = len(work.table.pair)
    numbers = np.full((room, PointContact.SIZE), 0.0, dtype)
    found = PointContacts(np.zeros((room, Who.SIZE), np.int64), numbers, np.zeros(1, np.int64))
    run = partial(kernel, *given, found) if dtype.hasobject else kernel.bind(*given, found)
    return ContactRoom(work, found, run)


def contacts_in(room: ContactRoom, ids: Sequence[Any], bodies: Sequence[BodyIndex]) -> PointContactArrays:
    """Contacts of the last step, or at the present; none before the first.

    Args:
        room: What they are put together in.
        ids: of the geometries, by row.
        bodies: numbers of the bodies, by row.
    """
    room.run()
    n = int(room.found.total[0])
    return PointContactArrays(room.found.who[:n].copy(), room.found.how[:n].copy(), ids, bodies)


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
