"""Random kernels against what the language's page says of them: `python tools/fuzz_kernels.py --programs 10000`.

Each program has all the grammar to choose from (`docs/kernels.md`) and edges as operands: 0, -1, the ends of 64 bits,
signed zeros, denormals, infinities, NaN. It runs three ways on the same memory: by `kernel_oracle`, compiled with
`strict=True`, and, as long as the page says that nothing differs, as plain Python. Status and memory must be equal bit
for bit; only one NaN is as good as another. Functions of libm are libm's in all three, so that they are equal as well,
but for powers of 2**n and the like, which LLVM may write in another way: a program that takes one is run, not compared.
Nested minima or maxima that share a number may keep a NaN that they should lose (LLVM takes the inner one for the
whole): a program that differs is compared with this too, and counted.

There are four sorts of programs: on numbers for which plain Python does the same; on floats; on floats with bounds
checks and indices that leave their arrays (status INDEX_ERROR, and what was stored until then); on complex numbers
(`kernel.on_complex`). Many programs share a module; every fourth is compiled with vectors and unrolled loops.

What differs is printed with its source, and the status is 1. 10 000 programs take some 8 minutes of one processor.
"""

from __future__ import annotations

import argparse
import contextlib
import copy
import linecache
import os
import random
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Annotated, Any, NamedTuple

import numpy as np
from tools.kernel_oracle import HIGH, LOW, Oracle, OutOfBounds

from sheldrake.common import record
from sheldrake.common._native import lower, store
from sheldrake.common._native.prebuilt import PROTOTYPE
from sheldrake.common._native.target import host
from sheldrake.common.kernel import INDEX_ERROR, IntMatrix, IntVector, Matrix, Vector

SORTS = ("plain", "float", "bounds", "complex")
BATCH = 40  # programs of a module


class Law(record.Record):
    """A row of everything."""

    k = record.number("number")
    V = record.numbers((3, 3), "tuple of tuples")
    m = record.numbers((1, 3), "number and tuple")
    w = record.array((2, 2), "array of two axes")
    s = record.array(3, "array of one axis")
    c = record.number("the same", same_as=k)
    rest = record.array(..., "what follows")


class Tree(record.Record):
    """Integers."""

    first = record.integer("integer")
    pair = record.integers(2, "tuple")
    ids = record.array(2, "array", dtype=int)


class Pair(record.Record):
    """Another view of the same rows."""

    a = record.integer("integer")
    b = record.integer("integer")


class Options(record.Record):
    """There is one."""

    dt = record.number("number")
    nodes = record.array(3, "array")
    tup = record.numbers(2, "tuple")


class Flags(record.Record):
    """There is one, of integers."""

    mode = record.integer("integer")
    two = record.integers(2, "tuple")


class Stacked(record.Stack):
    """Rows by name."""

    q = record.vector("vector")
    dq = record.vector("vector")


@record.table
class Table(NamedTuple):
    """All there is in tables."""

    law: Annotated[Matrix, Law]
    J: Annotated[Matrix, record.Each(2)]
    option: Annotated[Vector, Options]
    flag: Annotated[IntVector, Flags]
    tree: Annotated[IntMatrix, record.Items("trees", Tree), record.Items("pairs", Pair)]
    x: Annotated[Matrix, Stacked]


VIEW = record.view_of(Options)


class Both(NamedTuple):
    """A NamedTuple of numbers."""

    x: float
    n: int


HEAD = """
import math
import numpy as np
from sheldrake.common._kernels.generic import (
    acos, asin, atan, atan2, clip, cos, cosh, exp, floor, has_slopes, is_finite, is_positive, is_zero, log, mul_add,
    sin, sinh, sqrt, tan, tanh, value_of, whole)
from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector, Vectors, kernel
LOW, HIGH, INF, NAN, TINY = -(2**63), 2**63 - 1, math.inf, math.nan, 5e-324
FEW, REAL, PAIRS = (3, -1, 64), (0.5, -0.0, 1e300), ((1, 2.0), (-3, 0.25))

def scaled_by(factor):
    @kernel(strict=True)
    def scaled(w):
        return w * factor
    return scaled

@kernel(strict=True)
def twice(f, w):
    return f(f(w))

@kernel(strict=True, outline=True)
def summed(f, g, w0, w1) -> float:
    total = 0.0
    for i in range(3):
        total += f(w0, w1) - g(float(i))
    return total

@kernel(strict=True)
def at_least(w):
    g = max
    w = g(w, -2.0)
    return w

@kernel(strict=True)
def counted(first, last):
    i = first
    while i < last:
        if i % 3 != 1:
            yield i
        i += 1

@kernel
def forward(first, last):
    if first > 2:
        return
    yield from counted(first, last)

@kernel(strict=True)
def below(w):
    yield from range(w % 4, -1, -1)

@kernel(strict=True)
def places(x):
    for i in below(len(x) - 1):
        for j in counted(0, i):
            if x[j] > 1e18:
                return
            yield j, x[i]

@kernel(strict=True)
def signed(w0, w1):
    return math.copysign(w0, w1) if w1 == w1 else w0

half, shrunk = scaled_by(0.5), scaled_by(0.75)
"""
PARAMETERS = (
    "t: float, table: Table, one: Options, x: Vector, A: Matrix, n: IntVector, N: IntMatrix, u: Vectors, a: float, "
    "k: int"
)
NAMES = "t, table, one, x, A, n, N, u, a, k"
INTS = (0, 1, -1, 2, 3, -2, 5, 7, -7, 63, 64, 65, -64, 2**31, 2**53 + 1, -(2**53) - 1, 2**62, HIGH, LOW, LOW + 1)
REALS = (0.0, -0.0, 1.0, -1.0, 0.5, -2.5, 3.0, 1e-3, 1e16, 2.0**63, -(2.0**63), 1e19, 1e300, -1e300, 1e-300, 5e-324,
         -5e-324, 2.2250738585072014e-308, float("inf"), -float("inf"), float("nan"))  # fmt: skip
TAME_INTS, TAME_REALS = ("0", "1", "-1", "2", "3", "7", "-7", "63"), ("1.0", "-1.0", "0.5", "-2.5", "3.0", "0.125")
INT_TEXTS = ("0", "1", "-1", "2", "3", "7", "-7", "63", "64", "-64", "2147483648", "9007199254740993", "HIGH", "LOW")
REAL_TEXTS = ("0.0", "-0.0", "1.0", "-1.0", "0.5", "-2.5", "3.0", "1e16", "9223372036854775808.0", "1e19", "1e300",
              "1e-300", "TINY", "INF", "-INF", "NAN", "math.pi")  # fmt: skip


