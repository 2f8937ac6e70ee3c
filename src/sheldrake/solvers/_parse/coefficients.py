"""Expressions as coefficients: affine and quadratic ones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sheldrake.symbolic import Expression, Variable
from sheldrake.symbolic import _decompose as decompose
from sheldrake.symbolic import _traverse as traverse


def _age_of_term(term: tuple[Variable, float]) -> int:
    return term[0]._id


class Coefficients:
    """A polynomial of degree two at most as 1/2 x' Q x + b' x + c; of one of higher degree, that degree."""

    def __init__(self, e: Expression, flat: list | None = None):
        """flat: The terms of e, if `flat_terms` knows them."""
        self.Q: np.ndarray | None = None
        if flat is None and decompose.is_linear(e):
            terms, self.c = decompose.linear_terms(e)
            if len(terms) > 1:
                terms.sort(key=_age_of_term)
            self.vars = traverse.object_array([v for v, _ in terms])
            self.degree, self.b = min(len(terms), 1), np.array([c for _, c in terms], dtype=float)
            return
        variables = traverse.variables_of(e)
        found = sorted(variables, key=Variable.get_id)
        self.vars = traverse.object_array(found)
        self.degree, self.b, self.c = 0, np.zeros(len(found)), 0.0
        places = {v: i for i, v in enumerate(found)}
        if flat is None:
            self.degree = decompose.degree_of_product(e)
            if self.degree > 2:
                return
            terms_of = decompose.decompose(e, variables).items()
            flat = [(coefficient._made[0], list(m._powers.items())) for m, coefficient in terms_of]
        for value, powers in flat:
            self._add(value, [places[v] for v, n in powers for _ in range(min(n, 3))])
            self.degree = max(self.degree, sum([n for _, n in powers]))

    def _add(self, value: float, at: list[int]) -> None:
        """Adds a term that is a product of these variables, if it has no more than two."""
        if len(at) == 0:
            self.c += value
        elif len(at) == 1:
            self.b[at[0]] += value
        elif len(at) == 2:
            if self.Q is None:
                self.Q = np.zeros((len(self.b), len(self.b)))
            self.Q[at[0], at[1]] += value
            self.Q[at[1], at[0]] += value

    def hessian(self) -> np.ndarray:
        """Q, zero if there is no term of degree two."""
        return np.zeros((len(self.vars), len(self.vars))) if self.Q is None else self.Q


def coefficients(e: Expression) -> Coefficients | None:
    """The coefficients of a polynomial of any degree; None for other expressions."""
    if decompose.is_linear(e):
        return Coefficients(e)
    flat = decompose.flat_terms(e)
    return Coefficients(e, flat) if flat is not None or traverse.is_polynomial(e) else None


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

    def __init__(self, rows: Sequence[Coefficients]):
        self.vars = traverse.object_array(list(dict.fromkeys(v for r in rows for v in r.vars)))
        places = {v: i for i, v in enumerate(self.vars)}
        self.A = np.zeros((len(rows), len(self.vars)))
        for i, r in enumerate(rows):
            for v, value in zip(r.vars, r.b):
                self.A[i, places[v]] = value
        self.c = np.array([r.c for r in rows])


def affine_rows(expressions: Sequence[Expression]) -> list[Coefficients] | None:
    """The coefficients of each expression; None if one is not affine."""
    out = []
    for e in expressions:
        found = coefficients(e)
        if found is None or found.degree > 1:
            return None
        out.append(found)
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
