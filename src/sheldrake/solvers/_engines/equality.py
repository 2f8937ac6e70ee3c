"""Programs with linear equations alone: linear algebra solves them."""

from __future__ import annotations

import numpy as np

from sheldrake.solvers._engines.interface import SolverInterface
from sheldrake.solvers._ids import ProgramAttribute as A
from sheldrake.solvers._ids import SolutionResult, SolverOptions
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.solvers._program_type import quadratic_costs_are_convex
from sheldrake.solvers._result import MathematicalProgramResult


def equations(prog: MathematicalProgram) -> tuple[np.ndarray, np.ndarray]:
    """All linear equations as A x = b over all decision variables."""
    bindings = prog.linear_equality_constraints()
    rows = sum(b._evaluator.num_constraints() for b in bindings)
    M, rhs, at = np.zeros((rows, prog.num_vars())), np.zeros(rows), 0
    for b in bindings:
        m = b._evaluator.num_constraints()
        add_columns(
            M[at : at + m], parts_of(prog).bindings.places(b), b._evaluator._jacobian(np.zeros(len(b._variables)))
        )
        rhs[at : at + m] = b._evaluator._lower
        at += m
    return M, rhs


def add_columns(out: np.ndarray, places: np.ndarray, block: np.ndarray) -> None:
    """Adds the columns of a block at their places; a variable may be there several times."""
    for j, place in enumerate(places):
        out[:, place] += block[:, j]


def _required(solver: str, attribute: str) -> str:
    return f"{solver} is unable to solve because a {attribute} is required but has not been declared."


class LinearSystemSolver(SolverInterface):
    """Solves linear equations without a cost, in the least squares sense where there is no exact solution."""

    _name = "Linear system"
    _attributes = frozenset({A.kLinearEqualityConstraint})

    def _restriction(self, prog: MathematicalProgram) -> str:
        if prog.linear_equality_constraints():
            return ""
        return _required("LinearSystemSolver", "LinearEqualityConstraint")

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        M, rhs = equations(prog)
        x = np.linalg.lstsq(M, rhs, rcond=None)[0]
        fits = np.allclose(M @ x, rhs, rtol=1e-9, atol=1e-9 * max(1.0, np.abs(rhs).max(initial=0.0)))
        result._finish(SolutionResult.kSolutionFound if fits else SolutionResult.kInfeasibleConstraints, x, 0.0)


class EqualityConstrainedQPSolver(SolverInterface):
    """Solves convex quadratic costs under linear equations."""

    _name = "EqConstrainedQP"
    _attributes = frozenset({A.kLinearEqualityConstraint, A.kQuadraticCost, A.kLinearCost})

    def _restriction(self, prog: MathematicalProgram) -> str:
        if prog.num_vars() and not prog.quadratic_costs():
            if not prog.required_capabilities():
                return ""
            return _required("EqualityConstrainedQPSolver", "QuadraticCost")
        return (
            ""
            if quadratic_costs_are_convex(prog)
            else "EqualityConstrainedQPSolver is unable to solve because (at least) one quadratic cost is non-convex."
        )

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        n = prog.num_vars()
        tolerance = self._options(options, {"FeasibilityTol": 1e-12})["FeasibilityTol"]
        Q, c, constant = quadratic_objective(prog)
        M, rhs = equations(prog)
        m = len(rhs)
        # Karush-Kuhn-Tucker conditions; least squares choose among many solutions the shortest.
        K = np.block([[Q, -M.T], [M, np.zeros((m, m))]])
        found = np.linalg.lstsq(K, np.concatenate((-c, rhs)), rcond=None)[0] if n + m else np.zeros(0)
        x, dual = found[:n], found[n:]
        scale = max(1.0, np.abs(rhs).max(initial=0.0))
        if m and np.abs(M @ x - rhs).max() > max(tolerance, 1e-9) * scale:
            result._finish(SolutionResult.kInfeasibleConstraints, x, np.inf)
            return
        slope = Q @ x + c - M.T @ dual
        if np.abs(slope).max(initial=0.0) > 1e-8 * max(1.0, np.abs(c).max(initial=0.0)):
            result._finish(SolutionResult.kUnbounded, np.full(n, np.nan), -np.inf)
            return
        result._finish(SolutionResult.kSolutionFound, x, 0.5 * x @ Q @ x + c @ x + constant)
        at = 0
        for b in prog.linear_equality_constraints():
            rows = b._evaluator.num_constraints()
            result._set_dual(b, dual[at : at + rows])
            at += rows


def quadratic_objective(prog: MathematicalProgram) -> tuple[np.ndarray, np.ndarray, float]:
    """Q, c, constant with linear and quadratic costs adding up to 1/2 x' Q x + c' x + constant."""
    n = prog.num_vars()
    Q, c, constant = np.zeros((n, n)), np.zeros(n), 0.0
    for b in prog.quadratic_costs():
        at, cost = parts_of(prog).bindings.places(b), b._evaluator
        np.add.at(Q, (at[:, None], at[None, :]), cost._Q)
        np.add.at(c, at, cost._b)
        constant += cost._c
    for linear in prog.linear_costs():
        np.add.at(c, parts_of(prog).bindings.places(linear), linear.evaluator()._a)
        constant += linear.evaluator()._b
    return Q, c, constant
