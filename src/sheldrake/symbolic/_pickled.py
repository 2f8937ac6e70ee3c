"""Variables, expressions and formulas as pickles.

A variable is one of the process that made it. Its pickle names that process: there it is the same variable again, and
anywhere else all pickles of it give one variable, of its name and type.
"""

from __future__ import annotations

import copyreg
import os
import weakref

from sheldrake.symbolic import _build, _formula
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._formula import Formula
from sheldrake.symbolic._variable import Variable, number_of_last

_NUMBER = (1 << 56) - 1  # The bits of an identity above these are the type's.
_Origin = tuple[str, int]
# Names of this process, each with the last variable made before it: a forked child counts on from its parent's.
_names: list[tuple[int, str]] = [(0, os.urandom(16).hex())]
_alive: weakref.WeakValueDictionary[_Origin, Variable] = weakref.WeakValueDictionary()
_origins: dict[int, _Origin] = {}  # Of variables that come from elsewhere, by identity.


def _renamed() -> None:
    _names.append((number_of_last(), os.urandom(16).hex()))


def _reduced_variable(v: Variable) -> tuple:
    """What `pickle` needs to make a variable again."""
    origin = _origins.get(v._id)
    if origin is None:
        number = v._id & _NUMBER
        origin = next(name for last, name in reversed(_names) if last < number), number
    _alive[origin] = v
    return _variable, (origin, v._name, v._type.value)


def _variable(origin: _Origin, name: str, kind: int) -> Variable:
    found = _alive.get(origin)
    if found is None:
        found = _alive[origin] = Variable(name, Variable.Type(kind))
        _origins[found._id] = origin
    return found


def _reduced_expression(e: Expression) -> tuple:
    """What `pickle` needs to make an expression again: its different parts in a row, by number in others."""
    parts = _build.nodes(e)
    at = {part._serial: i for i, part in enumerate(parts)}
    return _expression, ([(part._kind, *_contents(part, at)) for part in parts],)


def _contents(e: Expression, at: dict[int, int]) -> tuple:
    if e._kind == k.ADD:
        return e._args[0], [(at[term._serial], c) for term, c in e._args[1]]
    if e._kind == k.MUL:
        return e._args[0], [(at[base._serial], at[exponent._serial]) for base, exponent in e._args[1]]
    if e._kind in (k.CONSTANT, k.VAR, k.NAN):
        return e._args
    own = e._args[:1] if e._kind in (k.UNINTERPRETED, k.IF_THEN_ELSE) else ()
    return (*own, [at[child._serial] for child in _build.children(e)])


def _expression(parts: list[tuple]) -> Expression:
    made: list[Expression] = []
    for kind, *contents in parts:
        made.append(_part(kind, contents, made))
    return made[-1]


def _part(kind: int, contents: list, made: list[Expression]) -> Expression:
    if kind == k.CONSTANT:
        return _build.constant(contents[0])
    if kind == k.VAR:
        return _build.variable(contents[0])
    if kind == k.NAN:
        return _build.NOT_A_NUMBER
    if kind == k.ADD:
        return _build.make_sum(contents[0], {made[i]._serial: (made[i], c) for i, c in contents[1]})
    if kind == k.MUL:
        return _build.make_product(
            contents[0], {made[i]._serial: (made[i], _build.numbered(made[j])) for i, j in contents[1]}
        )
    children = [made[i] for i in contents[-1]]
    if kind == k.UNINTERPRETED:
        return _build.uninterpreted(contents[0], tuple(children))
    if kind == k.IF_THEN_ELSE:
        return _build.conditional(contents[0], *children)
    return _build.plain(kind, *children)


def _reduced_formula(f: Formula) -> tuple:
    """What `pickle` needs to make a formula again."""
    return _formula.again, (f._kind, f._args)


def allow() -> None:
    """Tells `pickle` and `copyreg` how all of them are reduced."""
    copyreg.pickle(Variable, _reduced_variable)  # type: ignore[arg-type]
    copyreg.pickle(Expression, _reduced_expression)  # type: ignore[arg-type]
    copyreg.pickle(Formula, _reduced_formula)  # type: ignore[arg-type]
    if hasattr(os, "register_at_fork"):
        os.register_at_fork(after_in_child=_renamed)
