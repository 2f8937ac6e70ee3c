"""Expressions as Python functions give what a walk over them gives, errors too."""

import math

import numpy as np
import pytest

from sheldrake import symbolic as sym
from sheldrake.symbolic import Variable, _compiled, _traverse
from sheldrake.symbolic._compiled import Compiled, compiled

X = [Variable(f"x{k}") for k in range(3)]


def some_expressions():
    x, y, z = X
    return [
        x + 2.0 * y - 3.5, x * y * z, x**2 / (y**2 + 1), sym.sin(x) * sym.cos(y) + sym.tan(z), sym.exp(x * y),
        sym.sqrt(x**2 + 1) ** 3, sym.log(x**2 + 2), sym.atan2(x, y), sym.min(x, y) - sym.max(y, z), sym.abs(x - y),
        sym.asin(x / 10) + sym.acos(y / 10) + sym.atan(z), sym.sinh(x) + sym.cosh(y) - sym.tanh(z),
        sym.ceil(3 * x) + sym.floor(3 * y), sym.pow(x**2 + 1, y), -x, sym.Expression(2.5),
        sym.Expression(x), x**-2, -1e300 * x,
    ]  # fmt: skip


def test_values_are_those_of_the_walk():
    expressions = some_expressions()
    function, rng = compiled(expressions, X), np.random.default_rng(5)
    for _ in range(50):
        numbers = rng.uniform(-2.0, 2.0, 3).tolist()
        expected = _traverse.evaluate_nodes(expressions, dict(zip(X, numbers)))
        np.testing.assert_allclose(function(numbers), expected, rtol=1e-14)


def test_a_planted_fault_is_seen(monkeypatch):
    monkeypatch.setitem(_compiled._NAMES, "cos", math.sin)
    numbers = [0.3, 0.7, -0.2]
    function = compiled(some_expressions(), X)
    expected = _traverse.evaluate_nodes(some_expressions(), dict(zip(X, numbers)))
    assert not np.allclose(function(numbers), expected)


@pytest.mark.parametrize(
    ("expression", "numbers"),
    [(1 / X[0], [0.0]), (sym.sqrt(X[0]), [-1.0]), (sym.log(X[0]), [-1.0]), (sym.pow(X[0], 0.5), [-1.0])],
)
def test_errors_are_those_of_the_walk(expression, numbers):
    function, messages = Compiled([expression], X), set()
    for _ in range(2 * _compiled.PATIENCE):
        with pytest.raises((RuntimeError, ValueError)) as error:
            function([*numbers, 0.0, 0.0])
        messages.add(str(error.value))
    assert len(messages) == 1


def test_where_python_raises_the_answer_is_ieee_s():
    function = Compiled([sym.exp(X[0]), sym.log(X[1])], X)
    for _ in range(2 * _compiled.PATIENCE):
        assert list(function([1000.0, 0.0, 0.0])) == [math.inf, -math.inf]


def test_branches_are_walked():
    function = Compiled([sym.if_then_else(X[0] > 0, 1 / X[0], X[1])], X)
    for _ in range(2 * _compiled.PATIENCE):
        assert list(function([0.0, 3.0, 0.0])) == [3.0]
        assert list(function([2.0, 3.0, 0.0])) == [0.5]
