"""Wheels of other platforms, run here under emulators: `python dev.py foreign`.

Not part of the ordinary tests: it builds every wheel and needs Debian's qemu-user and wine64.
"""

from __future__ import annotations

import os
import pathlib
import shutil
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def wheels(tmp_path_factory):
    """The folder with all platforms' wheels, and libraries in `prebuilt`: built now, or that of SHELDRAKE_WHEELS."""
    if "SHELDRAKE_WHEELS" in os.environ:
        return pathlib.Path(os.environ["SHELDRAKE_WHEELS"])
    out = tmp_path_factory.mktemp("wheels")
    subprocess.run([sys.executable, ROOT / "tools" / "build_wheels.py", out], check=True, cwd=ROOT)
    shutil.copytree(ROOT / "build" / "prebuilt", out / "prebuilt")
    return out


@pytest.fixture(scope="session")
def driver(tmp_path_factory):
    """Makes the program that runs a case of spans.py, for a target of zig."""

    def make(target: str, ending: str = "") -> pathlib.Path:
        program = tmp_path_factory.mktemp("driver") / f"driver{ending}"
        source = pathlib.Path(__file__).with_name("span_driver.c")
        command = [sys.executable, "-m", "ziglang", "cc", "-target", target, "-O1", "-o", program, source]
        subprocess.run([*command, *([] if ending else ["-ldl"])], check=True)
        return program

    return make
