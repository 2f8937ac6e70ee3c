"""Polynomials made of a basis and the matrix between it: m' Q m."""

from __future__ import annotations

from typing import Any

from sheldrake.common._checked_late import checked_late
from sheldrake.symbolic import _build
from sheldrake.symbolic._decompose import add_to
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._monomial import Monomial
from sheldrake.symbolic._polynomial import Polynomial


@checked_late
def CalcPolynomialWLowerTriangularPart(monomial_basis: Any, gram_lower: Any) -> Polynomial:
    """Returns m' Q m for a vector of monomials m and a symmetric matrix Q, given by the columns of its lower half.

    Args:
        monomial_basis: Shape `(n,)`.
        gram_lower: Numbers, variables or expressions, shape `(n * (n + 1) / 2,)`.

    Raises:
        RuntimeError: the lengths do not fit.
    """
    basis, lower = list(monomial_basis), list(gram_lower)
    n = len(basis)
    if len(lower) != n * (n + 1) // 2:
        raise RuntimeError(
            f"CalcPolynomialWLowerTriangularPart(): {n} monomials need {n * (n + 1) // 2} numbers, got {len(lower)}."
        )
    out: dict[Monomial, Expression] = {}
    entries = iter(lower)
    for j in range(n):
        for i in range(j, n):
            c = _build.expect("CalcPolynomialWLowerTriangularPart", next(entries))
            add_to(out, basis[i] * basis[j], c if i == j else _build.scale(2.0, c))
    return Polynomial._of(out)
