"""Mutated files of real robots (example-robot-data, Drake's share): as our own files in `tests/properties`."""

from __future__ import annotations

import importlib.util
import pathlib

import pytest
from hypothesis import given
from real_robots import robot_files
from tools.torture.documents import check_parse, fuzz_settings, mutated, unnoticed_places

pytestmark = pytest.mark.usefixtures("quiet")

KINDS = ("urdf", "sdf", "dmd.yaml")
SILENT = {"gazebo", "hardwareInterface"}


def drake_files() -> list[pathlib.Path]:
    """The models that come with an installed Drake; found without importing it."""
    spec = importlib.util.find_spec("pydrake")
    share = pathlib.Path(spec.origin).parent / "share" if spec is not None and spec.origin else None
    return sorted(path for kind in KINDS for path in share.rglob(f"*.{kind}")) if share else []


FILES = [*robot_files(*KINDS), *drake_files()]


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parts[-3]}-{path.name}")
def test_mutated_robots_give_models_or_clear_errors(path):
    @fuzz_settings(15)
    @given(mutated(path.read_text()))
    def check(text):
        check_parse(path, text)

    check()


def test_nothing_in_a_robot_is_dropped_silently():
    """Each kind of place once, in the first file that has it."""
    visited: dict[str, set[str]] = {".urdf": set(), ".sdf": set()}
    files = [path for path in FILES if path.suffix in visited]
    assert [place for path in files for place in unnoticed_places(path, SILENT, visited[path.suffix])] == []
    assert min(map(len, visited.values())) > 50
