"""How expressions are made: canonical sums and products, and the simplifications done on the way.

An expression is an immutable node. Equal expressions have equal numbers, given when somebody asks: whatever becomes
part of another is asked, so that a shared part is evaluated once, and terms and factors are dictionaries by number.
What nobody asks (the sums on the way to a longer sum) costs no look at what else there is.

Sums are a constant and terms with coefficients, products a constant and bases with exponents. Their order is that of
`key_of`, by kind first, then by content; they are put in order when somebody wants to see them (`_args`).
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import weakref
from typing import TYPE_CHECKING, Any, SupportsFloat, TypeVar

import numpy as np

from sheldrake.common._overloads import Mismatch
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic import _numbers
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._variable import Variable

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Sequence

    from sheldrake.symbolic._formula import Formula

Terms = dict[int, tuple[Expression, float]]
Factors = dict[int, tuple[Expression, Expression]]

_REAL = (float, int, np.floating, np.integer, np.bool_)
_ADD, _MUL, _POW, _CONSTANT, _VAR = k.ADD, k.MUL, k.POW, k.CONSTANT, k.VAR
_COMMUTATIVE, _LEAVES = {_ADD, _MUL}, {_CONSTANT, _VAR, k.NAN}
_serials = itertools.count(1)
_new = object.__new__


# Nodes


def _node(kind: int, args: tuple) -> Expression:
    """A node whose parts are in order and have numbers, or get them when it gets its own."""
    e = _new(Expression)
    e._kind, e._made = kind, args
    e._number, e._order, e._variables = 0, (), None
    return e


def _sum_node(constant: float, terms: Terms) -> Expression:
    e = _new(Expression)
    e._kind, e._constant, e._terms = _ADD, constant, terms
    e._number, e._order, e._made, e._variables = 0, (), None, None
    return e


def _product_node(c: float, factors: Factors, unit: Expression | None) -> Expression:
    """unit: the product without its constant, if it is at hand."""
    e = _new(Expression)
    e._kind, e._constant, e._terms, e._unit = _MUL, c, factors, unit
    e._number, e._order, e._made, e._variables = 0, (), None, None
    return e


def found_of(e: Expression) -> dict[Any, Any]:
    """What was found out about an expression before, by question: it is the same for ever, as the expression is."""
    found = getattr(e, "_found", None)
    if found is None:
        found = e._found = {}
    return found


class _Known(weakref.ref):
    """A node that has a number, as the table has it: with what it is found by."""

    __slots__ = ("identity",)
    identity: tuple


class _Table:
    """A node of each number that was asked for, while it lives: what stayed longer would burden garbage collections."""

    def __init__(self) -> None:
        self._nodes: dict[tuple, _Known] = {}
        self._forgets = self._forget

    def __len__(self) -> int:
        return len(self._nodes)

    def number(self, e: Expression) -> int:
        """The number of a node: that of an equal one that lives, which it keeps alive from then on, or a new one."""
        identity, own = _identity(e), _Known(e, self._forgets)
        own.identity = identity
        known = self._nodes.setdefault(identity, own)
        if known is not own:
            twin = known()
            if twin is not None:
                e._twin, e._number = twin, twin._number
                return e._number
            self._nodes[identity] = own
        e._number = n = next(_serials)
        return n

    def _forget(self, gone: _Known) -> None:
        if self._nodes.get(gone.identity) is gone:
            del self._nodes[gone.identity]


table = _Table()
number_of = table.number


def numbered(e: Expression) -> Expression:
    """The same; it has a number now."""
    if not e._number:
        number_of(e)
    return e


def _identity(e: Expression) -> tuple:
    """What two expressions have in common only if they are equal."""
    kind = e._kind
    if kind == _ADD:
        return (kind, e._constant, frozenset([(n, c) for n, (_, c) in e._terms.items()]))
    if kind == _MUL:
        for _, exponent in e._terms.values():
            if exponent is not ONE:
                return (kind, e._constant, frozenset([(n, x._number) for n, (_, x) in e._terms.items()]))
        return (kind, e._constant, frozenset(e._terms))
    args = e._made
    if kind == _CONSTANT:
        return (kind, args[0])
    if len(args) == 1:
        return (kind, args[0]._number)
    if kind == k.IF_THEN_ELSE:
        return (kind, args[0]._identity, args[1]._serial, args[2]._serial)
    if kind == k.UNINTERPRETED:
        return (kind, args[0], tuple([a._serial for a in args[1]]))
    return (kind, *[a._serial for a in args])


def in_order(e: Expression) -> tuple:
    """Constant and terms of a sum or a product, in order; kept with it."""
    e._made = (e._constant, tuple(in_order_of_first(e._terms.values())))
    return e._made


def in_order_of_first(items: Collection[tuple]) -> list[tuple]:
    """Tuples in the order of the different expressions they begin with; keys are made only where kinds do not tell."""
    if len(items) < 2:
        return list(items)
    kinds = [item[0]._kind for item in items if item[0]._kind != _VAR]
    return sorted(items, key=_key_of_first if len(kinds) > len(set(kinds)) else _kind_of_first)


def _key_of_first(item: tuple) -> tuple:
    return item[0]._order or key_of(item[0])


def _kind_of_first(item: tuple) -> tuple:
    return item[0]._order or (item[0]._kind,)


def key_of(e: Expression) -> tuple:
    """What expressions are sorted by; kept with them."""
    stack = [e]
    while stack:
        without = [part for part in children(stack[-1]) if not part._order]
        stack.extend(without)
        if not without:
            node = stack.pop()
            node._order = _key(node)
    return e._order


def _key(e: Expression) -> tuple:
    """The key of an expression whose parts have theirs."""
    kind, args = e._kind, e._args
    if kind == _VAR:
        return (kind, args[0]._id)
    if kind == _ADD:
        return (kind, args[0], tuple([(t._order, c) for t, c in args[1]]))
    if kind == _MUL:
        return (kind, args[0], tuple([(b._order, x._order) for b, x in args[1]]))
    if kind == k.IF_THEN_ELSE:
        return (kind, args[0]._key, args[1]._order, args[2]._order)
    if kind == k.UNINTERPRETED:
        return (kind, args[0], tuple([a._order for a in args[1]]))
    return (kind, *[a if kind == _CONSTANT else a._order for a in args])


# Numbers and variables


def constant(value: SupportsFloat) -> Expression:
    """The expression of a number; of nan, the one that is not a number. Small whole numbers have one each."""
    value = float(value)
    found = _SMALL.get(value)
    if found is not None:
        return found
    return _node(_CONSTANT, (value,)) if value == value else NOT_A_NUMBER


def variable(v: Variable) -> Expression:
    """The expression of a variable.

    Raises:
        RuntimeError: the variable is Boolean, which only formulas may hold.
    """
    e = v._expression
    if e is None:
        if v._type is Variable.Type.BOOLEAN:
            raise RuntimeError(f"Expression(): {v!r} is a Boolean variable; it belongs in a Formula.")
        v._expression = e = node_of(v)  # both hold each other: they go when circles are collected
    return e


def node_of(v: Variable) -> Expression:
    """An expression of a variable that the variable does not keep, for many that are made for one program."""
    e = _node(_VAR, (v,))
    e._number, e._order = -v._id or next(_serials), (_VAR, v._id)  # a dummy has no number of its own
    return e


def as_expression(x: object) -> Expression | None:
    """x as an expression, if it is an expression, a variable or a number (also as a 0-d array); else None."""
    if x.__class__ is Expression:
        return x  # type: ignore[return-value]
    if x.__class__ is Variable:
        return x._expression or variable(x)  # type: ignore[attr-defined, arg-type]
    if isinstance(x, _REAL):
        return constant(x)
    if isinstance(x, Variable):
        return variable(x)
    return as_expression(x.item()) if isinstance(x, np.ndarray) and x.ndim == 0 else None


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


_SMALL: dict[float, Expression] = {float(i): _node(_CONSTANT, (float(i),)) for i in range(-16, 65)}
NOT_A_NUMBER = _node(k.NAN, ())
for _one in (*_SMALL.values(), NOT_A_NUMBER):
    number_of(_one)
ZERO, ONE, MINUS_ONE, TWO = (_SMALL[v] for v in (0.0, 1.0, -1.0, 2.0))


# Sums


def make_sum(c0: float, terms: Terms) -> Expression:
    """c0 + the terms with their coefficients, which are not zero. The terms are the sum's from now on."""
    if len(terms) < 2:
        if not terms:
            return constant(c0)
        if c0 == 0.0:
            ((term, c),) = terms.values()
            return scale(c, term)
    return _sum_node(c0, terms)


