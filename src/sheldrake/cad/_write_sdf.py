"""A model as SDFormat, with Drake's extensions where SDFormat has no word."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._text import untaken
from sheldrake.geometry import Convex, HalfSpace, Mesh, Shape
from sheldrake.geometry._shape_types import type_of
from sheldrake.multibody.parsing._model.description import GeometryDescription

from ._mesh_files import MeshFiles
from ._model_parts import BodyPart, JointPart, ModelParts
from ._write_parts import (
    add_filters,
    add_forces,
    add_proximity,
    add_viewers,
    axis_of,
    central_inertia,
    check_gravity,
    check_looks,
    colours,
    image_name,
    measures,
)
from ._xml_tree import MOMENTS, Node, xyz_rpy

if TYPE_CHECKING:
    from sheldrake.math import RigidTransform


def sdf_text(parts: ModelParts, folder: Path, files: MeshFiles) -> str:
    """The text of an SDFormat file in a folder; `files` names and writes its meshes."""
    return _Sdf(parts, folder, files).text()


def _put(node: Node, tag: str, value: Any, attribute: str = "") -> None:
    node.add(tag, value)


def _free_name(name: str, what: str, taken: set[str]) -> str:
    """The name, with an ending when it is taken; takes it."""
    return untaken(f"{name}_{what}" if name in taken else name, taken)


class _Sdf:
    def __init__(self, parts: ModelParts, folder: Path, files: MeshFiles):
        self._parts, self._folder, self._files = parts, folder, files
        self._sdf = Node("sdf", **{"version": "1.9", "xmlns:drake": "https://drake.mit.edu"})
        self._model = self._sdf.add("model", name=parts.name)

    def text(self) -> str:
        parts = self._parts
        check_looks(parts)
        check_gravity(parts)
        if not parts.bodies:
            raise ValueError("A model without links can not be written as SDFormat.")
        for geometry in [*parts.world.visuals, *parts.world.collisions]:
            parts.losses.append(f"the geometry '{geometry.name}' of the world: a model has none there")
        self._tell_names_apart()
        inboard = {joint.child: joint for joint in parts.joints}
        for body in parts.bodies:
            self._link(body, inboard.get(body.name))
        for joint in parts.joints:
            self._joint(joint)
        for name, link, X in parts.frames:
            self._pose(self._model.add("frame", name=name, attached_to=link), X)
        add_forces(self._model, parts, _put, _put)
        add_filters(self._model, parts, [], _put)
        return self._sdf.document()

    def _tell_names_apart(self) -> None:
        """Links, joints and frames of an SDFormat model have different names: joints give way, then frames."""
        taken = {body.name for body in self._parts.bodies}
        renamed = {}
        for joint in self._parts.joints:
            name = _free_name(joint.name, "joint", taken)
            if name != joint.name:
                self._parts.losses.append(f"joint '{joint.name}' is called '{name}': a link has its name")
                renamed[joint.name] = name
                joint.name = name
        for joint in self._parts.joints:
            if joint.mimics is not None and joint.mimics[0] in renamed:
                joint.mimics = (renamed[joint.mimics[0]], *joint.mimics[1:])
        frames = []
        for old, body, X in self._parts.frames:
            name = _free_name(old, "frame", taken)
            if name != old:
                self._parts.losses.append(f"frame '{old}' is called '{name}': a joint has its name")
            frames.append((name, body, X))
        self._parts.frames = frames

    def _pose(self, node: Node, X: RigidTransform, relative_to: str | None = None) -> None:
        xyz, rpy = xyz_rpy(X)
        if relative_to is not None or not X.IsExactlyIdentity():
            node.add("pose", np.concatenate([xyz, rpy]), relative_to=relative_to)

    def _link(self, part: BodyPart, joint: JointPart | None) -> None:
        link = self._model.add("link", name=part.name)
        if joint is not None:
            X_FM = joint.joint.X_FM() if joint.kind == "weld" else None
            X_PM = joint.X_PF if X_FM is None else joint.X_PF @ X_FM
            self._pose(link, X_PM @ joint.X_CM.inverse(), None if joint.parent == "world" else joint.parent)
        elif part.name in self._parts.free_poses:
            self._pose(link, self._parts.free_poses[part.name])
        mass, p_BoBcm, I_BBcm = central_inertia(part.body)
        inertial = link.add("inertial")
        if np.any(p_BoBcm != 0.0):
            inertial.add("pose", np.concatenate([p_BoBcm, np.zeros(3)]))
        inertial.add("mass", mass)
        inertia = inertial.add("inertia")
        for key, i, j in MOMENTS:
            inertia.add(key, I_BBcm[i, j])
        for geometry in part.visuals:
            self._visual(link, geometry)
        for geometry in part.collisions:
            node = self._placed(link, "collision", geometry)
            if node is not None:
                add_proximity(node, geometry, _put)

    def _placed(self, link: Node, tag: str, geometry: GeometryDescription) -> Node | None:
        shape = self._shape(geometry.shape)
        if shape is None:
            kind = type(geometry.shape).__name__
            self._parts.losses.append(
                f"the {tag} '{geometry.name}' of '{link.attributes['name']}': SDFormat has no {kind}"
            )
            return None
        node = link.add(tag, name=geometry.name)
        self._pose(node, geometry.X_BG)
        node.add("geometry").children.append(shape)
        return node

    def _shape(self, shape: Shape) -> Node | None:
        if isinstance(shape, HalfSpace):
            node = Node("plane")
            node.add("normal", [0.0, 0.0, 1.0])
            node.add("size", [1.0, 1.0])
            return node
        if isinstance(shape, (Mesh, Convex)):
            node = Node("mesh")
            node.add("uri", self._files.name(shape))
            if np.any(shape.scale3() != 1.0):
                node.add("scale", shape.scale3())
            if isinstance(shape, Convex):
                node.add("drake:declare_convex")
            return node
        tags = type_of(shape).sdf
        if not tags:
            return None
        node = Node(tags[0].name)
        for tag, value in measures(shape, tags[0]).items():
            node.add(tag, value)
        return node

    def _visual(self, link: Node, geometry: GeometryDescription) -> None:
        node = self._placed(link, "visual", geometry)
        if node is None:
            return
        shades, image = colours(geometry), image_name(geometry, self._folder)
        if shades or image is not None:
            material = node.add("material")
            for shade, rgba in shades.items():
                material.add(shade, rgba)
            if image is not None:
                material.add("drake:diffuse_map", image)
        add_viewers(node, geometry)

    def _joint(self, part: JointPart) -> None:
        if part.type.sdf_custom:
            self._custom(part)
            return
        if not part.type.sdf:
            raise NotImplementedError(f"Joint '{part.name}' is of type {part.kind}, which SDFormat does not have.")
        node = self._model.add("joint", name=part.name, type=part.type.sdf[0])
        node.add("parent", part.parent)
        node.add("child", part.child)
        self._pose(node, part.X_CM)
        if part.type.has_one_axis:
            self._actuated(node, part)
        elif part.kind in ("ball_rpy", "universal"):
            damping = float(np.atleast_1d(part.joint.default_damping_vector())[0])
            for number, direction in enumerate(([1.0, 0.0, 0.0], [0.0, 1.0, 0.0])):
                if part.kind == "universal" or (number == 0 and damping != 0.0):
                    axis = node.add("axis2" if number else "axis")
                    axis.add("xyz", direction)
                    axis.add("limit").add("effort", 0.0)
                    axis.add("dynamics").add("damping", damping)
        if part.mimics is not None:
            source, ratio, offset = part.mimics
            node.add("drake:mimic", joint=source, multiplier=ratio, offset=offset)

    def _actuated(self, node: Node, part: JointPart) -> None:
        joint = part.joint
        axis = node.add("axis")
        axis.add("xyz", axis_of(part))
        limit = axis.add("limit")
        values = {
            "lower": joint.position_lower_limits()[0],
            "upper": joint.position_upper_limits()[0],
            "velocity": joint.velocity_upper_limits()[0],
            "drake:acceleration": joint.acceleration_upper_limits()[0],
        }
        for key, value in values.items():
            if np.isfinite(value):
                limit.add(key, value)
        effort = part.actuators[0].effort_limit() if part.actuators else 0.0
        limit.add("effort", effort if np.isfinite(effort) else -1.0)
        dynamics = Node("dynamics")
        damping = float(np.atleast_1d(joint.default_damping_vector())[0])
        if damping != 0.0:
            dynamics.add("damping", damping)
        if part.spring is not None and part.type.spring:
            dynamics.add("spring_stiffness", part.spring[0])
            dynamics.add("spring_reference", part.spring[1])
        if dynamics.children:
            axis.children.append(dynamics)
        if "screw_pitch" in part.type.takes:
            node.add("screw_thread_pitch", joint.screw_pitch())
        self._actuators(node, part)

    def _actuators(self, node: Node, part: JointPart) -> None:
        for number, actuator in enumerate(part.actuators):
            if number:
                self._parts.losses.append(f"actuator '{actuator.name()}': a joint has one in SDFormat")
                continue
            if actuator.name() != part.name:
                self._parts.losses.append(f"actuator '{actuator.name()}' is called like its joint, '{part.name}'")
            if actuator.default_rotor_inertia() != 0.0:
                node.add("drake:rotor_inertia", actuator.default_rotor_inertia())
            if actuator.default_gear_ratio() != 1.0:
                node.add("drake:gear_ratio", actuator.default_gear_ratio())
            if actuator.has_controller():
                gains = actuator.get_controller_gains()
                node.add("drake:controller_gains", p=gains.p, d=gains.d)

    def _custom(self, part: JointPart) -> None:
        """Its ends are named frames. Readers put it after all ordinary joints, whatever the order in the file."""
        later = self._parts.joints[self._parts.joints.index(part) + 1 :]
        if any(joint.type.velocities and not joint.type.sdf_custom for joint in later):
            self._parts.losses.append(f"the place of joint '{part.name}' among the joints: {part.kind} ones come last")
        node = Node("drake:joint", name=part.name, type=part.type.sdf_custom)
        for end, body, X in (("parent", part.parent, part.X_PF), ("child", part.child, part.X_CM)):
            name = body
            if not X.IsExactlyIdentity():
                name = f"{part.name}_{end}"
                self._pose(self._model.add("frame", name=name, attached_to=body), X)
            node.add(f"drake:{end}", name)
        node.add("drake:damping", part.joint.default_damping_vector())
        self._model.children.append(node)
