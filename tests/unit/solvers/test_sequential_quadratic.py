"""Sequential quadratic programming: minima that are known, constraints that contradict each other, and when it runs."""

import numpy as np
import pytest

from sheldrake.solvers import MathematicalProgram, SnoptSolver, SolutionResult, Solve, SolverOptions
from sheldrake.solvers._engines.interior_point import Ending, interior_point
from sheldrake.solvers._engines.nonlinear import Settings
from sheldrake.solvers._engines.nonlinear_form import NonlinearForm
from sheldrake.solvers._engines.restoration import aside, restore
from sheldrake.solvers._engines.sqp import Sqp, suits
from sheldrake.symbolic import sin

# W. Hock and K. Schittkowski, Test Examples for Nonlinear Programming Codes (1981): number, cost, constraints with
# their bounds, bounds of variables, start, minimum.
INF = np.inf
PROBLEMS = {
    "6": (lambda x: (1 - x[0]) ** 2, lambda x: [10 * (x[1] - x[0] ** 2)], [0], [0], -INF, INF, [-1.2, 1], 0.0),
    "7": (
        lambda x: np.log(1 + x[0] ** 2) - x[1],
        lambda x: [(1 + x[0] ** 2) ** 2 + x[1] ** 2],
        [4],
        [4],
        -INF,
        INF,
        [2, 2],
        -(3**0.5),
    ),
    "26": (
        lambda x: (x[0] - x[1]) ** 2 + (x[1] - x[2]) ** 4,
        lambda x: [(1 + x[1] ** 2) * x[0] + x[2] ** 4],
        [3],
        [3],
        -INF,
        INF,
        [-2.6, 2, 2],
        0.0,
    ),
    "43": (
        lambda x: x[0] ** 2 + x[1] ** 2 + 2 * x[2] ** 2 + x[3] ** 2 - 5 * x[0] - 5 * x[1] - 21 * x[2] + 7 * x[3],
        lambda x: [
            8 - x[0] ** 2 - x[1] ** 2 - x[2] ** 2 - x[3] ** 2 - x[0] + x[1] - x[2] + x[3],
            10 - x[0] ** 2 - 2 * x[1] ** 2 - x[2] ** 2 - 2 * x[3] ** 2 + x[0] + x[3],
            5 - 2 * x[0] ** 2 - x[1] ** 2 - x[2] ** 2 - 2 * x[0] + x[1] + x[3],
        ],
        [0, 0, 0],
        [INF, INF, INF],
        -INF,
        INF,
        [0, 0, 0, 0],
        -44.0,
    ),
    "71": (
        lambda x: x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2],
        lambda x: [x[0] * x[1] * x[2] * x[3], x @ x],
        [25, 40],
        [INF, 40],
        1,
        5,
        [1, 5, 5, 1],
        17.0140173,
    ),
}


def program(cost, rows, lower, upper, low, high, start):
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(len(start), "x")
    prog.AddCost(cost, x)
    prog.AddConstraint(lambda z: np.array(rows(z)), np.array(lower, float), np.array(upper, float), x)
    prog.AddBoundingBoxConstraint(low, high, x)
    prog.SetInitialGuess(x, start)
    return prog, x


@pytest.mark.parametrize("number", PROBLEMS)
def test_minima_that_are_known(number):
    *given, least = PROBLEMS[number]
    prog, x = program(*given)
    result = Solve(prog)
    assert result.is_success() and result.get_solver_id().name() == "SQP"
    assert result.get_optimal_cost() == pytest.approx(least, abs=1e-6)
    found = result.GetSolution(x)
    beyond = np.maximum(np.array(given[2]) - given[1](found), given[1](found) - np.array(given[3]))
    assert beyond.max() <= 1e-6


