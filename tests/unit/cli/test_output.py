"""`-o -`, `--json`, and what the documentation says of exit codes."""

import json
import pathlib
import re
import subprocess
import sys

import numpy as np
import pytest
from tests.unit.cli.test_cli import ROOT, script, sheldrake

from sheldrake.cli._main import _EXIT_CODES
from sheldrake.systems.primitives import LogSet, VectorLog

FALL = """
from sheldrake.all import *
print("the script speaks")
builder = DiagramBuilder()
plant = builder.AddSystem(MultibodyPlant(1e-3))
plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
plant.Finalize()
Simulator(builder.Build()).AdvanceTo(0.01)
"""


def log_file(folder):
    log = VectorLog(2)
    for t in range(3):
        log.AddData(float(t), [t, -t])
    LogSet({"a/state": log}).ToNpz(folder / "log.npz")
    return str(folder / "log.npz")


def run(*words, **options):
    return subprocess.run([sys.executable, "-m", "sheldrake", *words], capture_output=True, **options)


@pytest.mark.parametrize("command", ["report", "page"])
def test_pages_go_to_the_standard_output_alone(tmp_path, command):
    done = run(command, "-o", "-", script(tmp_path, FALL), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    page = done.stdout.decode()
    assert page.lstrip().lower().startswith("<!doctype html") and page.rstrip().endswith("</html>")
    assert b"the script speaks" in done.stderr and "the script speaks" not in page
    assert [file.name for file in tmp_path.iterdir()] == ["script.py"]


def test_plots_go_to_the_standard_output(tmp_path):
    done = run("plot", "-o", "-", log_file(tmp_path), cwd=tmp_path)
    assert done.returncode == 0 and done.stdout.startswith(b"\x89PNG"), done.stderr


def test_files_are_named_when_they_are_written(tmp_path):
    done = sheldrake("report", "-o", "r.html", log_file(tmp_path), cwd=tmp_path)
    assert done.returncode == 0 and done.stdout == "wrote r.html\n" and (tmp_path / "r.html").exists()
    done = sheldrake("report", "-o", "s.html", str(tmp_path / "missing.npz"), cwd=tmp_path)
    assert done.returncode == 1 and done.stdout == "" and not (tmp_path / "s.html").exists()


def test_what_is_in_a_log_for_programs(tmp_path):
    done = sheldrake("plot", "--list", "--json", log_file(tmp_path))
    (facts,) = json.loads(done.stdout)
    assert facts == {
        "log": "a/state", "samples": 3, "elements": ["y0", "y1"], "units": ["", ""], "begin": 0.0, "end": 2.0,
    }  # fmt: skip


def test_the_documentation_has_the_exit_codes():
    told = re.findall(r"^  (\d+) +(.*)$", _EXIT_CODES, re.MULTILINE)
    page = pathlib.Path(ROOT / "docs" / "cheatsheet.md").read_text(encoding="utf-8")
    assert told == re.findall(r"^\| (\d+) \| (.*) \|$", page, re.MULTILINE) and len(told) == 6


def test_logs_as_xarray():
    xarray = pytest.importorskip("xarray")
    logs = {}
    for name, times in (("a", [0.0, 1.0]), ("b", [0.0, 1.0]), ("c", [0.5])):
        logs[name] = VectorLog(2)
        for t in times:
            logs[name].AddData(t, [t, 2 * t])
    one, all_of_them = logs["a"].ToXarray(), LogSet(logs).ToXarray()
    assert isinstance(one, xarray.DataArray) and one.dims == ("time", "element")
    np.testing.assert_array_equal(one.sel(time=1.0), [1.0, 2.0])
    assert one.element.values.tolist() == ["y0", "y1"] and one.time.attrs["units"] == "s"
    assert set(all_of_them) == {"a", "b", "c"}
    assert all_of_them["a"].dims[0] == all_of_them["b"].dims[0] != all_of_them["c"].dims[0]
    assert float(all_of_them["c"][0, 1]) == 1.0
