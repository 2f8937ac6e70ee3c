"""MJCF bookkeeping: compiler settings, default classes, orientations."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from .._files.xml import Element
from .._reading.reading import Reading, rotation_from_z

if TYPE_CHECKING:
    from sheldrake.math import RigidTransform, RotationMatrix

_ORIENTATIONS = ("quat", "axisangle", "euler", "xyaxes", "zaxis")
MAIN_CLASS = "main"
_READ = ("mesh", "material", "geom", "joint", "motor", "position", "connect")  # elements that take defaults


@dataclass
class Compiler:
    """The settings of `<compiler>` that this reader honours."""

    degrees: bool = True
    autolimits: bool = True
    euler_sequence: str = "xyz"
    mesh_folder: str = ""
    inertia_from_geom: bool | None = None  # None: only for bodies without <inertial>

    def angle(self, value: Any) -> Any:
        """An angle of the file, or an array of them, in radians."""
        return np.deg2rad(value) if self.degrees else value


def read_compiler(element: Element, compiler: Compiler, reading: Reading) -> None:
    """Applies a `<compiler>` element."""
    known = (
        "angle",
        "autolimits",
        "eulerseq",
        "meshdir",
        "assetdir",
        "inertiafromgeom",
        "coordinate",
        "texturedir",
        "convexhull",
    )
    reading.warn_unknown(element, attributes=known, silent=("usethread",))
    angle = element.get("angle")
    if angle in ("degree", "radian"):
        compiler.degrees = angle == "degree"
    elif angle is not None:
        reading.warn(element, f"<compiler angle='{angle}'> is unknown and ignored; known are degree and radian.")
    if element.get("coordinate", "local") != "local":
        reading.fail(element, f"<compiler coordinate='{element.get('coordinate')}'> is not supported.")
    sequence = element.get("eulerseq", compiler.euler_sequence)
    if len(sequence) != 3 or set(sequence) - set("xyzXYZ"):
        reading.fail(element, f"<compiler eulerseq='{sequence}'> must be three of the letters x, y, z, X, Y, Z.")
    compiler.euler_sequence = sequence
    for attribute in ("assetdir", "meshdir"):
        compiler.mesh_folder = element.get(attribute, compiler.mesh_folder)
    flag = element.get("autolimits")
    if flag is not None:
        compiler.autolimits = reading.parse_bool(flag, element.where_attribute("autolimits"), "'autolimits'")
    from_geom = element.get("inertiafromgeom")
    if from_geom is not None:
        where = element.where_attribute("inertiafromgeom")
        compiler.inertia_from_geom = (
            None if from_geom == "auto" else reading.parse_bool(from_geom, where, "'inertiafromgeom'")
        )


@dataclass
class Defaults:
    """Default attributes by class name and tag; a class has those of the class around it, unless it sets its own."""

    classes: dict[str, dict[str, dict[str, str]]] = field(default_factory=lambda: {MAIN_CLASS: {}})

    def read(self, element: Element, reading: Reading, outer: str | None = None) -> None:
        """Adds a `<default>` element and those inside it."""
        reading.note_unknown(element, ("default", *_READ), ("class",))
        name = element.get("class") or MAIN_CLASS
        if outer is not None and name == MAIN_CLASS:
            reading.fail(element, "A <default> inside another needs the attribute 'class'.")
        inherited = self.classes.get(outer or name, {})
        tags = {tag: dict(attributes) for tag, attributes in inherited.items()}
        for child in element:
            if child.tag != "default":
                reading.note_unknown(child, attributes=child.attributes)  # those that no one reads show in their use
                tags[child.tag] = {**tags.get(child.tag, {}), **child.attributes}
        self.classes[name] = tags
        if outer is None:
            self.classes[MAIN_CLASS] = tags
        for child in element.find_all("default"):
            self.read(child, reading, name)

    def apply(self, element: Element, child_class: str, reading: Reading) -> Element:
        """A copy of the element with the default attributes of its class filled in."""
        name = element.get("class") or child_class
        if name not in self.classes:
            known = ", ".join(self.classes)
            reading.warn(element, f"The default class '{name}' is unknown; there are no defaults. Known are {known}.")
        defaults = self.classes.get(name, {}).get(element.tag, {})
        if any(attribute in element.attributes for attribute in _ORIENTATIONS):
            defaults = {key: value for key, value in defaults.items() if key not in _ORIENTATIONS}
        copy = element.renamed(element.tag)
        copy.attributes = {**defaults, **element.attributes}
        return copy


def read_pose(element: Element, compiler: Compiler, reading: Reading) -> RigidTransform:
    """The pose in `pos` and one of the orientation attributes."""
    from sheldrake.math import RigidTransform

    position = reading.vector(element, "pos", 3, np.zeros(3))
    return RigidTransform(_read_rotation(element, compiler, reading), position)


def _read_rotation(element: Element, compiler: Compiler, reading: Reading) -> RotationMatrix:
    from sheldrake.math import RotationMatrix

    given = [name for name in _ORIENTATIONS if name in element.attributes]
    if not given:
        return RotationMatrix()
    if len(given) > 1:
        reading.fail(element, f"<{element.tag}> has several orientations: {', '.join(given)}; one is allowed.")
    return _ROTATIONS[given[0]](element, compiler, reading)


def _unit(vector: np.ndarray, element: Element, reading: Reading) -> np.ndarray:
    length = float(np.linalg.norm(vector))
    if length < 1e-10:
        reading.fail(element, f"The orientation of this <{element.tag}> is zero.")
    return vector / length


def _from_quat(element: Element, _compiler: Compiler, reading: Reading) -> RotationMatrix:
    from sheldrake.common.eigen_geometry import Quaternion
    from sheldrake.math import RotationMatrix

    w, x, y, z = _unit(reading.vector(element, "quat", 4), element, reading)
    return RotationMatrix(Quaternion(w=w, x=x, y=y, z=z))


def _about(axis: np.ndarray, angle: float) -> RotationMatrix:
    from sheldrake.common.eigen_geometry import AngleAxis
    from sheldrake.math import RotationMatrix

    return RotationMatrix(AngleAxis(angle=angle, axis=axis))


def _from_axis_angle(element: Element, compiler: Compiler, reading: Reading) -> RotationMatrix:
    values = reading.vector(element, "axisangle", 4)
    return _about(_unit(values[:3], element, reading), compiler.angle(values[3]))


def _from_euler(element: Element, compiler: Compiler, reading: Reading) -> RotationMatrix:
    """Small letters turn about the moving axes, capital letters about the fixed ones."""
    from sheldrake.math import RotationMatrix

    R = RotationMatrix()
    for letter, value in zip(compiler.euler_sequence, reading.vector(element, "euler", 3)):
        turn = _about(np.eye(3)["xyz".index(letter.lower())], compiler.angle(value))
        R = R @ turn if letter.islower() else turn @ R
    return R


def _from_xy_axes(element: Element, _compiler: Compiler, reading: Reading) -> RotationMatrix:
    from sheldrake.math import RotationMatrix

    values = reading.vector(element, "xyaxes", 6)
    x = _unit(values[:3], element, reading)
    y = _unit(values[3:] - (values[3:] @ x) * x, element, reading)
    return RotationMatrix(np.column_stack([x, y, np.cross(x, y)]))


def _from_z_axis(element: Element, _compiler: Compiler, reading: Reading) -> RotationMatrix:
    return rotation_from_z(_unit(reading.vector(element, "zaxis", 3), element, reading))


_ROTATIONS = {
    "quat": _from_quat,
    "axisangle": _from_axis_angle,
    "euler": _from_euler,
    "xyaxes": _from_xy_axes,
    "zaxis": _from_z_axis,
}


def is_limited(element: Element, flag: str, limits: str, compiler: Compiler, reading: Reading) -> bool:
    """Whether a range holds: `true`, `false`, or `auto`, which means that there is a range.

    Raises:
        ParseError: For a range without flag when automatic limits are switched off.
    """
    text = element.get(flag, "auto")
    if text != "auto":
        return reading.parse_bool(text, element.where_attribute(flag), f"attribute '{flag}'")
    if limits in element.attributes and not compiler.autolimits:
        reading.fail(element, f"'{limits}' is given but <compiler autolimits> is false; set {flag}='true'.")
    return limits in element.attributes
