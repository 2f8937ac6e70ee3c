"""Polynomials with decision variables as coefficients, and sums of squares."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from sheldrake.common._enums import BoundEnum
from sheldrake.common._kinds import count, instance_of, text
from sheldrake.common._overloads import Mismatch, dispatch, overload
from sheldrake.solvers import _kinds as kinds
from sheldrake.symbolic import (
    EvenDegreeMonomialBasis,
    Expression,
    Monomial,
    MonomialBasis,
    OddDegreeMonomialBasis,
    Polynomial,
    Variables,
)


class NonnegativePolynomial(BoundEnum):
    """Ways to say that a polynomial is not negative."""

    kSos = 1
    kSdsos = 2
    kDsos = 3


NonnegativePolynomial.__qualname__ = "MathematicalProgram.NonnegativePolynomial"
_SOS = NonnegativePolynomial.kSos


def _basis(value: Any) -> np.ndarray:
    array = np.asarray(value, dtype=object)
    if array.ndim == 0 or not all(isinstance(m, Monomial) for m in array.flat):
        raise Mismatch
    return array.ravel()


_kind = (instance_of(NonnegativePolynomial), _SOS)


class ProgramPolynomials:
    """Free and nonnegative polynomials."""

    NonnegativePolynomial = NonnegativePolynomial

    def MakePolynomial(self, e: Any) -> Polynomial:
        """Returns an expression as a polynomial in the indeterminates of this program."""
        e = kinds.expression(e)
        return Polynomial(e, Variables([v for v in e.GetVariables() if v.get_id() in self._indeterminate_places]))  # type: ignore

    def Reparse(self, p: Polynomial) -> None:
        """Makes the indeterminates of this program those of a polynomial."""
        p.SetIndeterminates(Variables(self._indeterminates))  # type: ignore[attr-defined]

    def _reparsed(self, p: Polynomial) -> Polynomial:
        return self.MakePolynomial(p.ToExpression())

    def _free(self, basis: np.ndarray, coeff_name: str) -> Polynomial:
        coefficients = self.NewContinuousVariables(len(basis), coeff_name)  # type: ignore[attr-defined]
        return Polynomial({m: Expression(c) for m, c in zip(basis, coefficients)})

    def NewFreePolynomial(self, indeterminates: Variables, deg: int, coeff_name: str = "a") -> Polynomial:
        """Returns a polynomial of a degree with new variables as coefficients."""
        return self._free(MonomialBasis(indeterminates, deg), coeff_name)

    def NewEvenDegreeFreePolynomial(self, indeterminates: Variables, degree: int, coeff_name: str = "a") -> Polynomial:
        """Returns a polynomial with new variables as coefficients of the monomials of even degree."""
        return self._free(EvenDegreeMonomialBasis(indeterminates, degree), coeff_name)

    def NewOddDegreeFreePolynomial(self, indeterminates: Variables, degree: int, coeff_name: str = "a") -> Polynomial:
        """Returns a polynomial with new variables as coefficients of the monomials of odd degree."""
        return self._free(OddDegreeMonomialBasis(indeterminates, degree), coeff_name)

    # Nonnegative polynomials

    def NewSosPolynomial(self, *args: Any, **kwargs: Any) -> Any:
        """Returns a nonnegative polynomial m' Q m and its Gram matrix Q.

        Called as `(monomial_basis, type, gram_name)`, `(indeterminates, degree, type, gram_name)`; or
        `(gramian, monomial_basis, type)` with a given matrix, which returns the polynomial alone.

        Raises:
            RuntimeError: the degree is odd or negative.
        """

        def of_basis(self: Any, basis: np.ndarray, type: Any, gram_name: str) -> tuple:
            Q = self.NewSymmetricContinuousVariables(len(basis), gram_name)
            return self._nonnegative_form(Q, basis, type), Q

        def of_degree(self: Any, indeterminates: Variables, degree: int, type: Any, gram_name: str) -> tuple:
            if degree < 0 or degree % 2:
                raise RuntimeError(
                    f"NewSosPolynomial: degree must be a nonnegative even integer, but {degree} is given instead."
                )
            if degree == 0:
                Q = self.NewContinuousVariables(1, 1, gram_name)
                self.AddBoundingBoxConstraint(0.0, np.inf, Q)
                return quadratic_form(Q, MonomialBasis(indeterminates, 0)), Q
            return of_basis(self, MonomialBasis(indeterminates, degree // 2), type, gram_name)

        name = (text, "S")
        ways = [
            overload(of_basis, monomial_basis=_basis, type=_kind, gram_name=name),
            overload(
                lambda self, Q, m, type: self._nonnegative_form(Q, m, type),
                gramian=kinds.expressions,
                monomial_basis=_basis,
                type=_kind,
            ),
            overload(of_degree, indeterminates=kinds.variables, degree=count, type=_kind, gram_name=name),
        ]
        return dispatch("NewSosPolynomial", ways, self, args, kwargs)

    def _nonnegative_form(self, Q: np.ndarray, basis: np.ndarray, type: NonnegativePolynomial) -> Polynomial:
        if type is _SOS:
            self.AddPositiveSemidefiniteConstraint(Q)  # type: ignore[attr-defined]
        elif type is NonnegativePolynomial.kSdsos:
            self.AddScaledDiagonallyDominantMatrixConstraint(Q)  # type: ignore[attr-defined]
        else:
            self.AddPositiveDiagonallyDominantMatrixConstraint(Q)  # type: ignore[attr-defined]
        return quadratic_form(Q, basis)

    def NewEvenDegreeNonnegativePolynomial(
        self, indeterminates: Variables, degree: int, type: NonnegativePolynomial
    ) -> tuple[Polynomial, np.ndarray, np.ndarray]:
        """Returns a nonnegative polynomial of even monomials, and the Gram matrices of odd and even monomials."""
        if degree < 0 or degree % 2:
            raise RuntimeError(f"NewEvenDegreeNonnegativePolynomial: the degree must be even, not {degree}.")
        parts = []
        for basis in (
            OddDegreeMonomialBasis(indeterminates, degree // 2),
            EvenDegreeMonomialBasis(indeterminates, degree // 2),
        ):
            Q = self.NewSymmetricContinuousVariables(len(basis), "S")  # type: ignore[attr-defined]
            parts.append((self._nonnegative_form(Q, basis, type) if len(basis) else Polynomial(), Q))
        (odd, Q_odd), (even, Q_even) = parts
        return odd + even, Q_odd, Q_even

    def NewEvenDegreeSosPolynomial(self, indeterminates: Variables, degree: int) -> tuple:
        """Returns a sum of squares of even monomials, and its Gram matrices of odd and even monomials."""
        return self.NewEvenDegreeNonnegativePolynomial(indeterminates, degree, _SOS)

    def NewEvenDegreeSdsosPolynomial(self, indeterminates: Variables, degree: int) -> tuple:
        """The same with scaled diagonally dominant Gram matrices."""
        return self.NewEvenDegreeNonnegativePolynomial(indeterminates, degree, NonnegativePolynomial.kSdsos)

    def NewEvenDegreeDsosPolynomial(self, indeterminates: Variables, degree: int) -> tuple:
        """The same with diagonally dominant Gram matrices."""
        return self.NewEvenDegreeNonnegativePolynomial(indeterminates, degree, NonnegativePolynomial.kDsos)

    def AddSosConstraint(self, *args: Any, **kwargs: Any) -> Any:
        """Adds that a polynomial, or an expression, is a sum of squares m' Q m.

        Called as `(p, monomial_basis, type, gram_name)`, which returns Q; or without the basis, which returns Q and the
        basis that was found.
        """

        def with_basis(self: Any, p: Polynomial, basis: np.ndarray, type: Any, gram_name: str) -> np.ndarray:
            form, Q = self.NewSosPolynomial(basis, type, gram_name)
            self.AddEqualityConstraintBetweenPolynomials(p, form)
            return Q

        def without(self: Any, p: Polynomial, type: Any, gram_name: str) -> tuple:
            p = self._reparsed(p)
            basis = half_newton_basis(p)
            return with_basis(self, p, basis, type, gram_name), basis

        name = (text, "S")
        ways = [
            overload(with_basis, p=kinds.polynomial, monomial_basis=_basis, type=_kind, gram_name=name),
            overload(without, p=kinds.polynomial, type=_kind, gram_name=name),
            overload(
                lambda self, e, m, t, n: with_basis(self, self.MakePolynomial(e), m, t, n),
                e=kinds.expression,
                monomial_basis=_basis,
                type=_kind,
                gram_name=name,
            ),
            overload(
                lambda self, e, t, n: without(self, self.MakePolynomial(e), t, n),
                e=kinds.expression,
                type=_kind,
                gram_name=name,
            ),
        ]
        return dispatch("AddSosConstraint", ways, self, args, kwargs)

    def AddEqualityConstraintBetweenPolynomials(self, p1: Polynomial, p2: Polynomial) -> list:
        """Adds that all coefficients of two polynomials are equal; returns the linear constraints.

        Coefficients that are different numbers give a constraint without variables, which cannot hold: the program is
        infeasible.

        Raises:
            RuntimeError: a coefficient is not affine in the decision variables.
        """
        difference = self._reparsed(p1 - p2)
        out = []
        for coefficient in difference.monomial_to_coefficient_map().values():
            if len(coefficient.GetVariables()) == 0:
                row = np.zeros((1, 0)), [-coefficient.Evaluate()], np.empty(0, dtype=object)
                out.append(self.AddLinearEqualityConstraint(*row))  # type: ignore[attr-defined]
                continue
            out.append(self.AddLinearEqualityConstraint(coefficient, 0.0))  # type: ignore[attr-defined]
        return out


def quadratic_form(Q: np.ndarray, basis: np.ndarray) -> Polynomial:
    """m' Q m for a symmetric matrix of variables or expressions."""
    terms: dict[Monomial, list] = {}
    for i, j in itertools.combinations_with_replacement(range(len(basis)), 2):
        factor = 1.0 if i == j else 2.0
        terms.setdefault(basis[i]._times(basis[j]), []).append(factor * kinds.expression(Q[i, j]))
    from sheldrake.symbolic import _build

    return Polynomial({m: _build.sum_of(found) for m, found in terms.items()})


