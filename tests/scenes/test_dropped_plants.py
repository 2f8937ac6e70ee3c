"""Plants that are built, simulated, linearized and dropped leave nothing behind."""

import gc
import resource
import sys

from sheldrake.autodiffutils import _complex_step
from sheldrake.geometry import Box, HalfSpace
from sheldrake.math import RigidTransform
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.multibody.tree import PrismaticJoint, SpatialInertia
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import FirstOrderTaylorApproximation, LogVectorOutput


def build_simulate_drop(time_step):
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step)
    friction = CoulombFriction(0.7, 0.5)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", friction)
    block = plant.AddRigidBody("block", SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.2, 0.3))
    plant.RegisterCollisionGeometry(block, RigidTransform(), Box(0.1, 0.2, 0.3), "box", friction)
    plant.SetDefaultFloatingBaseBodyPose(block, RigidTransform([0.0, 0.0, 0.149]))
    slider = plant.AddRigidBody("slider", SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.2, 0.3))
    joint = plant.AddJoint(PrismaticJoint("slide", plant.world_frame(), slider.body_frame(), [0.0, 0.0, 1.0]))
    plant.AddJointActuator("motor", joint)
    plant.Finalize()
    LogVectorOutput(plant.get_state_output_port(), builder)
    builder.ExportInput(plant.get_actuation_input_port(), "u")
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    diagram.get_input_port().FixValue(context, [1.0])
    simulator.AdvanceTo(0.005)
    assert plant.GetPositions(plant.GetMyContextFromRoot(context)).shape == (8,)
    if not time_step:
        FirstOrderTaylorApproximation(diagram, context)


def resident_kib():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * resource.getpagesize() // 1024


def test_hundreds_of_plants(monkeypatch):
    monkeypatch.setattr(_complex_step, "PATIENCE", 10**9)  # compiling leaves objects of its own behind
    rounds = [1e-3] * 4 + [0.0]
    for time_step in rounds * 30:  # calls that are often made are compiled after a while, which stays
        build_simulate_drop(time_step)
    gc.collect()
    objects, growths = len(gc.get_objects()), []
    for _ in range(4):
        before = resident_kib() if sys.platform == "linux" else 0
        for time_step in rounds * 20:
            build_simulate_drop(time_step)
        gc.collect()
        growths.append(resident_kib() - before if sys.platform == "linux" else 0)
    assert len(gc.get_objects()) - objects < 50
    # The heap takes some hundred plants to settle; a leak grows in every span of a hundred.
    assert min(growths) < 1_000, growths
