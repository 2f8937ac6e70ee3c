"""FMUs on ARM: FMPy simulates them there, in a Python that knows no sheldrake, with the numbers of this machine."""

from __future__ import annotations

import json

import numpy as np
from tests.unit.export.exported_pages import falling_block

from sheldrake.export import SaveFmu

SIMULATE = """
import json, platform, sys
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu
path, stop = sys.argv[1], float(sys.argv[2])
assert validate_fmu(path) == []
names = json.loads(sys.argv[3])
found = simulate_fmu(path, stop_time=stop, output_interval=0.01, output=names)
print(json.dumps([platform.machine(), "sheldrake" in sys.modules, [list(map(float, row)) for row in found]]))
"""


def test_fmpy_simulates_the_block_there(arm_python, tmp_path_factory, tmp_path):
    """Of FMI 3.0: FMI 2.0 has no name for ARM, and FMPy looks for code for x86-64 there."""
    simulator = falling_block()
    plant = simulator.get_system().GetSubsystemByName("plant")
    port = plant.get_state_output_port()
    path = tmp_path / "block.fmu"
    SaveFmu(simulator, path, platforms=["x86_64-linux", "aarch64-linux"], outputs=[port])
    site = tmp_path_factory.getbasetemp() / "fmpy-for-arm"
    if not site.exists():
        arm_python.install(site, "fmpy")
    names = [f"plant/state.two_hole_block_body_{axis}" for axis in "xyz"]
    (tmp_path / "simulate.py").write_text(SIMULATE)
    told = arm_python.run(site, tmp_path / "simulate.py", path, "0.4", json.dumps(names))
    machine, knows, rows = json.loads(told.splitlines()[-1])
    assert (machine, knows, len(rows)) == ("aarch64", False, 41)
    context = plant.GetMyContextFromRoot(simulator.get_context())
    for time, *position in rows:  # it lands at 0.16 s
        simulator.AdvanceTo(time)
        expected = plant.GetPositions(context)[4:]
        np.testing.assert_allclose(position, expected, rtol=0, atol=1e-12 if time < 0.1 else 1e-9)
