"""The worked change of CONTRIBUTING for contact: it applies to a copy of the package, in three places, and works."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import sheldrake

CHANGES = Path(__file__).parents[2] / "docs" / "changes"
DIFF, PROGRAM = CHANGES / "approximation.diff", CHANGES / "approximation.py"


def changed_copy(diff: str, folder: Path) -> None:
    """Copies the package below `folder` / src and applies a diff to it."""
    ignored = shutil.ignore_patterns("__pycache__", "*.pyi", "*.so", "*.a")
    shutil.copytree(Path(sheldrake.__file__).parent, folder / "src" / "sheldrake", ignore=ignored)
    # GIT_CEILING_DIRECTORIES: a repository around the folder would have paths relative to its own root
    environment = os.environ | {"GIT_CEILING_DIRECTORIES": str(folder.parent)}
    subprocess.run(["git", "apply", "-"], input=diff.encode(), cwd=folder, env=environment, check=True)


def run(folder: Path) -> subprocess.CompletedProcess:
    environment = os.environ | {"PYTHONPATH": str(folder / "src")}
    return subprocess.run([sys.executable, str(PROGRAM)], cwd=folder, env=environment, capture_output=True, text=True)


def test_a_new_approximation_is_three_places_and_works(tmp_path):
    diff = DIFF.read_text(encoding="utf-8")
    assert len(re.findall(r"^\+\+\+ b/", diff, re.M)) == 3
    changed_copy(diff, tmp_path)
    done = run(tmp_path)
    assert done.returncode == 0 and done.stdout.endswith("ok\n"), done.stderr


def test_without_the_change_its_program_fails(tmp_path):
    failed = run(Path(sheldrake.__file__).parents[2])
    assert failed.returncode != 0 and "cannot import name" in failed.stderr


def test_a_law_whose_cost_is_another_is_caught(tmp_path):
    right = DIFF.read_text(encoding="utf-8")
    wrong = right.replace("friction + 0.5 * G[5]", "friction + 0.4 * G[5]")
    assert wrong != right
    changed_copy(wrong, tmp_path)
    assert "AssertionError" in run(tmp_path).stderr
