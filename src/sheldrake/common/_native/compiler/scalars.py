"""Arithmetic of numbers. Mixed kinds become the higher one: bool, int, float, complex.

Nothing here is undefined for any operands. Integers wrap around at 64 bits, as NumPy's do; a shift by 64 or more leaves
nothing but the sign; quotients of integers by 0 are 0 (`prelude`). What is not an instruction is a kernel of `prelude`.
"""

from __future__ import annotations

import ast
import operator
import struct
from typing import Any

from sheldrake.common._native.compiler.body import Body
from sheldrake.common._native.compiler.kinds import BOOL, COMPLEX, FLOAT, INT, LANES, MASK, Kind, Scalar, Tuple, Value

Operator = type[ast.operator]
INT_OPS = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.BitAnd: "and", ast.BitOr: "or", ast.BitXor: "xor"}
FLOAT_OPS = {ast.Add: "fadd", ast.Sub: "fsub", ast.Mult: "fmul", ast.Div: "fdiv"}
INT_COMPARE = {ast.Eq: "eq", ast.NotEq: "ne", ast.Lt: "slt", ast.LtE: "sle", ast.Gt: "sgt", ast.GtE: "sge"}
FLOAT_COMPARE = {ast.Eq: "oeq", ast.NotEq: "une", ast.Lt: "olt", ast.LtE: "ole", ast.Gt: "ogt", ast.GtE: "oge"}
PRELUDE = {ast.FloorDiv: "floor_divide", ast.Mod: "modulo", ast.Pow: "power"}
FOLDED = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul}
SIGNS = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "//", ast.Mod: "%", ast.Pow: "**",
    ast.BitAnd: "&", ast.BitOr: "|", ast.BitXor: "^", ast.LShift: "<<", ast.RShift: ">>", ast.MatMult: "@",
}  # fmt: skip
LARGEST_POWER = 64
WORD = 64  # bits of an integer


class Unfit(Exception):
    """An operation that these kinds do not have; functions here and in `memory` raise it, who called says where."""


class Wider(Exception):
    """A variable, or what a function returns (""), must be of a wider kind: the function is compiled anew."""

    def __init__(self, name: str, kind: Kind) -> None:
        self.name, self.kind = name, kind
        super().__init__(name)


def widest(kind: Kind, other: Kind) -> Kind:
    """A kind with complex numbers for the floats that are complex in another: they are the kernel's scalars."""
    if isinstance(kind, Tuple) and isinstance(other, Tuple) and len(kind.items) == len(other.items):
        return Tuple(tuple(widest(a, b) for a, b in zip(kind.items, other.items)), kind.cls)
    return other if kind is FLOAT and other in (COMPLEX, LANES) else kind


def on_lanes(kind: Kind) -> Kind:
    """A kind with lanes for its floats."""
    if isinstance(kind, Tuple):
        return Tuple(tuple(map(on_lanes, kind.items)), kind.cls)
    return LANES if kind is FLOAT else kind


def number(x: Any) -> Value:
    """A number that is known."""
    if isinstance(x, bool):
        return Value(BOOL, ("true" if x else "false",), x)
    if isinstance(x, int):
        if not -(2 ** (WORD - 1)) <= x < 2 ** (WORD - 1):
            raise Unfit(f"{x} has no place in {WORD} bits")
        return Value(INT, (f"{x:d}",), int(x))
    if isinstance(x, complex):
        return Value(COMPLEX, (_bits(x.real), _bits(x.imag)), x)
    return Value(FLOAT, (_bits(x),), x)


def _bits(x: float) -> str:
    return f"0x{struct.unpack('<Q', struct.pack('<d', x))[0]:016X}"


def convert(b: Body, value: Value, kind: Scalar) -> Value:
    """A number as one of a kind that is not lower."""
    have = value.kind
    if have is kind:
        return value
    if not isinstance(have, Scalar) or have.rank > kind.rank:
        raise Unfit(f"{have!r} where {kind!r} is wanted")
    if kind is COMPLEX:
        return Value(COMPLEX, (convert(b, value, FLOAT).leaves[0], _bits(0.0)))
    if kind is LANES:
        return Value(LANES, (b.spread("double", convert(b, value, FLOAT).leaves[0]),))
    if value.known is not None:
        return number(int(value.known) if kind is INT else float(value.known))
    if kind is INT:
        return Value(INT, (b.op(f"zext i1 {value.leaves[0]} to i64"),))
    signed = "uitofp i1" if have is BOOL else "sitofp i64"
    return Value(FLOAT, (b.op(f"{signed} {value.leaves[0]} to double"),))


