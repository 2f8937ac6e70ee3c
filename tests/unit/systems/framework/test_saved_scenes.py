"""Runs saved half-way go on in another process as if they had never stopped: same bits, whatever takes the steps."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.unit.systems.framework.saved_scenes import END, HALF, SCENES, outcome, simulator_of

from sheldrake.systems.framework import LoadContext, SaveContext

PROGRAM = Path(__file__).with_name("saved_scenes.py")


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """What came of every scene without stopping, and of its second half in another process."""
    directory, never_stopped = tmp_path_factory.mktemp("scenes"), {}
    for name, make in SCENES.items():
        system, context, scheme, accuracy = make()
        simulator = simulator_of(system, context, scheme, accuracy)
        simulator.AdvanceTo(HALF)
        SaveContext(context, directory / f"{name}.npz")
        simulator.AdvanceTo(END)
        never_stopped[name] = outcome(context)
    command = [sys.executable, str(PROGRAM), str(directory)]
    done = subprocess.run(command, env=dict(os.environ), capture_output=True)
    assert done.returncode == 0, done.stderr.decode()
    return directory, {name: (x, np.load(directory / f"{name}.npy")) for name, x in never_stopped.items()}


@pytest.mark.parametrize("name", SCENES)
def test_same_bits(runs, name):
    never_stopped, gone_on = runs[1][name]
    assert never_stopped.tobytes() == gone_on.tobytes()
    assert len(never_stopped) > 6


def test_events_happened(runs):
    story = runs[1]["eventful"][0]
    assert story[7] > 22 and len(story) == 8 + story[7], "periodic updates of the abstract state, and the witness"


@pytest.mark.parametrize("name", ["radau3", "velocity_implicit_euler", "runge_kutta5"])
def test_what_integrators_remember_matters(runs, name):
    """Without it the steps, and so the last bits, are others."""
    directory, found = runs
    system, _, scheme, accuracy = SCENES[name]()
    context = LoadContext(system, directory / f"{name}.npz")
    context._store.goes_on = (*context._store.goes_on[:1], "another", [0.0])
    simulator_of(system, context, scheme, accuracy).AdvanceTo(END)
    assert outcome(context).tobytes() != found[name][0].tobytes()
    np.testing.assert_allclose(outcome(context), found[name][0], atol=1e-3)
