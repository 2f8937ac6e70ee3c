"""The machine of a page, run in Node: the numbers of the simulator, the same from run to run."""

import argparse
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from tests.unit.export.exported_pages import arm, falling_block, native_state

from sheldrake.cli import _fmu
from sheldrake.cli._output import take_options_behind
from sheldrake.common.kernel import jit_enabled
from sheldrake.export import PageSlider, SavePage

pytest.importorskip("ziglang")
pytestmark = pytest.mark.skipif(not jit_enabled(), reason="runs machine code; SHELDRAKE_JIT=0 switches it off")
RUN = pathlib.Path(__file__).with_name("run_page.mjs")
ROOT = RUN.parents[3]
SCRIPT = """
from pydrake.all import *

builder = DiagramBuilder()
plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
body = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
plant.Finalize()
simulator = Simulator(builder.Build())
simulator.AdvanceTo(1.0)
print("not reached")
"""


def states(page, *times):
    """Words of the states at some times, as Node computes them."""
    if shutil.which("node") is None:
        pytest.skip("there is no node")
    command = ["node", str(RUN), str(page), *map(str, times)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return [np.array([int(word, 16) for word in line.split()], np.uint64) for line in done.stdout.splitlines()]


@pytest.mark.parametrize(
    ("make", "before", "after"), [(falling_block, 0.1, 1.0), (arm, 0.5, 1.0)], ids=["falling block", "arm"]
)
def test_a_page_has_the_numbers_of_the_simulator(tmp_path, make, before, after):
    simulator, page = make(), tmp_path / "page.html"
    SavePage(simulator, page)
    assert page.stat().st_size < 2e6
    first, again = states(page, before, after), states(page, before, after)
    for words, repeated, time, tolerance in zip(first, again, (before, after), (1e-9, 1e-6)):
        np.testing.assert_array_equal(words, repeated)
        expected = native_state(simulator, time)
        np.testing.assert_allclose(words.view(float)[: len(expected)], expected, rtol=0, atol=tolerance)


def test_nothing_of_a_page_is_elsewhere_and_names_are_text(tmp_path):
    bad = "</script><img src=x onerror=window.bad=1>"
    SavePage(falling_block(name=bad), tmp_path / "page.html", title=bad)
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<img src=x" not in text
    assert text.count("</script>") == text.count("<script")  # what ends a script is what began one
    about = json.loads(re.search(r'id="diagram">(.*?)</script>', text, re.S)[1])
    assert about["states"][0]["name"] == bad
    own = re.sub(r'id="scene-page">.*?</script>', "", text, flags=re.S)  # the viewer names its licenses' addresses
    assert not re.search(r"https?://", own)


def test_a_slider_must_be_of_something(tmp_path):
    page = tmp_path / "page.html"
    for slider, complaint in (
        (PageSlider("plant/force", 0, 1), "no input or parameter 'plant/force' for a slider; there are 'plant/app"),
        (PageSlider("plant/applied_generalized_force", 0, 1, element=6), "has 6 elements; a slider asks for number 6"),
        (PageSlider("plant/applied_generalized_force", 1, 1), "goes from 1 to 1"),
    ):
        with pytest.raises(ValueError, match=complaint):
            SavePage(falling_block(), page, sliders=[slider])
        assert not page.exists()


def test_the_commands_write_what_a_script_would_simulate(tmp_path):
    (tmp_path / "ball.py").write_text(SCRIPT)
    (tmp_path / "nothing.py").write_text("print('hello')\n")
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}

    def run(*words):
        command = [sys.executable, "-m", "sheldrake", *words]
        return subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)

    for words, wrote, files in (
        (["page", "ball.py"], "ball.html", ["ball.html"]),
        (
            ["c", "ball.py", "-o", "out"],
            "out",
            ["out/ball.h", "out/ball.c", "out/libball.a", "out/main.c", "out/Makefile"],
        ),
    ):
        done = run(*words)
        assert (done.returncode, done.stdout) == (0, f"wrote {wrote}\n"), done.stderr
        assert all((tmp_path / file).exists() for file in files)
    done = run("page", "nothing.py")
    assert done.returncode == 1 and "the script ran no simulation" in done.stderr


@pytest.mark.parametrize(
    ("words", "output", "platforms", "arguments"),
    [
        (["x.py", "-o", "a", "--height", "2"], "a", None, ["--height", "2"]),
        (["-o", "a", "x.py", "--height", "2", "-v"], "a", None, ["--height", "2", "-v"]),
        (["x.py", "--output=a", "--platform", "x86_64-linux", "y"], "a", ["x86_64-linux"], ["y"]),
        (["-o", "a", "x.py", "1", "--", "-o", "b"], "a", None, ["1", "-o", "b"]),
        (["-o", "a", "x.py", "-offset", "3"], "a", None, ["-offset", "3"]),
    ],
)
def test_options_may_stand_behind_the_script(words, output, platforms, arguments):
    parser = argparse.ArgumentParser()
    _fmu.add_arguments(parser)
    options = parser.parse_args(words)
    options.command = "fmu"
    take_options_behind(options, _fmu._add_options)
    assert (options.output, options.platform, options.fmi) == (output, platforms, "3.0")
    assert (options.script, options.arguments) == ("x.py", arguments)
