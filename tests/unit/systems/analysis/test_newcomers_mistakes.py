"""Mistakes of a first script are answered with what to do."""

import pytest

from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder


def test_the_builder_in_place_of_the_diagram():
    with pytest.raises(TypeError, match=r"is no System; give the diagram that its Build\(\) makes"):
        Simulator(DiagramBuilder())
    with pytest.raises(TypeError, match=r"3 is no System$"):
        Simulator(3)


def test_plant_and_scene_graph_connected_once_more():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    with pytest.raises(RuntimeError, match=r"already wired; an input port takes one output\. .* has connected"):
        builder.Connect(scene_graph.get_query_output_port(), plant.get_geometry_query_input_port())
