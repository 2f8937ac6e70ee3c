"""A diagram as C: compiled, linked, run; the numbers are those of the simulator."""

import re
import struct
import subprocess
import sys

import numpy as np
import pytest
from tests.unit.export.exported_pages import arm, falling_block, native_state

from sheldrake.common.kernel import jit_enabled
from sheldrake.export import SaveC

pytest.importorskip("ziglang")
pytestmark = pytest.mark.skipif(not jit_enabled(), reason="runs machine code; SHELDRAKE_JIT=0 switches it off")
ZIG = [sys.executable, "-m", "ziglang"]


WARNINGS = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-O2"]


def compiled(folder, name):
    """The program of a folder, for this machine."""
    program = folder / "program"
    sources = ["main.c", f"{name}.c", f"lib{name}.a"]
    subprocess.run([*ZIG, "cc", *WARNINGS, *sources, "-lm", "-o", str(program)], cwd=folder, check=True)
    return program


@pytest.mark.parametrize(
    ("make", "before", "after"), [(falling_block, 0.1, 1.0), (arm, 0.5, 1.0)], ids=["falling block", "arm"]
)
def test_a_library_gives_the_numbers_of_the_simulator(tmp_path, make, before, after):
    simulator = make()
    SaveC(simulator, tmp_path, name="scene")
    program = compiled(tmp_path, "scene")
    done = subprocess.run([program, str(before), str(after)], capture_output=True, text=True, check=True)
    for line, time, tolerance in zip(done.stdout.splitlines(), (before, after), (1e-9, 1e-6)):
        t, *found = map(float, line.split())
        expected = native_state(simulator, time)
        assert t == time
        np.testing.assert_allclose(found[: len(expected)], expected, rtol=0, atol=tolerance)


def test_inputs_reset_logs_and_memory_are_in_the_header(tmp_path):
    simulator = falling_block()
    SaveC(simulator, tmp_path, name="a block")
    (tmp_path / "main.c").write_text(
        """#include <stdio.h>
#include "a_block.h"
static int samples;
static double last;
static void count(int log, const double *rows, int n, int columns) {
  samples += n;
  last = rows[(n - 1) * columns] + 0 * log;
}
int main(void) {
  a_block_samples = count;
  for (int run = 0; run < 2; ++run) {
    samples = 0;
    a_block_reset();
    a_block_plant_applied_generalized_force[3] = 1.0; /* along x */
    a_block_changed();
    if (a_block_advance_to(0.1)) return 1;
    if (a_block_compute_outputs()) return 1;
    printf("%.17g %d %g %d\\n", a_block_plant_state[4], samples, last, (int)sizeof a_block_memory);
  }
  return 0;
}
"""
    )
    done = subprocess.run([compiled(tmp_path, "a_block")], capture_output=True, text=True, check=True)
    lines = done.stdout.splitlines()
    assert len(lines) == 2 and lines[0] == lines[1]
    x, samples, last, size = lines[0].split()
    plant = next(s for s in simulator.get_system().GetSystems() if hasattr(s, "GetPositionsAndVelocities"))
    port, context = plant.get_applied_generalized_force_input_port(), simulator.get_mutable_context()
    port.FixValue(plant.GetMyMutableContextFromRoot(context), np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0]))
    assert float(x) == pytest.approx(native_state(simulator, 0.1)[4], abs=1e-9)
    assert int(samples) == 101 and float(last) == pytest.approx(0.1)
    header = (tmp_path / "a_block.h").read_text()
    assert f"{size} bytes of memory" in header


@pytest.mark.parametrize(
    ("target", "options", "machine"),
    [
        ("aarch64-linux", ["-target", "aarch64-linux-musl"], 183),
        ("riscv64-linux", ["-target", "riscv64-linux-musl"], 243),
        ("thumbv7em-none-eabihf", ["-target", "thumb-freestanding-eabihf", "-mcpu=cortex_m7", "-ffreestanding"], 40),
    ],
)
def test_other_processors_compile(tmp_path, target, options, machine):
    SaveC(falling_block(), tmp_path, target=target, name="scene")
    subprocess.run([*ZIG, "cc", *options, *WARNINGS, "-c", "scene.c", "-o", "scene.o"], cwd=tmp_path, check=True)
    subprocess.run([*ZIG, "ar", "x", "libscene.a"], cwd=tmp_path, check=True)
    machines = {path.name: struct.unpack_from("<H", path.read_bytes(), 18)[0] for path in tmp_path.glob("*.o")}
    assert len(machines) > 5 and set(machines.values()) == {machine}  # e_machine of ELF


def test_names_stay_in_their_comments_and_unknown_targets_are_refused(tmp_path):
    SaveC(falling_block(name='*/ #error "x" ??/\n//'), tmp_path, name="scene")
    compiled(tmp_path, "scene")
    header = (tmp_path / "scene.h").read_text()
    assert not re.search(r"^\s*#error", header, re.M)
    with pytest.raises(ValueError, match=r"no target 'z80'; there are x86_64-linux, aarch64-linux"):
        SaveC(falling_block(), tmp_path, target="z80")
