"""SceneGraph configuration: what proximity geometries get when they do not say."""

from __future__ import annotations

import copy
from types import SimpleNamespace
from typing import Any, ClassVar, Optional

from ._text import choices, number


class _Record:
    """A named bundle of values with pydrake's `__fields__`, keyword construction and repr."""

    _types: ClassVar[dict[str, Any]] = {}
    __fields__: ClassVar[tuple[SimpleNamespace, ...]] = ()

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.__fields__ = tuple(SimpleNamespace(name=name, type=type_) for name, type_ in cls._types.items())

    def __init__(self, **kwargs: Any) -> None:
        for name, value in self._defaults().items():
            object.__setattr__(self, name, value)
        for name, value in kwargs.items():
            setattr(self, name, value)

    def _defaults(self) -> dict[str, Any]:
        raise NotImplementedError

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in self._types:
            kind = type(self).__name__
            raise AttributeError(f"{kind!r} object has no attribute {name!r}; it has {choices(self._types)}.")
        object.__setattr__(self, name, value)

    def __copy__(self) -> Any:
        return copy.deepcopy(self)

    def __deepcopy__(self, memo: dict) -> Any:
        return type(self)(**{name: copy.deepcopy(getattr(self, name), memo) for name in self._types})

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(getattr(self, name) == getattr(other, name) for name in self._types)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{name}={getattr(self, name)!r}' for name in self._types)})"


class DefaultProximityProperties(_Record):
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

    compliance_type: str
    hydroelastic_modulus: float | None
    resolution_hint: float | None
    slab_thickness: float | None
    margin: float | None
    dynamic_friction: float | None
    static_friction: float | None
    hunt_crossley_dissipation: float | None
    relaxation_time: float | None
    point_stiffness: float | None

    _types: ClassVar[dict[str, Any]] = {
        "compliance_type": str,
        "hydroelastic_modulus": Optional[float],  # noqa: UP045 (what pydrake reports)
        "resolution_hint": Optional[float],  # noqa: UP045
        "slab_thickness": Optional[float],  # noqa: UP045
        "margin": Optional[float],  # noqa: UP045
        "dynamic_friction": Optional[float],  # noqa: UP045
        "static_friction": Optional[float],  # noqa: UP045
        "hunt_crossley_dissipation": Optional[float],  # noqa: UP045
        "relaxation_time": Optional[float],  # noqa: UP045
        "point_stiffness": Optional[float],  # noqa: UP045
    }

    def _defaults(self) -> dict[str, Any]:
        return {
            "compliance_type": "undefined",
            "hydroelastic_modulus": 1e7,
            "resolution_hint": 0.02,
            "slab_thickness": None,
            "margin": None,
            "dynamic_friction": 0.5,
            "static_friction": 0.5,
            "hunt_crossley_dissipation": 50.0,
            "relaxation_time": 0.1,
            "point_stiffness": 1e6,
        }

    def _validate(self) -> None:
        """Raises RuntimeError for values that make no sense."""
        if self.compliance_type not in ("undefined", "rigid", "compliant"):
            raise RuntimeError(
                f"Invalid default_proximity_properties.compliance_type: unknown '{self.compliance_type}'; "
                "expected 'undefined', 'rigid' or 'compliant'."
            )
        positive = ("hydroelastic_modulus", "resolution_hint", "slab_thickness", "point_stiffness")
        for name in self._types:
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


class SceneGraphConfig(_Record):
    """Configuration of a SceneGraph.

    Attributes:
        default_proximity_properties: DefaultProximityProperties.
    """

    default_proximity_properties: DefaultProximityProperties

    _types: ClassVar[dict[str, Any]] = {"default_proximity_properties": DefaultProximityProperties}

    def _defaults(self) -> dict[str, Any]:
        return {"default_proximity_properties": DefaultProximityProperties()}
