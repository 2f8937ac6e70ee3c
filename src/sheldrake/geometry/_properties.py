"""Named values in named groups that come with a role.

A geometry has one set for each of its roles: proximity (contact materials), illustration and perception (looks).
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.geometry._rgba import Rgba

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

_Properties = TypeVar("_Properties", bound="GeometryProperties")
_DEFAULT_GROUP = "__default__"
_NOTHING: Mapping[str, Any] = {}
_CPP_NAMES = {float: "double", str: "std::string", bool: "bool"}


def _type_name(value: object) -> str:
    return _CPP_NAMES.get(type(value), type(value).__name__)


class GeometryProperties:
    """Values addressed by (group, name). Make one of the subclasses, which say for which role they are."""

    @checked
    def __init__(self, other: GeometryProperties | None = None) -> None:
        if type(self) is GeometryProperties:
            raise TypeError("GeometryProperties: No constructor defined! Make the properties of a role.")
        self._groups: dict[str, dict[str, Any]] = {_DEFAULT_GROUP: {}}
        if other is not None:
            self._groups = {group: dict(values) for group, values in other._groups.items()}

    @staticmethod
    def default_group_name() -> str:
        """The name of the group that always exists."""
        return _DEFAULT_GROUP

    @checked
    def HasGroup(self, group_name: str) -> bool:
        """True if any property was added to the group."""
        return group_name in self._groups

    def num_groups(self) -> int:
        """Number of groups, the default group included."""
        return len(self._groups)

    def GetGroupNames(self) -> set[str]:
        """Names of all groups."""
        return set(self._groups)

    @checked
    def GetPropertiesInGroup(self, group_name: str) -> dict[str, Any]:
        """Name -> AbstractValue of all properties in a group.

        Raises:
            RuntimeError: no such group.
        """
        from sheldrake.common.value import AbstractValue

        if group_name not in self._groups:
            raise RuntimeError(
                f"GetPropertiesInGroup(): Can't retrieve properties for a group that doesn't exist: '{group_name}'"
            )
        return {name: AbstractValue.Make(value) for name, value in self._groups[group_name].items()}

    @checked
    def AddProperty(self, group_name: str, name: str, value: object) -> None:
        """Adds a property, whose value is copied.

        Raises:
            RuntimeError: the property exists already.
        """
        if self.HasProperty(group_name, name):
            raise RuntimeError(
                f"AddProperty(): Trying to add property ('{group_name}', '{name}'); "
                "a property with that name already exists"
            )
        self._groups.setdefault(group_name, {})[name] = copy.deepcopy(value)

    @checked
    def UpdateProperty(self, group_name: str, name: str, value: object) -> None:
        """Changes a property, or adds it; the value is copied.

        Raises:
            RuntimeError: the property exists with a value of another type; what only Python knows is of one type.
        """
        from sheldrake.common.value import AbstractValue

        group = self._groups.setdefault(group_name, {})
        if name in group:
            old = group[name]
            if isinstance(old, float) and type(value) is int:
                value = float(value)
            if type(AbstractValue.Make(old)) is not type(AbstractValue.Make(value)):
                raise RuntimeError(
                    f"UpdateProperty(): Trying to update property ('{group_name}', '{name}'); The property already "
                    f"exists and is of different type. New type {_type_name(value)}, existing type {_type_name(old)}"
                )
        group[name] = copy.deepcopy(value)

    @checked
    def HasProperty(self, group_name: str, name: str) -> bool:
        """True if the property exists."""
        return name in self._groups.get(group_name, ())

    @checked
    def GetProperty(self, group_name: str, name: str) -> Any:
        """The value of a property.

        Raises:
            RuntimeError: no such group, or no such property in it.
        """
        if group_name not in self._groups:
            raise RuntimeError(
                f"GetProperty(): Trying to read property ('{group_name}', '{name}'), but the group does not exist."
            )
        if name not in self._groups[group_name]:
            raise RuntimeError(f"GetProperty(): There is no property ('{group_name}', '{name}')")
        value = self._groups[group_name][name]
        return copy.copy(value) if isinstance(value, Rgba) else value

    @checked
    def GetPropertyOrDefault(self, group_name: str, name: str, default_value: object) -> Any:
        """The value of a property, or `default_value` if there is none."""
        return self.GetProperty(group_name, name) if self.HasProperty(group_name, name) else default_value

    def _get(self, group_name: str, name: str, default_value: object) -> Any:
        """The same for who compiles many geometries: nothing is checked, and a colour is not copied."""
        return self._groups.get(group_name, _NOTHING).get(name, default_value)

    def _with_defaults(self: _Properties, defaults: Mapping[str, Mapping[str, Any]]) -> _Properties:
        """A copy with values that there are none of yet, by group and name."""
        new = type(self)(self)
        for group, values in defaults.items():
            new._groups[group] = {**values, **new._groups.get(group, _NOTHING)}
        return new

    @checked
    def RemoveProperty(self, group_name: str, name: str) -> bool:
        """Removes a property; returns whether there was one."""
        if not self.HasProperty(group_name, name):
            return False
        del self._groups[group_name][name]
        return True

    def __copy__(self: _Properties) -> _Properties:
        return type(self)(self)

    def __deepcopy__(self: _Properties, memo: dict) -> _Properties:
        new = type(self)()
        new._groups = copy.deepcopy(self._groups, memo)
        return new

    def __str__(self) -> str:
        lines = []
        for group, values in self._groups.items():
            lines.append(f"[{group}]")
            lines.extend(f"  {name}: {_type_name(value)}" for name, value in values.items())
        return "\n".join(lines)


class ProximityProperties(GeometryProperties):
    """Properties of a geometry that touches others: material, friction, hydroelastic representation."""


class IllustrationProperties(GeometryProperties):
    """Properties of a geometry that people look at: colour, texture."""


class PerceptionProperties(GeometryProperties):
    """Properties of a geometry that simulated sensors see: colour, texture, label."""


@checked
def MakePhongIllustrationProperties(diffuse: ArrayLike) -> IllustrationProperties:
    """Illustration properties with the colour `diffuse` (r, g, b, a), each in [0, 1], shape (4,)."""
    properties = IllustrationProperties()
    colour = Rgba(*np.reshape(diffuse, (4,)))
    properties.AddProperty("phong", "diffuse", colour)
    return properties
