"""How expressions are made: canonical sums and products, and the simplifications done on the way.

An expression is an immutable node. Equal expressions are the same node: a table of live nodes sees to that, so that
comparing is `is`, a shared part is stored and evaluated once, and sets of terms are dictionaries of node numbers.

Sums are a constant and terms with coefficients, products a constant and bases with exponents, both in the order of
`_key`: by kind first, then by content.
"""

from __future__ import annotations

import itertools
import weakref
from typing import TYPE_CHECKING, SupportsFloat

import numpy as np

from sheldrake.common._overloads import Mismatch
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic import _numbers
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._variable import Variable

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sheldrake.symbolic._formula import Formula

_REAL = (float, int, np.floating, np.integer, np.bool_)
_table: weakref.WeakValueDictionary[tuple, Expression] = weakref.WeakValueDictionary()
_serials = itertools.count()
_new = object.__new__


def _node(identity: tuple, args: tuple, key: tuple) -> Expression:
    """The live node of this identity, or a new one. identity: (kind, contents by value and node number)."""
    node = _table.get(identity)
    if node is None:
        node = _new(Expression)
        node._kind, node._args, node._key, node._serial, node._variables = identity[0], args, key, next(_serials), None
        _table[identity] = node
    return node


def constant(value: SupportsFloat) -> Expression:
    """The expression of a number; of nan, the one expression that is not a number."""
    value = float(value)
    if value != value:
        return NOT_A_NUMBER
    return _node((k.CONSTANT, value), (value,), (k.CONSTANT, value))


def variable(v: Variable) -> Expression:
    """The expression of a variable.

    Raises:
        RuntimeError: the variable is Boolean, which only formulas may hold.
    """
    if v._expression is None:
        if v._type is Variable.Type.BOOLEAN:
            raise RuntimeError(f"Expression(): {v!r} is a Boolean variable; it belongs in a Formula.")
        # The variable keeps its node alive, and both hold each other: they live as long as the process needs either.
        v._expression = _node((k.VAR, v._id), (v,), (k.VAR, v._id))
    return v._expression


def as_expression(x: object) -> Expression | None:
    """x as an expression, if it is an expression, a variable or a number; else None."""
    if x.__class__ is Expression:
        return x
    if x.__class__ is Variable:
        return variable(x)
    if isinstance(x, _REAL):
        return constant(x)
    if isinstance(x, Variable):
        return variable(x)
    return None


def expect(call: str, x: object) -> Expression:
    """x as an expression.

    Raises:
        TypeError: it is none.
    """
    e = as_expression(x)
    if e is None:
        raise Mismatch(
            f"{call}(): incompatible function arguments; expected an Expression, a Variable or a number, got {x!r}."
        )
    return e


NOT_A_NUMBER = _node((k.NAN,), (), (k.NAN,))
ZERO, ONE, MINUS_ONE, TWO = (constant(v) for v in (0.0, 1.0, -1.0, 2.0))


# Sums


def make_sum(c0: float, terms: dict[int, tuple[Expression, float]]) -> Expression:
    """c0 + the terms with their coefficients, which are not zero."""
    if not terms:
        return constant(c0)
    if len(terms) == 1 and c0 == 0.0:
        ((term, c),) = terms.values()
        return scale(c, term)
    ordered = sorted(terms.values(), key=_term_key)
    identity = (k.ADD, c0, tuple((t._serial, c) for t, c in ordered))
    return _node(identity, (c0, tuple(ordered)), (k.ADD, c0, tuple((t._key, c) for t, c in ordered)))


def _term_key(item: tuple) -> tuple:
    return item[0]._key


def add_into(terms: dict[int, tuple[Expression, float]], e: Expression) -> float:
    """Adds e to the terms and returns the constant that is left."""
    if e._kind == k.CONSTANT:
        return e._args[0]
    if e._kind == k.ADD:
        for term, c in e._args[1]:
            _add_term(terms, term, c)
        return e._args[0]
    if e._kind == k.MUL and e._args[0] != 1.0:
        _add_term(terms, make_product(1.0, {b._serial: (b, x) for b, x in e._args[1]}), e._args[0])
    else:
        _add_term(terms, e, 1.0)
    return 0.0


def _add_term(terms: dict[int, tuple[Expression, float]], term: Expression, c: float) -> None:
    known = terms.get(term._serial)
    if known is not None:
        c += known[1]
    if c == 0.0:
        terms.pop(term._serial, None)
    else:
        terms[term._serial] = (term, c)


def add(a: Expression, b: Expression) -> Expression:
    """a + b."""
    if a is ZERO:
        return b
    if b is ZERO:
        return a
    terms: dict[int, tuple[Expression, float]] = {}
    c0 = add_into(terms, a)
    c0 += add_into(terms, b)
    return make_sum(c0, terms)