def half_newton_basis(p: Polynomial) -> np.ndarray:
    """Monomials that a decomposition of p into squares may need.

    Their doubled exponents lie in the Newton polytope of p (Reznick, 1978); one whose square is neither in p nor a
    product of two others is left out, until none is.
    """
    support = [m for m, _ in p.monomial_to_coefficient_map().items()]
    vars = list(p.indeterminates())
    points = np.array([[m.degree(v) for v in vars] for m in support], dtype=float).reshape(len(support), len(vars))
    if not len(points):
        return np.array([Monomial()], dtype=object)
    degree = int(max(m.total_degree() for m in support)) // 2
    candidates = [m for m in MonomialBasis(Variables(vars), degree)] if vars else [Monomial()]
    low, high = points.min(axis=0), points.max(axis=0)
    totals = points.sum(axis=1)
    kept = []
    for m in candidates:
        doubled = 2.0 * np.array([m.degree(v) for v in vars])
        inside = np.all(doubled >= low) and np.all(doubled <= high) and totals.min() <= doubled.sum() <= totals.max()
        if inside and _in_hull(doubled, points):
            kept.append(m)
    return _objects(_without_useless(kept, set(support)))


def _in_hull(x: np.ndarray, points: np.ndarray) -> bool:
    """Whether x is a convex combination of points."""
    if (points == x).all(axis=1).any():
        return True
    from scipy.optimize import linprog

    A = np.vstack((points.T, np.ones(len(points))))
    found = linprog(np.zeros(len(points)), A_eq=A, b_eq=np.append(x, 1.0), bounds=(0, None), method="highs")
    return found.status == 0


def _without_useless(basis: list[Monomial], support: set[Monomial]) -> list[Monomial]:
    while True:
        products = {a._times(b) for a, b in itertools.combinations(basis, 2)}
        kept = [m for m in basis if (square := m._times(m)) in support or square in products]
        if len(kept) == len(basis):
            return kept
        basis = kept


def _objects(items: list) -> np.ndarray:
    out = np.empty(len(items), dtype=object)
    out[:] = items
    return out
