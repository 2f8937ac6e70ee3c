"""Nonlinear programs by the library NLopt (Johnson, 2007), through its package."""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import numpy as np

from sheldrake.solvers._engines.interface import is_installed, option_name
from sheldrake.solvers._engines.nonlinear import Multipliers, NonlinearSolver, Outcome, Settings, number
from sheldrake.solvers._engines.nonlinear_form import NonlinearForm
from sheldrake.solvers._ids import SolutionResult, SolverOptions

_LEAST_PROGRESS, _SPENT = (1, 2, 3, 4), (5, 6)
_FAILURE = -1


@functools.cache
def _names_of_options() -> list[str]:
    calls = [call for call in dir(NloptSolver) if call.endswith("Name") and call != "SolverName"]
    return [getattr(NloptSolver, call)() for call in calls]


def _algorithm(name: str) -> int:
    import nlopt

    algorithm = getattr(nlopt, name, None)
    if not isinstance(algorithm, int) or name[:2] not in ("LD", "LN", "GD", "GN", "AU"):
        raise RuntimeError(f"NLopt: there is no algorithm {name!r}; names are those of NLopt, such as LD_SLSQP.")
    return algorithm


def _set_params(problem: Any, given: dict[str, Any], prefix: str) -> None:
    """Hands on the options whose names begin with a prefix."""
    for name, value in given.items():
        if name.startswith(prefix):
            problem.set_param(name.removeprefix(prefix), float(value))


def _set_tolerances(problem: Any, given: dict[str, Any], prefix: str = "") -> None:
    for name, default in (("xtol_rel", 1e-6), ("xtol_abs", 1e-6), ("ftol_rel", 0.0), ("ftol_abs", 0.0)):
        getattr(problem, f"set_{name}")(number(given, prefix + name, default))


class NloptSolverDetails(NamedTuple):
    """What the solver tells of a solve: NLopt's status, above 0 for success, 5 for too many evaluations."""

    status: int


