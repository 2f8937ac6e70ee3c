"""Expressions as coefficients: affine and quadratic ones."""

from __future__ import annotations

from collections.abc import Iterable, Sequence, Set
from typing import NamedTuple

import numpy as np

from sheldrake.symbolic import Expression, Variable
from sheldrake.symbolic import _decompose as decompose
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic import _traverse as traverse
from sheldrake.symbolic._decompose import LinearTerms
from sheldrake.symbolic._keys import age


def _age_of_term(term: tuple[Variable, float]) -> int:
    return term[0]._id


class Coefficients:
    """A polynomial of degree two at most as 1/2 x' Q x + b' x + c; of one of higher degree, that degree."""

    def __init__(
        self, e: Expression, flat: list[tuple[float, list[tuple[Variable, int]]]] | None = None, degree: int = 0
    ):
        """flat: The terms of e, if `flat_terms` knows them. degree: That of e, if known to be more than two."""
        self.Q: np.ndarray | None = None
        self.degree = degree
        found: Iterable[Variable]
        if flat is None:
            variables = traverse.variables_of(e)
            found = variables
            if self.degree <= 2:
                flat = _terms_of(e, variables)
        else:
            found = {v: None for _, powers in flat for v, _ in powers}
        ordered = sorted(found, key=age)
        self.vars = traverse.object_array(ordered)
        self.b, self.c = np.zeros(len(ordered)), 0.0
        if self.degree > 2:
            return
        places = {v: i for i, v in enumerate(ordered)}
        for value, powers in flat or ():
            degree = sum([n for _, n in powers])
            if degree > self.degree:
                self.degree = degree
            if degree == 0:
                self.c += value
            elif degree == 1:
                self.b[places[powers[0][0]]] += value
            elif degree == 2:
                if self.Q is None:
                    self.Q = np.zeros((len(ordered), len(ordered)))
                i, j = places[powers[0][0]], places[powers[-1][0]]
                self.Q[i, j] += value
                self.Q[j, i] += value

    @classmethod
    def linear(cls, terms: list[tuple[Variable, float]], c: float) -> Coefficients:
        """Those of a sum of variables times numbers, and of a constant."""
        terms.sort(key=_age_of_term)
        out = cls.__new__(cls)
        out.Q, out.c, out.degree = None, c, 1 if terms else 0
        out.vars = traverse.object_array([v for v, _ in terms])
        out.b = np.fromiter([value for _, value in terms], float, len(terms))
        return out

    @classmethod
    def quadratic(cls, e: Expression) -> Coefficients | None:
        """Those of a sum of numbers, variables, and products of two, each once, times numbers; None of others."""
        found = Quadratic.of(e)
        if found is None:
            return None
        out, n = cls.__new__(cls), len(found.vars)
        out.vars, out.b, out.c = traverse.object_array(found.vars), np.array(found.b, dtype=float), found.c
        out.Q, out.degree = None, 2 if found.at else 1
        if found.at:
            out.Q = np.zeros((n, n))
            out.Q.put(found.at, found.values)
        return out

    @classmethod
    def of_difference(cls, a: Expression, b: Expression) -> Coefficients | None:
        """Those of a - b, if a is expanded as it is and b a number."""
        if b._kind != k.CONSTANT:
            return None
        out = cls.quadratic(a)
        if out is None:
            flat = decompose.flat_terms(a)
            if flat is None:
                return None
            out = cls(a, flat)
        out.c -= b._made[0]
        return out

    def hessian(self) -> np.ndarray:
        """Q, zero if there is no term of degree two."""
        return np.zeros((len(self.vars), len(self.vars))) if self.Q is None else self.Q


