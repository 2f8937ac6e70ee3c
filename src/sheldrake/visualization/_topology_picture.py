"""Which body hangs on which by what joint, as SVG."""

from __future__ import annotations

import os
from html import escape
from typing import TYPE_CHECKING, Any

from sheldrake.multibody.tree import BodyIndex

from ._layered_layout import Wire
from ._svg_boxes import EDGE, PortBox, document, draw_boxes

if TYPE_CHECKING:
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import Joint
    from sheldrake.multibody.tree._rigid_body import RigidBody


def DrawTopology(plant: MultibodyPlant, path: str | os.PathLike | None = None) -> str:
    """Returns a picture of a plant's bodies and joints as SVG, made without other programs.

    The world is on the left; each body names the joint that holds it, with the joint's type and whether it is driven.

    Args:
        plant: A finalized MultibodyPlant.
        path: A file to write the picture to as well, "robot.svg".

    Raises:
        RuntimeError: when the plant is not finalized.
    """
    if not plant.is_finalized():
        raise RuntimeError("DrawTopology(): call plant.Finalize() first.")
    joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
    driven = {plant.get_joint_actuator(index).joint().index() for index in plant.GetJointActuatorIndices()}
    bodies = [plant.get_body(BodyIndex(i)) for i in range(plant.num_bodies())]
    place = {body.index(): k for k, body in enumerate(bodies)}
    held: list[list[Any]] = [[] for _ in bodies]
    for joint in joints:
        held[place[joint.child_body().index()]].append(joint)
    holds = {place[joint.parent_body().index()] for joint in joints}
    boxes = [
        PortBox(
            body.name(),
            _about(plant, body),
            [(_joint_text(joint, joint.index() in driven), _joint_tip(joint), True) for joint in held[k]],
            [("", "", True)] if k in holds else [],
        )
        for k, body in enumerate(bodies)
    ]
    wires, titles = [], []
    for k, joints_of_body in enumerate(held):
        for row, joint in enumerate(joints_of_body):
            wires.append(Wire((place[joint.parent_body().index()], 0), (k, row)))
            titles.append(_joint_tip(joint))
    drawing, width, height = draw_boxes(boxes, wires, titles)
    title = plant.get_name() or "plant"
    body = f'<text class="title" x="{EDGE}" y="20">{escape(title)}</text>\n{drawing}'
    text = document(body, width, height, f"Bodies and joints of {title}")
    if path is not None:
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
    return text


def _about(plant: MultibodyPlant, body: RigidBody) -> str:
    """Returns the line below a body's name: its model and mass."""
    if body is plant.world_body():
        return ""
    return f"{plant.GetModelInstanceName(body.model_instance())} \u00b7 {float(body.default_mass()):.3g} kg"


def _joint_text(joint: Joint, is_driven: bool) -> str:
    return f"{joint.name()} ({joint.type_name()}{', driven' if is_driven else ''})"


def _joint_tip(joint: Joint) -> str:
    """Returns what pointing at a joint says: what it joins, and its limits."""
    text = f"{joint.parent_body().name()} \u2192 {joint.child_body().name()}: {joint.name()}, {joint.type_name()}"
    if joint.num_positions() == 1:
        text += f", from {joint.position_lower_limits()[0]:.4g} to {joint.position_upper_limits()[0]:.4g}"
    return text
