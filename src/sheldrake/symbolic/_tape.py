"""Expressions as a `Tape`, which a kernel evaluates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._build import ONE, nodes
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._kernels import tape as t
from sheldrake.symbolic._traverse import variables_of
from sheldrake.symbolic._variable import Variable

_UNARY = {
    k.LOG: t.LOG, k.ABS: t.ABS, k.EXP: t.EXP, k.SQRT: t.SQRT, k.SIN: t.SIN, k.COS: t.COS, k.TAN: t.TAN,
    k.ASIN: t.ASIN, k.ACOS: t.ACOS, k.ATAN: t.ATAN, k.SINH: t.SINH, k.COSH: t.COSH, k.TANH: t.TANH,
    k.CEIL: t.CEIL, k.FLOOR: t.FLOOR,
}  # fmt: skip
_BINARY = {k.POW: t.POWER, k.DIV: t.DIVIDE, k.ATAN2: t.ATAN2, k.MIN: t.MIN, k.MAX: t.MAX}


class _Writer:
    """Numbers that are known, by what they are, and operations as they are found.

    A number is ("constant", i), ("variable", i) or ("result", i) until it is known how many of each there are.
    """

    def __init__(self) -> None:
        self.constants: dict[str, float] = {}  # by their text, which tells 0.0 from -0.0
        self.operations: list[tuple[int, tuple[str, int], tuple[str, int]]] = []

    def constant(self, value: float) -> tuple[str, int]:
        text = repr(value)
        self.constants.setdefault(text, value)
        return "constant", list(self.constants).index(text)

    def apply(self, kind: int, a: tuple[str, int], b: tuple[str, int]) -> tuple[str, int]:
        self.operations.append((kind, a, b))
        return "result", len(self.operations) - 1

    def chain(self, kind: int, first: list[tuple[str, int]]) -> tuple[str, int]:
        """A sum or a product from left to right."""
        total = first[0]
        for item in first[1:]:
            total = self.apply(kind, total, item)
        return total


def tape_of(expressions: Sequence[Expression], variables: Sequence[Variable | None]) -> t.Tape | None:
    """The values of expressions as operations; None if one has a condition, or something else that has no kernel.

    Args:
        expressions: What is wanted.
        variables: What the first numbers stand for, in order; None: nothing that counts.
    """
    writer = _Writer()
    found: dict[int, tuple[str, int]] = {}
    places = {v.get_id(): ("variable", i) for i, v in enumerate(variables) if v is not None}
    for e in nodes(*expressions):
        number = _write(writer, e, found, places)
        if number is None:
            return None
        found[e._serial] = number
    n = len(variables)
    begin = {"variable": 0, "constant": n, "result": n + len(writer.constants)}
    operations = [
        (kind, *(begin[what] + i for what, i in (a, b)), begin["result"] + to)
        for to, (kind, a, b) in enumerate(writer.operations)
    ]
    results = [begin[what] + i for what, i in (found[e._serial] for e in expressions)]
    used = {v.get_id() for e in expressions for v in variables_of(e)}
    return t.Tape(
        np.array(operations, np.int64).reshape(-1, t.Operation.SIZE),
        np.array(list(writer.constants.values()), float),
        np.array([n], np.int64),
        np.array([i for i, v in enumerate(variables) if v is not None and v.get_id() in used], np.int64),
        np.array(results, np.int64),
    )


def _write(
    writer: _Writer, e: Expression, found: dict[int, tuple[str, int]], places: dict[int, tuple[str, int]]
) -> tuple[str, int] | None:
    """Writes what makes a part of those that are found; its number, None if there is no operation for it."""
    kind, args = e._kind, e._args

    def of(part: Expression) -> tuple[str, int]:
        return found[part._serial]

    if kind == k.CONSTANT:
        return writer.constant(float(args[0]))
    if kind == k.VAR:
        return places.get(args[0].get_id())
    if kind == k.ADD:
        terms = [of(x) if c == 1.0 else writer.apply(t.MULTIPLY, writer.constant(c), of(x)) for x, c in args[1]]
        return writer.chain(t.ADD, terms if args[0] == 0.0 else [writer.constant(args[0]), *terms])
    if kind == k.MUL:
        factors = [of(b) if power is ONE else writer.apply(t.POWER, of(b), of(power)) for b, power in args[1]]
        return writer.chain(t.MULTIPLY, factors if args[0] == 1.0 else [writer.constant(args[0]), *factors])
    if kind in _BINARY:
        return writer.apply(_BINARY[kind], of(args[0]), of(args[1]))
    if kind in _UNARY:
        return writer.apply(_UNARY[kind], of(args[0]), of(args[0]))
    return None
