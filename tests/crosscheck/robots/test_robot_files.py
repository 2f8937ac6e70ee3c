"""Every description of a real robot makes a scene with its geometry, or is wrong, and we say what is wrong with it."""

from __future__ import annotations

import pytest
from real_robots import robot_files

from sheldrake.multibody.parsing import ParseError, Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.systems.framework import DiagramBuilder

pytestmark = pytest.mark.usefixtures("quiet")

FILES = robot_files("urdf", "sdf")
WRONG = {
    "alex_psyonic_hands.urdf": "mimics joint 'index_q1', which does not exist",
    "romeo_laas_small.urdf": "file:///usr/Romeo/",  # meshes of somebody's machine
    "talos_left_arm.urdf": "names joint 'arm_left_1_joint', which does not exist",
}
"""What is wrong with files that cannot be read."""
EMPTY = ("ur3.urdf", "simple_humanoid_classical.urdf")  # no links; links without geometry


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parts[-3]}-{path.name}")
def test_robots_come_with_their_geometry_or_a_reason(path):
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    if path.name in WRONG:
        with pytest.raises(ParseError) as caught:
            Parser(plant).AddModels(str(path))
        assert WRONG[path.name] in str(caught.value) and f"{path.name}:" in str(caught.value)
        return
    Parser(plant).AddModels(str(path))
    plant.Finalize()
    builder.Build().CreateDefaultContext()
    assert (scene_graph.model_inspector().num_geometries() > 0) == (path.name not in EMPTY)
