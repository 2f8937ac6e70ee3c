"""Reaction forces of joints."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sheldrake.common.kernel import Kernel
from sheldrake.multibody.math import SpatialForce, SpatialForce_
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._building.frozen_model import FrozenModel
from sheldrake.multibody.plant._building.geometry import PlantGeometry
from sheldrake.multibody.plant._building.settings import Settings
from sheldrake.multibody.plant._contact.hydroelastic import HydroelasticContactInfo
from sheldrake.multibody.plant._contact.results import ContactResults
from sheldrake.multibody.plant._context.contexts import Contexts
from sheldrake.multibody.plant._context.view import View
from sheldrake.multibody.plant._kernels.model import StepWork
from sheldrake.multibody.plant._kernels.reactions import JointEnd, JointEnds, add_constraint_forces, calc_reactions
from sheldrake.multibody.plant._step.advance import Advance
from sheldrake.multibody.plant._step.applied_forces import AppliedForces
from sheldrake.multibody.plant._step.kernel_models import KernelModels
from sheldrake.multibody.plant._step.reports import Reports
from sheldrake.multibody.tree._kernels import forces
from sheldrake.multibody.tree._kernels.model import BodyInertia, TreeWork
from sheldrake.systems.framework import Context


class Reactions:
    """Forces that joints transmit.

    Args:
        elements: Joints and constraints.
        settings: Discrete or continuous; sampled ports or not.
        geometry: Whose shapes touch.
        contexts: The state.
        applied: Forces from outside.
        models: Constants of the kernels.
        advance: The last step.
        reports: Contacts.
    """

    def __init__(
        self,
        elements: Elements,
        settings: Settings,
        geometry: PlantGeometry,
        contexts: Contexts,
        applied: AppliedForces,
        models: KernelModels,
        advance: Advance,
        reports: Reports,
    ) -> None:
        self._elements, self._settings, self._geometry = elements, settings, geometry
        self._contexts, self._applied, self._models = contexts, applied, models
        self._advance, self._reports = advance, reports

    def forces(self, context: Context) -> list[SpatialForce]:
        """F_CJc_Jc of every joint: the spatial force on its child at its frame M, expressed in M.

        Newton-Euler on each body at the accelerations of the last step (of the present state when ports are not
        sampled), tip to base: what moves a body, less what acts on it otherwise, comes through its inboard joint.
        """
        view, work = self._contexts.view(context), self._advance.results(context)
        model, make_each = view.frozen, view.of(SpatialForce_)._make_each
        no_step_yet = self._settings.sampled and not np.count_nonzero(work.tree.inertia[1:, BodyInertia.mass])
        if no_step_yet:
            return make_each(view.zeros(len(model.rows_by_joint), 6))
        results = self._reports.contact_results(context)
        room = self._room_for(view, work, results.num_point_pair_contacts())
        _fill_contacts(room, results, model.row_list)
        room.vdot[:] = self._reports.generalized_acceleration(context)
        room.other[:] = 0.0 if view.S.dtype == float else view.zeros(1)[0]
        self._add_other_forces(context, work, results, room)
        if status := room.run():
            raise RuntimeError(f"reaction_forces: calc_reactions() returned status {status}.")
        return make_each(room.reactions[model.rows_by_joint])

    def _room_for(self, view: View, work: StepWork, contacts: int) -> _Room:
        """What the kernel works on, and the kernel bound to it; kept while the scratch is the same."""
        room = view.reactions
        if room is None or room.tree is not work.tree or len(room.points) < contacts:
            room = view.reactions = _make_room(view, work.tree, max(4, 2 * contacts))
            if self._settings.is_discrete() and self._elements.constraints:
                held = work.rows, work.problem, self._settings.time_step, room.other
                given = view.model, self._models.plant_model, view.p, work.tree, *held
                room.constraints.append(_bound(view, add_constraint_forces, given))
        return room

    def _add_other_forces(self, context: Context, work: StepWork, results: ContactResults, room: _Room) -> None:
        """Adds forces of contact surfaces, of constraints, and applied ones, about `root`, by row."""
        view, other = self._contexts.view(context), room.other
        for surface in results._hydroelastic:
            self._add_surface_force(view.frozen, work.tree, surface, other)
        if not self._settings.is_discrete():
            if self._applied.are_given(context):
                other += self._applied.amount(context)[1]
            return
        for add in room.constraints:
            add()
        if len(work.step.body_force):
            other += work.step.body_force

    def _add_surface_force(
        self, model: FrozenModel, tree: TreeWork, info: HydroelasticContactInfo, F: np.ndarray
    ) -> None:
        """Adds the force of a contact surface to F, on both bodies."""
        surface, force = info.contact_surface(), info.F_Ac_W().get_coeffs()
        geometries = self._geometry.required_scene_graph()._default_state().geometries
        for geometry_id, sign in ((surface.id_M(), 1.0), (surface.id_N(), -1.0)):
            row = model.row_of(self._geometry.body_of_frame[geometries[geometry_id].frame])
            F[row, :3] += sign * force[:3]
            point, f = tuple(surface.centroid()), tuple(sign * force[3:])
            forces.add_point_force(model.tree, tree, F, row, point, f)


class _Room(NamedTuple):
    """Arrays of `calc_reactions` and a call on them."""

    tree: TreeWork
    vdot: np.ndarray
    touching: np.ndarray
    points: np.ndarray
    forces: np.ndarray
    other: np.ndarray
    reactions: np.ndarray
    run: Callable[[], int]
    constraints: list[Callable[[], int]]
    """What adds their forces to `other`; nothing where there are none."""


def _make_room(view: View, tree: TreeWork, contacts: int) -> _Room:
    model, nb = view.frozen, view.nb
    ends = np.zeros((nb, JointEnd.SIZE), np.int64)
    for row, step in enumerate(model.steps, start=1):
        ends[row] = *model.place_of(step.joint.frame_on_child()), -1 if step.reversed else 1
    touching, points, pushes = np.zeros(2 * contacts + 1, np.int64), view.zeros(contacts, 3), view.zeros(contacts, 3)
    vdot, other, reactions = view.zeros(view.nv), view.zeros(nb, 6), view.zeros(nb, 6)
    A, F = view.zeros(nb, 6), view.zeros(nb, 6)
    given = view.model, model.forces, view.p, tree, vdot, touching, points, pushes, other, JointEnds(ends), A, F
    run = _bound(view, calc_reactions, (*given, reactions))
    return _Room(tree, vdot, touching, points, pushes, other, reactions, run, [])


def _bound(view: View, kernel: Kernel, arguments: tuple) -> Callable[[], int]:
    return kernel.bind(*arguments) if view.native else lambda: kernel(*arguments) or 0


def _fill_contacts(room: _Room, results: ContactResults, row_of: list[int]) -> None:
    """Puts point contacts where the kernel reads them."""
    count = results.num_point_pair_contacts()
    room.touching[-1] = count
    if not count:
        return
    arrays = results._arrays
    if arrays is None:
        infos = results._point_pairs
        pairs = [(info.bodyA_index(), info.bodyB_index()) for info in infos]
        room.touching[: 2 * count] = [row_of[int(body)] for pair in pairs for body in pair]
        room.points[:count] = [info.contact_point() for info in infos]
        room.forces[:count] = [info.contact_force() for info in infos]
    else:
        room.touching[: 2 * count] = arrays.pair[:, 2:].ravel()
        room.points[:count], room.forces[:count] = arrays.p_WC, arrays.f_Bc_W
