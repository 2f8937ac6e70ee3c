"""Hints about retired names say the line of the script, however deep inside the library they come from."""

import re
import subprocess
import sys

SCRIPT = """
from pydrake.all import *
from pydrake.solvers.snopt import SnoptSolver
import pydrake.systems.meshcat_visualizer
builder = DiagramBuilder()
AddMultibodyPlantSceneGraph(builder)
integrator = Integrator(1)
context = integrator.CreateDefaultContext()
program = DirectCollocation(integrator, context, 3, minimum_timestep=0.1, maximum_timestep=0.2)
Solve(program)
"""


def test_each_hint_is_at_its_line(tmp_path):
    path = tmp_path / "script.py"
    path.write_text(SCRIPT)
    command = [sys.executable, "-m", "sheldrake", "run", str(path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    found = re.findall(r"^(.*):(\d+): hint: (\S+)", done.stderr, re.MULTILINE)
    assert [(file, int(line), word) for file, line, word in found] == [
        (str(path), 3, "pydrake.solvers.snopt"),
        (str(path), 4, "pydrake.systems.meshcat_visualizer"),
        (str(path), 6, "AddMultibodyPlantSceneGraph():"),
        (str(path), 9, "DirectCollocation.__init__():"),
        (str(path), 10, "Solve():"),
    ]
