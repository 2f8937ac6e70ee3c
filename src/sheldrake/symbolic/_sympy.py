"""To sympy and back. sympy is imported when one of these is called."""

from __future__ import annotations

import functools
import operator
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.symbolic import _build, _functions
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._formula import Formula
from sheldrake.symbolic._kinds import FormulaKind as K
from sheldrake.symbolic._variable import Variable

if TYPE_CHECKING:
    import sympy


def to_sympy(x: Any, *, memo: dict | None = None) -> Any:
    """Returns sympy's counterpart of a number, a variable, an expression or a formula.

    Args:
        x: What to convert.
        memo: Filled with the symbols made for variables, by identity number, and the variables by symbol. Pass the
            same dict again to get the same symbols, and to `from_sympy` to get the same variables.

    Raises:
        NotImplementedError: sympy has no counterpart.
    """
    memo = {} if memo is None else memo
    if isinstance(x, (bool, np.bool_, int, float)):
        return x
    if isinstance(x, Variable):
        return _symbol(x, memo)
    if isinstance(x, Expression):
        done: dict[int, Any] = {}
        for node in _build.nodes(x):
            done[node._serial] = _to_sympy(node, done, memo)
        return done[x._serial]
    if isinstance(x, Formula):
        return _formula_to_sympy(x, memo)
    raise NotImplementedError(f"Cannot create a SymPy object from the given object {x!r}")


def _symbol(v: Variable, memo: dict) -> sympy.Symbol:
    import sympy

    if v.get_id() not in memo:
        types = {
            Variable.Type.BOOLEAN: {},
            Variable.Type.INTEGER: {"integer": True},
            Variable.Type.BINARY: {"integer": True},
        }
        symbol = sympy.Dummy(v.get_name(), **types.get(v.get_type(), {"real": True}))
        memo[v.get_id()] = symbol
        memo[symbol] = v
    return memo[v.get_id()]


def _to_sympy(e: Expression, done: dict[int, Any], memo: dict) -> Any:
    import sympy

    kind, args = e._kind, e._args
    if kind == k.CONSTANT:
        value = args[0]
        return sympy.Integer(int(value)) if float(value).is_integer() else sympy.Float(value)
    if kind == k.VAR:
        return _symbol(args[0], memo)
    if kind == k.NAN:
        return sympy.nan
    if kind == k.ADD:
        return sympy.Add(_exact(args[0]), *(_exact(c) * done[t._serial] for t, c in args[1]))
    if kind == k.MUL:
        return sympy.Mul(_exact(args[0]), *(done[b._serial] ** done[x._serial] for b, x in args[1]))
    if kind == k.IF_THEN_ELSE:
        condition = _formula_to_sympy(args[0], memo)
        return sympy.Piecewise((done[args[1]._serial], condition), (done[args[2]._serial], True))
    if kind == k.UNINTERPRETED:
        raise NotImplementedError(f"Cannot create a SymPy object from the uninterpreted function {e}")
    functions: dict[int, Any] = {
        k.DIV: operator.truediv, k.POW: operator.pow, k.ATAN2: sympy.atan2, k.MIN: sympy.Min, k.MAX: sympy.Max,
        k.ABS: sympy.Abs, k.CEIL: sympy.ceiling, k.FLOOR: sympy.floor,
    }  # fmt: skip
    function = functions.get(kind) or getattr(sympy, k.UNARY_NAMES[kind])
    return function(*(done[a._serial] for a in args))


def _exact(c: float) -> int | float:
    return int(c) if float(c).is_integer() else c


def _formula_to_sympy(f: Formula, memo: dict) -> Any:
    import sympy

    kind, args = f._kind, f._args
    relations = {
        K.Eq: sympy.Eq, K.Neq: sympy.Ne, K.Gt: sympy.Gt, K.Geq: sympy.Ge, K.Lt: sympy.Lt, K.Leq: sympy.Le,
        K.And: sympy.And, K.Or: sympy.Or, K.Not: sympy.Not,
    }  # fmt: skip
    if kind in (K.True_, K.False_):
        return sympy.true if kind is K.True_ else sympy.false
    if kind is K.Var:
        return _symbol(args[0], memo)
    if kind not in relations:
        raise NotImplementedError(f"Cannot create a SymPy object from the given {kind} object {f!r}")
    return relations[kind](*(to_sympy(a, memo=memo) for a in args))


def from_sympy(x: Any, *, memo: dict | None = None) -> Any:
    """Returns the number, variable, expression or formula that a sympy object means.

    Args:
        x: What to convert.
        memo: The dict that `to_sympy` filled: variables by symbol.

    Raises:
        NotImplementedError: a symbol is not in `memo`, or there is no counterpart.
    """
    if isinstance(x, (bool, int, float)):
        return x
    return _from_sympy(x, {} if memo is None else memo)


def _from_sympy(x: Any, memo: dict) -> Any:
    import sympy

    if x is sympy.true or x is sympy.false:
        return bool(x)
    if isinstance(x, sympy.Symbol):
        if x not in memo:
            raise NotImplementedError(f"The SymPy variable {x} is missing from the `memo` dict.")
        return memo[x]
    if x.is_Atom:
        if x.is_number:
            return float(x)
        raise NotImplementedError(f"Unsupported atom {x} ({type(x)})")
    if isinstance(x, sympy.Piecewise):
        return _from_piecewise(x, memo)
    args = [_from_sympy(a, memo) for a in x.args]
    function = _functions_of_sympy().get(x.func)
    if function is None:
        raise NotImplementedError(f"Unsupported head {x.func}")
    return function(*args)


def _from_piecewise(x: Any, memo: dict) -> Any:
    pieces = [(_from_sympy(value, memo), _from_sympy(condition, memo)) for value, condition in x.args]
    if pieces[-1][1] is not True:
        raise NotImplementedError(f"Unsupported: {x} does not say what holds otherwise.")
    out = pieces[-1][0]
    for value, condition in reversed(pieces[:-1]):
        out = _functions.if_then_else(condition, value, out)
    return out


@functools.cache
def _functions_of_sympy() -> dict[Any, Any]:
    import sympy

    def logical(function: Any) -> Any:
        def call(*args: Any) -> Any:
            return function(*(Formula(a) if not isinstance(a, Formula) else a for a in args))

        return call

    table: dict[Any, Any] = {
        sympy.Add: lambda *a: functools.reduce(operator.add, a),
        sympy.Mul: lambda *a: functools.reduce(operator.mul, a),
        sympy.Pow: _functions.pow,
        sympy.Abs: _functions.abs,
        sympy.ceiling: _functions.ceil,
        sympy.Min: lambda *a: functools.reduce(_functions.min, a),
        sympy.Max: lambda *a: functools.reduce(_functions.max, a),
        sympy.atan2: _functions.atan2,
        sympy.And: logical(_functions.logical_and),
        sympy.Or: logical(_functions.logical_or),
        sympy.Not: logical(_functions.logical_not),
    }
    for name in ("exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "floor"):
        table[getattr(sympy, name)] = getattr(_functions, name)
    signs = {"Equality": "eq", "Unequality": "ne", "StrictGreaterThan": "gt", "GreaterThan": "ge"}
    signs |= {"StrictLessThan": "lt", "LessThan": "le"}
    for name, sign in signs.items():
        table[getattr(sympy, name)] = getattr(operator, sign)
    return table
