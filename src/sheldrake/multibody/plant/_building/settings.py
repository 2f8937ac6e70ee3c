"""What is chosen before Finalize(): time step, contact model, approximation, and the numbers of the contact laws."""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch
from sheldrake.geometry import HydroelasticContactRepresentation
from sheldrake.multibody.contact_solvers._kernels.solve import Approximation
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._enums import ContactModel, DiscreteContactApproximation, DiscreteContactSolver

_Choice = TypeVar("_Choice")


def checked_time_step(time_step: float) -> float:
    """The time step that a plant is made with.

    Raises:
        TypeError: it is no number.
        RuntimeError: it is negative or not finite.
    """
    try:
        time_step = float(time_step)
    except (TypeError, ValueError):
        raise TypeError(
            f"MultibodyPlant(): incompatible constructor arguments. time_step must be a float, not {time_step!r}."
        ) from None
    if not (time_step >= 0.0 and np.isfinite(time_step)):
        raise RuntimeError(f"MultibodyPlant(): time_step must be zero or positive and finite, not {time_step}.")
    return time_step


class Settings:
    """How a plant advances and how its contact is modelled.

    Args:
        elements: Tell whether it is still time to choose.
        time_step: Period of the discrete update [s], 0 for continuous state.
    """

    def __init__(self, elements: Elements, time_step: float) -> None:
        self._elements, self.time_step = elements, time_step
        self.sampled = self.is_discrete()
        """Whether ports that depend on forces report the last step."""
        self.contact_model = ContactModel.kHydroelasticWithFallback
        self.approximation = DiscreteContactApproximation.kLagged
        self.representation = self.GetDefaultContactSurfaceRepresentation(time_step)
        self.penetration_allowance = 1e-3
        self.stiction_tolerance = 1e-4
        self.near_rigid_threshold = 1.0

    def is_discrete(self) -> bool:
        """Whether the state is discrete."""
        return self.time_step > 0.0

    @property
    def kind(self) -> Approximation:
        """What the approximation is made of."""
        return self.approximation._made_of

    def SetUseSampledOutputPorts(self, use_sampled_output_ports: bool) -> None:
        """Whether ports that depend on forces report the last step (the default) or are computed when asked.

        Raises:
            RuntimeError: the plant is finalized, or continuous and sampling is asked for.
        """
        self._elements.require_not_finalized("SetUseSampledOutputPorts")
        if use_sampled_output_ports and not self.is_discrete():
            raise RuntimeError("SetUseSampledOutputPorts(): a continuous plant (time_step = 0) has no step to sample.")
        self.sampled = bool(use_sampled_output_ports)

    def has_sampled_output_ports(self) -> bool:
        """Whether ports that depend on forces report the last step."""
        return self.sampled

    def refuse_dry_friction(self) -> None:
        """Only solvers that know scalar rows know dry friction.

        Raises:
            RuntimeError: a joint has it, and the plant is continuous or its contact kTamsi.
        """
        if self.is_discrete() and self.kind.scalar_rows:
            return
        rubbing = [joint.name() for joint in self._elements.joints if joint._dry_friction.any()]
        if rubbing:
            raise RuntimeError(
                f"Finalize(): joint {rubbing[0]!r} has dry friction, which only discrete plants with kLagged, "
                "kSimilar or kSap contact have."
            )

    def _chosen(self, call: str, kind: type[_Choice], value: object) -> _Choice:
        self._elements.require_not_finalized(call)
        if not isinstance(value, kind):
            raise Mismatch(f"{call}(): incompatible function arguments. Expected a {kind.__name__}, not {value!r}.")
        return value

    @checked
    def set_contact_model(self, model: ContactModel) -> None:
        """Chooses point contact, hydroelastic contact, or the latter where possible."""
        self.contact_model = self._chosen("set_contact_model", ContactModel, model)

    def get_contact_model(self) -> ContactModel:
        """The contact model."""
        return self.contact_model

    @checked
    def set_discrete_contact_approximation(self, approximation: DiscreteContactApproximation) -> None:
        """Chooses how the discrete update models contact.

        Raises:
            RuntimeError: the plant is continuous or finalized, or has constraints, which kTamsi does not know.
        """
        self._elements.require_not_finalized("set_discrete_contact_approximation")
        if not self.is_discrete():
            raise RuntimeError(
                "set_discrete_contact_approximation(): the plant is continuous (time_step = 0); the approximation is "
                "for discrete plants."
            )
        if not approximation._made_of.scalar_rows and self._elements.constraints:
            raise RuntimeError(
                f"set_discrete_contact_approximation(): this plant has {len(self._elements.constraints)} constraints, "
                "and TAMSI does not support constraints."
            )
        self.approximation = self._chosen(
            "set_discrete_contact_approximation", DiscreteContactApproximation, approximation
        )

    def get_discrete_contact_approximation(self) -> DiscreteContactApproximation:
        """How the discrete update models contact."""
        return self.approximation

    def get_discrete_contact_solver(self) -> DiscreteContactSolver:
        """The solver of the discrete update."""
        return DiscreteContactSolver.kSap if self.kind.scalar_rows else DiscreteContactSolver.kTamsi

    @staticmethod
    @checked
    def GetDefaultContactSurfaceRepresentation(time_step: float) -> HydroelasticContactRepresentation:
        """How hydroelastic contact surfaces are tessellated: polygons for a discrete plant, else triangles."""
        kinds = HydroelasticContactRepresentation
        return kinds.kTriangle if time_step == 0.0 else kinds.kPolygon

    @checked
    def set_contact_surface_representation(self, surface_representation: HydroelasticContactRepresentation) -> None:
        """Chooses how hydroelastic contact surfaces are tessellated."""
        call = "set_contact_surface_representation"
        self.representation = self._chosen(call, HydroelasticContactRepresentation, surface_representation)

    def get_contact_surface_representation(self) -> HydroelasticContactRepresentation:
        """How hydroelastic contact surfaces are tessellated."""
        return self.representation

    def _positive(self, call: str, value: float) -> float:
        value = float(value)
        if not value > 0.0:
            raise RuntimeError(f"{call}(): must be positive, not {value}.")
        return value

    def set_penetration_allowance(self, penetration_allowance: float = 1e-3) -> None:
        """How deep a body may sink in under its weight where the geometry says no stiffness [m]."""
        self.penetration_allowance = self._positive("set_penetration_allowance", penetration_allowance)

    def get_contact_penalty_method_time_scale(self) -> float:
        """Time scale of contact under the penetration allowance [s].

        Raises:
            RuntimeError: before Finalize().
        """
        self._elements.require_finalized("get_contact_penalty_method_time_scale")
        return (self.penetration_allowance / self._elements.gravity_strength()) ** 0.5

    def set_stiction_tolerance(self, v_stiction: float = 1e-3) -> None:
        """Slip below which friction counts as sticking [m/s]."""
        self.stiction_tolerance = self._positive("set_stiction_tolerance", v_stiction)

    def set_sap_near_rigid_threshold(self, near_rigid_threshold: float = 1.0) -> None:
        """How stiff contact may be before kSap softens it, relative to the time step."""
        self._elements.require_not_finalized("set_sap_near_rigid_threshold")
        if not near_rigid_threshold >= 0.0:
            raise RuntimeError(f"set_sap_near_rigid_threshold(): must not be negative, not {near_rigid_threshold}.")
        self.near_rigid_threshold = float(near_rigid_threshold)

    def get_sap_near_rigid_threshold(self) -> float:
        """The near-rigid threshold of kSap."""
        return self.near_rigid_threshold
