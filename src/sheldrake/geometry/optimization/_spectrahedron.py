"""The points that satisfy linear and semidefinite constraints."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import dispatch, overload
from sheldrake.geometry.optimization._affine import Affine, Rows
from sheldrake.geometry.optimization._convex_set import ConvexSet
from sheldrake.solvers import MathematicalProgram


class Spectrahedron(ConvexSet):
    """What satisfies the linear and semidefinite constraints of a program; made as `()` or `(prog)`.

    Raises:
        RuntimeError: the program has other constraints, or costs that are not linear.
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
        linear = [*prog.GetLinearConstraints(), *prog.bounding_box_constraints()]
        matrices, inequalities = prog.positive_semidefinite_constraints(), prog.linear_matrix_inequality_constraints()
        if len(prog.GetAllConstraints()) > len(linear) + len(matrices) + len(inequalities):
            raise RuntimeError("Spectrahedron(): the program has constraints that are neither linear nor semidefinite.")
        if others := {type(b.evaluator()).__name__ for b in prog.GetAllCosts()} - {"LinearCost"}:
            raise RuntimeError(
                f"Spectrahedron does not support MathematicalPrograms that have costs other than linear ones; found "
                f"{', '.join(sorted(others))}."
            )
        n = self._dimension
        for binding in linear:
            c = binding.evaluator()
            A = c._jacobian(np.zeros(c.num_vars()))
            self._linear.append(
                (np.array(prog.FindDecisionVariableIndices(binding.variables())), A, c.lower_bound(), c.upper_bound())
            )
        for matrix in matrices:
            rows = matrix.evaluator().matrix_rows()
            select = np.zeros((rows * rows, n))
            select[np.arange(rows * rows), prog.FindDecisionVariableIndices(matrix.variables())] = 1.0
            self._matrices.append((select, np.zeros(rows * rows), rows))
        for inequality in inequalities:
            F = inequality.evaluator().F()
            full = np.zeros((F[0].size, n))
            for place, M in zip(prog.FindDecisionVariableIndices(inequality.variables()), F[1:]):
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
