"""What the last discrete step left in its scratch, for the plant's output ports."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from sheldrake.geometry import GeometryId
from sheldrake.geometry._kernels.hydro_model import FaceValue, HydroModel
from sheldrake.geometry._kernels.model import ContactPair, ContactPoint
from sheldrake.multibody.contact_solvers._kernels.laws import INFINITE_STIFFNESS, share
from sheldrake.multibody.contact_solvers._kernels.problem import ContactState, Participation
from sheldrake.multibody.plant._contact.hydroelastic import HydroelasticContactInfo, infos_of
from sheldrake.multibody.plant._kernels.contacts import contact_frame
from sheldrake.multibody.plant._kernels.model import StepWork
from sheldrake.multibody.tree._kernels.model import TreeModel


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


def step_contacts(work: StepWork, stiffness: np.ndarray, dt: float) -> StepContacts:
    """Contacts of the last step; none before the first.

    Args:
        work: the scratch.
        stiffness: point stiffness of each geometry, shape (num_geometries,), as in `GeometryModel.material`.
        dt: time step [s].
    """
    n = int(work.table.num_contacts)
    pair, point, state = work.table.pair[:n].astype(np.int64), work.table.point[:n], work.contacts.state[:n]
    fields = ContactPoint.p_WCa, ContactPoint.p_WCb, ContactPoint.nhat_BA_W
    p_WCa, p_WCb, nhat = (point[:, field.columns].copy() for field in fields)
    gamma, vc = state[:, ContactState.gamma.columns], state[:, ContactState.vc.columns]
    x, y = _tangents(-nhat)
    force = (gamma[:, :1] * x + gamma[:, 1:2] * y - gamma[:, 2:] * nhat) / dt
    k_A, k_B = stiffness[pair[:, ContactPair.geometry_A]], stiffness[pair[:, ContactPair.geometry_B]]
    w_A = _shares(k_A, k_B)[:, None]
    middle = p_WCb + w_A * (p_WCa - p_WCb)
    slip = (vc[:, 0] * vc[:, 0] + vc[:, 1] * vc[:, 1]) ** 0.5
    depth = point[:, ContactPoint.depth]
    felt = ((depth > 0.0) | (gamma[:, 2] > 0.0)).astype(bool)  # not those only seen ahead
    columns_ = (pair, p_WCa, p_WCb, nhat, depth, middle, force, slip, vc[:, 2])
    return StepContacts(*(column[felt] for column in columns_))


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


def _shares(k_A: np.ndarray, k_B: np.ndarray) -> np.ndarray:
    """A's share of each pair of stiffnesses, shape (n,), as `share` has it."""
    if k_A.dtype == object or not (np.isfinite(k_A).all() and np.isfinite(k_B).all() and (k_A + k_B > 0.0).all()):
        return np.array([share(a, b) for a, b in zip(k_A, k_B)], dtype=k_A.dtype)
    return np.where(
        k_A > INFINITE_STIFFNESS,
        np.where(k_B > INFINITE_STIFFNESS, 0.5, 1.0),
        np.where(k_B > INFINITE_STIFFNESS, 0.0, k_A / (k_A + k_B)),
    )


def _tangents(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tangents x, y to unit vectors z, shape (n, 3) each, as `contact_frame` has them."""
    if z.dtype == object:
        frames = [contact_frame(tuple(row)) for row in z]
        return tuple(np.array([frame[k] for frame in frames], dtype=object).reshape(-1, 3) for k in (0, 1))  # type: ignore[return-value]
    n, i = np.arange(len(z)), np.argmin(z * z, axis=1)
    j, k = (i + 1) % 3, (i + 2) % 3
    x, y = np.zeros_like(z), np.empty_like(z)
    length = np.sqrt(1.0 - z[n, i] * z[n, i])
    r = 1.0 / length
    s = -r * z[n, i]
    x[n, j], x[n, k] = -r * z[n, k], r * z[n, j]
    y[n, i], y[n, j], y[n, k] = length, s * z[n, j], s * z[n, k]
    return x, y


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


def point_pair(id_A: GeometryId, id_B: GeometryId, p_WCa: Any, p_WCb: Any, nhat: Any, depth: Any) -> Any:
    """A PenetrationAsPointPair."""
    from sheldrake.geometry import PenetrationAsPointPair

    pair = object.__new__(PenetrationAsPointPair)  # every field is given: no defaults
    pair.id_A, pair.id_B, pair.p_WCa, pair.p_WCb, pair.nhat_BA_W, pair.depth = (
        id_A, id_B, p_WCa, p_WCb, nhat, depth,
    )  # fmt: skip
    return pair