class Given(NamedTuple):
    """Arguments of a program; a Record is a vector, which Python sees by its names."""

    t: float
    table: Table
    one: np.ndarray
    x: np.ndarray
    A: np.ndarray
    n: np.ndarray
    N: np.ndarray
    u: tuple[np.ndarray, ...]
    a: float
    k: int

    def seen(self) -> list[Any]:
        """As a kernel of Python sees them."""
        return [VIEW(a) if a is self.one else a for a in self]

    def arrays(self) -> list[np.ndarray]:
        """All memory."""
        return [*self.table, self.one, self.x, self.A, self.n, self.N, *self.u]


def memory(rng: np.random.Generator, is_complex: bool, tame: bool) -> Given:
    """Arguments: numbers of all sizes, edges among them unless they are to be tame."""

    def real(*shape: int) -> np.ndarray:
        values = rng.normal(size=shape) * (1.0 if tame else 10.0 ** rng.integers(-3, 4, shape))
        if not tame:
            values = np.where(rng.random(shape) < 0.3, rng.choice(REALS, shape), values)
        slopes = rng.normal(size=shape) * 1e-30 if rng.random() < 0.5 else rng.normal(size=shape)
        return values + 1j * slopes if is_complex else values

    def whole(*shape: int) -> np.ndarray:
        values = rng.integers(-20, 20, shape)
        return values if tame else np.where(rng.random(shape) < 0.3, rng.choice(np.array(INTS), shape), values)

    def one(values: np.ndarray) -> Any:
        return values.real[0].item()

    with np.errstate(all="ignore"):
        table = Table(real(3, 22), real(6, 2), real(6), whole(3), whole(3, 5), real(2, 4))
        return Given(
            one(real(1)), table, real(6), real(5), real(3, 4), whole(6), whole(2, 3), (real(3), real(2)), one(real(1)),
            int(whole(1)[0]),
        )  # fmt: skip


# ---- programs


class Expression(NamedTuple):
    """A text, and whether its value is known to the compiler: integers that are known must not overflow."""

    text: str
    known: bool = False


Kind = Any
"""b, i, f, c, or a tuple of kinds; a `Both` is "B"."""


class Helper(NamedTuple):
    """A kernel of a program."""

    name: str
    kinds: tuple[Kind, ...]
    returns: Kind
    is_leaf: bool  # whether it calls none of the program's kernels, nor `twice`, which may not call itself


