"""What an editor says of programs that use sheldrake: right lines are clean, wrong ones are underlined.

The checker is pyright, which editors use, on the stubs and annotations as they are installed.
"""

from __future__ import annotations

import json
import os
import pathlib
import re
import subprocess
import sys

import pytest

pytest.importorskip("pyright")

ROOT = pathlib.Path(__file__).resolve().parents[2]
MISTAKES = pathlib.Path(__file__).with_name("mistakes.py")
NOT_CLEAN = {
    "pydrake": "it imports pydrake",
    "kernels": "it shows a mistake, and what is said of it",
    "own_laws": "it shows a mistake, and reads what SciPy gives in two ways",
    "notebook": "it asks for what only notebooks ask for",
    "worlds": "a name is bound in a loop",
}
"""Pages that an editor may underline, and why."""
PAGES = [ROOT / "README.md", *(p for p in sorted((ROOT / "docs").glob("*.md")) if p.stem not in NOT_CLEAN)]
PROGRAMS = [*(ROOT / "examples").glob("*.py"), *(ROOT / "benchmarks" / "in_the_loop").glob("*.py")]


def errors_of(folder: pathlib.Path) -> list[tuple[str, int, str]]:
    """What pyright says of the programs of a folder: file, line and message of each error."""
    (folder / "pyrightconfig.json").write_text(json.dumps({"extraPaths": [str(ROOT / "src")]}))
    command = [sys.executable, "-m", "pyright", "--outputjson", "--pythonpath", sys.executable, "-p", str(folder)]
    environment = {**os.environ, "PYRIGHT_PYTHON_IGNORE_WARNINGS": "1"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=600)
    if not done.stdout.startswith("{"):
        pytest.skip(f"pyright does not start here (it needs node): {done.stderr[-300:]}")
    report = json.loads(done.stdout)
    assert report["summary"]["filesAnalyzed"] == len(list(folder.glob("*.py")))
    return [
        (pathlib.Path(found["file"]).name, found["range"]["start"]["line"] + 1, found["message"])
        for found in report["generalDiagnostics"]
        if found["severity"] == "error"
    ]


def test_lines_of_readme_pages_and_examples_are_clean(tmp_path):
    for page in PAGES:
        blocks = re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
        (tmp_path / f"{page.stem}_page.py").write_text("\n".join(blocks), encoding="utf-8")
    for program in PROGRAMS:
        text = program.read_text(encoding="utf-8").replace("pydrake", "sheldrake")
        (tmp_path / program.name).write_text(text, encoding="utf-8")
    lines = [line for path in tmp_path.glob("*.py") for line in path.read_text(encoding="utf-8").splitlines()]
    assert sum(bool(line.strip()) for line in lines) > 2500
    assert errors_of(tmp_path) == []


def test_every_mistake_is_underlined_and_nothing_else(tmp_path):
    text = MISTAKES.read_text(encoding="utf-8")
    (tmp_path / "mistakes.py").write_text(text, encoding="utf-8")
    wrong = [number for number, line in enumerate(text.splitlines(), 1) if line.endswith("# wrong")]
    assert len(wrong) >= 20
    assert sorted({line for _, line, _ in errors_of(tmp_path)}) == wrong


def test_the_same_mistakes_are_seen_less_well_with_the_stubs_of_pydrake(tmp_path):
    """Of our file, pydrake's own stubs underline fewer wrong lines, and a right one."""
    pydrake = pytest.importorskip("pydrake")
    if not list(pathlib.Path(pydrake.__file__).parent.glob("*.pyi")):
        pytest.skip("this pydrake has no stubs")
    text = MISTAKES.read_text(encoding="utf-8").replace("sheldrake", "pydrake")
    (tmp_path / "mistakes.py").write_text(text, encoding="utf-8")
    lines = {line for _, line, _ in errors_of(tmp_path)}
    wrong = {number for number, line in enumerate(text.splitlines(), 1) if line.endswith("# wrong")}
    assert lines & wrong < wrong and lines - wrong, "the stubs of pydrake are as good as ours"


TYPES = {
    "context": "Context",
    "plant": "MultibodyPlant",
    "scene_graph": "SceneGraph",
    "plant.GetMyContextFromRoot(context)": "Context",
    "X @ X": "RigidTransform",
    "X.multiply(X)": "RigidTransform",
    "simulator.get_system()": "Diagram",
    "Variable('x') + 1": "Expression",
    "Variable('x') < 1": "Formula",
    "RollPitchYaw(0, 0, 1).ToRotationMatrix().multiply(RotationMatrix())": "RotationMatrix",
    "X.inverse()": "RigidTransform",
    "X.rotation()": "RotationMatrix",
    "plant.EvalBodyPoseInWorld(context, plant.world_body())": "RigidTransform",
    "simulator.get_context()": "Context",
    "MultibodyPlant(0.001)": "MultibodyPlant",
    "ConstantVectorSource([1.0])": "ConstantVectorSource",
    "MathematicalProgram().AddLinearCost(Expression(1))": "Binding",
    "builder.AddSystem(plant)": "MultibodyPlant",
    "scene_graph.get_query_output_port()": "OutputPort",
    "context.get_discrete_state()": "DiscreteValues",
    "context.get_discrete_state(0)": "BasicVector",
    "context.get_abstract_state(0)": "AbstractValue",
    "diagram.ToAutoDiffXd()": "Diagram",
    "X.rotation().ToQuaternion().inverse()": "Quaternion",
    "X.rotation().ToQuaternion().w()": "float",
}
"""What an editor knows of values that programs hold."""


def test_values_have_types(tmp_path):
    text = """
from sheldrake.all import *
builder = DiagramBuilder()
plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
diagram = builder.Build()
context = diagram.CreateDefaultContext()
simulator = Simulator(diagram, context)
X = RigidTransform()
"""
    (tmp_path / "types.py").write_text(text + "".join(f"_: int = {value}\n" for value in TYPES))
    found = [re.search(r'Type "([^"]*)"', message) for _, _, message in errors_of(tmp_path)]
    assert [match and match.group(1) for match in found] == list(TYPES.values())


def test_the_stubs_are_up_to_date():
    command = [sys.executable, str(ROOT / "tools" / "make_stubs.py"), "--check"]
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": str(ROOT / "src")})
    assert done.returncode == 0, done.stderr


def test_the_package_says_that_it_has_types():
    assert (ROOT / "src" / "sheldrake" / "py.typed").exists()


WITH_FORMS = """
from sheldrake.common._overloads import overload, overloaded, text

class Thing:
    @overloaded(overload(name=text))
    def __init__(self, name) -> None: ...

    @overloaded(overload(name=text))
    def length(self, name) -> int:
        return 1

reveal_type(Thing("a"))
reveal_type(Thing("a").length("b"))
"""


def test_mypy_knows_what_calls_with_several_forms_give(tmp_path):
    pytest.importorskip("mypy")
    (tmp_path / "forms.py").write_text(WITH_FORMS)
    command = [sys.executable, "-m", "mypy", "--config-file=", "--cache-dir", str(tmp_path / "cache"), "forms.py"]
    environment = {**os.environ, "MYPYPATH": str(ROOT / "src"), "PYTHONPATH": ""}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=tmp_path, timeout=600)
    found = re.findall(r'forms\.py:\d+: note: Revealed type is "(.*)"', done.stdout)
    assert [name.rpartition(".")[2] for name in found] == ["Thing", "int"], done.stdout + done.stderr
