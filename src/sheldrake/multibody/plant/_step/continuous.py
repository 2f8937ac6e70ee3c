"""The continuous plant: derivatives of its state, and what their scratch says."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common.kernel import Kernel
from sheldrake.geometry._compiled.hydroelastic import face_capacity
from sheldrake.geometry._kernels.hydro_model import hydro_table
from sheldrake.geometry._kernels.model import contact_table
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._building.settings import Settings
from sheldrake.multibody.plant._contact.hydroelastic import infos_of
from sheldrake.multibody.plant._contact.results import ContactResults
from sheldrake.multibody.plant._context.view import View
from sheldrake.multibody.plant._enums import ContactModel
from sheldrake.multibody.plant._kernels.derivatives import (
    ContactForce,
    DerivativeVectors,
    DerivativeWork,
    FaceForce,
    contact_forces,
    plant_derivatives,
    run_surfaces,
    smooth_forces,
    surface_forces,
)
from sheldrake.multibody.plant._kernels.ports import refuse_constraints, refuse_without_geometry
from sheldrake.multibody.plant._step.kernel_models import CompiledGeometry, KernelModels
from sheldrake.multibody.plant._step.results import contacts_in, room_of_derivatives
from sheldrake.multibody.plant._step.stages import contact_stages
from sheldrake.multibody.tree._kernels.model import make_work
from sheldrake.systems.framework import LeafSystem
from sheldrake.systems.framework._declarations import Stages

if TYPE_CHECKING:
    from sheldrake.systems.framework._engine.memory import RootView


class ContinuousDynamics:
    """Time derivatives of a plant with time_step = 0.

    Args:
        elements: The model of the tree.
        settings: Contact model and stiction tolerance.
        models: The arrays of the kernels.
    """

    vectors = "flow"
    """The part of the scratch with vectors of coordinates."""
    kept_parts = ("tree",)
    """Parts of the scratch that do not speak of contacts."""

    def __init__(self, elements: Elements, settings: Settings, models: KernelModels) -> None:
        self._elements, self._settings, self._models = elements, settings, models

    def declare(self, plant: LeafSystem, stages: Stages) -> None:
        """Declares the derivatives."""
        plant.DeclareTimeDerivatives(stages)

    def stages(self, models: dict[str, Any]) -> list[Kernel]:
        """The kernels of the derivatives, in order."""
        strict = self._settings.contact_model is ContactModel.kHydroelastic
        contact = contact_stages(models["geometry_model"], models["hydro_model"], strict, contact_forces)
        surfaces = [surface_forces] if len(models["hydro_model"].pair) else []
        running = [run_surfaces] if len(self._models.plant_model.belt) else []
        return [smooth_forces, *running, *contact, *surfaces, plant_derivatives]

    def refusal(self, root: RootView) -> list[Kernel]:
        """The kernel that refuses derivatives in the contexts of a root, where they cannot be computed."""
        if self._models.misses_geometry(root.source(0) is not None):
            return [refuse_without_geometry]
        return [refuse_constraints] if self._elements.constraints else []

    def make_work(self, geometry: CompiledGeometry, pushes: bool) -> DerivativeWork:
        """The scratch of the derivatives, which is the same whether spatial forces are applied or not (`pushes`)."""
        model = self._elements.model("MultibodyPlant")
        table, nb, nv = contact_table(geometry.model), model.num_bodies, model.nv
        belts = len(self._models.plant_model.belt)
        surfaces = hydro_table(geometry.hydro, face_capacity(geometry.hydro))
        flow = DerivativeVectors(
            np.zeros((len(table.pair), ContactForce.SIZE)), np.zeros((nb, 6)), np.zeros(nv), np.zeros(nv),
            np.zeros(nv), np.zeros(nv), np.zeros(len(model.actuators)), np.zeros(model.nq),
            np.array([self._settings.stiction_tolerance]), np.zeros(nv),
            np.zeros(belts), np.zeros((nb, 3)),
            np.zeros((len(surfaces.face), FaceForce.SIZE)),
        )  # fmt: skip
        return DerivativeWork(make_work(model.tree), table, flow, surfaces)

    def scratch_fault(self, scratch: DerivativeWork) -> str:
        """No fault: nothing is numbered by what the scratch holds."""
        return ""

    # --- what they leave

    def applied_force(self, work: DerivativeWork) -> tuple[np.ndarray, ...]:
        """Where the generalized forces of applied spatial forces belong."""
        return (work.flow.applied_force,)

    def vdot(self, work: DerivativeWork) -> np.ndarray:
        """Generalized accelerations, shape (nv,)."""
        return work.flow.vdot.copy()

    def net_actuation(self, work: DerivativeWork) -> np.ndarray:
        """Efforts of the actuators, shape (nu,)."""
        return work.flow.net_actuation.copy()

    def generalized_contact_forces(self, work: DerivativeWork) -> np.ndarray:
        """J^T f over all contacts, shape (nv,)."""
        return work.flow.contact_force.copy()

    def report_contacts(
        self, view: View, work: DerivativeWork, geometry: CompiledGeometry, results: ContactResults
    ) -> None:
        """Puts the contacts into results."""
        if view.contact_room is None or view.contact_room.work is not work:
            view.contact_room = room_of_derivatives(work)
        results._set_points(contacts_in(view.contact_room, geometry.ids, view.frozen.body_indices))
        results._hydroelastic = infos_of(work.surfaces, geometry.hydro, geometry.ids, work.flow.face, view.T)