class Program:
    """Writes one random kernel and those that it calls."""

    def __init__(self, rng: random.Random, number: int, sort: str) -> None:
        self.rng, self.number, self.sort = rng, number, sort
        self.count = 0
        self.lines: list[str] = []
        self.helpers: list[Helper] = []
        self.yields: list[Helper] = []
        self.used: Counter[str] = Counter()
        self.item = "c" if sort == "complex" else "f"
        self.wild = sort != "plain"  # whether numbers and operations may be such that Python does something else
        self.texts = [self._helper(i) for i in range(rng.choice((0, 1, 2, 3)))]
        self.name = f"p{number}"
        self.texts.append(self._main())

    def text(self) -> str:
        """The source."""
        return "\n".join(self.texts)

    def _pick(self, **weights: float) -> str:
        """One of some names by weight."""
        name = self.rng.choices(list(weights), list(weights.values()))[0]
        self.used[name] += 1
        return name

    def _chance(self, p: float) -> bool:
        return self.rng.random() < p

    def _new(self, kind: Kind) -> str:
        self.count += 1
        return f"{'z' if kind == 'c' else 'v'}{self.count}"

    # ---- functions

    def _begin(self, variables: dict[str, Kind]) -> None:
        self.lines, self.indent, self.loops = [], 1, 0
        self.scope: list[dict[str, Kind]] = [variables]
        self.known: set[str] = set()
        self.fixed: set[str] = set()
        self.has_memory = False
        self.returns: Kind = "i"

    def _main(self) -> str:
        self._begin({"t": "f", "a": "f", "k": "i"})
        self.has_memory = True
        if self._chance(0.3):
            self._say('"""About a program."""')
        for _ in range(self.rng.randint(2, 4)):
            self._declare(self.rng.choice(("i", "f", "f", "b", self.item)))
        self._statements(self.rng.randint(4, 11))
        if self._chance(0.8):
            self._say(f"return {self._of('i', 2).text}")
        else:
            self._say("return 0")
        return "\n".join(
            ["@kernel(strict=True, outline=True)", f"def {self.name}({PARAMETERS}) -> int:", *self.lines, ""]
        )

    def _helper(self, i: int) -> str:
        kinds: tuple[Kind, ...] = tuple(
            self.rng.choice(("i", "f", "f", "b", ("f", "f", "f"), ("i", "f"), "x", "n", "row", "tree", self.item))
            for _ in range(self.rng.randint(1, 3))
        )
        if not self.wild:
            kinds = tuple("f" if kind == "b" else kind for kind in kinds)
        returns = self.rng.choice(("f", "f", "i", "b", ("f", "f"), None, self.item, ("i", ("f", "f"))))
        name = f"h{self.number}_{i}"
        parameters = [f"{'z' if kind == 'c' else 'w'}{j}" for j, kind in enumerate(kinds)]
        self._begin(dict(zip(parameters, kinds)))
        yields = self._chance(0.25) and not isinstance(returns, tuple) and returns is not None
        self.returns = None if yields else returns
        if yields:
            self._yield(returns)
        elif self._chance(0.4) and returns is not None:
            self._say(f"return {self._of(returns, 3).text}")
        else:
            self._declare(self.rng.choice(("i", "f", self.item)))
            self._statements(self.rng.randint(1, 4))
            if returns is not None:
                self._say(f"return {self._of(returns, 2).text}")
        options = self.rng.choice(("", ", outline=True"))
        is_leaf = not any("twice(" in line or f"h{self.number}_" in line for line in self.lines)
        (self.yields if yields else self.helpers).append(Helper(name, kinds, returns, is_leaf))
        notes = {"f": " -> float", "i": " -> int", "b": " -> bool", "c": " -> complex"}
        note = "" if yields else notes.get(str(returns), "")
        return "\n".join(
            [f"@kernel(strict=True{options})", f"def {name}({', '.join(parameters)}){note}:", *self.lines, ""]
        )

    def _yield(self, kind: Kind) -> None:
        """The body of a kernel that loops go over."""
        self._declare("f")
        name = self._new("i")
        self._say(f"for {name} in range({self.rng.choice(('3', '2, 0, -1', '1, 6, 2'))}):")
        self.fixed.add(name)
        self.scope.append({name: "i"})
        self.indent, self.loops = 2, 1
        self._statements(self.rng.randint(0, 2))
        self._say(f"yield {self._of(kind, 2).text}")
        self._statements(self.rng.randint(0, 2))
        self.scope.pop()
        self.indent, self.loops = 1, 0

    def _say(self, line: str) -> None:
        self.lines.append("    " * self.indent + line)

    # ---- statements

    def _statements(self, number: int) -> None:
        for _ in range(number):
            self._statement()

    def _statement(self) -> None:
        deep = self.indent >= 4
        loop = 0.0 if self.loops >= 2 or deep else 1.0
        name = self._pick(
            declare=1.5, assign=2.0, augment=2.5, store=3.0 * self.has_memory, branch=0.0 if deep else 2.0,
            count=1.2 * loop, yielded=0.8 * loop, of_own=0.5 * loop * bool(self.yields), turns=0.8 * loop,
            forever=0.5 * loop, each=0.9 * loop, each_pair=0.4 * loop, leave=0.6 if self.loops else 0.0,
            early=0.25 if self.indent > 1 else 0.0, unpack=1.0, chain=0.4, idle=0.1,
            call=0.7 if self.helpers else 0.0, rows=3.0 * self.has_memory, text=0.1, swap=0.4,
        )  # fmt: skip
        getattr(self, f"_write_{name}")()

    def _inside(self, number: int, loop: bool = False, variables: dict[str, Kind] | None = None) -> None:
        self.indent += 1
        self.loops += loop
        self.scope.append(variables or {})
        self._statements(number)
        self.scope.pop()
        self.loops -= loop
        self.indent -= 1

    def _declare(self, kind: Kind) -> str:
        narrow = kind == "c" and self._chance(0.2)
        name, value = self._new(kind), self._of("f" if narrow else kind, 2)
        note = {"f": ": float", "i": ": int"}.get(str(kind), "") if self._chance(0.15) else ""
        self._say(f"{name}{note} = {value.text}")
        if narrow:
            self._say(f"{name} += {self._of('c', 1).text}")
        if value.known:
            self.known.add(name)
        self.scope[-1][name] = kind
        return name

    def _write_declare(self) -> None:
        self._declare(self.rng.choice(("i", "f", "b", self.item, ("f", "f"), ("i", "f"), ("f", ("i", "f")), "B", "c")))

    def _variable(self, *kinds: Kind) -> str | None:
        """A variable that may be stored into."""
        names = [v for s in self.scope for v, k in s.items() if k in kinds and v not in self.fixed]
        return self.rng.choice(names) if names else None

    def _kind_of(self, name: str) -> Kind:
        return next(s[name] for s in reversed(self.scope) if name in s)

    def _write_assign(self) -> None:
        if (name := self._variable("i", "f", "b", "c", ("f", "f"), ("i", "f"), "B", ("f", ("i", "f")))) is None:
            return self._write_declare()
        kind = self._kind_of(name)
        kind = "i" if kind == "f" and self._chance(0.15) else "f" if kind == "c" and self._chance(0.2) else kind
        kind = ("f", "i") if kind == ("f", "f") and self._chance(0.3 * self.wild) else kind
        self._say(f"{name} = {self._of(kind, 3).text}")

    def _write_augment(self) -> None:
        if (name := self._variable("i", "f", "c")) is not None:
            self._augment(name, self._kind_of(name))

    def _augment(self, place: str, kind: Kind) -> None:
        value = self._of("i" if kind == "f" and self._chance(0.15 * self.wild) else kind, 2)
        if kind == "i":
            op = self.rng.choice(("+", "-", "*", "//", "%", "<<", ">>", "&", "|", "^") if self.wild else "+-&|^")
            value = Expression(f"({value.text} + k * 0)") if value.known and self.has_memory else value
            if value.known:
                op = self.rng.choice("&|^")
        elif kind == "f":
            op = self.rng.choice(("+", "-", "*", "/", "//", "%", "**") if self.wild else "+-*")
            if op == "**":
                value = Expression(self.rng.choice(("0", "2", "3", self._simple_int(), self._some_float())))
        else:
            op = self.rng.choice("+-*/")
        self.used[f"augmented {kind} {op}"] += 1
        self._say(f"{place} {op}= {value.text}")

    def _write_store(self) -> None:
        place, kind = self._place()
        if self._chance(0.5):
            return self._augment(place, kind)
        self._say(f"{place} = {self._of('i' if kind == 'f' and self._chance(0.1) else kind, 3).text}")

    def _place(self) -> tuple[str, Kind]:
        """An item of an array."""
        name = self._pick(x=3, n=2, A=2, N=1, u=1)
        f = self.item
        return {
            "x": lambda: (f"x[{self._index('x.shape[0]', 5)}]", f),
            "n": lambda: (f"n[{self._index('len(n)', 6)}]", "i"),
            "A": lambda: (f"A[{self._index('A.shape[0]', 3)}, {self._index('A.shape[1]', 4)}]", f),
            "N": lambda: (f"N[{self._index('len(N)', 2)}, {self._index('N.shape[1]', 3)}]", "i"),
            "u": lambda: (f"u[{self._index('len(u)', 2)}][{self._index('2', 2)}]", f),
        }[name]()  # type: ignore[no-any-return]

    def _index(self, length: str, number: int) -> str:
        """An index into an array of this length; sometimes out of it, where that is tested."""
        if self.sort == "bounds" and self._chance(0.04):
            return self.rng.choice((str(number), str(number + 7), "HIGH", self._simple_int()))
        if self._chance(0.5):
            return str(self.rng.randrange(number))
        counters = [v for s in self.scope for v, k in s.items() if k == "i" and v in self.fixed]
        if counters and self._chance(0.6):
            return f"{self.rng.choice(counters)} % {length}"
        return f"{self._simple_int()} % {length}"

    def _write_rows(self) -> None:
        f = self.item
        i, j = self._index("3", 3), self._index("len(table.trees)", 3)
        row, tree = f"table[{i}]", f"table.trees[{j}]"
        if self._chance(0.5):
            row, tree = self._new("row"), self._new("tree")
            self._say(f"{row} = table[{i}]")
            self._say(f"{tree} = table.trees[{j}]")
            self.scope[-1] |= {row: "row", tree: "tree"}
            self.fixed |= {row, tree}
        self._row_statement(row, tree)
        if self._chance(0.3):
            place, kind = self.rng.choice((
                ("table.dt", f), ("one.dt", f), ("one.nodes[0]", f), ("one.tup", (f, f)),
                ("table.flag[0]", "i"), ("table.mode", "i"), ("table.nodes[2]", f),
                (f"table.q[{self._index('4', 4)}]", f), ("table.dq[1]", f), ("table.tup", (f, f)),
                (f"table.pairs[{self._index('3', 3)}].b", "i"), ("table.two", ("i", "i")),
            ))  # fmt: skip
            if isinstance(kind, tuple) or self._chance(0.5):
                self._say(f"{place} = {self._of(kind, 2).text}")
            else:
                self._augment(place, kind)

    def _row_statement(self, row: str, tree: str) -> None:
        f = self.item
        places: list[tuple[str, Kind]] = [
            (f"{row}.k", f), (f"{row}.c", f), (f"{row}.V", ((f, f, f), (f, f, f))), (f"{row}.m", (f, (f, f, f))),
            (f"{row}.w[1, {self._index('2', 2)}]", f), (f"{row}.s[{self._index('3', 3)}]", f),
            (f"{row}.rest[{self._index(f'len({row}.rest)', 4)}]", f),
            (f"{tree}.first", "i"), (f"{tree}.pair", ("i", "i")), (f"{tree}.ids[1]", "i"),
        ]  # fmt: skip
        if self.has_memory:
            places.append((f"{row}.J[{self._index('2', 2)}, 1]", f))
        for place, kind in self.rng.sample(places, 2):
            self.used[f"field {place.rpartition('.')[2].partition('[')[0]}"] += 1
            if not isinstance(kind, tuple) and self._chance(0.5):
                self._augment(place, kind)
            else:
                self._say(f"{place} = {self._of(kind, 2).text}")

    def _write_branch(self) -> None:
        self._say(f"if {self._condition(2)}:")
        self._inside(self.rng.randint(1, 3))
        if self._chance(0.3):
            self._say(f"elif {self._condition(1)}:")
            self._inside(self.rng.randint(1, 2))
        if self._chance(0.5):
            self._say("else:")
            self._inside(self.rng.randint(1, 2))

    def _write_count(self) -> None:
        name = self._new("i")
        few = f"{self._simple_int()} % 5"
        bounds = self.rng.choice((
            "3", few, f"1, {few}", f"{few}, -1, -1", f"0, {few}, 2", f"7, {few}, -3", "LOW, HIGH, 4611686018427387904",
            "HIGH, LOW, -4611686018427387904", "HIGH - k % 3, HIGH", "LOW + 2, LOW, -1", "5, 5", "3, -4, 2",
            "HIGH - 5, HIGH, 4", "True, 3", "LOW + 1, LOW + 4, 2", "LOW, HIGH, HIGH",
        ) if self.has_memory and self.wild else ("3", few, f"{few}, -1, -2", "5, 5", "7, -2, -3"))  # fmt: skip
        self._say(f"for {name} in range({bounds}):")
        self.fixed.add(name)
        self._inside(self.rng.randint(1, 3), True, {name: "i"})

    def _write_yielded(self) -> None:
        name, few = self._new("i"), f"{self._simple_int()} % 5"
        over = [f"counted({few}, {self._simple_int()} % 7)", f"forward({few}, 5)", f"below({self._simple_int()})"]
        kinds: dict[str, Kind] = {name: "i"}
        target = name
        if self.has_memory and self._chance(0.4):
            other = self._new(self.item)
            over, target = ["places(x)", "places(table.nodes)"], f"{name}, {other}"
            kinds[other] = self.item
        self._say(f"for {target} in {self.rng.choice(over)}:")
        self.fixed |= {*kinds}
        self._inside(self.rng.randint(1, 3), True, kinds)

    def _write_of_own(self) -> None:
        helper = self.rng.choice(self.yields)
        if (call := self._call(helper, 2)) is None:
            return self._say("pass")
        name = self._new(helper.returns)
        self._say(f"for {name} in {call}:")
        self.fixed.add(name)
        self._inside(self.rng.randint(1, 3), True, {name: helper.returns})

    def _write_turns(self) -> None:
        name = self._new("i")
        self._say(f"{name} = 0")
        self.fixed.add(name)
        self.scope[-1][name] = "i"
        self._say(f"while {name} < {self.rng.randint(1, 4)}{self.rng.choice(('', f' and {self._condition(1)}'))}:")
        self.indent += 1
        self._say(f"{name} += 1")
        self.indent -= 1
        self._inside(self.rng.randint(1, 3), True)

    def _write_forever(self) -> None:
        name = self._new("i")
        self._say(f"{name} = 0")
        self.fixed.add(name)
        self.scope[-1][name] = "i"
        self._say(self.rng.choice(("while True:", "while 1:")))
        self.indent += 1
        self._say(f"{name} += 1")
        if self._chance(0.5):
            self._say(f"if {name} > 3:")
            self._say("    break")
        else:
            self._say(f"if {name} < 3 and {self._condition(1)}:")
            self._say("    continue")
            self._say("elif True:")
            self._say("    break")
        self.indent -= 1
        self._inside(self.rng.randint(1, 2), True)

    def _write_each(self) -> None:
        kind = self.rng.choice(("i", "f", self.item))
        name = self._new(kind)
        items = [self._of(kind, 1).text for _ in range(self.rng.randint(1, 3))]
        texts = {"i": "FEW", "f": "REAL"} if self._chance(0.2) else {}
        self._say(f"for {name} in {texts.get(kind, '(' + ', '.join(items) + ',)')}:")
        self.fixed.add(name)
        self._inside(self.rng.randint(1, 3), True, {name: kind})

    def _write_each_pair(self) -> None:
        one, other = self._new("i"), self._new("f")
        pairs = ", ".join(f"({self._of('i', 1).text}, {self._of('f', 1).text})" for _ in range(2))
        self._say(f"for {one}, {other} in {self.rng.choice((f'({pairs})', 'PAIRS'))}:")
        self.fixed |= {one, other}
        self._inside(self.rng.randint(1, 2), True, {one: "i", other: "f"})

    def _write_leave(self) -> None:
        self._say(f"if {self._condition(1)}:")
        self._say(f"    {self.rng.choice(('break', 'continue'))}")

    def _write_early(self) -> None:
        self._say(f"if {self._condition(1)}:")
        self._say(f"    return {self._of(self.returns, 1).text}" if self.returns is not None else "    return")

    def _write_unpack(self) -> None:
        f = self.rng.choice(("f", self.item))
        one, two, three = self._new(f), self._new("i"), self._new(f)
        kind: Kind = (f, ("i", f)) if self._chance(0.5) else (f, "i", f)
        target = f"{one}, ({two}, {three})" if len(kind) == 2 else f"{one}, {two}, {three}"
        self._say(f"{target} = {self._of(kind, 2).text}")
        self.scope[-1] |= {one: f, two: "i", three: f}
        self.known.add(two)

    def _write_swap(self) -> None:
        f = self.item
        if self.has_memory and self._chance(0.5):
            i, j = self._index("5", 5), self._index("5", 5)
            self._say(f"x[{i}], x[{j}] = {self._of((f, f), 1).text}")
            return
        one, two = self._variable(f), self._variable(f)
        if one is not None and one != two:
            self._say(f"{one}, {two} = {two}, {one}")
        else:
            self._say("pass")

    def _write_chain(self) -> None:
        one, two = self._new("f"), self._new("f")
        value = self._of("f", 2)
        self._say(f"{one} = {two} = {value.text}")
        self.scope[-1] |= {one: "f", two: "f"}

    def _write_idle(self) -> None:
        self._say("pass")

    def _write_text(self) -> None:
        self._say(self.rng.choice(('"a text alone"', "...", "3")))

    def _write_call(self) -> None:
        helper = self.rng.choice(self.helpers)
        self._say(self._call(helper, 2) or "pass")

    # ---- expressions

    def _call(self, helper: Helper, depth: int) -> str | None:
        given = [self._argument(kind, depth - 1) for kind in helper.kinds]
        return None if None in given else f"{helper.name}({', '.join(map(str, given))})"

    def _argument(self, kind: Kind, depth: int) -> str | None:
        if kind in ("row", "tree", "x", "n"):
            names = [v for s in self.scope for v, k in s.items() if k == kind]
            if not self.has_memory:
                return self.rng.choice(names) if names else None
            return {
                "row": f"table[{self._index('3', 3)}]", "tree": f"table.trees[{self._index('3', 3)}]", "n": "n",
                "x": self.rng.choice(("x", "u[0]", "table.q", "table.nodes", "table[1].s", "table.option")),
            }[kind] if not names or self._chance(0.7) else self.rng.choice(names)  # fmt: skip
        return self._unknown("i", depth) if kind == "i" else self._of(kind, depth).text

    def _of(self, kind: Kind, depth: int) -> Expression:
        """An expression of a kind."""
        if kind == "B":
            names = [v for s in self.scope for v, k in s.items() if k == "B"]
            if names and self._chance(0.3):
                return Expression(self.rng.choice(names))
            return Expression(f"Both({self._of('f', depth - 1).text}, {self._of('i', depth - 1).text})")
        if isinstance(kind, tuple):
            return self._tuple_of(kind, depth)
        calls = [h for h in self.helpers if h.returns == kind]
        if depth > 1 and calls and self._chance(0.15):
            if (call := self._call(self.rng.choice(calls), depth)) is not None:
                self.used["call"] += 1
                return Expression(call)
        if depth > 1 and self._chance(0.06):
            one, other = self._of(kind, depth - 1), self._of(kind, depth - 1)
            self.used["choice"] += 1
            return Expression(f"({one.text} if {self._condition(depth - 1)} else {other.text})")
        return {"b": self._of_bool, "i": self._of_int, "f": self._of_float, "c": self._of_complex}[kind](depth)

    def _tuple_of(self, kind: tuple, depth: int) -> Expression:
        names = [v for s in self.scope for v, k in s.items() if k == kind]
        calls = [h for h in self.helpers if h.returns == kind]
        if names and self._chance(0.4):
            return Expression(self.rng.choice(names))
        if (
            calls
            and depth > 0
            and self._chance(0.4)
            and (call := self._call(self.rng.choice(calls), depth)) is not None
        ):
            return Expression(call)
        f = self.item
        fields = {((f, f, f), (f, f, f)): "table[1].V", (f, (f, f, f)): "table[2].m", (f, f): "table.tup",
                  ("i", "i"): "table.two"}  # fmt: skip
        if self.has_memory and kind in fields and self._chance(0.3):
            return Expression(fields[kind])
        if depth > 1 and self._chance(0.1):
            one, other = self._tuple_of(kind, 0), self._tuple_of(kind, 0)
            return Expression(f"({one.text} if {self._condition(1)} else {other.text})")
        return Expression("(" + ", ".join(self._of(k, depth - 1).text for k in kind) + ",)")

    def _leaf(self, kind: str) -> Expression:
        names = [v for s in self.scope for v, k in s.items() if k == kind]
        if names and self._chance(0.55):
            name = self.rng.choice(names)
            return Expression(name, kind == "i" and name in self.known)
        if self.has_memory and self._chance(0.5):
            f = self.item
            found = {
                "f": () if f == "c" else ("", "table.dt", "one.dt", "one.nodes[1]", "one.tup[0]",
                    "table[1].k", "table[0].V[1][2]", "u[1][0]",
                    "table.q[2]", "table[2].rest[3]", "table[0].J[1, 0]", "table[0].m[0]"),
                "c": () if f == "f" else ("", "table.dt", "one.dt", "one.nodes[1]", "one.tup[0]",
                    "table[1].k", "table[0].V[1][2]", "u[1][0]",
                    "table.q[2]"),
                "i": ("", "len(x)", "A.shape[1]", "table.trees[1].first", "table.mode", "len(u)",
                    "table.trees[2].pair[1]", "table.pairs[0].a", "len(table.trees)", "N.shape[0]",
                    "len(table[0].rest)"),
                "b": (),
            }[kind]  # fmt: skip
            if found:
                return Expression(self.rng.choice(found) or self._place_of(kind))
        tuples = [(v, k) for s in self.scope for v, k in s.items() if isinstance(k, tuple) and kind in k]
        if tuples and self._chance(0.5):
            name, items = self.rng.choice(tuples)
            i = self.rng.choice([j for j, k in enumerate(items) if k == kind])
            if len(set(items)) == 1 and kind in "fi" and self._chance(0.5):
                self.used["tuple at run time"] += 1
                outside = self.sort == "bounds" and self._chance(0.05)
                index = self._simple_int() + ("" if outside else f" % {len(items)}")
                return Expression(f"{name}[{index}]", kind == "i")
            return Expression(f"{name}[{self.rng.choice((i, i - len(items)))}]", kind == "i")
        both = [v for s in self.scope for v, k in s.items() if k == "B"]
        if both and kind in "fi" and self._chance(0.5):
            return Expression(f"{self.rng.choice(both)}.{'x' if kind == 'f' else 'n'}", kind == "i")
        if kind == "c":
            return Expression(f"complex({self._leaf('f').text}, {self._leaf('f').text})")
        if kind == "b":
            return Expression(self.rng.choice(("True", "False")), True)
        ints, reals = (INT_TEXTS, REAL_TEXTS) if self.wild else (TAME_INTS, TAME_REALS)
        return Expression(self.rng.choice(ints), True) if kind == "i" else Expression(self.rng.choice(reals))

    def _place_of(self, kind: str) -> str:
        while True:
            place, found = self._place()
            if found == kind:
                return place

    def _unknown(self, kind: str, depth: int) -> str:
        """An integer that the compiler does not know."""
        value = self._of(kind, depth)
        return self._simple_int() if value.known else f"({value.text})"

    def _simple_int(self) -> str:
        """A short integer that the compiler does not know."""
        names = [v for s in self.scope for v, k in s.items() if k == "i" and v not in self.known]
        names += ["n[1]", "k", "table.mode"] if self.has_memory else []
        return self.rng.choice(names) if names else f"int({self._some_float()})"

    def _some_float(self) -> str:
        names = [v for s in self.scope for v, k in s.items() if k == "f"]
        return self.rng.choice(names) if names else "2.5"

    def _of_int(self, depth: int) -> Expression:
        if depth <= 0:
            return self._leaf("i")
        name = self._pick(int_leaf=1.0, int_sum=2.5, int_divide=1.5, int_shift=1.0, int_bits=1.0, int_unary=1.0,
            int_convert=1.0, int_extreme=0.7, int_power=0.5 * self.wild, int_of_bool=0.4 * self.wild,
            int_apply=0.5)  # fmt: skip
        one, other = self._of("i", depth - 1), self._of("i", depth - 1)
        if name == "int_sum":
            return Expression(f"({self._unless_known(one, other)} {self.rng.choice('+-*')} {other.text})")
        if name in ("int_divide", "int_shift") and not self.wild:
            op = self.rng.choice(("//", "%", "<<", ">>"))
            return Expression(f"({self._unknown('i', 0)} {op} {f'({other.text} & 7)' if op in '<<>>' else '5'})")
        if name == "int_divide":
            return Expression(f"({one.text} {self.rng.choice(('//', '%'))} {other.text})")
        if name == "int_shift":
            return Expression(f"({one.text} {self.rng.choice(('<<', '>>'))} {other.text})")
        if name == "int_bits":
            return Expression(f"({one.text} {self.rng.choice('&|^')} {other.text})")
        if name == "int_unary":
            op = self.rng.choice(("-", "~", "+"))
            return Expression(f"({op}{self._unknown('i', depth - 1)})")
        if name == "int_convert":
            call = self.rng.choice(("int", "math.floor", "whole", "np.int64"))
            return Expression(f"{call}({self._of('f', depth - 1).text})")
        if name == "int_extreme":
            if self._chance(0.4):
                return Expression(f"abs({self._unknown('i', depth - 1)})")
            third = self.rng.choice(("", f", {self._of('i', 0).text}"))
            return Expression(f"{self.rng.choice(('min', 'max'))}({one.text}, {other.text}{third})")
        if name == "int_power":
            power = self.rng.choice((0, 1, 2, 3, 7, 63, 64))
            return Expression(f"{self._unknown('i', depth - 1)} ** {power}", known=power == 0)
        if name == "int_of_bool":
            how = self.rng.choice(("({} + {})", "({} * {})", "(-{} + {})", "int({}) - {}", "({} // {})", "({} << {})"))
            return Expression("(" + how.format(self._of("b", 1).text, self._unknown("i", 0)) + ")")
        if name == "int_apply":
            found = [h.name for h in self.helpers if h.kinds == ("i",) and h.returns == "i" and h.is_leaf] or [
                "abs",
                "int",
                "np.int64",
            ]
            return Expression(f"twice({self.rng.choice(found)}, {self._unknown('i', 1)})")
        return one

    def _unless_known(self, one: Expression, other: Expression) -> str:
        if not (one.known and other.known):
            return one.text
        return self._unknown("i", 0)

    def _of_float(self, depth: int) -> Expression:
        if depth <= 0:
            return self._leaf("f")
        name = self._pick(float_leaf=1.0, float_sum=3.0, float_quotient=1.0, float_floor_divide=0.8, float_of_int=0.8,
            float_unary=0.8, float_function=1.0, float_extreme=0.8, float_power=0.5 * self.wild,
            float_parts=0.5 * self.wild, mixed_choice=0.3 * self.wild, float_apply=0.5)  # fmt: skip
        one, other = self._of("f", depth - 1).text, self._of("f", depth - 1).text
        if name == "float_sum":
            other = self._of("i", depth - 1).text if self._chance(0.15) else other
            return Expression(f"({one} {self.rng.choice('+-*')} {other})")
        if name in ("float_quotient", "float_floor_divide") and not self.wild:
            return Expression(f"({one} {self.rng.choice(('/', '//', '%'))} (abs({other}) + 0.5))")
        if name == "float_quotient":
            kinds = self.rng.choice(("ff", "fi", "if", "ii", "bf"))
            return Expression(f"({self._of(kinds[0], depth - 1).text} / {self._of(kinds[1], depth - 1).text})")
        if name == "float_floor_divide":
            other = self._unknown("i", 0) if self._chance(0.2) else other
            return Expression(f"({one} {self.rng.choice(('//', '%'))} {other})")
        if name == "float_of_int":
            kind = self.rng.choice("ib")
            return Expression(f"{self.rng.choice(('float', 'np.float64'))}({self._of(kind, depth - 1).text})")
        if name == "float_unary":
            return Expression(self.rng.choice(("(-{})", "(+{})", "abs({})", "np.floor({})", "floor({})")).format(one))
        if name == "float_function":
            call = self.rng.choice(("sin", "cos", "atan", "tanh", "atan2", "mul_add") if not self.wild else
                ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "math.sqrt",
                 "atan2", "clip", "mul_add"))  # fmt: skip
            self.used[call] += 1
            given = {"atan2": f"{one}, {other}", "clip": f"{one}, -0.5, {other}", "mul_add": f"{one}, {other}, 1.5"}
            return Expression(f"{call}({given.get(call, one)})")
        if name == "float_extreme":
            third = self.rng.choice(("", f", {self._of('f', 0).text}"))
            other = self._of("i", 0).text if self._chance(0.15 * self.wild) else other
            return Expression(f"{self.rng.choice(('min', 'max'))}({one}, {other}{third})")
        if name == "float_power":
            if self._chance(0.7):
                return Expression(f"({one}) ** {self.rng.choice((0, 1, 2, 3, 5, 64))}")
            return Expression(f"({one}) ** {self._some_float()}")
        if name == "float_parts":
            if self._chance(0.3):
                return Expression(f"value_of({self._of(self.rng.choice('cf'), depth - 1).text})")
            return Expression(f"({self._of('c', depth - 1).text}).{self.rng.choice(('real', 'imag'))}")
        if name == "float_apply":
            if self._chance(0.4):
                g = self.rng.choice(("float", "half", "at_least", "abs"))
                h = self.rng.choice(("max", "min", "atan2") if not self.wild else ("max", "min", "atan2", "math.fmod",
                    "math.pow", "signed"))  # fmt: skip
                return Expression(f"summed({h}, {g}, {one}, {other})")
            call = self.rng.choice(("half", "shrunk", "at_least", "abs", "np.floor"))
            return Expression(f"twice({call}, {one})")
        if name == "mixed_choice":
            names = [v for s in self.scope for v, k in s.items() if k == "f"]
            if names:
                pair = [self.rng.choice(names), self.rng.choice(("0", "7", "HIGH", "k" if self.has_memory else "LOW"))]
                self.rng.shuffle(pair)
                return Expression(f"({pair[0]} if {self._condition(1)} else {pair[1]})")
        return Expression(one)

    def _of_complex(self, depth: int) -> Expression:
        if depth <= 0:
            return self._leaf("c")
        name = self._pick(complex_leaf=1.0, complex_sum=3.0, complex_quotient=0.8, complex_unary=0.5, complex_power=0.4,
            complex_function=0.8 if self.sort == "complex" else 0.2, complex_extreme=0.3, complex_of=0.4)  # fmt: skip
        one, other = self._of("c", depth - 1).text, self._of("c", depth - 1).text
        if name == "complex_sum":
            other = self._of(self.rng.choice("fi"), depth - 1).text if self._chance(0.3) else other
            pair = [one, other]
            self.rng.shuffle(pair)
            return Expression(f"({pair[0]} {self.rng.choice('+-*')} {pair[1]})")
        if name == "complex_quotient":
            return Expression(f"({one} / {other})")
        if name == "complex_unary":
            return Expression(f"({self.rng.choice('+-')}{one})")
        if name == "complex_power":
            return Expression(f"({one}) ** {self.rng.choice((0, 1, 2, 3, 5))}")
        if name == "complex_function":
            call = self.rng.choice(("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log",
                "sqrt", "atan2", "clip", "floor", "mul_add"))  # fmt: skip
            self.used[f"complex {call}"] += 1
            given = {"atan2": f"{one}, {other}", "clip": f"{one}, -0.5, 0.75", "mul_add": f"{one}, {other}, 1.5"}
            return Expression(f"{call}({given.get(call, one)})")
        if name == "complex_extreme":
            return Expression(f"{self.rng.choice(('min', 'max'))}({one}, {other})")
        if name == "complex_of":
            return Expression(self.rng.choice((f"complex({self._of('f', depth - 1).text})", "(2.5 - 1.5j)",
                f"complex({self._of('f', 0).text}, {self._of('i', 0).text} * 1.0)")))  # fmt: skip
        return Expression(one)

    def _of_bool(self, depth: int) -> Expression:
        if depth <= 0:
            return self._leaf("b")
        name = self._pick(bool_leaf=0.3, bool_compare=4.0, bool_logic=1.5, bool_bits=0.5, bool_not=0.7, bool_of=0.8)
        if name == "bool_compare":
            kind = self.rng.choice(("f", "i", "b", self.item, "m"))
            op = self.rng.choice(("<", "<=", ">", ">=", "==", "!="))
            kinds = ("i", "f") if kind == "m" else (kind, kind)
            return Expression(f"({self._of(kinds[0], depth - 1).text} {op} {self._of(kinds[1], depth - 1).text})")
        if name == "bool_logic":
            op = self.rng.choice(("and", "or"))
            parts = [
                self._of(self.rng.choice("bbif" if self.wild else "b"), depth - 1).text
                for _ in range(self.rng.randint(2, 3))
            ]
            return Expression("(" + f" {op} ".join(parts) + ")")
        if name == "bool_bits":
            return Expression(
                f"({self._of('b', depth - 1).text} {self.rng.choice('&|^')} {self._of('b', depth - 1).text})"
            )
        if name == "bool_not":
            return Expression(f"(not {self._of(self.rng.choice('bif'), depth - 1).text})")
        if name == "bool_of":
            kind = self.rng.choice(("f", "f", self.item))
            call = self.rng.choice(("is_finite", "is_zero", "is_positive", "has_slopes") if kind == "c" else
                ("bool", "is_finite", "is_zero", "is_positive", "has_slopes"))  # fmt: skip
            return Expression(f"{call}({self._of(kind, depth - 1).text})")
        return self._leaf("b")

    def _condition(self, depth: int) -> str:
        return self._of(self.rng.choice("bbbif"), depth).text


