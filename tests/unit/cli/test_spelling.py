"""`sheldrake run` says what a misspelt word was probably meant to be."""

import subprocess
import sys

import pytest

from sheldrake.cli import _spelling

LINES = {
    "AddMultibodyPlantSceneGraph(DiagramBuilder(), timestep=0.002)": "did you mean 'time_step'?",
    "MultibodyPlant(timestep=0.1)": "did you mean 'time_step'?",
    "MultiBodyPlant(0.1)": "did you mean 'MultibodyPlant'?",
    "from pydrake.multibody.plant import MultiBodyPlant": "did you mean 'MultibodyPlant'?",
    "MultibodyPlant(0.0).GetBodyByname('x')": "did you mean 'GetBodyByName'?",
    "Simulator(Integrator(1)).AdvanceTo(boundry_time=1)": "did you mean 'boundary_time'?",
    "LogVectorOutput(1, 2, publish_perod=3)": "did you mean 'publish_period'?",
    "Sphere(r=1)": "Sphere() takes radius.",
}


def error_of(line):
    scope = {}
    exec("from sheldrake.all import *", scope)
    try:
        exec(line.replace("pydrake", "sheldrake"), scope)
    except Exception as error:
        return error
    raise AssertionError("no error")


@pytest.mark.parametrize("line", LINES)
def test_a_misspelt_word(line):
    assert _spelling.did_you_mean(error_of(line)) == LINES[line]


@pytest.mark.parametrize(
    "line",
    [
        "nothing_like_it",
        "LeafSystem().zzz",
        "len(a=3)",
        "Sphere(-1.0)",
        "{}['radius']",
        "(lambda x: x)(y=1)",
    ],
)
def test_where_nothing_is_alike_nothing_is_said(line):
    assert _spelling.did_you_mean(error_of(line)) is None


def test_it_is_said_once_below_the_error(tmp_path):
    script = tmp_path / "script.py"
    script.write_text("from pydrake.all import *\nAddMultibodyPlantSceneGraph(DiagramBuilder(), timestep=0.002)\n")
    command = [sys.executable, "-m", "sheldrake", "run", str(script)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 1
    assert done.stderr.lower().count("did you mean 'time_step'?") == 1
    assert "left out" not in done.stderr  # the hint for scripts of 2021, which gave no time step
