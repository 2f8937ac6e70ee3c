"""Expressions as Drake writes them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._build import ONE, written
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._numbers import text_of as number

if TYPE_CHECKING:
    from collections.abc import Callable


def text_of(e: Expression) -> str:
    """The text of an expression."""
    return written(e, _text)


def _text(e: Expression, of: Callable[[Expression], str]) -> str:
    kind, args = e._kind, e._args
    if kind == k.VAR:
        return args[0]._name
    if kind == k.ADD:
        return _sum(args[0], [(t._made[0]._name if t._kind == k.VAR else of(t), c) for t, c in args[1]])
    if kind == k.MUL:
        factors = [number(args[0])] if args[0] != 1.0 else []
        for b, x in args[1]:
            base = b._made[0]._name if b._kind == k.VAR else of(b)
            factors.append(base if x is ONE else f"pow({base}, {of(x)})")
        return f"({' * '.join(factors)})"
    if kind == k.CONSTANT:
        return number(args[0])
    if kind == k.DIV:
        return f"({of(args[0])} / {of(args[1])})"
    if kind == k.NAN:
        return "NaN"
    if kind == k.IF_THEN_ELSE:
        return f"(if {args[0]} then {of(args[1])} else {of(args[2])})"
    if kind == k.UNINTERPRETED:
        return f"{args[0]}({', '.join([of(a) for a in args[1]])})"
    if len(args) == 1:
        return f"{k.UNARY_NAMES[kind]}({of(args[0])})"
    return f"{k.BINARY_NAMES[kind]}({of(args[0])}, {of(args[1])})"


def _sum(c0: float, terms: list[tuple[str, float]]) -> str:
    text = number(c0) if c0 != 0.0 else ""
    for term, c in terms:
        sign = " - " if not c > 0.0 else " + " if text else ""
        text += f"{sign}{term}" if c == 1.0 or c == -1.0 else f"{sign}{number(abs(c))} * {term}"
    return f"({text})"
