"""What kernels may call that is not a kernel: each takes the compiler of the caller, the call, and the arguments."""

from __future__ import annotations

import ast
import builtins
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common import rows
from sheldrake.common._kernels import generic
from sheldrake.common._native.compiler import prelude, scalars
from sheldrake.common._native.compiler.body import PREFETCH
from sheldrake.common._native.compiler.kinds import (
    BOOL,
    COMPLEX,
    FLOAT,
    INT,
    LANES,
    MASK,
    NOTHING,
    Array,
    Rows,
    Tuple,
    Value,
    Vectors,
)
from sheldrake.common._native.compiler.scalars import Unfit, convert

if TYPE_CHECKING:
    from sheldrake.common._native.compiler.function import Function

Builtin = Callable[..., Value]
LLVM_NAMES = {"sin": "llvm.sin.f64", "cos": "llvm.cos.f64", "exp": "llvm.exp.f64", "log": "llvm.log.f64"}
ANY = 99


def _of_doubles(name: str) -> Builtin:
    def call(f: Function, *args: Value) -> Value:
        if scalars.common(*args) is COMPLEX:
            return f.call(prelude.COMPLEX[name], [convert(f.b, a, COMPLEX) for a in args])
        return real(f, *args)

    real = _of_floats(LLVM_NAMES.get(name, name))
    return call


def _of_floats(name: str) -> Builtin:
    def call(f: Function, *args: Value) -> Value:
        kind = LANES if scalars.common(*args) is LANES else FLOAT
        given = (convert(f.b, a, kind).leaves[0] for a in args)
        return Value(kind, (f.b.math(name, *given, kind=kind.element),))

    return call


def _kernel(function: Any) -> Builtin:
    return lambda f, *args: f.call(function, list(args))


def _raw(how: str) -> Builtin:
    """An instruction on two integers, for `prelude` alone: it is not for all integers."""

    def call(f: Function, x: Value, y: Value) -> Value:
        if f.python.__module__ != prelude.__name__:
            raise Unfit("is for the compiler alone: write // or %")
        return Value(INT, (f.b.op(f"{how} i64 {x.leaves[0]}, {y.leaves[0]}"),))

    return call


def _remainder(f: Function, x: Value, y: Value) -> Value:
    x, y = convert(f.b, x, FLOAT), convert(f.b, y, FLOAT)
    return Value(FLOAT, (f.b.op(f"frem double {x.leaves[0]}, {y.leaves[0]}"),))


def _abs(f: Function, x: Value) -> Value:
    if scalars.common(x) in (FLOAT, LANES):
        return Value(x.kind, (f.b.math("llvm.fabs.f64", x.leaves[0], kind=x.kind.element),))
    x = convert(f.b, x, INT)
    is_negative = f.b.op(f"icmp slt i64 {x.leaves[0]}, 0")
    return Value(INT, (f.b.op(f"select i1 {is_negative}, i64 {scalars.negate(f.b, x).leaves[0]}, i64 {x.leaves[0]}"),))


def _extreme(op: Any) -> Builtin:
    """The first of those that no other one is less (greater) than; a NaN stays if it comes first."""

    def call(f: Function, *args: Value) -> Value:
        best = args[0]
        for x in args[1:]:
            kind = scalars.common(best, x)
            best, x = convert(f.b, best, kind), convert(f.b, x, kind)
            best = f.choose(scalars.compare(f.b, op, x, best), x, best)
        return best

    return call


def _math_floor(f: Function, x: Value) -> Value:
    """The largest integer that is not above x; of lanes the one they have in common, or the function is left."""
    if scalars.common(x).rank <= INT.rank:
        return convert(f.b, x, INT)
    if x.kind is LANES:
        floors = f.b.math("floor", x.leaves[0], kind=LANES.element)
        first = f.b.op(f"extractelement {LANES.element} {floors}, i64 0")
        f.b.must_agree(f.b.op(f"fcmp oeq {LANES.element} {floors}, {f.b.spread('double', first)}"))
        return _int(f, Value(FLOAT, (first,)))
    return _int(f, Value(FLOAT, (f.b.math("floor", convert(f.b, x, FLOAT).leaves[0]),)))


def _floor(f: Function, x: Value) -> Value:
    """As a float that has been an integer: there is no -0.0."""
    if scalars.common(x) is COMPLEX:
        return f.call(prelude.COMPLEX["floor"], [x])
    return f.arithmetic(ast.Add(), _of_floats("floor")(f, x), scalars.number(0.0))


def _int(f: Function, x: Value) -> Value:
    if x.kind is FLOAT:
        return Value(INT, (f.b.to_integer(x.leaves[0]),))
    return convert(f.b, x, INT)


def _complex(f: Function, x: Value, y: Value | None = None) -> Value:
    if y is None:
        return convert(f.b, x, COMPLEX)
    return Value(COMPLEX, convert(f.b, x, FLOAT).leaves + convert(f.b, y, FLOAT).leaves)


