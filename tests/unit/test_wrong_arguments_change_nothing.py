"""Arguments of wrong types are TypeErrors, as in pydrake, and leave everything as it was."""

import numpy as np
import pytest

import sheldrake.all as m

NOT_NUMBERS = ("abc", None, [1.0, 2.0], np.eye(2), {}, object())


@pytest.fixture(scope="module")
def arm():
    plant = m.MultibodyPlant(0.0)
    free, link = (plant.AddRigidBody(name, m.SpatialInertia.SolidSphereWithMass(1.0, 0.1)) for name in ("free", "link"))
    joint = plant.AddJoint(m.RevoluteJoint("joint", plant.world_frame(), link.body_frame(), [0, 0, 1]))
    plant.Finalize()
    return plant, free, joint


CALLS = {
    "set_angle": (NOT_NUMBERS, lambda plant, free, joint, c, x: joint.set_angle(c, x)),
    "SetPositions": (("abc", None, 3, 1j, {}, object()), lambda plant, free, joint, c, x: plant.SetPositions(c, x)),
    "SetFreeBodyPose": ((*NOT_NUMBERS, 3), lambda plant, free, joint, c, x: plant.SetFreeBodyPose(c, free, x)),
    "SetContinuousState": ((3, 1j, None, {}), lambda plant, free, joint, c, x: c.SetContinuousState(x)),
    "SetAtIndex": (
        NOT_NUMBERS,
        lambda plant, free, joint, c, x: c.get_mutable_continuous_state_vector().SetAtIndex(0, x),
    ),
}


@pytest.mark.parametrize("call", CALLS)
def test_of_a_plant(arm, call):
    plant, free, joint = arm
    context = plant.CreateDefaultContext()
    before = plant.GetPositionsAndVelocities(context).copy()
    wrong, function = CALLS[call]
    for value in wrong:
        with pytest.raises(TypeError):
            function(plant, free, joint, context, value)
    np.testing.assert_array_equal(plant.GetPositionsAndVelocities(context), before)


@pytest.mark.parametrize("value", [3, None, ["a"], 1.5, {}, np.eye(2)])
def test_of_systems(value):
    gain = m.Gain(1.0, 2)
    for call in (gain.set_name, gain.GetInputPort, gain.GetOutputPort, m.TrajectorySource):
        with pytest.raises(TypeError):
            call(value)
    assert gain.get_name() == ""


@pytest.mark.parametrize("value", [{}, object(), 1j, "abc"])
def test_of_vectors(value):
    with pytest.raises(TypeError):
        m.BasicVector(value)
    vector = m.BasicVector([1.0, 2.0])
    with pytest.raises(TypeError):
        vector.SetFromVector(value)
    assert vector.CopyToVector().tolist() == [1.0, 2.0]
