"""The points that satisfy linear and semidefinite constraints."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import dispatch, overload
from sheldrake.geometry.optimization._affine import Affine, Rows
from sheldrake.geometry.optimization._convex_set import ConvexSet
from sheldrake.solvers import MathematicalProgram

_LINEAR = ("linear_constraints", "linear_equality_constraints", "bounding_box_constraints")
_MATRIX = "positive_semidefinite_constraints"
_INEQUALITY = "linear_matrix_inequality_constraints"


class Spectrahedron(ConvexSet):
    """What satisfies the linear and semidefinite constraints of a program; made as `()` or `(prog)`.

    Raises:
        RuntimeError: the program has other constraints.
    """

    def __init__(self, *args: Any, **kwargs: Any):
        ways = [
            overload(lambda self: self._set(None)),
            overload(Spectrahedron._set, prog=instance_of(MathematicalProgram)),
        ]
        dispatch("Spectrahedron", ways, self, args, kwargs)

    def _set(self, prog: MathematicalProgram | None) -> None:
        self._linear: list[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]] = []
        self._matrices: list[tuple[np.ndarray, np.ndarray, int]] = []
        self._dimension = 0 if prog is None else prog.num_vars()
        if prog is None:
            return
        if any(
            prog._lists[k]
            for k in prog._lists
            if k.endswith("constraints") and k not in (*_LINEAR, _MATRIX, _INEQUALITY)
        ):
            raise RuntimeError("Spectrahedron(): the program has constraints that are neither linear nor semidefinite.")
        n = self._dimension
        for kind in _LINEAR:
            for binding in prog._lists[kind]:
                c = binding.evaluator()
                A = c._jacobian(np.zeros(c.num_vars()))
                self._linear.append((prog._indices(binding), A, c.lower_bound(), c.upper_bound()))
        for binding in prog._lists[_MATRIX]:
            rows = binding.evaluator().matrix_rows()
            select = np.zeros((rows * rows, n))
            select[np.arange(rows * rows), prog._indices(binding)] = 1.0
            self._matrices.append((select, np.zeros(rows * rows), rows))
        for binding in prog._lists[_INEQUALITY]:
            F = binding.evaluator().F()
            full = np.zeros((F[0].size, n))
            for place, M in zip(prog._indices(binding), F[1:]):
                full[:, place] += M.ravel()
            self._matrices.append((full, F[0].ravel(), F[0].shape[0]))

    def _contain(self, into: Rows, x: Affine, scale: Affine) -> None:
        for places, A, lower, upper in self._linear:
            e = A @ x[places]
            if np.array_equal(lower, upper):
                into.equal(e - scale.times(lower))
            else:
                into.within(lower, e, upper, scale)
        for A, b, rows in self._matrices:
            into.semidefinite(A @ x + scale.times(b), rows)
        into.nonnegative(scale)

    def _contains(self, x: np.ndarray, tol: float) -> bool:
        for places, A, lower, upper in self._linear:
            e = A @ x[places]
            if np.any(e < lower - tol) or np.any(e > upper + tol):
                return False
        return all(np.linalg.eigvalsh((A @ x + b).reshape(n, n)).min() >= -tol for A, b, n in self._matrices)
