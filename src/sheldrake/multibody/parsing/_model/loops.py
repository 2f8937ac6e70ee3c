"""Joints that close kinematic loops: links are divided, so that joints form trees, and their halves welded together."""

from __future__ import annotations

from .._files.diagnostics import DiagnosticPolicy
from .description import (
    BodyDescription,
    FrameReference,
    JointDescription,
    ModelDescription,
    WeldConstraintDescription,
)


def cut_loop(
    model: ModelDescription, joint: JointDescription, child: BodyDescription, name: str, policy: DiagnosticPolicy
) -> None:
    """Lets a joint end at a new link that has half the mass of its child, held to the child by a weld constraint.

    The joint stays what it is, with its limits, spring, damping and actuator; masses add up to what they were.

    Args:
        model: The model that has the joint; the new link and the constraint become its own.
        joint: The joint that closes a loop.
        child: Its child link.
        name: Name of the new link.
        policy: Hears of the cut.
    """
    from sheldrake.math import RigidTransform
    from sheldrake.multibody.tree import SpatialInertia

    whole = child.M_BBo_B
    half = SpatialInertia(0.5 * whole.get_mass(), whole.get_com(), whole.get_unit_inertia())
    policy.Warning(
        joint,
        f"Joint '{joint.name}' closes a kinematic loop: half the mass of its child link '{joint.child}' becomes link "
        f"'{name}' at the end of the joint, and a weld constraint holds the two together.",
    )
    child.M_BBo_B = half
    model.bodies.append(BodyDescription(joint.where, name, half))
    model.exclusions.append((joint.parent, joint.child))
    other = FrameReference(name)
    model.elements.append(
        WeldConstraintDescription(joint.where, joint.child, RigidTransform(), other, RigidTransform())
    )
    joint.child = other
