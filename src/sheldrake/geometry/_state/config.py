"""SceneGraph configuration: what proximity geometries get when they do not say."""

from __future__ import annotations

from sheldrake.common._options import Options
from sheldrake.common._text import number


class DefaultProximityProperties(Options):
    """Defaults of proximity properties; None leaves a property absent.

    Attributes:
        compliance_type: "undefined", "rigid" or "compliant" (hydroelastic representation).
        hydroelastic_modulus: [Pa].
        resolution_hint: edge length of hydroelastic meshes [m].
        slab_thickness: of compliant half spaces [m].
        margin: hydroelastic margin [m].
        dynamic_friction: coefficient [-]; given with static_friction or not at all.
        static_friction: coefficient [-].
        hunt_crossley_dissipation: [s/m].
        relaxation_time: [s].
        point_stiffness: of one contact point [N/m].
    """

    compliance_type: str = "undefined"
    hydroelastic_modulus: float | None = 1e7
    resolution_hint: float | None = 0.02
    slab_thickness: float | None = None
    margin: float | None = None
    dynamic_friction: float | None = 0.5
    static_friction: float | None = 0.5
    hunt_crossley_dissipation: float | None = 50.0
    relaxation_time: float | None = 0.1
    point_stiffness: float | None = 1e6

    def _validate(self) -> None:
        """Raises RuntimeError for values that make no sense."""
        if self.compliance_type not in ("undefined", "rigid", "compliant"):
            raise RuntimeError(
                f"Invalid default_proximity_properties.compliance_type: unknown '{self.compliance_type}'; "
                "expected 'undefined', 'rigid' or 'compliant'."
            )
        positive = ("hydroelastic_modulus", "resolution_hint", "slab_thickness", "point_stiffness")
        for name in self._defaults:
            value = getattr(self, name)
            if name == "compliance_type" or value is None:
                continue
            if not (value > 0.0 if name in positive else value >= 0.0):
                wanted = "positive" if name in positive else "not negative"
                raise RuntimeError(f"Invalid scene graph configuration: '{name}' ({number(value)}) must be {wanted}.")
        if (self.dynamic_friction is None) != (self.static_friction is None):
            raise RuntimeError(
                "Invalid scene graph configuration: either both static_friction and dynamic_friction must have a "
                "value, or neither."
            )
        static, dynamic = self.static_friction, self.dynamic_friction
        if dynamic is not None and static is not None and dynamic > static:
            raise RuntimeError(
                f"Invalid scene graph configuration: 'dynamic_friction' ({number(dynamic)}) is greater "
                f"than 'static_friction' ({number(static)})."
            )


class SceneGraphConfig(Options):
    """Configuration of a SceneGraph.

    Attributes:
        default_proximity_properties: DefaultProximityProperties.
    """

    default_proximity_properties: DefaultProximityProperties = DefaultProximityProperties()
