"""A script as people wrote them for pydrake in 2021: today's names for nothing. Takes the URDF."""

import sys

import numpy as np
from pydrake.all import (
    AddMultibodyPlantSceneGraph,
    ConnectMeshcatVisualizer,
    CoulombFriction,
    DiagramBuilder,
    HalfSpace,
    LogVectorOutput,
    Parser,
    RigidTransform,
    RotationMatrix,
    Simulator,
    SpatialVelocity,
)


def add_ground(plant):
    X_WG = RigidTransform()
    friction = CoulombFriction(static_friction=0.7, dynamic_friction=0.5)
    plant.RegisterCollisionGeometry(plant.world_body(), X_WG, HalfSpace(), "ground_collision", friction)
    plant.RegisterVisualGeometry(plant.world_body(), X_WG, HalfSpace(), "ground_visual", np.array([0.5, 1.0, 0.5, 1.0]))


builder = DiagramBuilder()
plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
block = Parser(plant, scene_graph).AddModelFromFile(sys.argv[1])
add_ground(plant)
plant.Finalize()
logger = LogVectorOutput(plant.get_state_output_port(block), builder)
logger.set_name("logger")
visualizer = ConnectMeshcatVisualizer(
    builder=builder,
    zmq_url="tcp://127.0.0.1:6000",
    scene_graph=scene_graph,
    output_port=scene_graph.get_query_output_port(),
)
diagram = builder.Build()
visualizer.load()

context = diagram.CreateDefaultContext()
plant_context = plant.GetMyContextFromRoot(context)
body = plant.GetBodyByName("body", block)
X_WB = RigidTransform(RotationMatrix.MakeXRotation(np.pi / 2), [0, 0, 0.1])
plant.SetFreeBodyPose(plant_context, body, X_WB)
plant.SetFreeBodySpatialVelocity(body, SpatialVelocity(np.zeros(3), np.zeros(3)), plant_context)
diagram.Publish(context)

simulator = Simulator(diagram, context)
simulator.set_publish_every_time_step(False)
simulator.Initialize()
simulator.AdvanceTo(1.0)
log = logger.FindLog(context)
print(log.sample_times().shape, log.data().shape, "at rest" if abs(log.data()[7:, -1]).max() < 1e-9 else "moving")
