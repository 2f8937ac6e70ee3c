"""The functions of the module: mathematics, conditionals, logic, and taking expressions apart."""

from __future__ import annotations

import functools
import operator
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._overloads import Mismatch
from sheldrake.symbolic import _build, _formula
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._formula import Formula
from sheldrake.symbolic._kinds import FormulaKind as K
from sheldrake.symbolic._variable import Variable, Variables

if TYPE_CHECKING:
    from collections.abc import Callable

    from sheldrake.common._types import Symbolic, Symbolics


def _unary(kind: int) -> Callable[[Symbolic], Expression]:
    name = k.UNARY_NAMES[kind]

    def function(x: Symbolic) -> Expression:
        return _build.unary(kind, _build.expect(name, x))

    function.__name__ = function.__qualname__ = name
    function.__doc__ = f"Returns the expression {name}(x) of an expression, a variable or a number."
    return function


log, abs, exp, sqrt = (_unary(kind) for kind in (k.LOG, k.ABS, k.EXP, k.SQRT))
sin, cos, tan = (_unary(kind) for kind in (k.SIN, k.COS, k.TAN))
asin, acos, atan = arcsin, arccos, arctan = tuple(_unary(kind) for kind in (k.ASIN, k.ACOS, k.ATAN))
sinh, cosh, tanh = (_unary(kind) for kind in (k.SINH, k.COSH, k.TANH))
ceil, floor = _unary(k.CEIL), _unary(k.FLOOR)


def atan2(y: Symbolic, x: Symbolic) -> Expression:
    """Returns the expression of the angle [rad] of the point (x, y)."""
    return _build.binary(k.ATAN2, _build.expect("atan2", y), _build.expect("atan2", x))


arctan2 = atan2


def min(a: Symbolic, b: Symbolic) -> Expression:
    """Returns the expression of the smaller of the two."""
    return _build.binary(k.MIN, _build.expect("min", a), _build.expect("min", b))


def max(a: Symbolic, b: Symbolic) -> Expression:
    """Returns the expression of the larger of the two."""
    return _build.binary(k.MAX, _build.expect("max", a), _build.expect("max", b))


def pow(base: Symbolic, exponent: Symbolic) -> Expression:
    """Returns the expression of base to the power exponent."""
    return _build.power(_build.expect("pow", base), _build.expect("pow", exponent))


def _as_formula(call: str, f: Symbolics) -> Formula:
    if isinstance(f, Formula):
        return f
    if isinstance(f, (bool, np.bool_)) or (isinstance(f, Variable) and f.get_type() is Variable.Type.BOOLEAN):
        return Formula(f)
    raise Mismatch(f"{call}(): incompatible function arguments; expected a Formula, got {f!r}.")


def if_then_else(f_cond: Any, e_then: Any, e_else: Any) -> Expression:
    """Returns the expression that is `e_then` where the formula holds and `e_else` elsewhere."""
    call = "if_then_else"
    return _build.conditional(_as_formula(call, f_cond), _build.expect(call, e_then), _build.expect(call, e_else))


def uninterpreted_function(name: str, arguments: Any) -> Expression:
    """Returns the expression of a function of which only name and arguments are known."""
    return _build.uninterpreted(name, tuple(_build.expect("uninterpreted_function", a) for a in arguments))


def isnan(x: Symbolic | None = None, *, e: Symbolic | None = None) -> Formula:
    """Returns the formula that an expression (`x` or `e`, by Drake's two names) is not a number."""
    return _formula.is_nan(_build.expect("isnan", e if x is None else x))


def logical_and(*formulas: Any) -> Formula:
    """Returns the formula that all of the formulas hold."""
    if not formulas:
        raise AssertionError("logical_and(): Must supply at least one operand")
    return _formula.junction(K.And, [_as_formula("logical_and", f) for f in formulas])


def logical_or(*formulas: Any) -> Formula:
    """Returns the formula that one or more of the formulas hold."""
    if not formulas:
        raise AssertionError("logical_or(): Must supply at least one operand")
    return _formula.junction(K.Or, [_as_formula("logical_or", f) for f in formulas])


def logical_not(f: Symbolics) -> Formula:
    """Returns the formula that f does not hold."""
    return _formula.negation(_as_formula("logical_not", f))


def forall(vars: Variables, f: Symbolics) -> Formula:
    """Returns the formula that f holds for all values of the variables."""
    return _formula.for_all(vars, _as_formula("forall", f))


