"""ExplainFailure: the time, the body, and what is wrong with its size."""

import numpy as np
import pytest

from sheldrake.cad import ExplainFailure
from sheldrake.geometry import Box
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia, SpatialVelocity
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder


def simulator_of(factor, speed=0.0):
    """Two boxes of half a kilogram, one of them this many times as large as it should be, and that one as fast."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    for name, scale in (("good", 1.0), ("part", factor)):
        body = plant.AddRigidBody(name, SpatialInertia.SolidBoxWithMass(0.5, 0.06, 0.04, 0.025))
        box = Box(*(scale * np.array([0.06, 0.04, 0.025])))
        plant.RegisterCollisionGeometry(body, RigidTransform(), box, name, CoulombFriction(1, 1))
    plant.Finalize()
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetFreeBodySpatialVelocity(context, plant.GetBodyByName("part"), SpatialVelocity([0, 0, 0], [speed, 0, 0]))
    simulator.get_mutable_context().SetTime(0.25)
    return simulator


@pytest.mark.parametrize(("factor", "word"), [(1000.0, "large"), (0.001, "small")])
def test_a_mesh_in_another_unit_is_named_with_what_mends_it(factor, word):
    first, wrong, command = ExplainFailure(simulator_of(factor, 2e4)).splitlines()
    assert first == "at t = 0.25 s 'part' moves at 2e+04 m/s, which nothing in a real scene does"
    assert wrong.startswith("'part' is ") and f"0.5 kg: 1000 times too {word} (a mesh in" in wrong
    assert "sheldrake doctor MODEL --fix FILE" in command


def test_a_sound_model_has_nothing_said_against_it():
    assert ExplainFailure(simulator_of(1.0, 2.0)) == "at t = 0.25 s 'part' moves at 2 m/s"
