"""Descriptions that come with Drake, shapes included: the same scene, contacts, steps and falls in both libraries."""

import os
import pathlib
import pickle
import subprocess
import sys

import numpy as np
import pytest

pydrake = pytest.importorskip("pydrake")
pytestmark = pytest.mark.peer

ROOT = pathlib.Path(__file__).resolve().parents[3]
SHARE = pathlib.Path(pydrake.__file__).parent / "share" / "drake"
FILES = sorted(str(path) for kind in ("urdf", "sdf") for path in SHARE.rglob(f"*.{kind}"))
FILES += sorted(str(path) for path in (ROOT / "src" / "sheldrake" / "models").rglob("*.urdf"))
# Falls with contact: solvers stop within 1e-6 of the largest momentum, as Drake's.
TOLERANCE = 1e-6


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    program = pathlib.Path(__file__).with_name("described_scenes.py")
    environment, found = {**os.environ, "PYTHONPATH": str(ROOT / "src")}, {}
    for library in ("pydrake", "sheldrake"):
        out = tmp_path_factory.mktemp(library) / "scenes"
        command = [sys.executable, str(program), library, str(out), *FILES]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=600)
        assert done.returncode == 0, done.stderr
        found[library] = pickle.loads(out.read_bytes())
    return found


def same(theirs, ours):
    """The names of entries that differ by more than rounding."""
    found = []
    for name, expected in theirs.items():
        if name in ("poses", "geometries"):
            continue
        if isinstance(expected, np.ndarray):
            if not np.allclose(
                ours[name], expected, rtol=0, atol=TOLERANCE * max(1.0, np.abs(expected).max(initial=0))
            ):
                found.append(name)
        elif isinstance(expected, dict):
            if expected.keys() != ours[name].keys() or any(abs(ours[name][k] - d) > 1e-6 for k, d in expected.items()):
                found.append(name)
        elif expected != ours[name]:
            found.append(name)
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda path: pathlib.Path(path).name)
def test_scenes_are_the_same(path, scenes):
    theirs, ours = (scenes[library][path] for library in ("pydrake", "sheldrake"))
    assert not isinstance(theirs, str) and not isinstance(ours, str), (theirs, ours)
    assert same(theirs[0], ours[0]) == []
    assert len(theirs[0]["geometries"]) == len(ours[0]["geometries"])
    for expected, found in zip(theirs[0]["geometries"], ours[0]["geometries"]):
        assert found == expected
    np.testing.assert_allclose(np.array(ours[0]["poses"]), np.array(theirs[0]["poses"]), rtol=0, atol=1e-14)
    assert same(theirs[1], ours[1]) == []


def test_a_fault_of_one_part_in_ten_thousand_is_seen(scenes):
    _, numbers = scenes["pydrake"][FILES[0]]
    for name, value in numbers.items():
        if isinstance(value, np.ndarray) and value.size:
            assert same(numbers, {**numbers, name: value + 1e-4 * np.abs(value).max()}) == [name]