# ---- running


class Fault(NamedTuple):
    """A program that went wrong."""

    number: int
    what: str
    source: str


class Report(NamedTuple):
    """What a run found."""

    programs: int
    faults: list[Fault]
    used: Counter
    sorts: Counter
    plain: int
    left: int
    powers: int
    nan: int

    def __str__(self) -> str:
        kinds = ", ".join(f"{n} {sort}" for sort, n in sorted(self.sorts.items()))
        return (
            f"{self.programs} programs ({kinds}), {self.plain} of them compared with plain Python too, "
            f"{self.left} left an array, {self.powers} not compared for a power, "
            f"{self.nan} kept a NaN in nested minima: {len(self.faults)} faults"
        )


@contextlib.contextmanager
def bounds_checks(on: bool) -> Iterator[None]:
    """What SHELDRAKE_BOUNDSCHECK says, for a while."""
    before = os.environ.get("SHELDRAKE_BOUNDSCHECK")
    os.environ["SHELDRAKE_BOUNDSCHECK"] = str(int(on))
    try:
        yield
    finally:
        os.environ.pop("SHELDRAKE_BOUNDSCHECK")
        if before is not None:
            os.environ["SHELDRAKE_BOUNDSCHECK"] = before


def module_of(text: str, name: str) -> dict[str, Any]:
    """What a text defines; its source can be read, as that of a notebook's cell."""
    path = f"<{name}>"
    linecache.cache[path] = (len(text), None, text.splitlines(keepends=True), path)
    scope: dict[str, Any] = {"__name__": "fuzz", "Both": Both, "Options": Options, "Table": Table}
    exec(compile(text, path, "exec", dont_inherit=True), scope)
    return scope


