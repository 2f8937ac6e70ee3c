"""Contact model, approximation, and the numbers of the contact laws."""

from __future__ import annotations

from typing import Any

from sheldrake.geometry import HydroelasticContactRepresentation
from sheldrake.multibody.plant._enums import ContactModel, DiscreteContactApproximation, DiscreteContactSolver


class ContactSettings:
    """Settings to be made before Finalize()."""

    def _start_contact_settings(self) -> None:
        self._contact_model = ContactModel.kHydroelasticWithFallback
        self._approximation = DiscreteContactApproximation.kLagged
        self._representation = self.GetDefaultContactSurfaceRepresentation(self._time_step)
        self._penetration_allowance = 1e-3
        self._stiction_tolerance = 1e-4
        self._near_rigid_threshold = 1.0

    def _set_before_finalize(self, call: str, attribute: str, kind: type, value: Any) -> None:
        self._require_not_finalized(call)
        if not isinstance(value, kind):
            raise TypeError(f"{call}(): incompatible function arguments. Expected a {kind.__name__}, not {value!r}.")
        setattr(self, attribute, value)

    def set_contact_model(self, model: ContactModel) -> None:
        """Chooses point contact, hydroelastic contact, or the latter where possible."""
        self._set_before_finalize("set_contact_model", "_contact_model", ContactModel, model)

    def get_contact_model(self) -> ContactModel:
        """The contact model."""
        return self._contact_model

    def set_discrete_contact_approximation(self, approximation: DiscreteContactApproximation) -> None:
        """Chooses how the discrete update models contact.

        Raises:
            RuntimeError: the plant is continuous or finalized, or has constraints, which kTamsi does not know.
        """
        self._require_not_finalized("set_discrete_contact_approximation")
        if not self.is_discrete():
            raise RuntimeError(
                "set_discrete_contact_approximation(): the plant is continuous (time_step = 0); the approximation is "
                "for discrete plants."
            )
        if approximation is DiscreteContactApproximation.kTamsi and self._constraints:
            raise RuntimeError(
                f"set_discrete_contact_approximation(): this plant has {len(self._constraints)} constraints, and TAMSI "
                "does not support constraints."
            )
        self._set_before_finalize(
            "set_discrete_contact_approximation", "_approximation", DiscreteContactApproximation, approximation
        )

    def get_discrete_contact_approximation(self) -> DiscreteContactApproximation:
        """How the discrete update models contact."""
        return self._approximation

    def get_discrete_contact_solver(self) -> DiscreteContactSolver:
        """The solver of the discrete update."""
        tamsi = self._approximation is DiscreteContactApproximation.kTamsi
        return DiscreteContactSolver.kTamsi if tamsi else DiscreteContactSolver.kSap

    @staticmethod
    def GetDefaultContactSurfaceRepresentation(time_step: float) -> HydroelasticContactRepresentation:
        """How hydroelastic contact surfaces are tessellated: polygons for a discrete plant, else triangles."""
        kinds = HydroelasticContactRepresentation
        return kinds.kTriangle if time_step == 0.0 else kinds.kPolygon

    def set_contact_surface_representation(self, surface_representation: HydroelasticContactRepresentation) -> None:
        """Chooses how hydroelastic contact surfaces are tessellated."""
        call = "set_contact_surface_representation"
        self._set_before_finalize(call, "_representation", HydroelasticContactRepresentation, surface_representation)

    def get_contact_surface_representation(self) -> HydroelasticContactRepresentation:
        """How hydroelastic contact surfaces are tessellated."""
        return self._representation

    def _positive(self, call: str, value: float) -> float:
        value = float(value)
        if not value > 0.0:
            raise RuntimeError(f"{call}(): must be positive, not {value}.")
        return value

    def set_penetration_allowance(self, penetration_allowance: float = 1e-3) -> None:
        """How deep a body may sink in under its weight where the geometry says no stiffness [m]."""
        self._penetration_allowance = self._positive("set_penetration_allowance", penetration_allowance)

    def get_contact_penalty_method_time_scale(self) -> float:
        """Time scale of contact under the penetration allowance [s].

        Raises:
            RuntimeError: before Finalize().
        """
        self._require_finalized("get_contact_penalty_method_time_scale")
        return (self._penetration_allowance / self._gravity_strength()) ** 0.5

    def _gravity_strength(self) -> float:
        g = float((self._gravity.gravity_vector() ** 2).sum() ** 0.5)
        return g if g > 0.0 else 9.81

    def set_stiction_tolerance(self, v_stiction: float = 1e-3) -> None:
        """Slip below which friction counts as sticking [m/s]."""
        self._stiction_tolerance = self._positive("set_stiction_tolerance", v_stiction)

    def set_sap_near_rigid_threshold(self, near_rigid_threshold: float = 1.0) -> None:
        """How stiff contact may be before kSap softens it, relative to the time step."""
        self._require_not_finalized("set_sap_near_rigid_threshold")
        if not near_rigid_threshold >= 0.0:
            raise RuntimeError(f"set_sap_near_rigid_threshold(): must not be negative, not {near_rigid_threshold}.")
        self._near_rigid_threshold = float(near_rigid_threshold)

    def get_sap_near_rigid_threshold(self) -> float:
        """The near-rigid threshold of kSap."""
        return self._near_rigid_threshold
