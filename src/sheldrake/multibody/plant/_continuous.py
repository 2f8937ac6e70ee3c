"""The continuous plant: derivatives of its state and what its ports report."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.geometry._kernels.model import contact_table
from sheldrake.multibody.plant._contact_results import PointPairContactInfo
from sheldrake.multibody.plant._kernels import derivatives as columns
from sheldrake.multibody.plant._kernels.derivatives import DerivativeWork, plant_derivatives
from sheldrake.multibody.tree._kernels.model import make_work


class ContinuousDynamics:
    """Time derivatives of a plant with time_step = 0."""

    def _declare_derivatives(self) -> None:
        self._declare_time_derivatives(plant_derivatives)

    def _derivative_work(self, geometry_model: Any) -> DerivativeWork:
        table, nb, nv = contact_table(geometry_model), len(self._row_bodies), self._nv
        return DerivativeWork(
            *make_work(self._tree_model), *table, np.zeros((len(table.pair), columns.NUM_CONTACT_COLUMNS)),
            np.zeros((nb, 6)), np.zeros(nv), np.zeros(nv), np.zeros(nv), np.zeros(nv), np.zeros(len(self._actuators)),
            np.zeros(self._nq), np.array([self._stiction_tolerance]), np.zeros(nv),
        )  # fmt: skip

    def _derivatives(self, context: Any) -> DerivativeWork:
        """The work of the derivatives at the present state."""
        view = context._system._view(context)
        stamp = context._store.i[2]
        if view.results is None or view.results[0] != stamp:
            work = view.copy_of(self._scratch_prototype)
            self._run(context, plant_derivatives, work, view.zeros(len(view.x)))
            view.results = stamp, work
        return view.results[1]

    def _continuous_vdot(self, context: Any) -> np.ndarray:
        return self._derivatives(context).vdot

    def _continuous_contact_forces(self, context: Any) -> np.ndarray:
        return self._derivatives(context).contact_force

    def _continuous_actuation(self, context: Any) -> np.ndarray:
        return self._derivatives(context).net_actuation

    def _continuous_contacts(self, context: Any) -> list[PointPairContactInfo]:
        work, (_, ids) = self._derivatives(context), self._compiled_geometry()
        infos = []
        for c in range(int(work.table_count[0])):
            A, B, body_A, body_B = work.table_pair[c]
            point, row = work.table_point[c], work.contact[c]
            pair = self._point_pair(ids[A], ids[B], point[0:3], point[3:6], point[6:9], point[9])
            bodies = (self._row_bodies[body_A].index(), self._row_bodies[body_B].index())
            infos.append(PointPairContactInfo(*bodies, row[:3], row[3:6], row[7], row[6], pair))
        return infos
