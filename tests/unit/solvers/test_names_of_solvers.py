"""A result names what found it."""

import numpy as np
import pytest

from sheldrake.solvers import (
    ClarabelSolver,
    ClpSolver,
    CsdpSolver,
    GetAvailableSolvers,
    MathematicalProgram,
    MobyLcpSolver,
    ProgramType,
    SolverId,
    UnrevisedLemkeSolver,
)
from sheldrake.solvers._engines.equality import LinearSystemSolver


def linear():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2)
    prog.AddBoundingBoxConstraint(0.0, 1.0, x)
    prog.AddLinearCost(x[0] - x[1])
    return prog


def large():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(100)
    prog.AddBoundingBoxConstraint(0.0, 1.0, x)
    prog.AddLinearCost(np.ones(100), 0.0, x)
    return prog


def complementary():
    prog = MathematicalProgram()
    prog.AddLinearComplementarityConstraint(np.eye(2), np.array([-1.0, 2.0]), prog.NewContinuousVariables(2))
    return prog


def system():
    prog = MathematicalProgram()
    prog.AddLinearEqualityConstraint(prog.NewContinuousVariables(1)[0] == 2.0)
    return prog


def semidefinite():
    prog = MathematicalProgram()
    X = prog.NewSymmetricContinuousVariables(2)
    prog.AddPositiveSemidefiniteConstraint(X)
    prog.AddLinearEqualityConstraint(X[0, 0] + X[1, 1] == 1)
    prog.AddCost(X[0, 1] + 3.0)
    return prog


def test_of_csdp_the_answer_is_told_in_its_words():
    pytest.importorskip("clarabel")
    result = CsdpSolver().Solve(semidefinite())
    assert result.get_optimal_cost() == pytest.approx(2.5, abs=1e-6)
    details = result.get_solver_details()
    assert details.return_code == 0 and details.y_val is None
    # CSDP maximizes the negative of the cost; Drake's wheel says the same.
    assert details.primal_objective == pytest.approx(-2.5, abs=1e-6)
    assert details.dual_objective == pytest.approx(-2.5, abs=1e-6)
    assert CsdpSolver().available() and CsdpSolver.id() not in GetAvailableSolvers(ProgramType.kLP)
    never = semidefinite()
    never.AddLinearConstraint(never.decision_variables()[0] <= -1.0)
    assert CsdpSolver().Solve(never).get_solver_details().return_code == 1


def test_clp_solves_quadratic_costs_that_are_convex():
    pytest.importorskip("clarabel")
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2)
    cost = prog.AddQuadraticCost([[1.0, 0.0], [0.0, 2.0]], [1.0, -1.0], x)
    row = prog.AddLinearConstraint([[1.0, 1.0]], [0.5], [np.inf], x)
    result = ClpSolver().Solve(prog)
    np.testing.assert_allclose(result.GetSolution(x), [-1.0 / 3.0, 5.0 / 6.0], atol=1e-6)
    np.testing.assert_allclose(result.GetDualSolution(row), [2.0 / 3.0], atol=1e-6)
    assert result.get_solver_details().status == 0 and result.get_solver_id() == ClarabelSolver.id()
    prog.AddLinearConstraint([[1.0, 1.0]], [-np.inf], [0.0], x)
    assert ClpSolver().Solve(prog).get_solver_details().status == 1
    cost.evaluator().UpdateCoefficients([[1.0, 0.0], [0.0, -2.0]], [1.0, -1.0])
    with pytest.raises(ValueError, match=r"ClpSolver is unable .* non-convex"):
        ClpSolver().Solve(prog)


@pytest.mark.parametrize(
    ("solver", "make", "ran"),
    [
        (CsdpSolver, semidefinite, ClarabelSolver.id()),
        (ClpSolver, linear, SolverId("Simplex")),
        (ClpSolver, large, SolverId("HiGHS")),
        (MobyLcpSolver, complementary, UnrevisedLemkeSolver.id()),
        (UnrevisedLemkeSolver, complementary, UnrevisedLemkeSolver.id()),
        (LinearSystemSolver, system, LinearSystemSolver.id()),
    ],
)
def test_results_name_what_ran(solver, make, ran):
    result = solver().Solve(make())
    assert result.is_success() and result.get_solver_id() == ran
