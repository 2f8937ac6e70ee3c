"""FMUs that others made, in FmuSystem: the numbers that FMPy's own loop gets.

Those of OpenModelica and PythonFMU that the package gemseo-fmu brings, and all that lie in the folder SHELDRAKE_FMUS:
`SHELDRAKE_FMUS=folder python dev.py foreign -k fmus_of_others`, such as the reference FMUs of the Modelica Association.
"""

from __future__ import annotations

import os
import pathlib
import subprocess
import sys
import zipfile

import numpy as np
import pytest

from sheldrake.export import FmuSystem
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import ConstantVectorSource

fmpy = pytest.importorskip("fmpy")
pytestmark = pytest.mark.skipif(fmpy.platform_tuple != "x86_64-linux", reason="has FMUs for x86-64 Linux")
STEPS = 200


def compare(path: pathlib.Path) -> tuple[float, int]:
    """How far FmuSystem and FMPy are apart, by the largest value of each variable, and how many variables there are."""
    about = fmpy.read_model_description(str(path), validate=False)
    step = FmuSystem(path).get_step() or 0.01
    system = FmuSystem(path, step=step)
    builder = DiagramBuilder()
    builder.AddSystem(system)
    given = {}
    variables = {v.name: v for v in about.modelVariables}
    for i in range(system.num_input_ports()):
        port = system.get_input_port(i)
        kind = variables[port.get_name()].type
        value = 0.25 * (i + 1) if kind in ("Real", "Float32", "Float64") else 1.0
        source = builder.AddSystem(ConstantVectorSource(np.full(port.size(), value)))
        builder.Connect(source.get_output_port(), port)
        numbers = [value if kind in ("Real", "Float32", "Float64") else kind == "Boolean" or 1] * port.size()
        given[port.get_name()] = numbers if port.size() > 1 else numbers[0]
    simulator = Simulator(builder.Build())
    expected = fmpy.simulate_fmu(
        str(path), start_time=0.0, stop_time=STEPS * step, output_interval=step, start_values=given,
        fmi_type="CoSimulation", validate=False,
    )  # fmt: skip
    names = [n for n in expected.dtype.names if system.HasOutputPort(n)]
    found = []
    for time in expected["time"][1:]:
        simulator.AdvanceTo(time)
        context = system.GetMyContextFromRoot(simulator.get_context())
        found.append(np.concatenate([system.GetOutputPort(n).Eval(context) for n in names]))
    reference = np.array([np.concatenate([np.ravel(row[n]).astype(float) for n in names]) for row in expected[1:]])
    scale = np.maximum(abs(reference).max(axis=0), 1e-30)
    return float((abs(np.array(found) - reference) / scale).max()), reference.shape[1]


@pytest.fixture(scope="session")
def of_tools(tmp_path_factory):
    """Folder of the FMUs that gemseo-fmu brings; none of that package is installed."""
    folder = tmp_path_factory.mktemp("gemseo")
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--only-binary=:all:", "-d", folder]
    subprocess.run([*command, "gemseo-fmu"], check=True)
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder, [n for n in archive.namelist() if "/linux/" in n and n.endswith(".fmu")])
    return next(folder.rglob("linux"))


@pytest.mark.parametrize(
    ("name", "tool"),
    [
        ("MassSpringSystem", "OpenModelica Compiler OpenModelica 1.21"),
        ("Mass_Damper", "OpenModelica Compiler OpenModelica 1.19"),
        ("ramp", "OpenModelica Compiler OpenModelica 1.20"),
        ("FMU3Model", "PythonFMU3"),
    ],
)
def test_fmus_of_other_tools(of_tools, name, tool):
    path = of_tools / f"{name}.fmu"
    assert fmpy.read_model_description(str(path), validate=False).generationTool.startswith(tool)
    difference, size = compare(path)
    print(f"\n{name}: {size} outputs, {difference:.1e}")
    assert size > 0 and difference < 1e-9  # OpenModelica's solvers choose steps of their own


def given_fmus() -> list[pathlib.Path]:
    folder = os.environ.get("SHELDRAKE_FMUS")
    return sorted(pathlib.Path(folder).glob("**/*.fmu")) if folder else []


@pytest.mark.skipif(not given_fmus(), reason="needs a folder with FMUs in SHELDRAKE_FMUS, such as the reference FMUs")
@pytest.mark.parametrize("path", given_fmus(), ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_fmus_of_a_folder(path):
    if fmpy.read_model_description(str(path), validate=False).coSimulation is None:
        with pytest.raises(ValueError, match="not for co-simulation"):
            FmuSystem(path)
        return
    difference, size = compare(path)
    print(f"\n{path.stem}: {size} outputs, {difference:.1e}")
    assert size > 0 and difference < 1e-9
