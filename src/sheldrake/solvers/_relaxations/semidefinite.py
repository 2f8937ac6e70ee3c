"""Quadratic programs as semidefinite ones that are no harder to satisfy (Shor, 1987)."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import overload, overloaded
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.symbolic import Expression, Variable
from sheldrake.symbolic import _build as build


class SemidefiniteRelaxationOptions:
    """What a relaxation also says of products of constraints.

    Args:
        add_implied_linear_equality_constraints: Products of equations with variables.
        add_implied_linear_constraints: Products of inequalities with each other.
    """

    __fields__ = (
        SimpleNamespace(name="add_implied_linear_equality_constraints", type=bool),
        SimpleNamespace(name="add_implied_linear_constraints", type=bool),
    )

    def __init__(
        self, add_implied_linear_equality_constraints: bool = True, add_implied_linear_constraints: bool = True
    ):
        self.add_implied_linear_equality_constraints = add_implied_linear_equality_constraints
        self.add_implied_linear_constraints = add_implied_linear_constraints

    def set_to_strongest(self) -> None:
        """Says all that is implied."""
        self.add_implied_linear_equality_constraints = self.add_implied_linear_constraints = True

    def set_to_weakest(self) -> None:
        """Says nothing that is implied: Shor's relaxation."""
        self.add_implied_linear_equality_constraints = self.add_implied_linear_constraints = False

    def __repr__(self) -> str:
        return (
            "SemidefiniteRelaxationOptions(add_implied_linear_equality_constraints="
            f"{self.add_implied_linear_equality_constraints}, add_implied_linear_constraints="
            f"{self.add_implied_linear_constraints})"
        )


_ALLOWED = {
    "linear_costs",
    "quadratic_costs",
    "linear_constraints",
    "linear_equality_constraints",
    "bounding_box_constraints",
    "quadratic_constraints",
    "visualization_callbacks",
}


def _refuse_groups(*_given: Any) -> None:
    raise NotImplementedError("MakeSemidefiniteRelaxation(): variable_groups are not supported.")


@overloaded(
    overload(prog=instance_of(MathematicalProgram), options=(instance_of(SemidefiniteRelaxationOptions), None)),
    overload(
        _refuse_groups,
        prog=instance_of(MathematicalProgram),
        variable_groups=instance_of(list, tuple),
        options=(instance_of(SemidefiniteRelaxationOptions), None),
    ),
)
def MakeSemidefiniteRelaxation(
    prog: MathematicalProgram, options: SemidefiniteRelaxationOptions | None
) -> MathematicalProgram:
    """Returns a program in y and Y, with [Y, y; y', 1] positive semidefinite, where products y_i y_j are Y_ij.

    Args:
        prog: A program with linear and quadratic costs and constraints.
        options: What is added beyond the relaxation itself.

    Raises:
        RuntimeError: the program has other costs or constraints.
        NotImplementedError: groups of variables are given.
    """
    for name, bindings in prog._lists.items():
        if bindings and name not in _ALLOWED:
            raise RuntimeError(
                "MakeSemidefiniteRelaxation() does not (yet) support this program: it has "
                f"{name.replace('_', ' ')}, and only linear and quadratic costs and constraints can be relaxed."
            )
    return _Relaxation(prog, options or SemidefiniteRelaxationOptions()).program


class _Relaxation:
    def __init__(self, prog: MathematicalProgram, options: SemidefiniteRelaxationOptions):
        self._prog = prog
        self.program = prog.Clone()
        self._y = prog.decision_variables()
        n = len(self._y)
        one = Variable("one")
        self.program.AddDecisionVariables(np.array([one], dtype=object))
        self._Y = self.program.NewSymmetricContinuousVariables(n, "Y")
        X = np.empty((n + 1, n + 1), dtype=object)
        X[:n, :n], X[:n, n], X[n, :n], X[n, n] = self._Y, self._y, self._y, one
        self.program.AddPositiveSemidefiniteConstraint(X)
        self.program.AddLinearEqualityConstraint(one == 1)
        self._costs()
        self._quadratic_constraints()
        if options.add_implied_linear_constraints:
            self._inequalities()
        if options.add_implied_linear_equality_constraints:
            self._equations()

    def _lifted(self, Q: np.ndarray, b: np.ndarray, at: np.ndarray) -> Expression:
        """1/2 x' Q x + b' x with Y in the place of products."""
        terms = [0.5 * Q[i, j] * self._Y[at[i], at[j]] for i, j in zip(*np.nonzero(Q))]
        terms += [value * self._y[k] for k, value in zip(at, b) if value]
        return build.sum_of([build.as_expression(t) for t in terms])

    def _costs(self) -> None:
        for binding in self._prog.quadratic_costs():
            self.program.RemoveCost(binding)
            c = binding._evaluator
            self.program.AddLinearCost(self._lifted(c._Q, c._b, self._prog._indices(binding)) + c._c)

    def _quadratic_constraints(self) -> None:
        for binding in self._prog.quadratic_constraints():
            self.program.RemoveConstraint(binding)
            c = binding._evaluator
            e = self._lifted(c._Q, c._b, self._prog._indices(binding))
            self.program.AddLinearConstraint(e, c._lower[0], c._upper[0])

    def _rows(self, name: str) -> Any:
        """Rows of linear constraints over all variables, with their bounds."""
        for binding in self._prog._lists[name]:
            c = binding._evaluator
            block = c._jacobian(np.zeros(len(binding._variables)))
            A = np.zeros((len(block), len(self._y)))
            np.add.at(A, (slice(None), self._prog._indices(binding)), block)
            yield from zip(A, c._lower, c._upper)

    def _equations(self) -> None:
        """(a' y - b) y_j = 0."""
        rows = list(self._rows("linear_equality_constraints"))
        for j in range(len(self._y)):
            for a, b, _ in rows:
                terms = [a[i] * self._Y[i, j] for i in np.flatnonzero(a)]
                e = build.sum_of([build.as_expression(t) for t in terms]) - b * self._y[j]
                self.program.AddLinearEqualityConstraint(e, 0.0)

    def _inequalities(self) -> None:
        """Products of c_i - a_i' y >= 0, each pair once."""
        rows = []
        for name in ("bounding_box_constraints", "linear_constraints"):
            for a, low, high in self._rows(name):
                rows += [(-a, -low)] if np.isfinite(low) else []
                rows += [(a, high)] if np.isfinite(high) else []
        es, lower = [], []
        for i, (a, c) in enumerate(rows):
            for b, d in rows[i:]:
                M = np.outer(a, b)
                es.append(self._lifted(M + M.T, -d * a - c * b, np.arange(len(self._y))))
                lower.append(-c * d)
        kept = [k for k, e in enumerate(es) if len(e.GetVariables())]
        if kept:
            array = np.array([es[k] for k in kept], dtype=object)
            self.program.AddLinearConstraint(array, np.array(lower)[kept], np.full(len(kept), np.inf))
