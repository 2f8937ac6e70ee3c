"""Projected gradient descent."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sheldrake.solvers._engines.interface import Engine, SolverInterface, option_name
from sheldrake.solvers._engines.nonlinear_form import NonlinearForm
from sheldrake.solvers._ids import ProgramAttribute as A
from sheldrake.solvers._ids import SolutionResult, SolverOptions
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.solvers._result import MathematicalProgramResult


class ProjectedGradientDescentSolver(Engine):
    """Steps along the negative gradient, each put back to the nearest point that satisfies the constraints."""

    _name = "PGD"
    _attributes = frozenset(A) - {A.kBinaryVariable}
    kDefaultConvergenceTol = 1e-12
    kDefaultMaxIterations = 1000
    kDefaultMaxLineSearchSteps = 100
    kDefaultBacktrackingC = 0.5
    kDefaultBacktrackingTau = 0.5
    kDefaultBacktrackingAlpha0 = 0.1

    def __init__(self) -> None:
        self._gradient: Callable | None = None
        self._projection: Callable | None = None
        self._interface: SolverInterface | None = None

    ConvergenceTolOptionName = option_name("ConvergenceTol", "the length of a step that ends it")
    MaxIterationsOptionName = option_name("MaxIterations", "the largest number of steps")
    BacktrackingCOptionName = option_name("BacktrackingC", "the part of the expected decrease that is asked for")
    BacktrackingTauOptionName = option_name("BacktrackingTau", "the factor by which a step is made shorter")
    BacktrackingAlpha0OptionName = option_name("BacktrackingAlpha0", "the first factor of the gradient")

    def SetCustomGradientFunction(self, custom_gradient_function: Callable) -> None:
        """Sets what gives the gradient at x."""
        self._gradient = custom_gradient_function

    def SetCustomProjectionFunction(self, custom_projection_function: Callable) -> None:
        """Sets what gives (success, nearest feasible point) for x."""
        self._projection = custom_projection_function

    def SetProjectionSolverInterface(self, projection_solver_interface: SolverInterface) -> None:
        """Sets the solver that finds nearest feasible points."""
        self._interface = projection_solver_interface

    def _project(self, prog: MathematicalProgram, x: np.ndarray) -> tuple[bool, np.ndarray]:
        if self._projection is not None:
            success, y = self._projection(x)
            return bool(success), np.asarray(y, dtype=float).ravel()
        if prog.CheckSatisfied(prog.GetAllConstraints(), x, 0.0):
            return True, x
        from sheldrake.solvers._engines.choose import Solve

        nearest = prog.Clone()
        for b in nearest.GetAllCosts():
            nearest.RemoveCost(b)
        nearest.AddQuadraticErrorCost(np.eye(x.size), x, nearest.decision_variables())
        found = Solve(nearest, x) if self._interface is None else SolverInterface.Solve(self._interface, nearest, x)
        return found.is_success(), found.get_x_val()

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        given = self._options(
            options,
            {
                "ConvergenceTol": self.kDefaultConvergenceTol,
                "MaxIterations": self.kDefaultMaxIterations,
                "BacktrackingC": self.kDefaultBacktrackingC,
                "BacktrackingTau": self.kDefaultBacktrackingTau,
                "BacktrackingAlpha0": self.kDefaultBacktrackingAlpha0,
            },
        )
        form = NonlinearForm(prog, is_scaled=False)
        success, x = self._project(prog, np.nan_to_num(guess))
        outcome = SolutionResult.kIterationLimit
        for _ in range(int(given["MaxIterations"])):
            if not success:
                break
            f, gradient = form.cost(x)
            if self._gradient is not None:
                gradient = np.asarray(self._gradient(x), dtype=float).ravel()
            success, step = self._project(prog, self._line_search(form, x, f, gradient, given))
            if success:
                length = float(np.linalg.norm(step - x))
                x = step
                if length < given["ConvergenceTol"]:
                    outcome = SolutionResult.kSolutionFound
                    break
        if not success:
            outcome = SolutionResult.kInfeasibleConstraints
        result._finish(outcome, x, form.cost(x)[0])

    def _line_search(
        self, form: NonlinearForm, x: np.ndarray, f: float, gradient: np.ndarray, given: dict
    ) -> np.ndarray:
        """A point along the negative gradient where the cost is enough less (Armijo's rule); constraints come after."""
        alpha, square = given["BacktrackingAlpha0"], float(gradient @ gradient)
        for _ in range(self.kDefaultMaxLineSearchSteps):
            if form.values(x - alpha * gradient)[0] <= f - given["BacktrackingC"] * alpha * square:
                break
            alpha *= given["BacktrackingTau"]
        return x - alpha * gradient
