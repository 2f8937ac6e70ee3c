"""What a plant reports about forces and contacts."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.multibody.plant._contact.results import ContactResults
from sheldrake.multibody.plant._context.contexts import Contexts
from sheldrake.multibody.plant._step.advance import Advance
from sheldrake.multibody.plant._step.kernel_models import KernelModels
from sheldrake.systems.framework import Context


class Reports:
    """What ports say about forces and contacts, of discrete and continuous plants.

    Args:
        plant: The plant, which contact results name.
        contexts: What is known of one.
        models: The geometry of contexts.
        advance: The step, or the derivatives.
    """

    def __init__(self, plant: Any, contexts: Contexts, models: KernelModels, advance: Advance) -> None:
        self._plant, self._contexts, self._models, self._advance = plant, contexts, models, advance

    def generalized_acceleration(self, context: Context) -> np.ndarray:
        """Generalized accelerations in the last step, shape (nv,)."""
        return self._advance.vdot(context, sampled=True)

    def generalized_contact_forces(self, context: Context) -> np.ndarray:
        """J^T f over all contacts [N or N m], shape (nv,)."""
        return self._advance.equations.generalized_contact_forces(self._advance.results(context, motion=False))

    def net_actuation(self, context: Context) -> np.ndarray:
        """Efforts that actuators exert [N m or N], shape (nu,)."""
        return self._advance.equations.net_actuation(self._advance.results(context, motion=False))

    def contact_results(self, context: Context) -> ContactResults:
        """All contacts."""
        results = ContactResults()
        results._plant = self._plant
        geometry, work = self._models.geometry_of(context), self._advance.results(context, motion=False)
        self._advance.equations.report_contacts(self._contexts.view(context), work, geometry, results)
        return results
