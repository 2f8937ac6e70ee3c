"""The degree that is seen at once is that of the polynomial, and what is none is told."""

import numpy as np

from sheldrake import symbolic as sym
from sheldrake.symbolic import Expression, Polynomial, Variable, _decompose, _traverse

X = [Variable(name) for name in "xyz"]


def random_expression(rng, depth):
    what = rng.integers(0, 9 if depth else 4)
    if what < 3:
        return Expression(X[what])
    if what == 3:
        return Expression(float(rng.integers(-2, 3)))
    a = random_expression(rng, depth - 1)
    if what == 4:
        return a ** int(rng.integers(1, 4))
    if what == 5:
        return a * random_expression(rng, depth - 1)
    if what == 6:
        return [a / 2.0, sym.sin(a), sym.pow(a**2 + 1.0, 0.5), 1.0 / (a**2 + 1.0)][rng.integers(0, 4)]
    return a + random_expression(rng, depth - 1) if what == 7 else a - random_expression(rng, depth - 1)


def test_degrees_of_random_expressions():
    rng, seen = np.random.default_rng(0), set()
    for _ in range(1500):
        e = random_expression(rng, 4)
        degree = _decompose.degree_of(e)
        assert (degree == _decompose.NO_POLYNOMIAL) == (not _traverse.is_polynomial(e))
        if degree > 2:
            assert Polynomial(e).TotalDegree() == degree
        seen.add(min(degree, 3))
    assert seen == {-1, 0, 1, 2, 3}


def test_what_may_cancel_is_not_certain():
    x, y, _ = X
    assert _decompose.degree_of((x + y) ** 2 * x - x * (x**2 + 2 * x * y + y**2)) == _decompose.UNCERTAIN
    assert _decompose.degree_of((x + y) ** 3 * x - x * y) == 4


def test_many_shared_parts_are_looked_at_once():
    x, _, _ = X
    e = x + 1.0
    for _ in range(60):
        e = (e + 1.0) * (e + 2.0)
    assert _decompose.degree_of(e) == 2**60
