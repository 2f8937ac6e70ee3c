"""SaveC: a diagram as a C library without heap, for any processor that LLVM knows."""

from __future__ import annotations

import json
import os
import pathlib
import re
import tempfile
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._native.target import Target
from sheldrake.common._text import untaken
from sheldrake.export._freeze import Freeze
from sheldrake.export._frozen import FrozenDiagram
from sheldrake.export._objects import require_compiler, write_objects, zig
from sheldrake.systems.framework import OutputPort

if TYPE_CHECKING:
    from os import PathLike


class Board(NamedTuple):
    """What a library is made for.

    Attributes:
        target: For the kernels.
        compiler: What compiles the rest there, with its options.
        has_system: Whether there is something that prints.
    """

    target: Target
    compiler: str
    has_system: bool = True


BOARDS = {
    "x86_64-linux": Board(Target("x86_64-unknown-linux-gnu", 1, "x86-64"), "cc"),
    "aarch64-linux": Board(Target("aarch64-unknown-linux-gnu", 1, "generic"), "aarch64-linux-gnu-gcc"),
    "riscv64-linux": Board(
        Target("riscv64-unknown-linux-gnu", 1, "generic-rv64", "+m,+a,+f,+d,+c", abi="lp64d"), "riscv64-linux-gnu-gcc"
    ),
    "thumbv7em-none-eabihf": Board(
        # With all four parts: of three, LLVM does not see that numbers are passed in registers for floating point.
        Target("thumbv7em-unknown-none-eabihf", 1, "cortex-m7", reloc="static"),
        "arm-none-eabi-gcc -mcpu=cortex-m7 -mthumb -mfloat-abi=hard -mfpu=fpv5-d16",
        has_system=False,
    ),
}


def SaveC(
    simulator: Any,
    folder: str | PathLike[str],
    *,
    target: str = "x86_64-linux",
    name: str = "",
    outputs: Iterable[OutputPort] = (),
) -> None:
    """Writes a diagram as a C library: header, source, static library of its kernels, an example, a Makefile.

    The library allocates nothing: its memory is one static array, and the header says how large. It calls libm, and
    memset, memcpy and memmove, and nothing else.

    Args:
        simulator: Of a diagram that `Freeze` takes; the library begins where it stands.
        folder: Where to; made if it is not there.
        target: "x86_64-linux", "aarch64-linux", "riscv64-linux", or "thumbv7em-none-eabihf" (a Cortex-M7: a processor
            with numbers in double precision).
        name: What all names in the header begin with; by default the diagram's name.
        outputs: Output ports beside those that the diagram exports.

    Raises:
        ValueError: something in the diagram is Python (see `Freeze`), or the target is unknown.
        ModuleNotFoundError: llvmlite or ziglang is not installed.
        OSError: a file can not be written.
    """
    if target not in BOARDS:
        raise ValueError(f"SaveC(): there is no target {target!r}; there are {', '.join(BOARDS)}.")
    require_compiler("SaveC()")
    frozen = Freeze(simulator, outputs)
    out = pathlib.Path(os.fspath(folder))
    out.mkdir(parents=True, exist_ok=True)
    library = _Library(frozen, identifier(name or frozen.name or "diagram"), target)
    with tempfile.TemporaryDirectory(prefix="sheldrake-") as temporary:
        objects = write_objects(frozen.description["functions"], BOARDS[target].target, pathlib.Path(temporary))
        archive = out / f"lib{library.name}.a"
        archive.unlink(missing_ok=True)
        zig("SaveC()", "ar", "rcsD", archive, *objects)
    for file, text in library.files().items():
        (out / file).write_text(text, encoding="ascii", newline="\n")


def identifier(name: str) -> str:
    """A name in C."""
    plain = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_").lower() or "x"
    return f"_{plain}" if plain[0].isdigit() else plain


def _comment(text: str) -> str:
    """Text that stays in its comment."""
    return json.dumps(text).strip('"').replace("*/", "* /").replace("/*", "/ *").replace("??/", "?? /")


