"""Expressions as lists of operations, which kernels walk along: for values, and for their derivatives."""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sheldrake.common._bound_calls import BoundCalls
from sheldrake.symbolic import _build
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._build import ONE
from sheldrake.symbolic._kernels import tape as t

if TYPE_CHECKING:
    from collections.abc import Callable

    from sheldrake.common.kernel import Bound
    from sheldrake.symbolic._expression import Expression
    from sheldrake.symbolic._variable import Variable

_SMOOTH = {
    k.LOG: t.LOG, k.EXP: t.EXP, k.SQRT: t.SQRT, k.SIN: t.SIN, k.COS: t.COS, k.TAN: t.TAN, k.ASIN: t.ASIN,
    k.ACOS: t.ACOS, k.ATAN: t.ATAN, k.SINH: t.SINH, k.COSH: t.COSH, k.TANH: t.TANH, k.DIV: t.DIVIDE, k.ATAN2: t.ATAN2,
}  # fmt: skip
_ALL = {**_SMOOTH, k.ABS: t.ABS, k.CEIL: t.CEIL, k.FLOOR: t.FLOOR, k.MIN: t.MIN, k.MAX: t.MAX}


class Written(NamedTuple):
    """Expressions as operations on numbered floats.

    Attributes:
        operations: Of each its kind, two numbers that it takes, and the one that it gives.
        constants: The last numbers, from the end.
        results: Which numbers the expressions are.
        size: How many numbers there are.
        variables: How many of these are variables, which come first.
    """

    operations: list[int]
    constants: list[float]
    results: list[int]
    size: int
    variables: int


class _CannotWriteError(Exception):
    """An expression has a condition, or something else that has no operation."""


class _Writer:
    """Numbers that are found, and operations; constants have numbers from -1 down until it is known how many there are.

    Args:
        variables: What the first numbers stand for.
        kinds: Operations of the functions there may be.
    """

    def __init__(self, variables: Sequence[Variable | None], kinds: dict[int, int]) -> None:
        self._places, self._kinds = {v._id: i for i, v in enumerate(variables) if v is not None}, kinds
        self._next = len(variables)
        self.known: dict[float | str, int] = {}  # constants; zeros by their text, which has a sign
        self.operations: list[int] = []

    def _constant(self, value: float) -> int:
        return self.known.setdefault(value or str(value), -1 - len(self.known))

    def _apply(self, kind: int, a: int, b: int) -> int:
        to = self._next
        self._next = to + 1
        self.operations += (kind, a, b, to)
        return to

    def _power(self, base: int, exponent: Expression, of: Callable[[Expression], int]) -> int:
        kind = t.CONSTANT_POWER if exponent._kind == k.CONSTANT else t.POWER
        return self._apply(kind, base, of(exponent))

    def rule(self, e: Expression, of: Callable[[Expression], int]) -> int:
        """The number of an expression; `of` gives that of a part. Sums and products go from left to right."""
        kind = e._kind
        if kind == k.VAR:
            place = self._places.get(e._made[0]._id)
            if place is None:
                raise _CannotWriteError
            return place
        if kind == k.CONSTANT:
            return self._constant(float(e._made[0]))
        if kind == k.ADD:
            first, terms = e._args
            total = None if first == 0.0 else self._constant(first)
            for x, c in terms:
                number = of(x) if c == 1.0 else self._apply(t.MULTIPLY, self._constant(c), of(x))
                total = number if total is None else self._apply(t.ADD, total, number)
            assert total is not None
            return total
        if kind == k.MUL:
            first, factors = e._args
            total = None if first == 1.0 else self._constant(first)
            for base, exponent in factors:
                number = of(base) if exponent is ONE else self._power(of(base), exponent, of)
                total = number if total is None else self._apply(t.MULTIPLY, total, number)
            assert total is not None
            return total
        if kind == k.POW:
            return self._power(of(e._made[0]), e._made[1], of)
        what = self._kinds.get(kind)
        if what is None:
            raise _CannotWriteError
        return self._apply(what, of(e._made[0]), of(e._made[-1]))


def write(
    expressions: Sequence[Expression], variables: Sequence[Variable | None], smooth: bool = False
) -> Written | None:
    """The values of expressions as operations; None if one has a condition, or something else that has no kernel.

    Args:
        expressions: What is wanted.
        variables: What the first numbers stand for, in order; None: nothing that counts.
        smooth: Whether there is to be nothing that has kinks or steps, either.
    """
    writer = _Writer(variables, _SMOOTH if smooth else _ALL)
    try:
        results = _build.fold(expressions, writer.rule)
    except _CannotWriteError:
        return None
    size = writer._next + len(writer.known)
    operations, results = ([x if x >= 0 else x + size for x in some] for some in (writer.operations, results))
    return Written(operations, [float(c) for c in writer.known], results, size, len(variables))