class NloptSolver(NonlinearSolver):
    """Solves nonlinear programs by NLopt; stands on the package nlopt. Its matrices are dense.

    Options are those whose names its functions return; the algorithm is named as in NLopt, "LD_SLSQP" if absent.
    """

    _name = "NLopt"

    @classmethod
    def _is_available(cls) -> bool:
        return is_installed("nlopt")

    def _why_not_available(self) -> str:
        return "stands on the package nlopt, which is not installed (pip install sheldrake[nlp])."

    ConstraintToleranceName = option_name("constraint_tol", "the largest violation of a constraint")
    XRelativeToleranceName = option_name("xtol_rel", "the least relative step")
    XAbsoluteToleranceName = option_name("xtol_abs", "the least step")
    MaxEvalName = option_name("max_eval", "the largest number of evaluations")
    MaxTimeName = option_name("max_time", "the longest time [s]")
    AlgorithmName = option_name("algorithm", "the algorithm")
    FRelativeToleranceName = option_name("ftol_rel", "the least relative change of the cost")
    FAbsoluteToleranceName = option_name("ftol_abs", "the least change of the cost")
    StopValName = option_name("stopval", "a cost that is good enough to stop at")

    @staticmethod
    def ParamPrefix() -> str:
        """Returns what the names of options begin with that go to the algorithm as they are, after it."""
        return "nlopt_param:"

    LocalOptimizerAlgorithmName = option_name(
        "local_optimizer_algorithm", "the algorithm that solves subproblems, where there are any"
    )
    LocalOptimizerXRelativeToleranceName = option_name(
        "local_optimizer_xtol_rel", "the least relative step in a subproblem"
    )
    LocalOptimizerXAbsoluteToleranceName = option_name("local_optimizer_xtol_abs", "the least step in a subproblem")
    LocalOptimizerFRelativeToleranceName = option_name(
        "local_optimizer_ftol_rel", "the least relative change of the cost in a subproblem"
    )
    LocalOptimizerFAbsoluteToleranceName = option_name(
        "local_optimizer_ftol_abs", "the least change of the cost in a subproblem"
    )
    LocalOptimizerMaxEvalName = option_name(
        "local_optimizer_max_eval", "the largest number of evaluations in a subproblem"
    )
    LocalOptimizerMaxTimeName = option_name("local_optimizer_max_time", "the longest time of a subproblem [s]")

    @staticmethod
    def LocalOptimizerParamPrefix() -> str:
        """Returns what the names of options begin with that go to the algorithm of subproblems."""
        return "local_optimizer_param:"

    def _read(self, options: SolverOptions) -> Settings:
        prefixes = self.ParamPrefix(), self.LocalOptimizerParamPrefix()
        known = [name for name in options._of(self._name) if name.startswith(prefixes)]
        given = self._given(options, [*_names_of_options(), *known])
        return Settings(
            feasibility=max(1e-6, number(given, "constraint_tol", 1e-6)),
            iterations=int(number(given, "max_eval", 1000)),
            prints=self._prints(options),
            more=given,
        )

    def _run(self, form: NonlinearForm, start: np.ndarray, settings: Settings) -> Outcome:
        import nlopt

        given = settings.more or {}
        problem = nlopt.opt(_algorithm(given.get("algorithm", "LD_SLSQP")), form.num_vars)
        functions, shows = form.functions, form.has_callbacks
        functions.y[:] = start

        def cost(y: np.ndarray, slope: np.ndarray) -> float:
            if not slope.size:
                return functions.values(y).item(0)  # type: ignore[no-any-return]
            rows, _, J = functions.slopes(y)
            slope[:] = J[0]
            if shows:
                form.show(y)
            return rows.item(0)  # type: ignore[no-any-return]

        problem.set_min_objective(cost)
        problem.set_lower_bounds(form.x_lower)
        problem.set_upper_bounds(form.x_upper)
        tolerance = number(given, "constraint_tol", 1e-6)
        equal = form.lower == form.upper
        self._constrain(problem.add_equality_mconstraint, form, np.flatnonzero(equal), None, tolerance)
        above, below = (np.flatnonzero(~equal & np.isfinite(bound)) for bound in (form.lower, form.upper))
        self._constrain(problem.add_inequality_mconstraint, form, below, above, tolerance)
        _set_tolerances(problem, given)
        problem.set_maxeval(settings.iterations)
        problem.set_maxtime(number(given, "max_time", 0.0))
        problem.set_stopval(number(given, "stopval", -np.inf))
        _set_params(problem, given, self.ParamPrefix())
        if local := given.get("local_optimizer_algorithm", ""):
            problem.set_local_optimizer(self._local_optimizer(local, form.num_vars, given))
        try:
            y = problem.optimize(start)
            status = problem.last_optimize_result()
        except Exception as error:  # NLopt's own: rounding stops it, or there are more equations than variables.
            if "nlopt" not in f"{type(error).__module__} {error}".lower():
                raise  # a user's function raised it
            y, status = functions.y.copy(), _FAILURE
        return Outcome(self._name, y, status in _LEAST_PROGRESS, status in _SPENT, None, status)

    def _local_optimizer(self, name: str, num_vars: int, given: dict[str, Any]) -> Any:
        """What solves the subproblems of algorithms that have such."""
        import nlopt

        local = nlopt.opt(_algorithm(name), num_vars)
        _set_tolerances(local, given, "local_optimizer_")
        local.set_maxeval(max(0, int(number(given, "local_optimizer_max_eval", 0))))
        local.set_maxtime(max(0.0, number(given, "local_optimizer_max_time", 0.0)))
        _set_params(local, given, self.LocalOptimizerParamPrefix())
        return local

    @staticmethod
    def _constrain(
        add: Any, form: NonlinearForm, below: np.ndarray, above: np.ndarray | None, tolerance: float
    ) -> None:
        """Rows `below` are kept below their upper bounds, or at them; rows `above` above their lower ones."""
        lower = np.zeros(0, dtype=int) if above is None else above
        size = len(below) + len(lower)
        if not size:
            return

        places = np.concatenate((below, lower)) + 1
        sign = np.repeat((1.0, -1.0), (len(below), len(lower)))
        bounds, column = np.concatenate((form.upper[below], -form.lower[lower])), sign[:, None]

        def excess(out: np.ndarray, y: np.ndarray, slopes: np.ndarray) -> None:
            if slopes.size:
                rows, J = form.dense(y)
                np.multiply(J[places], column, out=slopes)
            else:
                rows = form.functions.values(y)
            np.subtract(sign * rows[places], bounds, out=out)

        add(excess, np.full(size, tolerance))

    def _details(
        self, kind: SolutionResult, outcome: Outcome, seconds: float, F: np.ndarray, multipliers: Multipliers
    ) -> NloptSolverDetails:
        assert outcome.status is not None
        return NloptSolverDetails(outcome.status)
