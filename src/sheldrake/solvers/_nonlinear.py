"""Nonlinear programs by SciPy's SLSQP and trust-region interior point methods, under the names of other solvers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from sheldrake.solvers._highs import set_box_duals
from sheldrake.solvers._ids import SolutionResult, SolverOptions
from sheldrake.solvers._nonlinear_form import NonlinearForm
from sheldrake.solvers._program import MathematicalProgram
from sheldrake.solvers._program_type import NONLINEAR
from sheldrake.solvers._result import MathematicalProgramResult
from sheldrake.solvers._solver_interface import SolverInterface


class Outcome:
    """Where a method stopped."""

    def __init__(self, y: np.ndarray, converged: bool, iterations_spent: bool, message: str):
        self.y, self.converged, self.iterations_spent, self.message = y, converged, iterations_spent, message


class Settings:
    """Tolerances and limits that all methods share."""

    def __init__(
        self, optimality: float = 1e-9, feasibility: float = 1e-6, iterations: int = 1000, prints: bool = False
    ):
        self.optimality, self.feasibility, self.iterations, self.prints = optimality, feasibility, iterations, prints


def slsqp(form: NonlinearForm, start: np.ndarray, settings: Settings) -> Outcome:
    """Sequential least squares programming (Kraft, 1988)."""
    from scipy.optimize import Bounds, minimize

    equal = form.lower == form.upper
    above, below = ~equal & np.isfinite(form.lower), ~equal & np.isfinite(form.upper)

    def inequality(y: np.ndarray) -> np.ndarray:
        g = form.constraints(y)[0]
        return np.concatenate((g[above] - form.lower[above], form.upper[below] - g[below]))

    def inequality_slope(y: np.ndarray) -> np.ndarray:
        J = form.constraints(y)[1]
        return np.vstack((J[above], -J[below]))

    constraints: list[dict[str, Any]] = []
    if equal.any():
        constraints.append(
            {
                "type": "eq",
                "fun": lambda y: form.constraints(y)[0][equal] - form.lower[equal],
                "jac": lambda y: form.constraints(y)[1][equal],
            }
        )
    if above.any() or below.any():
        constraints.append({"type": "ineq", "fun": inequality, "jac": inequality_slope})
    found = minimize(
        lambda y: form.cost(y)[0],
        start,
        jac=lambda y: form.cost(y)[1],
        method="SLSQP",
        bounds=Bounds(form.x_lower, form.x_upper),
        constraints=constraints,
        callback=form.show if form._callbacks else None,
        options={"maxiter": settings.iterations, "ftol": settings.optimality, "disp": settings.prints},
    )
    # Status 8: no descent along the last direction, as happens at the limit of rounding.
    return Outcome(found.x, found.status in (0, 8), found.status == 9, found.message)


def trust_constr(form: NonlinearForm, start: np.ndarray, settings: Settings) -> Outcome:
    """A trust-region interior point method (Byrd, Hribar and Nocedal, 1999) with quasi-Newton Hessians."""
    import warnings

    from scipy.optimize import BFGS, Bounds, NonlinearConstraint, minimize

    constraints = []
    if form.num_rows:
        constraints.append(
            NonlinearConstraint(
                lambda y: form.constraints(y)[0],
                form.lower,
                form.upper,
                jac=lambda y: form.constraints(y)[1],
                hess=BFGS(),
            )
        )

    def callback(y: np.ndarray, state: Any) -> bool:
        form.show(y)
        return False

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = minimize(
            lambda y: form.cost(y)[0],
            start,
            jac=lambda y: form.cost(y)[1],
            hess=BFGS(),
            method="trust-constr",
            bounds=Bounds(form.x_lower, form.x_upper),
            constraints=constraints,
            callback=callback if form._callbacks else None,
            options={"maxiter": settings.iterations, "gtol": 1e-8, "xtol": 1e-10, "verbose": 2 * settings.prints},
        )
    return Outcome(found.x, found.status in (1, 2), found.status == 0, found.message)


class _NonlinearSolver(SolverInterface):
    """SLSQP, and the trust-region method where SLSQP stops at a point that is not feasible or not a minimum."""

    _attributes = frozenset(NONLINEAR)
    _methods: tuple[Callable[..., Outcome], ...] = (slsqp, trust_constr)

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        form = NonlinearForm(prog)
        settings = self._read(options)
        if np.any(form.x_lower > form.x_upper) or np.any(form.lower > form.upper):
            result._finish(SolutionResult.kInfeasibleConstraints, guess, np.inf)
            self._tell(form, np.nan_to_num(guess), None, result)
            return
        y, outcome = form.start(guess), None
        with np.errstate(all="ignore"):
            for method in self._methods:
                outcome = method(form, y, settings)
                candidate = np.clip(outcome.y, form.x_lower, form.x_upper)
                y = candidate if np.isfinite(candidate).all() else y
                if outcome.converged and form.violation(y) <= settings.feasibility:
                    break
            self._conclude(form, y, outcome, settings, result)

    def _conclude(self, form: Any, y: np.ndarray, outcome: Any, settings: Settings, result: Any) -> None:
        cost, violation = form.cost(y)[0], form.violation(y)
        if violation > settings.feasibility:
            spent = outcome.iterations_spent
            kind = SolutionResult.kIterationLimit if spent else SolutionResult.kInfeasibleConstraints
        elif cost < -1e15 or np.isnan(cost):
            kind = SolutionResult.kUnbounded
        elif outcome.converged:
            kind = SolutionResult.kSolutionFound
        else:
            kind = SolutionResult.kIterationLimit if outcome.iterations_spent else SolutionResult.kSolverSpecificError
        result._finish(kind, y * form.scale, cost)
        self._tell(form, y, outcome, result)
        if kind is SolutionResult.kSolutionFound:
            dual, low, high = form.multipliers(y)
            for row in form.rows:
                if row.binding is not None:
                    result._set_dual(row.binding, dual[row.rows])
            set_box_duals(form.prog, result, low, high)

    def _read(self, options: SolverOptions) -> Settings:
        raise NotImplementedError

    def _tell(self, form: Any, y: np.ndarray, outcome: Any, result: MathematicalProgramResult) -> None:
        raise NotImplementedError


def _number(values: dict, key: str, default: float) -> float:
    return float(values.get(key, default))


class SnoptSolverDetails(NamedTuple):
    """What the solver tells of a solve: `info` is 1 for success, 13 for infeasible, 32 for too many iterations."""

    info: int
    solve_time: float
    xmul: Any
    F: Any
    Fmul: Any


_SNOPT_INFO = {
    SolutionResult.kSolutionFound: 1,
    SolutionResult.kInfeasibleConstraints: 13,
    SolutionResult.kUnbounded: 21,
    SolutionResult.kIterationLimit: 32,
}


class SnoptSolver(_NonlinearSolver):
    """Solves nonlinear programs. In sheldrake it is SLSQP of SciPy, a sequential quadratic programming method too.

    Options that are understood: "Major iterations limit", "Major optimality tolerance",
    "Major feasibility tolerance"; others are accepted without effect.
    """

    _name = "SNOPT"

    def _read(self, options: SolverOptions) -> Settings:
        given = options._of(self._name)
        return Settings(
            optimality=min(1e-9, _number(given, "Major optimality tolerance", 1e-6) * 1e-3),
            feasibility=_number(given, "Major feasibility tolerance", 1e-6),
            iterations=int(_number(given, "Major iterations limit", 1000)),
            prints=self._prints(options),
        )

    def _tell(self, form: Any, y: np.ndarray, outcome: Any, result: MathematicalProgramResult) -> None:
        F = np.concatenate(([form.cost(y)[0]], form.constraints(y)[0]))
        zeros = np.zeros(form.num_vars), np.zeros(len(F))
        info = _SNOPT_INFO.get(result.get_solution_result(), 41)
        result._details = SnoptSolverDetails(info, 0.0, zeros[0], F, zeros[1])


class IpoptSolverDetails(NamedTuple):
    """What the solver tells of a solve: `status` is 0 for success, 2 for infeasible, 1 for too many iterations."""

    status: int
    z_L: Any
    z_U: Any
    g: Any
    lambda_val: Any

    def ConvertStatusToString(self) -> str:
        """Returns the status as a word."""
        words = {0: "Success", 1: "Max iterations exceeded", 2: "Local infeasibility", 6: "Diverging iterates"}
        return words.get(self.status, "Unknown")


_IPOPT_STATUS = {
    SolutionResult.kSolutionFound: 0,
    SolutionResult.kIterationLimit: 1,
    SolutionResult.kInfeasibleConstraints: 2,
    SolutionResult.kUnbounded: 6,
}


class IpoptSolver(_NonlinearSolver):
    """Solves nonlinear programs. In sheldrake it is SLSQP of SciPy, then its trust-region interior point method.

    Options that are understood: "max_iter", "tol", "constr_viol_tol"; others are accepted without effect.
    """

    _name = "Ipopt"

    def _read(self, options: SolverOptions) -> Settings:
        given = options._of(self._name)
        return Settings(
            optimality=min(1e-9, _number(given, "tol", 1e-8)),
            feasibility=_number(given, "constr_viol_tol", 1e-6),
            iterations=int(_number(given, "max_iter", 1000)),
            prints=self._prints(options) or _number(given, "print_level", 0) > 0,
        )

    def _tell(self, form: Any, y: np.ndarray, outcome: Any, result: MathematicalProgramResult) -> None:
        g = form.constraints(y)[0]
        dual, low, high = form.multipliers(y)
        status = _IPOPT_STATUS.get(result.get_solution_result(), 5)
        result._details = IpoptSolverDetails(status, low, -high, g, -dual)


class NloptSolverDetails(NamedTuple):
    """What the solver tells of a solve: `status` is 4 for success, 5 for too many evaluations, -1 for failure."""

    status: int


class NloptSolver(_NonlinearSolver):
    """Solves nonlinear programs. In sheldrake it is SLSQP of SciPy, which is one of NLopt's algorithms too."""

    _name = "NLopt"

    @staticmethod
    def ConstraintToleranceName() -> str:
        """Returns the name of the option for the largest violation of a constraint."""
        return "constraint_tol"

    @staticmethod
    def XRelativeToleranceName() -> str:
        """Returns the name of the option for the least relative step."""
        return "xtol_rel"

    @staticmethod
    def XAbsoluteToleranceName() -> str:
        """Returns the name of the option for the least step."""
        return "xtol_abs"

    @staticmethod
    def MaxEvalName() -> str:
        """Returns the name of the option for the largest number of evaluations."""
        return "max_eval"

    @staticmethod
    def MaxTimeName() -> str:
        """Returns the name of the option for the longest time [s]."""
        return "max_time"

    @staticmethod
    def AlgorithmName() -> str:
        """Returns the name of the option for the algorithm."""
        return "algorithm"

    def _read(self, options: SolverOptions) -> Settings:
        given = options._of(self._name)
        return Settings(
            feasibility=_number(given, self.ConstraintToleranceName(), 1e-6),
            iterations=int(_number(given, self.MaxEvalName(), 1000)),
            prints=self._prints(options),
        )

    def _tell(self, form: Any, y: np.ndarray, outcome: Any, result: MathematicalProgramResult) -> None:
        kinds = {SolutionResult.kSolutionFound: 4, SolutionResult.kIterationLimit: 5}
        result._details = NloptSolverDetails(kinds.get(result.get_solution_result(), -1))
