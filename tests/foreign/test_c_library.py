"""The C library on RISC-V, as QEMU has it: the numbers of the simulator; sizes are printed."""

from __future__ import annotations

import pathlib
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from tests.unit.export.exported_pages import arm, falling_block, native_state

from sheldrake.export import SaveC

ZIG = [sys.executable, "-m", "ziglang"]
WARNINGS = ["-std=gnu99", "-Wall", "-Wextra", "-Werror", "-O2"]
SCENES = pytest.mark.parametrize(
    ("make", "state"), [(falling_block, 13), (arm, 12)], ids=["falling block", "arm with PID"]
)
STEPS = 100  # before first contact [ms]


def build(folder: pathlib.Path, target: str, *options: str) -> pathlib.Path:
    """The program of a library with its `main.c`."""
    program = folder / "program"
    command = [*ZIG, "cc", "-target", target, *WARNINGS, *options, "main.c", "scene.c", "libscene.a", "-lm"]
    subprocess.run([*command, "-o", str(program)], cwd=folder, check=True)
    return program


def tell(name: str, folder: pathlib.Path, program: pathlib.Path) -> None:
    (memory,) = re.findall(r"(\d+) bytes of memory", (folder / "scene.h").read_text())
    kernels = (folder / "libscene.a").stat().st_size
    print(f"\n{name}: kernels {kernels} bytes, memory {memory} bytes, program {program.stat().st_size} bytes")


@pytest.mark.skipif(not shutil.which("qemu-riscv64"), reason="needs qemu-riscv64 (Debian: qemu-user)")
@SCENES
def test_risc_v(tmp_path, make, state):
    simulator = make()
    SaveC(simulator, tmp_path, target="riscv64-linux", name="scene")
    program = build(tmp_path, "riscv64-linux-musl", "-static", "-s")
    tell("RISC-V", tmp_path, program)
    command = ["qemu-riscv64", program, repr(STEPS * 1e-3)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True)
    time, *found = map(float, done.stdout.split())
    assert time == STEPS * 1e-3
    np.testing.assert_allclose(found[:state], native_state(simulator, time)[:state], rtol=0, atol=1e-12)