class _Library:
    """The texts of a library."""

    def __init__(self, frozen: FrozenDiagram, name: str, target: str):
        self.about, self.name, self.target, self.board = frozen.description, name, target, BOARDS[target]
        self.words = np.frombuffer(frozen.image, np.int64)

    def files(self) -> dict[str, str]:
        """By name."""
        return {
            f"{self.name}.h": self._header(),
            f"{self.name}.c": self._source(),
            "main.c": self._main(),
            "Makefile": self._makefile(),
        }

    def _vectors(self) -> list[tuple[str, str, dict[str, Any]]]:
        """Kind, identifier and description of all that has a name."""
        found, taken = [], set[str]()
        for kind in ("states", "inputs", "parameters", "outputs"):
            single = kind.removesuffix("s")
            for vector in self.about[kind]:
                base = identifier(f"{vector['name']}_{single}" if kind in ("states", "outputs") else vector["name"])
                found.append((single, untaken(base, taken), vector))
        return found

    def _header(self) -> str:
        name, upper = self.name, self.name.upper()
        lines = [
            f"/* {_comment(self.about['name'] or name)}: a simulation as C, without heap.",
            "",
            f"   {8 * len(self.words)} bytes of memory beside the code. Needs libm, memset, memcpy and memmove.",
            "   For one thread at a time. Times are in seconds. */",
            "",
            f"#ifndef {upper}_H",
            f"#define {upper}_H",
            "",
            "#include <stdint.h>",
            "",
            "#ifdef __cplusplus",
            'extern "C" {',
            "#endif",
            "",
            "/* The beginning; must be called first, may be called again. */",
            f"void {name}_reset(void);",
            "",
            "/* Advances to a time; updates due just then stay pending. 0, or the status of what failed. */",
            f"int64_t {name}_advance_to(double time);",
            "",
            "/* The time that has been reached; and where it went wrong, after a failure. */",
            f"double {name}_time(void);",
            f"const char *{name}_failure(void);",
            "",
            "/* To be called when states, inputs or parameters were written. */",
            f"void {name}_changed(void);",
            "",
            "/* Brings outputs up to date; 0, or the status of what failed. */",
            f"int64_t {name}_compute_outputs(void);",
            "",
            f"typedef union {{ int64_t i; double d; }} {name}_word;",
            f"extern {name}_word {name}_memory[{len(self.words)}];",
        ]
        slab = self.about["memory"]["slab"]
        for kind, title, vector in self._vectors():
            elements = ", ".join(
                f"{element} [{unit}]" if unit else element for element, unit in zip(vector["elements"], vector["units"])
            )
            size = len(vector["elements"])
            lines += [
                "",
                f"/* {kind} {_comment(vector['name'])}: {_comment(elements)} */",
                f"#define {upper}_NUM_{title.upper()} {size}",
                f"#define {name}_{title} (&{name}_memory[{slab + vector['at']}].d)",
            ]
        for k, log in enumerate(self.about["logs"]):
            lines += ["", f"/* log {k} {_comment(log['name'])}: time, then {_comment(', '.join(log['elements']))} */"]
        lines += [
            "",
            "/* Is given what is logged, rows of time and values, if it is set; in the order of time. */",
            f"extern void (*{name}_samples)(int log, const double *rows, int num_rows, int num_columns);",
            "",
            "#ifdef __cplusplus",
            "}",
            "#endif",
            "",
            "#endif",
            "",
        ]
        return "\n".join(lines)

    def _source(self) -> str:
        return self._tables() + "\n" + self._calls()

    def _tables(self) -> str:
        """What is constant, and the memory."""
        about, name = self.about, self.name
        functions = about["functions"]
        pieces = runs(self.words)
        rows = ", ".join(map(str, about["rows"]))
        names = ",\n  ".join(json.dumps(row).replace("??", "?\\?") for row in about["row_names"]) or '""'
        fixups = ",\n  ".join(f"{{{at}, {to}, {absolute}}}" for at, to, absolute in about["fixups"])
        logs = ", ".join(f"{{{log['table']}, {len(log['elements']) + 1}}}" for log in about["logs"]) or "{0, 0}"
        return f"""#include "{name}.h"

/* Each kernel: time, memory from which offsets count, where its arguments are. */
typedef int64_t kernel(double, double *, int64_t *);
{"".join(f"kernel {f['symbol']};{chr(10)}" for f in functions)}
#if defined(__GNUC__)
__attribute__((aligned(64)))
#endif
{name}_word {name}_memory[{len(self.words)}];
void (*{name}_samples)(int, const double *, int, int);

static kernel *const kernels[] = {{{", ".join(f["symbol"] for f in functions)}}};
static const int16_t rows[] = {{{rows}}};
static const char *const row_names[] = {{
  {names}}};
static const struct {{ int32_t at, to, absolute; }} fixups[] = {{
  {fixups}}};
static const int32_t logs[][2] = {{{logs}}};
enum {{ NUM_LOGS = {len(about["logs"])}, NUM_ROWS = {len(about["rows"])}, NUM_NAMES = {len(about["row_names"])} }};

/* What memory begins with: {len(pieces)} runs of words that are not zero: where, how many, and they. */
static const int64_t image[] = {{
  {("," + chr(10) + "  ").join(", ".join(map(literal, (at, len(run), *run))) for at, run in pieces) or "0"}}};
enum {{ IMAGE = {sum(2 + len(run) for _, run in pieces)} }};
"""

    def _calls(self) -> str:
        """The functions of the header."""
        about, name = self.about, self.name
        advance, outputs, words = about["calls"]["advance"], about["calls"]["refresh_outputs"], about["words"]
        return f"""void {name}_reset(void) {{
  {name}_word *m = {name}_memory;
  for (int32_t i = 0; i < {len(self.words)}; ++i) m[i].i = 0;
  for (int32_t i = 0; i < IMAGE;) {{
    const int64_t *run = image + i;
    for (int32_t k = 0; k < run[1]; ++k) m[run[0] + k].i = run[2 + k];
    i += 2 + (int32_t)run[1];
  }}
  int64_t base = (int64_t)(intptr_t)m;
  for (uint32_t i = 0; i < sizeof fixups / sizeof *fixups; ++i)
    m[fixups[i].at].i = fixups[i].absolute ? base + fixups[i].to : (base + fixups[i].to) / 8;
  for (int32_t r = 0; r < NUM_ROWS; ++r)
    if (rows[r] >= 0) m[{about["memory"]["table"]} + r].i = (int64_t)(intptr_t)kernels[rows[r]];
}}

static void take_samples(void) {{
  {name}_word *m = {name}_memory;
  for (int k = 0; k < NUM_LOGS; ++k) {{
    {name}_word *table = m + logs[k][0];
    if (table[2].i && {name}_samples)
      {name}_samples(k, &m[{about["memory"]["log"]} + table[0].i].d, (int)table[2].i, logs[k][1]);
    table[2].i = 0;
  }}
}}

int64_t {name}_advance_to(double time) {{
  {name}_word *m = {name}_memory;
  m[{words["fresh"]}].i = 1;
  m[{words["t_break"]}].d = time + 1e300;
  for (;;) {{
    m[{words["budget"]}].i = 1 << 30;
    m[{advance["words"] + advance["numbers"]["T"]}].d = time;
    int64_t code = kernels[{advance["function"]}](0.0, 0, &m[{advance["words"]}].i);
    if (code == 2) take_samples(); /* a log is full */
    else if (code == 1) return m[{words["status"]}].i;
    else if (code != 3) break;
  }}
  take_samples();
  return 0;
}}

double {name}_time(void) {{ return {name}_memory[{about["memory"]["slab"]}].d; }}

const char *{name}_failure(void) {{
  int64_t row = {name}_memory[{words["row"]}].i;
  return row >= 0 && row < NUM_NAMES ? row_names[row] : "the integrator";
}}

void {name}_changed(void) {{
  for (int k = 0; k < 3; ++k) {name}_memory[{words["constant"]} + k].i += 1;
}}

int64_t {name}_compute_outputs(void) {{
  return kernels[{outputs["function"]}](0.0, 0, &{name}_memory[{outputs["words"]}].i);
}}
"""

    def _main(self) -> str:
        name = self.name
        states = [(t, len(v["elements"])) for kind, t, v in self._vectors() if kind == "state"]
        if not self.board.has_system:
            return f"""#include "{name}.h"

int main(void) {{
  {name}_reset();
  for (int k = 1; k <= 1000; ++k)
    if ({name}_advance_to(k * 1e-3)) return 1;
  return 0;
}}
"""
        prints = "\n".join(
            f'  for (int i = 0; i < {size}; ++i) printf(" %.17g", {name}_{title}[i]);' for title, size in states
        )
        return f"""#include <stdio.h>
#include <stdlib.h>

#include "{name}.h"

/* Advances to the times that are given, and prints the states there. */
int main(int argc, char **argv) {{
  {name}_reset();
  for (int k = 1; k < argc; ++k) {{
    int64_t status = {name}_advance_to(atof(argv[k]));
    if (status) {{
      fprintf(stderr, "%s failed with status %lld\\n", {name}_failure(), (long long)status);
      return 1;
    }}
    printf("%.17g", {name}_time());
{prints}
    printf("\\n");
  }}
  return 0;
}}
"""

    def _makefile(self) -> str:
        name = self.name
        return f"""# For {self.target}: make, or make CC="..." with another compiler.
ifeq ($(origin CC),default)
CC = {self.board.compiler}
endif
CFLAGS ?= -O2

{name}: main.c {name}.c {name}.h lib{name}.a
\t$(CC) $(CFLAGS) -std=c99 -o $@ main.c {name}.c -L. -l:lib{name}.a -lm
"""


def runs(words: np.ndarray) -> list[tuple[int, list[int]]]:
    """Words that are not zero, in runs that may bridge short gaps: where each begins, and its words."""
    places = np.flatnonzero(words)
    if not len(places):
        return []
    pieces = np.split(places, np.flatnonzero(np.diff(places) > 3) + 1)
    return [(int(p[0]), words[p[0] : p[-1] + 1].tolist()) for p in pieces]


def literal(word: int) -> str:
    """A word as C has it."""
    return "INT64_MIN" if word == -(2**63) else f"{word}LL" if abs(word) >= 2**31 else str(word)