def common(*values: Value) -> Scalar:
    """The kind of what comes of these numbers."""
    for v in values:
        if not isinstance(v.kind, Scalar):
            raise Unfit(f"{v.kind!r} is not a number")
    return max((v.kind for v in values), key=lambda k: k.rank)


def truth(b: Body, value: Value) -> str:
    """Whether a number is not zero, as an i1."""
    if value.kind is BOOL:
        return value.leaves[0]
    if value.kind is INT:
        return b.op(f"icmp ne i64 {value.leaves[0]}, 0")
    if value.kind is FLOAT:
        return b.op(f"fcmp une double {value.leaves[0]}, {_bits(0.0)}")
    if value.kind is MASK:
        return b.agreed(value.leaves[0])
    raise Unfit(f"{value.kind!r} is neither true nor false")


def compare(b: Body, op: type[ast.cmpop], x: Value, y: Value) -> Value:
    """A comparison, false of NaN but for `!=`; complex numbers are ordered by their real parts."""
    kind = common(x, y)
    if kind is COMPLEX:
        x, y = convert(b, x, COMPLEX), convert(b, y, COMPLEX)
        parts = [compare(b, op, real(x), real(y)), compare(b, op, imaginary(x), imaginary(y))]
        if op not in (ast.Eq, ast.NotEq):
            return parts[0]
        return Value(BOOL, (b.op(f"{'and' if op is ast.Eq else 'or'} i1 {parts[0].leaves[0]}, {parts[1].leaves[0]}"),))
    kind = INT if kind is BOOL else kind
    x, y = convert(b, x, kind), convert(b, y, kind)
    if kind is LANES:
        return Value(MASK, (b.op(f"fcmp {FLOAT_COMPARE[op]} <4 x double> {x.leaves[0]}, {y.leaves[0]}"),))
    how = f"icmp {INT_COMPARE[op]} i64" if kind is INT else f"fcmp {FLOAT_COMPARE[op]} double"
    return Value(BOOL, (b.op(f"{how} {x.leaves[0]}, {y.leaves[0]}"),))


def real(z: Value) -> Value:
    """The real part of a number."""
    return Value(FLOAT, z.leaves[:1]) if z.kind is COMPLEX else z


def imaginary(z: Value) -> Value:
    """The imaginary part of a number."""
    return Value(FLOAT, z.leaves[1:]) if z.kind is COMPLEX else number(0.0)


def negate(b: Body, x: Value) -> Value:
    """-x."""
    kind = max(common(x), INT, key=lambda k: k.rank)
    if x.known is not None and kind is not COMPLEX:
        return number(-x.known)
    x = convert(b, x, kind)
    if kind is INT:
        return Value(INT, (b.op(f"sub i64 0, {x.leaves[0]}"),))
    return Value(kind, tuple(b.op(f"fneg {k} {leaf}") for k, leaf in zip(kind.leaves, x.leaves)))


def invert(b: Body, x: Value) -> Value:
    """~x of an integer."""
    if common(x).rank > INT.rank:
        raise Unfit(f"~ takes an int, not {x.kind!r}")
    return Value(INT, (b.op(f"xor i64 {convert(b, x, INT).leaves[0]}, -1"),))


