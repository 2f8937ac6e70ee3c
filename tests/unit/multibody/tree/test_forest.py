"""The order in which trees follow each other: Drake numbers positions and velocities in it."""

import pytest

from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import RevoluteJoint


def order(description):
    """Bodies by the place of their velocities; "a a1<a" are two bodies, the second on the first."""
    plant, joints = MultibodyPlant(0.0), []
    for word in description.split():
        name, _, parent = word.partition("<")
        plant.AddRigidBody(name, SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        joints += [(name, parent)] * bool(parent)
    for name, parent in joints:
        P, C = plant.GetFrameByName(parent), plant.GetFrameByName(name)
        plant.AddJoint(RevoluteJoint(f"to_{name}", P, C, [0, 0, 1]))
    plant.Finalize()
    joints = sorted((plant.get_joint(i) for i in plant.GetJointIndices()), key=lambda joint: joint.velocity_start())
    return " ".join(joint.child_body().name() for joint in joints)


@pytest.mark.parametrize(
    ("description", "expected"),
    [
        ("a b", "a b"),
        ("a b b1<b", "b b1 a"),  # Single bodies are last.
        ("a a1<a b b1<b b2<b", "b b1 b2 a a1"),  # The base with the most joints goes first, ...
        ("a a1<a a2<a1 a3<a2 b b1<b b2<b", "b b1 b2 a a1 a2 a3"),  # ... not that of the largest tree ...
        ("a a1<a b b1<b b2<b1 b3<b2", "a a1 b b1 b2 b3"),  # ... and else the one that was added first.
        ("c a a1<a w<world b b1<b d", "w a a1 b b1 c d"),  # What is on the world is before all of them.
    ],
)
def test_order(description, expected):
    assert order(description) == expected
