"""The continuous plant: derivatives of its state and what its ports report."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.geometry._compiled.hydroelastic import face_capacity
from sheldrake.geometry._kernels.hydro_model import hydro_table
from sheldrake.geometry._kernels.model import contact_table
from sheldrake.multibody.plant._contact.hydroelastic import HydroelasticContactInfo, infos_of
from sheldrake.multibody.plant._contact.results import PointPairContactInfo
from sheldrake.multibody.plant._enums import ContactModel
from sheldrake.multibody.plant._kernels import derivatives as columns
from sheldrake.multibody.plant._kernels.derivatives import (
    DerivativeVectors,
    DerivativeWork,
    contact_forces,
    plant_derivatives,
    smooth_forces,
)
from sheldrake.multibody.plant._kernels.hydro_forces import surface_forces
from sheldrake.multibody.plant._kernels.ports import refuse_constraints, refuse_without_geometry
from sheldrake.multibody.plant._step.stages import contact_stages
from sheldrake.multibody.tree._kernels.model import make_work
from sheldrake.systems.framework._declarations import Stages


class ContinuousDynamics:
    """Time derivatives of a plant with time_step = 0."""

    def _declare_derivatives(self) -> None:
        self._declare_time_derivatives(Stages(ContinuousDynamics._derivative_stages_in))

    def _derivative_stages(self, models: dict[str, Any]) -> list[Any]:
        strict = self._contact_model is ContactModel.kHydroelastic
        contact = contact_stages(models["geometry_model"], models["hydro_model"], strict, contact_forces)
        surfaces = [surface_forces] if len(models["hydro_model"].pair) else []
        return [smooth_forces, *contact, *surfaces, plant_derivatives]

    def _derivative_stages_in(self, root: Any) -> list[Any]:
        if self._misses_geometry(root.source(0) is not None):
            return [refuse_without_geometry]
        if self._constraints:
            return [refuse_constraints]
        return self._derivative_stages(self._kernel_models(root))

    def _derivative_work(self, geometry: Any) -> DerivativeWork:
        table, nb, nv = contact_table(geometry.model), len(self._row_bodies), self._nv
        surfaces = hydro_table(geometry.hydro, face_capacity(geometry.hydro))
        flow = DerivativeVectors(
            np.zeros((len(table.pair), columns.NUM_CONTACT_COLUMNS)), np.zeros((nb, 6)), np.zeros(nv), np.zeros(nv),
            np.zeros(nv), np.zeros(nv), np.zeros(len(self._actuators)), np.zeros(self._nq),
            np.array([self._stiction_tolerance]), np.zeros(nv), np.zeros((len(surfaces.face), 6)),
        )  # fmt: skip
        return DerivativeWork(make_work(self._tree_model), table, flow, surfaces)

    def _derivatives(self, context: Any) -> DerivativeWork:
        """The work of the derivatives at the present state."""
        return self._present_work(context)

    def _continuous_vdot(self, context: Any) -> np.ndarray:
        if context._system._scalar is AutoDiffXd:  # the machine code on complex numbers leaves no work
            return context._system.EvalTimeDerivatives(context).get_generalized_velocity().CopyToVector()
        return self._derivatives(context).flow.vdot

    def _continuous_contact_forces(self, context: Any) -> np.ndarray:
        return self._derivatives(context).flow.contact_force

    def _continuous_actuation(self, context: Any) -> np.ndarray:
        return self._derivatives(context).flow.net_actuation

    def _continuous_contacts(self, context: Any) -> list[PointPairContactInfo]:
        work, ids = self._derivatives(context), self._geometry_of(context).ids
        infos = []
        for c in range(int(work.table.count[0])):
            A, B, body_A, body_B = work.table.pair[c]
            point, row = work.table.point[c], work.flow.contact[c]
            pair = self._point_pair(ids[A], ids[B], point[0:3], point[3:6], point[6:9], point[9])
            bodies = (self._row_bodies[body_A].index(), self._row_bodies[body_B].index())
            infos.append(PointPairContactInfo(*bodies, row[:3], row[3:6], row[7], row[6], pair))
        return infos

    def _continuous_surfaces(self, context: Any) -> list[HydroelasticContactInfo]:
        work, geometry = self._derivatives(context), self._geometry_of(context)
        scalar = context._system._scalar
        return infos_of(work.surfaces, geometry.hydro, geometry.ids, work.flow.face, scalar)
