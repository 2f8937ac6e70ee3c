"""Walks over expressions: evaluation, substitution, expansion. Each different part is visited once."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._overloads import Mismatch, expect
from sheldrake.symbolic import _build, _numbers
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._variable import Variable

_compiled: Any = None  # A module that needs this one; the package binds it when all is loaded.

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sheldrake.common import RandomGenerator


def variables_of(e: Expression) -> frozenset[Variable]:
    """The variables in an expression; kept with it."""
    if e._variables is None:
        if e._kind == k.VAR:
            e._variables = frozenset(e._made)
            return e._variables
        found: set[Variable] = set()
        if e._kind == k.ADD or e._kind == k.MUL:
            parts = e._terms.values()
            found.update([part._made[0] for part, _ in parts if part._kind == k.VAR])
            if len(found) == len(parts) and (e._kind == k.ADD or all([x._kind == k.CONSTANT for _, x in parts])):
                e._variables = frozenset(found)
                return e._variables
        seen: set[int] = set()
        stack = [e]
        while stack:
            node = stack.pop()
            if node._variables is not None:
                found |= node._variables
                continue
            if node._kind == k.IF_THEN_ELSE:
                found |= node._made[0]._variables()
            for child in _build.children(node):
                if child._kind == k.VAR:
                    found.add(child._made[0])
                elif child._kind != k.CONSTANT and child._serial not in seen:
                    seen.add(child._serial)
                    stack.append(child)
        e._variables = frozenset(found)
    return e._variables


def variable_list(call: str, vars: Any) -> list[Variable]:
    """The variables given as a vector.

    Raises:
        TypeError: an element is no variable.
    """
    out = list(vars) if not isinstance(vars, Variable) else [vars]
    for v in out:
        if not isinstance(v, Variable):
            raise Mismatch(f"{call}(): incompatible function arguments; expected a vector of Variable, got {v!r}.")
    return out


# Evaluation


def numbers_by_variable(call: str, env: Mapping[Variable, float] | None) -> dict[Variable, float]:
    """The environment a user gave, as floats.

    Raises:
        TypeError: a key is no variable or a value is no number.
        RuntimeError: a value is nan.
    """
    out = {}
    for v, value in expect(call, env or {}, dict).items():
        if v.__class__ is Variable and (value.__class__ is float or value.__class__ is np.float64) and value == value:
            out[v] = float(value)
            continue
        if isinstance(value, np.ndarray) and value.ndim == 0:
            value = value.item()
        if not isinstance(v, Variable) or not isinstance(value, _build._REAL):
            raise Mismatch(
                f"{call}(): incompatible function arguments; expected a dict of Variable to float, "
                f"got {v!r}: {value!r}."
            )
        out[v] = float(value)
        if math.isnan(out[v]):
            raise RuntimeError(f"{call}(): NaN is detected in the initialization of an environment, as value of {v}.")
    return out


def no_entry(v: Variable) -> RuntimeError:
    """The error for a variable without a value."""
    return RuntimeError(f"The following environment does not have an entry for the variable {v}.")


def evaluate(
    expressions: Sequence[Expression], env: Mapping[Variable, float] | None, generator: RandomGenerator | None = None
) -> list[float]:
    """Values of expressions for given values of their variables; see `Expression.Evaluate`."""
    if generator is None and env is not None and not hasattr(env, "items"):
        env, generator = None, env
    values = numbers_by_variable("Evaluate", env) if env is not None else {}
    if generator is not None:
        from sheldrake.symbolic._random import sample

        sample(frozenset().union(*map(variables_of, expressions)), values, generator)
        if len(expressions) == 1 and expressions[0]._kind == k.ADD:  # as most distributions are
            total = _plain_sum(expressions[0], values)
            if total is not None:
                return [total]
    return _compiled.values(expressions, values)


def _plain_sum(e: Expression, env: dict[Variable, float]) -> float | None:
    """The value of a sum of numbers times variables; None of another sum, and where a variable has no value."""
    total: float
    total, terms = e._args
    for t, c in terms:
        if t._kind != k.VAR:
            return None
        x = env.get(t._made[0])
        if x is None:
            return None
        total += c * x
    return total


def evaluate_nodes(
    expressions: Sequence[Expression], env: dict[Variable, float], both_branches: bool = False
) -> list[float]:
    """Values of expressions, the environment already checked.

    Args:
        expressions: What is evaluated.
        env: Values by variable.
        both_branches: The branch of a conditional that is not taken must have a value, too.
    """
    if len(expressions) == 1 and expressions[0]._kind == k.ADD:
        total = _plain_sum(expressions[0], env)
        if total is not None:
            return [total]

    def value(e: Expression, of: Callable[[Expression], float]) -> float:
        kind, args = e._kind, e._args
        if kind == k.VAR:
            if args[0] not in env:
                raise no_entry(args[0])
            return env[args[0]]
        if kind == k.ADD:
            total, terms = args
            for t, c in terms:
                total += c * (env[t._made[0]] if t._kind == k.VAR and t._made[0] in env else of(t))
            return total
        if kind == k.MUL:
            product, factors = args
            for base, exponent in factors:
                b = env[base._made[0]] if base._kind == k.VAR and base._made[0] in env else of(base)
                product *= b if exponent is _build.ONE else _numbers.power(b, of(exponent))
            return product
        if kind == k.IF_THEN_ELSE:
            if both_branches:
                of(args[1]), of(args[2])
            return of(args[1] if args[0]._evaluate(env) else args[2])
        return _value(e, of)

    return _build.fold(expressions, value)


def _value(e: Expression, of: Callable[[Expression], float]) -> float:
    kind, args = e._kind, e._args
    if kind == k.CONSTANT:
        return args[0]
    if kind == k.DIV:
        a, b = of(args[0]), of(args[1])
        if b == 0.0:
            raise RuntimeError(f"Division by zero: {a:g} / {b:g}, in {e}")
        return a / b
    if kind == k.NAN:
        raise RuntimeError("NaN is detected during Symbolic computation.")
    if kind == k.UNINTERPRETED:
        raise RuntimeError(f"Uninterpreted-function expression cannot be evaluated: {e}")
    if len(args) == 1:
        return float(_numbers.UNARY[kind](of(args[0])))
    return float(_numbers.BINARY[kind](of(args[0]), of(args[1])))


# Substitution


def substitution(call: str, what: Any, e: Any = None) -> Mapping[Variable, Any]:
    """What a user gave as `(var, e)` or `({var: e})`.

    Raises:
        TypeError: it is neither.
    """
    if isinstance(what, Variable):
        return {what: e}
    for v in what:
        if not isinstance(v, Variable):
            raise Mismatch(f"{call}(): incompatible function arguments; {v!r} is no Variable.")
    return what


def substitute(expressions: Iterable[Expression], s: Mapping[Variable, Any]) -> list[Expression]:
    """Expressions with others (or numbers) in the place of variables, all at once.

    Raises:
        TypeError: what is to take the place of a variable is no expression.
    """
    expressions, variables = list(expressions), list(s)
    if not expressions:
        return []
    values = _values_if_numbers(expressions, s)
    if values is not None:
        return values
    found = _build.found_of(expressions[0])
    known = found.get(_SUBSTITUTION)
    if known is None or not known.is_for(expressions, variables):
        known = found[_SUBSTITUTION] = _Substitution(expressions, variables)
    return known.given(expressions, [_build.expect("Substitute", e) for e in s.values()])


def _values_if_numbers(expressions: list[Expression], s: Mapping[Variable, Any]) -> list[Expression] | None:
    """The same where all variables become numbers; None otherwise, and where only rules for expressions tell."""
    numbers = {v: x for v, x in s.items() if x.__class__ is float}
    if len(numbers) < len(s) or not all([variables_of(e) <= numbers.keys() for e in expressions]):
        return None
    try:
        values = evaluate_nodes(expressions, numbers, both_branches=True)
    except (RuntimeError, ValueError):
        return None
    return [_build.constant(x) for x in values] if all(map(math.isfinite, values)) else None


_SUBSTITUTION = "substitution"
_Step = Callable[[list[Expression]], Expression]


class _Substitution:
    """Others in the place of variables, as steps: one for each part that changes, after those of its own parts.

    What does not change is put together beforehand. Steps are kept with the first of the expressions, so none refers to
    a whole one.
    """

    def __init__(self, expressions: list[Expression], variables: list[Variable]) -> None:
        self._others, self._variables = expressions[1:], variables
        self._places = {v: i for i, v in enumerate(variables)}
        self._steps: list[_Step] = []
        self._ends = _build.fold(expressions, self._place)

    def is_for(self, expressions: list[Expression], variables: list[Variable]) -> bool:
        """Whether the steps are those for these expressions, the first being the one they are kept with."""
        return (
            len(variables) == len(self._variables)
            and len(expressions) == len(self._others) + 1
            and all(map(operator.is_, variables, self._variables))
            and all(map(operator.is_, expressions[1:], self._others))
        )

    def given(self, expressions: list[Expression], values: list[Expression]) -> list[Expression]:
        """The expressions with these values of the variables."""
        for step in self._steps:
            values.append(step(values))
        return [e if i < 0 else values[i] for e, i in zip(expressions, self._ends)]

    def _place(self, e: Expression, of: Callable[[Expression], int]) -> int:
        """Where among the values what e becomes will be; -1 if it stays as it is."""
        kind = e._kind
        if kind == k.VAR:
            return self._places.get(e._made[0], -1)
        if kind == k.CONSTANT:
            return -1
        step = self._of_sum(e, of) if kind == k.ADD else self._of_product(e, of) if kind == k.MUL else self._of(e, of)
        if step is None:
            return -1
        self._steps.append(step)
        return len(self._variables) + len(self._steps) - 1

    def _of_sum(self, e: Expression, of: Callable[[Expression], int]) -> _Step | None:
        kept: _build.Terms = {}
        constant, changed, places = e._constant, [], self._places
        for t, c in e._terms.values():
            i = places.get(t._made[0], -1) if t._kind == k.VAR else of(t)
            if i < 0:
                constant += _build.add_scaled_into(kept, c, t)
            else:
                changed.append((t, i, c))
        moved = [(i, c) for _, i, c in _build.in_order_of_first(changed)]  # as sums of floats depend on their order

        def step(values: list[Expression]) -> Expression:
            terms, total = kept.copy(), constant
            for i, c in moved:
                total += _build.add_product_into(terms, c, values[i])
            return _build.make_sum(total, terms)

        return step if changed or kept.keys() != e._terms.keys() else None  # as 2 (1 / x), added again, is (2 / x)

    def _of_product(self, e: Expression, of: Callable[[Expression], int]) -> _Step | None:
        factors, places = [], self._places
        for base, exponent in e._args[1]:
            i = places.get(base._made[0], -1) if base._kind == k.VAR else of(base)
            factors.append((i, base, -1 if exponent._kind == k.CONSTANT else of(exponent), exponent))
        first = next((n for n, (i, _, j, _) in enumerate(factors) if i >= 0 or j >= 0), None)
        if first is None:
            if e._constant != -1.0 or factors[0][1]._kind != k.ADD:
                return None
            first = len(factors)  # -(a + b) c becomes (-a - b) c when it is multiplied again
        kept, rest = _multiplied(_build.constant(e._constant), factors[:first], []), factors[first:]
        return lambda values: _multiplied(kept, rest, values)

    def _of(self, e: Expression, of: Callable[[Expression], int]) -> _Step | None:
        parts = [(of(part), part) for part in _build.children(e)]
        make = _build.maker(e)
        if e._kind == k.IF_THEN_ELSE:
            condition, variables = e._made[0], self._variables
            if condition._variables().isdisjoint(variables) and all([i < 0 for i, _ in parts]):
                return None
            return lambda values: _build.conditional(
                condition._substitute(dict(zip(variables, values))), *[p if i < 0 else values[i] for i, p in parts]
            )
        if all([i < 0 for i, _ in parts]):
            return None
        if len(parts) == 1:
            place = parts[0][0]
            return lambda values: make(values[place])
        return lambda values: make(*[part if i < 0 else values[i] for i, part in parts])


_ONE_BY_ONE = {k.CONSTANT, k.DIV, k.NAN}
"""Kinds of factors that products and quotients make something else of."""


def _multiplied(
    out: Expression, factors: list[tuple[int, Expression, int, Expression]], values: list[Expression]
) -> Expression:
    """A product times powers; a base or an exponent whose place is not -1 is among the values."""
    given = [(base if i < 0 else values[i], exponent if j < 0 else values[j]) for i, base, j, exponent in factors]
    if out is _build.ONE and len(given) == 1:
        ((base, exponent),) = given
        return base if exponent is _build.ONE else _build.power(base, exponent)
    product = _gathered(out, given)
    if product is not None:
        return product
    for base, exponent in given:
        factor = base if exponent is _build.ONE else _build.power(base, exponent)
        out = factor if out is _build.ONE else _build.multiply(out, factor)
    return out


def _gathered(out: Expression, powers: list[tuple[Expression, Expression]]) -> Expression | None:
    """The product of an expression and powers without products on the way; None where such a one is more than that."""
    if out._kind == k.DIV or out is _build.MINUS_ONE or out is _build.ZERO:
        return None
    factors: _build.Factors = {}
    c = _build.multiply_into(factors, out)
    for base, exponent in powers:
        if exponent is _build.ONE:
            if base._kind in _ONE_BY_ONE:
                return None
            c *= _build.multiply_into(factors, base)
        elif base._kind in _ONE_BY_ONE or base._kind == k.POW or exponent._kind != k.CONSTANT or not exponent._made[0]:
            return None
        else:
            c *= _build.multiply_by(factors, base, exponent)
    return _build.make_product(c, factors) if c else None


# Expansion


def expand(e: Expression) -> Expression:
    """Products of sums multiplied out."""
    return _build.fold([e], _expanded)[0]


def _expanded(e: Expression, of: Callable[[Expression], Expression]) -> Expression:
    kind = e._kind
    if kind == k.ADD:
        terms = [_weighted(c * d, s) for t, c in e._terms.values() for d, s in _terms(of(t))]
        return _build.combination(e._constant, terms)
    if kind == k.MUL:
        if all(b._kind == k.VAR and x._kind == k.CONSTANT for b, x in e._terms.values()):
            return e
        out = _build.constant(e._constant)
        for base, exponent in e._terms.values():
            out = times(out, _expanded_power(of(base), of(exponent)))
        return out
    if kind in _build._LEAVES:
        return e
    parts = [of(p) for p in _build.children(e)]
    if kind == k.POW:
        return _expanded_power(*parts)
    if kind == k.DIV and parts[1]._kind == k.CONSTANT and parts[1] is not _build.ZERO:
        c = 1.0 / parts[1]._made[0]
        if parts[0]._kind == k.ADD:
            return _build.combination(0.0, [(c * d, s) for d, s in _terms(parts[0])])
        return times(_build.constant(c), parts[0])
    return _build.rebuild(e, parts)


def _terms(e: Expression) -> list[tuple[float, Expression]]:
    """The terms of a sum and their coefficients, constant first."""
    if e._kind != k.ADD:
        return [(1.0, e)]
    head = [(e._constant, _build.ONE)] if e._constant != 0.0 else []
    return head + [(c, t) for t, c in e._terms.values()]


def _weighted(c: float, e: Expression) -> tuple[float, Expression]:
    """A number and what it multiplies, as a term of an expanded sum: of a quotient it goes into the numerator."""
    return (1.0, _times_one(_build.constant(c), e)) if c != 1.0 and e._kind == k.DIV else (c, e)


def times(a: Expression, b: Expression) -> Expression:
    """The product of two expanded expressions, expanded."""
    if a._kind != k.ADD and b._kind != k.ADD:
        return _times_one(a, b)
    terms = [_weighted(c * d, _times_one(s, t)) for c, s in _terms(a) for d, t in _terms(b)]
    return _build.combination(0.0, terms)


def _times_one(a: Expression, b: Expression) -> Expression:
    if a is _build.ONE or b is _build.ONE:
        return b if a is _build.ONE else a
    if a._kind != k.DIV and b._kind != k.DIV:
        return _build.multiply(a, b)
    (p, q), (r, s) = ((e._made if e._kind == k.DIV else (e, _build.ONE)) for e in (a, b))
    return _build.divide(times(p, r), times(q, s))


def _expanded_power(base: Expression, exponent: Expression) -> Expression:
    n = exponent._args[0] if exponent._kind == k.CONSTANT else math.nan
    whole = n == math.floor(n) if math.isfinite(n) else False
    if whole and base._kind == k.MUL:
        out = _build.constant(_numbers.power(base._args[0], n))
        for b, x in base._args[1]:
            out = times(out, _build.power(b, _build.multiply(x, exponent)))
        return out
    if whole and n > 0 and base._kind == k.ADD:
        return _integer_power(base, int(n))
    return _build.power(base, exponent)


def _integer_power(base: Expression, n: int) -> Expression:
    if n == 1:
        return base
    half = _integer_power(base, n // 2)
    square = times(half, half)
    return times(square, base) if n % 2 else square


# Questions


def is_polynomial(e: Expression) -> bool:
    """Whether an expression is a polynomial in its variables."""
    return _build.fold([e], _is_polynomial)[0]


def _is_polynomial(e: Expression, of: Callable[[Expression], bool]) -> bool:
    kind = e._kind
    if kind == k.ADD:
        return all([of(t) for t, _ in e._terms.values()])
    if kind == k.MUL:
        return all([of(b) and _is_natural(x) for b, x in e._terms.values()])
    if kind == k.POW:
        return of(e._made[0]) and _is_natural(e._made[1])
    if kind == k.DIV:
        return of(e._made[0]) and e._made[1]._kind == k.CONSTANT
    return kind in (k.CONSTANT, k.VAR)


def _is_natural(e: Expression) -> bool:
    return e._kind == k.CONSTANT and e._args[0] >= 0.0 and float(e._args[0]).is_integer()


_OBJECT = np.dtype(object)


def object_array(items: Sequence[Any], shape: tuple[int, ...] | None = None) -> np.ndarray:
    """An array of objects from a flat list."""
    out = np.fromiter(items, _OBJECT, len(items))
    return out if shape is None else out.reshape(shape)
