"""Polynomials with decision variables as coefficients, and sums of squares.

One of the parts that `MathematicalProgram` is put together from.
"""

from __future__ import annotations

import functools
import itertools
import operator
from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._enums import BoundEnum
from sheldrake.common._kinds import count, instance_of, text
from sheldrake.common._nonnegative_least_squares import nonnegative_least_squares
from sheldrake.common._overloads import Mismatch, Ways, dispatch, overload
from sheldrake.solvers import _kinds as kinds
from sheldrake.solvers._functions.bindings import Binding, bind
from sheldrake.solvers._functions.constraints import BoundingBoxConstraint, LinearEqualityConstraint
from sheldrake.solvers._parse.constraints import equation
from sheldrake.solvers._program.bindings import ProgramBindings
from sheldrake.solvers._program.cones import ProgramCones
from sheldrake.solvers._program.variables import ProgramVariables
from sheldrake.symbolic import (
    EvenDegreeMonomialBasis,
    Expression,
    Monomial,
    MonomialBasis,
    OddDegreeMonomialBasis,
    Polynomial,
    Variable,
    Variables,
)
from sheldrake.symbolic import _build as build
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic import _traverse as traverse
from sheldrake.symbolic._decompose import affine_sum, parted
from sheldrake.symbolic._keys import Keys, Part, Sums, in_common, keys_for, number_or

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from sheldrake.common._types import Symbolic, Symbolics


class NonnegativePolynomial(BoundEnum):
    """Ways to say that a polynomial is not negative."""

    kSos = 1
    kSdsos = 2
    kDsos = 3


NonnegativePolynomial.__qualname__ = "NonnegativePolynomial"
_SOS = NonnegativePolynomial.kSos


def _basis(value: ArrayLike) -> np.ndarray:
    array = np.asarray(value, dtype=object)
    if array.ndim == 0 or not all(isinstance(m, Monomial) for m in array.flat):
        raise Mismatch
    return array.ravel()