def compiled(kernel: Any) -> Callable[..., int]:
    """A kernel's function of the ABI, compiled now and kept nowhere."""
    symbol = store.symbol_of(kernel)
    return PROTOTYPE(store._link(lower.emit(lower.lower(kernel, symbol), symbol, host()), symbol))


def entry_of(programs: list[Program], short_loops: bool) -> str:
    """An entry that runs one of some programs."""
    lines = [
        f"@kernel(top=True, strict=True, short_loops={short_loops})",
        f"def entry({PARAMETERS}, which: int) -> int:",
    ]
    for p in programs:
        lines += [f"    if which == {p.number}:", f"        return {p.name}({NAMES})"]
    return "\n".join([*lines, "    return -1", ""])


def run_batch(programs: list[Program], seed: int) -> tuple[list[Fault], Counter]:
    """Runs programs of one sort; what went wrong."""
    source = HEAD + "\n".join(p.text() for p in programs) + entry_of(programs, programs[0].number % (4 * BATCH) != 0)
    scope = module_of(source, f"fuzz {seed} {programs[0].number}")
    sort, counts = programs[0].sort, Counter[str]()
    entry = scope["entry"].on_complex if sort == "complex" else scope["entry"]
    try:
        with bounds_checks(sort == "bounds"):
            function = compiled(entry)
    except Exception:
        if len(programs) == 1:
            return [
                Fault(programs[0].number, "refused:\n" + traceback.format_exc(limit=-3), programs[0].text())
            ], counts
        found = [run_batch([p], seed) for p in programs]
        return [fault for faults, _ in found for fault in faults], sum((c for _, c in found), counts)
    faults = []
    for p in programs:
        rng = np.random.default_rng((seed, p.number))
        for turn in range(2):
            given = memory(rng, sort == "complex", tame=turn == 1)
            if what := compare(p, scope[p.name], entry, function, given, counts):
                faults.append(Fault(p.number, what, p.text()))
                break
    return faults, counts


