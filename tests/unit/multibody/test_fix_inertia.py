import difflib
import re

import numpy as np
import pytest

from sheldrake.multibody import fix_inertia
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.systems.framework import DiagramBuilder

URDF = """<?xml version="1.0"?>
<!-- top -->
<robot name="r">
  <link name="a">
    <inertial>
      <!-- stays -->
      <origin xyz="0 0 0.5"/>
      <mass value="2"/>
      <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="5"/>
    </inertial>
    <visual><geometry><box size="1 2 3"/></geometry></visual>
    <collision><origin xyz="1 0 0"/><geometry><box size="0.1 0.2 0.3"/></geometry></collision>
  </link>
  <link name="b">
    <inertial><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
  </link>
  <link name="c"><inertial><mass value="-2"/></inertial></link>
</robot>
"""
SDF = """<sdf version="1.7"><model name="m">
  <link name="a">
    <inertial>
      <mass>2</mass>
      <inertia><ixx>1</ixx><iyy>1</iyy><izz>5</izz></inertia>
    </inertial>
    <collision name="c"><pose>1 0 0 0 0 0</pose><geometry><box><size>0.1 0.2 0.3</size></box></geometry></collision>
  </link>
</model></sdf>
"""


def inertia_of(path):
    plant, _ = AddMultibodyPlantSceneGraph(DiagramBuilder(), 1e-3)
    parser = Parser(plant)
    parser.diagnostic_policy().SetActionForWarnings(lambda detail: None)
    parser.AddModels(str(path))
    M = plant.GetBodyByName("a").default_spatial_inertia()
    return M.get_mass(), M.get_com(), M.Shift(M.get_com()).CalcRotationalInertia().CopyToFullMatrix3()


def box_moments(mass, x, y, z):
    return mass / 12.0 * np.diag([y * y + z * z, x * x + z * z, x * x + y * y])


@pytest.mark.parametrize("ending, text", [("urdf", URDF), ("sdf", SDF)])
def test_impossible_inertias_become_those_of_the_collision_geometry(tmp_path, ending, text):
    path, out = tmp_path / f"m.{ending}", tmp_path / f"out.{ending}"
    path.write_text(text)
    assert fix_inertia.main([str(path), str(out)]) == 0
    mass, center, I = inertia_of(out)
    assert mass == 2.0
    np.testing.assert_allclose(center, [1.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(I, box_moments(2.0, 0.1, 0.2, 0.3), atol=1e-10)
    changed = [line[2:].strip() for line in difflib.ndiff(text.splitlines(), out.read_text().splitlines())
               if line[0] in "+-"]  # fmt: skip
    assert all(re.match("<(origin|inertia|pose)", line) for line in changed), changed
    assert path.read_text() == text
    assert fix_inertia.main([str(path), "--in_place"]) == 0
    assert path.read_text() == out.read_text()


def test_roles_in_another_order_and_standard_output(tmp_path, capsys):
    path = tmp_path / "m.urdf"
    path.write_text(URDF)
    fix_inertia.main([str(path), "--geom_inertia_role_order", "illustration"])
    (tmp_path / "out.urdf").write_text(capsys.readouterr().out)
    _, center, I = inertia_of(tmp_path / "out.urdf")
    np.testing.assert_allclose(center, 0.0, atol=1e-12)
    np.testing.assert_allclose(I, box_moments(2.0, 1.0, 2.0, 3.0), rtol=1e-8)


def test_what_is_possible_or_has_no_geometry_stays(tmp_path):
    path = tmp_path / "m.urdf"
    sound = URDF.replace('izz="5"', 'izz="1"')
    path.write_text(sound)
    fix_inertia.main([str(path), "--in_place"])
    assert path.read_text() == sound


def test_an_impossible_mass_becomes_a_kilogram_as_in_drake(tmp_path):
    path = tmp_path / "m.urdf"
    path.write_text(URDF.replace('<mass value="2"/>', '<mass value="-2"/>', 1))
    fix_inertia.main([str(path), "--in_place"])
    mass, _, I = inertia_of(path)
    assert mass == 1.0
    np.testing.assert_allclose(I, box_moments(1.0, 0.1, 0.2, 0.3), atol=1e-9)


def test_errors(tmp_path):
    with pytest.raises(RuntimeError, match="neither"):
        fix_inertia.main([str(tmp_path / "part.obj")])
    with pytest.raises(RuntimeError, match="no file"):
        fix_inertia.main([str(tmp_path / "absent.urdf")])
    with pytest.raises(SystemExit):
        fix_inertia.main([])
