"""Affine functions of a program's variables, and the constraints that sets make of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.solvers import BoundingBoxConstraint, LinearConstraint, LinearEqualityConstraint, MathematicalProgram
from sheldrake.solvers._functions.bindings import bind
from sheldrake.solvers._program.parts import parts_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from sheldrake.common._types import Symbolic
    from sheldrake.solvers import Constraint


class Affine:
    """A sum of A x for blocks x of variables of a program, and b.

    Args:
        terms: (A, x) of each block, A of shape (m, len(x)); None for the variables themselves.
        b: Shape (m,).
    """

    __array_ufunc__ = None  # NumPy leaves M @ affine to __rmatmul__.

    def __init__(self, terms: list[tuple[np.ndarray | None, np.ndarray]], b: np.ndarray):
        self.terms, self.b = terms, b

    @classmethod
    def of(cls, vars: Sequence[Symbolic] | np.ndarray) -> Affine:
        """The variables themselves."""
        vars = np.asarray(vars, dtype=object).ravel()
        return cls([(None, vars)], np.zeros(len(vars)))

    @classmethod
    def constant(cls, b: ArrayLike) -> Affine:
        """Numbers."""
        return cls([], np.atleast_1d(np.array(b, dtype=float)))

    def is_one(self) -> bool:
        """Whether it is the number one."""
        return not self.terms and np.array_equal(self.b, [1.0])

    def __len__(self) -> int:
        return self.b.size

    def __add__(self, other: Affine) -> Affine:
        return Affine(self.terms + other.terms, self.b + other.b)

    def __sub__(self, other: Affine) -> Affine:
        minus: list[tuple[np.ndarray | None, np.ndarray]] = [
            (-np.eye(len(x)) if A is None else -A, x) for A, x in other.terms
        ]
        return Affine(self.terms + minus, self.b - other.b)

    def __rmatmul__(self, M: np.ndarray) -> Affine:
        return Affine([(M if A is None else M @ A, x) for A, x in self.terms], M @ self.b)

    def __getitem__(self, rows: slice | np.ndarray | list[int]) -> Affine:
        """Some rows."""
        return Affine([(None, x[rows]) if A is None else (A[rows], x) for A, x in self.terms], self.b[rows])

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
        A = np.concatenate([np.eye(len(x)) if A is None else A for A, x in self.terms], axis=1)
        vars = np.concatenate([x for _, x in self.terms])
        first: dict[int, int] = {}
        places = [first.setdefault(v._id, i) for i, v in enumerate(vars.tolist())]
        if len(first) == len(places):
            return A, vars
        together = np.zeros_like(A)
        np.add.at(together.T, places, A.T)
        kept = list(first.values())
        return together[:, kept], vars[kept]


class Rows:
    """Adds constraints to a program and remembers them, and the variables that come with them.

    Args:
        prog: The program.
        has_signs: Whether it says of all scales already that they are not negative.
    """

    def __init__(self, prog: MathematicalProgram, has_signs: bool = False):
        self.prog, self._has_signs = prog, has_signs
        self._bindings = parts_of(prog).bindings
        self.variables: list[Any] = []
        self.constraints: list[Any] = []

    def _add(self, evaluator: Constraint, vars: np.ndarray) -> None:
        self.constraints.append(self._bindings.add(bind(type(evaluator), evaluator, vars)))

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
        if len(e.terms) == 1 and e.terms[0][0] is None:
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
        self.constraints.append(self.prog.AddLorentzConeConstraint(A, e.b, vars))

    def rotated_lorentz(self, e: Affine) -> None:
        """e_0 e_1 >= |e_2 ...|^2, e_0 and e_1 not negative."""
        A, vars = e.gathered()
        self.constraints.append(self.prog.AddRotatedLorentzConeConstraint(A, e.b, vars))

    def exponential(self, e: Affine) -> None:
        """e_0 >= e_1 exp(e_2 / e_1), e_1 > 0."""
        A, vars = e.gathered()
        self.constraints.append(self.prog.AddExponentialConeConstraint(A, e.b, vars))

    def semidefinite(self, e: Affine, size: int) -> None:
        """The symmetric matrix whose columns, one after the other, are e has no negative eigenvalue."""
        A, vars = e.gathered()
        F = [e.b.reshape(size, size), *(column.reshape(size, size) for column in A.T)]
        self.constraints.append(self.prog.AddLinearMatrixInequalityConstraint(F, vars))