def add_into(terms: Terms, e: Expression) -> float:
    """Adds e to the terms and returns the constant that is left."""
    kind = e._kind
    if kind == _ADD:
        if not terms:
            terms.update(e._terms)
            return e._constant
        for n, item in e._terms.items():
            known = terms.get(n)
            if known is None:
                terms[n] = item
            else:
                _set_term(terms, n, item[0], known[1] + item[1])
        return e._constant
    if kind == _CONSTANT:
        return e._made[0]
    c = 1.0
    if kind == _MUL:
        c = e._constant
        if c != 1.0:
            e = e._unit or unit_of(e)
    n = e._number or number_of(e)
    known = terms.get(n)
    if known is None:
        terms[n] = (e, c)
    else:
        _set_term(terms, n, e, known[1] + c)
    return 0.0


def add_scaled_into(terms: Terms, c: float, e: Expression) -> float:
    """Adds c e to the terms and returns the constant that is left; a sum is a term as it is, as in `scale`."""
    if c == 1.0:
        return add_into(terms, e)
    kind = e._kind
    if c == 0.0 or kind == _CONSTANT or kind == k.DIV:
        return add_into(terms, scale(c, e))
    if kind == _MUL and e._constant != 1.0:
        c *= e._constant
        e = e._unit or unit_of(e)
    n = e._number or number_of(e)
    known = terms.get(n)
    if known is None:
        terms[n] = (e, c)
    else:
        _set_term(terms, n, e, known[1] + c)
    return 0.0


