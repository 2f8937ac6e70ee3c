"""Costs and constraints from expressions and formulas: the most special class that fits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from sheldrake.solvers import _arrays
from sheldrake.solvers._bindings import bind
from sheldrake.solvers._cone_constraints import LorentzConeConstraint, RotatedLorentzConeConstraint
from sheldrake.solvers._constraints import (
    BoundingBoxConstraint,
    ExpressionConstraint,
    LinearConstraint,
    LinearEqualityConstraint,
    QuadraticConstraint,
)
from sheldrake.solvers._costs import ExpressionCost, L2NormCost, LinearCost, PolynomialCost, QuadraticCost
from sheldrake.solvers._evaluators import Cost
from sheldrake.symbolic import DecomposeL2NormExpression, Expression, Formula, FormulaKind, Variable
from sheldrake.symbolic import _build as build
from sheldrake.symbolic import _decompose as decompose
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic import _traverse as traverse

_RELATIONS = (FormulaKind.Eq, FormulaKind.Leq, FormulaKind.Geq)


class Coefficients:
    """A polynomial of degree two at most as 1/2 x' Q x + b' x + c."""

    def __init__(self, e: Expression):
        found = sorted(traverse.variables_of(e), key=Variable.get_id)
        self.vars = traverse.object_array(found)
        self.degree, self.b, self.c = 0, np.zeros(len(found)), 0.0
        self.Q: np.ndarray | None = None
        places = {v: i for i, v in enumerate(found)}
        for m, coefficient in decompose.decompose(e, set(found)).items():
            value = coefficient.Evaluate()
            self.degree = max(self.degree, m.total_degree())
            at = [places[v] for v, n in m._powers.items() for _ in range(min(n, 3))]
            if len(at) == 0:
                self.c += value
            elif len(at) == 1:
                self.b[at[0]] += value
            elif len(at) == 2:
                if self.Q is None:
                    self.Q = np.zeros((len(found), len(found)))
                self.Q[at[0], at[1]] += value
                self.Q[at[1], at[0]] += value

    def hessian(self) -> np.ndarray:
        """Q, zero if there is no term of degree two."""
        return np.zeros((len(self.vars), len(self.vars))) if self.Q is None else self.Q


def coefficients(e: Expression) -> Coefficients | None:
    """The coefficients of a polynomial of any degree; None for other expressions."""
    if not traverse.is_polynomial(e):
        return None
    return Coefficients(e)


# Costs


def cost(e: Expression) -> Any:
    """The cost of an expression: linear, quadratic, a norm, or any expression."""
    found = coefficients(e)
    if found is None:
        if e._kind == k.SQRT:
            is_norm, A, b, x = DecomposeL2NormExpression(e)
            if is_norm:
                return bind(L2NormCost, L2NormCost(A, b), x)
    elif found.degree <= 1:
        return bind(LinearCost, LinearCost(found.b, found.c), found.vars)
    elif found.degree == 2:
        return bind(QuadraticCost, QuadraticCost(found.hessian(), found.b, found.c), found.vars)
    new = ExpressionCost(e) if found is None else PolynomialCost(e)
    return bind(Cost, new, new.vars())


def linear_cost(e: Expression) -> Any:
    """The linear cost of an expression.

    Raises:
        RuntimeError: it is not linear.
    """
    found = coefficients(e)
    if found is None or found.degree > 1:
        raise RuntimeError(f"Expression {e} is non-linear.")
    return bind(LinearCost, LinearCost(found.b, found.c), found.vars)


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


def quadratic_cost(e: Expression, is_convex: bool | None) -> Any:
    """The quadratic cost of an expression.

    Raises:
        RuntimeError: it is not quadratic.
    """
    found = quadratic(e, "ParseQuadraticCost")
    return bind(QuadraticCost, QuadraticCost(found.hessian(), found.b, found.c, is_convex), found.vars)


def l2norm_cost(e: Expression, psd_tol: float, coefficient_tol: float) -> Any:
    """The cost of an expression that is a length.

    Raises:
        RuntimeError: it is none.
    """
    is_norm, A, b, x = DecomposeL2NormExpression(e, psd_tol, coefficient_tol)
    if not is_norm:
        raise RuntimeError(
            f"Expression {e} is not an L2 norm. ParseL2NormCost only supports expressions that are the square root of "
            "a quadratic."
        )
    return bind(L2NormCost, L2NormCost(A, b), x)


# Constraints


class _Affine:
    """Rows of affine expressions over all their variables, in the order of the rows that first have them."""

    def __init__(self, rows: Sequence[Coefficients]):
        self.vars = traverse.object_array(list(dict.fromkeys(v for r in rows for v in r.vars)))
        places = {v: i for i, v in enumerate(self.vars)}
        self.A = np.zeros((len(rows), len(self.vars)))
        for i, r in enumerate(rows):
            for v, value in zip(r.vars, r.b):
                self.A[i, places[v]] = value
        self.c = np.array([r.c for r in rows])


def _affine_rows(expressions: Sequence[Expression]) -> list[Coefficients] | None:
    out = []
    for e in expressions:
        found = coefficients(e)
        if found is None or found.degree > 1:
            return None
        out.append(found)
    return out


def _move_constants(lower: np.ndarray, upper: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of e - c from those of e."""
    if not np.isfinite(c).all():
        raise RuntimeError("FindBound() cannot handle a constraint with infinity in the constant term after expansion.")
    return lower - c, upper - c


