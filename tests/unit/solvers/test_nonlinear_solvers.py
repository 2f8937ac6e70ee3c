"""Solvers of nonlinear programs: results say who found them."""

import copy
import importlib.util

import numpy as np
import pytest

from sheldrake import solvers
from sheldrake.solvers import (
    ChooseBestSolver,
    GetAvailableSolvers,
    IpoptSolver,
    MakeSolver,
    MathematicalProgram,
    NloptSolver,
    ProgramType,
    SnoptSolver,
    Solve,
    SolverOptions,
)
from sheldrake.symbolic import exp, sin


def program():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2, "x")
    prog.AddCost((x[0] - 2) ** 2 * exp(0.1 * x[1]) + (x[1] + 1) ** 4)
    disc = prog.AddConstraint(x[0] ** 2 + x[1] ** 2 <= 1.0)
    box = prog.AddBoundingBoxConstraint(-0.25, 3.0, x[1])
    prog.SetInitialGuess(x, [0.1, 0.1])
    return prog, disc, box


@pytest.mark.parametrize("solver, name", [(SnoptSolver, "SQP"), (IpoptSolver, "Ipopt"), (NloptSolver, "NLopt")])
def test_results_name_what_ran(solver, name):
    if not solver().available():
        pytest.skip("not installed")
    prog, disc, box = program()
    result = solver().Solve(prog)
    assert result.is_success() and result.get_solver_id().name() == name
    x = result.get_x_val()
    np.testing.assert_allclose(x, [np.sqrt(1 - 0.25**2), -0.25], atol=1e-5)
    # Both constraints hold it: their multipliers put the gradient of the cost together.
    grow = np.exp(0.1 * x[1])
    gradient = np.array([2 * (x[0] - 2) * grow, 0.1 * (x[0] - 2) ** 2 * grow + 4 * (x[1] + 1) ** 3])
    by_disc, by_box = result.GetDualSolution(disc)[0], result.GetDualSolution(box)[0]
    np.testing.assert_allclose(by_disc * 2 * x + [0.0, by_box], gradient, atol=1e-4)


def test_the_choice_and_what_is_available_are_what_runs():
    prog, _, _ = program()
    chosen = ChooseBestSolver(prog)  # the interior point method, which leaves small programs to another first
    found = Solve(prog).get_solver_id()
    assert found.name() == "SQP" and found == MakeSolver(chosen).Solve(prog).get_solver_id()
    others = prog.NewContinuousVariables(60)
    prog.AddCost(others.dot(others) ** 2)
    assert chosen == ChooseBestSolver(prog)
    assert chosen == Solve(prog).get_solver_id() == MakeSolver(chosen).Solve(prog).get_solver_id()
    names = [i.name() for i in GetAvailableSolvers(ProgramType.kNLP)]
    assert names[0] == "InteriorPoint" and "SNOPT" not in names
    assert ("Ipopt" in names) == (importlib.util.find_spec("ipyopt") is not None)
    assert ("NLopt" in names) == (importlib.util.find_spec("nlopt") is not None)
    assert SnoptSolver().available()


@pytest.mark.parametrize("solver, package", [(IpoptSolver, "ipyopt"), (NloptSolver, "nlopt")])
def test_without_their_packages_solvers_say_what_to_install(solver, package, monkeypatch):
    monkeypatch.setattr(solver, "_is_available", classmethod(lambda cls: False))
    with pytest.raises(ValueError, match=rf"{package}.*pip install sheldrake\[nlp\]"):
        solver().Solve(program()[0])


def test_details_are_what_the_solve_found():
    prog, _, _ = program()
    details = SnoptSolver().Solve(prog).get_solver_details()
    assert details.info == 1 and details.solve_time > 0.0
    np.testing.assert_allclose(details.F[1], 1.0, atol=1e-6)
    assert details.Fmul[1] < -0.1 and details.xmul[1] > 0.1
    contradiction = MathematicalProgram()
    x = contradiction.NewContinuousVariables(1, "x")
    contradiction.AddBoundingBoxConstraint(1.0, 0.0, x[0])
    contradiction.AddConstraint(sin(x[0]) <= 0.5)
    with pytest.raises(RuntimeError, match="details"):
        SnoptSolver().Solve(contradiction).get_solver_details()