def add_product_into(terms: Terms, c: float, e: Expression) -> float:
    """Adds the product of c and e, where minus a sum is a sum, as `multiply` makes it; returns the constant left."""
    if c == -1.0 and e._kind == _ADD:
        return add_into(terms, negate(e))
    return add_scaled_into(terms, c, e)


def _set_term(terms: Terms, n: int, term: Expression, c: float) -> None:
    if c == 0.0:
        del terms[n]
    else:
        terms[n] = (term, c)


def add(a: Expression, b: Expression) -> Expression:
    """a + b."""
    if b is ZERO:
        return a
    if a._kind == _ADD:
        terms, c0 = a._terms.copy(), a._constant
    elif a._kind == _VAR:
        terms, c0 = {a._number: (a, 1.0)}, 0.0
    else:
        if a is ZERO:
            return b
        terms = {}
        c0 = add_into(terms, a)
    c0 += add_into(terms, b)
    return _sum_node(c0, terms) if len(terms) > 1 else make_sum(c0, terms)


def sum_of(expressions: Iterable[Expression]) -> Expression:
    """The sum of many, in one go."""
    terms: Terms = {}
    c0 = 0.0
    for e in expressions:
        c0 += add_into(terms, e)
    return make_sum(c0, terms)


def combination(c0: float, parts: Iterable[tuple[float, Expression]]) -> Expression:
    """c0 + the expressions times their numbers."""
    terms: Terms = {}
    for c, e in parts:
        c0 += add_scaled_into(terms, c, e)
    return make_sum(c0, terms)


def subtract(a: Expression, b: Expression) -> Expression:
    """a - b."""
    if b is ZERO:
        return a
    if _are_equal(a, b):
        return ZERO  # even where it holds infinities
    return add(a, negate(b))


