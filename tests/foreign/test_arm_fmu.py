"""FMUs on ARM: FMPy simulates them there, in a Python that knows no sheldrake, with the numbers of this machine."""

from __future__ import annotations

import json

import numpy as np
import pytest
from tests.unit.export.exported_pages import falling_block

from sheldrake.export import SaveFmu

SIMULATE = """
import json, os, platform, sys
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu
path, stop = sys.argv[1], float(sys.argv[2])
assert validate_fmu(path) == []
names = json.loads(sys.argv[3])
more = {}
if sys.argv[4:]:
    about, folder = read_model_description(path), extract(path)
    name = about.coSimulation.modelIdentifier
    library = os.path.join(folder, "binaries", sys.argv[4], name + ".so")
    slave = FMU2Slave(guid=about.guid, unzipDirectory=folder, modelIdentifier=name, libraryPath=library)
    slave.instantiate()
    more = {"fmu_instance": slave}
found = simulate_fmu(path, stop_time=stop, output_interval=0.01, output=names, **more)
print(json.dumps([platform.machine(), "sheldrake" in sys.modules, [list(map(float, row)) for row in found]]))
"""


@pytest.mark.parametrize(
    ("version", "platforms", "folder"),
    [
        ("3.0", ["x86_64-linux", "aarch64-linux"], None),
        ("2.0", ["aarch64-linux"], None),  # FMI 2.0 has no name for ARM, and FMPy looks under linux64
        ("2.0", ["x86_64-linux", "aarch64-linux"], "aarch64-linux"),
    ],
)
def test_fmpy_simulates_the_block_there(arm_python, tmp_path_factory, tmp_path, version, platforms, folder):
    simulator = falling_block()
    plant = simulator.get_system().GetSubsystemByName("plant")
    port = plant.get_state_output_port()
    path = tmp_path / "block.fmu"
    SaveFmu(simulator, path, fmi_version=version, platforms=platforms, outputs=[port])
    site = tmp_path_factory.getbasetemp() / "fmpy-for-arm"
    if not site.exists():
        arm_python.install(site, "fmpy")
    names = [f"plant/state.two_hole_block_body_{axis}" for axis in "xyz"]
    (tmp_path / "simulate.py").write_text(SIMULATE)
    told = arm_python.run(site, tmp_path / "simulate.py", path, "0.4", json.dumps(names), *filter(None, [folder]))
    machine, knows, rows = json.loads(told.splitlines()[-1])
    assert (machine, knows, len(rows)) == ("aarch64", False, 41)
    context = plant.GetMyContextFromRoot(simulator.get_context())
    for time, *position in rows[1:]:  # it lands at 0.16 s
        simulator.AdvanceTo(time)
        expected = plant.GetPositions(context)[4:]
        np.testing.assert_allclose(position, expected, rtol=0, atol=1e-12 if time < 0.1 else 1e-9)
