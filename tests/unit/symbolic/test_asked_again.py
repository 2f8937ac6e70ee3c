"""What is asked of an expression again is what was found before, and asking much at once is asking for each."""

import numpy as np
import pytest

from sheldrake.symbolic import (
    Evaluate,
    Expression,
    Jacobian,
    MakeVectorVariable,
    Polynomial,
    Substitute,
    Variable,
    Variables,
    abs,
    cos,
    exp,
    if_then_else,
    log,
    sin,
    sqrt,
)

X = MakeVectorVariable(4, "x")
a, b, c, d = X


def some_expressions():
    return [
        sin(a * b) / (2.0 + cos(c)) + a * (b - 3.0 * c) ** 2,
        exp(a - d) * sqrt(1.0 + b**2) - d,
        (a + 2.0 * b) * (c - d) * (a + c),
        a**b + (a * c) ** 3 / (1.0 + d),
        X @ (np.eye(4) + 0.5) @ X,
        if_then_else(a > 0.2, a * d, b),
        Expression(3.0),
        Expression(a),
    ]


POINT = dict(zip(X, [0.4, 0.7, -0.3, 1.1]))


@pytest.mark.parametrize("index", range(8))
def test_derivatives_are_slopes(index):
    for v in X:
        e = some_expressions()[index]
        above, below = (e.Evaluate({**POINT, v: POINT[v] + h}) for h in (1e-6, -1e-6))
        assert e.Differentiate(v).Evaluate(POINT) == pytest.approx((above - below) / 2e-6, abs=1e-7)


def test_a_jacobian_has_the_derivatives_one_by_one():
    J = Jacobian(some_expressions(), X)
    for e, row in zip(some_expressions(), J):
        assert all(slope.EqualTo(e.Differentiate(v)) for slope, v in zip(row, X))
        assert all(one.EqualTo(other) for one, other in zip(e.Jacobian(X[::-1]), row[::-1]))
    again = some_expressions()[0]
    assert again.Differentiate(a) is again.Differentiate(a)


def test_many_evaluations_are_as_the_first():
    rng = np.random.default_rng(0)
    es = some_expressions()
    for _ in range(30):
        point = dict(zip(X, rng.uniform(0.1, 2.0, 4)))
        new = some_expressions()
        assert [e.Evaluate(point) for e in es] == [e.Evaluate(point) for e in new]
        np.testing.assert_array_equal(Evaluate(es, point), Evaluate(new, point))
        np.testing.assert_array_equal(Evaluate(es[:2], point), Evaluate(new[:2], point))


def test_errors_stay_after_many_evaluations():
    e = sqrt(a) / b
    for _ in range(20):
        assert e.Evaluate({a: 4.0, b: 2.0}) == 1.0
    with pytest.raises(RuntimeError, match="Division by zero"):
        e.Evaluate({a: 4.0, b: 0.0})
    with pytest.raises(ValueError, match="out of domain"):
        e.Evaluate({a: -4.0, b: 1.0})
    with pytest.raises(RuntimeError, match="does not have an entry for the variable x\\(1\\)"):
        e.Evaluate({a: 4.0})
    with pytest.raises(RuntimeError, match="NaN"):
        e.Evaluate({a: 4.0, b: 1.0, c: float("nan")})


@pytest.mark.parametrize("index", range(8))
def test_substitution_and_evaluation_agree(index):
    e = some_expressions()[index]
    places = {a: b + c, b: 2.0 * d, d: Expression(0.9)}
    inner = {v: Expression(places.get(v, v)).Evaluate(POINT) for v in X}
    assert e.Substitute(places).Evaluate(POINT) == pytest.approx(e.Evaluate(inner), rel=1e-13)
    assert Substitute([e], places)[0, 0].EqualTo(e.Substitute(places))
    assert e.Substitute({Variable("other"): Expression(1.0)}).EqualTo(e)


def test_quotients_in_products_keep_their_order():
    quotient = Expression(1.0) / d
    assert (a * b * c).Substitute({b: quotient}).EqualTo(a * quotient * c)
    assert (2.0 * a * abs(b)).Substitute({a: quotient}).EqualTo(2.0 * quotient * abs(b))


def test_expanding_twice_changes_nothing():
    e = (a + 2.0 * b - c) ** 3 * (a - d) + a / 4.0
    expanded = e.Expand()
    assert e.Expand() is expanded and expanded.Expand() is expanded
    assert expanded.Evaluate(POINT) == pytest.approx(e.Evaluate(POINT), rel=1e-13)
    assert Polynomial(e).ToExpression().EqualTo(expanded)
    assert (a * b - b * a + 2.0).Expand().EqualTo(Expression(2.0))


def test_polynomials_with_and_without_other_variables():
    e = (a + b * c) ** 2 - 3.0 * d
    p, q = Polynomial(e), Polynomial(e, Variables([a, c]))
    assert p.Evaluate(POINT) == pytest.approx(e.Evaluate(POINT)) == pytest.approx(q.Evaluate(POINT))
    A, v, b0 = Polynomial(b * a**2 + (d - 2.0 * b) * c + 1.0, Variables([a, c])).EvaluateWithAffineCoefficients(
        [a, c], np.array([[0.4, 1.0], [-0.3, 2.0]])
    )
    np.testing.assert_allclose(A @ [POINT[x] for x in v] + b0, [0.7 * 0.16 + (1.1 - 1.4) * -0.3 + 1.0, 0.7 - 0.6 + 1.0])


def test_numbers_in_the_place_of_all_variables_need_both_branches():
    x, y = Variable("x"), Variable("y")
    e = if_then_else(x > 0, log(x), y * y) + sin(x) * y
    assert e.EvaluatePartial({x: 2.0, y: 3.0}).EqualTo(Expression(e.Evaluate({x: 2.0, y: 3.0})))
    assert e.Evaluate({x: -2.0, y: 3.0}) == 9.0 + np.sin(-2.0) * 3.0
    with pytest.raises(ValueError, match="log"):
        e.EvaluatePartial({x: -2.0, y: 3.0})
