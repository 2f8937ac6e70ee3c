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
    plant.SetDefaultFreeBodyPose(block, RigidTransform([0.0, 0.0, 0.149]))
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


def test_hundreds_of_plants(monkeypatch):
    monkeypatch.setattr(_complex_step, "PATIENCE", 10**9)  # compiling leaves numba's own objects behind
    rounds = [1e-3] * 4 + [0.0]
    gc.collect()
    for time_step in rounds * 5:
        build_simulate_drop(time_step)
    gc.collect()
    before, peak = len(gc.get_objects()), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for time_step in rounds * 80:
        build_simulate_drop(time_step)
    gc.collect()
    assert len(gc.get_objects()) - before < 50
    if sys.platform == "linux":
        assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - peak < 10_000  # KiB
