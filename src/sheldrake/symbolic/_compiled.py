"""Expressions as Python's own functions of their variables: one line for each different part."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic import _numbers, _traverse
from sheldrake.symbolic._build import ONE, nodes
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._variable import Variable

PATIENCE = 8
"""Calls that walk over the expressions before they are compiled."""

_MOST_PARTS = 20_000
_PLAIN = {k.SIN: "sin", k.COS: "cos", k.TAN: "tan", k.EXP: "exp", k.SQRT: "sqrt", k.ATAN: "atan", k.TANH: "tanh"}
_NAMES: dict[str, Any] = {
    **{name: getattr(math, name) for name in _PLAIN.values()},
    **{f"unary_{kind}": function for kind, function in _numbers.UNARY.items()},
    **{f"binary_{kind}": function for kind, function in _numbers.BINARY.items()},
    "power": _numbers.power,
    "inf": math.inf,
    "__builtins__": {},
}


class Compiled:
    """Values of expressions as a function of numbers, as `Expression.Evaluate` gives them.

    Args:
        expressions: What is wanted.
        variables: What the numbers stand for, in order.
    """

    def __init__(self, expressions: Sequence[Expression], variables: Sequence[Variable]):
        self._expressions, self._variables = list(expressions), list(variables)
        self._calls = 0
        self._function: Callable[[Sequence[float]], tuple[float, ...]] | None = None

    def __call__(self, numbers: Sequence[float]) -> Sequence[float]:
        """The values.

        Raises:
            RuntimeError: a division by zero, or an expression has no value.
            ValueError: a function is asked outside its domain.
        """
        if self._function is None:
            self._calls += 1
            if self._calls == PATIENCE:
                self._function = compiled(self._expressions, self._variables)
        if self._function is not None:
            try:
                return self._function(numbers)
            except (ArithmeticError, ValueError):
                pass  # the walk gives the answer of IEEE arithmetic, or says what is wrong
        return _traverse.evaluate_nodes(self._expressions, dict(zip(self._variables, numbers)))


def compiled(
    expressions: Sequence[Expression], variables: Sequence[Variable]
) -> Callable[[Sequence[float]], tuple[float, ...]] | None:
    """A function of a sequence of floats; None where only a walk over the expressions can evaluate them.

    It raises ArithmeticError or ValueError where a walk might give inf or nan.
    """
    places = {v.get_id(): i for i, v in enumerate(variables)}
    order = nodes(*expressions)
    if len(order) > _MOST_PARTS:
        return None
    lines: list[str] = []
    names: dict[int, str] = {}
    for e in order:
        text = _text_of(e, names, places)
        if text is None:
            return None
        if e._kind == k.CONSTANT:
            names[e._serial] = text
        else:
            names[e._serial] = name = f"t{len(lines)}"
            lines.append(f" {name} = {text}\n")
    found = ", ".join(names[e._serial] for e in expressions)
    # The text has numbers and the names made above, nothing that a user wrote.
    space = dict(_NAMES)
    exec(f"def function(x):\n{''.join(lines)} return [{found}]\n", space)
    return space["function"]


def _text_of(e: Expression, names: dict[int, str], places: dict[int, int]) -> str | None:
    kind, args = e._kind, e._args
    if kind == k.CONSTANT:
        return f"({args[0]!r})"
    if kind == k.VAR:
        place = places.get(args[0].get_id())
        return None if place is None else f"x[{place}]"
    if kind == k.ADD:
        terms = [names[t._serial] if c == 1.0 else f"{c!r} * {names[t._serial]}" for t, c in args[1]]
        return " + ".join(terms if args[0] == 0.0 else [f"{args[0]!r}", *terms])
    if kind == k.MUL:
        factors = [
            names[b._serial] if exponent is ONE else f"power({names[b._serial]}, {names[exponent._serial]})"
            for b, exponent in args[1]
        ]
        return " * ".join(factors if args[0] == 1.0 else [f"{args[0]!r}", *factors])
    if kind == k.DIV:
        return f"{names[args[0]._serial]} / {names[args[1]._serial]}"
    if kind in _PLAIN:
        return f"{_PLAIN[kind]}({names[args[0]._serial]})"
    if kind in _numbers.UNARY:
        return f"unary_{kind}({names[args[0]._serial]})"
    if kind in _numbers.BINARY:
        return f"binary_{kind}({names[args[0]._serial]}, {names[args[1]._serial]})"
    return None