def test_multipliers_put_the_gradient_together():
    *given, _ = PROBLEMS["43"]
    prog, x = program(*given)
    result = Solve(prog)
    z, h = result.GetSolution(x), 1e-6
    dual = result.GetDualSolution(prog.generic_constraints()[0])
    slope = np.array([(given[0](z + h * e) - given[0](z - h * e)) / (2 * h) for e in np.eye(4)])
    rows = np.array([(np.array(given[1](z + h * e)) - given[1](z - h * e)) / (2 * h) for e in np.eye(4)])
    np.testing.assert_allclose(rows @ dual, slope, atol=1e-4)


def test_linearized_constraints_that_contradict_each_other_may_be_missed():
    # At 0.1 a line says that x is at least 5.05, and bounds that it is at most 2.
    prog, _ = program(lambda z: z[0] ** 2, lambda z: [z[0] ** 2], [1], [INF], -2, 2, [0.1])
    outcome = Sqp(NonlinearForm(prog), np.array([0.1]), Settings()).run()
    assert outcome.converged and outcome.y == pytest.approx([1.0], abs=1e-6)


def test_what_has_no_solution_is_not_called_one():
    prog, _ = program(lambda z: z[0], lambda z: [z[0] ** 2 + 1], [0], [0], -9, 9, [3.0])
    assert not Sqp(NonlinearForm(prog), np.array([3.0]), Settings()).run().converged
    assert not Solve(prog).is_success()


def corner(cost, start):
    """x y = 1, z >= x^2 and a box: three of its bounds meet in (1/3, 3, 1/9)."""
    rows = (lambda z: [z[0] * z[1] - 1, z[2] - z[0] ** 2], [0, 0], [0, INF])
    return program(cost, *rows, -3, 3, start)[0]


def test_where_as_many_bounds_meet_as_there_are_variables_iterations_end():
    """There the quadratic program is all rounding, and one of an equation's two sides depends on the other."""
    start = np.ones(3)
    prog = corner(lambda z: z[0] ** 2 + z[1] * z[2] + z[2] ** 4, start)
    outcome = Sqp(NonlinearForm(prog), start, Settings()).run()
    assert outcome.converged and outcome.y == pytest.approx([1 / 3, 3, 1 / 9], abs=1e-9)
    assert Solve(prog).get_optimal_cost() == pytest.approx(1 / 9 + 1 / 3 + 1 / 9**4, abs=1e-9)


def test_a_corner_from_which_the_cost_falls_is_left():
    prog = corner(lambda z: z[1], [1 / 3, 3, 1 / 9])
    assert Solve(prog).get_optimal_cost() == pytest.approx(3**-0.5, abs=1e-6)


def test_a_limit_of_iterations_holds():
    *given, _ = PROBLEMS["71"]
    prog, _ = program(*given)
    outcome = Sqp(NonlinearForm(prog), np.array(given[-1], float), Settings(iterations=2)).run()
    assert outcome.iterations_spent and not outcome.converged
    options = SolverOptions()
    options.SetOption(SnoptSolver.id(), "Major iterations limit", 2)
    result = SnoptSolver().Solve(prog, None, options)
    assert result.get_solution_result() == SolutionResult.kIterationLimit


def test_programs_it_is_for():
    prog, x = program(*PROBLEMS["71"][:-1])
    assert suits(NonlinearForm(prog))
    known = MathematicalProgram()
    y = known.NewContinuousVariables(2, "y")
    known.AddConstraint(y[0] ** 2 * y[1] <= 1.0)
    assert suits(NonlinearForm(known))
    for _ in range(60):
        prog.AddLinearConstraint(x[0] + x[1], -1.0, 99.0)
    assert not suits(NonlinearForm(prog))


def test_a_program_may_solve_another_of_its_size():
    *given, least = PROBLEMS["71"]

    def cost(x):
        inner, _ = program(*given)
        assert Solve(inner).get_solver_id().name() == "SQP"
        return given[0](x)

    prog, _ = program(cost, *given[1:])
    result = Solve(prog)
    assert result.get_solver_id().name() == "SQP" and result.get_optimal_cost() == pytest.approx(least, abs=1e-6)


