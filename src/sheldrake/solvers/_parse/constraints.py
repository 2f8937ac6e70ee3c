"""Constraints from expressions with bounds: the most special class that fits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.solvers._functions.bindings import bind, bind_list
from sheldrake.solvers._functions.cone_constraints import LorentzConeConstraint, RotatedLorentzConeConstraint
from sheldrake.solvers._functions.constraints import (
    BoundingBoxConstraint,
    ExpressionConstraint,
    LinearConstraint,
    LinearEqualityConstraint,
    QuadraticConstraint,
)
from sheldrake.solvers._parse.coefficients import Affine, Coefficients, affine_rows, coefficients, difference
from sheldrake.symbolic import DecomposeL2NormExpression, Expression, Formula, FormulaKind, Variable
from sheldrake.symbolic import _build as build
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic import _traverse as traverse
from sheldrake.symbolic._decompose import LinearTerms
from sheldrake.symbolic._keys import age

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.solvers._functions.bindings import BindingBase
    from sheldrake.solvers._functions.evaluators import Constraint


def _move_constants(lower: np.ndarray, upper: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of e - c from those of e."""
    if not np.isfinite(c).all():
        raise RuntimeError("FindBound() cannot handle a constraint with infinity in the constant term after expansion.")
    return lower - c, upper - c


def _check_constant_rows(
    rows: list[LinearTerms], expressions: Sequence[Expression], lower: np.ndarray, upper: np.ndarray
) -> None:
    """Raises a RuntimeError where a row without variables is never satisfied."""
    for i, (terms, c) in enumerate(rows):
        if not lower[i] <= c <= upper[i] and not any([value for _, value in terms]):
            raise RuntimeError(
                f"Constraint {lower[i]:g} <= {expressions[i]} <= {upper[i]:g} is unsatisfiable but called with "
                "ParseConstraint."
            )


def _linear(
    expressions: Sequence[Expression], rows: list[LinearTerms], lower: np.ndarray, upper: np.ndarray
) -> BindingBase[LinearConstraint]:
    """Equality, bounding box or other linear constraint."""
    _check_constant_rows(rows, expressions, lower, upper)
    return of_rows(rows, lower, upper)


def of_rows(rows: list[LinearTerms], lower: np.ndarray, upper: np.ndarray) -> BindingBase[LinearConstraint]:
    """Equality, bounding box or other linear constraint of rows which have variables, or hold."""
    if not rows:
        return bind(BoundingBoxConstraint, BoundingBoxConstraint(np.zeros(0), np.zeros(0)), np.zeros(0, dtype=object))
    lower, upper = _move_constants(lower, upper, np.array([c for _, c in rows]))
    is_equality = bool((lower == upper).all())
    if not is_equality and all([len(terms) == 1 and terms[0][1] != 0.0 for terms, _ in rows]):
        scale = np.array([terms[0][1] for terms, _ in rows])
        low, high = lower / scale, upper / scale
        low, high = np.where(scale > 0.0, low, high), np.where(scale > 0.0, high, low)
        vars = traverse.object_array([terms[0][0] for terms, _ in rows])
        return bind(BoundingBoxConstraint, BoundingBoxConstraint._of(low, high), vars)
    a = Affine(rows)
    if is_equality:
        return bind(LinearEqualityConstraint, LinearEqualityConstraint._of(a.A, lower, lower), a.vars)
    return bind(LinearConstraint, LinearConstraint._of(a.A, lower, upper), a.vars)


def linear_row(row: LinearTerms, lower: float, upper: float) -> BindingBase[LinearConstraint] | None:
    """The linear constraint of one row whose terms are in order, as `constraint` makes it.

    None where there is more to look at.
    """
    terms, c = row
    low, high = lower - c, upper - c
    if not terms or not math.isfinite(c) or low != low or high != high:
        return None
    vars = [v for v, _ in terms]
    if low == high:
        equation = LinearEqualityConstraint._of_row([value for _, value in terms], low, high)
        return bind_list(LinearEqualityConstraint, equation, vars)
    if len(terms) > 1:
        return bind_list(LinearConstraint, LinearConstraint._of_row([value for _, value in terms], low, high), vars)
    scale = terms[0][1]
    if scale != 1.0:
        low, high = (low / scale, high / scale) if scale > 0.0 else (high / scale, low / scale)
    return bind_list(BoundingBoxConstraint, BoundingBoxConstraint._of_variable(low, high), vars)


def _linear_at_once(e: object, lower: Any, upper: Any) -> BindingBase[Any] | None:
    """The constraint of an expression that is linear as it is, between numbers; None of others."""
    if not (isinstance(e, Expression) and isinstance(lower, float) and isinstance(upper, float)):
        return None
    row = difference(e, build.ZERO)
    return None if row is None else linear_row(row, lower, upper)


