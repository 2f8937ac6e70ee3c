"""The wheel for ARM, in an ARM Python run by qemu: installs, drops the block without a compiler, same numbers."""

from __future__ import annotations

import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest


@pytest.fixture(scope="module")
def arm(arm_python, wheels, tmp_path_factory):
    """Runs the ARM Python, in which the wheel and what it needs are installed."""
    site = tmp_path_factory.mktemp("site")
    (wheel,) = wheels.glob("*manylinux*_aarch64.whl")
    arm_python.install(site, wheel)

    def run(*arguments: str) -> str:
        return arm_python.run(site, *arguments)

    return run


def test_kernels_come_from_the_wheel(arm):
    code = """
import platform, sys
from sheldrake.common._native import prebuilt
found, why = prebuilt.library()
print(platform.machine(), why, len(found.entries) > 50, "llvmlite" in sys.modules)
"""
    assert arm("-c", code).split() == ["aarch64", "in", "use", "True", "False"]


def test_the_block_falls_as_here(arm, tmp_path):
    there, here = tmp_path / "there", tmp_path / "here"
    arm("-m", "sheldrake", "demo", "--headless", "--seconds", "1", "--out", str(there))
    command = [sys.executable, "-m", "sheldrake", "demo", "--headless", "--seconds", "1", "--out", str(here)]
    source = pathlib.Path(__file__).resolve().parents[2] / "src"
    subprocess.run(command, check=True, env={**os.environ, "PYTHONPATH": str(source)}, stdout=subprocess.DEVNULL)
    mine, theirs = (np.load(folder / "block.npz") for folder in (here, there))
    assert sorted(mine.files) == sorted(theirs.files)
    assert mine["data"].shape[1] > 1000 and np.ptp(mine["data"][6]) > 0.05
    np.testing.assert_allclose(theirs["data"], mine["data"], rtol=1e-8, atol=1e-9)
