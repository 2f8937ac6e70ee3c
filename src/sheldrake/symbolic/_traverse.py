"""Walks over expressions: evaluation, substitution, expansion. Each different part is visited once."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._overloads import Mismatch, expect
from sheldrake.symbolic import _build, _numbers
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._build import nodes
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._variable import Variable

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sheldrake.common import RandomGenerator


def variables_of(e: Expression) -> frozenset[Variable]:
    """The variables in an expression; kept with it."""
    if e._variables is None:
        found: set[Variable] = set()
        seen, stack = {e._serial}, [e]
        while stack:
            node = stack.pop()
            if node._variables is not None:
                found |= node._variables
                continue
            if node._kind == k.VAR:
                found.add(node._args[0])
            elif node._kind == k.IF_THEN_ELSE:
                found |= node._args[0]._variables()
            for child in _build.children(node):
                if child._serial not in seen:
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
    return evaluate_nodes(expressions, values)


class _Failure(float):
    """Stands for a value that could not be computed; it matters only if a branch that is taken uses it."""

    error: Exception


def evaluate_nodes(expressions: Sequence[Expression], env: dict[Variable, float]) -> list[float]:
    """Values of expressions, the environment already checked."""
    done: dict[int, float] = {}
    order = nodes(*expressions)
    lazy = any(node._kind == k.IF_THEN_ELSE for node in order)
    for e in order:
        try:
            done[e._serial] = _value(e, done, env, lazy)
        except (RuntimeError, ValueError) as error:
            if not lazy:
                raise
            failure = _Failure("nan")
            failure.error = error
            done[e._serial] = failure
    out = [done[e._serial] for e in expressions]
    for value in out:
        if value.__class__ is _Failure:
            raise value.error
    return out


def _value(e: Expression, done: dict[int, float], env: dict[Variable, float], lazy: bool) -> float:
    kind, args = e._kind, e._args
    if kind == k.CONSTANT:
        return args[0]
    if kind == k.VAR:
        if args[0] not in env:
            raise no_entry(args[0])
        return env[args[0]]
    if kind == k.IF_THEN_ELSE:
        return done[(args[1] if args[0]._evaluate(env) else args[2])._serial]
    if lazy:
        for child in _build.children(e):
            value = done[child._serial]
            if value.__class__ is _Failure:
                raise value.error
    if kind == k.ADD:
        return sum((c * done[t._serial] for t, c in args[1]), args[0])
    if kind == k.MUL:
        product = args[0]
        for base, exponent in args[1]:
            b = done[base._serial]
            product *= b if exponent is _build.ONE else _numbers.power(b, done[exponent._serial])
        return product
    if kind == k.DIV:
        a, b = (done[x._serial] for x in args)
        if b == 0.0:
            raise RuntimeError(f"Division by zero: {a:g} / {b:g}, in {e}")
        return a / b
    if kind == k.NAN:
        raise RuntimeError("NaN is detected during Symbolic computation.")
    if kind == k.UNINTERPRETED:
        raise RuntimeError(f"Uninterpreted-function expression cannot be evaluated: {e}")
    if len(args) == 1:
        return float(_numbers.UNARY[kind](done[args[0]._serial]))
    return float(_numbers.BINARY[kind](done[args[0]._serial], done[args[1]._serial]))


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
    expressions = list(expressions)
    places = {v: _build.as_expression(e) for v, e in s.items()}
    done: dict[int, Any] = {}
    for e in nodes(*expressions):
        if e._kind == k.VAR:
            done[e._serial] = places.get(e._args[0], e)
        elif e._kind == k.IF_THEN_ELSE:
            condition = e._args[0]._substitute(places)
            done[e._serial] = _build.conditional(condition, done[e._args[1]._serial], done[e._args[2]._serial])
        else:
            parts = _build.children(e)
            new = [done[p._serial] for p in parts]
            changed = any(a._serial != b._serial for a, b in zip(parts, new))
            done[e._serial] = _build.rebuild(e, new) if changed else e
    return [done[e._serial] for e in expressions]


# Expansion


def expand(e: Expression) -> Expression:
    """Products of sums multiplied out."""
    done: dict[int, Expression] = {}
    for node in nodes(e):
        done[node._serial] = _expanded(node, done)
    return done[e._serial]


def _expanded(e: Expression, done: dict[int, Expression]) -> Expression:
    if e._kind == k.ADD:
        return _build.sum_of([_build.constant(e._args[0]), *(_times_number(c, done[t._serial]) for t, c in e._args[1])])
    if e._kind == k.MUL:
        out = _build.ONE
        for base, exponent in e._args[1]:
            out = times(out, _expanded_power(done[base._serial], done[exponent._serial]))
        return _times_number(e._args[0], out)
    if e._kind == k.POW:
        return _expanded_power(*(done[a._serial] for a in e._args))
    if e._kind == k.DIV:
        a, b = (done[x._serial] for x in e._args)
        if b._kind == k.CONSTANT and b._args[0] != 0.0:
            return _times_number(1.0 / b._args[0], a)
    parts = [done[p._serial] for p in _build.children(e)]
    return _build.rebuild(e, parts)


def _terms(e: Expression) -> list[Expression]:
    """The terms of a sum, constant first, coefficients multiplied in."""
    if e._kind != k.ADD:
        return [e]
    head = [_build.constant(e._args[0])] if e._args[0] != 0.0 else []
    return head + [_build.scale(c, t) for t, c in e._args[1]]


def _times_number(c: float, e: Expression) -> Expression:
    return _build.sum_of(_build.scale(c, t) for t in _terms(e)) if e._kind == k.ADD else _build.scale(c, e)


def times(a: Expression, b: Expression) -> Expression:
    """The product of two expanded expressions, expanded."""
    if a._kind != k.ADD and b._kind != k.ADD:
        return _times_one(a, b)
    return _build.sum_of(_times_one(s, t) for s in _terms(a) for t in _terms(b))


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
    done: dict[int, bool] = {}
    for node in nodes(e):
        kind, args = node._kind, node._args
        if kind == k.ADD:
            answer = all(done[t._serial] for t, _ in args[1])
        elif kind == k.MUL:
            answer = all(done[b._serial] and _is_natural(x) for b, x in args[1])
        elif kind == k.POW:
            answer = done[args[0]._serial] and _is_natural(args[1])
        elif kind == k.DIV:
            answer = done[args[0]._serial] and args[1]._kind == k.CONSTANT
        else:
            answer = kind in (k.CONSTANT, k.VAR)
        done[node._serial] = answer
    return done[e._serial]


def _is_natural(e: Expression) -> bool:
    return e._kind == k.CONSTANT and e._args[0] >= 0.0 and float(e._args[0]).is_integer()


def object_array(items: Sequence[Any], shape: tuple[int, ...] | None = None) -> np.ndarray:
    """An array of objects from a flat list."""
    out = np.empty(len(items), dtype=object)
    for i, item in enumerate(items):
        out[i] = item
    return out if shape is None else out.reshape(shape)