def _without_trivial(
    rows: list[Coefficients], expressions: Sequence[Expression], lower: np.ndarray, upper: np.ndarray
) -> tuple[list[Coefficients], np.ndarray, np.ndarray]:
    """Leaves out rows without variables.

    Raises:
        RuntimeError: such a row is never satisfied.
    """
    keep = []
    for i, r in enumerate(rows):
        if r.b.any():
            keep.append(i)
        elif not lower[i] <= r.c <= upper[i]:
            raise RuntimeError(
                f"Constraint {lower[i]:g} <= {expressions[i]} <= {upper[i]:g} is unsatisfiable but called with "
                "ParseConstraint."
            )
    return [rows[i] for i in keep], lower[keep], upper[keep]


def _linear(expressions: Sequence[Expression], rows: list[Coefficients], lower: np.ndarray, upper: np.ndarray) -> Any:
    """Equality, bounding box or other linear constraint."""
    rows, lower, upper = _without_trivial(rows, expressions, lower, upper)
    a = _Affine(rows)
    if not rows:
        return bind(BoundingBoxConstraint, BoundingBoxConstraint(np.zeros(0), np.zeros(0)), a.vars)
    lower, upper = _move_constants(lower, upper, a.c)
    if np.array_equal(lower, upper):
        return bind(LinearEqualityConstraint, LinearEqualityConstraint(a.A, lower), a.vars)
    if np.all(np.count_nonzero(a.A, axis=1) == 1):
        return _box(a, lower, upper)
    return bind(LinearConstraint, LinearConstraint(a.A, lower, upper), a.vars)


def _box(a: _Affine, lower: np.ndarray, upper: np.ndarray) -> Any:
    cols = np.argmax(a.A != 0.0, axis=1)
    scale = a.A[np.arange(len(cols)), cols]
    low, high = lower / scale, upper / scale
    low, high = np.where(scale > 0.0, low, high), np.where(scale > 0.0, high, low)
    return bind(BoundingBoxConstraint, BoundingBoxConstraint(low, high), a.vars[cols])


def constraint(expressions: Any, lower: Any, upper: Any) -> Any:
    """The constraint lower <= expressions <= upper: linear, quadratic, a cone, or any expression.

    Raises:
        RuntimeError: it holds for no values of the variables.
    """
    es, lower, upper = _flat(expressions, lower, upper)
    _check_bounds(lower, upper)
    rows = _affine_rows(es)
    if rows is not None:
        return _linear(es, rows, lower, upper)
    if len(es) == 1:
        special = _special(es[0], lower[0], upper[0])
        if special is not None:
            return special
        constant = _constant_term(es[0])
        es = [build.subtract(es[0], build.constant(constant))]
        lower, upper = lower - constant, upper - constant
    new = ExpressionConstraint(es, lower, upper)
    return bind(ExpressionConstraint, new, new.vars())


def _flat(expressions: Any, lower: Any, upper: Any) -> tuple[list[Expression], np.ndarray, np.ndarray]:
    es = list(np.atleast_1d(expressions).ravel(order="F"))
    lower, upper = (np.atleast_1d(np.asarray(b, dtype=float)).ravel(order="F") for b in (lower, upper))
    if lower.size != len(es) or upper.size != len(es):
        raise RuntimeError(f"A constraint on {len(es)} expressions has {lower.size} and {upper.size} bounds.")
    return es, lower, upper


def _check_bounds(lower: np.ndarray, upper: np.ndarray) -> None:
    if np.isnan(lower).any() or np.isnan(upper).any():
        raise RuntimeError("A bound of a constraint is nan.")


def _constant_term(e: Expression) -> float:
    expanded = e.Expand() if traverse.is_polynomial(e) else e
    return expanded._args[0] if expanded._kind == k.ADD else 0.0


def _special(e: Expression, lower: float, upper: float) -> Any:
    """A quadratic or Lorentz cone constraint, if it is one."""
    found = coefficients(e)
    if found is not None:
        if found.degree != 2:
            return None
        new = QuadraticConstraint(found.hessian(), found.b, lower - found.c, upper - found.c)
        return bind(QuadraticConstraint, new, found.vars)
    cone = None
    if np.isneginf(lower) and np.isfinite(upper):
        cone = _norm_below(build.subtract(e, build.constant(upper)))
    elif np.isposinf(upper) and np.isfinite(lower):
        cone = _norm_below(build.subtract(build.constant(lower), e))
    return None if cone is None else lorentz(*cone, LorentzConeConstraint.EvalType.kConvexSmooth)


