"""Expressions as operations: values are those of the walk, derivatives those of the expressions' own derivatives."""

import numpy as np
import pytest

from sheldrake import symbolic as sym
from sheldrake.symbolic import Variable
from sheldrake.symbolic._kernels import tape as kernels
from sheldrake.symbolic._tape import AtPoints, write

X = [Variable(f"x{k}") for k in range(3)]


def smooth_expressions():
    x, y, z = X
    return [
        x + 2.0 * y - 3.5, x * y * z, x**2 / (y**2 + 1), sym.sin(x) * sym.cos(y) + sym.tan(z), sym.exp(x * y),
        sym.sqrt(x**2 + 1) ** 3, sym.log(x**2 + 2), sym.atan2(x, y), sym.asin(x / 10) + sym.acos(y / 10),
        sym.atan(z) * x, sym.sinh(x) + sym.cosh(y) - sym.tanh(z), sym.pow(x**2 + 1, y), -x, sym.Expression(2.5),
        sym.Expression(x), x**-2, x**0.5 * y, (x * y + z) ** 2 * sym.sin(x * y + z), z**3,
    ]  # fmt: skip


def evaluated(expressions, point):
    env = dict(zip(X, point))
    return np.array([sym.Expression(e).Evaluate(env) for e in expressions])


@pytest.fixture(scope="module")
def points():
    return np.random.default_rng(3).uniform(0.1, 2.0, (7, 3))


def found_at(expressions, points):
    found = AtPoints(write([sym.Expression(e) for e in expressions], X, smooth=True))
    weights = np.random.default_rng(4).normal(size=(len(points), len(expressions)))
    return *found(points, True), found.hessian(points, weights), weights


def test_values_and_two_derivatives(points):
    expressions = smooth_expressions()
    values, slopes, H, weights = found_at(expressions, points)
    first = [[sym.Expression(e).Differentiate(v) for v in X] for e in expressions]
    for p, point in enumerate(points):
        np.testing.assert_allclose(values[p], evaluated(expressions, point), rtol=1e-14)
        np.testing.assert_allclose(slopes[p], [evaluated(row, point) for row in first], rtol=1e-13, atol=1e-13)
        second = np.array([[evaluated([e.Differentiate(v) for v in X], point) for e in row] for row in first])
        np.testing.assert_allclose(H[p], np.tensordot(weights[p], second, 1), rtol=1e-12, atol=1e-12)


def test_a_planted_fault_is_seen(points, monkeypatch):
    expressions = [sym.sin(X[0]) * X[1]]
    monkeypatch.setitem(sym._tape._SMOOTH, sym._kinds.SIN, kernels.COS)
    values, slopes, _, _ = found_at(expressions, points)
    assert not np.allclose(values[0], evaluated(expressions, points[0]))
    assert not np.allclose(slopes[0, 0, 0], np.cos(points[0, 0]) * points[0, 1])


def test_what_does_not_count_is_no_number_times_zero():
    """Where a slope is infinite, values that do not depend on it, and powers of zero, have theirs."""
    x, y, _ = X
    _, slopes, H, weights = found_at(
        [sym.sqrt(x) + y**2, x**2 * y + x, x * y, 3.0 * y + x**1.0], np.array([[0.0, 2.0, 1.0]])
    )
    np.testing.assert_array_equal(slopes[0], [[np.inf, 4.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 3.0, 0.0]])
    assert H[0, 1, 1] == 2.0 * weights[0, 0] and not H[0, 2].any()


def test_outside_of_domains_there_is_no_number():
    x, y, _ = X
    values, _, _, _ = found_at(
        [sym.log(x), sym.sqrt(x), 1.0 / y, sym.pow(x, 0.5), sym.log(y)], np.array([[-1.0, 0.0, 1.0]])
    )
    np.testing.assert_array_equal(values[0], [np.nan, np.nan, np.inf, np.nan, -np.inf])


@pytest.mark.parametrize("f", [sym.abs, sym.ceil, sym.floor, lambda x: sym.min(x, 1.0), lambda x: sym.max(x, 1.0)])
def test_what_has_kinks_is_written_only_if_that_is_allowed(f):
    assert write([f(X[0])], X) is not None and write([f(X[0])], X, smooth=True) is None


def test_conditions_and_other_variables_are_not_written():
    x, y, _ = X
    assert write([sym.if_then_else(x > 0.0, x, y)], X) is None
    assert write([x + Variable("other")], X) is None


def test_a_deep_expression_is_written():
    e = sym.Expression(X[0])
    for _ in range(3000):
        e = sym.sin(e)
    values, slopes = AtPoints(write([e], X, smooth=True))(np.full((1, 3), 0.5), True)
    expected, slope = 0.5, 1.0
    for _ in range(3000):
        expected, slope = np.sin(expected), slope * np.cos(expected)
    np.testing.assert_allclose((values[0, 0], slopes[0, 0, 0]), (expected, slope), rtol=1e-12)


def test_what_is_there_twice_is_computed_once():
    x, y, z = X
    part = sym.sin(x * y)
    assert write([part * z, part + z], X).operations[::4] == [
        kernels.MULTIPLY,
        kernels.SIN,
        kernels.MULTIPLY,
        kernels.ADD,
    ]
