"""A model as URDF, with Drake's extensions where URDF has no word."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._text import untaken
from sheldrake.geometry import Convex, Mesh, Shape
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


def urdf_text(parts: ModelParts, folder: Path, files: MeshFiles) -> str:
    """The text of a URDF in a folder; `files` names and writes its meshes."""
    return _Urdf(parts, folder, files).text()


def _put_value(node: Node, tag: str, value: Any) -> None:
    node.add(tag, value=value)


def _put_name(node: Node, tag: str, name: str, attribute: str = "name") -> None:
    node.add(tag, **{attribute: name})


class _Urdf:
    def __init__(self, parts: ModelParts, folder: Path, files: MeshFiles):
        self._parts, self._folder, self._files = parts, folder, files
        self._robot = Node("robot", **{"name": parts.name, "xmlns:drake": "https://drake.mit.edu"})
        self._materials: dict[tuple, str] = {}
        self._apart: list[tuple[str, str]] = []  # bodies that are no neighbours any more

    def text(self) -> str:
        parts = self._parts
        check_looks(parts)
        check_gravity(parts)
        if parts.world.visuals or parts.world.collisions:
            self._link(parts.world)
        for body in parts.bodies:
            self._link(body)
        for joint in parts.joints:
            self._joint(joint)
        for joint in parts.joints:
            self._transmissions(joint)
        for name, link, X in parts.frames:
            xyz, rpy = xyz_rpy(X)
            self._robot.add("frame", name=name, link=link, xyz=xyz, rpy=rpy)
        add_forces(self._robot, parts, _put_value, _put_name)
        add_filters(self._robot, parts, self._apart, _put_name)
        for name, X in parts.free_poses.items():
            if not X.IsExactlyIdentity():
                parts.losses.append(f"default pose of the free link '{name}'")
        return self._robot.document()

    def _link(self, part: BodyPart) -> None:
        link = self._robot.add("link", name=part.name)
        if part.name != "world":
            mass, p_BoBcm, I_BBcm = central_inertia(part.body)
            if mass > 0.0:
                inertial = link.add("inertial")
                inertial.add("origin", xyz=p_BoBcm, rpy=np.zeros(3))
                inertial.add("mass", value=mass)
                inertial.add("inertia", **{key: I_BBcm[i, j] for key, i, j in MOMENTS})
        for geometry in part.visuals:
            self._visual(link, geometry)
        for geometry in part.collisions:
            node = self._placed(link, "collision", geometry)
            if node is not None:
                add_proximity(node, geometry, _put_value)

    def _placed(self, link: Node, tag: str, geometry: GeometryDescription) -> Node | None:
        shape = self._shape(geometry.shape)
        if shape is None:
            kind = type(geometry.shape).__name__
            self._parts.losses.append(f"the {tag} '{geometry.name}' of '{link.attributes['name']}': URDF has no {kind}")
            return None
        node = link.add(tag, name=geometry.name)
        self._origin(node, geometry.X_BG)
        node.add("geometry").children.append(shape)
        return node

    def _origin(self, node: Node, X: RigidTransform) -> None:
        if not X.IsExactlyIdentity():
            xyz, rpy = xyz_rpy(X)
            node.add("origin", xyz=xyz, rpy=rpy)

    def _shape(self, shape: Shape) -> Node | None:
        if isinstance(shape, (Mesh, Convex)):
            scale = shape.scale3()
            uri = self._files.name(shape)
            node = Node("mesh", filename=uri, scale=None if np.all(scale == 1.0) else scale)
            if isinstance(shape, Convex):
                node.add("drake:declare_convex")
            return node
        tags = type_of(shape).urdf
        return Node(tags[0].name, **measures(shape, tags[0])) if tags else None

    def _visual(self, link: Node, geometry: GeometryDescription) -> None:
        node = self._placed(link, "visual", geometry)
        if node is None:
            return
        shades = colours(geometry)
        diffuse, image = shades.pop("diffuse", None), image_name(geometry, self._folder)
        for shade in shades:
            text = f"{shade} colours: URDF has the diffuse one only"
            if text not in self._parts.losses:
                self._parts.losses.append(text)
        if diffuse is not None or image is not None:
            key = (None if diffuse is None else tuple(diffuse), image)
            name = self._materials.setdefault(key, f"material_{len(self._materials) + 1}")
            material = node.add("material", name=name)
            if diffuse is not None:
                material.add("color", rgba=diffuse)
            if image is not None:
                material.add("texture", filename=image)
        add_viewers(node, geometry)

    def _joint(self, part: JointPart) -> None:
        X_PF, axis, child = self._without_child_frame(part)
        if not part.type.urdf:
            raise NotImplementedError(f"Joint '{part.name}' is of type {part.kind}, which URDF does not have.")
        tag = "joint" if part.type.urdf_custom is False else "drake:joint"
        node = self._robot.add(tag, name=part.name, type=part.type.urdf[0])
        node.add("parent", link=part.parent)
        node.add("child", link=child)
        self._origin(node, X_PF)
        if part.kind == "weld":
            return
        if axis is not None:
            node.add("axis", xyz=axis)
        if part.type.has_one_axis:
            self._limits(node, part)
        if "screw_pitch" in part.type.takes:
            node.add("drake:screw_thread_pitch", value=part.joint.screw_pitch())
        damping = np.atleast_1d(part.joint.default_damping_vector())
        damping = damping if part.type.damping_each else damping[:1]
        if np.any(damping != 0.0):
            node.add("dynamics", damping=damping)
        if part.mimics is not None:
            source, ratio, offset = part.mimics
            node.add("mimic", joint=source, multiplier=ratio, offset=offset)
        if part.spring is not None:
            self._parts.losses.append(f"the spring of joint '{part.name}': URDF has none")

    def _without_child_frame(self, part: JointPart) -> tuple[Any, np.ndarray | None, str]:
        """Pose of the joint in the parent, axis there, and child link, for a joint whose child moves with frame M.

        URDF puts the child's own frame where the joint is. X_MC commutes with the motion about or along the axis when
        it is a turn, or a shift along the axis, for a prismatic joint any pose; otherwise a link without mass stands
        between the joint and its child.
        """
        X_MC = part.X_CM.inverse()
        if part.kind == "weld":
            return part.X_PF @ part.joint.X_FM() @ X_MC, None, part.child
        axis = axis_of(part)
        if part.X_CM.IsExactlyIdentity():
            return part.X_PF, axis, part.child
        if part.type.has_one_axis:
            p_CM = np.asarray(part.X_CM.translation())
            axis_C = part.X_CM.rotation().matrix() @ axis
            if part.kind == "prismatic" or np.linalg.norm(np.cross(p_CM, axis_C)) == 0.0:
                return part.X_PF @ X_MC, axis_C, part.child
        between = self._between(part)
        return part.X_PF, axis, between

    def _between(self, part: JointPart) -> str:
        name = untaken(f"{part.name}_frame", {*self._parts.names.values()})
        self._parts.names[("between", name)] = name
        self._robot.add("link", name=name)
        weld = self._robot.add("joint", name=f"{name}_to_{part.child}", type="fixed")
        weld.add("parent", link=name)
        weld.add("child", link=part.child)
        self._origin(weld, part.X_CM.inverse())
        self._parts.losses.append(
            f"joint '{part.name}' is not at the origin of '{part.child}': link '{name}' was added"
        )
        if part.parent != "world":
            self._apart.append((part.parent, part.child))
        return name

    def _limits(self, node: Node, part: JointPart) -> None:
        joint = part.joint
        lower, upper = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
        if part.kind == "revolute" and np.isinf(lower) and np.isinf(upper):
            node.attributes["type"] = "continuous"
        values = {"lower": lower, "upper": upper, "velocity": joint.velocity_upper_limits()[0]}
        values["drake:acceleration"] = joint.acceleration_upper_limits()[0]
        if part.actuators:
            values["effort"] = part.actuators[0].effort_limit()
        finite = {key: value for key, value in values.items() if np.isfinite(value)}
        if finite:
            node.add("limit", **finite)

    def _transmissions(self, part: JointPart) -> None:
        for actuator in part.actuators:
            name = actuator.name()
            node = self._robot.add("transmission", name=f"{name}_transmission")
            node.add("type", "transmission_interface/SimpleTransmission")
            node.add("joint", name=part.name)
            inside = node.add("actuator", name=name)
            if actuator.default_rotor_inertia() != 0.0:
                inside.add("drake:rotor_inertia", value=actuator.default_rotor_inertia())
            if actuator.default_gear_ratio() != 1.0:
                inside.add("drake:gear_ratio", value=actuator.default_gear_ratio())
            if actuator.has_controller():
                gains = actuator.get_controller_gains()
                inside.add("drake:controller_gains", p=gains.p, d=gains.d)
