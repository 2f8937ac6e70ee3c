"""What the last discrete step left in its scratch, for the plant's output ports."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.geometry._kernels import hydro_model as hydro
from sheldrake.geometry._kernels import model as geometry
from sheldrake.geometry._kernels.hydro_model import HydroModel
from sheldrake.multibody.contact_solvers._kernels import problem as columns
from sheldrake.multibody.plant._contact.hydroelastic import HydroelasticContactInfo, infos_of
from sheldrake.multibody.plant._kernels.contact_rows import contact_frame, share
from sheldrake.multibody.plant._kernels.model import StepWork
from sheldrake.multibody.tree._kernels import model as tree_columns
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
    n = int(work.table.count[0])
    pair, point, state = work.table.pair[:n].astype(np.int64), work.table.point[:n], work.contacts.state[:n]
    p_WCa, p_WCb = (point[:, k : k + 3].copy() for k in (int(geometry.P_WCA), int(geometry.P_WCB)))
    nhat = point[:, int(geometry.NHAT_BA_W) : int(geometry.NHAT_BA_W) + 3].copy()
    gamma = state[:, int(columns.GAMMA) : int(columns.GAMMA) + 3]
    vc = state[:, int(columns.VC) : int(columns.VC) + 3]
    x, y = _tangents(-nhat)
    force = (gamma[:, :1] * x + gamma[:, 1:2] * y - gamma[:, 2:] * nhat) / dt
    w_A = np.array([share(a, b) for a, b in zip(stiffness[pair[:, 0]], stiffness[pair[:, 1]])]).reshape(-1, 1)
    middle = p_WCb + w_A * (p_WCa - p_WCb)
    slip = (vc[:, 0] * vc[:, 0] + vc[:, 1] * vc[:, 1]) ** 0.5
    depth = point[:, geometry.DEPTH]
    felt = np.array([d > 0.0 or f > 0.0 for d, f in zip(depth, gamma[:, 2])], bool)  # not those only seen ahead
    columns_ = (pair, p_WCa, p_WCb, nhat, depth, middle, force, slip, vc[:, 2])
    return StepContacts(*(column[felt] for column in columns_))


def step_surfaces(
    work: StepWork, hydro_model: HydroModel, ids: list, dt: float, scalar: type = float
) -> list[HydroelasticContactInfo]:
    """Contact surfaces of the last step, with the forces at its end."""
    surfaces = work.surfaces
    if surfaces.count[hydro.NUM_SURFACES] == 0:
        return []
    F_B_W = np.full((int(surfaces.count[hydro.NUM_FACES]), 6), 0.0, dtype=work.contacts.state.dtype)
    at, normal = int(columns.GAMMA), int(hydro.NORMAL)
    for f, c in enumerate(surfaces.contact[: len(F_B_W)].tolist()):
        if c >= 0:
            z = -surfaces.value[f, normal : normal + 3]
            x, y = contact_frame(tuple(z))
            gamma = work.contacts.state[c, at : at + 3]
            F_B_W[f, 3:] = (gamma[0] * np.array(x) + gamma[1] * np.array(y) + gamma[2] * z) / dt
    return infos_of(surfaces, hydro_model, ids, F_B_W, scalar)


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
    for c in range(int(work.problem.count[columns.NUM_CONTACTS])):
        width = work.contacts.index[c, columns.WIDTH]
        dofs = work.contacts.index[c, int(columns.DOFS) : int(columns.DOFS) + width]
        gamma = work.contacts.state[c, int(columns.GAMMA) : int(columns.GAMMA) + 3]
        tau[dofs] += gamma @ work.contacts.J[3 * c : 3 * c + 3, :width] / dt
    return tau


def bodies_at_hand(work: StepWork, tree_model: TreeModel) -> list[int]:
    """Body rows of the island that the solver worked on last: where it gave up, if it did."""
    begin, end = work.problem.count[columns.TREES_BEGIN], work.problem.count[columns.TREES_END]
    trees = work.problem.tree[begin:end, columns.TREE_ORDER]
    spans = tree_model.tree[np.sort(trees)][:, [tree_columns.TREE_BODY, tree_columns.TREE_NUM_BODIES]]
    return [int(row) for first, n in spans for row in range(first, first + n)]


def accelerations(work: StepWork, dt: float) -> np.ndarray:
    """Change of the generalized velocities over the last step, per time [rad/s² or m/s²], shape (nv,)."""
    return (work.step.v_next - work.step.v) / dt
