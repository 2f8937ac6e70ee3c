"""Contact results as messages."""

from sheldrake.geometry import Box, Sphere
from sheldrake.lcm import DrakeLcm
from sheldrake.lcm._messages import lcmt_contact_results_for_viz
from sheldrake.math import RigidTransform
from sheldrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ConnectContactResultsToDrakeVisualizer,
    ContactResultsToLcmSystem,
    CoulombFriction,
)
from sheldrake.multibody.tree import SpatialInertia
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder


def test_a_resting_ball_presses_with_its_weight():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    ball = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(2.0, 0.1))
    friction = CoulombFriction(0.5, 0.5)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform([0, 0, -1]), Box(9, 9, 2), "ground", friction)
    plant.RegisterCollisionGeometry(ball, RigidTransform(), Sphere(0.1), "skin", friction)
    plant.Finalize()
    lcm, messages = DrakeLcm("memq://"), []
    ConnectContactResultsToDrakeVisualizer(builder, plant, scene_graph, lcm, publish_period=0.5)
    assert isinstance(builder.GetSubsystemByName("contact_to_lcm"), ContactResultsToLcmSystem)
    simulator = Simulator(builder.Build())
    lcm.Subscribe("CONTACT_RESULTS", messages.append)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetFreeBodyPose(context, ball, RigidTransform([0.0, 0.0, 0.1]))
    simulator.AdvanceTo(0.5)
    lcm.HandleSubscriptions(0)
    message = lcmt_contact_results_for_viz.decode(messages[-1])
    assert (message.timestamp, message.num_point_pair_contacts) == (500000, 1)
    (point,) = message.point_pair_contact_info
    assert {point.body1_name, point.body2_name} == {"world(0)", "ball(1)"}
    assert abs(abs(point.contact_force[2]) - 2.0 * 9.81) < 1e-2
