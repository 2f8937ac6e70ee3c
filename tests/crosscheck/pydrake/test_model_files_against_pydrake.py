"""mesh_to_model and fix_inertia, run as programs, write models with the masses and inertias that Drake's write."""

import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("pydrake")
pytestmark = pytest.mark.peer

SOURCES = pathlib.Path(__file__).resolve().parents[3] / "src"
WEDGE = """v 0.1 0 0
v 1.1 0 0
v 0.1 2 0
v 0.1 0 3
f 1 3 2
f 1 2 4
f 2 3 4
f 3 1 4
"""
BODIES = """<robot name="r">
  <link name="body">
    <inertial>
      <mass value="{mass}"/>
      <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="5"/>
    </inertial>
    <collision><origin xyz="1 0 0"/><geometry><box size="0.1 0.2 0.3"/></geometry></collision>
    <collision><origin xyz="3 0 0" rpy="0.1 0.2 0.3"/>
      <geometry><cylinder radius="0.1" length="0.4"/></geometry></collision>
    <visual><geometry><sphere radius="0.3"/></geometry></visual></link>
</robot>"""


def run(library, program, folder, *arguments):
    command = [sys.executable, "-m", f"{library}.multibody.{program}", *arguments]
    environment = {**os.environ, "PYTHONPATH": str(SOURCES)}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr


def inertia(file):
    """Mass, centre of mass, and moments about it of the only body of a file."""
    from sheldrake.multibody.parsing import Parser
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import BodyIndex

    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(str(file))
    M = plant.get_body(BodyIndex(1)).default_spatial_inertia()
    central = M.Shift(M.get_com()).CalcRotationalInertia().CopyToFullMatrix3()
    return np.concatenate([[M.get_mass()], M.get_com(), central.ravel()])


@pytest.mark.parametrize(
    "options",
    [
        (),
        ("--scale", "0.01", "--model-name", "foo"),
        ("--mass", "3", "--origin-at-com"),
        ("--density", "20", "--body-origin", "1,2,3"),
        ("--package", "auto"),
    ],
)
def test_a_mesh_becomes_the_same_body(tmp_path, options):
    found = []
    for library in ("pydrake", "sheldrake"):
        folder = tmp_path / library
        folder.mkdir()
        (folder / "wedge.obj").write_text(WEDGE)
        run(library, "mesh_to_model", folder, "wedge.obj", *options)
        found.append(inertia(folder / "wedge.sdf"))
        assert (folder / "package.xml").exists() == ("--package" in options)
    np.testing.assert_allclose(found[1], found[0], rtol=1e-12, atol=1e-12 * found[0][0])


@pytest.mark.parametrize("roles", [(), ("--geom_inertia_role_order", "illustration")])
@pytest.mark.parametrize("mass", [2, -1])
def test_an_impossible_inertia_becomes_the_same(tmp_path, mass, roles):
    found = []
    (tmp_path / "robot.urdf").write_text(BODIES.format(mass=mass))
    for library in ("pydrake", "sheldrake"):
        run(library, "fix_inertia", tmp_path, "robot.urdf", f"{library}.urdf", *roles)
        found.append(inertia(tmp_path / f"{library}.urdf"))
    assert found[0][0] == abs(mass)
    np.testing.assert_allclose(found[1], found[0], rtol=2e-5, atol=1e-5)  # Drake writes five digits
