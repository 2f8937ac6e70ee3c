"""Nonlinear programs by sequential quadratic programming, under the names of other solvers."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from sheldrake.common._blas import one_thread
from sheldrake.solvers._engines.highs import set_box_duals
from sheldrake.solvers._engines.interface import SolverInterface
from sheldrake.solvers._engines.nonlinear_form import NonlinearForm
from sheldrake.solvers._engines.sqp import is_available as sqp_is_available
from sheldrake.solvers._engines.sqp import trust_region_sqp
from sheldrake.solvers._ids import SolutionResult, SolverOptions
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.solvers._program_type import NONLINEAR
from sheldrake.solvers._result import MathematicalProgramResult


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
            options={
                "maxiter": min(300, settings.iterations),
                "gtol": 1e-8,
                "xtol": 1e-10,
                "verbose": 2 * settings.prints,
            },
        )
    return Outcome(found.x, found.status in (1, 2), found.status == 0, found.message)


def restore(form: NonlinearForm, start: np.ndarray) -> np.ndarray:
    """A point near `start` with the least squares of violations, by a trust region (Branch, Coleman and Li, 1999)."""
    from scipy.optimize import least_squares

    free = form.x_lower < form.x_upper
    y = start.copy()

    def at(z: np.ndarray) -> np.ndarray:
        out = y.copy()
        out[free] = z
        return out

    # Its iterates are strictly inside of the bounds.
    low, high = form.x_lower[free], form.x_upper[free]
    inside = np.clip(start[free], np.nextafter(low, high), np.nextafter(high, low))
    found = least_squares(
        lambda z: form.excess(at(z))[0],
        inside,
        jac=lambda z: form.excess(at(z))[1][:, free],
        bounds=(low, high),
        max_nfev=200,
        xtol=1e-12,
        ftol=1e-14,
        gtol=1e-14,
    )
    return at(found.x)


def best_of(form: NonlinearForm, start: np.ndarray, settings: Settings) -> Outcome:
    """The trust-region SQP method if there is Clarabel to serve it; SLSQP without, or where that finds no way."""
    if not sqp_is_available():
        return by_slsqp(form, start, settings)
    found = Outcome(*trust_region_sqp(form, start, settings.feasibility, settings.iterations), "")
    if form.violation(found.y) <= settings.feasibility or found.iterations_spent:
        return found
    other = by_slsqp(form, start, settings)
    return other if form.violation(form.clip(other.y)) <= settings.feasibility else found


def by_slsqp(form: NonlinearForm, start: np.ndarray, settings: Settings) -> Outcome:
    """SLSQP; from a point that satisfies the constraints, if it does not find one; and the trust-region method where
    it stops short of a minimum.
    """
    outcome = slsqp(form, start, settings)
    for origin in (outcome.y, start):
        if np.isfinite(outcome.y).all() and form.violation(form.clip(outcome.y)) <= settings.feasibility:
            break
        if not form.num_rows or outcome.iterations_spent:
            return outcome
        y = restore(form, form.clip(np.where(np.isfinite(origin), origin, 0.0)))
        if form.violation(y) > settings.feasibility:
            outcome = Outcome(y, True, False, "no point near satisfies the constraints")
            continue
        outcome = slsqp(form, y, settings)
        if form.violation(form.clip(outcome.y)) > settings.feasibility:
            outcome = Outcome(y, False, False, outcome.message)
    if outcome.converged or outcome.iterations_spent:
        return outcome
    again = trust_constr(form, form.clip(outcome.y), settings)
    better = form.violation(form.clip(again.y)) <= settings.feasibility and again.converged
    return again if better else outcome


class _NonlinearSolver(SolverInterface):
    _attributes = frozenset(NONLINEAR)

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        form = NonlinearForm(prog)
        settings = self._read(options)
        if np.any(form.x_lower > form.x_upper) or np.any(form.lower > form.upper):
            result._finish(SolutionResult.kInfeasibleConstraints, guess, np.inf)
            self._tell(form, np.nan_to_num(guess), None, result)
            return
        start = form.start(guess)
        with np.errstate(all="ignore"), one_thread():
            outcome = best_of(form, start, settings)
            y = form.clip(outcome.y) if np.isfinite(outcome.y).all() else start
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
        result._cost = float(cost)  # That of the point where it stopped, feasible or not.
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
    """Solves nonlinear programs by sequential quadratic programming: a trust region and Clarabel, or SciPy's SLSQP.

    Options that are understood, in small letters or capitals: "Major iterations limit", "Major optimality tolerance",
    "Major feasibility tolerance"; others are accepted without effect.
    """

    _name = "SNOPT"

    def _read(self, options: SolverOptions) -> Settings:
        given = {key.lower(): value for key, value in options._of(self._name).items()}
        return Settings(
            optimality=min(1e-9, _number(given, "major optimality tolerance", 1e-6) * 1e-3),
            feasibility=_number(given, "major feasibility tolerance", 1e-6),
            iterations=int(_number(given, "major iterations limit", 1000)),
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
    """Solves nonlinear programs. In sheldrake it is the same method as that of SnoptSolver.

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
    """Solves nonlinear programs. In sheldrake it is the same method as that of SnoptSolver."""

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
        given = self._given(
            options,
            [
                self.ConstraintToleranceName(),
                self.XRelativeToleranceName(),
                self.XAbsoluteToleranceName(),
                self.MaxEvalName(),
                self.MaxTimeName(),
                self.AlgorithmName(),
            ],
        )
        return Settings(
            feasibility=_number(given, self.ConstraintToleranceName(), 1e-6),
            iterations=int(_number(given, self.MaxEvalName(), 1000)),
            prints=self._prints(options),
        )

    def _tell(self, form: Any, y: np.ndarray, outcome: Any, result: MathematicalProgramResult) -> None:
        kinds = {SolutionResult.kSolutionFound: 4, SolutionResult.kIterationLimit: 5}
        result._details = NloptSolverDetails(kinds.get(result.get_solution_result(), -1))