def test_what_is_not_finite_is_no_solution():
    prog, _ = program(lambda z: z[0] + np.nan, lambda z: [z[0] ** 2], [0], [1], -9, 9, [0.5])
    assert not Sqp(NonlinearForm(prog), np.array([0.5]), Settings()).run().converged


def far_from(center, least, start):
    """A program for a point that is at least so far from a center, inside of a box of half width 1."""
    return program(lambda z: z @ z, lambda z: [np.sum((z - center) ** 2)], [least], [INF], -1, 1, start)


def test_what_three_sides_find_to_be_infeasible_ends_without_other_methods():
    # The corner (-1, -1) is furthest of (1, 1), at a square of 8.
    prog, x = far_from(np.ones(2), 9.0, [-0.5, -0.4])
    result = Solve(prog)
    assert result.get_solution_result() == SolutionResult.kInfeasibleConstraints
    assert result.get_solver_id().name() == "SQP"
    np.testing.assert_allclose(result.GetSolution(x), [-1.0, -1.0], atol=1e-6)


def test_a_start_without_slope_is_left():
    # At the center the distance has no slope: only another side shows that there are points far enough.
    prog, x = far_from(np.zeros(2), 1.5, [0.0, 0.0])
    result = Solve(prog)
    assert result.is_success() and np.sum(result.GetSolution(x) ** 2) == pytest.approx(1.5, abs=1e-5)


def test_bounds_and_a_line_that_contradict_each_other():
    prog, x = far_from(np.zeros(3), 0.1, [0.3, 0.2, 0.1])
    prog.AddLinearConstraint(np.ones((1, 3)), [4.0], [9.0], x)
    result = Solve(prog)
    assert result.get_solution_result() == SolutionResult.kInfeasibleConstraints
    assert result.get_solver_id().name() == "SQP"


def test_a_violation_near_the_tolerance_is_not_called_clear():
    prog, _ = program(lambda z: z[0], lambda z: [z[0] ** 2], [-9], [-1e-5], -9, 9, [3.0])
    form = NonlinearForm(prog)
    assert not restore(form, np.array([3.0]), 1e-6).is_least
    assert restore(form, np.array([3.0]), 1e-8).is_least


def test_least_violations_inside_of_bounds_are_the_same_from_all_sides():
    prog, _ = program(
        lambda z: 0.0 * z[0], lambda z: [(z[0] - 3) ** 2 + z[1] ** 2, z[0]], [0, -5], [1, 0], -1, 1, [0.5, 0.9]
    )
    form = NonlinearForm(prog)
    found = [restore(form, aside(form, np.array([0.5, 0.9]), part), 1e-6) for part in (0.1, 0.3, 1.0)]
    assert all(one.confirms(found[0]) and (form.clip(one.y) == one.y).all() for one in found)
    # At (1, 0), the bound, the disk about (3, 0) is missed by 3, and the half plane by 1: more of squares elsewhere.
    assert found[0].squares == pytest.approx(10.0, rel=0.1)


def test_formulas_that_the_interior_point_method_satisfies_are_not_given_up():
    rng, solved = np.random.default_rng(5), 0
    for _ in range(46):
        a, b, start = 2.5 * rng.normal(size=2), rng.normal(), 2.0 * rng.normal(size=2)
        there = rng.uniform(-0.6, 0.6, 2)
        prog = MathematicalProgram()
        x = prog.NewContinuousVariables(2, "x")
        prog.AddCost((x[0] + 2.0 * x[1]) ** 4 + (x[1] - 1.0) ** 2)
        prog.AddConstraint(sin(a.dot(x) + b) + x[0] ** 2 == np.sin(a @ there + b) + there[0] ** 2)
        prog.AddConstraint(x.dot(x) <= there @ there + 0.01)
        form = NonlinearForm(prog)
        with np.errstate(all="ignore"):
            *_, ending = interior_point(form, form.start(start), 1e-8, 1e-6, 1000)
        if ending is Ending.CONVERGED:
            solved += 1
            result = Solve(prog, start)
            assert result.is_success() and not result.GetInfeasibleConstraints(prog)
    assert solved > 25
