"""Products that are put together in one go are those that multiplying factor by factor makes."""

import itertools

import pytest

from sheldrake.symbolic import Expression, MakeVectorVariable, Monomial, Polynomial, pow, sin

a, b, c, d = MakeVectorVariable(4, "x")
AT = {a: 0.7, d: 1.3}
FACTORS = [
    Expression(0.0), Expression(-1.0), Expression(2.0), a + 0.0, d + 0.0, a + d, -2.0 * (a + d), a * d, 3.0 * a / d,
    1.0 / a, a**2, pow(a, -1.0), pow(a + d, 0.5), sin(a), -sin(d) * a,
]  # fmt: skip


@pytest.mark.parametrize("coefficient", [1.0, -1.0, 0.5])
def test_substituting_is_multiplying(coefficient):
    for p, q in itertools.product(FACTORS, repeat=2):
        x, y = p.Evaluate(AT), q.Evaluate(AT)
        for e, value in ((b * c, x * y), (b**2 * c, x**2 * y), (d * b * c**3, 1.3 * x * y**3)):
            found = (coefficient * e).Substitute({b: p, c: q})
            assert found.Evaluate(AT) == pytest.approx(coefficient * value, rel=1e-14)  # of five products
        assert (b * c).Substitute({b: p, c: q}).EqualTo(p * q), (p, q)


@pytest.mark.parametrize("coefficient", FACTORS[1:])
def test_polynomials_are_sums_of_products_of_coefficients_and_monomials(coefficient):
    p = Polynomial(
        {Monomial(b, 2): coefficient, Monomial({b: 1, c: 3}): 2.0 * coefficient, Monomial(): coefficient + d}
    )
    terms = [e * m.ToExpression() for m, e in p.monomial_to_coefficient_map().items()]
    assert p.ToExpression().EqualTo(sum(terms, Expression(0.0)))
