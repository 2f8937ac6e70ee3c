"""DAQP's answers satisfy the conditions of optimality, duals included."""

import importlib.util

import numpy as np
import pytest

from sheldrake.solvers import (
    CommonSolverOption,
    DaqpSolver,
    GetAvailableSolvers,
    MakeSolver,
    MathematicalProgram,
    ProgramType,
    SolutionResult,
    SolverOptions,
)

installed = pytest.mark.skipif(importlib.util.find_spec("daqp") is None, reason="needs the package daqp")


def optimality_error(prog, result, x):
    """Largest violation of stationarity and of bounds; duals are derivatives of the cost by active bounds."""
    y = result.GetSolution(x)
    gradient = np.zeros(len(x))
    for b in prog.quadratic_costs():
        gradient += b.evaluator().Q() @ y + b.evaluator().b()
    for b in prog.linear_costs():
        gradient += b.evaluator().a()
    worst = 0.0
    for b in prog.GetAllConstraints():
        A, dual = b.evaluator().GetDenseA(), result.GetDualSolution(b)
        gradient -= A.T @ dual
        value = A @ y
        worst = max(worst, *(b.evaluator().lower_bound() - value), *(value - b.evaluator().upper_bound()))
        room_below, room_above = value - b.evaluator().lower_bound(), b.evaluator().upper_bound() - value
        worst = max(worst, *(np.minimum(room_below, 1.0) * np.maximum(dual, 0.0)))
        worst = max(worst, *(np.minimum(room_above, 1.0) * np.maximum(-dual, 0.0)))
    return max(worst, np.abs(gradient).max())


def chance_program(seed):
    rng = np.random.default_rng(seed)
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(6)
    L = rng.normal(size=(6, 6))
    prog.AddQuadraticCost(L @ L.T, 5.0 * rng.normal(size=6), x)
    prog.AddLinearCost(rng.normal(size=6), 2.0, x)
    prog.AddLinearConstraint(rng.normal(size=(3, 6)), np.full(3, -np.inf), np.full(3, 0.3), x)
    prog.AddLinearEqualityConstraint(rng.normal(size=(1, 6)), [0.1], x)
    prog.AddBoundingBoxConstraint(-0.4, 0.5, x)
    return prog, x


@installed
@pytest.mark.parametrize("seed", range(5))
def test_solutions_and_duals_are_optimal(seed):
    prog, x = chance_program(seed)
    result = DaqpSolver().Solve(prog)
    assert result.is_success() and result.get_solver_id() == DaqpSolver.id()
    assert optimality_error(prog, result, x) < 1e-7
    assert result.get_solver_details().exitflag == 1
    moved = DaqpSolver().Solve(prog)  # the oracle sees another point, and other duals
    moved.set_x_val(moved.get_x_val() + 1e-4)
    assert optimality_error(prog, moved, x) > 1e-5


@installed
def test_how_a_solve_ends_is_told():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2)
    prog.AddQuadraticCost(np.eye(2), np.zeros(2), x)
    prog.AddLinearConstraint(x[0] >= 1)
    few = SolverOptions()
    few.SetOption(DaqpSolver.id(), "iter_limit", 0)
    assert DaqpSolver().Solve(prog, None, few).get_solution_result() is not SolutionResult.kSolutionFound
    assert DaqpSolver().Solve(prog).get_optimal_cost() == pytest.approx(0.5)
    prog.AddLinearConstraint(x[0] <= 0)
    assert DaqpSolver().Solve(prog).get_solution_result() is SolutionResult.kInfeasibleConstraints


@installed
def test_options_that_it_does_not_know_are_refused_and_common_ones_taken():
    prog, _ = chance_program(0)
    options = SolverOptions()
    options.SetOption(CommonSolverOption.kPrintToConsole, 0)
    assert DaqpSolver().Solve(prog, None, options).is_success()
    options.SetOption(DaqpSolver.id(), "iteration_limit", 3)
    with pytest.raises(RuntimeError, match=r"iteration_limit.*iter_limit"):
        DaqpSolver().Solve(prog, None, options)


def test_it_says_what_it_cannot_solve_and_what_to_install(monkeypatch):
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(1)
    prog.AddLinearCost(x[0])
    assert "QuadraticCost is required" in DaqpSolver().ExplainUnsatisfiedProgramAttributes(prog)
    prog.AddQuadraticCost(-x[0] * x[0])
    assert "non-convex" in DaqpSolver().ExplainUnsatisfiedProgramAttributes(prog)
    assert isinstance(MakeSolver(DaqpSolver.id()), DaqpSolver)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name, *rest: None)
    assert not DaqpSolver().available() and DaqpSolver.id() not in GetAvailableSolvers(ProgramType.kQP)
    with pytest.raises(ValueError, match="pip install"):
        DaqpSolver().Solve(chance_program(0)[0])