def negate(e: Expression) -> Expression:
    """-e; a sum is negated term by term."""
    if e._kind == _CONSTANT:
        return constant(-e._made[0])
    if e._kind == _ADD:
        return _sum_node(-e._constant, {n: (t, -c) for n, (t, c) in e._terms.items()})
    return scale(-1.0, e)


# Products


def scale(c: float, e: Expression) -> Expression:
    """c * e for a number c; a sum keeps its shape."""
    if c == 1.0:
        return e
    if c == 0.0:
        return ZERO
    kind = e._kind
    if kind == _CONSTANT:
        return constant(c * e._made[0])
    if kind == _MUL:
        product = c * e._constant
        unit = e if e._constant == 1.0 else e._unit
        return _product_node(product, e._terms, unit) if product != 1.0 else make_product(product, e._terms)
    if kind == _POW:
        base, exponent = e._made
        return _product_node(c, {base._serial: (base, exponent)}, e)
    if kind == k.DIV and e._made[0]._kind == _CONSTANT:
        return divide(constant(c * e._made[0]._made[0]), e._made[1])
    return _product_node(c, {e._number or number_of(e): (e, ONE)}, e)


def unit_of(e: Expression) -> Expression:
    """A product without its constant; kept with it."""
    e._unit = make_product(1.0, e._terms)
    return e._unit


def make_product(c: float, factors: Factors) -> Expression:
    """c * the bases to the power of their exponents, which are not zero. The factors are the product's from now on."""
    if len(factors) < 2:
        if not factors:
            return constant(c)
        if c == 1.0:
            ((base, exponent),) = factors.values()
            return power(base, exponent)
    return _product_node(c, factors, None)


def multiply_into(factors: Factors, e: Expression) -> float:
    """Multiplies the factors by e and returns the constant that is left."""
    if e._kind == _CONSTANT:
        return e._made[0]
    if e._kind == _MUL:
        if not factors:
            factors.update(e._terms)
            return e._constant
        c = e._constant
        for base, exponent in e._terms.values():
            c *= multiply_by(factors, base, exponent)
        return c
    return multiply_by(factors, e, ONE)


def multiply_by(factors: Factors, base: Expression, exponent: Expression) -> float:
    """Multiplies the factors by a power and returns the constant that is left."""
    if base._kind == _POW:
        base, exponent = base._made[0], multiply(base._made[1], exponent)
    n = base._number or number_of(base)
    known = factors.get(n)
    if known is not None:
        exponent = add(known[1], exponent)
    if exponent is ZERO:
        factors.pop(n, None)
    elif base._kind == _CONSTANT and exponent._kind == _CONSTANT:
        factors.pop(n, None)
        return _numbers.power(base._made[0], exponent._made[0])
    else:
        factors[n] = (base, numbered(exponent))
    return 1.0


def multiply(a: Expression, b: Expression) -> Expression:
    """a * b."""
    kind, other = a._kind, b._kind
    if kind == _VAR and other == _VAR:
        if a is b or a._number == b._number:
            return _node(_POW, (a, TWO))
        return _product_node(1.0, {a._number: (a, ONE), b._number: (b, ONE)}, None)
    if a is ZERO or b is ZERO:
        return ZERO
    if kind == _CONSTANT:
        return negate(b) if a is MINUS_ONE else scale(a._made[0], b)
    if other == _CONSTANT:
        return negate(a) if b is MINUS_ONE else scale(b._made[0], a)
    if kind == k.DIV or other == k.DIV:
        quotient = _product_of_quotients(a, b)
        if quotient is not None:
            return quotient
    if kind == _POW and a._made[0]._serial == b._serial:
        return power(b, add(a._made[1], ONE))
    if other == _POW and b._made[0]._serial == a._serial:
        return power(a, add(b._made[1], ONE))
    if other == _MUL and (kind != _MUL or len(a._terms) < len(b._terms)):
        a, b = b, a  # the factors of the longer are copied all at once
    factors: Factors = {}
    c = multiply_into(factors, a)
    c *= multiply_into(factors, b)
    return ZERO if c == 0.0 else make_product(c, factors)


