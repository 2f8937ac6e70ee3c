"""SDFormat joints of type gearbox: they couple two other joints."""

from __future__ import annotations

import numpy as np

from .._files.xml import Element
from .._model.description import (
    CouplerDescription,
    FrameReference,
    GearboxDescription,
    JointDescription,
    ModelDescription,
)
from .._reading.reading import Reading
from .children import child_number
from .frames import SdfScope
from .joints import read_axis, read_ends, reference

_TAGS = ("parent", "child", "pose", "axis", "axis2", "gearbox_ratio", "gearbox_reference_body")


def read_gearbox(
    element: Element, model: ModelDescription, scope: SdfScope, version: tuple[int, int], reading: Reading
) -> None:
    """Adds a gearbox to a model; it becomes a coupler when all joints are known."""
    name = reading.name(element, "<joint>")
    reading.warn_unknown(element, _TAGS, ("name", "type"))
    parent, child = read_ends(element, name, scope, reading)
    body = element.find("gearbox_reference_body")
    if body is None or not body.text.strip():
        reading.fail(element, f"Gearbox '{name}' has no <gearbox_reference_body>.")
    axes = [element.find(tag) for tag in ("axis", "axis2")]
    if axes[0] is None:
        reading.fail(element, f"Gearbox '{name}' needs an <axis>.")
    R_MJ = scope.pose(name, element.where).rotation()
    directions = [R_MJ @ read_axis(axis, name, scope, version, reading).direction for axis in axes if axis is not None]
    ratio = child_number(element, "gearbox_ratio", reading, 1.0)
    ends = reference(scope, body.text.strip(), body), parent, child
    model.gearboxes.append(
        GearboxDescription(element.where, name, *ends, ratio, np.array([directions[0], directions[-1]]))
    )


def make_couplers(model: ModelDescription, scope: SdfScope, reading: Reading) -> None:
    """Turns the gearboxes of a model into couplers of the joints they mean."""
    for gearbox in model.gearboxes:
        source, source_sign = _joint_to(gearbox, gearbox.parent, gearbox.axes[0], model, scope, reading)
        joint, sign = _joint_to(gearbox, gearbox.child, gearbox.axes[1], model, scope, reading)
        ratio = -gearbox.ratio * source_sign * sign
        model.couplers.append(CouplerDescription(gearbox.where, joint.name, source.name, ratio, 0.0))
    model.gearboxes = []


def _joint_to(
    gearbox: GearboxDescription,
    link: FrameReference,
    axis: np.ndarray,
    model: ModelDescription,
    scope: SdfScope,
    reading: Reading,
) -> tuple[JointDescription, float]:
    """The turning joint between the reference body and a link, and 1.0 or -1.0: how it counts the gearbox's angle."""
    ends = gearbox.reference, link
    for joint in model.joints():
        if joint.kind == "revolute" and (joint.parent, joint.child) in (ends, ends[::-1]):
            assert joint.axis is not None
            along = float((scope.pose(joint.name, joint.where).rotation() @ joint.axis) @ axis)
            if abs(along) < 1.0 - 1e-6:
                reading.fail(
                    gearbox.where,
                    f"An axis of gearbox '{gearbox.name}' is not that of joint '{joint.name}', whose angle it means.",
                )
            return joint, float(np.sign(along)) * (1.0 if joint.parent == ends[0] else -1.0)
    reading.fail(
        gearbox.where,
        f"Gearbox '{gearbox.name}' needs a revolute joint between its reference body '{ends[0]}' and '{ends[1]}'.",
    )