def compare(program: Program, kernel: Any, entry: Any, function: Any, given: Given, counts: Counter) -> str:
    """What is wrong with a program, or nothing."""
    from sheldrake.common._native.binding import arguments

    got, oracle = copy.deepcopy(given), Oracle()
    wanted, status = by_the_page(oracle, kernel, given)
    if oracle.has_left:
        counts["left"] += 1
        if program.sort != "bounds":
            return "the program leaves an array (a fault of the generator)"
    words = arguments(entry, (*got, program.number))[0].placed()
    found = function(got.t, None, words.ctypes.data)
    if oracle.last_bits:
        counts["powers"] += 1
        return ""
    if what := difference(wanted, got, status, found):
        if oracle.lost_nan:
            spread, status = by_the_page(Oracle(nan_spreads=True), kernel, given)
            if not difference(spread, got, status, found):
                counts["nan"] += 1
                return ""
        return f"compiled {what}"
    if status != INDEX_ERROR and not oracle.differs and program.sort != "complex":
        plain = copy.deepcopy(given)
        try:
            with np.errstate(all="ignore"):
                status = kernel(*plain.seen())
        except (ArithmeticError, AttributeError, TypeError, ValueError):  # infinite numbers, truths of NumPy, atan2
            return ""
        counts["plain"] += 1
        if what := difference(wanted, plain, found, status):
            return f"plain Python {what}"
    return ""