def _product_of_quotients(a: Expression, b: Expression) -> Expression | None:
    """The product if one of both, or its numerator, is a number, or both are quotients."""
    if a._kind == k.DIV and b._kind == k.DIV:
        return divide(multiply(a._made[0], b._made[0]), multiply(a._made[1], b._made[1]))
    if a._kind == k.DIV and a._made[0]._kind == _CONSTANT:
        return divide(multiply(a._made[0], b), a._made[1])
    if b._kind == k.DIV and b._made[0]._kind == _CONSTANT:
        return divide(multiply(a, b._made[0]), b._made[1])
    return None


def divide(a: Expression, b: Expression) -> Expression:
    """a / b.

    Raises:
        RuntimeError: both are numbers and b is zero.
    """
    if b is ONE:
        return a
    if a._kind == _CONSTANT and b._kind == _CONSTANT:
        return constant(_numbers.divide(a._made[0], b._made[0]))
    return ONE if _are_equal(a, b) else _node(k.DIV, (a, b))


def _are_equal(a: Expression, b: Expression) -> bool:
    """Whether both have the same structure; neither gets a number where it is plain that they have not."""
    if a._kind != b._kind or (a._kind in _COMMUTATIVE and a._terms.keys() != b._terms.keys()):
        return False
    return a._serial == b._serial


def power(base: Expression, exponent: Expression) -> Expression:
    """base to the power exponent."""
    if exponent._kind == _CONSTANT:
        if base._kind == _CONSTANT:
            return constant(_numbers.power(base._made[0], exponent._made[0]))
        if exponent is ZERO:
            return ONE
        if exponent is ONE:
            return base
    if base._kind == _POW:
        return plain(_POW, base._made[0], multiply(base._made[1], exponent))
    return plain(_POW, base, exponent)


# Functions


def plain(kind: int, *args: Expression) -> Expression:
    """A function of other expressions, as it is."""
    for a in args:
        numbered(a)
    return _node(kind, args)


def unary(kind: int, e: Expression) -> Expression:
    """A function of one argument, computed at once for a number."""
    if e._kind == k.CONSTANT:
        return constant(_numbers.UNARY[kind](e._made[0]))
    if kind == k.SQRT and e._kind == _POW and e._made[1] is TWO:
        return plain(k.ABS, e._made[0])
    return plain(kind, e)


def binary(kind: int, a: Expression, b: Expression) -> Expression:
    """A function of two arguments, computed at once for numbers."""
    if a._kind == k.CONSTANT and b._kind == k.CONSTANT:
        return constant(_numbers.BINARY[kind](a._args[0], b._args[0]))
    if kind == k.POW:
        return power(a, b)
    if kind in (k.MIN, k.MAX) and a._serial == b._serial:
        return a
    return plain(kind, a, b)


def conditional(condition: Formula, then: Expression, otherwise: Expression) -> Expression:
    """`then` where the formula holds, `otherwise` elsewhere."""
    if condition._is_constant():
        return then if condition._truth() else otherwise
    return _node(k.IF_THEN_ELSE, (condition, numbered(then), numbered(otherwise)))


def uninterpreted(name: str, arguments: tuple[Expression, ...]) -> Expression:
    """A function of which only the name is known."""
    return _node(k.UNINTERPRETED, (name, tuple(map(numbered, arguments))))


def children(e: Expression) -> Sequence[Expression]:
    """The expressions one is made of (of a conditional, without those of its condition); of sums in no order."""
    kind = e._kind
    if kind == _ADD:
        return [t for t, _ in e._terms.values()]
    if kind == _MUL:
        return [x for factor in e._terms.values() for x in factor]
    if kind in _LEAVES:
        return ()
    if kind == k.UNINTERPRETED:
        return e._made[1]
    return e._made[1:] if kind == k.IF_THEN_ELSE else e._made


