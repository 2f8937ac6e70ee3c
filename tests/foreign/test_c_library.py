"""The C library on RISC-V and a Cortex-M7, as QEMU has them: the numbers of the simulator; sizes are printed."""

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
CORTEX = ["-mcpu=cortex-m7", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv5-d16"]
BOARD = """
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include "scene.h"

void initialise_monitor_handles(void);
extern char _stack_top;

void _fini(void) {} /* exit() calls it */

void begin(void) {
  *(volatile uint32_t *)0xE000ED88 |= 0xF << 20; /* the coprocessor for floating point, before any such number */
  __asm__ volatile("dsb\\n isb");
  initialise_monitor_handles();
  int64_t status = scene_advance_to_end();
  exit((int)status);
}

__attribute__((section(".vectors"), used)) static void (*const vectors[])(void) = {
    (void (*)(void))&_stack_top, begin};
"""
ADVANCE = """
__attribute__((noinline)) static int64_t scene_advance_to_end(void) {
  scene_reset();
  int64_t status = scene_advance_to(%r);
  printf("%%.17g", scene_time());
  for (int i = 0; i < %d; ++i) printf(" %%.17g", scene_plant_state[i]);
  printf("\\n");
  return status;
}
"""
LAYOUT = """
ENTRY(begin)
SECTIONS {
  . = 0;
  .vectors : { KEEP(*(.vectors)) }
  .text : { *(.text*) *(.rodata*) *(.ARM.ex*) }
  .data : ALIGN(64) { *(.data*) }
  .bss : ALIGN(64) { *(.bss*) *(COMMON) }
  end = ALIGN(64);
  _stack_top = 0x400000;
}
"""


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


CORTEX_TOOLS = ("qemu-system-arm", "arm-none-eabi-gcc")


@pytest.mark.skipif(
    not all(map(shutil.which, CORTEX_TOOLS)),
    reason=f"needs {', '.join(CORTEX_TOOLS)} (Debian: qemu-system-arm, gcc-arm-none-eabi, libnewlib-arm-none-eabi)",
)
@SCENES
def test_cortex_m7(tmp_path, make, state):
    """On a board without an operating system, whose words come out through the debugger (semihosting)."""
    simulator, time = make(), STEPS * 1e-3
    SaveC(simulator, tmp_path, target="thumbv7em-none-eabihf", name="scene")
    head, _, tail = BOARD.partition("void begin")
    (tmp_path / "board.c").write_text(f"{head}{ADVANCE % (time, state)}\nvoid begin{tail}")
    (tmp_path / "board.ld").write_text(LAYOUT)
    command = ["arm-none-eabi-gcc", *CORTEX, *WARNINGS, "-nostartfiles", "-specs=rdimon.specs", "-T", "board.ld"]
    command += ["board.c", "scene.c", "libscene.a", "-lm", "-o", "program"]
    subprocess.run(command, cwd=tmp_path, check=True)
    tell("Cortex-M7", tmp_path, tmp_path / "program")
    command = ["qemu-system-arm", "-M", "mps2-an500", "-nographic", "-semihosting", "-kernel", tmp_path / "program"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True)
    reached, *found = map(float, done.stdout.split())
    assert reached == time
    np.testing.assert_allclose(found, native_state(simulator, time)[:state], rtol=0, atol=1e-12)
