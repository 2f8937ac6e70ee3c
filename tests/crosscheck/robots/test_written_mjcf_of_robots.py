"""Real robots, written as MJCF, are the same robots in MuJoCo."""

from __future__ import annotations

import pytest
from real_robots import robot_files
from tests.crosscheck.mjcf.mujoco_numbers import faults
from tests.crosscheck.robots.test_robot_files import WRONG

from sheldrake.cad import WriteModel
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.systems.framework import DiagramBuilder

mujoco = pytest.importorskip("mujoco")
pytestmark = [pytest.mark.usefixtures("quiet"), pytest.mark.peer]

NO_LINKS = "ur3.urdf"
FILES = [path for path in robot_files("urdf", "sdf") if path.name not in (*WRONG, NO_LINKS)]


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parts[-3]}-{path.name}")
def test_robots_are_the_same_in_mujoco(path, tmp_path):
    plant, scene_graph = AddMultibodyPlantSceneGraph(DiagramBuilder(), 1e-3)
    Parser(plant).AddModels(str(path))
    plant.Finalize()
    written = WriteModel(plant, tmp_path / "robot.xml", scene_graph)
    model = mujoco.MjModel.from_xml_path(str(written.path))
    assert faults(plant, scene_graph, model, mujoco.MjData(model)) == []
