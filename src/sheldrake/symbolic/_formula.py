"""Formulas: what is true or false of expressions.

What comparisons of expressions give; programs take them as constraints, conditionals as their condition.
"""

from __future__ import annotations

import operator
import sys
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._overloads import Mismatch, overloaded
from sheldrake.symbolic import _build
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._arguments import SUBSTITUTIONS
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._kinds import FormulaKind as K
from sheldrake.symbolic._variable import Variable, Variables

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sheldrake.common._types import Symbolic, Symbolics

_functions: Any = None  # Modules that need the class below; the package binds them when all is loaded.
_traverse: Any = None

_COMPARISONS = {
    "==": (K.Eq, operator.eq),
    "!=": (K.Neq, operator.ne),
    ">": (K.Gt, operator.gt),
    ">=": (K.Geq, operator.ge),
    "<": (K.Lt, operator.lt),
    "<=": (K.Leq, operator.le),
}
_SIGNS = {kind: sign for sign, (kind, _) in _COMPARISONS.items()}
_TESTS = dict(_COMPARISONS.values())
_KEY = operator.attrgetter("_key")


class Formula:
    """A statement about expressions and Boolean variables: immutable.

    It is neither true nor false until `Evaluate` is called, so `if formula:` is an error. `==` between formulas tells
    whether they have the same structure.

    Args:
        value: True, False or a Boolean variable; False if absent.
    """

    __slots__ = ("_args", "_kind", "_known", "_order")
    _args: Any
    _kind: K
    _known: tuple | None  # Its identity, and its order, once they have been asked for.
    _order: tuple | None

    def __new__(cls, value: Any = False, *, var: Variable | None = None) -> Formula:
        value = value if var is None else var
        if isinstance(value, (bool, np.bool_)):
            return _TRUE if value else _FALSE
        if isinstance(value, Formula):
            return value
        if not isinstance(value, Variable):
            raise Mismatch(
                f"Formula(): incompatible constructor arguments; expected a bool or a Boolean Variable, got {value!r}."
            )
        if value.get_type() is not Variable.Type.BOOLEAN:
            raise RuntimeError(f"Formula(): {value!r} is not a Boolean variable.")
        return _make(K.Var, value)

    @staticmethod
    def True_() -> Formula:
        """Returns the formula that holds always."""
        return _TRUE

    @staticmethod
    def False_() -> Formula:
        """Returns the formula that never holds."""
        return _FALSE

    def get_kind(self) -> K:
        """Returns what the formula is at its top."""
        return self._kind

    def EqualTo(self, other: Formula) -> bool:
        """Tells whether both have the same structure."""
        if not isinstance(other, Formula):
            raise Mismatch(f"Formula.EqualTo(): incompatible function arguments; expected a Formula, got {other!r}.")
        return self._identity == other._identity

    def GetFreeVariables(self) -> Variables:
        """Returns the variables in it that no `forall` binds."""
        return Variables(sorted(self._variables(), key=Variable.get_id))

    def Evaluate(self, env: Mapping[Variable, float] | None = None) -> bool:
        """Tells whether it holds for given values of the variables.

        Raises:
            RuntimeError: a variable has no value.
        """
        return self._evaluate(_traverse.numbers_by_variable("Evaluate", env))

    @overloaded(*SUBSTITUTIONS)
    def Substitute(
        self, what: Mapping[Variable, Symbolic] | Variable | Symbolics, e: Symbolic | None = None
    ) -> Formula:
        """Returns the formula with expressions in the place of variables, all at once.

        Called as `Substitute(var, e)` or `Substitute({var: e, ...})`.
        """
        return self._substitute(_traverse.substitution("Substitute", what, e))

    def Unapply(self) -> tuple[Any, list]:
        """Returns a function and its arguments that give this formula when called."""
        return _functions.unapply_formula(self)

    def to_string(self) -> str:
        """Returns the text of it."""
        return str(self)

    def __eq__(self, other: object) -> bool:
        return self._identity == other._identity if isinstance(other, Formula) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._identity)

    def __bool__(self) -> bool:
        # A kernel that runs on expressions may branch on numbers, such as a mass: those comparisons are decided.
        if self._is_constant() and "._kernels." in sys._getframe(1).f_globals.get("__name__", ""):
            return self._truth()
        raise RuntimeError(
            "You should not call `__bool__` / `__nonzero__` on `Formula`: it has no truth value before Evaluate(). For "
            "a dictionary whose keys are a Variable, Expression or Polynomial, use common.containers.EqualToDict."
        )

    __nonzero__ = __bool__

    def __copy__(self) -> Formula:
        return self

    def __deepcopy__(self, memo: dict) -> Formula:
        return self

    def __str__(self) -> str:
        return _text(self)

    def __repr__(self) -> str:
        return f'<Formula "{self}">'

    @property
    def _identity(self) -> tuple:
        """What is equal for formulas of the same structure only."""
        if self._known is None:
            self._known = (self._kind.value, *_contents(self, "_serial", "_identity"))
        return self._known

    @property
    def _key(self) -> tuple:
        """What they are sorted by: it is as deep as they are."""
        if self._order is None:
            self._order = (self._kind.value, *_contents(self, "_key", "_key"))
        return self._order

    def _is_constant(self) -> bool:
        return self._kind in (K.True_, K.False_)

    def _truth(self) -> bool:
        return self._kind is K.True_

    def _expressions(self) -> tuple[Expression, ...]:
        if self._kind in _SIGNS:
            return self._args
        if self._kind is K.Isnan:
            return self._args
        return tuple(self._args[0].flat) if self._kind is K.PositiveSemidefinite else ()

    def _variables(self) -> set[Variable]:
        if self._kind in (K.And, K.Or, K.Not):
            return set().union(*(f._variables() for f in self._args))
        if self._kind is K.Forall:
            return self._args[1]._variables() - set(self._args[0])
        if self._kind is K.Var:
            return {self._args[0]}
        return set().union(*(_traverse.variables_of(e) for e in self._expressions()))

    def _evaluate(self, env: dict[Variable, float]) -> bool:
        kind, args = self._kind, self._args
        if kind in _TESTS:
            a, b = _traverse.evaluate_nodes(args, env)
            return bool(_TESTS[kind](a, b))
        if kind is K.And:
            return all(f._evaluate(env) for f in args)
        if kind is K.Or:
            return any(f._evaluate(env) for f in args)
        if kind is K.Not:
            return not args[0]._evaluate(env)
        if kind is K.Var:
            if args[0] not in env:
                raise _traverse.no_entry(args[0])
            return bool(env[args[0]])
        if kind is K.Isnan:
            if args[0] is _build.NOT_A_NUMBER:
                return True
            value = _traverse.evaluate_nodes(args, env)[0]
            return value != value
        if kind is K.PositiveSemidefinite:
            matrix = np.reshape(_traverse.evaluate_nodes(list(args[0].flat), env), args[0].shape)
            return bool(np.linalg.eigvalsh(matrix).min(initial=0.0) >= -1e-12 * max(1.0, float(np.abs(matrix).max())))
        if kind is K.Forall:
            raise RuntimeError(f"Formula.Evaluate(): {self} quantifies over all values and cannot be evaluated.")
        return kind is K.True_

    def _substitute(self, s: dict[Variable, Expression]) -> Formula:
        kind, args = self._kind, self._args
        if kind in _SIGNS:
            return compare(_SIGNS[kind], *_traverse.substitute(args, s))
        if kind in (K.And, K.Or):
            return junction(kind, [f._substitute(s) for f in args])
        if kind is K.Not:
            return negation(args[0]._substitute(s))
        if kind is K.Isnan:
            return is_nan(_traverse.substitute(args, s)[0])
        if kind is K.Forall:
            return for_all(args[0], args[1]._substitute({v: e for v, e in s.items() if v not in args[0]}))
        if kind is K.PositiveSemidefinite:
            flat = np.empty(args[0].size, dtype=object)
            flat[:] = _traverse.substitute(list(args[0].flat), s)
            return semidefinite(flat.reshape(args[0].shape))
        return self


