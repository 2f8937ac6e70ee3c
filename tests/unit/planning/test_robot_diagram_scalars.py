"""Diagrams of one robot for each scalar."""

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant_
from sheldrake.multibody.tree import RevoluteJoint_, SpatialInertia
from sheldrake.planning import RobotDiagram_, RobotDiagramBuilder, RobotDiagramBuilder_
from sheldrake.symbolic import Expression
from sheldrake.systems.framework import DiagramBuilder_


@pytest.mark.parametrize("T", [float, AutoDiffXd, Expression])
def test_a_diagram_of_a_scalar(T):
    builder = RobotDiagramBuilder_[T](0.0)
    plant = builder.plant()
    assert isinstance(plant, MultibodyPlant_[T])
    diagram = builder.Build()
    assert isinstance(diagram, RobotDiagram_[T]) and diagram.plant() is plant
    assert diagram.plant_context(diagram.CreateDefaultContext()) is not None


def test_the_builder_of_floats_is_the_plain_one():
    assert RobotDiagramBuilder_[float] is RobotDiagramBuilder


def test_plants_join_builders_of_their_scalar():
    plant, scene_graph = AddMultibodyPlantSceneGraph(DiagramBuilder_[AutoDiffXd](), time_step=0.0)
    inertia = SpatialInertia.SolidCubeWithDensity(1.0, 1.0)
    body = plant.AddRigidBody("link", inertia)
    plant.AddJoint(RevoluteJoint_[AutoDiffXd]("joint", plant.world_frame(), body.body_frame(), [0, 0, 1]))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    assert isinstance(plant.CalcMassMatrix(context)[0, 0], AutoDiffXd)
    assert np.isclose(plant.CalcMassMatrix(context)[0, 0].value(), 1.0 / 6.0)
    assert scene_graph.get_name() == "scene_graph"
