"""Branch and bound against trying all; ordered sets, relaxations and projections by what they promise."""

import itertools

import numpy as np
import pytest

from sheldrake.solvers import (
    AddBilinearProductMcCormickEnvelopeSos2,
    AddLogarithmicSos1Constraint,
    AddLogarithmicSos2Constraint,
    AugmentedLagrangianNonsmooth,
    AugmentedLagrangianSmooth,
    ClarabelSolver,
    ClpSolver,
    IntervalBinning,
    MakeSemidefiniteRelaxation,
    MathematicalProgram,
    MixedIntegerBranchAndBound,
    ProjectedGradientDescentSolver,
    SemidefiniteRelaxationOptions,
    SolutionResult,
    Solve,
)
from sheldrake.solvers._relaxations.special_ordered_sets import gray_code
from sheldrake.symbolic import Expression, Variables


@pytest.mark.parametrize("seed", range(3))
def test_branch_and_bound_finds_what_trying_all_finds(seed):
    rng = np.random.default_rng(seed)
    prog = MathematicalProgram()
    b = prog.NewBinaryVariables(5, "b")
    c, weights = rng.normal(size=5), rng.uniform(0.2, 1, size=5)
    prog.AddLinearCost(c, 0.0, b)
    prog.AddLinearConstraint(weights.reshape(1, -1), [0.8], [1.6], b)
    search = MixedIntegerBranchAndBound(prog, ClpSolver.id())
    assert search.Solve() is SolutionResult.kSolutionFound
    allowed = [v for v in itertools.product((0, 1), repeat=5) if 0.8 <= weights @ v <= 1.6]
    best = min(allowed, key=lambda v: c @ v)
    np.testing.assert_array_equal(search.GetSolution(b), best)
    assert search.GetOptimalCost() == pytest.approx(c @ best)
    assert Solve(prog).get_optimal_cost() == pytest.approx(c @ best)  # HiGHS


def test_neighbouring_gray_codes_differ_in_one_place():
    codes = gray_code(4)
    assert len({tuple(c) for c in codes}) == 16
    assert (np.abs(np.diff(codes, axis=0)).sum(axis=1) == 1).all()


def test_weights_of_ordered_sets():
    prog = MathematicalProgram()
    weights, y = AddLogarithmicSos1Constraint(prog, 6)
    prog.AddLinearCost(-weights[4] + 0.1 * weights[2])
    result = Solve(prog)
    np.testing.assert_allclose(result.GetSolution(weights), np.eye(6)[4], atol=1e-7)
    np.testing.assert_array_equal(result.GetSolution(y), gray_code(3)[4])
    prog = MathematicalProgram()
    weights = prog.NewContinuousVariables(5, "l")
    AddLogarithmicSos2Constraint(prog, weights)
    prog.AddLinearCost(-weights[0] - weights[3])
    prog.AddLinearConstraint(weights[0] <= 0.9)
    x = Solve(prog).GetSolution(weights)
    assert x.sum() == pytest.approx(1) and np.flatnonzero(x > 1e-6).size <= 2
    assert np.ptp(np.flatnonzero(x > 1e-6)) <= 1


@pytest.mark.parametrize("binning", [IntervalBinning.kLinear, IntervalBinning.kLogarithmic])
def test_products_are_exact_at_corners(binning):
    prog = MathematicalProgram()
    x, y, w = prog.NewContinuousVariables(3, "v")
    count = 2 if binning is IntervalBinning.kLinear else 1
    Bx, By = prog.NewBinaryVariables(count, "Bx"), prog.NewBinaryVariables(count, "By")
    grid = [0.0, 1.0, 3.0]
    AddBilinearProductMcCormickEnvelopeSos2(prog, x, y, Expression(w), grid, grid, Bx, By, binning)
    prog.AddLinearConstraint(x == 1)
    prog.AddLinearConstraint(y == 3)
    prog.AddLinearCost(w)
    assert Solve(prog).GetSolution(w) == pytest.approx(3)


def test_relaxations_bound_from_below():
    pytest.importorskip("clarabel")
    prog = MathematicalProgram()
    y = prog.NewContinuousVariables(2, "y")
    prog.AddQuadraticCost(-(y[0] ** 2) + y[0] * y[1])
    prog.AddConstraint(y.dot(y) <= 1)
    relaxed = Solve(MakeSemidefiniteRelaxation(prog)).get_optimal_cost()
    values = [-(np.cos(t) ** 2) + np.cos(t) * np.sin(t) for t in np.linspace(0, np.pi, 2001)]
    assert relaxed == pytest.approx(min(values), abs=1e-5)  # exact for one quadratic constraint
    weak = SemidefiniteRelaxationOptions()
    weak.set_to_weakest()
    assert Solve(MakeSemidefiniteRelaxation(prog, weak)).get_optimal_cost() <= relaxed + 1e-6
    prog.AddConstraint(y[0] ** 3 <= 1)
    with pytest.raises(RuntimeError, match="generic constraints"):
        MakeSemidefiniteRelaxation(prog)


def test_convex_quadratic_constraints_may_be_kept():
    pytest.importorskip("clarabel")
    prog = MathematicalProgram()
    y = prog.NewContinuousVariables(2, "y")
    prog.AddQuadraticCost(-(y[0] ** 2) + y[0] * y[1])
    prog.AddConstraint(y.dot(y) + y[0] <= 1)
    prog.AddConstraint(-y.dot(y) >= -3)
    prog.AddConstraint(y[0] ** 2 - y[1] ** 2 <= 0.5)  # not convex
    options = SemidefiniteRelaxationOptions()
    assert not options.preserve_convex_quadratic_constraints
    assert not MakeSemidefiniteRelaxation(prog, options).rotated_lorentz_cone_constraints()
    options.set_to_strongest()
    relaxed = MakeSemidefiniteRelaxation(prog, options)
    cones = relaxed.rotated_lorentz_cone_constraints()
    assert [list(b.variables()) == list(y) for b in cones] == [True, True]
    for point in np.random.default_rng(0).normal(size=(50, 2)):
        holds = [b.evaluator().CheckSatisfied(point) for b in cones]
        assert holds == [point @ point + point[0] <= 1, point @ point <= 3]
    assert Solve(relaxed).get_optimal_cost() == pytest.approx(
        Solve(MakeSemidefiniteRelaxation(prog)).get_optimal_cost(), abs=1e-6
    )