def rebuild(e: Expression, parts: list[Expression]) -> Expression:
    """The same function of other parts (given in the order of `children`)."""
    if e._kind == _ADD:
        return combination(e._constant, [(c, part) for (_, c), part in zip(e._terms.values(), parts)])
    if e._kind == _MUL:
        out = constant(e._constant)
        for base, exponent in zip(parts[::2], parts[1::2]):
            factor = base if exponent is ONE else power(base, exponent)
            out = factor if out is ONE else multiply(out, factor)
        return out
    return e if e._kind in _LEAVES else maker(e)(*parts)


def maker(e: Expression) -> Callable[..., Expression]:
    """What makes an expression like this one, which is no sum, product or leaf, of other parts."""
    kind = e._kind
    if kind == k.DIV:
        return divide
    if kind == _POW:
        return power
    if kind == k.UNINTERPRETED:
        return lambda *parts, name=e._made[0]: uninterpreted(name, parts)
    if kind == k.IF_THEN_ELSE:
        return functools.partial(conditional, e._made[0])
    return functools.partial(unary if len(e._made) == 1 else binary, kind)


_Value = TypeVar("_Value")

if TYPE_CHECKING:
    _Rule = Callable[[Expression, Callable[[Expression], _Value]], _Value]


def fold(expressions: Iterable[Expression], rule: _Rule[_Value]) -> list[_Value]:
    """What a rule makes of expressions: `rule(e, of)` asks `of` for parts; of each part it is asked once."""
    expressions, of = list(expressions), _AskedOnce(rule)
    try:
        return [of(e) for e in expressions]
    except RecursionError:
        for part in nodes(*expressions):  # Too deep: from the parts up, then.
            with contextlib.suppress(RuntimeError, ValueError):  # It may not be wanted, as the other branch is taken.
                of(part)
        return [of(e) for e in expressions]


class _AskedOnce:
    """What a rule makes of parts, each asked once. It refers to no function that refers to it: it goes at once."""

    __slots__ = ("_done", "_rule")

    def __init__(self, rule: _Rule[Any]) -> None:
        self._rule, self._done = rule, dict[int, Any]()

    def __call__(self, e: Expression) -> Any:
        n = e._number
        found = self._done.get(n)
        if found is None:
            found = self._rule(e, self)
            if n:
                self._done[n] = found
        return found


def written(e: Expression, rule: _Rule[str]) -> str:
    """What a rule makes of an expression, in words: as `fold`, which would keep the words of each part of a deep one.

    Raises:
        MemoryError: a deep one has more characters than anybody reads.
    """
    try:
        return _AskedOnce(rule)(e)
    except RecursionError:
        return _written_from_the_top(e, rule)


_MOST_CHARACTERS = 10**9
_A_PART = "\0"  # stands around the number of a part where its words belong


def _written_from_the_top(e: Expression, rule: _Rule[str]) -> str:
    def pieces(part: Expression) -> list[str | Expression]:
        inner: list[Expression] = []

        def place(child: Expression) -> str:
            inner.append(child)
            return f"{_A_PART}{len(inner) - 1}{_A_PART}"

        words = rule(part, place).split(_A_PART)
        return [inner[int(word)] if i % 2 else word for i, word in enumerate(words)]

    def count(part: Expression, of: Callable[[Expression], int]) -> int:
        return sum(len(piece) if isinstance(piece, str) else of(piece) for piece in pieces(part))

    if fold([e], count)[0] > _MOST_CHARACTERS:
        raise MemoryError(
            f"An expression would be written with more than {_MOST_CHARACTERS:,} characters, as it repeats its parts."
        )
    out: list[str] = []
    stack: list[str | Expression] = [e]
    while stack:
        top = stack.pop()
        if isinstance(top, str):
            out.append(top)
        else:
            stack.extend(reversed(pieces(top)))
    return "".join(out)


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
            if e._kind in _LEAVES:
                out.append(e)
                continue
            stack.append((e, True))
            stack.extend([(child, False) for child in children(e) if child._serial not in seen])
    return out
