"""Separates parameters from the rest of expressions."""

from __future__ import annotations

import numpy as np

from sheldrake.symbolic import _build
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._decompose import is_zero
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._traverse import _terms, object_array, variables_of
from sheldrake.symbolic._variable import Variable


def lumped(es: list[Expression], parameters: set[Variable]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """W, alpha and w0 with es = W alpha + w0; see `DecomposeLumpedParameters`."""
    # By row: the factor free of parameters, and the sum of factors in parameters that it multiplies.
    rows: list[dict[int, tuple[Expression, Expression]]] = []
    w0 = []
    for e in es:
        row: dict[int, tuple[Expression, Expression]] = {}
        free = _build.ZERO
        for c, unit in _terms(e.Expand()):
            coefficient, alpha = _split(_build.scale(c, unit), parameters)
            if alpha._kind == k.CONSTANT:
                free = _build.add(free, _build.multiply(coefficient, alpha))
                continue
            known = row.get(coefficient._serial, (coefficient, _build.ZERO))
            row[coefficient._serial] = (coefficient, _build.add(known[1], alpha))
        rows.append(row)
        w0.append(free)
    alphas: dict[int, Expression] = {}
    for row in rows:
        for _, alpha in row.values():
            alphas.setdefault(alpha._serial, alpha)
    ordered = sorted((a for a in alphas.values() if not is_zero(a)), key=lambda a: a._key)
    W = np.empty((len(es), len(ordered)), dtype=object)
    W[:] = _build.ZERO
    column = {a._serial: j for j, a in enumerate(ordered)}  # equal expressions may be several objects
    for i, row in enumerate(rows):
        for coefficient, alpha in row.values():
            if (j := column.get(alpha._serial)) is not None:
                W[i, j] = _build.add(W[i, j], coefficient)
    return W, object_array(ordered), object_array(w0)


def _split(term: Expression, parameters: set[Variable]) -> tuple[Expression, Expression]:
    """A term as (factor free of parameters, factor in parameters alone); numbers go with the first.

    Raises:
        RuntimeError: a factor mixes both.
    """
    variables = variables_of(term)
    if not variables & parameters:
        return term, _build.ONE
    if variables <= parameters and term._kind != k.MUL:
        return _build.ONE, term
    if term._kind == k.MUL:
        coefficient, alpha = _build.constant(term._args[0]), _build.ONE
        for base, exponent in term._args[1]:
            c, a = _split(_build.power(base, exponent), parameters)
            coefficient, alpha = _build.multiply(coefficient, c), _build.multiply(alpha, a)
        return coefficient, alpha
    raise RuntimeError(
        f"{term} cannot be factored into lumped parameters, since it depends on both parameters and non-parameter "
        "variables."
    )
