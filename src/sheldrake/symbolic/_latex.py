"""Expressions, formulas and matrices for LaTeX."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np

from sheldrake.symbolic import _build
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._formula import Formula, negation
from sheldrake.symbolic._kinds import FormulaKind as K
from sheldrake.symbolic._variable import Variable

_SIGNS = {K.Eq: "=", K.Neq: r"\neq", K.Gt: ">", K.Geq: r"\ge", K.Lt: "<", K.Leq: r"\le"}
_OPPOSITE = {K.Eq: K.Neq, K.Neq: K.Eq, K.Gt: K.Leq, K.Geq: K.Lt, K.Lt: K.Geq, K.Leq: K.Gt}


def ToLatex(e: Any = None, precision: int = 3, *, f: Any = None, M: Any = None) -> str:
    """Returns LaTeX for an expression, a formula, a number, or a matrix of expressions or numbers.

    Args:
        e: What to write.
        precision: Digits after the point of numbers that are not whole.

    Raises:
        RuntimeError: for nan and uninterpreted functions.
    """
    what = e if e is not None else f if f is not None else M
    if what.__class__ is Expression:
        return _expression(what, precision)
    if isinstance(what, Formula):
        return _formula(what, precision)
    if isinstance(what, (np.ndarray, list, tuple)):
        matrix = np.asarray(what)
        matrix = matrix.reshape(-1, 1) if matrix.ndim == 1 else matrix
        return _matrix(matrix, precision)
    return _expression(_build.expect("ToLatex", what), precision)


def _matrix(matrix: np.ndarray, precision: int) -> str:
    rows = [" & ".join(ToLatex(x, precision) for x in row) for row in matrix]
    return r"\begin{bmatrix} " + r" \\ ".join(rows) + r" \end{bmatrix}"


_MOST_TIMES = 1000
"""Of pi and e, that are written as such."""


def _number(x: float, precision: int) -> str:
    if float(x).is_integer():
        return f"{x:.0f}"
    if math.isinf(x):
        return r"\infty" if x > 0 else r"-\infty"
    for value, name in ((math.pi, r"\pi"), (math.e, "e")):
        times = round(x / value) if abs(x) < _MOST_TIMES * value else 0
        if times and times * value == x:
            return {1: name, -1: f"-{name}"}.get(times, f"{times}{name}")
    return f"{x:.{precision}f}"


def _variable(v: Variable) -> str:
    return _name(v.get_name())


@functools.lru_cache(maxsize=1024)
def _name(name: str) -> str:
    """Indices in parentheses become subscripts."""
    return re.sub(r"\(([^)]*)\)", r"_{\1}", name)


def _expression(e: Expression, precision: int) -> str:
    def node(e: Expression, of: Callable[[Expression], str]) -> str:
        kind, args = e._kind, e._args
        if kind == k.VAR:
            return _variable(args[0])
        if kind == k.CONSTANT:
            return _number(args[0], precision)
        if kind == k.ADD:
            return _sum(args[0], [(of(t), c) for t, c in args[1]], precision)
        if kind == k.MUL:
            factors = [of(b) if x is _build.ONE else f"{of(b)}^{{{of(x)}}}" for b, x in args[1]]
            return " ".join([_number(args[0], precision), *factors] if args[0] != 1.0 else factors)
        if kind == k.NAN:
            raise RuntimeError("NaN is detected while visiting an expression.")
        if kind == k.UNINTERPRETED:
            raise RuntimeError("ToLatex does not support uninterpreted functions.")
        if kind == k.IF_THEN_ELSE:
            condition, then, otherwise = _formula(args[0], precision), of(args[1]), of(args[2])
            return (
                rf"\begin{{cases}} {then} & \text{{if }} {condition}, \\ {otherwise} & \text{{otherwise}}.\end{{cases}}"
            )
        return _TEMPLATES[kind] % tuple([of(a) for a in args])

    return _build.written(e, node)


def _sum(c0: float, terms: list[tuple[str, float]], precision: int) -> str:
    text = _number(c0, precision) if c0 != 0.0 else ""
    for term, c in terms:
        if c > 0.0:
            text += " + " if text else ""
        else:
            text += " - "
        text += term if abs(c) == 1.0 else _number(abs(c), precision) + term
    return f"({text})"


_TEMPLATES = {
    **{kind: rf"\{name}{{%s}}" for kind, name in k.UNARY_NAMES.items()},
    k.DIV: r"\frac{%s}{%s}",
    k.POW: "%s^{%s}",
    k.EXP: "e^{%s}",
    k.ABS: "|%s|",
    k.ATAN2: r"\atan{\frac{%s}{%s}}",
    k.MIN: r"\min\{%s, %s\}",
    k.MAX: r"\max\{%s, %s\}",
    k.CEIL: r"\lceil %s \rceil",
    k.FLOOR: r"\lfloor %s \rfloor",
}


def _formula(f: Formula, precision: int) -> str:
    kind, args = f._kind, f._args
    if kind in _SIGNS:
        return f"{_expression(args[0], precision)} {_SIGNS[kind]} {_expression(args[1], precision)}"
    if kind in (K.And, K.Or):
        return (r" \land " if kind is K.And else r" \lor ").join(_formula(part, precision) for part in args)
    if kind is K.Not:
        return _negated(args[0], precision)
    if kind is K.Var:
        return _variable(args[0])
    if kind is K.Isnan:
        return rf"\text{{isnan}}({_expression(args[0], precision)})"
    if kind is K.Forall:
        return rf"\forall {', '.join(_variable(v) for v in args[0])}: ({_formula(args[1], precision)})"
    if kind is K.PositiveSemidefinite:
        return rf"{_matrix(args[0], precision)} \succeq 0"
    return r"\text{true}" if kind is K.True_ else r"\text{false}"


def _negated(f: Formula, precision: int) -> str:
    kind, args = f._kind, f._args
    if kind in _SIGNS:
        a, b = (_expression(x, precision) for x in args)
        return f"{a} {_SIGNS[_OPPOSITE[kind]]} {b}"
    if kind in (K.And, K.Or):
        return (r" \lor " if kind is K.And else r" \land ").join(_formula(negation(part), precision) for part in args)
    return rf"\neg {_formula(f, precision)}"
