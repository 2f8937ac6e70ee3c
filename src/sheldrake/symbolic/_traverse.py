"""Walks over expressions: evaluation, substitution, expansion. Each different part is visited once."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._overloads import Mismatch, expect
from sheldrake.symbolic import _build, _numbers
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._variable import Variable

_compiled: Any = None  # A module that needs this one; the package binds it when all is loaded.

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from sheldrake.common import RandomGenerator


def variables_of(e: Expression) -> frozenset[Variable]:
    """The variables in an expression; kept with it."""
    if e._variables is None:
        found: set[Variable] = set()
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
                elif child._kind != k.CONSTANT and child._number not in seen:
                    seen.add(child._number)
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
    values = numbers_by_variable("Evaluate", env)
    if generator is not None:
        from sheldrake.symbolic._random import sample

        wanted = set().union(*(variables_of(e) for e in expressions))
        sample(sorted(wanted, key=Variable.get_id), values, generator)
    return _compiled.values(expressions, values)


def evaluate_nodes(expressions: Sequence[Expression], env: dict[Variable, float]) -> list[float]:
    """Values of expressions, the environment already checked."""

    def value(e: Expression, of: Callable[[Expression], float]) -> float:
        kind, args = e._kind, e._args
        if kind == k.VAR:
            if args[0] not in env:
                raise no_entry(args[0])
            return env[args[0]]
        if kind == k.ADD:
            total, terms = args
            for t, c in terms:
                total += c * of(t)
            return total
        if kind == k.MUL:
            product, factors = args
            for base, exponent in factors:
                b = env[base._made[0]] if base._kind == k.VAR and base._made[0] in env else of(base)
                product *= b if exponent is _build.ONE else _numbers.power(b, of(exponent))
            return product
        if kind == k.IF_THEN_ELSE:
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


def substitution(call: str, what: Any, e: Any = None) -> dict[Variable, Expression]:
    """What a user gave as `(var, e)` or `({var: e})`.

    Raises:
        TypeError: it is neither.
    """
    out = {}
    for v, new in [(what, e)] if isinstance(what, Variable) else what.items():
        if not isinstance(v, Variable):
            raise Mismatch(f"{call}(): incompatible function arguments; {v!r} is no Variable.")
        out[v] = _build.expect(call, new)
    return out


def substitute(expressions: Iterable[Expression], s: dict[Variable, Any]) -> list[Expression]:
    """Expressions with others (or numbers) in the place of variables."""
    for v, e in s.items():
        if e.__class__ is not Expression:
            s = {**s, v: _build.expect("Substitute", e)}
    return _build.fold(expressions, _Substitution(s))


class _Substitution:
    """The rule of `substitute`: what does not change is taken over."""

    def __init__(self, places: dict[Variable, Expression]) -> None:
        self._places = places

    def __call__(self, e: Expression, of: Callable[[Expression], Expression]) -> Expression:
        kind = e._kind
        if kind == k.VAR:
            return self._places.get(e._made[0], e)
        if kind == k.CONSTANT:
            return e
        if kind == k.ADD:
            return self._of_sum(e, of)
        if kind == k.MUL:
            return self._of_product(e, of)
        args = e._made
        if kind == k.POW and args[1]._kind == k.CONSTANT:
            base = of(args[0])
            return e if base is args[0] else _build.power(base, args[1])
        if kind == k.IF_THEN_ELSE:
            condition, then, otherwise = args
            return _build.conditional(condition._substitute(self._places), of(then), of(otherwise))
        parts = _build.children(e)
        new = [of(part) for part in parts]
        return e if all(map(operator.is_, parts, new)) else _build.rebuild(e, new)

    def _of_sum(self, e: Expression, of: Callable[[Expression], Expression]) -> Expression:
        places, changed, terms = self._places, [], e._terms
        for n, (t, c) in terms.items():
            new = places.get(t._made[0], t) if t._kind == k.VAR else of(t)
            if new is not t:
                changed.append((n, c, new))
        if not changed:
            return e
        terms, constant = terms.copy(), e._constant
        for n, _, _ in changed:
            del terms[n]
        for _, c, new in changed:
            constant += _build.add_scaled_into(terms, c, new)
        return _build.make_sum(constant, terms)

    def _of_product(self, e: Expression, of: Callable[[Expression], Expression]) -> Expression:
        places, changed, factors = self._places, [], e._terms
        for n, (base, exponent) in factors.items():
            new = places.get(base._made[0], base) if base._kind == k.VAR else of(base)
            power = exponent if exponent._kind == k.CONSTANT else of(exponent)
            if new is not base or power is not exponent:
                changed.append((n, new, power))
        if not changed:
            return e
        if any([new._kind == k.DIV for _, new, _ in changed]):  # what quotients and others give depends on their order
            parts = [of(part) for part in _build.children(e)]
            return _build.rebuild(e, parts)
        factors = factors.copy()
        for n, _, _ in changed:
            del factors[n]
        out = _build.make_product(e._constant, factors)
        for _, new, power in changed:
            factor = new if power is _build.ONE else _build.power(new, power)
            out = factor if out is _build.ONE else _build.multiply(out, factor)
        return out


# Expansion


def expand(e: Expression) -> Expression:
    """Products of sums multiplied out."""
    return _build.fold([e], _expanded)[0]


def _expanded(e: Expression, of: Callable[[Expression], Expression]) -> Expression:
    kind = e._kind
    if kind == k.ADD:
        terms = [(c * d, s) for t, c in e._terms.values() for d, s in _terms(of(t))]
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
        return times(_build.constant(1.0 / parts[1]._made[0]), parts[0])
    return _build.rebuild(e, parts)


def _terms(e: Expression) -> list[tuple[float, Expression]]:
    """The terms of a sum and their coefficients, constant first."""
    if e._kind != k.ADD:
        return [(1.0, e)]
    head = [(e._constant, _build.ONE)] if e._constant != 0.0 else []
    return head + [(c, t) for t, c in e._terms.values()]


def times(a: Expression, b: Expression) -> Expression:
    """The product of two expanded expressions, expanded."""
    if a._kind != k.ADD and b._kind != k.ADD:
        return _times_one(a, b)
    return _build.combination(0.0, [(c * d, _times_one(s, t)) for c, s in _terms(a) for d, t in _terms(b)])


def _times_one(a: Expression, b: Expression) -> Expression:
    if a._kind == k.DIV and b._kind != k.CONSTANT:
        return _build.divide(times(a._args[0], b), a._args[1])
    if b._kind == k.DIV and a._kind != k.CONSTANT:
        return _build.divide(times(a, b._args[0]), b._args[1])
    return _build.multiply(a, b)


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


def object_array(items: Sequence[Any], shape: tuple[int, ...] | None = None) -> np.ndarray:
    """An array of objects from a flat list."""
    out = np.empty(len(items), dtype=object)
    out[:] = items
    return out if shape is None else out.reshape(shape)
