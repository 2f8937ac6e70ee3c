"""A model as MJCF, as MuJoCo understands it."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._text import untaken
from sheldrake.geometry import Convex, HalfSpace, Mesh
from sheldrake.geometry._shape_types import type_of
from sheldrake.multibody.parsing._model.description import GeometryDescription

from ._mesh_files import MeshFiles
from ._model_parts import BodyPart, JointPart, ModelParts
from ._write_parts import axis_of, central_inertia, check_looks, colours, has_standard_gravity, texture
from ._xml_tree import Node

if TYPE_CHECKING:
    from sheldrake.math import RigidTransform
    from sheldrake.multibody.tree import Joint, JointActuator

MESHES = (".obj", ".stl")
"""What MuJoCo reads; other meshes are written as OBJ beside the file."""

_UNLIMITED = 1e10  # MuJoCo's largest number (mjMAXVAL); a range has two ends
_LOCKED = 1e-9  # half width of the range of a joint that must not move [rad or m]; MuJoCo wants a width
_REFUSED = 1e-14  # mass [kg] and moments of inertia [kg m²] that MuJoCo does not take of what moves (mjMINVAL, mjEPS)
_LEAST = 1e-12  # what such a body gets
_VISUAL_GROUP, _COLLISION_GROUP = "2", "3"  # as in MuJoCo's own models: its viewer shows 0 to 2


def mjcf_text(parts: ModelParts, folder: Path, files: MeshFiles) -> str:
    """The text of an MJCF file in a folder; `files` names and writes its meshes."""
    return _Mjcf(parts, files).text()


class _Mjcf:
    def __init__(self, parts: ModelParts, files: MeshFiles):
        self._parts, self._files = parts, files
        self._mujoco = Node("mujoco", model=parts.name)
        self._assets = Node("asset")
        self._tendons = Node("tendon")
        self._equalities = Node("equality")
        self._contact = Node("contact")
        self._nodes: dict[str, Node] = {}  # of bodies, by name
        self._meshes: dict[tuple, str] = {}
        self._names: dict[str, set[str]] = {}
        self._inboard = _tree(parts)
        self._counts: dict[str, int] = {}  # how often something is lost

    def text(self) -> str:
        parts, mujoco = self._parts, self._mujoco
        check_looks(parts)
        # What a geom weighs is in the inertia of its body; `mass` 0 says so to those who sum up geoms all the same.
        mujoco.add("compiler", angle="radian", autolimits="true", inertiafromgeom="false")
        if not has_standard_gravity(parts):
            mujoco.add("option", gravity=parts.gravity)
        mujoco.add("default").add("geom", mass=0.0)
        mujoco.children.append(self._assets)
        world = self._nodes["world"] = mujoco.add("worldbody")
        self._geoms(world, parts.world)
        self._bodies()
        self._sites()
        actuators = Node("actuator")
        for actuator in parts.actuators:
            self._actuator(actuators, actuator)
        self._constraints()
        self._filters()
        mujoco.children += [n for n in (self._tendons, actuators, self._equalities, self._contact) if n.children]
        if not self._assets.children:
            mujoco.children.remove(self._assets)
        parts.losses += [what.format(n) for what, n in self._counts.items()]
        return mujoco.document()

    def _count(self, what: str) -> None:
        """Notes a loss that is said once, with how often it happens in the place of {}."""
        self._counts[what] = self._counts.get(what, 0) + 1

    def _unique(self, kind: str, name: str) -> str:
        return untaken(name, self._names.setdefault(kind, set()))

    # Bodies, in the order of a tree: a body stands inside its parent.

    def _bodies(self) -> None:
        inboard = self._inboard
        waiting = list(self._parts.bodies)
        while waiting:
            later = []
            for body in waiting:
                joint = inboard.get(body.name)
                parent = "world" if joint is None else joint.parent
                if parent in self._nodes:
                    self._body(body, joint, self._nodes[parent])
                else:
                    later.append(body)
            if len(later) == len(waiting):
                names = ", ".join(body.name for body in later)
                raise NotImplementedError(f"The bodies {names} are no tree, which MJCF wants.")
            waiting = later

    def _body(self, part: BodyPart, joint: JointPart | None, parent: Node) -> None:
        node = self._nodes[part.name] = parent.add("body", name=part.name)
        if joint is None:
            if part.name in self._parts.free_poses:
                _place(node, self._parts.free_poses[part.name])
            node.add("freejoint", name=self._unique("joint", part.name))
        else:
            X_PM = joint.X_PF
            if joint.kind == "weld":
                X_FM = joint.joint.X_FM()
                X_PM = X_PM @ (X_FM.inverse() if joint.is_reversed else X_FM)
            _place(node, X_PM @ joint.X_CM.inverse())
            self._joint(node, joint)
        self._inertial(node, part, moves=joint is None or joint.kind != "weld")
        self._geoms(node, part)

    def _inertial(self, node: Node, part: BodyPart, moves: bool) -> None:
        mass, p_BoBcm, I_BBcm = central_inertia(part.body)
        if moves and not self._has_inertia(part):
            self._count(f"that {{}} moving bodies have no mass or no inertia: MuJoCo wants some, they get {_LEAST:g}")
            mass, I_BBcm = max(mass, _LEAST), I_BBcm + _LEAST * np.eye(3)
        if mass == 0.0:
            return
        I_BBcm = self._accepted(I_BBcm)
        moments = [I_BBcm[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        if np.any(moments[3:]):
            node.add("inertial", pos=p_BoBcm, mass=mass, fullinertia=moments)
        else:
            node.add("inertial", pos=p_BoBcm, mass=mass, diaginertia=moments[:3])

    def _accepted(self, I_BBcm: np.ndarray) -> np.ndarray:
        """The inertia, enlarged where MuJoCo would refuse it: no moment may be 0 or more than the two others together.

        A rod and a flat plate are at these edges, so that rounding decides.
        """
        moments = np.linalg.eigvalsh(I_BBcm)
        short = max(moments[2] - moments[0] - moments[1], -moments[0]) + _REFUSED
        if short <= 0.0:
            return I_BBcm
        if short > max(1e-9 * moments[2], 2.0 * _REFUSED):
            self._count("that {} bodies have moments of inertia that no body has, A + B < C: MuJoCo gets larger ones")
        return I_BBcm + 2.0 * short * np.eye(3)

    def _has_inertia(self, part: BodyPart) -> bool:
        """Whether a body, or one that is welded to it, has enough mass and inertia for MuJoCo."""
        mass, _, I_BBcm = central_inertia(part.body)
        if mass >= _REFUSED and np.linalg.eigvalsh(I_BBcm)[0] >= _REFUSED:
            return True
        welded = {joint.child for joint in self._parts.joints if joint.kind == "weld" and joint.parent == part.name}
        return any(self._has_inertia(other) for other in self._parts.bodies if other.name in welded)

    # Joints: of a body, in its own frame.

    def _joint(self, node: Node, part: JointPart) -> None:
        if part.kind == "weld":
            return
        kinds = part.type.mjcf
        if not kinds:
            raise NotImplementedError(f"Joint '{part.name}' is of type {part.kind}, which MJCF does not have.")
        name, joint = self._unique("joint", part.name), part.joint
        pos = np.asarray(part.X_CM.translation())
        damping = np.atleast_1d(joint.default_damping_vector())
        R_CM = part.X_CM.rotation().matrix()
        if part.kind == "ball_rpy" and not part.is_reversed:
            self._count("that {} ball joints have roll, pitch and yaw: MuJoCo's have a quaternion")
            node.add("joint", name=name, type="ball", pos=pos, damping=_nonzero(damping[0]))
            return
        if part.is_reversed and not part.type.has_one_dof:
            raise NotImplementedError(f"Joint '{part.name}', {part.kind}, would have to be turned round for a tree.")
        if len(kinds) > 1:
            axes = np.eye(3)[: len(kinds)]
            for number, (kind, axis) in enumerate(zip(kinds, axes)):
                one = self._unique("joint", f"{part.name}_{number + 1}")
                value = damping[min(number, len(damping) - 1)]
                node.add("joint", name=one, type=kind, pos=pos, axis=R_CM @ axis, damping=_nonzero(value))
            if not part.X_PF.IsExactlyIdentity() or not part.X_CM.IsExactlyIdentity():
                what = "the place of joint '{}' for Drake and sheldrake, which put it behind a body's first joints"
                self._parts.losses.append(what.format(part.name))
            return
        axis = R_CM @ axis_of(part) * (-1.0 if part.is_reversed else 1.0)
        made = node.add("joint", name=name, type=kinds[0], pos=pos, axis=axis, damping=_nonzero(damping[0]))
        self._limits(made, part)
        if part.spring is not None:
            made.attributes["stiffness"], made.attributes["springref"] = part.spring
        armature = sum(a.default_rotor_inertia() * a.default_gear_ratio() ** 2 for a in part.actuators)
        if armature != 0.0:
            made.attributes["armature"] = armature

    def _limits(self, node: Node, part: JointPart) -> None:
        joint = part.joint
        lower, upper = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
        if lower == upper:
            self._count(f"that {{}} joints are locked by equal limits: their range is {2 * _LOCKED:g} wide")
            lower, upper = lower - _LOCKED, upper + _LOCKED
        if np.isfinite(lower) or np.isfinite(upper):
            if not (np.isfinite(lower) and np.isfinite(upper)):
                self._count(f"that {{}} joints have one limit only: the other is {_UNLIMITED:g}")
            node.attributes["range"] = [max(lower, -_UNLIMITED), min(upper, _UNLIMITED)]
        for what in ("velocity", "acceleration"):
            if np.isfinite(getattr(joint, f"{what}_upper_limits")()[0]):
                self._count(f"{what} limits of {{}} joints")

    # Geometry.

    def _geoms(self, node: Node, part: BodyPart) -> None:
        for geometry in part.visuals:
            geom = self._geom(node, part, geometry, "visual")
            if geom is None:
                continue
            rgba = colours(geometry).get("diffuse")
            geom.attributes |= {"contype": "0", "conaffinity": "0", "group": _VISUAL_GROUP}
            if rgba is not None:
                geom.attributes["rgba"] = rgba
            if texture(geometry) is not None:
                self._count("images on {} visual geometries")
        for geometry in part.collisions:
            geom = self._geom(node, part, geometry, "collision")
            if geom is not None:
                geom.attributes["group"] = _COLLISION_GROUP
                self._friction(geom, geometry.proximity)

    def _geom(self, node: Node, part: BodyPart, geometry: GeometryDescription, role: str) -> Node | None:
        shape = geometry.shape
        attributes: dict[str, Any]
        written = type_of(shape).mjcf
        if written is not None:
            attributes = {"type": written.type, "size": np.array(shape._values()) * written.factors}
        elif isinstance(shape, HalfSpace) and part.name == "world":
            attributes = {"type": "plane", "size": [0.0, 0.0, 1.0]}
        elif isinstance(shape, (Mesh, Convex)):
            attributes = {"type": "mesh", "mesh": self._mesh(shape)}
        else:
            where = f"the {role} '{geometry.name}' of '{part.name}'"
            moves = " that moves" if isinstance(shape, HalfSpace) else ""
            self._parts.losses.append(f"{where}: MuJoCo has no {shape.type_name()}{moves}")
            return None
        name = self._unique("geom", f"{part.name}_{geometry.name}")
        geom = node.add("geom", name=name, **attributes)
        _place(geom, geometry.X_BG)
        return geom

    def _mesh(self, shape: Mesh | Convex) -> str:
        file, scale = self._files.name(shape), tuple(np.asarray(shape.scale3(), dtype=float))
        if (file, scale) not in self._meshes:
            name = self._unique("mesh", Path(file).stem)
            self._meshes[file, scale] = name
            # Of a surface with holes MuJoCo computes no volume, and takes no file then; it wants none of a shell.
            mesh = self._assets.add("mesh", name=name, file=file, inertia="shell")
            if scale != (1.0, 1.0, 1.0):
                mesh.attributes["scale"] = scale
        return self._meshes[file, scale]

    def _friction(self, geom: Node, properties: Any) -> None:
        if properties.HasProperty("material", "coulomb_friction"):
            friction = properties.GetProperty("material", "coulomb_friction")
            geom.attributes["friction"] = friction.dynamic_friction()
            if friction.static_friction() != friction.dynamic_friction():
                self._count("static friction of {} geometries: MuJoCo has one coefficient")
        for group in ("material", "hydroelastic"):
            if properties.HasGroup(group) and set(properties.GetPropertiesInGroup(group)) - {"coulomb_friction"}:
                self._count(f"{group} properties of {{}} geometries, other than friction")

    # What joins bodies, moves joints or marks places.

    def _sites(self) -> None:
        for name, body, X in self._parts.frames:
            self._site(body, name, X)

    def _site(self, body: str, name: str, X: RigidTransform) -> str:
        name = self._unique("site", name)
        _place(self._nodes[body].add("site", name=name, size=0.005, group="4"), X)
        return name

    def _actuator(self, actuators: Node, actuator: JointActuator) -> None:
        name = self._unique("actuator", actuator.name())
        limit = actuator.effort_limit()
        joint = self._joint_name(actuator.joint())
        bounds = [-limit, limit] if np.isfinite(limit) and limit > 0.0 else None
        if limit == 0.0:
            self._count("that {} actuators have an effort limit of 0: MuJoCo wants a range")
        if actuator.has_controller():
            gains = actuator.get_controller_gains()
            actuators.add("position", name=name, joint=joint, kp=gains.p, kv=_nonzero(gains.d), forcerange=bounds)
            if gains.d != 0.0:
                self._count("desired velocities of {} controlled actuators: MuJoCo's damps the velocity itself")
        else:
            actuators.add("motor", name=name, joint=joint, ctrlrange=bounds)
        if actuator.default_gear_ratio() != 1.0:
            self._count(
                "rotor inertia and gear ratio of {} actuators as two numbers: `armature` is what they are together"
            )

    def _joint_name(self, joint: Joint) -> str:
        return next(part.name for part in self._parts.joints if part.joint.index() == joint.index())

    def _constraints(self) -> None:
        for joint in self._parts.joints:
            if joint.mimics is not None:
                source, ratio, offset = joint.mimics
                line = [offset, ratio, 0.0, 0.0, 0.0]
                self._equalities.add("joint", joint1=joint.name, joint2=source, polycoef=line)
        for one, p_AP, other, p_BQ in self._parts.balls:
            sites = [self._site(b, f"{b}_anchor", _at(p)) for b, p in ((one, p_AP), (other, p_BQ))]
            self._equalities.add("connect", site1=sites[0], site2=sites[1])
        for force in self._parts.forces:
            if type(force).__name__ != "LinearSpringDamper":
                self._parts.losses.append(f"force element {type(force).__name__}")
                continue
            spring = self._tendons.add("spatial", springlength=force.free_length(), stiffness=force.stiffness())
            spring.attributes["damping"] = force.damping()
            for body, p in ((force.bodyA(), force.p_AP()), (force.bodyB(), force.p_BQ())):
                where = self._parts.names[body.index()]
                spring.add("site", site=self._site(where, f"{where}_spring", _at(p)))

    def _filters(self) -> None:
        """Pairs that pass through each other, but for those that MuJoCo finds itself: neighbours that move."""
        parts = self._parts
        touching = {part.name for part in parts.bodies if part.collisions}
        fixed = {"world"}
        for joint in self._in_tree_order():
            if joint.kind == "weld" and joint.parent in fixed:
                fixed.add(joint.child)
        pairs = list(parts.filtered)
        known = {frozenset(pair) for pair in pairs}
        for joint in self._inboard.values():
            pair = joint.parent, joint.child
            to_itself = joint.kind != "weld" and joint.parent in fixed and {*pair} <= touching
            if to_itself and frozenset(pair) not in known:
                pairs.append(pair)
        for one, other in pairs:
            self._contact.add("exclude", body1=one, body2=other)

    def _in_tree_order(self) -> list[JointPart]:
        order = {name: number for number, name in enumerate(self._nodes)}
        return sorted(self._inboard.values(), key=lambda joint: order[joint.child])


def _tree(parts: ModelParts) -> dict[str, JointPart]:
    """The joint of each body towards the world; those that a plant takes the other way round are turned round."""
    known = {"world", *parts.free_poses}
    known |= {part.name for part in parts.bodies if not _joints_of(part.name, parts)}
    inboard: dict[str, JointPart] = {}

    def reach(joint: JointPart) -> bool:
        if joint.parent not in known or joint.child in known:
            return False
        inboard[joint.child] = joint
        known.add(joint.child)
        return True

    while True:
        while any([reach(joint) for joint in parts.joints]) or any(reach(_turned(joint)) for joint in parts.joints):
            pass
        # Of a plant that is not finalized, nobody knows yet what will be free: the first body that no joint holds.
        left = [part.name for part in parts.bodies if part.name not in known]
        if not left:
            return inboard
        children = {joint.child for joint in parts.joints}
        known.add(next((name for name in left if name not in children), left[0]))


def _joints_of(body: str, parts: ModelParts) -> list[JointPart]:
    return [joint for joint in parts.joints if body in (joint.parent, joint.child)]


def _turned(part: JointPart) -> JointPart:
    return dataclasses.replace(
        part, parent=part.child, child=part.parent, X_PF=part.X_CM, X_CM=part.X_PF, is_reversed=True
    )


def _place(node: Node, X: RigidTransform) -> None:
    """Adds the pose of a node in what it stands in."""
    if np.any(np.asarray(X.translation())):
        node.attributes["pos"] = np.asarray(X.translation())
    if not X.rotation().IsExactlyIdentity():
        node.attributes["quat"] = np.asarray(X.rotation().ToQuaternion().wxyz())


def _at(p: Any) -> RigidTransform:
    from sheldrake.math import RigidTransform

    return RigidTransform(np.asarray(p, dtype=float))


def _nonzero(value: float) -> float | None:
    return float(value) if value != 0.0 else None
