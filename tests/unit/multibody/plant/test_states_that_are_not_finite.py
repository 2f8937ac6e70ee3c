"""A run whose state is NaN or infinite ends with the time and the joint, in contact or not."""

import numpy as np
import pytest

from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, DiscreteContactApproximation
from sheldrake.multibody.tree import RevoluteJoint, SpatialInertia
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder

APPROXIMATIONS = [None, *DiscreteContactApproximation.__members__.values()]


def scene(approximation):
    """Two free bodies and a pendulum; None: in continuous time."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0 if approximation is None else 1e-3)
    if approximation is not None:
        plant.set_discrete_contact_approximation(approximation)
    for name in ("ball", "stone", "rod"):
        plant.AddRigidBody(name, SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    rod = plant.GetBodyByName("rod")
    plant.AddJoint(RevoluteJoint("hinge", plant.world_frame(), rod.body_frame(), [0.0, 1.0, 0.0]))
    plant.Finalize()
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.05)
    return simulator, plant, plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())


@pytest.mark.parametrize("approximation", APPROXIMATIONS, ids=str)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize(("joint", "k"), [("ball", 0), ("ball", 5), ("stone", 6), ("hinge", 0)])
def test_positions(approximation, value, joint, k):
    simulator, plant, context = scene(approximation)
    joint = plant.GetJointByName(joint)
    context._store.S[slice(*(context._place.xc if approximation is None else context._place.xd))][
        joint.position_start() + k
    ] = value
    context.SetAllCacheEntriesOutOfDate()
    with pytest.raises(RuntimeError, match=rf"at time 0\.05.*infinite or NaN.* joints '{joint.name()}'"):
        simulator.AdvanceTo(0.2)


@pytest.mark.parametrize("approximation", APPROXIMATIONS[1:], ids=str)
def test_velocities(approximation):
    simulator, plant, context = scene(approximation)
    joint = plant.GetJointByName("stone")
    at = context._place.xd[0] + plant.num_positions() + joint.velocity_start()
    context._store.S[at] = np.nan
    context.SetAllCacheEntriesOutOfDate()
    with pytest.raises(RuntimeError, match=r"at time 0\.05.*infinite or NaN.* joints 'stone'"):
        simulator.AdvanceTo(0.2)


@pytest.mark.parametrize("approximation", APPROXIMATIONS, ids=str)
def test_a_quaternion_of_zeros(approximation):
    simulator, plant, context = scene(approximation)
    plant.SetPositions(context, np.zeros(plant.num_positions()))
    before = plant.GetPositionsAndVelocities(context)
    with pytest.raises(RuntimeError, match=r"all elements of a quaternion are zero.*'ball', 'stone'; .*\(1, 0, 0, 0\)"):
        simulator.AdvanceTo(0.1)
    np.testing.assert_array_equal(plant.GetPositionsAndVelocities(context), before)