def by_the_page(oracle: Oracle, kernel: Any, given: Given) -> tuple[Given, Any]:
    """Memory and status after a kernel as the page says."""
    after = copy.deepcopy(given)
    try:
        return after, oracle.run(kernel, after.seen())
    except OutOfBounds:
        oracle.has_left = True
        return after, INDEX_ERROR


def difference(wanted: Given, got: Given, status: Any, found: Any) -> str:
    """How two memories and statuses differ."""
    if int(status) != int(found):
        return f"returns {found}, the page says {status}"
    names = [*Table._fields, "one", "x", "A", "n", "N", "u0", "u1"]
    for name, a, b in zip(names, wanted.arrays(), got.arrays()):
        same = _bits_of(a) == _bits_of(b)
        if not same.all():
            at = tuple(np.argwhere(~same)[0])
            return f"has {name}[{at}] = {b.view(a.real.dtype)[at]!r}, the page says {a.view(a.real.dtype)[at]!r}"
    return ""


def _bits_of(a: np.ndarray) -> np.ndarray:
    if a.dtype.kind == "i":
        return a
    real = a.view(np.float64)
    return np.where(np.isnan(real), -1, real.view(np.int64))


def fuzz(number: int, seed: int = 0, only: int | None = None, tell: Callable[[str], None] | None = None) -> Report:
    """Runs `number` programs, or one of them."""
    faults: list[Fault] = []
    used, sorts, counts = Counter[str](), Counter[str](), Counter[str]()
    start, size = time.perf_counter(), min(BATCH, max(number // len(SORTS), 1))
    batches = range(0, number, size)
    for done, first in enumerate(batches):
        sort = SORTS[done % 4]
        programs = [
            Program(random.Random(seed * 1_000_003 + i), i, sort) for i in range(first, min(first + size, number))
        ]
        programs = [p for p in programs if only in (None, p.number)]
        if not programs:
            continue
        wrong, found = run_batch(programs, seed)
        faults += wrong
        counts += found
        sorts[sort] += len(programs)
        for p in programs:
            used += p.used
        if tell is not None:
            spent = time.perf_counter() - start
            left = spent / (done + 1) * (len(batches) - done - 1)
            tell(f"{min(first + size, number)} of {number} programs, {len(faults)} faults, {left:.0f} s left")
    told = (counts[name] for name in ("plain", "left", "powers", "nan"))
    return Report(sum(sorts.values()), faults, used, sorts, *told)


def main() -> int:
    """What the command does."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else "")
    parser.add_argument("--programs", type=int, default=1000, help="how many")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, help="number of one program of that run")
    parser.add_argument("--show", type=int, default=3, help="faults that are printed with their source")
    parser.add_argument("--grammar", action="store_true", help="how often each part of the grammar was written")
    given = parser.parse_args()

    def tell(line: str) -> None:
        print(f"\r{line}    ", end="", file=sys.stderr, flush=True)

    report = fuzz(given.programs, given.seed, given.only, tell)
    print(file=sys.stderr)
    for fault in report.faults[: given.show]:
        print(f"---- program {fault.number}: {fault.what}\n{fault.source}")
    print("faults: " + (" ".join(str(f.number) for f in report.faults) or "none"))
    if given.grammar:
        for name, n in sorted(report.used.items()):
            print(f"{n:8d} {name}")
    print(report)
    return bool(report.faults)


if __name__ == "__main__":
    sys.exit(main())
