"""Constraints from formulas: what is left and right of a relation, and bounds of the difference."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.solvers._parse.coefficients import Coefficients, difference
from sheldrake.solvers._parse.constraints import (
    constraint,
    equality_constraint,
    linear_constraint,
    linear_row,
    of_rows,
    quadratic_row,
)
from sheldrake.symbolic import Expression, Formula, FormulaKind
from sheldrake.symbolic import _build as build
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic import _traverse as traverse

if TYPE_CHECKING:
    from sheldrake.solvers._functions.bindings import BindingBase
    from sheldrake.solvers._functions.constraints import LinearEqualityConstraint
    from sheldrake.solvers._functions.evaluators import Constraint

_RELATIONS = (FormulaKind.Eq, FormulaKind.Leq, FormulaKind.Geq)


def _relations(f: Formula, call: str, allowed: tuple, words: str) -> list[Formula]:
    """The parts of a conjunction of relations.

    Raises:
        RuntimeError: it holds something else.
    """
    kind = f.get_kind()
    if kind is FormulaKind.True_:
        return []
    if kind is FormulaKind.False_:
        raise RuntimeError(f"{call} is called with a formula being always false.")
    if kind in allowed:
        return [f]
    if kind is FormulaKind.And and all(part.get_kind() in allowed for part in f._args):
        return list(f._args)
    raise RuntimeError(f"{call} is called with a formula {f} which is neither {words}.")


_ANY_RELATION = (
    "a relational formula using one of {==, <=, >=} operators nor a conjunction of those relational formulas"
)
_EQUALITY = "an equality formula nor a conjunction of equality formulas"


def _sides(f: Formula, swap: bool) -> tuple[Expression, float, float]:
    """An expression and its bounds.

    Args:
        f: A relation a <= b, a >= b or a == b.
        swap: Write a >= b as b - a <= 0, as for a formula on its own; in arrays it is a - b >= 0.

    Raises:
        RuntimeError: one side is infinite, and not in the direction that means no bound.
    """
    a, b = f._args
    if f.get_kind() is FormulaKind.Eq:
        return _difference(f, a, b), 0.0, 0.0
    if f.get_kind() is FormulaKind.Geq and not swap:
        return _at_least(f, a, b)
    if f.get_kind() is FormulaKind.Geq:
        a, b = b, a
    return _one_sided(f, a, b)


def _difference(f: Formula, a: Expression, b: Expression) -> Expression:
    for side in (a, b):
        constant = side._constant if side._kind == k.ADD else side._made[0] if side._kind == k.CONSTANT else 0.0
        if math.isinf(constant):
            raise RuntimeError(
                f"FindBound() cannot handle the constraint: {str(f)[1:-1]} because {side} has infinity in the constant "
                "term after expansion."
            )
    return build.subtract(a, b)


def _is_infinite(e: Expression, sign: float) -> bool:
    return e._kind == k.CONSTANT and e._made[0] == sign * np.inf


def _one_sided(f: Formula, a: Expression, b: Expression) -> tuple[Expression, float, float]:
    """a <= b as a - b <= 0."""
    if _is_infinite(b, 1.0):
        return a, -np.inf, np.inf
    if _is_infinite(a, -1.0):
        return b, -np.inf, np.inf
    return _difference(f, a, b), -np.inf, 0.0


def _at_least(f: Formula, a: Expression, b: Expression) -> tuple[Expression, float, float]:
    """a >= b as a - b >= 0."""
    if _is_infinite(b, -1.0):
        return a, -np.inf, np.inf
    if _is_infinite(a, 1.0):
        return b, -np.inf, np.inf
    return _difference(f, a, b), 0.0, np.inf


def _bounded(f: Formula, swap: bool) -> tuple[Expression, Expression, float, float]:
    """a, b and the bounds of a - b; see `_sides`."""
    a, b = f._args
    kind, low, high = f._kind, 0.0, 0.0
    if kind is FormulaKind.Leq:
        low = -math.inf
    elif kind is FormulaKind.Geq and swap:
        a, b, low = b, a, -math.inf
    elif kind is FormulaKind.Geq:
        high = math.inf
    return a, b, low, high


def _relation_at_once(f: Formula, swap: bool, linear: bool) -> BindingBase[Constraint] | None:
    """The same of one formula."""
    a, b, low, high = _bounded(f, swap)
    terms = difference(a, b)
    if terms is not None:
        return linear_row(terms, low, high)
    row = None if linear else Coefficients.of_difference(a, b)
    return None if row is None else quadratic_row(row, low, high)


def _at_once(parts: list[Formula], swap: bool) -> BindingBase[Constraint] | None:
    """The constraint of formulas whose coefficients are found as they are; None for others, and for infinite sides."""
    rows, lows, highs = [], [], []
    for f in parts:
        a, b, low, high = _bounded(f, swap)
        terms = difference(a, b)
        if terms is None or not terms[0] or not math.isfinite(terms[1]):
            return None
        rows.append(terms)
        lows.append(low)
        highs.append(high)
    return of_rows(rows, np.array(lows), np.array(highs))


def _parsed(parts: list[Formula], swap: bool, linear: bool) -> BindingBase[Constraint]:
    if len(parts) > 1 and (found := _at_once(parts, swap)) is not None:
        return found
    triples = [_sides(f, swap) for f in parts]
    es: Any
    lower: Any
    upper: Any
    if len(triples) == 1:
        es, lower, upper = triples[0]
    else:
        es = traverse.object_array([t[0] for t in triples])
        lower, upper = (np.array([t[i] for t in triples]) for i in (1, 2))
    return linear_constraint(es, lower, upper, parts) if linear else constraint(es, lower, upper)


def formula_constraint(f: Formula, linear: bool = False) -> BindingBase[Constraint]:
    """The constraint of a formula.

    Raises:
        RuntimeError: it is no conjunction of ==, <=, >=, or never holds.
    """
    found = _relation_at_once(f, True, linear) if f._kind in _RELATIONS else None
    if found is not None:
        return found
    parts = _relations(f, "ParseConstraint", _RELATIONS, _ANY_RELATION)
    return _parsed(parts, len(parts) == 1, linear)


def formulas_constraint(formulas: list[Formula], linear: bool = False) -> BindingBase[Constraint]:
    """The constraint of several formulas.

    Raises:
        RuntimeError: one of them is no conjunction of ==, <=, >=, or never holds.
    """
    never = next((i for i, f in enumerate(formulas) if f.get_kind() is FormulaKind.False_), None)
    if never is not None:
        raise RuntimeError(f"ParseConstraint is called with formulas({never}, 0) being always false")
    parts = [p for f in formulas for p in _relations(f, "ParseConstraint", _RELATIONS, _ANY_RELATION)]
    found = _relation_at_once(parts[0], False, linear) if len(parts) == 1 else None
    return _parsed(parts, False, linear) if found is None else found


def formulas_equality(formulas: list[Formula]) -> BindingBase[LinearEqualityConstraint]:
    """The linear equality constraint of formulas.

    Raises:
        RuntimeError: one of them is no conjunction of ==, or not linear.
    """
    parts = [p for f in formulas for p in _relations(f, "ParseLinearConstraint", (FormulaKind.Eq,), _EQUALITY)]
    es = [_sides(f, False)[0] for f in parts]
    return equality_constraint(traverse.object_array(es), np.zeros(len(es)))
