"""Affine functions of a program's variables, and the constraints that sets make of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from sheldrake.solvers import (
    BoundingBoxConstraint,
    LinearConstraint,
    LinearEqualityConstraint,
    LorentzConeConstraint,
    MathematicalProgram,
    RotatedLorentzConeConstraint,
)
from sheldrake.solvers._functions.bindings import bind, bind_list
from sheldrake.solvers._program.parts import parts_of
from sheldrake.symbolic import Variable
from sheldrake.symbolic._traverse import object_array

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import ArrayLike

    from sheldrake.common._types import Symbolic
    from sheldrake.geometry.optimization._convex_set import ConvexSet
    from sheldrake.solvers import Constraint


class Affine:
    """A sum of A x for blocks x of variables of a program, and b.

    Args:
        terms: (A, x) of each block, A of shape (m, len(x)); or a number, by which the variables are multiplied.
        b: Shape (m,).
    """

    __array_ufunc__ = None  # NumPy leaves M @ affine to __rmatmul__.

    def __init__(self, terms: list[tuple[np.ndarray | float, np.ndarray]], b: np.ndarray, is_plain: bool = False):
        self.terms, self.b, self._is_plain = terms, b, is_plain  # plain: known to have no matrices and no constant

    @classmethod
    def of(cls, vars: Sequence[Symbolic] | np.ndarray) -> Affine:
        """The variables themselves."""
        vars = np.asarray(vars, dtype=object).ravel()
        return cls([(1.0, vars)], np.zeros(len(vars)), True)

    @classmethod
    def constant(cls, b: ArrayLike) -> Affine:
        """Numbers."""
        numbers = np.atleast_1d(np.array(b, dtype=float))
        return cls([], numbers, not numbers.any())

    def is_one(self) -> bool:
        """Whether it is the number one."""
        return not self.terms and np.array_equal(self.b, [1.0])

    def factors(self) -> tuple[float, ...] | str | None:
        """The numbers its blocks are multiplied by, if it has no matrices and no constant; "one" of the number one."""
        if self._is_plain:
            return tuple([A for A, _ in self.terms])  # type: ignore[misc]
        return "one" if self.is_one() else None

    def __len__(self) -> int:
        return self.b.size

    def __add__(self, other: Affine) -> Affine:
        return Affine(self.terms + other.terms, self.b + other.b, self._is_plain and other._is_plain)

    def __sub__(self, other: Affine) -> Affine:
        terms = self.terms + [(-A, x) for A, x in other.terms]
        return Affine(terms, self.b - other.b, self._is_plain and other._is_plain)

    def __rmatmul__(self, M: np.ndarray) -> Affine:
        return Affine([(M * A if A.__class__ is float else M @ A, x) for A, x in self.terms], M @ self.b)

    def __getitem__(self, rows: slice | np.ndarray | list[int]) -> Affine:
        """Some rows."""
        terms: list[Any] = [(A, x[rows]) if isinstance(A, float) else (A[rows], x) for A, x in self.terms]
        return Affine(terms, self.b[rows], self._is_plain)

    def stacked(self, other: Affine) -> Affine:
        """This one over another."""
        n, m = len(self), len(other)
        top, bottom = np.eye(n + m, n), np.eye(n + m)[:, n:]
        return (top @ self) + (bottom @ other)

    def times(self, v: ArrayLike) -> Affine:
        """v times this one, which has one row."""
        return np.asarray(v, dtype=float).reshape(-1, 1) @ self

    def gathered(self) -> tuple[np.ndarray, np.ndarray]:
        """A, shape (m, n), and the variables, each once."""
        if not self.terms:
            return np.zeros((len(self), 0)), np.zeros(0, dtype=object)
        A = np.concatenate([A * np.eye(len(x)) if A.__class__ is float else A for A, x in self.terms], axis=1)
        vars = np.concatenate([x for _, x in self.terms])
        first: dict[int, int] = {}
        places = [first.setdefault(v._id, i) for i, v in enumerate(vars.tolist())]
        if len(first) == len(places):
            return A, vars
        together = np.zeros_like(A)
        np.add.at(together.T, places, A.T)
        kept = list(first.values())
        return together[:, kept], vars[kept]


class _Added(NamedTuple):
    """What was added for an object and variables, as it can be added for others.

    Attributes:
        source: The object, which is not to be forgotten.
        names: Of new variables.
        bindings: Kind, evaluator and places of the variables among those given and the new ones.
    """

    source: object
    names: list[str]
    bindings: list[tuple[Any, Any, list[int]]]


Known: TypeAlias = "dict[tuple[Any, ...], _Added]"


class Rows:
    """Adds constraints to a program and remembers them, and the variables that come with them.

    Args:
        prog: The program.
        has_signs: Whether it says of all scales already that they are not negative.
        known: What was added to other programs that say the same of scales; is filled.
    """

    def __init__(self, prog: MathematicalProgram, has_signs: bool = False, known: Known | None = None):
        self.prog, self._has_signs = prog, has_signs
        self._bindings = parts_of(prog).bindings
        self.variables: list[Any] = []
        self.constraints: list[Any] = []
        self._added: Known = {} if known is None else known

    def _add(self, evaluator: Constraint, vars: np.ndarray) -> None:
        self.constraints.append(self._bindings.add(bind(type(evaluator), evaluator, vars)))

    def contain(self, set: ConvexSet, x: Affine, scale: Affine) -> None:
        """Has x be in a set times a scale that is not negative."""
        self.alike(set, (x, scale), lambda: set._contain(self, x, scale))

    def alike(self, source: object, of: tuple[Affine, ...], add: Callable[[], None]) -> None:
        """What `add` adds, which depends on an object and on affine functions of variables.

        Where these are sums of different variables times numbers, or the number one, it is done once for each object
        and such numbers: for other variables the same evaluators are bound to them.
        """
        parts = [e.factors() for e in of]
        given = [v for e in of for _, x in e.terms for v in x.tolist()]
        if None in parts or len({v._id for v in given}) < len(given):
            add()
            return
        key = id(source), len(of[0]), *parts
        known = self._added.get(key)
        if known is not None:
            self._again(known, given)
            return
        before = len(self.variables), len(self.constraints)
        add()
        new = self.variables[before[0] :]
        places = {v._id: i for i, v in enumerate([*given, *new])}
        found = [(b._kind, b._evaluator, [places[v._id] for v in b._list]) for b in self.constraints[before[1] :]]
        self._added[key] = _Added(source, [v.get_name() for v in new], found)

    def _again(self, known: _Added, given: list[Variable]) -> None:
        new = [Variable(name) for name in known.names]
        if new:
            self.prog.AddDecisionVariables(object_array(new))
            self.variables += new
        vars = given + new
        for kind, evaluator, places in known.bindings:
            binding = bind_list(kind, evaluator, [vars[i] for i in places])
            self.constraints.append(self._bindings.add(binding))

    def new(self, count: int, name: str) -> Affine:
        """New variables."""
        vars = self.prog.NewContinuousVariables(count, name)
        self.variables += list(vars)
        return Affine.of(vars)

    def new_columns(self, rows: int, cols: int, name: str) -> list[Affine]:
        """New variables as the columns of a matrix."""
        vars = self.prog.NewContinuousVariables(rows, cols, name)
        self.variables += list(vars.ravel(order="F"))
        return [Affine.of(vars[:, j]) for j in range(cols)]

    def equal(self, e: Affine) -> None:
        """e = 0."""
        A, vars = e.gathered()
        right = 0.0 - e.b
        self._add(LinearEqualityConstraint._of(A, right, right), vars)

    def between(self, lower: np.ndarray, e: Affine, upper: np.ndarray) -> None:
        """lower <= e <= upper; bounds where e are variables."""
        factor = e.terms[0][0] if len(e.terms) == 1 else 0.0
        if isinstance(factor, float) and factor == 1.0:
            self._add(BoundingBoxConstraint._of(lower - e.b, upper - e.b), e.terms[0][1])
        else:
            self.linear(lower, e, upper)

    def linear(self, lower: np.ndarray, e: Affine, upper: np.ndarray) -> None:
        """lower <= e <= upper."""
        A, vars = e.gathered()
        self._add(LinearConstraint._of(A, lower - e.b, upper - e.b), vars)

    def within(self, lower: np.ndarray, x: Affine, upper: np.ndarray, scale: Affine) -> None:
        """Lower s <= x <= upper s for the scale s; a bound that is infinite is left out."""
        if scale.is_one():
            self.between(lower, x, upper)
            return
        for sign, bound in ((-1.0, lower), (1.0, upper)):
            finite = np.flatnonzero(np.isfinite(bound))
            if finite.size:
                e = x[finite] - scale.times(bound[finite])
                zero, far = np.zeros(finite.size), np.full(finite.size, np.inf)
                self.linear(zero, e, far) if sign < 0 else self.linear(-far, e, zero)

    def nonnegative(self, scale: Affine) -> None:
        """s >= 0 for a scale that is no number."""
        if not (self._has_signs or scale.is_one()):
            self.between(np.zeros(1), scale, np.array([np.inf]))

    def lorentz(self, e: Affine) -> None:
        """e_0 >= |e_1 ...|."""
        A, vars = e.gathered()
        self._add(LorentzConeConstraint(A, e.b), vars)

    def rotated_lorentz(self, e: Affine) -> None:
        """e_0 e_1 >= |e_2 ...|^2, e_0 and e_1 not negative."""
        A, vars = e.gathered()
        self._add(RotatedLorentzConeConstraint(A, e.b), vars)

    def exponential(self, e: Affine) -> None:
        """e_0 >= e_1 exp(e_2 / e_1), e_1 > 0."""
        A, vars = e.gathered()
        self.constraints.append(self.prog.AddExponentialConeConstraint(A, e.b, vars))

    def semidefinite(self, e: Affine, size: int) -> None:
        """The symmetric matrix whose columns, one after the other, are e has no negative eigenvalue."""
        A, vars = e.gathered()
        F = [e.b.reshape(size, size), *(column.reshape(size, size) for column in A.T)]
        self.constraints.append(self.prog.AddLinearMatrixInequalityConstraint(F, vars))
