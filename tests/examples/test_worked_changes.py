"""The worked changes of CONTRIBUTING: each applies to a copy of the package, in few places, and does what it says."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import sheldrake

ROOT = Path(__file__).parents[2]
CHANGES = ROOT / "docs" / "changes"
PLACES = {"joint_type": 5, "shape": 6, "approximation": 3, "block": 3}
"""Files that a change of each kind touches."""


def files_of(diff: str) -> list[str]:
    return re.findall(r"^\+\+\+ b/(.*)$", diff, re.M)


def changed_copy(diff: Path, folder: Path) -> subprocess.CompletedProcess:
    """Copies the package below `folder` / src and applies a diff to it."""
    ignored = shutil.ignore_patterns("__pycache__", "*.pyi", "*.so", "*.a")
    shutil.copytree(Path(sheldrake.__file__).parent, folder / "src" / "sheldrake", ignore=ignored)
    # GIT_CEILING_DIRECTORIES: a repository around the folder would have paths relative to its own root
    environment = os.environ | {"GIT_CEILING_DIRECTORIES": str(folder.parent)}
    return subprocess.run(["git", "apply", str(diff)], cwd=folder, env=environment, capture_output=True, text=True)


def run(program: Path, folder: Path) -> subprocess.CompletedProcess:
    environment = os.environ | {"PYTHONPATH": str(folder / "src")}
    return subprocess.run([sys.executable, str(program)], cwd=folder, env=environment, capture_output=True, text=True)


def test_all_changes_are_counted():
    assert {path.stem for path in CHANGES.glob("*.diff")} == {path.stem for path in CHANGES.glob("*.py")} == set(PLACES)


@pytest.mark.parametrize("name", PLACES)
def test_a_change_applies_in_few_places_and_works(name, tmp_path):
    diff = CHANGES / f"{name}.diff"
    files = files_of(diff.read_text(encoding="utf-8"))
    assert len(files) == PLACES[name], files
    applied = changed_copy(diff, tmp_path)
    assert applied.returncode == 0, (
        f"{applied.stderr}\nMend docs/changes/{name}.diff: see CONTRIBUTING, Worked changes."
    )
    ruff = [sys.executable, "-m", "ruff", "--config", str(ROOT / "pyproject.toml")]
    for command in (["check"], ["format", "--check"]):
        linted = subprocess.run([*ruff[:3], *command, *ruff[3:], *files], cwd=tmp_path, capture_output=True, text=True)
        assert linted.returncode == 0, linted.stdout
    done = run(CHANGES / f"{name}.py", tmp_path)
    assert done.returncode == 0 and done.stdout.endswith("ok\n"), done.stderr


@pytest.mark.parametrize("name", PLACES)
def test_without_its_change_a_program_fails(name, tmp_path):
    failed = run(CHANGES / f"{name}.py", Path(sheldrake.__file__).parents[2])
    assert failed.returncode != 0 and "cannot import name" in failed.stderr


FAULTS = {
    "joint_type": ("work.dofs[dof + 1].S = (still, x_W)", "work.dofs[dof + 1].S = (still, y_W)"),
    "shape": ("depth_T = -height - rise", "depth_T = rise - height"),
    "approximation": ("friction + 0.5 * G[5]", "friction + 0.4 * G[5]"),
    "block": ("y[i] = u[0][i] - clip(", "y[i] = u[0][i] + clip("),
}
"""A line of each change and what is wrong instead."""


@pytest.mark.parametrize("name", PLACES)
def test_a_change_with_a_fault_is_caught(name, tmp_path):
    planted, right = tmp_path / "planted.diff", (CHANGES / f"{name}.diff").read_text(encoding="utf-8")
    wrong = right.replace(*FAULTS[name])
    assert wrong != right
    planted.write_text(wrong, encoding="utf-8")
    assert changed_copy(planted, tmp_path).returncode == 0
    assert "AssertionError" in run(CHANGES / f"{name}.py", tmp_path).stderr