@checked
class ProgramPolynomials:
    """Free and nonnegative polynomials.

    Args:
        variables: Where coefficients and Gram matrices get their variables.
        bindings: Where constraints on them are kept.
        cones: Adds the constraints on Gram matrices.
    """

    def __init__(self, variables: ProgramVariables, bindings: ProgramBindings, cones: ProgramCones) -> None:
        self._variables, self._bindings, self._cones = variables, bindings, cones

    def MakePolynomial(self, e: Expression | Variable | float) -> Polynomial:
        """Returns an expression as a polynomial in the indeterminates of this program."""
        found: Expression = kinds.expression(e)
        return Polynomial(found, Variables([v for v in found.GetVariables() if self._variables.is_indeterminate(v)]))

    def Reparse(self, p: Polynomial) -> None:
        """Makes the indeterminates of this program those of a polynomial."""
        p.SetIndeterminates(Variables(self._variables.indeterminates()))

    def _reparsed(self, p: Polynomial) -> Polynomial:
        """The polynomial in the indeterminates of this program."""
        is_indeterminate = self._variables.is_indeterminate
        if all(map(is_indeterminate, p._indeterminates)) and not any(map(is_indeterminate, p._decisions)):
            return p
        return self.MakePolynomial(p.ToExpression())

    def _free(self, basis: np.ndarray, coeff_name: str) -> Polynomial:
        coefficients = self._variables.NewContinuousVariables(len(basis), coeff_name)
        keys = keys_for(basis)
        part = {keys.key(m): build.node_of(c) for m, c in zip(basis, coefficients)}
        return Polynomial._of(keys, part, False, decided=frozenset(coefficients))

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

    @typing_overload
    def NewSosPolynomial(
        self, monomial_basis: np.ndarray | Sequence[Monomial], type: NonnegativePolynomial = ..., gram_name: str = "S"
    ) -> tuple[Polynomial, np.ndarray]: ...
    @typing_overload
    def NewSosPolynomial(
        self, gramian: Symbolics, monomial_basis: np.ndarray | Sequence[Monomial], type: NonnegativePolynomial = ...
    ) -> Polynomial: ...
    @typing_overload
    def NewSosPolynomial(
        self, indeterminates: Variables, degree: int, type: NonnegativePolynomial = ..., gram_name: str = "S"
    ) -> tuple[Polynomial, np.ndarray]: ...
    def NewSosPolynomial(self, *args: Any, **kwargs: Any) -> Any:
        """Returns a nonnegative polynomial m' Q m and its Gram matrix Q.

        Called as `(monomial_basis, type, gram_name)`, `(indeterminates, degree, type, gram_name)`; or
        `(gramian, monomial_basis, type)` with a given matrix, which returns the polynomial alone.

        Raises:
            RuntimeError: the degree is odd or negative.
        """

        return dispatch("NewSosPolynomial", _NEW_SOS, self, args, kwargs)

    def _sos_of_basis(
        self, basis: np.ndarray, type: NonnegativePolynomial, gram_name: str
    ) -> tuple[Polynomial, np.ndarray]:
        Q = self._variables.NewSymmetricContinuousVariables(len(basis), gram_name)
        return self._nonnegative_form(Q, basis, type), Q

    def _sos_of_degree(
        self, indeterminates: Variables, degree: int, type: NonnegativePolynomial, gram_name: str
    ) -> tuple[Polynomial, np.ndarray]:
        if degree < 0 or degree % 2:
            raise RuntimeError(
                f"NewSosPolynomial: degree must be a nonnegative even integer, but {degree} is given instead."
            )
        if degree == 0:
            Q = self._variables.NewContinuousVariables(1, 1, gram_name)
            self._bindings.add(
                bind(BoundingBoxConstraint, BoundingBoxConstraint(np.zeros(1), np.full(1, np.inf)), Q.ravel())
            )
            return quadratic_form(Q, MonomialBasis(indeterminates, 0)), Q
        return self._sos_of_basis(MonomialBasis(indeterminates, degree // 2), type, gram_name)

    def _nonnegative_form(self, Q: np.ndarray, basis: np.ndarray, type: NonnegativePolynomial) -> Polynomial:
        self._add_nonnegative(Q, type)
        return quadratic_form(Q, basis)

    def _add_nonnegative(self, Q: np.ndarray, type: NonnegativePolynomial) -> None:
        if type is _SOS:
            self._cones.AddPositiveSemidefiniteConstraint(Q)
        elif type is NonnegativePolynomial.kSdsos:
            self._cones.AddScaledDiagonallyDominantMatrixConstraint(Q)
        else:
            self._cones.AddPositiveDiagonallyDominantMatrixConstraint(Q)

    def NewEvenDegreeNonnegativePolynomial(
        self, indeterminates: Variables, degree: int, type: NonnegativePolynomial
    ) -> tuple[Polynomial, np.ndarray, np.ndarray]:
        """Returns a nonnegative polynomial of even monomials, and the Gram matrices of odd and even monomials."""
        if degree < 0 or degree % 2:
            raise RuntimeError(f"NewEvenDegreeNonnegativePolynomial: the degree must be even, not {degree}.")
        parts = []
        for basis in (
            EvenDegreeMonomialBasis(indeterminates, degree // 2),  # Its decision variables come first.
            OddDegreeMonomialBasis(indeterminates, degree // 2),
        ):
            Q = self._variables.NewSymmetricContinuousVariables(len(basis), "S")
            parts.append((self._nonnegative_form(Q, basis, type) if len(basis) else Polynomial(), Q))
        (even, Q_even), (odd, Q_odd) = parts
        return odd + even, Q_odd, Q_even

    def NewEvenDegreeSosPolynomial(
        self, indeterminates: Variables, degree: int
    ) -> tuple[Polynomial, np.ndarray, np.ndarray]:
        """Returns a sum of squares of even monomials, and its Gram matrices of odd and even monomials."""
        return self.NewEvenDegreeNonnegativePolynomial(indeterminates, degree, _SOS)

    def NewEvenDegreeSdsosPolynomial(
        self, indeterminates: Variables, degree: int
    ) -> tuple[Polynomial, np.ndarray, np.ndarray]:
        """The same with scaled diagonally dominant Gram matrices."""
        return self.NewEvenDegreeNonnegativePolynomial(indeterminates, degree, NonnegativePolynomial.kSdsos)

    def NewEvenDegreeDsosPolynomial(
        self, indeterminates: Variables, degree: int
    ) -> tuple[Polynomial, np.ndarray, np.ndarray]:
        """The same with diagonally dominant Gram matrices."""
        return self.NewEvenDegreeNonnegativePolynomial(indeterminates, degree, NonnegativePolynomial.kDsos)

    @typing_overload
    def AddSosConstraint(
        self,
        p: Polynomial,
        monomial_basis: np.ndarray | Sequence[Monomial],
        type: NonnegativePolynomial = ...,
        gram_name: str = "S",
    ) -> np.ndarray: ...
    @typing_overload
    def AddSosConstraint(
        self, p: Polynomial, type: NonnegativePolynomial = ..., gram_name: str = "S"
    ) -> tuple[np.ndarray, np.ndarray]: ...
    @typing_overload
    def AddSosConstraint(
        self,
        e: Symbolic,
        monomial_basis: np.ndarray | Sequence[Monomial],
        type: NonnegativePolynomial = ...,
        gram_name: str = "S",
    ) -> np.ndarray: ...
    @typing_overload
    def AddSosConstraint(
        self, e: Symbolic, type: NonnegativePolynomial = ..., gram_name: str = "S"
    ) -> tuple[np.ndarray, np.ndarray]: ...
    def AddSosConstraint(self, *args: Any, **kwargs: Any) -> Any:
        """Adds that a polynomial, or an expression, is a sum of squares m' Q m.

        Called as `(p, monomial_basis, type, gram_name)`, which returns Q; or without the basis, which returns Q and the
        basis that was found.
        """

        return dispatch("AddSosConstraint", _ADD_SOS, self, args, kwargs)

    def _add_with_basis(
        self, given: Polynomial | Expression, basis: np.ndarray, type: NonnegativePolynomial, gram_name: str
    ) -> np.ndarray:
        return self._add_form(*self._affine(given), basis, type, gram_name)

    def _add_without_basis(
        self, given: Polynomial | Expression, type: NonnegativePolynomial, gram_name: str
    ) -> tuple[np.ndarray, np.ndarray]:
        keys, part = self._affine(given)
        basis = half_newton_basis(*keys.without_absent(part))
        return self._add_form(keys, part, basis, type, gram_name), basis

    def _affine(self, given: Polynomial | Expression) -> tuple[Keys, AffinePart]:
        """The coefficients of a sum of monomials in the indeterminates of this program, but those that vanish.

        Raises:
            RuntimeError: one is not affine.
        """
        if isinstance(given, Expression):
            keys, part = parted(given, frozenset(self._variables.indeterminates().tolist()))
        else:
            p = self._reparsed(given)
            keys, part = p._keys, p._part
        found = {key: affine_sum(((1.0, c),)) for key, c in part.items()}
        return keys, {key: c for key, c in found.items() if c[0] or c[1] != 0.0}

    def _add_form(
        self, keys: Keys, part: AffinePart, basis: np.ndarray, type: NonnegativePolynomial, gram_name: str
    ) -> np.ndarray:
        """Adds that a sum of monomials with affine coefficients is a nonnegative form; returns its matrix."""
        own = keys_for(basis)
        if not all(map(self._variables.is_indeterminate, own.variables)):
            raise RuntimeError(f"AddSosConstraint(): {own.set} of the basis are not all indeterminates of the program.")
        Q = self._variables.NewSymmetricContinuousVariables(len(basis), gram_name)
        self._add_nonnegative(Q, type)
        keys, part, form = in_common(keys, part, own, _form(own, Q.tolist(), basis))
        for key, terms in form.items():
            known = part.get(key)
            part[key] = (terms, 0.0) if known is None else ({**known[0], **terms}, known[1])
        self._add_rows(keys, part)
        return Q

    def AddEqualityConstraintBetweenPolynomials(
        self, p1: Polynomial, p2: Polynomial
    ) -> list[Binding[LinearEqualityConstraint]]:
        """Adds that all coefficients of two polynomials are equal; returns the linear constraints.

        Coefficients that are different numbers give a constraint without variables, which cannot hold: the program is
        infeasible.

        Raises:
            RuntimeError: a coefficient is not affine in the decision variables.
        """
        p, q = self._reparsed(p1), self._reparsed(p2)
        keys, mine, its = in_common(p._keys, p._part, q._keys, q._part)
        part = {}
        for key in {**mine, **its}:
            c, d = mine.get(key, 0.0), its.get(key, 0.0)
            if c is not d:
                part[key] = affine_sum(((1.0, c), (-1.0, d)))
        return self._add_rows(keys, part)

    def _add_rows(self, keys: Keys, part: AffinePart) -> list[Binding[LinearEqualityConstraint]]:
        """Adds that all coefficients of a sum of monomials are zero."""
        out: list[Binding[LinearEqualityConstraint]] = []
        for key in keys.in_order(part):
            terms, constant = part[key]
            if terms or constant != 0.0:
                out.append(self._bindings.add(equation(terms, 0.0 - constant)))
        return out


_kind = (instance_of(NonnegativePolynomial), _SOS)
_name = (text, "S")
_NEW_SOS = Ways(
    [
        overload(ProgramPolynomials._sos_of_basis, monomial_basis=_basis, type=_kind, gram_name=_name),
        overload(ProgramPolynomials._nonnegative_form, gramian=kinds.expressions, monomial_basis=_basis, type=_kind),
        overload(
            ProgramPolynomials._sos_of_degree,
            indeterminates=kinds.variables,
            degree=count,
            type=_kind,
            gram_name=_name,
        ),
    ]
)
_ADD_SOS = Ways(
    [
        overload(
            ProgramPolynomials._add_with_basis,
            p=kinds.polynomial,
            monomial_basis=_basis,
            type=_kind,
            gram_name=_name,
        ),
        overload(ProgramPolynomials._add_without_basis, p=kinds.polynomial, type=_kind, gram_name=_name),
        overload(
            ProgramPolynomials._add_with_basis,
            e=kinds.expression,
            monomial_basis=_basis,
            type=_kind,
            gram_name=_name,
        ),
        overload(ProgramPolynomials._add_without_basis, e=kinds.expression, type=_kind, gram_name=_name),
    ]
)


AffinePart = dict[Any, tuple[dict[Variable, float], float]]
"""Variables with their coefficients, and constants, by key."""


def _form(keys: Keys, Q: list[list[Variable]], basis: np.ndarray) -> dict[Any, dict[Variable, float]]:
    """-m' Q m for a symmetric matrix of different variables: their coefficients by key."""
    at, times = list(map(keys.key, basis)), keys.times
    out: dict[Any, dict[Variable, float]] = {}
    for i, row in enumerate(Q):
        out.setdefault(times(at[i], at[i]), {})[row[i]] = -1.0
        for j in range(i + 1, len(at)):
            out.setdefault(times(at[i], at[j]), {})[row[j]] = -2.0
    return out


def quadratic_form(Q: np.ndarray, basis: np.ndarray) -> Polynomial:
    """m' Q m for a symmetric matrix of variables or expressions."""
    keys = keys_for(basis)
    at, times, out = list(map(keys.key, basis)), keys.times, Sums()
    entries, decided = Q.tolist(), set[Variable]()
    for i, row in enumerate(entries):
        for j in range(i, len(at)):
            x = row[j]
            e = build.node_of(x) if x.__class__ is Variable else kinds.expression(x)
            out.add(times(at[i], at[j]), number_or(e), 1.0 if i == j else 2.0)
            decided.update(e._made if e._kind == k.VAR else traverse.variables_of(e))
    return Polynomial._of(keys, out.whole(), decided=frozenset(decided))


def half_newton_basis(keys: Keys, part: Part) -> np.ndarray:
    """Monomials that a decomposition of a sum of monomials into squares may need; all variables of the keys occur.

    Their doubled exponents lie in the Newton polytope of the sum (Reznick, 1978); one whose square is neither in it nor
    a product of two others is left out, until none is.
    """
    if not (part and keys.variables):
        return np.array([Monomial()], dtype=object)
    ordered = keys.in_order(part)
    candidates = MonomialBasis(keys.set, max(map(keys.degree, part)) // 2).tolist()
    rows = keys.exponents(dict.fromkeys(map(keys.key, candidates)))
    needed = _needed(keys.exponents(dict.fromkeys(ordered)).tobytes(), rows.tobytes(), len(keys.variables))
    return traverse.object_array([candidates[i] for i in needed])


@functools.lru_cache(maxsize=64)
def _needed(support: bytes, candidates: bytes, num_vars: int) -> list[int]:
    """Which candidates a basis needs, from all exponents, row by row; programs with other numbers ask it again."""
    points, rows = (np.frombuffer(given).reshape(-1, num_vars) for given in (support, candidates))
    low, high = points.min(axis=0), points.max(axis=0)
    totals = points.sum(axis=1)
    doubled = 2.0 * rows
    sums = doubled.sum(axis=1)
    in_box = (doubled >= low).all(axis=1) & (doubled <= high).all(axis=1)
    inside = in_box & (totals.min() <= sums) & (sums <= totals.max())
    kept = [i for i in inside.nonzero()[0].tolist() if _in_hull(doubled[i], points)]
    return _without_useless(kept, rows.tolist(), set(map(tuple, points.tolist())))


def _in_hull(x: np.ndarray, points: np.ndarray) -> bool:
    """Whether x is a convex combination of points: nonnegative least squares leave nothing."""
    if (points == x).all(axis=1).any():
        return True
    A, b = np.vstack((points.T, np.ones(len(points)))), np.append(x, 1.0)
    return bool(np.abs(b - A @ nonnegative_least_squares(A, b)).max() < 1e-9)


def _without_useless(kept: list[int], rows: list[list[float]], support: set[tuple[float, ...]]) -> list[int]:
    def product(i: int, j: int) -> tuple[float, ...]:
        return tuple(map(operator.add, rows[i], rows[j]))

    while True:
        products = {product(i, j) for i, j in itertools.combinations(kept, 2)}
        left = [i for i in kept if (square := product(i, i)) in support or square in products]
        if len(left) == len(kept):
            return kept
        kept = left
