"""`sheldrake view go2`: names are looked up in what is installed."""

import sys

import pytest

from sheldrake.cli._main import main
from sheldrake.cli._model_names import find_model


@pytest.fixture
def robots(tmp_path, monkeypatch):
    """Installed stand-ins for example-robot-data and robot_descriptions."""
    folder = tmp_path / "share" / "example-robot-data" / "robots"
    files = ["dog_description/urdf/dog.urdf", "dog_description/urdf/dog_with_arm.urdf", "ur_description/ur5_robot.urdf"]
    for name in files:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("<robot name='r'/>")
    info = tmp_path / "example_robot_data-6.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: example-robot-data\nVersion: 6.0\n")
    (info / "RECORD").write_text("".join(f"share/example-robot-data/robots/{name},,\n" for name in files))
    package = tmp_path / "robot_descriptions"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "cat_description.py").write_text("URDF_PATH = '/somewhere/cat.urdf'")
    (package / "ant_mj_description.py").write_text("MJCF_PATH = '/somewhere/ant.xml'")
    monkeypatch.syspath_prepend(str(tmp_path))
    yield folder
    for module in [name for name in sys.modules if name.startswith("robot_descriptions")]:
        del sys.modules[module]


def test_robots_of_installed_packages(robots):
    assert find_model("dog") == str(robots / "dog_description/urdf/dog.urdf")
    assert find_model("dog_with_arm") == str(robots / "dog_description/urdf/dog_with_arm.urdf")
    assert find_model("ur5") == str(robots / "ur_description/ur5_robot.urdf")
    assert find_model("two_hole_block").endswith("two_hole_block.urdf")
    assert find_model("cat") == "/somewhere/cat.urdf" and find_model("ant") == "/somewhere/ant.xml"


def test_files_and_addresses_stay_as_they_are(robots, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "dog").write_text("")
    for name in ("dog", "none.urdf", "package://mine/robot.urdf", "folder/dog"):
        assert find_model(name) == name


def test_a_name_of_nothing_says_where_it_looked(robots, capsys):
    assert main(["view", "dogg"]) == 1
    text = capsys.readouterr().err
    for part in ("'dogg'", "sheldrake's models", "example-robot-data", "robot_descriptions", "Did you mean 'dog'"):
        assert part in text
