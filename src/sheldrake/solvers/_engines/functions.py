"""Cost and rows of a program as functions of all variables, with sparse derivatives.

Linear and quadratic forms and smooth formulas are evaluated by one kernel. What only Python can evaluate are groups
beside it (`terms`).
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from sheldrake.common.kernel import Bound, Kernel, jit_enabled
from sheldrake.solvers._arrays import joined
from sheldrake.solvers._engines.linear_rows import entries
from sheldrake.solvers._engines.terms import Placed, Terms, grouped, without_nan
from sheldrake.solvers._functions.constraints import LinearConstraint, QuadraticConstraint
from sheldrake.solvers._functions.costs import LinearCost, QuadraticCost
from sheldrake.solvers._kernels import functions as kernels
from sheldrake.symbolic._tape import Pieces

_DENSE = 20_000  # entries of a matrix of all derivatives that is filled at each point


class _Forms:
    """b'y + y'Qy/2 + c, each of some variables, as entries that have a row, a column, and a number in b.

    Args:
        linear: Linear forms; their entries are the coefficients that are not zero.
        quadratic: Quadratic forms, which have an entry for each variable.
        num_rows: How many rows there are.
        scale: Units of the variables.
    """

    def __init__(self, linear: Sequence[Placed], quadratic: Sequence[Placed], num_rows: int, scale: np.ndarray):
        self.c = np.zeros(num_rows)
        lists: tuple[list[np.ndarray], ...] = [], [], [], [], [], []
        rows, cols, b, i, j, Q = lists
        begin = 0
        for form, columns, places in quadratic:
            at = form._Q.nonzero()
            rows.append(places.repeat(len(columns)))
            cols.append(columns)
            b.append(form._b)
            i.append(at[0] + begin)
            j.append(at[1] + begin)
            Q.append(form._Q[at])
            self.c[places] += form._c if isinstance(form, QuadraticCost) else 0.0
            begin += len(columns)
        self.num_quadratic = begin
        if linear:
            matrices = [form._a.reshape(1, -1) if isinstance(form, LinearCost) else form._A for form, _, _ in linear]
            local, columns, numbers = entries(matrices, [len(places) for *_, places in linear])
            rows.append(np.concatenate([places for *_, places in linear])[local])
            cols.append(np.concatenate([columns for _, columns, _ in linear])[columns])
            b.append(numbers)
            for form, _, places in linear:
                self.c[places] += form._b if isinstance(form, LinearCost) else 0.0
        self.row, self.col, self.b = joined(rows, np.int64), joined(cols, np.int64), joined(b, float)
        self.i, self.j, self.Q = joined(i, np.int64), joined(j, np.int64), joined(Q, float)
        units = scale[self.col]
        self.b, self.Q = self.b * units, self.Q * units[self.i] * units[self.j]


class Functions:
    """Cost and rows of constraints, row 0 and those from 1 on, of variables in units of their own.

    Args:
        costs: The costs, all of row 0.
        constraints: The constraints.
        num_rows: How many rows there are.
        scale: Units of the variables.

    Attributes:
        row: Rows of the entries of the Jacobian; those at one place add up.
        col: Their columns.
        parts: What Python evaluates.
        is_native: Whether that is nothing.
        is_dense: Whether the Jacobian is filled as a matrix.
        y: The last point.
    """

    def __init__(self, costs: list[Placed], constraints: list[Placed], num_rows: int, scale: np.ndarray):
        linear: list[Placed] = []
        quadratic: list[Placed] = []
        formulas: list[tuple[Any, Placed]] = []
        rest: list[list[Placed]] = [[], []]
        for k, found in enumerate((costs, constraints)):
            for f in found:
                if isinstance(f.evaluator, (LinearCost, LinearConstraint)):
                    linear.append(f)
                elif isinstance(f.evaluator, (QuadraticCost, QuadraticConstraint)):
                    quadratic.append(f)
                elif (written := f.evaluator._written()) is not None:
                    formulas.append((written, f))
                else:
                    rest[k].append(f)
        forms = self._forms = _Forms(linear, quadratic, num_rows, scale)
        self._linear = linear
        self.parts: list[Terms] = [*grouped(rest[0], True), *grouped(rest[1])]
        self._formulas = [f for _, f in formulas]
        self._pieces = Pieces(len(forms.b))
        for written, f in formulas:
            self._pieces.add(written, f.columns.tolist())
        rows = [f.rows.repeat(len(f.columns)) for f in self._formulas]
        cols = [f.columns for f in self._formulas for _ in f.rows]
        self.row = np.concatenate((forms.row, *rows, *[p.J_rows for p in self.parts]))
        self.col = np.concatenate((forms.col, *cols, *[p.J_cols for p in self.parts]))
        self._scale, self._is_scaled, n = scale, bool((scale != 1.0).any()), len(scale)
        self._is_compiled = jit_enabled()
        self.is_native, self.is_dense = not self.parts and self._is_compiled, num_rows * n <= _DENSE
        self._entry = np.zeros(len(self.row))
        self._entry[: len(forms.b)] = forms.b
        self._models = kernels.Functions(
            forms.c, self.row, self.col, np.flatnonzero(self.row == 0), forms.b[: forms.num_quadratic], forms.i,
            forms.j, forms.Q, np.array([len(forms.b)]), joined([f.rows for f in self._formulas], np.int64), scale,
            np.zeros(n), self._entry,
        )  # fmt: skip
        self._tapes = self._pieces.tapes()
        self.y, self._rows, self._J = np.zeros(n), np.zeros(num_rows), np.zeros((num_rows if self.is_dense else 1, n))
        self._weights, self._H = np.zeros(num_rows), np.zeros(len(forms.Q) + self._pieces.curvatures)
        self._known: dict[str, list[int]] = {}
        self._values_at = self._slopes_at = b""  # the points that memory is of

    def words(self, *memory: np.ndarray) -> np.ndarray:
        """What all of `kernels` are called with, on memory of others: y, rows, J, weights, H."""
        given = dict(zip(kernels.slopes.names, (self._models, self._tapes, *memory)))
        return kernels.slopes.form.words(given, self._known)

    @functools.cached_property
    def _words(self) -> np.ndarray:
        return self.words(self.y, self._rows, self._J, self._weights, self._H)

    def _call(self, kernel: Kernel) -> Bound:
        given = self._models, self._tapes, self.y, self._rows, self._J, self._weights, self._H
        if self._is_compiled:
            return kernel.form.bind(self._words, given)
        return kernel.bind(*given)

    @functools.cached_property
    def _values(self) -> Bound:
        return self._call(kernels.values)

    @functools.cached_property
    def _slopes(self) -> Bound:
        return self._call(kernels.entries if self.parts else kernels.slopes)

    @functools.cached_property
    def _sums(self) -> Bound:
        return self._call(kernels.sums)

    def values(self, y: np.ndarray) -> np.ndarray:
        """Rows at y, shape (rows,), in memory that the next call overwrites; without derivatives."""
        key = y.tobytes()
        if key != self._values_at:
            self._values_at = self._slopes_at = b""
            self.y[:] = y
            self._values()
            if self.parts:
                x = y * self._scale
                for part in self.parts:
                    part.add(self._rows, part.values(x))
            self._values_at = key
        return self._rows

    def slopes(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows at y; entries of their Jacobian, as long as `row`; and the matrix, or of a large one the cost's row.

        In memory that the next call overwrites.
        """
        key = y.tobytes()
        if key != self._slopes_at:
            self._values_at = self._slopes_at = b""
            self.y[:] = y
            self._slopes()
            if self.parts:
                self._add_slopes(y * self._scale)
            self._values_at = self._slopes_at = key
        return self._rows, self._entry, self._J

    def _add_slopes(self, x: np.ndarray) -> None:
        """Adds what Python evaluates to what the kernel has left."""
        end = self._pieces.slopes
        for part in self.parts:
            values, J = part.slopes(x)
            part.add(self._rows, values)
            begin, end = end, end + len(J)
            self._entry[begin:end] = J
        self._sums()

    @functools.cached_property
    def where_hessian(self) -> tuple[np.ndarray, np.ndarray]:
        """Rows and columns of the entries of the Hessian, both halves of it; those at one place add up."""
        forms, columns = self._forms, [f.columns for f in self._formulas]
        found = [p.where_hessian() for p in self.parts]
        rows = forms.col[forms.i], *[c.repeat(len(c)) for c in columns], *[rows for rows, _ in found]
        cols = forms.col[forms.j], *[np.tile(c, len(c)) for c in columns], *[cols for _, cols in found]
        return np.concatenate(rows), np.concatenate(cols)

    @functools.cached_property
    def _hessian(self) -> Bound:
        return self._call(kernels.hessian)

    def hessian(self, y: np.ndarray, weights: np.ndarray, is_rough: bool = False) -> np.ndarray:
        """Entries of the Hessian of weights' rows, none of them NaN; where Python evaluates, roughly if wanted."""
        self.y[:], self._weights[:], found = y, weights, self._H
        self._hessian()
        if self.parts:
            x = y * self._scale
            of = [(p.rough_hessian if is_rough else p.hessian)(x, weights[p.places]) for p in self.parts]
            found = np.concatenate([found, *of])
        H = without_nan(found)
        H = H.copy() if H is found else H
        if self._is_scaled:
            rows, cols = self.where_hessian
            begin = len(self._forms.Q)
            H[begin:] *= self._scale[rows[begin:]] * self._scale[cols[begin:]]
        return H

    def empty_rows(self) -> np.ndarray:
        """Rows of linear forms without a coefficient."""
        begin, rows = self._forms.num_quadratic, joined([f.rows for f in self._linear], np.int64)
        counts = np.bincount(self._forms.row[begin:][self._forms.b[begin:] != 0.0], minlength=len(self._rows))
        return rows[counts[rows] == 0]
