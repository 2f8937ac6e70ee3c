"""Polynomials made of a basis and the matrix between it: m' Q m."""

from __future__ import annotations

from typing import Any

from sheldrake.common._checked import checked
from sheldrake.symbolic import _build
from sheldrake.symbolic._keys import Sums, keys_for, number_or
from sheldrake.symbolic._polynomial import Polynomial


@checked
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
    keys = keys_for(basis)
    at, times, out = list(map(keys.key, basis)), keys.times, Sums()
    entries = iter(lower)
    for j in range(n):
        for i in range(j, n):
            c = _build.expect("CalcPolynomialWLowerTriangularPart", next(entries))
            out.add(times(at[i], at[j]), number_or(c), 1.0 if i == j else 2.0)
    return Polynomial._of(keys, out.whole())
