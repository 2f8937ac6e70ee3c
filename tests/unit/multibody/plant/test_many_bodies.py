"""Plants of many bodies: what is done to finalize one grows as its bodies do."""

import sys

from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import RevoluteJoint, SpatialInertia


def calls_of_finalize(count):
    """How many calls `Finalize` of a plant with so many free bodies makes."""
    plant = MultibodyPlant(1e-3)
    for k in range(count):
        plant.AddRigidBody(f"body{k}", SpatialInertia.SolidBoxWithMass(0.1, 0.1, 0.1, 0.1))
    calls = 0

    def count_call(frame, event, argument):
        nonlocal calls
        calls += event in ("call", "c_call")

    sys.setprofile(count_call)
    try:
        plant.Finalize()
    finally:
        sys.setprofile(None)
    return calls


def test_finalize_of_twice_as_many_free_bodies_makes_twice_as_many_calls():
    calls_of_finalize(10)  # what is done once
    few, more, many = (calls_of_finalize(n) for n in (50, 100, 200))
    assert many - more < 2.2 * (more - few)


def test_a_floating_joint_has_a_name_that_no_other_of_its_model_has():
    plant = MultibodyPlant(1e-3)
    for name in ("a", "b"):
        plant.AddRigidBody(name, SpatialInertia.SolidBoxWithMass(0.1, 0.1, 0.1, 0.1))
    other = plant.AddModelInstance("other")
    plant.AddRigidBody("a", other, SpatialInertia.SolidBoxWithMass(0.1, 0.1, 0.1, 0.1))
    a, b = plant.GetBodyByName("a", plant.GetModelInstanceByName("DefaultModelInstance")), plant.GetBodyByName("b")
    plant.AddJoint(RevoluteJoint("a", a.body_frame(), b.body_frame(), [0.0, 0.0, 1.0]))
    plant.Finalize()
    assert sorted(plant.get_joint(j).name() for j in plant.GetJointIndices()) == ["_a", "a", "a"]
