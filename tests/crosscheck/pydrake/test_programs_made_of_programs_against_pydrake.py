"""Branch and bound, ordered sets, relaxations, augmented Lagrangians: what makes programs out of programs."""

import numpy as np
import pytest

from sheldrake import autodiffutils as our_autodiff
from sheldrake import solvers as ours
from sheldrake import symbolic as our_symbols

pytestmark = pytest.mark.peer
theirs = pytest.importorskip("pydrake.solvers")
pytest.importorskip("clarabel")
import pydrake.autodiffutils as their_autodiff  # noqa: E402
import pydrake.symbolic as their_symbols  # noqa: E402

BOTH = ((ours, our_symbols), (theirs, their_symbols))


def sos2(s, sym):
    p = s.MathematicalProgram()
    weights, y = p.NewContinuousVariables(4, "l"), p.NewBinaryVariables(3, "y")
    s.AddSos2Constraint(p, weights, y)
    return p


def logarithmic_sos1(s, sym):
    p = s.MathematicalProgram()
    s.AddLogarithmicSos1Constraint(p, 5)
    return p


def logarithmic_sos2(s, sym):
    p = s.MathematicalProgram()
    s.AddLogarithmicSos2Constraint(p, p.NewContinuousVariables(6, "l"))
    return p


def envelope(s, sym, linear=True):
    p = s.MathematicalProgram()
    x, y, w = p.NewContinuousVariables(3, "v")
    bins = s.IntervalBinning.kLinear if linear else s.IntervalBinning.kLogarithmic
    Bx, By = p.NewBinaryVariables(3 if linear else 2, "Bx"), p.NewBinaryVariables(2 if linear else 1, "By")
    s.AddBilinearProductMcCormickEnvelopeSos2(p, x, y, sym.Expression(w), [0, 1, 2, 3], [0, 1.0, 3], Bx, By, bins)
    return p


def relaxation(s, sym, weakest=False):
    p = s.MathematicalProgram()
    y = p.NewContinuousVariables(2, "y")
    p.AddLinearCost(y[0] + 2)
    p.AddQuadraticCost(y[0] * y[1] + y[1])
    p.AddConstraint(y.dot(y) == 1)
    p.AddQuadraticConstraint(y[0] ** 2 - y[1] ** 2, -1, 2)
    p.AddLinearConstraint(y[0] + 2 * y[1] <= 2)
    p.AddLinearConstraint(y[0] - y[1], -1, 3)
    p.AddLinearEqualityConstraint(y[0] + y[1] == 0.5)
    p.AddBoundingBoxConstraint(-1, 4, y[0])
    options = s.SemidefiniteRelaxationOptions()
    if weakest:
        options.set_to_weakest()
    return s.MakeSemidefiniteRelaxation(p, options)


@pytest.mark.parametrize(
    "build",
    [
        sos2,
        logarithmic_sos1,
        logarithmic_sos2,
        envelope,
        lambda s, sym: envelope(s, sym, False),
        relaxation,
        lambda s, sym: relaxation(s, sym, True),
    ],
)
def test_the_programs_are_the_same(build):
    mine, other = (str(build(s, sym)) for s, sym in BOTH)
    assert mine == other


def test_relaxations_have_the_same_minimum():
    costs = [s.Solve(relaxation(s, sym)).get_optimal_cost() for s, sym in BOTH]
    np.testing.assert_allclose(*costs, atol=1e-6)


def nonlinear(s, sym):
    p = s.MathematicalProgram()
    x = p.NewContinuousVariables(3, "x")
    p.AddCost(x[0] ** 2 + x[1] * x[2])
    p.AddConstraint(x[0] * x[1], -1, 2)
    p.AddConstraint(x[0] ** 2 == 3)
    p.AddLinearConstraint(x[0] + x[1] <= 2)
    p.AddLinearEqualityConstraint(x[1] - x[2] == 0.5)
    p.AddBoundingBoxConstraint([-1, -np.inf], [2, 3], x[:2])
    p.AddBoundingBoxConstraint(0.5, 0.5, x[2])
    p.AddLorentzConeConstraint(x)
    return p


