import numpy as np
import pytest
from tests.unit.cad.solids import write_box

from sheldrake.multibody import mesh_to_model
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import MultibodyPlant


def inertia_of(path, name):
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(str(path))
    return plant.GetBodyByName(name).default_spatial_inertia()


def test_words_and_numbers(tmp_path):
    mesh = write_box(tmp_path / "part.obj", 100.0, 200.0, 300.0)
    assert mesh_to_model.main([mesh, "--scale", "0.001", "--mass", "2", "--model-name", "hey"]) == 0
    M = inertia_of(tmp_path / "part.sdf", "hey")
    assert M.get_mass() == 2.0
    np.testing.assert_allclose(M.get_com(), [0.05, 0.1, 0.15])
    I_Bcm = 2.0 / 12.0 * np.array([0.04 + 0.09, 0.01 + 0.09, 0.01 + 0.04])
    found = M.Shift(M.get_com()).CalcRotationalInertia().CopyToFullMatrix3()
    np.testing.assert_allclose(found, np.diag(I_Bcm), atol=1e-15)

    mesh_to_model.main([mesh, "--scale", "0.001", "--origin-at-com"])
    M = inertia_of(tmp_path / "part.sdf", "part")
    np.testing.assert_allclose(M.get_com(), 0.0, atol=1e-15)
    assert M.get_mass() == pytest.approx(6.0)  # of water
    mesh_to_model.main([mesh, "--scale", "0.001", "--body-origin", "1,2,3", "--density", "7"])
    np.testing.assert_allclose(inertia_of(tmp_path / "part.sdf", "part").get_com(), [-0.95, -1.9, -2.85])


def test_it_runs_under_its_name_in_drake(tmp_path):
    import os
    import pathlib
    import subprocess
    import sys

    mesh = write_box(tmp_path / "part.obj", 1.0, 1.0, 1.0)
    environment = {**os.environ, "PYTHONPATH": str(pathlib.Path(__file__).resolve().parents[3] / "src")}
    words = [sys.executable, "-m", "sheldrake", "run", "-m", "pydrake.multibody.mesh_to_model", mesh, "--mass", "3"]
    result = subprocess.run(words, env=environment, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    assert inertia_of(tmp_path / "part.sdf", "part").get_mass() == 3.0


def test_packages(tmp_path):
    (tmp_path / "mine" / "meshes").mkdir(parents=True)
    mesh = write_box(tmp_path / "mine" / "meshes" / "part.obj", 1.0, 1.0, 1.0)
    (tmp_path / "mine" / "package.xml").write_text("<package><name>theirs</name></package>")
    mesh_to_model.main([mesh, "--package", str(tmp_path / "mine" / "package.xml"), "--output-dir", str(tmp_path)])
    assert "package://theirs/meshes/part.obj" in (tmp_path / "part.sdf").read_text()
    mesh_to_model.main([mesh, "--package", "auto"])
    assert "package://meshes/part.obj" in (tmp_path / "mine" / "meshes" / "part.sdf").read_text()
    assert "<name>meshes</name>" in (tmp_path / "mine" / "meshes" / "package.xml").read_text()


@pytest.mark.parametrize(
    "words", [["--scale", "-1"], ["--mass", "-1"], ["--package", "nope"], ["--output-dir", "nope"]]
)
def test_options_without_meaning(tmp_path, words):
    mesh = write_box(tmp_path / "part.obj", 1.0, 1.0, 1.0)
    with pytest.raises(RuntimeError if "--mass" in words else ValueError):
        mesh_to_model.main([mesh, *words])
    with pytest.raises(SystemExit):
        mesh_to_model.main([mesh, "--body-origin", "1,2"])
    with pytest.raises(RuntimeError):
        mesh_to_model.main([str(tmp_path / "absent.obj")])