def _make(kind: K, *args: Any) -> Formula:
    f = object.__new__(Formula)
    f._kind, f._args, f._known, f._order = kind, args, None, None
    return f


def _contents(f: Formula, of_expression: str, of_formula: str) -> tuple:
    """What formulas of one kind differ by, told by an attribute of their expressions and one of their formulas."""
    kind, args = f._kind, f._args
    if kind is K.Var:
        return (args[0]._id,)
    if kind is K.Forall:
        return (tuple(v._id for v in args[0]), getattr(args[1], of_formula))
    if kind is K.PositiveSemidefinite:
        return (len(args[0]), tuple(getattr(e, of_expression) for e in args[0].flat))
    return tuple(getattr(part, of_formula if part.__class__ is Formula else of_expression) for part in args)


_FALSE, _TRUE = _make(K.False_), _make(K.True_)


def truth(value: bool) -> Formula:
    """The formula True or False."""
    return _TRUE if value else _FALSE


def compare(sign: str, a: Expression, b: Expression) -> Formula:
    """a < b, and so on; decided at once where a - b is a number."""
    kind, test = _COMPARISONS[sign]
    difference = _difference_of_numbers(a, b)
    return _make(kind, a, b) if difference is None else truth(test(difference, 0.0))


def _difference_of_numbers(a: Expression, b: Expression) -> float | None:
    """a - b if that is a number: what is no sum differs from what is no sum by none but itself."""
    if a._kind == k.ADD and b._kind == k.ADD:
        may_be = a._terms.keys() == b._terms.keys()
    elif a._kind == k.ADD or b._kind == k.ADD:
        may_be = len((a if a._kind == k.ADD else b)._terms) == 1  # what is no sum cancels one term at most
    else:
        may_be = a._kind == b._kind
    if may_be:
        difference = _build.subtract(a, b)
        return difference._args[0] if difference._kind == k.CONSTANT else None
    return None