def _norm_below(e: Expression, psd_tol: float = 1e-8, coefficient_tol: float = 1e-8) -> tuple | None:
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


def lorentz(A: np.ndarray, b: np.ndarray, vars: np.ndarray, eval_type: Any) -> Any:
    """The Lorentz cone constraint on A x + b."""
    return bind(LorentzConeConstraint, LorentzConeConstraint(A, b, eval_type), vars)


def lorentz_from_formula(f: Formula, eval_type: Any, psd_tol: float, coefficient_tol: float) -> Any:
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


def affine_vector(expressions: Sequence[Expression], call: str) -> _Affine:
    """Affine expressions as A x + c.

    Raises:
        RuntimeError: one is not affine.
    """
    rows = _affine_rows(expressions)
    if rows is None:
        bad = next(e for e in expressions if _affine_rows([e]) is None)
        raise RuntimeError(f"{call}: expression {bad} is non-linear.")
    return _Affine(rows)


def linear_constraint(expressions: Any, lower: Any, upper: Any, what: str = "Expression") -> Any:
    """The linear constraint lower <= expressions <= upper.

    Raises:
        RuntimeError: an expression is not linear.
    """
    es, lower, upper = _flat(expressions, lower, upper)
    _check_bounds(lower, upper)
    rows = _affine_rows(es)
    if rows is None:
        bad = next(e for e in es if _affine_rows([e]) is None)
        raise RuntimeError(f"{what} {bad} is non-linear.")
    return _linear(es, rows, lower, upper)


def equality_constraint(expressions: Any, b: Any) -> Any:
    """The constraint expressions == b.

    Raises:
        RuntimeError: an expression is not linear.
    """
    es, b, _ = _flat(expressions, b, b)
    rows = _affine_rows(es)
    if rows is None:
        bad = next(e for e in es if _affine_rows([e]) is None)
        raise RuntimeError(f"Expression {bad} is non-linear.")
    a = _Affine(rows)
    return bind(LinearEqualityConstraint, LinearEqualityConstraint(a.A, b - a.c), a.vars)


# Formulas


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
        constant = side._args[0] if side._kind in (k.CONSTANT, k.ADD) else 0.0
        if isinstance(constant, float) and np.isinf(constant):
            raise RuntimeError(
                f"FindBound() cannot handle the constraint: {str(f)[1:-1]} because {side} has infinity in the constant "
                "term after expansion."
            )
    return build.subtract(a, b)


def _is_infinite(e: Expression, sign: float) -> bool:
    return e._kind == k.CONSTANT and e._args[0] == sign * np.inf


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


def _parsed(parts: list[Formula], swap: bool, linear: bool) -> Any:
    triples = [_sides(f, swap) for f in parts]
    es = traverse.object_array([t[0] for t in triples])
    lower, upper = np.array([t[1] for t in triples]), np.array([t[2] for t in triples])
    if linear:
        if _affine_rows(list(es)) is None:
            bad = next(f for f, e in zip(parts, es) if _affine_rows([e]) is None)
            raise RuntimeError(f"Formula {bad} is non-linear.")
        return linear_constraint(es, lower, upper)
    return constraint(es, lower, upper)


def formula_constraint(f: Formula, linear: bool = False) -> Any:
    """The constraint of a formula.

    Raises:
        RuntimeError: it is no conjunction of ==, <=, >=, or never holds.
    """
    parts = _relations(f, "ParseConstraint", _RELATIONS, _ANY_RELATION)
    return _parsed(parts, len(parts) == 1, linear)


def formulas_constraint(formulas: list[Formula], linear: bool = False) -> Any:
    """The constraint of several formulas.

    Raises:
        RuntimeError: one of them is no conjunction of ==, <=, >=, or never holds.
    """
    parts = [p for f in formulas for p in _relations(f, "ParseConstraint", _RELATIONS, _ANY_RELATION)]
    return _parsed(parts, False, linear)


def formulas_equality(formulas: list[Formula]) -> Any:
    """The linear equality constraint of formulas.

    Raises:
        RuntimeError: one of them is no conjunction of ==, or not linear.
    """
    parts = [p for f in formulas for p in _relations(f, "ParseLinearConstraint", (FormulaKind.Eq,), _EQUALITY)]
    es = [_sides(f, False)[0] for f in parts]
    return equality_constraint(traverse.object_array(es), np.zeros(len(es)))


def rotated_lorentz(A: np.ndarray, b: np.ndarray, vars: np.ndarray) -> Any:
    """The rotated Lorentz cone constraint on A x + b."""
    return bind(RotatedLorentzConeConstraint, RotatedLorentzConeConstraint(A, b), vars)


def flat_symbols(v: Any) -> list[Expression]:
    """Expressions, column after column."""
    return list(_arrays.expression_array(np.atleast_1d(np.asarray(v, dtype=object))).ravel(order="F"))