def sum_of(expressions: Iterable[Expression]) -> Expression:
    """The sum of many, in one go."""
    terms: dict[int, tuple[Expression, float]] = {}
    c0 = 0.0
    for e in expressions:
        c0 += add_into(terms, e)
    return make_sum(c0, terms)


def subtract(a: Expression, b: Expression) -> Expression:
    """a - b."""
    if a is b:
        return ZERO
    return a if b is ZERO else add(a, negate(b))


def negate(e: Expression) -> Expression:
    """-e; a sum is negated term by term."""
    if e._kind == k.CONSTANT:
        return constant(-e._args[0])
    if e._kind == k.ADD:
        return make_sum(-e._args[0], {t._serial: (t, -c) for t, c in e._args[1]})
    return scale(-1.0, e)


# Products


def scale(c: float, e: Expression) -> Expression:
    """c * e for a number c; a sum keeps its shape."""
    if c == 1.0:
        return e
    if c == 0.0:
        return ZERO
    if e._kind == k.CONSTANT:
        return constant(c * e._args[0])
    if e._kind == k.MUL:
        return make_product(c * e._args[0], {b._serial: (b, x) for b, x in e._args[1]})
    if e._kind == k.POW:
        return make_product(c, {e._args[0]._serial: (e._args[0], e._args[1])})
    if e._kind == k.DIV and e._args[0]._kind == k.CONSTANT:
        return divide(constant(c * e._args[0]._args[0]), e._args[1])
    return make_product(c, {e._serial: (e, ONE)})


def make_product(c: float, factors: dict[int, tuple[Expression, Expression]]) -> Expression:
    """c * the bases to the power of their exponents, which are not zero."""
    if not factors:
        return constant(c)
    if len(factors) == 1 and c == 1.0:
        ((base, exponent),) = factors.values()
        return power(base, exponent)
    ordered = sorted(factors.values(), key=_term_key)
    identity = (k.MUL, c, tuple((b._serial, x._serial) for b, x in ordered))
    return _node(identity, (c, tuple(ordered)), (k.MUL, c, tuple((b._key, x._key) for b, x in ordered)))


def _multiply_into(factors: dict[int, tuple[Expression, Expression]], e: Expression) -> float:
    """Multiplies the factors by e and returns the constant that is left."""
    if e._kind == k.CONSTANT:
        return e._args[0]
    if e._kind == k.MUL:
        c = e._args[0]
        for base, exponent in e._args[1]:
            c *= _multiply_by(factors, base, exponent)
        return c
    return _multiply_by(factors, e, ONE)


def _multiply_by(factors: dict[int, tuple[Expression, Expression]], base: Expression, exponent: Expression) -> float:
    if base._kind == k.POW:
        base, exponent = base._args[0], multiply(base._args[1], exponent)
    known = factors.get(base._serial)
    if known is not None:
        exponent = add(known[1], exponent)
    if exponent is ZERO:
        factors.pop(base._serial, None)
    elif base._kind == k.CONSTANT and exponent._kind == k.CONSTANT:
        factors.pop(base._serial, None)
        return _numbers.power(base._args[0], exponent._args[0])
    else:
        factors[base._serial] = (base, exponent)
    return 1.0


def multiply(a: Expression, b: Expression) -> Expression:
    """a * b."""
    if a is ZERO or b is ZERO:
        return ZERO
    if a is ONE:
        return b
    if b is ONE:
        return a
    if a is MINUS_ONE:
        return negate(b)
    if b is MINUS_ONE:
        return negate(a)
    if a._kind == k.DIV and b._kind == k.DIV:
        return divide(multiply(a._args[0], b._args[0]), multiply(a._args[1], b._args[1]))
    if a._kind == k.DIV and a._args[0]._kind == k.CONSTANT and b._kind != k.CONSTANT:
        return divide(multiply(a._args[0], b), a._args[1])
    if b._kind == k.DIV and b._args[0]._kind == k.CONSTANT:
        return divide(multiply(a, b._args[0]), b._args[1])
    if a._kind == k.DIV and a._args[0]._kind == k.CONSTANT:
        return divide(multiply(a._args[0], b), a._args[1])
    if a._kind == k.CONSTANT:
        return scale(a._args[0], b)
    if b._kind == k.CONSTANT:
        return scale(b._args[0], a)
    if a._kind == k.POW and a._args[0] is b:
        return power(b, add(a._args[1], ONE))
    if b._kind == k.POW and b._args[0] is a:
        return power(a, add(b._args[1], ONE))
    factors: dict[int, tuple[Expression, Expression]] = {}
    c = _multiply_into(factors, a)
    c *= _multiply_into(factors, b)
    return ZERO if c == 0.0 else make_product(c, factors)


