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
    if term._kind != k.MUL:
        return (_build.ONE, term) if _are_parameters(term, parameters) else (term, _build.ONE)
    free: _build.Factors = {}
    lumped: _build.Factors = {}
    for n, (base, exponent) in term._terms.items():
        if exponent._kind == k.CONSTANT:
            is_lumped = _are_parameters(base, parameters)
        else:
            is_lumped = _are_parameters(_build.power(base, exponent), parameters)
        (lumped if is_lumped else free)[n] = base, exponent
    return _build.make_product(term._constant, free), _build.make_product(1.0, lumped)


def _are_parameters(e: Expression, parameters: set[Variable]) -> bool:
    """Whether all variables of an expression are parameters; not if it has none.

    Raises:
        RuntimeError: some are, others are not.
    """
    if e._kind == k.VAR:
        return e._made[0] in parameters
    variables = variables_of(e)
    if variables.isdisjoint(parameters):
        return False
    if variables <= parameters:
        return True
    raise RuntimeError(
        f"{e} cannot be factored into lumped parameters, since it depends on both parameters and non-parameter "
        "variables."
    )
