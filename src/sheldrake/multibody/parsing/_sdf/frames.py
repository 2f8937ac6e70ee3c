"""Poses in SDFormat models: who is relative to whom, and where that puts everything.

Every link, joint, frame and nested model of a model is a named place. A place has a raw pose relative to another place;
following these gives its pose in the model frame. Scoped names (`arm::hand`) reach into nested models.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NoReturn

from .._files.diagnostics import Location
from .._files.xml import Element
from .._reading.reading import Reading

if TYPE_CHECKING:
    import numpy as np

    from sheldrake.math import RigidTransform

MODEL_FRAME = "__model__"


@dataclass
class Place:
    """A named thing with a pose; `X_RP` is its raw pose in the place called `relative_to` ("" = the default)."""

    where: Location
    kind: str  # link, joint, frame, model
    name: str
    X_RP: RigidTransform
    relative_to: str
    attached_to: str = ""  # of a frame: what it moves with; of a joint: its child
    scope: Any = None  # the SdfScope of a nested model
    placement_frame: str = ""  # of a nested model: its raw pose is that of this frame


@dataclass
class SdfScope:
    """The places of one model, or of a world."""

    name: str
    where: Location
    reading: Reading
    is_world: bool = False
    canonical_link: str = ""
    places: dict[str, Place] = field(default_factory=dict)
    known_poses: dict[str, Any] = field(default_factory=dict)
    known_bodies: dict[str, tuple[tuple[str, ...], str]] = field(default_factory=dict)

    def add(self, place: Place) -> None:
        """Adds a place; names are unique among links, joints, frames and nested models.

        Raises:
            ParseError: When the name is taken or reserved.
        """
        earlier = self.places.get(place.name)
        if earlier is not None:
            self.reading.fail(
                place.where,
                f"Model '{self.name}' already has a {earlier.kind} named '{place.name}' (line {earlier.where.line}); "
                f"the names of links, joints, frames and models must differ.",
            )
        if place.name == "world" or "::" in place.name or re.fullmatch("__.*__", place.name):
            self.reading.fail(place.where, f"The {place.kind} name '{place.name}' is reserved.")
        self.places[place.name] = place
        self.known_poses.clear()
        self.known_bodies.clear()

    def find(self, name: str, where: Location) -> tuple[SdfScope, Place]:
        """The place a possibly scoped name stands for, and the scope that owns it.

        Raises:
            ParseError: When there is no such place.
        """
        scope: SdfScope = self
        *outer, local = name.split("::")
        for part in outer:
            place = scope.places.get(part)
            if place is None or place.scope is None:
                self._unknown(name, where)
            scope = place.scope
        place = scope.places.get(local)
        if place is None:
            self._unknown(name, where)
        return scope, place

    def _unknown(self, name: str, where: Location) -> NoReturn:
        known = ", ".join([MODEL_FRAME, *self.places][:30])
        self.reading.fail(where, f"Model '{self.name}' has no link, joint, frame or model '{name}'; known are {known}.")

    def pose(self, name: str, where: Location, pending: tuple = ()) -> RigidTransform:
        """The pose of a place in the frame of this model (or in the world, for a world's places).

        Raises:
            ParseError: For an unknown name or poses that are relative to each other in a circle.
        """
        from sheldrake.math import RigidTransform

        if name in ("", MODEL_FRAME) or (self.is_world and name == "world"):
            return RigidTransform()
        if name in self.known_poses:
            return self.known_poses[name]
        if "::" in name:
            model, _, rest = name.partition("::")
            return self.pose(model, where, pending) @ self._nested(model, name, where).pose(rest, where, pending)
        _, place = self.find(name, where)
        key = (id(self), name)
        if key in pending:
            self.reading.fail(place.where, f"The pose of '{name}' is relative to itself, through others.")
        pending = (*pending, key)
        X_MR = self.pose(self._reference_of(place), place.where, pending)
        X_MP = X_MR @ place.X_RP
        if place.placement_frame:
            X_NF = place.scope.pose(place.placement_frame, place.where, pending)
            X_MP = X_MP @ X_NF.inverse()
        self.known_poses[name] = X_MP
        return X_MP

    def _nested(self, model: str, name: str, where: Location) -> SdfScope:
        place = self.places.get(model)
        if place is None or place.scope is None:
            self._unknown(name, where)
        return place.scope

    def _reference_of(self, place: Place) -> str:
        """What a raw pose is relative to when the file does not say."""
        if place.relative_to:
            return place.relative_to
        return place.attached_to if place.kind in ("joint", "frame") else MODEL_FRAME

    def body(self, name: str, where: Location, pending: tuple = ()) -> tuple[tuple[str, ...], str]:
        """The link that a place moves with: (names of nested models on the way, link), or ((), "world").

        Raises:
            ParseError: When there is none, or places are attached in a circle.
        """
        if name == "world":
            return (), "world"
        key = (id(self), name)
        if key in pending:
            self.reading.fail(where, f"'{name}' is attached to itself, through others.")
        pending = (*pending, key)
        if name in ("", MODEL_FRAME):
            if self.is_world:
                return (), "world"
            if not self.canonical_link:
                self.reading.fail(self.where, f"Model '{self.name}' has no link, so nothing can be attached to it.")
            return self.body(self.canonical_link, where, pending)
        if "::" in name:
            model, _, rest = name.partition("::")
            scope, link = self._nested(model, name, where).body(rest, where, pending)
            return ((model, *scope), link) if link != "world" else ((), "world")
        _, place = self.find(name, where)
        if place.kind == "link":
            return (), name
        if place.kind == "model":
            scope, link = place.scope.body(MODEL_FRAME, place.where, pending)
            return (name, *scope), link
        if name not in self.known_bodies:
            self.known_bodies[name] = self.body(place.attached_to, place.where, pending)
        return self.known_bodies[name]

    def is_fixed_to_model_frame(self, name: str) -> bool:
        """Whether a frame that can be found is attached to the frame of this model, directly or by others of it."""
        while name not in ("", MODEL_FRAME):
            place = self.places.get(name)
            if place is None or place.kind != "frame":
                return False
            name = place.attached_to
        return True

    def pose_of_body(self, scope: tuple[str, ...], link: str, where: Location) -> RigidTransform:
        """The pose of a link found by `body` in this model's frame."""
        if link == "world":
            return self.pose("world" if self.is_world else "", where)
        return self.pose("::".join((*scope, link)), where)


def read_pose(element: Element | None, reading: Reading) -> RigidTransform:
    """The raw pose in a `<pose>` element: identity when there is none."""
    from sheldrake.math import RigidTransform, RollPitchYaw, RotationMatrix

    if element is None:
        return RigidTransform()
    reading.warn_unknown(element, attributes=("relative_to", "degrees", "rotation_format", "frame"))
    if not element.text.strip():
        return RigidTransform()
    form = element.get("rotation_format", "euler_rpy")
    if form == "quat_xyzw":
        values = reading.parse_vector(element.text, 7, element.where, "<pose>")
        from sheldrake.common.eigen_geometry import Quaternion

        x, y, z, w = values[3:] / _norm(values[3:], element, reading)
        return RigidTransform(RotationMatrix(Quaternion(w=w, x=x, y=y, z=z)), values[:3])
    if form != "euler_rpy":
        reading.fail(element, f"The rotation format '{form}' is unknown; known are euler_rpy and quat_xyzw.")
    values = reading.parse_vector(element.text, 6, element.where, "<pose>")
    degrees = element.get("degrees")
    rpy = values[3:]
    if degrees is not None and reading.parse_bool(degrees, element.where_attribute("degrees"), "attribute 'degrees'"):
        rpy = rpy * 0.017453292519943295
    return RigidTransform(RollPitchYaw(rpy), values[:3])


def _norm(quaternion: np.ndarray, element: Element, reading: Reading) -> float:
    norm = float((quaternion @ quaternion) ** 0.5)
    if norm < 1e-9:
        reading.fail(element, "The quaternion of a <pose> is zero.")
    return norm


def reference_of_pose(element: Element | None) -> str:
    """The `relative_to` of a `<pose>`; SDFormat 1.5 and 1.6 called it `frame`."""
    if element is None:
        return ""
    return element.get("relative_to") or element.get("frame") or ""