def _as_matrix(m: Symbolics) -> np.ndarray:
    """An array in which a vector is a column."""
    array = np.asarray(m, dtype=object)
    if array.ndim not in (1, 2):
        raise TypeError(f"incompatible function arguments: expected a matrix, got one of {array.ndim} dimensions.")
    return array.reshape(-1, 1) if array.ndim == 1 else array


def positive_semidefinite(m: Symbolics) -> Formula:
    """Returns the formula that a symmetric matrix, shape `(n, n)`, has no negative eigenvalue."""
    array = _as_matrix(m)
    flat = np.empty(array.size, dtype=object)
    for i, x in enumerate(array.flat):
        flat[i] = _build.expect("positive_semidefinite", x)
    return _formula.semidefinite(flat.reshape(array.shape))


def inv(m: Symbolics) -> np.ndarray:
    """Returns the inverse of a matrix of expressions, shape `(n, n)` with n up to 4, by cofactors.

    Raises:
        RuntimeError: the matrix is not square or larger.
    """
    matrix = _as_matrix(m)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or matrix.shape[0] > 4:
        raise RuntimeError(f"inv(): expected a square matrix of up to 4 rows, got one of shape {matrix.shape}.")
    n = matrix.shape[0]
    entries = np.empty((n, n), dtype=object)
    for index in np.ndindex(n, n):
        entries[index] = _build.expect("inv", matrix[index])
    cofactors = np.empty((n, n), dtype=object)
    for i, j in np.ndindex(n, n):
        minor = np.delete(np.delete(entries, i, 0), j, 1)
        value = _determinant(minor)
        cofactors[i, j] = _build.negate(value) if (i + j) % 2 else value
    determinant = _build.sum_of(_build.multiply(entries[0, j], cofactors[0, j]) for j in range(n))
    out = np.empty((n, n), dtype=object)
    for i, j in np.ndindex(n, n):
        out[i, j] = _build.divide(cofactors[j, i], determinant)
    return out


def _determinant(m: np.ndarray) -> Expression:
    if m.shape[0] == 0:
        return _build.ONE
    terms = []
    for j in range(m.shape[0]):
        term = _build.multiply(m[0, j], _determinant(np.delete(m[1:], j, 1)))
        terms.append(_build.negate(term) if j % 2 else term)
    return _build.sum_of(terms)


# Taking apart


def _reduce_add(*args: Symbolic) -> Any:
    """Returns the sum of the arguments."""
    return functools.reduce(operator.add, args)


def _reduce_mul(*args: Symbolic) -> Any:
    """Returns the product of the arguments."""
    return functools.reduce(operator.mul, args)


_APPLY: dict[int, Any] = {
    k.LOG: log, k.ABS: abs, k.EXP: exp, k.SQRT: sqrt, k.SIN: sin, k.COS: cos, k.TAN: tan, k.ASIN: asin, k.ACOS: acos,
    k.ATAN: atan, k.SINH: sinh, k.COSH: cosh, k.TANH: tanh, k.CEIL: ceil, k.FLOOR: floor, k.POW: pow, k.ATAN2: atan2,
    k.MIN: min, k.MAX: max, k.DIV: operator.truediv, k.IF_THEN_ELSE: if_then_else,
}  # fmt: skip


def unapply(e: Expression) -> tuple[Any, list]:
    """A function and arguments that give the expression."""
    kind, args = e._kind, e._args
    if kind in (k.CONSTANT, k.VAR):
        return Expression, [args[0]]
    if kind == k.NAN:
        return Expression, [float("nan")]
    if kind == k.ADD:
        return _reduce_add, [args[0], *(_build.scale(c, t) for t, c in args[1])]
    if kind == k.MUL:
        return _reduce_mul, [args[0], *(_build.power(b, x) for b, x in args[1])]
    if kind == k.UNINTERPRETED:
        return uninterpreted_function, [args[0], list(args[1])]
    return _APPLY[kind], list(args)


def unapply_formula(f: Formula) -> tuple[Any, list]:
    """A function and arguments that give the formula."""
    comparison = {K.Eq: operator.eq, K.Neq: operator.ne, K.Gt: operator.gt, K.Geq: operator.ge, K.Lt: operator.lt}
    comparison[K.Leq] = operator.le
    logic = {K.And: logical_and, K.Or: logical_or, K.Not: logical_not, K.Isnan: isnan, K.Forall: forall}
    logic[K.PositiveSemidefinite] = positive_semidefinite
    kind = f._kind
    if kind is K.True_:
        return Formula.True_, []
    if kind is K.False_:
        return Formula.False_, []
    if kind is K.Var:
        return Formula, [f._args[0]]
    return (comparison.get(kind) or logic[kind]), list(f._args)
