"""Nonlinear programs by IPOPT (Waechter and Biegler, 2006), through the package ipyopt."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from sheldrake.solvers._engines.interface import is_installed
from sheldrake.solvers._engines.nonlinear import Multipliers, NonlinearSolver, Outcome, Settings, number
from sheldrake.solvers._engines.nonlinear_form import NonlinearForm
from sheldrake.solvers._ids import SolutionResult, SolverOptions


class _Status(NamedTuple):
    """How IPOPT's main program calls an ending; how its algorithm numbers it; a word for it."""

    application: int
    algorithm: int
    word: str


_ENDINGS = {
    s.application: s
    for s in (
        _Status(0, 0, "Success"),
        _Status(1, 4, "Stop at acceptable point"),
        _Status(2, 5, "Local infeasibility"),
        _Status(3, 3, "Stop at tiny step"),
        _Status(4, 8, "Diverging iterates"),
        _Status(5, 6, "User requested stop"),
        _Status(6, 7, "Feasible point found"),
        _Status(-1, 1, "Max iteration exceeded"),
        _Status(-2, 9, "Restoration failure"),
        _Status(-3, 10, "Error in step computation"),
        _Status(-4, 2, "CPU time exceeded"),
        _Status(-5, 17, "Wall time exceeded"),
        _Status(-10, 12, "Too few degrees of freedom"),
        _Status(-12, 13, "Invalid option"),
        _Status(-13, 11, "Invalid number detected"),
    )
}
_INTERNAL_ERROR = 15
_CONVERGED, _SPENT = (0, 4, 7), (1, 2, 17)


class IpoptSolverDetails(NamedTuple):
    """What the solver tells of a solve: IPOPT's status, 0 for success, and its multipliers of bounds and of rows."""

    status: int
    z_L: np.ndarray
    z_U: np.ndarray
    g: np.ndarray
    lambda_val: np.ndarray

    def ConvertStatusToString(self) -> str:
        """Returns the status as a word."""
        return next((s.word for s in _ENDINGS.values() if s.algorithm == self.status), "Internal error")


class _Calls:
    """What IPOPT calls: values and derivatives of a form at y.

    Attributes:
        half: Which entries of the Hessian are in its lower half.
        failures: Errors, kept until IPOPT has come back, since it cannot pass them on.
    """

    def __init__(self, form: NonlinearForm, start: np.ndarray):
        self._form, self._seen = form, start
        self.half = np.flatnonzero(form.H_rows >= form.H_cols)
        self.failures: list[Exception] = []

    def kept(self, evaluate: Callable[..., Any]) -> Callable[..., Any]:
        """A call that keeps the error it fails with; it and all later ones give nan then."""

        def call(*given: Any) -> Any:
            if not self.failures:
                try:
                    return evaluate(*given)
                except Exception as error:
                    self.failures.append(error)
            if len(given) > 1:
                given[-1][:] = np.nan
            return np.nan

        return call

    def cost(self, y: np.ndarray) -> float:
        self._seen = y.copy()
        return self._form.values(y)[0]

    def gradient(self, y: np.ndarray, out: np.ndarray) -> None:
        out[:] = self._form.cost(y)[1]

    def rows(self, y: np.ndarray, out: np.ndarray) -> None:
        out[:] = self._form.values(y)[1]

    def jacobian(self, y: np.ndarray, out: np.ndarray) -> None:
        out[:] = self._form.constraints(y)[1]

    def hessian(self, y: np.ndarray, multipliers: np.ndarray, cost_weight: float, out: np.ndarray) -> None:
        out[:] = self._form.hessian(y, cost_weight, multipliers)[self.half]

    def watch(self, *_: object) -> bool:
        """Shows the last point; whether IPOPT is to go on."""
        if not self.failures:
            self._form.show(self._seen)
        return not self.failures


class IpoptSolver(NonlinearSolver):
    """Solves nonlinear programs by IPOPT; stands on the package ipyopt, for which there are wheels for Linux.

    All options of IPOPT are handed over. Second derivatives are exact for costs and constraints that know theirs, and
    learned for others.
    """

    _name = "Ipopt"

    @classmethod
    def _is_available(cls) -> bool:
        return is_installed("ipyopt")

    def _why_not_available(self) -> str:
        return (
            "stands on the package ipyopt, which is not installed (pip install sheldrake[nlp]; on Linux). Solve() "
            "needs no package."
        )

    def _read(self, options: SolverOptions) -> Settings:
        given = dict(options._of(self._name))
        return Settings(
            feasibility=max(1e-6, number(given, "constr_viol_tol", 1e-6)),
            prints=self._prints(options),
            more=given,
        )

    def _run(self, form: NonlinearForm, start: np.ndarray, settings: Settings) -> Outcome:
        import ipyopt

        calls = _Calls(form, start)
        given = {
            "print_level": 5 if settings.prints else 0,
            "sb": "yes",
            "bound_relax_factor": 1e-10,  # More would show in rows that depend strongly on a variable at its bound.
            "constr_viol_tol": 1e-6,
            **(settings.more or {}),
        }
        y = start.copy()
        dual, low, high = np.zeros(form.num_rows), np.zeros(form.num_vars), np.zeros(form.num_vars)
        problem = ipyopt.Problem(
            form.num_vars,
            form.x_lower.copy(),
            form.x_upper.copy(),
            form.num_rows,
            form.lower.copy(),
            form.upper.copy(),
            (form.J_rows, form.J_cols),
            (form.H_rows[calls.half], form.H_cols[calls.half]),
            calls.kept(calls.cost),
            calls.kept(calls.gradient),
            calls.kept(calls.rows),
            calls.kept(calls.jacobian),
            calls.kept(calls.hessian),
            intermediate_callback=calls.watch,
            ipopt_options=given,
        )
        y, _, application = problem.solve(y, mult_g=dual, mult_x_L=low, mult_x_U=high)
        if calls.failures:
            raise calls.failures[0]
        status = _ENDINGS[application].algorithm if application in _ENDINGS else _INTERNAL_ERROR
        return Outcome(self._name, y, status in _CONVERGED, status in _SPENT, -dual, status)

    def _details(
        self, kind: SolutionResult, outcome: Outcome, seconds: float, F: np.ndarray, multipliers: Multipliers
    ) -> IpoptSolverDetails:
        assert outcome.status is not None
        return IpoptSolverDetails(outcome.status, multipliers.low, -multipliers.high, F[1:], -multipliers.rows)