def quadratic_row(row: Coefficients, lower: Any, upper: Any) -> BindingBase[Any] | None:
    """The quadratic constraint of one row, as `constraint` makes it; None where it has more to look at."""
    if row.degree != 2 or not (isinstance(lower, float) and isinstance(upper, float)):
        return None
    low, high = lower - row.c, upper - row.c
    if math.isnan(low) or math.isnan(high) or not math.isfinite(row.c):
        return None
    return bind(QuadraticConstraint, QuadraticConstraint._of(row.hessian(), row.b, low, high), row.vars)


def constraint(expressions: np.ndarray | Expression, lower: ArrayLike, upper: ArrayLike) -> BindingBase[Constraint]:
    """The constraint lower <= expressions <= upper: linear, quadratic, a cone, or any expression.

    Raises:
        RuntimeError: it holds for no values of the variables.
    """
    found = _linear_at_once(expressions, lower, upper)
    if found is not None:
        return found
    is_single = isinstance(expressions, Expression)
    row = coefficients(expressions) if is_single else None  # type: ignore[arg-type]
    found = None if row is None else quadratic_row(row, lower, upper)
    if found is not None:
        return found
    es, lower, upper = _flat(expressions, lower, upper)
    _check_bounds(lower, upper)
    rows = affine_rows(es) if not is_single or (row is not None and row.degree < 2) else None
    if rows is not None:
        return _linear(es, rows, lower, upper)
    if len(es) == 1:
        special = _special(es[0], row, lower.item(), upper.item())
        if special is not None:
            return special
        constant = _constant_term(es[0], row is not None if is_single else traverse.is_polynomial(es[0]))
        if constant != 0.0:
            es = [build.subtract(es[0], build.constant(constant))]
            lower, upper = lower - constant, upper - constant
    new = ExpressionConstraint._of(es, lower, upper)
    return bind(ExpressionConstraint, new, new.vars())


def _flat(expressions: Any, lower: Any, upper: Any) -> tuple[list[Expression], np.ndarray, np.ndarray]:
    if isinstance(expressions, Expression) and isinstance(lower, float) and isinstance(upper, float):
        return [expressions], np.array([lower]), np.array([upper])
    single = isinstance(expressions, Expression)
    es = [expressions] if single else np.atleast_1d(expressions).ravel(order="F").tolist()
    lower, upper = (np.atleast_1d(np.asarray(b, dtype=float)).ravel(order="F") for b in (lower, upper))
    if lower.size != len(es) or upper.size != len(es):
        raise RuntimeError(f"A constraint on {len(es)} expressions has {lower.size} and {upper.size} bounds.")
    return es, lower, upper


def _check_bounds(lower: np.ndarray, upper: np.ndarray) -> None:
    if np.isnan(lower).any() or np.isnan(upper).any():
        raise RuntimeError("A bound of a constraint is nan.")


def _constant_term(e: Expression, is_polynomial: bool) -> float:
    expanded = e.Expand() if is_polynomial else e
    return expanded._constant if expanded._kind == k.ADD else 0.0


def _special(e: Expression, found: Coefficients | None, lower: float, upper: float) -> BindingBase[Constraint] | None:
    """A quadratic or Lorentz cone constraint, if it is one."""
    if found is not None:
        if found.degree != 2:
            return None
        new = QuadraticConstraint._of(found.hessian(), found.b, lower - found.c, upper - found.c)
        return bind(QuadraticConstraint, new, found.vars)
    cone = None
    if lower == -math.inf and math.isfinite(upper):
        cone = _norm_below(build.subtract(e, build.constant(upper)))
    elif upper == math.inf and math.isfinite(lower):
        cone = _norm_below(build.subtract(build.constant(lower), e))
    return None if cone is None else lorentz(*cone, LorentzConeConstraint.EvalType.kConvexSmooth)


def _norm_below(
    e: Expression, psd_tol: float = 1e-8, coefficient_tol: float = 1e-8
) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """A, b, x with `e <= 0` meaning that A x + b is in the Lorentz cone: e is a length plus an affine part."""
    if e._kind == k.SQRT:
        parts: list[tuple[Expression, float]] = [(e, 1.0)]
        rest = build.ZERO
    elif e._kind == k.ADD:
        parts = [(t, c) for t, c in e._args[1] if t._kind == k.SQRT]
        others = [build.scale(c, t) for t, c in e._args[1] if t._kind != k.SQRT]
        rest = build.sum_of([build.constant(e._args[0]), *others])
    else:
        return None
    if len(parts) != 1 or parts[0][1] <= 0.0:
        return None
    affine = coefficients(rest)
    is_norm, A, b, x = DecomposeL2NormExpression(parts[0][0], psd_tol, coefficient_tol)
    if affine is None or affine.degree > 1 or not is_norm:
        return None
    c = parts[0][1]
    everything = traverse.object_array(sorted({*affine.vars, *x}, key=Variable.get_id))
    places = {v: i for i, v in enumerate(everything)}
    M = np.zeros((A.shape[0] + 1, len(everything)))
    M[0, [places[v] for v in affine.vars]] = -affine.b / c
    M[1:, [places[v] for v in x]] = A
    return M, np.concatenate(([-affine.c / c], b)), everything