def tape_of(
    expressions: Sequence[Expression], variables: Sequence[Variable | None], used: Container[int]
) -> t.Tape | None:
    """The same for a kernel that says where there is no value; `used` are the ids of variables that count."""
    written = write(expressions, variables)
    if written is None:
        return None
    return t.Tape(
        np.array(written.operations, np.int64).reshape(-1, t.Operation.SIZE),
        np.array(written.constants, float),
        np.array([written.size], np.int64),
        np.array([i for i, v in enumerate(variables) if v is not None and v._id in used], np.int64),
        np.array(written.results, np.int64),
    )


class Pieces:
    """Puts what is written together for `Tapes`: each at some variables, whose values and derivatives go somewhere.

    What is added again takes no more operations.

    Args:
        slopes: Where their derivatives begin.

    Attributes:
        values: How many values there are.
        slopes: Where derivatives end.
        curvatures: How many second derivatives there are.
    """

    def __init__(self, slopes: int = 0) -> None:
        self.values, self.slopes, self.curvatures = 0, slopes, 0
        self._operations: list[int] = []
        self._constants: list[float] = []
        self._results: list[int] = []
        self._columns: list[int] = []
        self._pieces: list[int] = []
        self._known: dict[int, tuple[int, ...]] = {}
        self._size = 1

    def add(self, written: Written, columns: Iterable[int]) -> None:
        """Adds expressions of the variables at given places."""
        n, m = written.variables, len(written.results)
        where = self._known.get(id(written))
        if where is None:
            begin = len(self._operations) // t.Operation.SIZE
            self._operations += written.operations
            end = len(self._operations) // t.Operation.SIZE
            where = begin, end, written.size, n, len(written.constants), m, len(self._constants), len(self._results)
            self._known[id(written)] = where
            self._constants += written.constants
            self._results += written.results
            self._size = max(self._size, written.size)
        *counts, result = where
        self._pieces += (*counts, len(self._columns), result, self.values, self.slopes)
        self._columns += columns
        self.values, self.slopes, self.curvatures = self.values + m, self.slopes + m * n, self.curvatures + n * n

    def tapes(self) -> t.Tapes:
        """All of them."""
        return t.Tapes(
            np.array(self._operations, np.int64).reshape(-1, t.Operation.SIZE),
            np.array(self._pieces, np.int64).reshape(-1, t.Piece.SIZE),
            np.array(self._constants, float),
            np.array(self._columns, np.int64),
            np.array(self._results, np.int64),
            np.zeros((4, self._size)),
        )


class AtPoints:
    """Smooth expressions at many points at once; inf or nan outside of their domains.

    Args:
        written: The expressions.
    """

    def __init__(self, written: Written):
        self._written = written
        self._calls = BoundCalls(self._made)

    def _made(self, count: int) -> tuple[Bound, Bound, list[np.ndarray]]:
        n, m = self._written.variables, len(self._written.results)
        pieces = Pieces()
        for p in range(count):
            pieces.add(self._written, range(p * n, p * n + n))
        tapes = pieces.tapes()
        x, values, slopes = np.zeros((count, n)), np.zeros((count, m)), np.zeros((count, m, n))
        weights, H = np.zeros((count, m)), np.zeros((count, n, n))
        rows = np.arange(count * m)
        first = t.at_points.bind(tapes, x.ravel(), values.ravel(), slopes.ravel(), 0)
        second = t.hessians_at_points.bind(tapes, x.ravel(), weights.ravel(), rows, H.ravel())
        return first, second, [x, values, slopes, weights, H]

    def __call__(self, points: np.ndarray, with_slopes: bool) -> tuple[np.ndarray, np.ndarray]:
        """Values, shape (points, m), and derivatives, shape (points, m, n) or, if not wanted, (points, 0, n)."""
        call, _, (x, values, slopes, *_) = self._calls.of(len(points))
        x[:] = points
        call.set("with_slopes", with_slopes)
        call()
        return values.copy(), slopes.copy() if with_slopes else slopes[:, :0].copy()

    def hessian(self, points: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Second derivatives of the values times weights of shape (points, m), shape (points, n, n)."""
        _, call, (x, _, _, given, H) = self._calls.of(len(points))
        x[:], given[:] = points, weights
        call()
        return H.copy()