def _len(f: Function, x: Value) -> Value:
    if isinstance(x.kind, Tuple):
        return scalars.number(len(x.kind.items))
    if isinstance(x.kind, (Array, Rows, Vectors)):
        return Value(INT, (x.leaves[2 if isinstance(x.kind, Vectors) else 1],))
    raise Unfit(f"{x.kind!r} has no length")


def _in_any(f: Function, x: Value) -> Value:
    """Whether it is true; of lanes, whether one is."""
    if x.kind is MASK:
        bits = f.b.op(f"bitcast {MASK.element} {x.leaves[0]} to i4")
        return Value(BOOL, (f.b.op(f"icmp ne i4 {bits}, 0"),))
    return Value(BOOL, (scalars.truth(f.b, x),))


def _mul_add(f: Function, *args: Value) -> Value:
    """One rounding where the processor can, unless it is to be Python's."""
    if f.b.fused and scalars.common(*args) is not COMPLEX:
        return _of_floats("llvm.fmuladd.f64")(f, *args)
    return f.call(prelude.mul_add, list(args))


def _sines_and_cosines(f: Function, x: Value, *others: Value) -> Value:
    """What has slopes is done one by one."""
    kernels = {FLOAT: prelude.sines_of_floats, LANES: prelude.sines_of_lanes}
    return f.call(kernels.get(x.kind.dtype, prelude.sines_one_by_one), [x, *others])


def _four_sines_and_cosines(f: Function, x: Value, s: Value, c: Value, k: Value) -> Value:
    b, four = f.b, LANES.element

    def place(array: Value) -> str:
        return f.check_memory(b.at("double", array.leaves[0], k.leaves[0]))

    angles = Value(LANES, (b.op(f"load {four}, ptr {place(x)}, align 8"),))
    for array, found in zip((s, c), f.call(prelude.sine_and_cosine, [angles]).leaves):
        b.do(f"store {four} {found}, ptr {place(array)}, align 8")
    return NOTHING


def _call_row(f: Function, table: Value, r: Value, t: Value, slab: Value, words: Value, at: Value) -> Value:
    """Calls the function of the ABI whose address is table[r]."""
    where = f.b.op(f"getelementptr i64, ptr {table.leaves[0]}, i64 {r.leaves[0]}")
    function = f.b.op(f"inttoptr i64 {f.b.load('i64', where)} to ptr")
    given = f.b.op(f"getelementptr i64, ptr {words.leaves[0]}, i64 {at.leaves[0]}")
    return Value(INT, (f.b.op(f"call i64 {function}(double {t.leaves[0]}, ptr {slab.leaves[0]}, ptr {given})"),))


def _prefetch(f: Function, numbers: Value, i: Value, j: Value | None = None) -> Value:
    """Asks for the line of the cache with numbers[i, j], or numbers[i], to be read and kept near."""
    at = i.leaves[0]
    if j is not None:
        at = f.b.op(f"add nsw i64 {f.b.op(f'mul nsw i64 {at}, {numbers.leaves[2]}')}, {j.leaves[0]}")
    place = f.b.at(numbers.kind.dtype.element, numbers.leaves[0], at)
    f.b.do(f"call void @{PREFETCH}(ptr {place}, i32 0, i32 3, i32 1)")
    return NOTHING


def _exchange(into: bool) -> Builtin:
    """Copies places of four rows into lanes or back, four at a time; the last four may be some of those before."""

    def call(f: Function, rows: Value, who: Value, j: Value, lanes: Value, begin: Value, end: Value) -> Value:
        b, (data, _, width) = f.b, rows.leaves
        first = b.at("i64", who.leaves[0], j.leaves[0])
        numbers = [b.load("i64", b.at("i64", first, i)) for i in range(4)]
        starts = [b.at("double", data, b.op(f"mul nsw i64 {n}, {width}")) for n in numbers]
        last = b.op(f"sub nsw i64 {end.leaves[0]}, 4")

        def four(at: str) -> None:
            parts = [b.at("double", start, at) for start in starts]
            beside = b.at(LANES.element, lanes.leaves[0], at)
            places = [b.at(LANES.element, beside, i) for i in range(4)]
            _transpose(f, into, parts, places)

        head, body, after, before, following = b.label(), b.label(), b.label(), b.block, f"%n{b.label()}"
        b.start(head)
        at = b.op(f"phi i64 [{begin.leaves[0]}, %{before}], [{following}, %{body}]")
        b.fork(b.op(f"icmp slt i64 {at}, {last}"), body, after)
        b.start(body)
        four(at)
        b.do(f"{following} = add nsw i64 {at}, 4")
        b.go(head)
        b.start(after)
        four(last)
        return NOTHING

    return call