def lorentz(
    A: np.ndarray, b: np.ndarray, vars: np.ndarray, eval_type: LorentzConeConstraint.EvalType
) -> BindingBase[LorentzConeConstraint]:
    """The Lorentz cone constraint on A x + b."""
    return bind(LorentzConeConstraint, LorentzConeConstraint(A, b, eval_type), vars)


def lorentz_from_formula(
    f: Formula, eval_type: LorentzConeConstraint.EvalType, psd_tol: float, coefficient_tol: float
) -> BindingBase[LorentzConeConstraint]:
    """The Lorentz cone constraint of a formula |A x + b| <= affine.

    Raises:
        RuntimeError: the formula is of another kind.
    """
    cone = None
    if f.get_kind() in (FormulaKind.Leq, FormulaKind.Geq):
        a, b = f._args if f.get_kind() is FormulaKind.Leq else f._args[::-1]
        cone = _norm_below(build.subtract(a, b), psd_tol, coefficient_tol)
    if cone is None:
        raise RuntimeError(f"Formula {f} is not of the form sqrt(quadratic) <= affine, as a Lorentz cone needs it.")
    return lorentz(*cone, eval_type)


def rotated_lorentz(A: np.ndarray, b: np.ndarray, vars: np.ndarray) -> BindingBase[RotatedLorentzConeConstraint]:
    """The rotated Lorentz cone constraint on A x + b."""
    return bind(RotatedLorentzConeConstraint, RotatedLorentzConeConstraint(A, b), vars)


def linear_constraint(
    expressions: np.ndarray | Expression, lower: ArrayLike, upper: ArrayLike, sources: Sequence[Formula] | None = None
) -> BindingBase[LinearConstraint]:
    """The linear constraint lower <= expressions <= upper; `sources` are the formulas that said so, for errors.

    Raises:
        RuntimeError: an expression is not linear.
    """
    found = _linear_at_once(expressions, lower, upper)
    if found is not None:
        return found
    es, lower, upper = _flat(expressions, lower, upper)
    _check_bounds(lower, upper)
    rows = affine_rows(es)
    if rows is None:
        bad = next(i for i, e in enumerate(es) if affine_rows([e]) is None)
        what = f"Expression {es[bad]}" if sources is None else f"Formula {sources[bad]}"
        raise RuntimeError(f"{what} is non-linear.")
    return _linear(es, rows, lower, upper)


def equation(terms: dict[Variable, float], b: float) -> BindingBase[LinearEqualityConstraint]:
    """The constraint that variables times numbers are b; without variables one that never holds."""
    vars = sorted(terms, key=age)
    row = [terms[v] for v in vars]
    if vars and b == b:
        return bind_list(LinearEqualityConstraint, LinearEqualityConstraint._of_row(row, b, b), vars)
    vector = traverse.object_array(vars)
    return bind(LinearEqualityConstraint, LinearEqualityConstraint(np.array(row).reshape(1, -1), [b]), vector)


def equality_constraint(expressions: np.ndarray | Expression, b: ArrayLike) -> BindingBase[LinearEqualityConstraint]:
    """The constraint expressions == b.

    Raises:
        RuntimeError: an expression is not linear.
    """
    value: Any  # a float: rows of expressions are real
    terms = difference(expressions, build.ZERO) if isinstance(expressions, Expression) else None
    if terms is not None and terms[0] and isinstance(b, float) and not math.isnan(value := b - terms[1]):
        equation = LinearEqualityConstraint._of_row([c for _, c in terms[0]], value, value)
        return bind_list(LinearEqualityConstraint, equation, [v for v, _ in terms[0]])
    row = coefficients(expressions) if isinstance(expressions, Expression) else None
    if row is not None and row.degree == 1:
        right = np.asarray(b, dtype=float)
        if right.size == 1 and not math.isnan(value := right.item() - row.c):
            equation = LinearEqualityConstraint._of_row(row.b.tolist(), value, value)
            return bind(LinearEqualityConstraint, equation, row.vars)
    es, b, _ = _flat(expressions, b, b)
    rows = affine_rows(es)
    if rows is None:
        bad = next(e for e in es if affine_rows([e]) is None)
        raise RuntimeError(f"Expression {bad} is non-linear.")
    a = Affine(rows)
    return bind(LinearEqualityConstraint, LinearEqualityConstraint(a.A, b - a.c), a.vars)
