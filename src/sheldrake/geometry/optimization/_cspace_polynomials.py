"""Polynomials in s and y as tables of coefficients, and the identities of certificates as linear equations."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from sheldrake.symbolic import Expression, Monomial, Polynomial

Powers = tuple[int, ...]
Table = dict[Powers, Any]
"""Coefficients, numbers or rows of them, by the powers of s and then of y."""


def times(a: Table, b: Table) -> Table:
    """The product; coefficients of at least one are numbers."""
    out: Table = {}
    for (p, x), (q, y) in itertools.product(a.items(), b.items()):
        key = tuple(i + j for i, j in zip(p, q))
        out[key] = out.get(key, 0.0) + x * y
    return out


def plus(*tables: Table) -> Table:
    """The sum."""
    out: Table = {}
    for table in tables:
        for key, x in table.items():
            out[key] = out.get(key, 0.0) + x
    return out


def unit(size: int, k: int, power: int = 1) -> Powers:
    """The powers of one variable alone."""
    return tuple(power if i == k else 0 for i in range(size))


def affine(size: int, constant: Any, slopes: Any) -> Table:
    """constant + slopes s, for the first variables."""
    out: Table = {(0,) * size: constant}
    for k, slope in enumerate(slopes):
        out[unit(size, k)] = slope
    return out


class Gram:
    """A sum of squares: in each group of monomials z, z' Q z with Q >= 0.

    Args:
        prog: The program that gets new variables Q; None for the sum of no squares: zero.
        groups: The monomials of each group.
    """

    def __init__(self, prog: Any, groups: list[list[Powers]]):
        self.terms: list[tuple[Any, Powers, float]] = []
        for z in groups if prog is not None else []:
            Q = prog.NewSymmetricContinuousVariables(len(z), "Gram")
            if len(z) == 1:
                prog.AddBoundingBoxConstraint(0.0, np.inf, Q.ravel())
            else:
                prog.AddPositiveSemidefiniteConstraint(Q)
            for i in range(len(z)):
                for j in range(i + 1):
                    key = tuple(p + q for p, q in zip(z[i], z[j]))
                    self.terms.append((Q[i, j], key, 1.0 if i == j else 2.0))

    def polynomial(self, variables: list) -> Polynomial:
        """The sum with Q as decision variables."""
        return symbolic({}, [(v, key, factor) for v, key, factor in self.terms], variables)

    def values(self, result: Any) -> Table:
        """The sum with the solution's Q."""
        out: Table = {}
        if self.terms:
            solution = np.atleast_1d(result.GetSolution(np.array([v for v, _, _ in self.terms], dtype=object)))
            for (_, key, factor), value in zip(self.terms, solution):
                out[key] = out.get(key, 0.0) + factor * value
        return out


def symbolic(numbers: Table, terms: list[tuple[Any, Powers, float]], variables: list) -> Polynomial:
    """A polynomial of numbers and of decision variables times factors."""
    out: dict[Powers, Any] = {key: Expression(float(x)) for key, x in numbers.items()}
    for v, key, factor in terms:
        out[key] = out.get(key, Expression(0.0)) + factor * v
    monomials = {Monomial({v: p for v, p in zip(variables, key) if p}): e for key, e in out.items()}
    return Polynomial(monomials)


class Identity:
    """A polynomial that is linear in variables of a program, and is to vanish."""

    def __init__(self) -> None:
        self._columns: dict[Any, int] = {}
        self._variables: list = []
        self._entries: list[tuple[Powers, int, float]] = []
        self._constants: Table = {}

    def add(self, v: Any, key: Powers, factor: float) -> None:
        """Adds factor v times a monomial."""
        column = self._columns.setdefault(v.get_id(), len(self._columns))
        if column == len(self._variables):
            self._variables.append(v)
        self._entries.append((key, column, factor))

    def add_numbers(self, table: Table, factor: float = 1.0) -> None:
        """Adds a multiple of a polynomial of numbers."""
        self._constants = plus(self._constants, {key: factor * x for key, x in table.items()})

    def add_rows(self, table: Table, x: np.ndarray) -> None:
        """Adds a polynomial whose coefficients are rows r: r[:-1] x + r[-1]."""
        for key, row in table.items():
            for v, factor in zip(x, row):
                if factor != 0.0:
                    self.add(v, key, float(factor))
        self.add_numbers({key: row[-1] for key, row in table.items()})

    def add_gram(self, gram: Gram, factor: Table) -> None:
        """Adds a sum of squares times a polynomial of numbers."""
        for v, key, weight in gram.terms:
            for other, x in factor.items():
                if x != 0.0:
                    self.add(v, tuple(p + q for p, q in zip(key, other)), weight * float(x))

    def impose(self, prog: Any) -> None:
        """Adds to a program that all coefficients are zero."""
        keys = sorted({key for key, _, _ in self._entries} | set(self._constants))
        places = {key: i for i, key in enumerate(keys)}
        A = np.zeros((len(keys), len(self._variables)))
        for key, column, factor in self._entries:
            A[places[key], column] += factor
        b = np.array([-float(self._constants.get(key, 0.0)) for key in keys])
        if len(keys):
            prog.AddLinearEqualityConstraint(A, b, np.array(self._variables, dtype=object))
