"""What is registered with a SceneGraph: frames and geometries, before registration."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING

from sheldrake.common._checked import checked
from sheldrake.geometry._ids import FrameId, GeometryId
from sheldrake.geometry._properties import IllustrationProperties, PerceptionProperties, ProximityProperties
from sheldrake.geometry._shapes import Shape

if TYPE_CHECKING:
    from sheldrake.math import RigidTransform


def canonical_name(name: str) -> str:
    """The name without surrounding white space.

    Raises:
        RuntimeError: nothing is left.
    """
    stripped = name.strip(" \t")
    if not stripped:
        raise RuntimeError(f"GeometryInstance given the name '{name}' which is an empty canonical string")
    return stripped


class GeometryFrame:
    """A frame to which geometries can be fixed; its pose comes from its source."""

    @checked
    def __init__(self, frame_name: str, frame_group_id: int = 0) -> None:
        if frame_group_id < 0:
            raise RuntimeError("GeometryFrame requires a non-negative frame group")
        self._id = FrameId.get_new_id()
        self._name = str(frame_name)
        self._group = int(frame_group_id)

    def id(self) -> FrameId:
        """The identifier the frame will have."""
        return self._id

    def name(self) -> str:
        """The name."""
        return self._name

    def frame_group(self) -> int:
        """A number the source may use as it likes (a plant puts the model instance there)."""
        return self._group

    def __deepcopy__(self, memo: dict) -> GeometryFrame:
        return copy.copy(self)


@checked
class GeometryInstance:
    """A shape with a pose in its parent frame, a name, and the properties of the roles it should play."""

    def __init__(self, X_PG: RigidTransform, shape: Shape, name: str) -> None:
        if not isinstance(shape, Shape):
            raise TypeError(f"GeometryInstance(): shape must be a Shape, got {shape!r}.")
        self._id = GeometryId.get_new_id()
        self._shape = shape.Clone()
        self._proximity: ProximityProperties | None = None
        self._illustration: IllustrationProperties | None = None
        self._perception: PerceptionProperties | None = None
        self.set_pose(X_PG)
        self.set_name(name)

    def id(self) -> GeometryId:
        """The identifier the geometry will have."""
        return self._id

    def pose(self) -> RigidTransform:
        """Pose X_PG of the geometry in its parent frame."""
        return copy.copy(self._X_PG)

    def set_pose(self, X_PG: RigidTransform) -> None:
        """Sets the pose X_PG."""
        self._X_PG = copy.copy(X_PG)

    def shape(self) -> Shape:
        """The shape."""
        return self._shape

    def name(self) -> str:
        """The name, without surrounding white space."""
        return self._name

    def set_name(self, name: str) -> None:
        """Sets the name.

        Raises:
            RuntimeError: the name has nothing but white space.
        """
        self._name = canonical_name(name)

    def set_proximity_properties(self, properties: ProximityProperties) -> None:
        """Gives the geometry the proximity role."""
        self._proximity = copy.copy(properties)

    def set_illustration_properties(self, properties: IllustrationProperties) -> None:
        """Gives the geometry the illustration role."""
        self._illustration = copy.copy(properties)

    def set_perception_properties(self, properties: PerceptionProperties) -> None:
        """Gives the geometry the perception role."""
        self._perception = copy.copy(properties)

    def proximity_properties(self) -> ProximityProperties | None:
        """The proximity properties, or None."""
        return self._proximity

    def illustration_properties(self) -> IllustrationProperties | None:
        """The illustration properties, or None."""
        return self._illustration

    def perception_properties(self) -> PerceptionProperties | None:
        """The perception properties, or None."""
        return self._perception

    mutable_proximity_properties = proximity_properties
    mutable_illustration_properties = illustration_properties
    mutable_perception_properties = perception_properties

    def __copy__(self) -> GeometryInstance:
        new = object.__new__(GeometryInstance)
        new.__dict__.update(self.__dict__)
        new._proximity = copy.copy(self._proximity)
        new._illustration = copy.copy(self._illustration)
        new._perception = copy.copy(self._perception)
        return new

    def __deepcopy__(self, memo: dict) -> GeometryInstance:
        return self.__copy__()
