"""Rows of programs with polynomials: what they say of coefficients, for values of the variables drawn at random."""

from __future__ import annotations

import gc

import numpy as np
import pytest

from sheldrake.solvers import MathematicalProgram
from sheldrake.symbolic import MonomialBasis, Polynomial, Variables


def set_up():
    """A program, its two indeterminates and a polynomial whose coefficients hold sums in sums."""
    prog = MathematicalProgram()
    x, y = prog.NewIndeterminates(2, "x")
    xs = Variables([x, y])
    V = prog.NewFreePolynomial(xs, 2)
    S, _ = prog.NewSosPolynomial(xs, 2)
    return prog, x, y, (S + V) * Polynomial((2.0 * x - 1.0) * y, xs) - 3.0 * V + Polynomial(x**4 + y**4 - 1.0, xs)


def residuals(rows, values):
    """What the left sides of rows have beyond the right ones."""
    return [b.evaluator().Eval([values[v] for v in b.variables()])[0] - b.evaluator().lower_bound()[0] for b in rows]


def coefficients(p, values):
    """The coefficients of a polynomial in the order of its monomials."""
    return [c.Evaluate(values) for c in p.monomial_to_coefficient_map().values()]


def drawn(prog):
    """A value for each variable."""
    vars = prog.decision_variables()
    return dict(zip(vars, np.random.default_rng(5).normal(size=len(vars))))


@pytest.mark.parametrize("kind", ["polynomial", "expression", "basis"])
def test_rows_are_the_coefficients_of_the_difference_from_the_form(kind):
    prog, x, y, p = set_up()
    given = p.ToExpression() if kind == "expression" else p
    if kind == "basis":
        basis = MonomialBasis(Variables([x, y]), 2)
        Q = prog.AddSosConstraint(given, basis)
    else:
        Q, basis = prog.AddSosConstraint(given)
    form = sum((Q[i, j] * (a * b).ToExpression() for i, a in enumerate(basis) for j, b in enumerate(basis)), 0.0 * x)
    rest, values = p - Polynomial(form, Variables([x, y])), drawn(prog)
    found = residuals(prog.linear_equality_constraints(), values)
    np.testing.assert_allclose(found, coefficients(rest, values), atol=1e-14)  # sums of a few numbers of order one
    for row in prog.linear_equality_constraints():
        ids = [v.get_id() for v in row.variables()]
        assert ids == sorted(ids)


def test_equal_polynomials_give_rows_where_they_differ():
    prog, x, y, p = set_up()
    a, b = prog.NewContinuousVariables(2, "a")
    q = p + Polynomial(a * x + 2.0 * (b - a) * x + x - b * y**5, p.indeterminates())
    rows = prog.AddEqualityConstraintBetweenPolynomials(p, q)
    values = drawn(prog)
    np.testing.assert_allclose(residuals(rows, values), coefficients((p - q).Expand(), values), atol=1e-14)
    assert len(rows) == 2


def test_products_of_decision_variables_may_cancel_and_are_refused_otherwise():
    prog, x, y, _ = set_up()
    a, b = prog.NewContinuousVariables(2, "a")
    xs = Variables([x, y])
    square = Polynomial((a + b) ** 2 * x + 3.0 * a, xs)
    rows = prog.AddEqualityConstraintBetweenPolynomials(square, Polynomial((a * a + 2.0 * a * b + b * b) * x, xs))
    assert [[v.get_name() for v in row.variables()] for row in rows] == [["a(0)"]]
    with pytest.raises(RuntimeError, match="non-linear"):
        prog.AddEqualityConstraintBetweenPolynomials(square, Polynomial(x, xs))
    with pytest.raises(RuntimeError, match="non-linear"):
        prog.AddSosConstraint(Polynomial(a * b * x**2, xs))


def test_a_basis_is_of_indeterminates():
    prog, x, _, p = set_up()
    a = prog.NewContinuousVariables(1, "a")[0]
    with pytest.raises(RuntimeError, match="indeterminates of the program"):
        prog.AddSosConstraint(p, MonomialBasis(Variables([x, a]), 2))


def test_programs_leave_nothing_that_has_to_be_looked_for():
    """What polynomials are made of goes with them; circles would wait for a collection."""

    def set_up_and_forget():
        prog = MathematicalProgram()
        xs = Variables(prog.NewIndeterminates(2, "x"))
        V = prog.NewFreePolynomial(xs, 4)
        prog.AddSosConstraint(V - prog.NewSosPolynomial(xs, 2)[0])
        prog.AddSosConstraint(V.ToExpression() * 2.0)

    set_up_and_forget()
    gc.collect()
    gc.disable()
    try:
        set_up_and_forget()
        assert gc.collect() == 0
    finally:
        gc.enable()
