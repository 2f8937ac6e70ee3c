"""Small dense linear programs say what HiGHS says of them, and prove it."""

import numpy as np
import pytest
from scipy.optimize import linprog

from sheldrake.solvers import ClpSolver, MathematicalProgram, Solve
from sheldrake.solvers._engines import highs, linear
from sheldrake.solvers._kernels.simplex import INFEASIBLE, OPTIMAL, UNBOUNDED, UNDECIDED

KINDS = ["any", "whole numbers", "cones", "units", "boxes", "equations", "too few directions", "degenerate"]


def some_program(kind, seed):
    rng = np.random.default_rng([KINDS.index(kind), seed])
    n, m = int(rng.integers(1, 7)), int(rng.integers(1, 25))
    c, A, b = rng.normal(size=n), rng.normal(size=(m, n)), rng.normal(0.5, 1.0, m)
    if kind == "whole numbers":
        c, A, b = (rng.integers(-2, 3, shape).astype(float) for shape in (n, (m, n), m))
        b += 1.0
    elif kind == "cones":
        b[:] = 0.0
    elif kind == "units":
        A, b = A * 10.0 ** rng.integers(-3, 4, n), abs(b)
    elif kind == "boxes":
        A, b = np.vstack((A, np.eye(n), -np.eye(n))), np.append(b + 1.0, np.ones(2 * n))
    elif kind == "equations":
        few = min(m, n) // 2
        A, b = np.vstack((A, -A[:few])), np.append(abs(b), -abs(b[:few]))
    elif kind == "too few directions":
        c, A, b = c * rng.integers(0, 2, n), A @ rng.normal(size=(n, n)) * rng.integers(0, 2, n), abs(b)
    elif kind == "degenerate":
        b = A @ rng.normal(size=n) + rng.integers(0, 2, m) * rng.random(m)
        c = A.T @ rng.integers(0, 3, m)
    return c, A, b


def by_highs(c, A, b):
    """Status and value; without its presolve, which may call empty what only has no limit."""
    found = linprog(-c, A_ub=A, b_ub=b, bounds=(None, None), method="highs", options={"presolve": False})
    return {0: OPTIMAL, 2: INFEASIBLE, 3: UNBOUNDED}.get(found.status, UNDECIDED), found.fun


@pytest.mark.parametrize("kind", KINDS)
def test_small_programs_are_solved_as_by_highs(kind):
    undecided = 0
    for seed in range(100):
        c, A, b = some_program(kind, seed)
        found, (status, cost) = linear._at_once(c, A, b), by_highs(c, A, b)
        undecided += found.status == UNDECIDED
        if found.status == UNDECIDED:
            continue
        assert found.status == status, seed
        assert (found.x is not None) == (status == OPTIMAL)
        if found.x is not None:
            assert c @ found.x == pytest.approx(-cost, rel=1e-7, abs=1e-7), seed
            assert np.all(A @ found.x <= b + 1e-11 * (abs(A) @ abs(found.x) + abs(b))), seed
    assert undecided <= 2


def test_all_outcomes_are_among_them():
    found = [linear._at_once(*some_program(kind, seed)).status for kind in KINDS for seed in range(30)]
    assert all(found.count(status) > 30 for status in (OPTIMAL, INFEASIBLE, UNBOUNDED))


def test_a_vertex_where_many_rows_meet_does_not_cycle():
    # E. M. L. Beale's example, on which the steepest columns alone go round for ever.
    A = np.vstack(([[0.25, -60.0, -0.04, 9.0], [0.5, -90.0, -0.02, 3.0], [0.0, 0.0, 1.0, 0.0]], -np.eye(4)))
    found = linear._at_once(np.array([0.75, -150.0, 0.02, -6.0]), A, np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]))
    np.testing.assert_allclose(found.x, [0.04, 0.0, 1.0, 0.0], atol=1e-14)


@pytest.mark.parametrize("gap, status", [(0.0, OPTIMAL), (1e-9, UNDECIDED), (1e-6, INFEASIBLE)])
def test_what_a_tolerance_decides_is_left_to_highs(gap, status):
    A, b = np.array([[1.0, 2.0], [-1.0, -2.0], [0.0, 1.0]]), np.array([1.0, -1.0 - gap, 1.0])
    assert linear._at_once(np.zeros(2), A, b).status == status
    assert linear.maximize(np.zeros(2), A, b).status == (INFEASIBLE if status == INFEASIBLE else OPTIMAL)


def test_rows_of_zeros_and_costs_of_free_variables():
    A, c = np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([1.0, 0.0])
    assert linear.maximize(c, A, np.array([-1.0, 2.0])).status == INFEASIBLE
    np.testing.assert_array_equal(linear.maximize(c, A, np.array([0.0, 2.0])).x, [2.0, 0.0])
    for sign in (-1.0, 1.0):
        assert linear.maximize(np.array([1.0, sign]), A, np.array([0.0, 2.0])).status == UNBOUNDED


