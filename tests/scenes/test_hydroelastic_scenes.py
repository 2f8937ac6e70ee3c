"""Long runs with hydroelastic contact: what is held stays held, what is stacked stands."""

import numpy as np
import pytest

from sheldrake.geometry import (
    AddCompliantHydroelasticProperties,
    AddContactMaterial,
    AddRigidHydroelasticProperties,
    Box,
    HalfSpace,
    ProximityProperties,
)
from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ContactModel,
    CoulombFriction,
    DiscreteContactApproximation,
)
from sheldrake.multibody.tree import FixedOffsetFrame, PrismaticJoint, SpatialInertia
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder


def properties(rigid):
    p = ProximityProperties()
    if rigid:
        AddRigidHydroelasticProperties(p)
    else:
        AddCompliantHydroelasticProperties(1.0, 1e6, p)
    AddContactMaterial(properties=p, friction=CoulombFriction(0.8, 0.8), dissipation=10.0)
    return p


def start(approximation):
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    plant.set_contact_model(ContactModel.kHydroelastic)
    plant.set_discrete_contact_approximation(approximation)
    return builder, plant


@pytest.mark.parametrize(
    "approximation, drift", [(DiscreteContactApproximation.kSap, 3e-5), (DiscreteContactApproximation.kLagged, 2e-4)]
)
def test_two_pads_hold_a_box_for_ten_seconds(approximation, drift):
    """Regularised friction lets it creep, as in Drake: by 1.7e-5 m with kSap, by 1.6e-4 m with kLagged."""
    builder, plant = start(approximation)
    box = plant.AddRigidBody("box", SpatialInertia.SolidBoxWithMass(1.0, 0.08, 0.08, 0.08))
    plant.RegisterCollisionGeometry(box, RigidTransform(), Box(0.08, 0.08, 0.08), "box", properties(rigid=True))
    for side in (-1.0, 1.0):
        pad = plant.AddRigidBody(f"pad{side}", SpatialInertia.SolidBoxWithMass(1.0, 0.02, 0.06, 0.06))
        plant.RegisterCollisionGeometry(pad, RigidTransform(), Box(0.02, 0.06, 0.06), "pad", properties(rigid=False))
        X = RigidTransform([side * 0.0499, 0, 0])
        rail = plant.AddFrame(FixedOffsetFrame(f"rail{side}", plant.world_frame(), X))
        joint = plant.AddJoint(PrismaticJoint(f"slide{side}", rail, pad.body_frame(), [1, 0, 0]))
        plant.AddJointActuator(f"motor{side}", joint)
    plant.Finalize()
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.get_actuation_input_port().FixValue(context, [40.0, -40.0])
    simulator.AdvanceTo(0.5)
    before = plant.EvalBodyPoseInWorld(context, box).translation()
    simulator.AdvanceTo(10.5)
    after = plant.EvalBodyPoseInWorld(context, box).translation()
    assert np.linalg.norm(after - before) < drift
    results = plant.get_contact_results_output_port().Eval(context)
    assert results.num_hydroelastic_contacts() == 2
    up = sum(abs(results.hydroelastic_contact_info(i).F_Ac_W().translational()[2]) for i in range(2))
    assert up == pytest.approx(9.81, rel=1e-3)


def test_a_stack_of_compliant_boxes_stands():
    builder, plant = start(DiscreteContactApproximation.kLagged)
    plant.RegisterCollisionGeometry(
        plant.world_body(), RigidTransform(), HalfSpace(), "ground", properties(rigid=True)
    )  # fmt: skip
    boxes = []
    for k in range(5):
        boxes.append(plant.AddRigidBody(f"box{k}", SpatialInertia.SolidBoxWithMass(1.0, 0.2, 0.2, 0.1)))
        shape = Box(0.2, 0.2, 0.1)
        plant.RegisterCollisionGeometry(boxes[-1], RigidTransform(), shape, "box", properties(rigid=False))
    plant.Finalize()
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    for k, box in enumerate(boxes):
        plant.SetFreeBodyPose(context, box, RigidTransform(RollPitchYaw(0, 0, 0.2 * k), [0.003 * k, 0, 0.05 + 0.1 * k]))
    simulator.AdvanceTo(2.0)
    heights = [plant.EvalBodyPoseInWorld(context, box).translation()[2] for box in boxes]
    np.testing.assert_allclose(heights, 0.05 + 0.1 * np.arange(5), atol=5e-4)
    assert np.abs(plant.GetVelocities(context)).max() < 1e-3
    results = plant.get_contact_results_output_port().Eval(context)
    assert results.num_hydroelastic_contacts() == 5
    lowest = max(abs(results.hydroelastic_contact_info(i).F_Ac_W().translational()[2]) for i in range(5))
    assert lowest == pytest.approx(5 * 9.81, rel=1e-3)