def test_augmented_lagrangians_agree_at_the_best_slacks():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2, "x")
    prog.AddCost(x[0] ** 2 + x[1])
    prog.AddConstraint(x[0] * x[1] >= 0.1)
    prog.AddConstraint(x[0] + x[1] ** 2 <= 3)
    smooth, nonsmooth = AugmentedLagrangianSmooth(prog, False), AugmentedLagrangianNonsmooth(prog, False)
    at, multipliers, mu = np.array([0.4, 0.2]), np.array([0.3, 0.1]), 2.0
    value, c, cost = nonsmooth.Eval(at, multipliers, mu)
    slack = np.maximum(c - multipliers / mu, 0)
    assert smooth.Eval(at, slack, multipliers, mu)[0] == pytest.approx(value)
    assert cost == pytest.approx(0.36)


def test_projections_and_gradients_may_be_given():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2, "x")
    prog.AddCost((x[0] - 1) ** 2 + (x[1] + 1) ** 2)
    prog.AddBoundingBoxConstraint(0, 10, x)
    solver = ProjectedGradientDescentSolver()
    seen = []
    solver.SetCustomGradientFunction(lambda v: seen.append(v) or 2 * (v - np.array([1, -1])))
    solver.SetCustomProjectionFunction(lambda v: (True, np.maximum(v, 0)))
    result = solver.Solve(prog, [3.0, 3.0])
    assert result.is_success() and seen
    np.testing.assert_allclose(result.GetSolution(x), [1, 0], atol=1e-9)
    solver.SetCustomProjectionFunction(lambda v: (False, v))
    assert solver.Solve(prog, [3.0, 3.0]).get_solution_result() is SolutionResult.kInfeasibleConstraints


def test_nodes_may_be_limited():
    pytest.importorskip("clarabel")
    prog = MathematicalProgram()
    b = prog.NewBinaryVariables(3, "b")
    prog.AddQuadraticErrorCost(np.eye(3), [0.4, 0.6, 0.5], b)
    search = MixedIntegerBranchAndBound(prog, ClarabelSolver.id(), MixedIntegerBranchAndBound.Options(1))
    assert search.Solve() is SolutionResult.kIterationLimit


def test_relaxation_by_groups_of_variables():
    pytest.importorskip("clarabel")
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(3, "x")
    prog.AddQuadraticCost(np.diag([1.0, -1.0]), np.zeros(2), x[1:], is_convex=False)
    prog.AddBoundingBoxConstraint(-1.0, 1.0, x)
    for pair in itertools.combinations(x, 2):
        prog.AddLinearConstraint(pair[0] + pair[1] <= 1.5)
    dense = MakeSemidefiniteRelaxation(prog)
    same = MakeSemidefiniteRelaxation(prog, variable_groups=[Variables(x)], options=SemidefiniteRelaxationOptions())
    assert Solve(same).get_optimal_cost() == pytest.approx(Solve(dense).get_optimal_cost(), abs=1e-6)
    groups = [Variables(x[:2]), Variables(x[1:])]
    sparse = MakeSemidefiniteRelaxation(prog, groups)
    assert len(sparse.positive_semidefinite_constraints()) == 2 and sparse.num_vars() == 3 + 1 + 2 * 3
    assert len(sparse.linear_equality_constraints()) == 2  # one = 1, and both have the same x_1^2
    with pytest.raises(RuntimeError, match="not convex"):
        MakeSemidefiniteRelaxation(prog, [Variables(x[:2])])


def test_other_solutions_on_the_way_are_kept_in_order():
    pytest.importorskip("clarabel")
    several = 0
    for seed in range(5):
        rng = np.random.default_rng(seed)
        prog = MathematicalProgram()
        b = prog.NewBinaryVariables(8)
        A = rng.normal(size=(4, 8))
        prog.AddLinearConstraint(A, np.full(4, -np.inf), np.ones(4), b)
        L = rng.normal(size=(8, 8))
        Q, c = L @ L.T, 3.0 * rng.normal(size=8)
        prog.AddQuadraticCost(Q, c, b)
        search = MixedIntegerBranchAndBound(prog, ClarabelSolver.id())
        assert search.Solve() is SolutionResult.kSolutionFound
        corners = np.array(list(itertools.product((0.0, 1.0), repeat=8)))
        costs = 0.5 * np.einsum("ki,ij,kj->k", corners, Q, corners) + corners @ c
        allowed = (corners @ A.T <= 1.0 + 1e-9).all(axis=1)
        found = [search.GetOptimalCost()]
        while True:
            try:
                found.append(search.GetSubOptimalCost(len(found) - 1))
            except RuntimeError:
                break
        assert found[0] == pytest.approx(costs[allowed].min(), abs=1e-5) and found == sorted(found)
        for k, cost in enumerate(found):
            x = search.GetSolution(b, k)
            at = np.flatnonzero((corners == x).all(axis=1))
            assert allowed[at].all() and costs[at] == pytest.approx(cost, abs=1e-5)
        several += len(found) > 1
    assert several >= 2
