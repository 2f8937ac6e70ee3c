"""What a plant reports about accelerations, forces and contacts."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.multibody.plant._contact.results import ContactResults, PointContactArrays, PointPairContactInfo
from sheldrake.multibody.plant._step.results import (
    accelerations,
    generalized_contact_forces,
    step_contacts,
    step_surfaces,
)
from sheldrake.multibody.tree._kernels import dynamics


class Reports:
    """What ports say about accelerations, forces and contacts, of discrete and continuous plants."""

    def _vdot(self, context: Any) -> np.ndarray:
        """Generalized accelerations at the present state, shape (nv,)."""
        self._view(context)  # Whether it is a context of this plant is told there.
        if self.is_discrete():
            return accelerations(self._present_work(context), self._time_step)
        return self._continuous_vdot(context)

    def _step_vdot(self, context: Any) -> np.ndarray:
        """Generalized accelerations in the last step, shape (nv,)."""
        if self.is_discrete():
            return accelerations(self._results(context), self._time_step)
        return self._continuous_vdot(context)

    def _step_accelerations(self, context: Any) -> np.ndarray:
        """Spatial accelerations of the body origins by row, as they were at the beginning of the last step."""
        if not self.is_discrete():
            return self._accelerations(context, self._continuous_vdot(context))
        work = self._results(context)
        tree = work.tree
        A = np.zeros_like(tree.A)
        dynamics.accelerations(self._tree_model, tree, accelerations(work, self._time_step), A)
        dynamics.body_accelerations(self._tree_model, tree, A)
        return A

    def _generalized_contact_forces(self, context: Any) -> np.ndarray:
        if not self.is_discrete():
            return self._continuous_contact_forces(context)
        return generalized_contact_forces(self._results(context), self._time_step)

    def _net_actuation(self, context: Any) -> np.ndarray:
        if not self.is_discrete():
            return self._continuous_actuation(context)
        return self._results(context).step.net_actuation

    def _contact_results(self, context: Any) -> ContactResults:
        results = ContactResults()
        results._plant = self
        if not self.is_discrete():
            results._point_pairs = self._continuous_contacts(context)
            results._hydroelastic = self._continuous_surfaces(context)
            return results
        _, model, ids, hydro = self._geometry_of(context)
        work = self._results(context)
        results._hydroelastic = step_surfaces(work, hydro, ids, self._time_step, context._system._scalar)
        contacts = step_contacts(work, model.material[:, 0], self._time_step)
        pair = contacts.pair.tolist()
        bodies = [body.index() for body in self._row_bodies]
        arrays = PointContactArrays(
            [bodies[a] for _, _, a, _ in pair],
            [bodies[b] for _, _, _, b in pair],
            [ids[A] for A, *_ in pair],
            [ids[B] for _, B, *_ in pair],
            contacts.f_Bc_W,
            contacts.p_WC,
        )
        results._set_points(arrays, lambda: self._contact_infos(contacts, arrays))
        return results

    def _contact_infos(self, contacts: Any, arrays: PointContactArrays) -> list[PointPairContactInfo]:
        """Point contacts as objects."""
        return [
            PointPairContactInfo(
                arrays.body_A[i],
                arrays.body_B[i],
                contacts.f_Bc_W[i],
                contacts.p_WC[i],
                contacts.separation_speed[i],
                contacts.slip_speed[i],
                self._point_pair(
                    arrays.geometry_A[i],
                    arrays.geometry_B[i],
                    contacts.p_WCa[i],
                    contacts.p_WCb[i],
                    contacts.nhat_BA_W[i],
                    contacts.depth[i],
                ),
            )
            for i in range(len(contacts.depth))
        ]

    def _point_pair(self, id_A: Any, id_B: Any, p_WCa: Any, p_WCb: Any, nhat: Any, depth: Any) -> Any:
        from sheldrake.geometry import PenetrationAsPointPair

        pair = object.__new__(PenetrationAsPointPair)  # every field is given: no defaults
        pair.id_A, pair.id_B, pair.p_WCa, pair.p_WCb, pair.nhat_BA_W, pair.depth = (
            id_A, id_B, p_WCa, p_WCb, nhat, depth,
        )  # fmt: skip
        return pair
