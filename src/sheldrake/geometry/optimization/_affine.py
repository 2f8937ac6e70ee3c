"""Affine functions of a program's variables, and the constraints that sets make of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.solvers import MathematicalProgram

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from sheldrake.common._types import Symbolic


class Affine:
    """A x + b of variables x of a program.

    Args:
        vars: Variables, shape (n,).
        A: Shape (m, n).
        b: Shape (m,).
    """

    __array_ufunc__ = None  # NumPy leaves M @ affine to __rmatmul__.

    def __init__(self, vars: np.ndarray, A: np.ndarray, b: np.ndarray):
        self.vars, self.A, self.b = vars, A, b

    @classmethod
    def of(cls, vars: Sequence[Symbolic] | np.ndarray) -> Affine:
        """The variables themselves."""
        vars = np.asarray(vars, dtype=object).ravel()
        return cls(vars, np.eye(len(vars)), np.zeros(len(vars)))

    @classmethod
    def constant(cls, b: ArrayLike) -> Affine:
        """Numbers."""
        b = np.atleast_1d(np.array(b, dtype=float))
        return cls(np.zeros(0, dtype=object), np.zeros((b.size, 0)), b)

    def is_one(self) -> bool:
        """Whether it is the number one."""
        return not self.vars.size and np.array_equal(self.b, [1.0])

    def __len__(self) -> int:
        return self.b.size

    def __add__(self, other: Affine) -> Affine:
        return Affine(
            np.concatenate((self.vars, other.vars)), np.hstack((self.A, other.A)), self.b + other.b
        ).simplified()

    def __sub__(self, other: Affine) -> Affine:
        return self + Affine(other.vars, -other.A, -other.b)

    def __rmatmul__(self, M: np.ndarray) -> Affine:
        return Affine(self.vars, M @ self.A, M @ self.b)

    def __getitem__(self, rows: int | slice | np.ndarray | list[int]) -> Affine:
        """Some rows, with the variables that are in these."""
        A = self.A[rows]
        used = A.any(axis=0)
        return Affine(self.vars[used], A[:, used], self.b[rows])

    def stacked(self, other: Affine) -> Affine:
        """This one over another."""
        n, m = len(self), len(other)
        top, bottom = np.eye(n + m, n), np.eye(n + m)[:, n:]
        return (top @ self) + (bottom @ other)

    def times(self, v: ArrayLike) -> Affine:
        """v times this one, which has one row."""
        return np.asarray(v, dtype=float).reshape(-1, 1) @ self

    def simplified(self) -> Affine:
        """The same function, with each variable once."""
        ids = [v.get_id() for v in self.vars]
        if len(set(ids)) == len(ids):
            return self
        first = {id: ids.index(id) for id in ids}
        columns = list(first)
        A = np.zeros((len(self), len(columns)))
        for j, id in enumerate(ids):
            A[:, columns.index(id)] += self.A[:, j]
        return Affine(self.vars[list(first.values())], A, self.b)


class Rows:
    """Adds constraints to a program and remembers them, and the variables that come with them."""

    def __init__(self, prog: MathematicalProgram):
        self.prog = prog
        self.variables: list[Any] = []
        self.constraints: list[Any] = []

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
        self.constraints.append(self.prog.AddLinearEqualityConstraint(e.A, 0.0 - e.b, e.vars))

    def between(self, lower: np.ndarray, e: Affine, upper: np.ndarray) -> None:
        """lower <= e <= upper; bounds where e are variables."""
        if e.A.shape[0] == e.A.shape[1] and np.array_equal(e.A, np.eye(len(e))):
            self.constraints.append(self.prog.AddBoundingBoxConstraint(lower - e.b, upper - e.b, e.vars))
        else:
            self.linear(lower, e, upper)

    def linear(self, lower: np.ndarray, e: Affine, upper: np.ndarray) -> None:
        """lower <= e <= upper."""
        self.constraints.append(self.prog.AddLinearConstraint(e.A, lower - e.b, upper - e.b, e.vars))

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
                self.between(zero, e, far) if sign < 0 else self.between(-far, e, zero)

    def nonnegative(self, scale: Affine) -> None:
        """s >= 0 for a scale that is no number."""
        if not scale.is_one():
            self.between(np.zeros(1), scale, np.array([np.inf]))

    def lorentz(self, e: Affine) -> None:
        """e_0 >= |e_1 ...|."""
        self.constraints.append(self.prog.AddLorentzConeConstraint(e.A, e.b, e.vars))

    def rotated_lorentz(self, e: Affine) -> None:
        """e_0 e_1 >= |e_2 ...|^2, e_0 and e_1 not negative."""
        self.constraints.append(self.prog.AddRotatedLorentzConeConstraint(e.A, e.b, e.vars))

    def exponential(self, e: Affine) -> None:
        """e_0 >= e_1 exp(e_2 / e_1), e_1 > 0."""
        self.constraints.append(self.prog.AddExponentialConeConstraint(e.A, e.b, e.vars))

    def semidefinite(self, e: Affine, size: int) -> None:
        """The symmetric matrix whose columns, one after the other, are e has no negative eigenvalue."""
        F = [e.b.reshape(size, size), *(column.reshape(size, size) for column in e.A.T)]
        self.constraints.append(self.prog.AddLinearMatrixInequalityConstraint(F, e.vars))