@pytest.mark.parametrize("smooth", [True, False])
@pytest.mark.parametrize("bounds", [True, False])
def test_augmented_lagrangians(smooth, bounds):
    found = []
    for (s, sym), ad in zip(BOTH, (our_autodiff, their_autodiff)):
        p = nonlinear(s, sym)
        L = (s.AugmentedLagrangianSmooth if smooth else s.AugmentedLagrangianNonsmooth)(p, bounds)
        n, x = L.lagrangian_size(), np.array([0.1, 0.2, 0.7])
        slack = (np.linspace(0.1, 0.4, L.s_size()),) if smooth else ()
        value, residues, cost = L.Eval(x, *slack, np.linspace(-0.5, 1, n), 2.0)
        duals = ad.InitializeAutoDiff(x)[:, 0]
        slack = tuple(np.array([ad.AutoDiffXd(v) for v in part]) for part in slack)
        total, _, dual_cost = L.Eval(duals, *slack, np.linspace(-0.5, 1, n), 2.0)
        found.append([value, cost, *residues, *L.is_equality(), *total.derivatives(), *dual_cost.derivatives()])
        found[-1] += [*L.x_lo(), *L.x_up()]
    np.testing.assert_allclose(*found, rtol=1e-12)


def knapsack(s, sym):
    p = s.MathematicalProgram()
    x, b = p.NewContinuousVariables(2, "x"), p.NewBinaryVariables(3, "b")
    p.AddQuadraticCost((x[0] - 1.3 * b[0]) ** 2 + (x[1] - 0.4) ** 2 + b[1] * 0.1 - b[2] * 0.05)
    p.AddLinearConstraint(x[0] + x[1] + b.sum() <= 2.2)
    p.AddLinearConstraint(x[0] >= 1)
    return p, x, b


def test_branch_and_bound():
    found = []
    for s, sym in BOTH:
        p, x, b = knapsack(s, sym)
        search = s.MixedIntegerBranchAndBound(p, s.ClarabelSolver.id())
        assert search.Solve().name == "kSolutionFound"
        found.append([search.GetOptimalCost(), *search.GetSolution(b), *search.GetSolution(x)])
        with pytest.raises(RuntimeError, match="only found"):
            search.GetSolution(b, 50)
        p.AddLinearConstraint(b.sum() >= 4)
        search = s.MixedIntegerBranchAndBound(p, s.ClarabelSolver.id())
        assert search.Solve().name == "kInfeasibleConstraints"
        with pytest.raises(RuntimeError, match="did not find"):
            search.GetOptimalCost()
    np.testing.assert_allclose(*found, atol=1e-6)


def test_projected_gradients_take_the_same_steps():
    found = []
    for s, _ in BOTH:
        p = s.MathematicalProgram()
        x = p.NewContinuousVariables(2, "x")
        p.AddCost((x[0] - 2) ** 2 + (x[1] - 3) ** 4)
        p.AddLinearConstraint(x[0] + x[1] <= 2)
        solver = s.ProjectedGradientDescentSolver()
        for steps in (2, 5, 1000):
            options = s.SolverOptions()
            options.SetOption(solver.id(), solver.MaxIterationsOptionName(), steps)
            result = solver.Solve(p, [0.0, 0.0], options)
            found.append((result.get_solution_result().name, result.get_x_val()))
    for mine, other in zip(found[:3], found[3:]):
        assert mine[0] == other[0]
        np.testing.assert_allclose(mine[1], other[1], atol=1e-5)


def test_a_planted_fault_is_seen():
    p = envelope(ours, our_symbols)
    p.linear_constraints()[0].evaluator().UpdateUpperBound([7.0, 0.0])
    assert str(p) != str(envelope(theirs, their_symbols))