class Quadratic(NamedTuple):
    """1/2 x' Q x + b' x + c as lists: entries of Q by their places, row by row; there are no others."""

    vars: list[Variable]
    at: list[int]
    values: list[float]
    b: list[float]
    c: float
    adds_squares: bool  # whether there are no products of two variables, and no square is subtracted

    @classmethod
    def of(cls, e: Expression) -> Quadratic | None:
        """A sum of numbers, variables, and products of two, each once, times numbers; None of others."""
        terms = decompose.quadratic_terms(e)
        return None if terms is None else cls.of_terms(*terms)

    @classmethod
    def of_terms(
        cls, linear: dict[Variable, float], products: list[tuple[Variable, Variable, float]], c: float
    ) -> Quadratic:
        """That of coefficients of variables, of products of two, and a constant."""
        found = dict.fromkeys(linear)
        for v, w, _ in products:
            found[v] = found[w] = None
        ordered = sorted(found, key=age)
        places, n = {v: i for i, v in enumerate(ordered)}, len(ordered)
        at: list[int] = []
        values: list[float] = []
        adds_squares = True
        for v, w, value in products:
            i, j = places[v], places[w]
            if i == j:
                at.append(i * n + i)
                values.append(2.0 * value)
                adds_squares = adds_squares and value >= 0.0
            else:
                at += (i * n + j, j * n + i)
                values += (value, value)
                adds_squares = False
        return cls(ordered, at, values, [linear.get(v, 0.0) for v in ordered], c, adds_squares)


def _terms_of(e: Expression, variables: Set[Variable]) -> list[tuple[float, list[tuple[Variable, int]]]]:
    """The terms of a polynomial: numbers and powers of variables."""
    keys, part = decompose.parted(e, variables)
    return [(c, list(keys.powers(key))) for key, c in part.items()]


def difference(a: Expression, b: Expression) -> LinearTerms | None:
    """The terms of a - b, if both are linear as they are, in the order of their variables; None for others."""
    minuend, subtrahend = decompose.linear_terms(a), decompose.linear_terms(b)
    if minuend is None or subtrahend is None:
        return None
    (terms, c), (others, d) = minuend, subtrahend
    if others:
        total = dict(terms)
        for v, value in others:
            total[v] = total.get(v, 0.0) - value
        terms = [(v, value) for v, value in total.items() if value != 0.0]
    if len(terms) > 1:
        terms.sort(key=_age_of_term)
    return terms, c - d


def coefficients(e: Expression) -> Coefficients | None:
    """The coefficients of a polynomial of any degree; None for other expressions."""
    linear = decompose.linear_terms(e)
    if linear is not None:
        return Coefficients.linear(*linear)
    found = Coefficients.quadratic(e)
    if found is not None:
        return found
    flat = decompose.flat_terms(e)
    if flat is not None:
        return Coefficients(e, flat)
    degree = decompose.degree_of(e)
    return None if degree == decompose.NO_POLYNOMIAL else Coefficients(e, None, degree if degree > 2 else 0)


def quadratic(e: Expression, wanted_by: str) -> Coefficients:
    """The coefficients of a quadratic expression.

    Raises:
        RuntimeError: it is not quadratic.
    """
    found = coefficients(e)
    if found is None:
        raise RuntimeError(f"{wanted_by}: the expression {e} is not a polynomial.")
    if found.degree > 2:
        raise RuntimeError(f"{wanted_by}: {e} has order higher than 2 and it cannot be handled as a quadratic.")
    return found


class Affine:
    """Rows of affine expressions over all their variables, in the order of the rows that first have them."""

    def __init__(self, rows: Sequence[LinearTerms]):
        found = list(dict.fromkeys([v for terms, _ in rows for v, _ in terms]))
        self.vars = traverse.object_array(found)
        places = {v: i for i, v in enumerate(found)}
        self.A = np.zeros((len(rows), len(found)))
        if found:
            owners = [i for i, (terms, _) in enumerate(rows) for _ in terms]
            columns = [places[v] for terms, _ in rows for v, _ in terms]
            self.A[owners, columns] = [value for terms, _ in rows for _, value in terms]
        self.c = np.array([c for _, c in rows], dtype=float)


def affine_rows(expressions: Sequence[Expression]) -> list[LinearTerms] | None:
    """The terms of each expression, in the order of their variables; None if one is not affine."""
    out = []
    for e in expressions:
        row = decompose.linear_terms(e)
        if row is None:
            found = coefficients(e)
            if found is None or found.degree > 1:
                return None
            row = list(zip(found.vars.tolist(), found.b.tolist())), found.c
        row[0].sort(key=_age_of_term)
        out.append(row)
    return out


def affine_vector(expressions: Sequence[Expression], call: str) -> Affine:
    """Affine expressions as A x + c.

    Raises:
        RuntimeError: one is not affine.
    """
    rows = affine_rows(expressions)
    if rows is None:
        bad = next(e for e in expressions if affine_rows([e]) is None)
        raise RuntimeError(f"{call}: expression {bad} is non-linear.")
    return Affine(rows)
