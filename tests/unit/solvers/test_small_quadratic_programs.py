"""Small quadratic programs have one solution, to rounding, and the duals that Clarabel finds; or go to Clarabel."""

import numpy as np
import pytest

from sheldrake.solvers import (
    ClarabelSolver,
    MathematicalProgram,
    OsqpSolver,
    SolutionResult,
    Solve,
)
from sheldrake.solvers._engines import small_quadratic
from sheldrake.solvers._engines.equality import EqualityConstrainedQPSolver

KINDS = ["any", "whole numbers", "twice", "nearly parallel", "units", "flat", "equations", "boxes", "apart", "held"]
OURS = {"Active set", "EqConstrainedQP"}


def some_program(kind, seed, lib=None):
    """A program of a kind, and its constraints."""
    rng = np.random.default_rng([KINDS.index(kind), seed])
    n, m = int(rng.integers(1, 9)), int(rng.integers(1, 10))
    M, q, A, inside = rng.normal(size=(n, n)), 3.0 * rng.normal(size=n), rng.normal(size=(m, n)), rng.normal(size=n)
    Q, low, high = M @ M.T + 0.05 * np.eye(n), A @ inside - rng.random(m), A @ inside + rng.random(m)
    low[rng.random(m) < 0.4] = -np.inf
    if kind == "whole numbers":
        Q, q, A = np.eye(n), -rng.integers(0, 3, n).astype(float), rng.integers(-1, 2, (m, n)).astype(float)
        low, high = np.full(m, -np.inf), np.ones(m)
    elif kind == "twice":
        A, low, high = np.vstack((A, A[:1], 2.0 * A[-1:])), np.r_[low, low[0], 2 * low[-1]], np.r_[high, high[0], 9.0]
    elif kind == "nearly parallel":
        A = np.vstack((A, A + 10.0 ** rng.integers(-12, -2) * rng.normal(size=A.shape)))
        low, high = np.r_[low, low], np.r_[high, high]
    elif kind == "units":
        of_x, of_rows = 10.0 ** rng.integers(-3, 4, n), 10.0 ** rng.integers(-3, 4, m)
        Q, q, A, inside = Q * np.outer(of_x, of_x), q * of_x, A * of_x * of_rows[:, None], inside / of_x
        low, high = low * of_rows, high * of_rows
    elif kind in ("flat", "held"):
        Q = M[:, : n // 2] @ M[:, : n // 2].T
        if kind == "held":
            E = rng.normal(size=(n - n // 2, n))
            A, low, high = np.vstack((A, E)), np.r_[low, E @ inside], np.r_[high, E @ inside]
    elif kind == "equations":
        A = A[: min(m, n)]
        low = high = A @ inside
    elif kind == "apart":
        A, low, high = np.vstack((A, A[:1])), np.r_[low, high[0] + 0.1], np.r_[high, np.inf]
    prog = (lib.MathematicalProgram if lib else MathematicalProgram)()
    x = prog.NewContinuousVariables(n)
    prog.AddQuadraticCost(Q, q, 0.3, x, is_convex=True)
    prog.AddLinearCost(np.full(n, 0.1), 1.0, x)
    found = [] if kind == "boxes" else [prog.AddLinearConstraint(A, low, high, x)]
    if kind != "equations" and (kind == "boxes" or seed % 2):
        order = rng.permutation(n)
        below, above = rng.random(n), rng.random(n)
        size = np.abs(inside[order])
        found.append(
            prog.AddBoundingBoxConstraint(inside[order] - below * size, inside[order] + above * size, x[order])
        )
    if seed % 3 == 0:
        E = rng.normal(size=(1, n))
        found.append(prog.AddLinearEqualityConstraint(E, E @ inside, x))
    return prog, found


def compare(found, wanted, rows, wanted_rows, seed):
    """Solutions are the same to what an interior point method reaches with gaps of 1e-8.

    Where a row just does not press that is the root of it, for prices in units a thousand times as large too.
    """
    assert wanted.is_success(), seed
    scale = 1.0 + np.abs(wanted.get_x_val()).max()
    assert found.get_optimal_cost() == pytest.approx(wanted.get_optimal_cost(), rel=1e-6, abs=1e-6), seed
    np.testing.assert_allclose(found.get_x_val() / scale, wanted.get_x_val() / scale, atol=1e-4, err_msg=str(seed))
    for own, other in zip(rows, wanted_rows):
        dual, given = found.GetDualSolution(own), wanted.GetDualSolution(other)
        scale = 1.0 + np.abs(given).max()
        np.testing.assert_allclose(dual / scale, given / scale, atol=5e-3, err_msg=str(seed))


def residuals(prog, result):
    """What the conditions of optimality are missed by, each relative to its terms."""
    x, n = result.get_x_val(), prog.num_vars()
    slope, size, missed = np.zeros(n), np.zeros(n), 0.0
    for cost in prog.GetAllCosts():
        at, e = prog.FindDecisionVariableIndices(cost.variables()), cost.evaluator()
        if hasattr(e, "Q"):
            np.add.at(slope, at, e.Q() @ x[at] + e.b())
            np.add.at(size, at, abs(e.Q()) @ abs(x[at]) + abs(e.b()))
        else:
            np.add.at(slope, at, e.a())
            np.add.at(size, at, abs(e.a()))
    for row in prog.GetAllConstraints():
        at, e, dual = prog.FindDecisionVariableIndices(row.variables()), row.evaluator(), result.GetDualSolution(row)
        A, values = e.GetDenseA(), e.GetDenseA() @ x[at]
        np.add.at(slope, at, -A.T @ dual)
        np.add.at(size, at, abs(A.T) @ abs(dual))
        terms = abs(A).sum(axis=1) * abs(x).max() + 1e-300
        for value, low, high, price, term in zip(values, e.lower_bound(), e.upper_bound(), dual, terms):
            missed = max(missed, (low - value) / term, (value - high) / term)
            if price:  # a row with a price holds with equality, on the side that it is pressed to
                missed = max(missed, abs(value - (low if price > 0.0 else high)) / term if low != high else 0.0)
    return max(missed, abs(slope).max() / max(size.max(), 1e-300))


@pytest.mark.parametrize("kind", KINDS)
def test_small_programs_have_the_solutions_and_duals_of_clarabel(kind):
    ours = 0
    for seed in range(80):
        prog, rows = some_program(kind, seed)
        found, wanted = Solve(prog), ClarabelSolver().Solve(prog)
        if found.get_solver_id().name() in OURS:
            ours += 1
            compare(found, wanted, rows, rows, seed)
            assert residuals(prog, found) < 1e-9, seed
        else:
            assert found.get_solution_result() == wanted.get_solution_result(), seed
    assert ours > 20 or kind in ("flat", "apart")


def test_a_wrong_solution_is_found_out():
    prog, _ = some_program("any", 1)
    found = Solve(prog)
    assert found.get_solver_id().name() == "Active set" and residuals(prog, found) < 1e-12
    found.set_x_val(found.get_x_val() + 1e-6)
    assert residuals(prog, found) > 1e-8


def program_of(Q, q, *boxes):
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(len(q))
    prog.AddQuadraticCost(np.array(Q), np.array(q), x, is_convex=True)
    return prog, x, [prog.AddBoundingBoxConstraint(low, high, x) for low, high in boxes]


def test_who_solved_is_named_and_told_as_of_clarabel():
    prog, x, (box,) = program_of(np.eye(2), [-2.0, 0.5], (-1.0, 1.0))
    found = Solve(prog)
    assert found.get_solver_id().name() == "Active set"
    assert found.get_solver_details().status == "Solved" and found.get_solver_details().iterations == 1
    np.testing.assert_array_equal(found.GetSolution(x), [1.0, -0.5])
    np.testing.assert_array_equal(found.GetDualSolution(box), [-1.0, 0.0])
    assert found.get_optimal_cost() == -1.625
    for solver in (ClarabelSolver, OsqpSolver):
        assert solver().Solve(prog).get_solver_id() == solver.id()


@pytest.mark.parametrize("boxes", [[(-1.0, 1.0), (-1.0, 1.0)], [(-1.0, 1.0), (-1.0, 1.0 + 1e-9)]])
def test_duals_that_are_not_unique_are_those_of_clarabel(boxes):
    prog, _, rows = program_of(np.eye(2), [-2.0, 0.5], *boxes)
    found, wanted = Solve(prog), ClarabelSolver().Solve(prog)
    assert found.get_solver_id().name() == "Clarabel"
    for row in rows:
        np.testing.assert_array_equal(found.GetDualSolution(row), wanted.GetDualSolution(row))


@pytest.mark.parametrize(
    "Q, q, result",
    [
        (np.zeros((2, 2)), [1.0, 0.0], SolutionResult.kDualInfeasible),
        (np.diag([1.0, 0.0]), [1.0, 0.0], SolutionResult.kSolutionFound),
        (np.array([[1.0, 1.0], [1.0, 1.0 + 1e-13]]), [1.0, 1.0], SolutionResult.kSolutionFound),
    ],
)
def test_flat_costs_are_left_to_clarabel(Q, q, result):
    prog, *_ = program_of(Q, q, (-np.inf, 5.0))
    found = Solve(prog)
    assert found.get_solver_id().name() == "Clarabel" and found.get_solution_result() == result


def test_bounds_that_nothing_is_between_and_rows_of_zeros():
    prog, x, _ = program_of(np.eye(2), [1.0, 1.0])
    rows = prog.AddLinearConstraint(np.zeros((1, 2)), [-1.0], [1.0], x)
    assert Solve(prog).get_solver_id().name() == "Active set"
    rows.evaluator().set_bounds([1.0], [2.0])
    assert Solve(prog).get_solution_result() == SolutionResult.kInfeasibleConstraints
    rows.evaluator().set_bounds([np.inf], [np.inf])
    assert Solve(prog).get_solution_result() == ClarabelSolver().Solve(prog).get_solution_result()


def test_a_cost_that_is_not_convex_is_not_mended_by_others():
    prog, x, _ = program_of(np.eye(2), [1.0, 1.0])
    prog.AddQuadraticCost(np.diag([-0.5, 1.0]), np.zeros(2), x)
    assert not small_quadratic.solve_small(prog)
    assert Solve(prog).get_solver_id().name() not in OURS


def test_results_share_nothing():
    prog, x, (box,) = program_of(np.eye(2), [-2.0, 0.5], (-1.0, 1.0))
    first = Solve(prog)
    other, _, _ = program_of(2.0 * np.eye(2), [5.0, -5.0], (-2.0, 2.0))
    Solve(other)
    np.testing.assert_array_equal(first.GetSolution(x), [1.0, -0.5])
    np.testing.assert_array_equal(first.GetDualSolution(box), [-1.0, 0.0])
    box.evaluator().set_bounds(np.full(2, -3.0), np.full(2, 3.0))
    late = Solve(prog)
    prog.RemoveConstraint(box)
    np.testing.assert_array_equal(late.GetDualSolution(box), [0.0, 0.0])
    np.testing.assert_array_equal(late.GetSolution(x), [2.0, -0.5])


def test_variables_that_come_and_go_keep_their_places():
    prog = MathematicalProgram()
    a, b = prog.NewContinuousVariables(1, "a"), prog.NewContinuousVariables(1, "b")
    prog.AddQuadraticCost(np.eye(1), [-3.0], b)
    assert small_quadratic.solve_small(prog) is None  # a may be anything
    prog.RemoveDecisionVariable(a[0])
    found = Solve(prog)
    assert found.get_solver_id().name() in OURS and found.GetSolution(b) == [3.0]


def test_a_guess_of_another_size_is_refused():
    prog, *_ = program_of(np.eye(2), [1.0, 1.0], (-1.0, 1.0))
    with pytest.raises(ValueError, match="size 2"):
        Solve(prog, np.zeros(3))


def test_equations_are_solved_in_the_name_of_their_solver():
    prog, x, _ = program_of(np.eye(3), [1.0, 0.0, -1.0])
    row = prog.AddLinearEqualityConstraint(np.array([[1.0, 1.0, 1.0]]), [3.0], x)
    found, wanted = Solve(prog), EqualityConstrainedQPSolver().Solve(prog)
    assert found.get_solver_id() == wanted.get_solver_id() == EqualityConstrainedQPSolver.id()
    np.testing.assert_allclose(found.get_x_val(), wanted.get_x_val(), rtol=1e-14)
    np.testing.assert_allclose(found.GetDualSolution(row), wanted.GetDualSolution(row), rtol=1e-14)
    np.testing.assert_allclose(found.GetDualSolution(row), [1.0], rtol=1e-14)


def test_what_is_large_goes_elsewhere():
    n = small_quadratic._VARIABLES + 1
    prog, *_ = program_of(np.eye(n), np.ones(n), (-0.5, 0.5))
    assert Solve(prog).get_solver_id().name() == "Clarabel"
