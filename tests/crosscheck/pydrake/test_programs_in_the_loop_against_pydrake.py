"""Programs of benchmarks/in_the_loop give the same numbers with both libraries: none is fast because it does less."""

import json
import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("pydrake")
pytestmark = pytest.mark.peer

ROOT = pathlib.Path(__file__).resolve().parents[3]
PROGRAMS = (
    "all_ports", "energy_shaping", "furuta_pendulum", "gym_episodes", "hopper", "inverse_dynamics_loop",
    "iterative_lqr", "model_questions", "monte_carlo", "net_in_the_wind", "observers", "particle_filter",
    "reading_results", "rimless_wheel", "swing_up", "system_identification", "unscented_filter", "vehicle",
)  # fmt: skip


def numbers(library, script):
    runner = pathlib.Path(__file__).with_name("numbers_of_program.py")
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    command = [sys.executable, str(runner), library, str(script)]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr
    return np.array(json.loads(run.stdout.splitlines()[-1]))


def worst(theirs, ours):
    """Largest difference, over what is there."""
    return np.max(np.abs(ours - theirs) / (1.0 + np.abs(theirs)))


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_program_gives_the_same_numbers(name):
    script = ROOT / "benchmarks" / "in_the_loop" / f"{name}.py"
    theirs, ours = (numbers(library, script) for library in ("pydrake", "sheldrake"))
    assert len(ours) == len(theirs) > 0
    assert worst(theirs, ours) < 1e-8


LESS = """import sys
from pydrake.examples import PendulumPlant
from pydrake.systems.analysis import Simulator

def program():
    simulator = Simulator(PendulumPlant())
    context = simulator.get_mutable_context()
    simulator.get_system().get_input_port(0).FixValue(context, [0.1])
    simulator.AdvanceTo(0.1 if "sheldrake" in sys.modules else 0.2)
    return context.get_continuous_state_vector().CopyToVector()
"""


def test_a_program_that_does_less_is_noticed(tmp_path):
    script = tmp_path / "less.py"
    script.write_text(LESS)
    assert worst(*(numbers(library, script) for library in ("pydrake", "sheldrake"))) > 1e-4