def junction(kind: K, formulas: list[Formula]) -> Formula:
    """The conjunction or disjunction, flat and without repetitions."""
    decides, neutral = (_FALSE, _TRUE) if kind is K.And else (_TRUE, _FALSE)
    parts: dict[tuple, Formula] = {}
    for f in formulas:
        for part in f._args if f._kind is kind else (f,):
            if part is decides:
                return decides
            if part is not neutral:
                parts[part._identity] = part
    ordered = sorted(parts.values(), key=_KEY) if len(parts) > 1 else [*parts.values()]
    if len(ordered) < 2:
        return ordered[0] if ordered else neutral
    return _make(kind, *ordered)


def negation(f: Formula) -> Formula:
    """not f."""
    if f._is_constant():
        return truth(not f._truth())
    return f._args[0] if f._kind is K.Not else _make(K.Not, f)


def is_nan(e: Expression) -> Formula:
    """Whether an expression is not a number."""
    return _make(K.Isnan, e)


def for_all(variables: Variables, f: Formula) -> Formula:
    """Whether f holds for all values of the variables."""
    return _make(K.Forall, Variables(variables), f)


def semidefinite(matrix: np.ndarray) -> Formula:
    """Whether a symmetric matrix of expressions has no negative eigenvalue.

    Raises:
        RuntimeError: the matrix is not symmetric.
    """
    rows, cols = matrix.shape
    if rows != cols or any(matrix[i, j]._serial != matrix[j, i]._serial for i in range(rows) for j in range(i)):
        raise RuntimeError(f"positive_semidefinite(): the matrix is not symmetric:\n{_rows_of(matrix)}")
    return _make(K.PositiveSemidefinite, matrix)


def again(kind: K, args: tuple) -> Formula:
    """The formula of a kind and its parts, as another was made of."""
    if kind in (K.True_, K.False_):
        return truth(kind is K.True_)
    if kind in (K.And, K.Or):
        return junction(kind, list(args))
    if kind is K.Not:
        return negation(*args)
    if kind is K.Forall:
        return for_all(*args)
    if kind is K.PositiveSemidefinite:
        return semidefinite(*args)
    if kind is K.Var:
        return Formula(*args)
    return _make(kind, *args)


def _rows_of(matrix: np.ndarray) -> str:
    texts = [[str(e) for e in row] for row in matrix]
    width = max((len(t) for row in texts for t in row), default=0)
    return "\n".join(" ".join(t.rjust(width) for t in row) for row in texts)


def _text(f: Formula) -> str:
    kind, args = f._kind, f._args
    if kind in _SIGNS:
        return f"({args[0]} {_SIGNS[kind]} {args[1]})"
    if kind in (K.And, K.Or):
        return f"({f' {kind.name.lower()} '.join(map(str, args))})"
    if kind is K.Not:
        return f"!({args[0]})"
    if kind is K.Var:
        return args[0].get_name()
    if kind is K.Isnan:
        return f"isnan({args[0]})"
    if kind is K.Forall:
        return f"forall({args[0]}. {args[1]})"
    if kind is K.PositiveSemidefinite:
        return f"positive_semidefinite({_rows_of(args[0])})"
    return "True" if kind is K.True_ else "False"