def test_tiny_and_huge_numbers():
    for scale in (1e-12, 1.0, 1e12):
        c, A, b = some_program("boxes", 3)
        np.testing.assert_allclose(linear._at_once(scale * c, A, b).x, linear._at_once(c, A, b).x, rtol=1e-12)
        np.testing.assert_allclose(
            linear._at_once(c, scale * A, scale * b).x, linear._at_once(c, A, b).x, rtol=1e-9, atol=1e-12
        )


def test_large_programs_are_solved_too():
    rng = np.random.default_rng(0)
    A, c = rng.normal(size=(400, 40)), rng.normal(size=40)
    assert A.size > linear.SMALL
    found, (status, cost) = linear.maximize(c, A, np.ones(400)), by_highs(c, A, np.ones(400))
    assert found.status == status == OPTIMAL and c @ found.x == pytest.approx(-cost)


def some_mathematical_program(seed):
    """With rows, equations, one-sided and two-sided bounds, some of them twice; and its constraints."""
    rng = np.random.default_rng(seed)
    n, m, few = int(rng.integers(2, 6)), int(rng.integers(1, 8)), int(rng.integers(1, 3))
    prog = MathematicalProgram()
    x, inside = prog.NewContinuousVariables(n), rng.normal(size=n)
    A, E = rng.normal(size=(m, n)), rng.normal(size=(few, n))
    lower, upper = A @ inside - rng.random(m), A @ inside + rng.random(m)
    lower[rng.random(m) < 0.3] = -np.inf
    constraints = [
        prog.AddLinearConstraint(A, lower, upper, x),
        prog.AddLinearEqualityConstraint(E[:1], E[:1] @ inside, x),
        prog.AddBoundingBoxConstraint(inside - 2.0, inside + 2.0, x),
        prog.AddBoundingBoxConstraint(inside[:2] - [2.0, 0.5], inside[:2] + np.array([np.inf, 2.0]), x[:2]),
    ]
    prog.AddLinearCost(rng.normal(size=n), 0.7, x)
    return prog, constraints


@pytest.mark.parametrize("seed", range(60))
def test_mathematical_programs_have_the_solutions_and_duals_of_highs(seed, monkeypatch):
    prog, constraints = some_mathematical_program(seed)
    found = Solve(prog)
    monkeypatch.setattr(highs, "_solve_small", lambda *_: False)
    wanted = Solve(prog)
    assert found.get_solver_id().name() == "Simplex" and wanted.get_solver_id().name() == "HiGHS"
    assert found.is_success() and wanted.is_success()
    assert found.get_optimal_cost() == pytest.approx(wanted.get_optimal_cost(), abs=1e-7)
    np.testing.assert_allclose(found.get_x_val(), wanted.get_x_val(), atol=1e-6)
    for constraint in constraints:
        np.testing.assert_allclose(
            found.GetDualSolution(constraint), wanted.GetDualSolution(constraint), atol=1e-6, err_msg=str(constraint)
        )


@pytest.mark.parametrize("kind", ["no rows", "unbounded", "infeasible", "rows apart", "nothing"])
def test_programs_without_a_solution_say_what_highs_says(kind, monkeypatch):
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2)
    if kind != "nothing":
        prog.AddLinearCost(x[0] + 2.0)
    if kind == "unbounded":
        prog.AddLinearConstraint(x[0] + x[1] <= 1.0)
        prog.AddBoundingBoxConstraint(-1.0, 3.0, x[1])
    elif kind == "infeasible":
        prog.AddLinearConstraint(x[0] + x[1] >= 1.0)
        prog.AddBoundingBoxConstraint(0.0, 0.25, x)
    elif kind == "rows apart":
        prog.AddLinearConstraint(x[0] + x[1] >= 1.0)
        prog.AddLinearConstraint(2.0 * x[0] + 2.0 * x[1] <= 1.0)
    found = ClpSolver().Solve(prog)
    monkeypatch.setattr(highs, "_solve_small", lambda *_: False)
    wanted = ClpSolver().Solve(prog)
    assert found.get_solver_id().name() == "Simplex" and wanted.get_solver_id().name() == "HiGHS"
    assert found.get_solution_result() == wanted.get_solution_result()
    assert found.get_optimal_cost() == wanted.get_optimal_cost()
    assert found.get_solver_details() == wanted.get_solver_details()

    def missed(result):
        slacks = [c.evaluator().Eval(result.GetSolution(c.variables())) for c in prog.GetLinearConstraints()]
        bounds = [(c.evaluator().lower_bound(), c.evaluator().upper_bound()) for c in prog.GetLinearConstraints()]
        return sum(np.maximum(0.0, np.maximum(low - y, y - high)).sum() for y, (low, high) in zip(slacks, bounds))

    assert missed(found) == pytest.approx(missed(wanted), abs=1e-9)
    for box in prog.bounding_box_constraints():
        assert box.evaluator().CheckSatisfied(found.GetSolution(box.variables()))
