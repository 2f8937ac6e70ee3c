"""Expressions as Python's own functions of their variables: one line for each different part."""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Callable, Iterable, Sequence
from types import CodeType
from typing import Any

import numpy as np

from sheldrake.symbolic import _build, _numbers, _traverse
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._build import ONE, ZERO, nodes
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
_NOT_SMOOTH = {k.ABS, k.MIN, k.MAX, k.CEIL, k.FLOOR, k.IF_THEN_ELSE}
_VECTOR_NAMES: dict[str, Any] = {
    **{name: getattr(np, {"atan": "arctan"}.get(name, name)) for name in _PLAIN.values()},
    "power": np.power,
    "inf": math.inf,
    "__builtins__": {},
    **{
        f"unary_{kind}": function
        for kind, function in {
            k.LOG: np.log,
            k.ASIN: np.arcsin,
            k.ACOS: np.arccos,
            k.SINH: np.sinh,
            k.COSH: np.cosh,
        }.items()
    },
    **{f"binary_{kind}": function for kind, function in {k.POW: np.power, k.ATAN2: np.arctan2}.items()},
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
    source = _source(expressions, variables)
    return None if source is None else _made(source, _NAMES)


def _source(expressions: Sequence[Expression], variables: Iterable[Variable]) -> str | None:
    """Python's text of a function of numbers; None where only a walk over the expressions can evaluate them.

    Args:
        expressions: What the function gives.
        variables: What its arguments stand for.
    """
    return _source_of(nodes(*expressions), expressions, variables)


def _source_of(order: list[Expression], expressions: Sequence[Expression], variables: Iterable[Variable]) -> str | None:
    """The same where the nodes of the expressions are known, those within others first."""
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
    return f"def function(x):\n{''.join(lines)} return [{found}]\n"


def smooth_source(expressions: Sequence[Expression], variables: Iterable[Variable]) -> str | None:
    """Text that is the same for expressions that differ by their variables alone; None where they are not smooth."""
    order = nodes(*expressions)
    if not _NOT_SMOOTH.isdisjoint([e._kind for e in order]):
        return None
    return _source_of(order, expressions, variables)


def _made(source: str, names: dict[str, Any]) -> Callable[[Any], Any]:
    # The text has numbers and the names made above, nothing that a user wrote.
    space = dict(names)
    exec(_code(source) if len(source) < _SHORT else source, space)
    return space["function"]


_SHORT = 4000  # characters of text whose code is kept: programs made anew step after step say the same again
_MOST_KNOWN = 256
_KNOWN: dict[tuple[str, tuple[int, ...]], Vectorized] = {}


@functools.lru_cache(maxsize=_MOST_KNOWN)
def _code(source: str) -> CodeType:
    return compile(source, "<expressions>", "exec")


class Vectorized:
    """Values and derivatives of expressions at many points at once, by NumPy; inf or nan outside of their domains.

    Made by `Vectorized.of`.
    """

    _source: str
    _expressions: list[Expression]
    _variables: list[Variable]

    @classmethod
    def of(cls, expressions: Sequence[Expression], variables: Iterable[Variable]) -> Vectorized | None:
        """Expressions as functions of variables; None where they are not smooth, or only a walk can evaluate them."""
        source = smooth_source(expressions, variables)
        return None if source is None else cls.of_source(source, expressions, variables)

    @classmethod
    def of_source(cls, source: str, expressions: Sequence[Expression], variables: Iterable[Variable]) -> Vectorized:
        """The same where `smooth_source` is known; what has the same text is the same function of its variables."""
        own = list(variables)
        ages = [v.get_id() for v in own]  # in whose order derivatives write sums and products
        key = source, tuple(sorted(range(len(own)), key=ages.__getitem__))
        found = _KNOWN.get(key)
        if found is None:
            found = cls.__new__(cls)
            found._source, found._expressions, found._variables = source, list(expressions), own
            if len(source) < _SHORT:
                if len(_KNOWN) >= _MOST_KNOWN:
                    _KNOWN.clear()
                _KNOWN[key] = found
        return found

    def __call__(self, points: np.ndarray, with_slopes: bool) -> tuple[np.ndarray, np.ndarray]:
        """Values, shape (points, m), and derivatives, shape (points, m, n) or, if not wanted, (points, 0, n)."""
        return (
            self.slopes(points) if with_slopes else (self.values(points), np.zeros((len(points), 0, points.shape[1])))
        )

    def values(self, points: np.ndarray) -> np.ndarray:
        """Values at points of shape (points, n), shape (points, m)."""
        return self._of_values(points)

    def slopes(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values, shape (points, m), and their derivatives, shape (points, m, n)."""
        function, places = self._of_slopes
        count, m, n = len(points), len(self._expressions), len(self._variables)
        found, J = function(points), np.zeros((count, m * n))
        J[:, places] = found[:, m:]
        return found[:, :m], J.reshape(count, m, n)

    def hessian(self, points: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Second derivatives of the values times weights of shape (points, m), shape (points, n, n)."""
        function, outputs, columns, places = self._of_curvature
        count, n = len(points), len(self._variables)
        H = np.zeros((count, n * n))
        if len(outputs):
            found = function(points) * weights[:, outputs]
            at = places if count == 1 else (places + (n * n * np.arange(count))[:, None]).ravel()
            H += np.bincount(at, found[:, columns].ravel(), H.size).reshape(H.shape)
        return H.reshape(count, n, n)

    @functools.cached_property
    def _of_values(self) -> _AtPoints:
        return _AtPoints(self._source)

    @functools.cached_property
    def _first(self) -> list[tuple[int, int, Expression]]:
        """Derivatives that are not zero everywhere: of which value, by which variable."""
        found = [
            (i, j, e.Differentiate(v))
            for i, e in enumerate(self._expressions)
            for j, v in enumerate(self._variables)
            if v in variables_of(e)
        ]
        return [entry for entry in found if entry[2] is not ZERO]

    @functools.cached_property
    def _of_slopes(self) -> tuple[_AtPoints, np.ndarray]:
        """Values and derivatives, and where these are in a full matrix."""
        first = self._first
        source = _source([*self._expressions, *(e for _, _, e in first)], self._variables)
        assert source is not None  # the derivatives of what can be written down can be, too
        return _AtPoints(source), np.array([i * len(self._variables) + j for i, j, _ in first], dtype=int)

    @functools.cached_property
    def _of_curvature(self) -> tuple[_AtPoints, list[int], np.ndarray, np.ndarray]:
        """Second derivatives, and of which values they are; for each entry of a full matrix, which one, and where."""
        second = [
            (i, a, b, e.Differentiate(self._variables[b]))
            for i, a, e in self._first
            for b in range(a + 1)
            if self._variables[b] in variables_of(e)
        ]
        second = [entry for entry in second if entry[3] is not ZERO]
        source = _source([entry[3] for entry in second], self._variables)
        assert source is not None
        n, outputs = len(self._variables), [i for i, *_ in second]
        both = [(j, place) for j, (_, a, b, _) in enumerate(second) for place in {a * n + b, b * n + a}]
        columns, places = np.array(both, dtype=int).reshape(-1, 2).T
        return _AtPoints(source), outputs, columns, places


class _AtPoints:
    """A function of text at many points by NumPy; at one by Python's own numbers, which takes a tenth of the time.

    Args:
        source: The text.
    """

    def __init__(self, source: str):
        self._source = source

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Values at points of shape (points, n), shape (points, m)."""
        if len(points) == 1:
            try:
                return np.array([self._of_numbers(points[0].tolist())], dtype=float)
            except (ArithmeticError, ValueError):
                pass  # NumPy has inf or nan there
        return _columns(self._of_columns(points.T), len(points))

    @functools.cached_property
    def _of_numbers(self) -> Callable[[Any], Any]:
        return _made(self._source, _NAMES)

    @functools.cached_property
    def _of_columns(self) -> Callable[[Any], Any]:
        return _made(self._source, _VECTOR_NAMES)


def _columns(found: Sequence[Any], count: int) -> np.ndarray:
    out = np.empty((count, len(found)))
    for j, column in enumerate(found):
        out[:, j] = column
    return out


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