def divide(a: Expression, b: Expression) -> Expression:
    """a / b.

    Raises:
        RuntimeError: both are numbers and b is zero.
    """
    if b is ONE:
        return a
    if a._kind == k.CONSTANT and b._kind == k.CONSTANT:
        return constant(_numbers.divide(a._args[0], b._args[0]))
    return ONE if a is b else plain(k.DIV, a, b)


def power(base: Expression, exponent: Expression) -> Expression:
    """base to the power exponent."""
    if exponent._kind == k.CONSTANT:
        if base._kind == k.CONSTANT:
            return constant(_numbers.power(base._args[0], exponent._args[0]))
        if exponent is ZERO:
            return ONE
        if exponent is ONE:
            return base
    if base._kind == k.POW:
        return plain(k.POW, base._args[0], multiply(base._args[1], exponent))
    return plain(k.POW, base, exponent)


# Functions


def plain(kind: int, *args: Expression) -> Expression:
    """A function of other expressions, as it is."""
    return _node((kind, *(a._serial for a in args)), args, (kind, *(a._key for a in args)))


def unary(kind: int, e: Expression) -> Expression:
    """A function of one argument, computed at once for a number."""
    if e._kind == k.CONSTANT:
        return constant(_numbers.UNARY[kind](e._args[0]))
    if kind == k.SQRT and e._kind == k.POW and e._args[1] is TWO:
        return plain(k.ABS, e._args[0])
    return plain(kind, e)


def binary(kind: int, a: Expression, b: Expression) -> Expression:
    """A function of two arguments, computed at once for numbers."""
    if a._kind == k.CONSTANT and b._kind == k.CONSTANT:
        return constant(_numbers.BINARY[kind](a._args[0], b._args[0]))
    if kind == k.POW:
        return power(a, b)
    if a is b and kind in (k.MIN, k.MAX):
        return a
    return plain(kind, a, b)


def conditional(condition: Formula, then: Expression, otherwise: Expression) -> Expression:
    """`then` where the formula holds, `otherwise` elsewhere."""
    if condition._is_constant():
        return then if condition._truth() else otherwise
    identity = (k.IF_THEN_ELSE, condition._key, then._serial, otherwise._serial)
    return _node(identity, (condition, then, otherwise), (k.IF_THEN_ELSE, condition._key, then._key, otherwise._key))


def uninterpreted(name: str, arguments: tuple[Expression, ...]) -> Expression:
    """A function of which only the name is known."""
    identity = (k.UNINTERPRETED, name, tuple(a._serial for a in arguments))
    return _node(identity, (name, arguments), (k.UNINTERPRETED, name, tuple(a._key for a in arguments)))


def children(e: Expression) -> tuple[Expression, ...]:
    """The expressions an expression is made of (of a conditional, without those of its condition)."""
    if e._kind == k.ADD:
        return tuple(t for t, _ in e._args[1])
    if e._kind == k.MUL:
        return tuple(x for factor in e._args[1] for x in factor)
    if e._kind in (k.CONSTANT, k.VAR, k.NAN):
        return ()
    if e._kind == k.UNINTERPRETED:
        return e._args[1]
    return e._args[1:] if e._kind == k.IF_THEN_ELSE else e._args


def rebuild(e: Expression, parts: list[Expression]) -> Expression:
    """The same function of other parts (given in the order of `children`)."""
    if e._kind == k.ADD:
        c0, terms = e._args
        return sum_of([constant(c0), *(scale(c, p) for (_, c), p in zip(terms, parts))])
    if e._kind == k.MUL:
        out = constant(e._args[0])
        for base, exponent in zip(parts[::2], parts[1::2]):
            out = multiply(out, power(base, exponent))
        return out
    if e._kind in (k.CONSTANT, k.VAR, k.NAN):
        return e
    if e._kind == k.DIV:
        return divide(*parts)
    if e._kind == k.UNINTERPRETED:
        return uninterpreted(e._args[0], tuple(parts))
    if e._kind == k.IF_THEN_ELSE:
        return conditional(e._args[0], *parts)
    return unary(e._kind, parts[0]) if len(parts) == 1 else binary(e._kind, *parts)


def nodes(*roots: Expression) -> list[Expression]:
    """All different parts of the expressions, each after its own parts. Needs no recursion, however deep they are."""
    seen: set[int] = set()
    out: list[Expression] = []
    stack: list[tuple[Expression, bool]] = [(root, False) for root in reversed(roots)]
    while stack:
        e, done = stack.pop()
        if done:
            out.append(e)
        elif e._serial not in seen:
            seen.add(e._serial)
            stack.append((e, True))
            stack.extend((child, False) for child in children(e) if child._serial not in seen)
    return out