def binary(b: Body, op: Operator, x: Value, y: Value) -> Value | str:
    """x op y, or the name of the kernel of `prelude` that does it."""
    kind = common(x, y)
    if kind is BOOL and op not in (ast.BitAnd, ast.BitOr, ast.BitXor):
        kind = INT
    if kind.rank <= INT.rank and op is ast.Div:
        kind = FLOAT
    if kind is INT:
        return _of_integers(b, op, x, y)
    if kind is COMPLEX and op in (ast.Add, ast.Sub):
        x, y = convert(b, x, kind), convert(b, y, kind)
        return Value(kind, tuple(_float(b, op, p, q) for p, q in zip(x.leaves, y.leaves)))
    if kind is COMPLEX and op in (ast.Mult, ast.Div):
        return "complex_product" if op is ast.Mult else "complex_quotient"
    if kind in (FLOAT, LANES) and op in FLOAT_OPS:
        return Value(kind, (_float(b, op, convert(b, x, kind).leaves[0], convert(b, y, kind).leaves[0], kind),))
    if kind is BOOL:
        return Value(BOOL, (b.op(f"{INT_OPS[op]} i1 {x.leaves[0]}, {y.leaves[0]}"),))
    if kind is FLOAT and op in PRELUDE:
        return f"{PRELUDE[op]}_float"
    raise _unfit(op, x, y)


def _unfit(op: Operator, x: Value, y: Value) -> Unfit:
    return Unfit(f"there is no {x.kind!r} {SIGNS[op]} {y.kind!r}")


def _of_integers(b: Body, op: Operator, x: Value, y: Value) -> Value | str:
    if isinstance(x.known, int) and isinstance(y.known, int) and op in FOLDED:
        return number(FOLDED[op](int(x.known), int(y.known)))
    p, q = convert(b, x, INT).leaves[0], convert(b, y, INT).leaves[0]
    if op in (ast.LShift, ast.RShift):
        return Value(INT, (_shift(b, op, p, q, y.known),))
    if op in INT_OPS:
        return Value(INT, (b.op(f"{INT_OPS[op]} i64 {p}, {q}"),))
    if op is ast.Pow:
        raise Unfit(f"an integer to a power of which is not known that it is 0 to {LARGEST_POWER}; write float(...)")
    if op not in PRELUDE:
        raise _unfit(op, x, y)
    if isinstance(y.known, int) and y.known > 0:
        return _divide(b, op, p, int(y.known))
    return f"{PRELUDE[op]}_int"


def _float(b: Body, op: Operator, x: str, y: str, kind: Scalar = FLOAT) -> str:
    """x op y. A sum with a product has one rounding where the processor can, unless it is to be Python's."""
    (number,) = kind.leaves
    if b.fused and op in (ast.Add, ast.Sub) and (y in b.products or x in b.products):
        (p, q), rest = (b.products[y], x) if y in b.products else (b.products[x], y)
        if op is ast.Sub and y in b.products:
            p = b.op(f"fneg {number} {p}")
        elif op is ast.Sub:
            rest = b.op(f"fneg {number} {rest}")
        return b.math("llvm.fmuladd.f64", p, q, rest, kind=number)
    result = b.op(f"{FLOAT_OPS[op]} {number} {x}, {y}")
    if op is ast.Mult:
        b.products[result] = x, y
    return result


def _shift(b: Body, op: Operator, x: str, n: str, known: Any) -> str:
    """x << n or x >> n; an n that is negative or 64 and more shifts everything out."""
    how = "shl" if op is ast.LShift else "ashr"
    if isinstance(known, int) and 0 <= known < WORD:
        return b.op(f"{how} i64 {x}, {n}")
    few = b.op(f"icmp ult i64 {n}, {WORD}")
    shifted = b.op(f"{how} i64 {x}, {b.op(f'select i1 {few}, i64 {n}, i64 {WORD - 1}')}")
    return shifted if how == "ashr" else b.op(f"select i1 {few}, i64 {shifted}, i64 0")


def _divide(b: Body, op: Operator, x: str, n: int) -> Value:
    """x // n or x % n of integers for a known n > 0: a shift where n is a power of two."""
    if n & (n - 1) == 0:
        how = f"ashr i64 {x}, {n.bit_length() - 1}" if op is ast.FloorDiv else f"and i64 {x}, {n - 1}"
        return Value(INT, (b.op(how),))
    rest = b.op(f"srem i64 {x}, {n}")
    below = b.op(f"icmp slt i64 {rest}, 0")
    if op is ast.Mod:
        return Value(INT, (b.op(f"select i1 {below}, i64 {b.op(f'add i64 {rest}, {n}')}, i64 {rest}"),))
    quotient = b.op(f"sdiv i64 {x}, {n}")
    return Value(INT, (b.op(f"select i1 {below}, i64 {b.op(f'add i64 {quotient}, -1')}, i64 {quotient}"),))