def test_options_of_ipopt_reach_it():
    if not IpoptSolver().available():
        pytest.skip("not installed")
    prog, _, _ = program()
    options = SolverOptions()
    options.SetOption(IpoptSolver.id(), "max_iter", 1)
    result = IpoptSolver().Solve(prog, None, options)
    assert result.get_solution_result() is solvers.SolutionResult.kIterationLimit
    assert result.get_solver_details().ConvertStatusToString() == "Max iteration exceeded"


def test_algorithms_of_nlopt_are_chosen_by_name():
    if not NloptSolver().available():
        pytest.skip("not installed")
    prog, _, _ = program()
    prog.SetSolverOption(NloptSolver.id(), NloptSolver.AlgorithmName(), "LD_MMA")
    assert NloptSolver().Solve(prog).get_optimal_cost() == pytest.approx(Solve(prog).get_optimal_cost(), abs=1e-5)
    prog.SetSolverOption(NloptSolver.id(), NloptSolver.AlgorithmName(), "LD_NOTHING")
    with pytest.raises(RuntimeError, match="no algorithm 'LD_NOTHING'"):
        NloptSolver().Solve(prog)


@pytest.mark.parametrize("solver", [SnoptSolver, IpoptSolver, NloptSolver])
def test_errors_of_a_users_function_are_raised(solver):
    if not solver().available():
        pytest.skip("not installed")
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(1, "x")

    def fails(z):
        raise ZeroDivisionError("of the user")

    prog.AddCost(fails, x)
    with pytest.raises(ZeroDivisionError, match="of the user"):
        solver().Solve(prog, [0.5])


def test_duals_are_those_of_the_program_that_was_solved():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2, "x")
    prog.AddCost((x[0] - 2.0) ** 2 + (x[1] - 3.0) ** 4)
    loose, tight = prog.AddBoundingBoxConstraint(-9.0, 5.0, x), prog.AddBoundingBoxConstraint(-9.0, 1.0, x)
    row = prog.AddLinearConstraint(x[0] + x[1] <= 1.5)
    result = SnoptSolver().Solve(prog, np.zeros(2), None)
    copy_of_result = copy.deepcopy(result)
    prog.RemoveConstraint(row)
    tight.evaluator().UpdateUpperBound([7.0, 7.0])
    for found in (result, copy_of_result):
        np.testing.assert_allclose(found.GetDualSolution(loose), 0.0)
        # At (0.5, 1) the cost falls by 3 and 32 per unit; the row takes 3 of both, the bound of x(1) the rest.
        np.testing.assert_allclose(found.GetDualSolution(tight), [0.0, -29.0], rtol=1e-4)
        np.testing.assert_allclose(found.GetDualSolution(row), [-3.0], rtol=1e-4)


def test_programs_without_a_limit_cost_minus_infinity():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2, "x")
    prog.AddQuadraticCost(np.diag([1.0, -1.0]), np.ones(2), x, is_convex=False)
    result = SnoptSolver().Solve(prog, np.zeros(2), None)
    assert result.get_solution_result().name == "kUnbounded" and result.get_optimal_cost() == -np.inf


def test_details_and_duals_belong_to_the_time_of_the_solve():
    limit = 1.0
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(1, "x")
    prog.AddCost(lambda v: (v[0] - 3.0) ** 2, x)
    bound = prog.AddConstraint(lambda v: np.array([limit * v[0]]), [-1.0], [1.0], x)
    result = SnoptSolver().Solve(prog, np.zeros(1), None)
    limit = 5.0  # what is made of it when somebody asks must not see that
    assert result.GetDualSolution(bound)[0] == pytest.approx(-4.0, abs=1e-4)
    assert result.get_solver_details().F == pytest.approx([4.0, 1.0], abs=1e-5)
    assert copy.deepcopy(result).get_solver_details().info == 1
