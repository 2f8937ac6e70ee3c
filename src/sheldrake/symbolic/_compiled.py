"""Expressions as Python's own functions of their variables: one line for each different part."""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Callable, Iterable, Sequence
from types import CodeType
from typing import Any

from sheldrake.symbolic import _build, _numbers, _traverse
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._build import ONE, nodes
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._traverse import variables_of
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
        calls: How often they have been evaluated before.
    """

    def __init__(self, expressions: Sequence[Expression], variables: Iterable[Variable], calls: int = 0):
        self.expressions, self.variables = list(expressions), list(variables)
        self._calls = calls
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
                self._function = compiled(self.expressions, self.variables)
        if self._function is not None:
            try:
                return self._function(numbers)
            except (ArithmeticError, ValueError):
                pass  # the walk gives the answer of IEEE arithmetic, or says what is wrong
        return _traverse.evaluate_nodes(self.expressions, dict(zip(self.variables, numbers)))


def values(expressions: Sequence[Expression], env: dict[Variable, float]) -> Sequence[float]:
    """Values of expressions, the environment already checked: by a function of their own when asked for often."""
    if not expressions:
        return []
    first, others = expressions[0], expressions[1:]
    found = _build.found_of(first)
    calls, with_others, function = found.get(_VALUES, (0, (), None))
    if len(with_others) != len(others) or not all(map(operator.is_, with_others, others)):
        calls, function = 0, None
    if function is None:
        calls += 1
        if calls == PATIENCE:
            function = Compiled(expressions, frozenset().union(*map(variables_of, expressions)), PATIENCE - 1)
        found[_VALUES] = calls, others, function
    if function is not None:
        try:
            return function([env[v] for v in function.variables])
        except KeyError:
            pass  # the walk says of which variable, if it is wanted at all
    return _traverse.evaluate_nodes(expressions, env)


_VALUES = "values"


def compiled(
    expressions: Sequence[Expression], variables: Sequence[Variable]
) -> Callable[[Sequence[float]], tuple[float, ...]] | None:
    """A function of a sequence of floats; None where only a walk over the expressions can evaluate them.

    It raises ArithmeticError or ValueError where a walk might give inf or nan.
    """
    order = nodes(*expressions)
    places = {v.get_id(): i for i, v in enumerate(variables)}
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
    source = f"def function(x):\n{''.join(lines)} return [{found}]\n"
    # The text has numbers and the names made above, nothing that a user wrote.
    space = dict(_NAMES)
    exec(_code(source) if len(source) < _SHORT else source, space)
    function: Callable[[Sequence[float]], tuple[float, ...]] = space["function"]
    return function


_SHORT = 4000  # characters of text whose code is kept: programs made anew step after step say the same again


@functools.lru_cache(maxsize=256)
def _code(source: str) -> CodeType:
    return compile(source, "<expressions>", "exec")


def _text_of(e: Expression, names: dict[int, str], places: dict[int, int]) -> str | None:
    def power(base: Expression, exponent: Expression) -> str:
        is_whole = exponent._kind == k.CONSTANT and exponent._made[0].is_integer()
        text = "{} ** {}" if is_whole else "power({}, {})"
        return text.format(names[base._serial], names[exponent._serial])

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
        factors = [names[b._serial] if exponent is ONE else power(b, exponent) for b, exponent in args[1]]
        return " * ".join(factors if args[0] == 1.0 else [f"{args[0]!r}", *factors])
    if kind == k.DIV:
        return f"{names[args[0]._serial]} / {names[args[1]._serial]}"
    if kind == k.POW:
        return power(*args)
    if kind in _PLAIN:
        return f"{_PLAIN[kind]}({names[args[0]._serial]})"
    if kind in _numbers.UNARY:
        return f"unary_{kind}({names[args[0]._serial]})"
    if kind in _numbers.BINARY:
        return f"binary_{kind}({names[args[0]._serial]}, {names[args[1]._serial]})"
    return None