def _transpose(f: Function, into: bool, parts: list[str], places: list[str]) -> None:
    """Four numbers of each of four rows, and the same places of lanes: one is copied, rows as columns, to the other.

    Rows are loaded and stored by halves: exchanging those within registers would take as long as all else.
    """
    b, four, two = f.b, LANES.element, "<2 x double>"

    def mixed(kind: str, x: str, y: str, *which: int) -> str:
        mask = ", ".join(f"i32 {i}" for i in which)
        return b.op(f"shufflevector {kind} {x}, {kind} {y}, <{len(which)} x i32> <{mask}>")

    def load(kind: str, at: str) -> str:
        return b.op(f"load {kind}, ptr {f.check_memory(at)}, align 8")

    def store(kind: str, value: str, at: str) -> None:
        b.do(f"store {kind} {value}, ptr {f.check_memory(at)}, align 8")

    for half in (0, 2):
        ends = [b.at("double", part, half) for part in parts]
        if into:
            w, x, y, z = (load(two, end) for end in ends)
            even, odd = (mixed(two, p, q, 0, 1, 2, 3) for p, q in ((w, y), (x, z)))
            store(four, mixed(four, even, odd, 0, 4, 2, 6), places[half])
            store(four, mixed(four, even, odd, 1, 5, 3, 7), places[half + 1])
        else:
            p, q = (load(four, place) for place in places[half : half + 2])
            even, odd = mixed(four, p, q, 0, 4, 2, 6), mixed(four, p, q, 1, 5, 3, 7)
            for (both, low), end in zip(((even, 0), (odd, 0), (even, 2), (odd, 2)), ends):
                store(two, mixed(four, both, both, low, low + 1), end)


BUILTINS: dict[Any, tuple[Builtin, int, int]] = {
    builtins.abs: (_abs, 1, 1), builtins.len: (_len, 1, 1), builtins.complex: (_complex, 1, 2),
    builtins.bool: (lambda f, x: Value(BOOL, (scalars.truth(f.b, x),)), 1, 1),
    builtins.min: (_extreme(ast.Lt), 2, ANY), builtins.max: (_extreme(ast.Gt), 2, ANY),
    builtins.int: (_int, 1, 1), builtins.float: (lambda f, x: convert(f.b, x, FLOAT), 1, 1),
    np.int64: (_int, 1, 1), np.float64: (lambda f, x: convert(f.b, x, FLOAT), 1, 1),
    np.floor: (_of_floats("floor"), 1, 1), math.floor: (_math_floor, 1, 1), generic.floor: (_floor, 1, 1),
    math.sqrt: (_of_doubles("sqrt"), 1, 1), generic.atan2: (_of_doubles("atan2"), 2, 2),
    generic.has_slopes: (lambda _, x: scalars.number(scalars.common(x) is COMPLEX), 1, 1),
    generic.in_any: (_in_any, 1, 1), generic.mul_add: (_mul_add, 3, 3),
    generic.sines_and_cosines: (_sines_and_cosines, 4, 4),
    prelude.four_sines_and_cosines: (_four_sines_and_cosines, 4, 4),
    prelude.quotient: (_raw("sdiv"), 2, 2), prelude.remainder: (_raw("srem"), 2, 2), math.fmod: (_remainder, 2, 2),
    math.pow: (_of_floats("llvm.pow.f64"), 2, 2), math.copysign: (_of_floats("llvm.copysign.f64"), 2, 2),
    rows.call_row: (_call_row, 6, 6), rows.prefetch: (_prefetch, 2, 3),
    rows.into_lanes: (_exchange(True), 6, 6), rows.out_of_lanes: (_exchange(False), 6, 6),
}  # fmt: skip
"""What a call of each makes, and how many arguments it takes, least and most."""
BUILTINS |= {getattr(generic, name): (_of_doubles(name), 1, 1) for name in generic.UNARY}
BUILTINS |= {
    getattr(generic, name): (_kernel(kernel), *[kernel.__code__.co_argcount] * 2)
    for name, kernel in prelude.GENERIC.items()
}

OF_NUMPY = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "atan2": "arctan2"}
OF_MATH = (*generic.UNARY, "atan2")
BUILTINS |= {getattr(math, name): BUILTINS[getattr(generic, name)] for name in OF_MATH}
BUILTINS |= {getattr(np, OF_NUMPY.get(name, name)): BUILTINS[getattr(generic, name)] for name in OF_MATH}
BUILTINS |= {np.absolute: (_abs, 1, 1), math.fabs: (_of_floats("llvm.fabs.f64"), 1, 1)}


def meant(thing: Any) -> Any:
    """What a function stands for in a kernel: that which its attribute `in_kernels` says, else itself."""
    return getattr(thing, "in_kernels", thing)


def refusal(thing: object) -> str:
    """What is said about something that a kernel cannot call."""
    name = getattr(thing, "__name__", repr(thing))
    home = (getattr(thing, "__module__", None) or type(thing).__module__).partition(".")[0]
    if home in ("numpy", "math", "builtins", "sheldrake"):
        known = ", ".join(["abs", "min", "max", "len", *OF_MATH, "floor"])
        return f"a kernel cannot call {name!r}; of mathematics it has {known}"
    return f"a kernel may call kernels, mathematics and len, not {name!r}: make it a @kernel"
