"""The discrete update: its stages, its scratch, and what the scratch says when a step is over."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common.kernel import Kernel
from sheldrake.geometry._kernels.model import Material
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._building.settings import Settings
from sheldrake.multibody.plant._contact.results import ContactResults
from sheldrake.multibody.plant._context.view import View
from sheldrake.multibody.plant._enums import ContactModel
from sheldrake.multibody.plant._kernels.model import StepWork
from sheldrake.multibody.plant._kernels.ports import refuse_without_geometry
from sheldrake.multibody.plant._step.arrays import step_work_of
from sheldrake.multibody.plant._step.kernel_models import CompiledGeometry, KernelModels
from sheldrake.multibody.plant._step.results import (
    accelerations,
    contact_room,
    contacts_in,
    generalized_contact_forces,
    step_surfaces,
)
from sheldrake.multibody.plant._step.stages import discrete_stages
from sheldrake.systems.framework import LeafSystem
from sheldrake.systems.framework._engine.scratch import size_of

if TYPE_CHECKING:
    from sheldrake.systems.framework._engine.memory import RootView

INTEGERS_KEPT = frozenset(
    "table.pair table.count problem.tree problem.count contacts.index rows.index "
    "surfaces.count surfaces.surface surfaces.face surfaces.contact".split()
)
"""Integers of the scratch that still mean something when a step is over."""


class DiscreteUpdate:
    """The step of a plant with time_step > 0.

    Args:
        elements: The model of the tree.
        settings: Time step and contact model.
        models: The arrays of the kernels.
    """

    vectors = "step"
    """The part of the scratch with vectors of coordinates."""
    kept_parts = ("tree", "step")
    """Parts of the scratch that do not speak of contacts."""

    def __init__(self, elements: Elements, settings: Settings, models: KernelModels) -> None:
        self._elements, self._settings, self._models = elements, settings, models

    def declare(self, plant: LeafSystem, stages: Any) -> None:
        """Declares the update's events.

        Args:
            plant: The system.
            stages: Its `Stages`.
        """
        dt = self._settings.time_step
        if self._settings.sampled:  # what ports report of a step, in its scratch, is state too
            plant.DeclarePeriodicUnrestrictedUpdateEvent(dt, 0.0, stages)
            plant.DeclareForcedUnrestrictedUpdateEvent(stages)
        else:
            plant.DeclarePeriodicDiscreteUpdateEvent(dt, 0.0, stages)
            plant.DeclareForcedDiscreteUpdateEvent(stages)

    def stages(self, models: dict[str, Any]) -> list[Kernel]:
        """The kernels of a step, in order."""
        strict, plant_model = self._settings.contact_model is ContactModel.kHydroelastic, self._models.plant_model
        geometry_model, hydro_model = models["geometry_model"], models["hydro_model"]
        return discrete_stages(geometry_model, plant_model, self._settings.kind.name, hydro_model, strict)

    def refusal(self, root: RootView) -> list[Kernel]:
        """The kernel that refuses to step in the contexts of a root, where geometry is missing."""
        return [refuse_without_geometry] if self._models.misses_geometry(root.source(0) is not None) else []

    def make_work(self, geometry: CompiledGeometry, pushes: bool) -> StepWork:
        """The scratch of a step; `pushes` says whether spatial forces are applied."""
        tree = self._elements.model("MultibodyPlant").tree
        models = tree, self._models.solver_model(geometry), self._models.plant_model
        return step_work_of(*models, geometry.model, geometry.hydro, pushes)

    def scratch_fault(self, scratch: StepWork) -> str:
        """Counts must be those of rows that are there, and no number may be larger than the scratch itself."""
        table, problem, surfaces = scratch.table, scratch.problem, scratch.surfaces
        for count, rows, what in (
            (table.num_contacts, table.pair, "contacts"),
            (problem.num_contacts, scratch.contacts.index, "contacts in its problem"),
            (problem.num_rows, scratch.rows.index, "constraints"),
            (surfaces.num_surfaces, surfaces.surface, "surfaces"),
            (surfaces.num_faces, surfaces.face, "faces"),
        ):
            if not 0 <= count <= len(rows):
                return f"{count} {what} where there is room for {len(rows)}"
        most = size_of(scratch)
        for name in sorted(INTEGERS_KEPT):
            field, part = name.split(".")
            if np.any(np.abs(getattr(getattr(scratch, field), part)) > most):
                return f"numbers in {name} that are none of what there is"
        return ""

    # --- what a step leaves

    def applied_force(self, work: StepWork) -> tuple[np.ndarray, ...]:
        """Where the generalized forces of applied spatial forces belong, and these by body about `root`."""
        return work.step.applied_force, work.step.body_force

    def vdot(self, work: StepWork) -> np.ndarray:
        """Generalized accelerations in the step, shape (nv,)."""
        return accelerations(work, self._settings.time_step)

    def net_actuation(self, work: StepWork) -> np.ndarray:
        """Efforts of the actuators, shape (nu,)."""
        return work.step.net_actuation

    def generalized_contact_forces(self, work: StepWork) -> np.ndarray:
        """J^T f over all contacts, shape (nv,)."""
        return generalized_contact_forces(work, self._settings.time_step)

    def report_contacts(self, view: View, work: StepWork, geometry: CompiledGeometry, results: ContactResults) -> None:
        """Puts the contacts of the step into results."""
        dt, ids = self._settings.time_step, geometry.ids
        results._hydroelastic = step_surfaces(work, geometry.hydro, ids, dt, view.T)
        if view.contact_room is None or view.contact_room.work is not work:
            view.contact_room = contact_room(work, geometry.model.material[:, Material.stiffness], dt)
        results._set_points(contacts_in(view.contact_room, ids, view.frozen.body_indices))
