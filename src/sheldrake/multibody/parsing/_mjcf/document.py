"""MJCF: a `<mujoco>` element to a model description. The subset is Drake's; everything else gives a warning."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.multibody.tree._joint_types import JOINT_TYPES

from .._files.xml import Element
from .._model.check import check_model
from .._model.description import (
    BallConstraintDescription,
    BodyDescription,
    FrameReference,
    JointDescription,
    ModelDescription,
)
from .._reading.inertia import find_problem, make_spatial_inertia
from .._reading.reading import Reading
from .actuators import read_actuator
from .defaults import MAIN_CLASS, Compiler, Defaults, is_limited, read_compiler, read_pose
from .geoms import Assets, read_geom, read_material_asset, read_mesh_asset, sum_mass

if TYPE_CHECKING:
    from sheldrake.math import RigidTransform
    from sheldrake.multibody.tree import SpatialInertia

_SECTIONS = ("option", "compiler", "default", "asset", "worldbody", "actuator", "contact", "equality")
_SILENT_SECTIONS = ("size", "custom", "include")
_OPTION_SILENT = (
    "apirate",
    "impratio",
    "jacobian",
    "o_margin",
    "o_solref",
    "o_solimp",
    "o_friction",
    "solver",
    "iterations",
    "tolerance",
    "ls_iterations",
    "ls_tolerance",
    "noslip_iterations",
    "noslip_tolerance",
    "ccd_iterations",
    "ccd_tolerance",
    "sdf_iterations",
    "sdf_tolerance",
    "sdf_initpoints",
)
_ORIENTATION = ("pos", "quat", "axisangle", "euler", "xyaxes", "zaxis")
_BODY_TAGS = ("body", "joint", "freejoint", "geom", "inertial")
_JOINT_ATTRIBUTES = ("name", "class", "type", "pos", "axis", "range", "limited", "damping", "ref", "armature")
_JOINT_SILENT = ("solreflimit", "solimplimit", "solreffriction", "solimpfriction", "margin")
_TYPES = {row.mjcf[0]: row for row in JOINT_TYPES.values() if len(row.mjcf) == 1}


def read_mjcf(root: Element, reading: Reading, model_name: str = "") -> ModelDescription:
    """The model that an MJCF document describes.

    Args:
        root: The document's root, which must be `<mujoco>`.
        reading: Its surroundings.
        model_name: Used instead of the model's own name when not empty.

    Raises:
        ParseError: When the document is not usable MJCF.
    """
    if root.tag != "mujoco":
        reading.fail(root, f"An MJCF document has a <mujoco> element, found <{root.tag}>.")
    return _MjcfReader(root, reading, model_name).read()


class _MjcfReader:
    """Reads one document; sections are handled in the order in which they depend on each other."""

    def __init__(self, root: Element, reading: Reading, model_name: str):
        self._root = root
        self._reading = reading
        self._compiler = Compiler()
        self._defaults = Defaults()
        self._assets = Assets({}, {})
        self._armature: dict[str, float] = {}
        self._num_bodies = reading.num_bodies
        self._expand_includes(root, reading)
        self._model = ModelDescription(root.where, model_name or self._name())

    def read(self) -> ModelDescription:
        reading = self._reading
        reading.warn_unknown(self._root, _SECTIONS, ("model",), _SILENT_SECTIONS)
        for element in self._root.find_all("compiler"):
            read_compiler(element, self._compiler, reading)
        for element in self._root.find_all("default"):
            self._defaults.read(element, reading)
        for element in self._root.find_all("option"):
            self._read_option(element)
        for element in self._root.find_all("asset"):
            self._read_assets(element)
        for element in self._root.find_all("worldbody"):
            self._read_world(element)
        for element in self._root.find_all("actuator"):
            self._read_actuators(element)
        for element in self._root.find_all("contact"):
            self._read_contact(element)
        for element in self._root.find_all("equality"):
            self._read_equality(element)
        check_model(self._model, reading.policy)
        return self._model

    def _name(self) -> str:
        name = self._root.get("model")
        if name is not None and name.strip():
            return name
        if self._reading.folder is None:
            self._reading.fail(self._root, "The <mujoco> needs a name: give it the attribute 'model'.")
        stem = os.path.splitext(os.path.basename(self._reading.source))[0]
        self._reading.warn(self._root, f"The <mujoco> has no name; it is called '{stem}' after its file.")
        return stem

    def _expand_includes(self, element: Element, reading: Reading) -> None:
        """Puts the content of included files in the place of every `<include>`."""
        children = []
        for child in element.children:
            if child.tag != "include":
                self._expand_includes(child, reading)
                children.append(child)
                continue
            reading.warn_unknown(child, attributes=("file",))
            file = reading.name(child, "<include>", "file")
            path = file if reading.folder else os.path.join(os.getcwd(), file)
            path = reading.resolve(path, child.where_attribute("file"))
            inner = reading.inside(path, child.where)
            root = inner.open_document()
            inner.warn_unknown(root, [section.tag for section in root])
            self._expand_includes(root, inner)
            children += root.children
        element.children = children

    def _read_option(self, element: Element) -> None:
        self._reading.warn_unknown(element, attributes=("gravity",), silent=_OPTION_SILENT)
        self._model.gravity = self._reading.vector(element, "gravity", 3, self._model.gravity)

    def _read_assets(self, element: Element) -> None:
        self._reading.warn_unknown(element, [child.tag for child in element])
        for child in element:
            full = self._defaults.apply(child, MAIN_CLASS, self._reading)
            if child.tag == "mesh":
                read_mesh_asset(full, self._assets, self._compiler, self._reading)
            elif child.tag == "material":
                read_material_asset(full, self._assets, self._reading)
            else:
                self._reading.pass_over(child)
                self._reading.warn(child, f"The asset <{child.tag}> is not supported and is ignored.")

    def _read_world(self, element: Element) -> None:
        self._reading.warn_unknown(element, ("body", "geom"), ("name",))
        child_class = element.get("childclass", MAIN_CLASS)
        world = BodyDescription(element.where, "world", is_world=True)
        for index, geom in enumerate(element.find_all("geom")):
            full = self._defaults.apply(geom, child_class, self._reading)
            read_geom(full, index, world, self._assets, self._compiler, self._reading)
        self._model.bodies.append(world)
        for body in element.find_all("body"):
            self._read_body(body, world, child_class)

    def _read_body(self, element: Element, parent: BodyDescription, child_class: str) -> None:
        reading = self._reading
        reading.warn_unknown(element, _BODY_TAGS, ("name", "childclass", *_ORIENTATION))
        child_class = element.get("childclass", child_class)
        name = element.get("name") or f"body{self._num_bodies}"
        body = BodyDescription(element.where, name)
        self._add_body(body)
        X_PB = read_pose(element, self._compiler, reading)
        inertial = element.find("inertial")
        if inertial is not None and self._compiler.inertia_from_geom is True:
            reading.pass_over(inertial)
            inertial = None
        parts = []
        for index, geom in enumerate(element.find_all("geom")):
            full = self._defaults.apply(geom, child_class, reading)
            part = read_geom(full, index, body, self._assets, self._compiler, reading, weighs=inertial is None)
            if part is not None:
                parts.append(part)
        if inertial is not None:
            body.M_BBo_B = self._read_inertial(inertial, name)
        else:
            body.M_BBo_B = sum_mass(parts)
        self._read_joints(element, body, parent, X_PB, child_class)
        for child in element.find_all("body"):
            self._read_body(child, body, child_class)

    def _add_body(self, body: BodyDescription) -> None:
        """Bodies and joints are added in turn, as Drake does."""
        self._model.bodies.append(body)
        self._model.elements.append(body)
        self._num_bodies += 1

    def _read_inertial(self, element: Element, body: str) -> SpatialInertia:
        reading = self._reading
        reading.warn_unknown(element, attributes=("mass", "diaginertia", "fullinertia", *_ORIENTATION))
        mass = reading.number(element, "mass")
        if mass is None:
            reading.fail(element, f"The <inertial> of body '{body}' needs the attribute 'mass'.")
        products = np.zeros(3)
        if "fullinertia" in element.attributes:
            values = reading.vector(element, "fullinertia", 6)
            moments, products = values[:3], values[3:]
        elif "diaginertia" in element.attributes:
            moments = reading.vector(element, "diaginertia", 3)
        else:
            reading.fail(element, f"The <inertial> of body '{body}' needs 'diaginertia' or 'fullinertia'.")
        problem = find_problem(mass, moments, products)
        if problem is not None:
            reading.fail(element, f"The inertia of body '{body}' is impossible: {problem}.")
        X_BI = read_pose(element, self._compiler, reading)
        return make_spatial_inertia(mass, X_BI, moments, products, lambda text: reading.warn(element, text))

    def _read_joints(
        self, element: Element, body: BodyDescription, parent: BodyDescription, X_PB: RigidTransform, child_class: str
    ) -> None:
        """Connects a body to its parent: welded, free, or by a chain of joints with massless bodies between them."""
        from sheldrake.math import RigidTransform

        joints = [self._defaults.apply(joint, child_class, self._reading) for joint in element.find_all("joint")]
        free = element.find_all("freejoint") + [joint for joint in joints if joint.get("type") == "free"]
        if free:
            self._check_free(free[0], joints, element, parent, body.name)
            self._reading.warn_unknown(free[0], attributes=_JOINT_ATTRIBUTES, silent=_JOINT_SILENT)
            body.default_pose = X_PB
            return
        if not joints:
            name = f"{parent.name}_welds_to_{body.name}"
            weld = JointDescription(element.where, name, "weld", _reference(parent), _reference(body), X_FM=X_PB)
            self._model.elements.append(weld)
            return
        if len(joints) > 1 and not X_PB.IsExactlyIdentity():
            self._reading.warn(
                element,
                f"Body '{body.name}' has several joints and a pose: as in Drake the pose follows the first joints, "
                "where MuJoCo has it before them.",
            )
        inboard = parent
        for index, joint in enumerate(joints):
            last = index == len(joints) - 1
            outboard = body if last else BodyDescription(element.where, f"{body.name}{index}")
            if not last:
                self._add_body(outboard)
            self._read_joint(joint, inboard, outboard, X_PB if last else RigidTransform())
            inboard = outboard

    def _check_free(
        self, free: Element, joints: list[Element], element: Element, parent: BodyDescription, body: str
    ) -> None:
        others = [joint for joint in joints if joint.get("type") != "free"]
        if others or len(element.find_all("freejoint")) + len(joints) > 1:
            self._reading.fail(free, f"Body '{body}' has a free joint and cannot have other joints.")
        if not parent.is_world:
            self._reading.fail(free, f"Body '{body}' has a free joint, so it must be a child of the world.")

    def _read_joint(
        self, element: Element, parent: BodyDescription, child: BodyDescription, X_PB: RigidTransform
    ) -> None:
        from sheldrake.math import RigidTransform

        reading = self._reading
        reading.warn_unknown(element, attributes=_JOINT_ATTRIBUTES, silent=_JOINT_SILENT)
        name = element.get("name") or f"{parent.name}-{child.name}"
        written = element.get("type", "hinge")
        if written not in _TYPES:
            known = ", ".join(_TYPES)
            reading.fail(element, f"Joint '{name}' has the unknown type '{written}'; known are {known}.")
        X_BJ = RigidTransform(reading.vector(element, "pos", 3, np.zeros(3)))
        joint = JointDescription(element.where, name, _TYPES[written].name, _reference(parent), _reference(child))
        joint.X_PF, joint.X_CM = X_PB @ X_BJ, X_BJ
        joint.damping = reading.number(element, "damping", 0.0)
        if joint.damping < 0.0:
            reading.fail(element, f"Joint '{name}': damping must not be negative, found {joint.damping:g}.")
        if joint.kind == "ball_rpy":
            if "range" in element.attributes:
                reading.warn(element, f"The range of ball joint '{name}' is not supported and is ignored.")
        else:
            self._read_axis(element, joint)
        self._armature[name] = reading.number(element, "armature", 0.0)
        self._model.elements.append(joint)

    def _read_axis(self, element: Element, joint: JointDescription) -> None:
        """Axis, range and the reference position, at which the body is where the file shows it."""
        reading, compiler = self._reading, self._compiler
        axis = reading.vector(element, "axis", 3, np.array([0.0, 0.0, 1.0]))
        length = float(np.linalg.norm(axis))
        if length < 1e-10:
            reading.fail(element, f"The axis of joint '{joint.name}' is zero.")
        joint.axis = axis / length
        turns = joint.kind == "revolute"
        if is_limited(element, "limited", "range", compiler, reading):
            bounds = reading.vector(element, "range", 2, np.zeros(2))
            joint.limits.lower, joint.limits.upper = compiler.angle(bounds) if turns else bounds
            if joint.limits.lower > joint.limits.upper:
                reading.fail(element, f"Joint '{joint.name}': the range '{element.get('range')}' is upside down.")
        reference = reading.number(element, "ref", 0.0)
        if reference != 0.0:
            joint.default_position = compiler.angle(reference) if turns else reference
            joint.X_CM = joint.X_CM @ _displacement(joint)

    def _read_actuators(self, element: Element) -> None:
        self._reading.warn_unknown(element, [child.tag for child in element])
        for child in element:
            if child.tag not in ("motor", "position"):
                self._reading.pass_over(child)
                self._reading.warn(child, f"The actuator <{child.tag}> is not supported and is ignored.")
        # Motors first, as in Drake: it is the order of the actuation input.
        for child in (*element.find_all("motor"), *element.find_all("position")):
            full = self._defaults.apply(child, MAIN_CLASS, self._reading)
            read_actuator(full, self._model, self._armature, self._compiler, self._reading)

    def _read_contact(self, element: Element) -> None:
        self._reading.warn_unknown(element, ("exclude",))
        for child in element.find_all("exclude"):
            self._reading.warn_unknown(child, attributes=("name", "body1", "body2", "class"))
            pair = [self._body_reference(child, attribute) for attribute in ("body1", "body2")]
            if self._reading.wants_geometry:
                self._model.exclusions.append((pair[0], pair[1]))

    def _read_equality(self, element: Element) -> None:
        self._reading.warn_unknown(element, ("connect",))
        for child in element.find_all("connect"):
            full = self._defaults.apply(child, MAIN_CLASS, self._reading)
            if "site1" in full.attributes or "site2" in full.attributes:
                self._reading.pass_over(full)
                self._reading.warn(
                    full, "<connect> of sites is not supported and is ignored; name bodies, and an anchor."
                )
                continue
            known = ("name", "class", "body1", "body2", "anchor")
            self._reading.warn_unknown(full, attributes=known, silent=("solref", "solimp"))
            anchor = self._reading.vector(full, "anchor", 3)
            if anchor is None:
                self._reading.fail(full, "<connect> needs the attribute 'anchor'.")
            one = self._body_reference(full, "body1")
            other = FrameReference("world", is_world=True)
            if "body2" in full.attributes:
                other = self._body_reference(full, "body2")
            self._model.elements.append(BallConstraintDescription(full.where, one, anchor, other, None))

    def _body_reference(self, element: Element, attribute: str) -> FrameReference:
        name = self._reading.name(element, f"<{element.tag}>", attribute)
        if name == "world":
            return FrameReference(name, is_world=True)
        known = [body.name for body in self._model.bodies if not body.is_world]
        if name not in known:
            where = element.where_attribute(attribute)
            self._reading.fail(where, f"There is no body '{name}'; the bodies are {', '.join(known) or '(none)'}.")
        return FrameReference(name)


def _reference(body: BodyDescription) -> FrameReference:
    return FrameReference(body.name, is_world=body.is_world)


def _displacement(joint: JointDescription) -> RigidTransform:
    """What the child has to be moved back by, so that the joint at its reference position shows the file's pose."""
    from sheldrake.common.eigen_geometry import AngleAxis
    from sheldrake.math import RigidTransform, RotationMatrix

    assert joint.axis is not None, "joints of these kinds have an axis"
    if joint.kind == "prismatic":
        return RigidTransform(joint.default_position * joint.axis)
    return RigidTransform(RotationMatrix(AngleAxis(angle=joint.default_position, axis=joint.axis)), np.zeros(3))
