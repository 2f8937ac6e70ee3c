"""tools/compare_with_pydrake.py --stubs finds what is planted into a stub."""

import importlib.util
import pathlib
import zipfile

import pytest

TOOL = pathlib.Path(__file__).parents[2] / "tools" / "compare_with_pydrake.py"

STUB = """
import enum
from typing import overload

class RigidTransform:
    def inverse(self) -> RigidTransform: ...
    def Fold(self) -> None: ...
    def rotation(self, sideways: bool) -> RotationMatrix: ...
    @staticmethod
    def Identity() -> RigidTransform: ...

class RigidTransform_𝓣AutoDiffXd𝓤:
    def OnlyOfInstantiations(self) -> None: ...

class Tesseract: ...

def is_close(a: float, b: float) -> bool: ...

@overload
def wrap_to(value: float, low: float, high: float) -> float: ...
@overload
def wrap_to(value: float, low: float, high: float, colour: str = "") -> float: ...
"""
FOUND = [
    "math.RigidTransform.Fold: missing",
    "math.RigidTransform.rotation: by position: too many positional arguments",
    "math.Tesseract: missing",
    "math.is_close: missing",
    "math.wrap_to: by position: too many positional arguments",
    "matter: missing module",
]


@pytest.fixture(scope="module")
def tool():
    spec = importlib.util.spec_from_file_location("compare_with_pydrake", TOOL)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_faults_of_a_folder_are_found(tool, tmp_path):
    (tmp_path / "pydrake").mkdir()
    (tmp_path / "pydrake" / "math.pyi").write_text(STUB, encoding="utf-8")
    (tmp_path / "pydrake" / "matter.pyi").write_text("", encoding="utf-8")
    found = [line.partition("  [")[0] for line in tool.stub_differences(tmp_path)]
    assert found == FOUND


def test_a_wheel_is_read_as_its_folder(tool, tmp_path):
    wheel = tmp_path / "drake.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("pydrake/math.pyi", STUB)
        archive.writestr("pydrake/matter.pyi", "")
    assert [line.partition("  [")[0] for line in tool.stub_differences(wheel)] == FOUND
    assert list(tool.stub_differences(wheel, "sheldrake.mat"))[-1:] == ["matter: missing module"]


def test_a_folder_without_stubs_is_refused(tool, tmp_path):
    with pytest.raises(SystemExit, match="no stubs of pydrake"):
        list(tool.stub_differences(tmp_path))
