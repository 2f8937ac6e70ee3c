"""A NaN is refused where it comes in; one that comes in a port stops the step it first enters."""

import numpy as np
import pytest

from sheldrake.math import RigidTransform
from sheldrake.multibody.plant import CoulombFriction, MultibodyPlant
from sheldrake.multibody.tree import FixedOffsetFrame, RevoluteJoint, ScrewJoint, SpatialInertia
from sheldrake.systems.analysis import Simulator

NAN = float("nan")
X_NAN = RigidTransform([0.0, NAN, 0.0])


def plant_with_body():
    plant = MultibodyPlant(1e-3)
    return plant, plant.AddRigidBody("body", SpatialInertia.SolidBoxWithMass(1.0, 1.0, 1.0, 1.0))


ENTRANCES = {
    "pose of a weld": lambda plant, body: plant.WeldFrames(plant.world_frame(), body.body_frame(), X_NAN),
    "pose of a frame": lambda plant, body: plant.AddFrame(FixedOffsetFrame("frame", body, X_NAN)),
    "gravity": lambda plant, body: plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, NAN]),
    "pitch": lambda plant, body: ScrewJoint("screw", plant.world_frame(), body.body_frame(), NAN, 0.0),
    "friction": lambda plant, body: CoulombFriction(0.5, NAN),
}


@pytest.mark.parametrize("bring", ENTRANCES.values(), ids=ENTRANCES)
def test_is_refused_at_the_door(bring):
    with pytest.raises(RuntimeError, match=r"finite|not a number"):
        bring(*plant_with_body())


def test_of_an_actuation_stops_the_step_and_names_the_port():
    plant, body = plant_with_body()
    joint = plant.AddJoint(RevoluteJoint("hinge", plant.world_frame(), body.body_frame(), [0.0, 0.0, 1.0]))
    plant.AddJointActuator("motor", joint)
    plant.Finalize()
    simulator = Simulator(plant)
    context = simulator.get_mutable_context()
    plant.SetPositions(context, [0.25])
    plant.get_actuation_input_port().FixValue(context, [1.0])
    simulator.AdvanceTo(0.01)
    before = plant.GetPositionsAndVelocities(context)
    plant.get_actuation_input_port().FixValue(context, [NAN])
    with pytest.raises(RuntimeError, match="Detected NaN in the actuation input port for all instances"):
        simulator.AdvanceTo(0.02)
    assert context.get_time() == pytest.approx(0.01)
    np.testing.assert_array_equal(plant.GetPositionsAndVelocities(context), before)


def test_of_a_generalized_force_names_its_port():
    plant, _ = plant_with_body()
    plant.Finalize()
    simulator = Simulator(plant)
    plant.get_applied_generalized_force_input_port().FixValue(simulator.get_context(), [0, 0, NAN, 0, 0, 0])
    with pytest.raises(RuntimeError, match="Detected NaN in the input port applied_generalized_force"):
        simulator.AdvanceTo(0.002)
