"""Our own linker of kernels, for Linux on x86-64."""

from __future__ import annotations

import ctypes
import math
import struct

import numpy as np
import pytest

from sheldrake.common._native import builtin, elf, prebuilt, store
from sheldrake.common._native.target import Target
from sheldrake.common.kernel import jit_enabled

pytestmark = [
    pytest.mark.skipif(not jit_enabled(), reason="asks about machine code; SHELDRAKE_JIT=0 switches it off"),
    pytest.mark.skipif(not elf.is_understood(), reason="on Linux and x86-64 only"),
]

TARGET = Target("x86_64-unknown-linux-gnu", 1, "x86-64")
TEXT = """
@weights = private constant [4 x double] [double 1.5, double -2.0, double 0.25, double 8.0]
@names = private constant [2 x ptr] [ptr @one, ptr @two]
@given = external global i64
declare double @sin(double)
define internal i64 @one(i64 %a) noinline {
  %b = mul i64 %a, 3
  ret i64 %b
}
define internal i64 @two(i64 %a) noinline {
  %b = add i64 %a, 1000
  ret i64 %b
}
define i64 @entry(double %t, ptr %slab, ptr %words) {
  %k = load i64, ptr %words
  %weight_at = getelementptr [4 x double], ptr @weights, i64 0, i64 %k
  %weight = load double, ptr %weight_at
  %sine = call double @sin(double %t)
  %product = fmul double %weight, %sine
  store double %product, ptr %slab
  %which = and i64 %k, 1
  %function_at = getelementptr [2 x ptr], ptr @names, i64 0, i64 %which
  %function = load ptr, ptr %function_at
  %answer = call i64 %function(i64 %k)
  %more = load i64, ptr @given
  %sum = add i64 %answer, %more
  ret i64 %sum
}
"""


def test_constants_addresses_calls_and_what_is_elsewhere_are_found():
    number = ctypes.c_int64(70)
    address = elf.load(builtin.assemble(TEXT, TARGET), "entry", {"given": ctypes.addressof(number)})
    function = prebuilt.PROTOTYPE(address)
    slab, words = np.zeros(1), np.zeros(1, np.int64)
    for k, weight in enumerate((1.5, -2.0, 0.25, 8.0)):
        words[0] = k
        answer = function(0.3, slab.ctypes.data, words.ctypes.data)
        assert slab[0] == weight * math.sin(0.3)
        assert answer == (k + 1000 if k % 2 else 3 * k) + 70
    number.value = -5  # it is read where it is
    assert function(0.3, slab.ctypes.data, words.ctypes.data) == 1003 - 5


def test_code_lies_in_memory_as_it_was_compiled():
    from sheldrake.multibody.tree._kernels.kinematics import position_kinematics as kernel

    code = store.make(kernel, tell=False)
    own = elf.load(code, store.symbol_of(kernel), {})
    sections = elf._sections(code)
    text = max((s for s in sections if s.flags & elf._IN_MEMORY), key=lambda s: s.size)
    known = set(range(text.size))
    for s in sections:
        if s.kind == elf._RELOCATIONS:
            found = np.frombuffer(code, elf._RELOCATION, s.size // elf._RELOCATION.itemsize, s.offset)
            known -= {int(at) + i for at in found["at"] for i in range(4)}
    begin = elf._placed(sections)[0][sections.index(text)]
    base = own - next(
        begin + value for name, value, _ in zip(*elf._symbols(code, sections)) if name == store.symbol_of(kernel)
    )
    here = ctypes.string_at(base + begin, text.size)
    assert all(here[i] == code[text.offset + i] for i in known)  # all but what the linker writes


@pytest.mark.parametrize(
    "spoil, message",
    [
        (lambda code: code[:40], "no object file of 64 bits"),
        (lambda code: b"MZ" + code[2:], "no object file of 64 bits"),
        (lambda code: code[:18] + struct.pack("<H", 183) + code[20:], "no object file of x86-64"),
        (lambda code: code[:100], "no object file of x86-64"),
    ],
)
def test_other_files_are_refused(spoil, message):
    with pytest.raises(RuntimeError, match=message):
        elf.load(spoil(builtin.assemble(TEXT, TARGET)), "entry", {"given": 8})


def test_what_is_not_there_is_named():
    code = builtin.assemble(TEXT, TARGET)
    with pytest.raises(RuntimeError, match="a kernel needs given, which this process has not"):
        elf.load(code, "entry", {})
    with pytest.raises(RuntimeError, match=r"has no start; it has .*entry"):
        elf.load(code, "start", {"given": 8})


def test_memory_of_code_cannot_be_written():
    address = elf.load(builtin.assemble(TEXT, TARGET), "entry", {"given": 8})
    with open("/proc/self/maps", encoding="ascii") as file:
        rows = [line.split() for line in file]
    (rights,) = [r[1] for r in rows if int(r[0].split("-")[0], 16) <= address < int(r[0].split("-")[1], 16)]
    assert rights == "r-xp"
