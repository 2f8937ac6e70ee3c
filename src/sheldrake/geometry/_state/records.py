"""What a GeometryState keeps of each source, frame and geometry, and when it changed."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

from sheldrake.geometry._ids import FrameId, SourceId
from sheldrake.geometry._properties import GeometryProperties
from sheldrake.geometry._roles import Role
from sheldrake.geometry._shapes import Shape

if TYPE_CHECKING:
    from sheldrake.math import RigidTransform

WORLD_FRAME_ID = FrameId.get_new_id()
next_version = itertools.count(1).__next__


class SourceRecord(NamedTuple):
    """A source and the frames it registered."""

    name: str
    frames: tuple[FrameId, ...] = ()


class FrameRecord(NamedTuple):
    """A registered frame."""

    name: str
    group: int
    source: SourceId
    parent: FrameId


class GeometryRecord(NamedTuple):
    """A registered geometry; records are replaced, never changed."""

    name: str
    source: SourceId
    frame: FrameId
    X_FG: RigidTransform
    shape: Shape
    roles: dict[Role, GeometryProperties]

    def has(self, role: Role) -> bool:
        """True if it has the role; every geometry without roles is `kUnassigned`."""
        return not self.roles if role is Role.kUnassigned else role in self.roles


class GeometryVersion:
    """Tells whether the geometries with a role changed between two looks at a SceneGraph."""

    __slots__ = ("_versions",)

    def __init__(self, other: GeometryVersion | None = None) -> None:
        self._versions: dict[Role, int] = {role: next_version() for role in Role} if other is None else other._versions

    def IsSameAs(self, other: GeometryVersion, role: Role) -> bool:
        """True if geometries with the role are certainly the same.

        Raises:
            RuntimeError: the role is `kUnassigned`, which has no version.
        """
        if role is Role.kUnassigned:
            raise RuntimeError("GeometryVersion.IsSameAs(): the role must be proximity, illustration or perception.")
        return self._versions[role] == other._versions[role]

    def _changed(self, roles: Iterable[Role]) -> GeometryVersion:
        new = GeometryVersion(self)
        new._versions = {**self._versions, **{role: next_version() for role in roles}}
        return new

    def __copy__(self) -> GeometryVersion:
        return GeometryVersion(self)

    def __deepcopy__(self, memo: dict) -> GeometryVersion:
        return GeometryVersion(self)
