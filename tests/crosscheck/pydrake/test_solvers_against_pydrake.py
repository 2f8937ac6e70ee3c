"""The same programs in both libraries: same text, same bindings, same choice of solver, same solution."""

import numpy as np
import pytest
from tests.crosscheck.pydrake.programs import PROGRAMS

from sheldrake import autodiffutils as our_autodiff
from sheldrake import solvers as ours
from sheldrake import symbolic as our_symbols

pytestmark = pytest.mark.peer
theirs = pytest.importorskip("pydrake.solvers")
pytest.importorskip("clarabel")
import pydrake.autodiffutils as their_autodiff  # noqa: E402
import pydrake.symbolic as their_symbols  # noqa: E402

LISTS = [n for n in dir(theirs.MathematicalProgram) if n.endswith(("_costs", "_constraints"))]
# Sums of squares choose their own basis and slack variables have other names: values agree, texts need not.
OWN_SLACKS = {"sum_of_squares", "lyapunov", "log_determinant", "geometric_mean", "diagonally_dominant", "l1_epigraph"}


def both(name):
    return PROGRAMS[name](ours, our_symbols), PROGRAMS[name](theirs, their_symbols)


@pytest.mark.parametrize("name", sorted(set(PROGRAMS) - OWN_SLACKS - {"lorentz_from_symbols"}))
def test_programs_print_the_same(name):
    (p, _), (q, _) = both(name)
    assert str(p) == str(q)
    assert p.ToLatex() == q.ToLatex()


@pytest.mark.parametrize("name", sorted(PROGRAMS))
def test_programs_have_the_same_bindings(name):
    (p, _), (q, _) = both(name)
    for kind in LISTS:
        mine, other = getattr(p, kind)(), getattr(q, kind)()
        if name in ("sum_of_squares", "lyapunov"):  # A coefficient each is a row, in whatever order.
            assert bool(mine) == bool(other), kind
            continue
        assert len(mine) == len(other), kind
        if name not in OWN_SLACKS:
            classes = [type(b.evaluator()).__name__.replace("Polynomial", "") for b in mine]  # A class without a name.
            assert classes == [type(b.evaluator()).__name__ for b in other]
            assert [[str(v) for v in b.variables()] for b in mine] == [[str(v) for v in b.variables()] for b in other]
    assert {a.name for a in p.required_capabilities()} == {a.name for a in q.required_capabilities()}
    assert ours.GetProgramType(p).name == theirs.GetProgramType(q).name
    chosen = theirs.ChooseBestSolver(q).name()
    assert ours.ChooseBestSolver(p).name() == {"SNOPT": "InteriorPoint"}.get(chosen, chosen)


@pytest.mark.parametrize("name", sorted(PROGRAMS))
def test_solutions_agree(name):
    (p, tolerance), (q, _) = both(name)
    a, b = ours.Solve(p), theirs.Solve(q)
    assert a.get_solution_result().name == b.get_solution_result().name
    assert a.is_success() == b.is_success()
    np.testing.assert_allclose(a.get_optimal_cost(), b.get_optimal_cost(), rtol=2e-6, atol=2e-6)
    if tolerance is not None:
        np.testing.assert_allclose(a.get_x_val(), b.get_x_val(), atol=tolerance)
        assert a.GetInfeasibleConstraintNames(p, 1e-5) == []


@pytest.mark.parametrize("name", ["lp", "qp", "equality_qp", "socp", "sdp", "lmi", "nlp", "rosenbrock"])
def test_duals_agree(name):
    (p, _), (q, _) = both(name)
    a, b = ours.Solve(p), theirs.Solve(q)
    for mine, other in zip(p.GetAllConstraints(), q.GetAllConstraints()):
        np.testing.assert_allclose(a.GetDualSolution(mine), b.GetDualSolution(other), atol=2e-4)


@pytest.mark.parametrize("name", ["lp", "qp", "socp", "sdp", "l2norm"])
@pytest.mark.parametrize(
    "solver", ["OsqpSolver", "ScsSolver", "ClarabelSolver", "SnoptSolver", "IpoptSolver", "NloptSolver"]
)
def test_each_solver_finds_the_same(name, solver):
    (p, _), (q, _) = both(name)
    mine = getattr(ours, solver)()
    if not mine.available():
        pytest.skip(f"{solver} stands on a package that is not installed")
    assert mine.AreProgramAttributesSatisfied(p) == getattr(theirs, solver)().AreProgramAttributesSatisfied(q)
    if mine.AreProgramAttributesSatisfied(p):
        found = mine.Solve(p)
        ran = {"InteriorPoint", "SQP"} if solver == "SnoptSolver" else {mine.SolverName()}
        assert found.is_success() and found.get_solver_id().name() in ran
        np.testing.assert_allclose(found.get_optimal_cost(), theirs.Solve(q).get_optimal_cost(), atol=1e-5)


def test_a_planted_fault_is_seen():
    (p, _), (q, _) = both("qp")
    p.quadratic_costs()[0].evaluator().update_linear_coefficient_entry(0, 1.001)
    a, b = ours.Solve(p), theirs.Solve(q)
    assert np.abs(a.get_x_val() - b.get_x_val()).max() > 1e-6


EVALUATORS = [
    lambda s, x: s.LinearCost([1.0, 2, 3], 0.5),
    lambda s, x: s.QuadraticCost(np.arange(9.0).reshape(3, 3), [1.0, 2, 3], 0.5),
    lambda s, x: s.L1NormCost(np.eye(3)[:2], [0.3, -9]),
    lambda s, x: s.L2NormCost(np.eye(3)[:2], [0.3, -9]),
    lambda s, x: s.LInfNormCost(np.eye(3)[:2], [0.3, -9]),
    lambda s, x: s.PerspectiveQuadraticCost(np.eye(3), [0.3, -9, 2]),
    lambda s, x: s.LinearConstraint(np.arange(6.0).reshape(2, 3), [0, 1], [1, 2]),
    lambda s, x: s.LinearEqualityConstraint(np.arange(6.0).reshape(2, 3), [0, 1]),
    lambda s, x: s.BoundingBoxConstraint([0, 1, 2], [1, 2, 3]),
    lambda s, x: s.QuadraticConstraint(np.arange(9.0).reshape(3, 3), [1, 2, 3.0], 0, 5),
    lambda s, x: s.LorentzConeConstraint(np.eye(3), np.ones(3)),
    lambda s, x: s.LorentzConeConstraint(np.eye(3), np.ones(3), s.LorentzConeConstraint.EvalType.kConvex),
    lambda s, x: s.LorentzConeConstraint(np.eye(3), np.ones(3), s.LorentzConeConstraint.EvalType.kNonconvex),
    lambda s, x: s.RotatedLorentzConeConstraint(np.eye(3), np.ones(3)),
    lambda s, x: s.ExponentialConeConstraint(np.eye(3), np.ones(3)),
    lambda s, x: s.ExpressionCost(x[0] * x[1] + 1 / x[2]),
    lambda s, x: s.ExpressionConstraint([x[0] * x[1], x[2] ** 3], [0, 1], [1, 2]),
    lambda s, x: s.PyFunctionCost(3, lambda z: z[0] * z[1] - z[2], "hi"),
    lambda s, x: s.PyFunctionConstraint(3, lambda z: np.array([z[0] * z[1], z[2]]), [0, 1], [1, 2]),
    lambda s, x: s.MinimumValueLowerBoundConstraint(3, 0.5, 0.7, 4, lambda z, v: z, lambda z, v: z),
    lambda s, x: s.MinimumValueUpperBoundConstraint(3, 0.5, 0.7, 4, lambda z, v: z, lambda z, v: z),
]


@pytest.mark.parametrize("make", EVALUATORS)
def test_values_gradients_and_texts_of_evaluators(make):
    x, y = (m.MakeVectorVariable(3, "x") for m in (our_symbols, their_symbols))
    mine, other = make(ours, x), make(theirs, y)
    rng = np.random.default_rng(3)
    for at in rng.uniform(0.2, 1.5, size=(4, 3)):
        np.testing.assert_allclose(mine.Eval(at), other.Eval(at), rtol=1e-12)
        gradient = rng.normal(size=(3, 2))
        a = mine.Eval(our_autodiff.InitializeAutoDiff(at, gradient)[:, 0])
        b = other.Eval(their_autodiff.InitializeAutoDiff(at, gradient)[:, 0])
        np.testing.assert_allclose(
            our_autodiff.ExtractGradient(a), their_autodiff.ExtractGradient(b), rtol=1e-9, atol=1e-12
        )
    assert mine.num_outputs() == other.num_outputs() and mine.num_vars() == other.num_vars()
    try:
        expected = [str(e) for e in other.Eval(y)]
    except RuntimeError:
        with pytest.raises(RuntimeError):
            mine.Eval(x)
    else:
        assert [str(e) for e in mine.Eval(x)] == expected
    assert mine.ToLatex(x) == other.ToLatex(y).replace("pydrake.solvers.", "")


CALLS = [
    lambda p, x, y, m: p.AddCost(y**2),
    lambda p, x, y, m: p.AddLinearCost(x[0] ** 2),
    lambda p, x, y, m: p.AddQuadraticCost(x[0] ** 3),
    lambda p, x, y, m: p.AddConstraint(x[0] != 1),
    lambda p, x, y, m: p.AddConstraint(x[0] < 1),
    lambda p, x, y, m: p.AddConstraint(m.logical_or(x[0] <= 1, x[1] >= 2)),
    lambda p, x, y, m: p.AddConstraint(m.Formula.False_()),
    lambda p, x, y, m: p.AddLinearConstraint(x[0] ** 2 <= 1),
    lambda p, x, y, m: p.AddLinearEqualityConstraint(x[0] <= 1),
    lambda p, x, y, m: p.AddCost("a"),
    lambda p, x, y, m: p.AddConstraint(lambda z: z, 0, 1, x),
    lambda p, x, y, m: p.AddConstraint(x[0] + np.inf >= 3),
    lambda p, x, y, m: p.SetInitialGuess(y, 1.0),
    lambda p, x, y, m: p.SetInitialGuess(x[0], "a"),
    lambda p, x, y, m: p.SetInitialGuess(x, 1.0),
    lambda p, x, y, m: p.FindDecisionVariableIndex(y),
    lambda p, x, y, m: p.AddIndeterminates(x),
    lambda p, x, y, m: p.RemoveDecisionVariable(y),
    lambda p, x, y, m: p.AddSosConstraint(x[0] ** 3),
    lambda p, x, y, m: p.AddLorentzConeConstraint(np.array([x[0] ** 2, x[1]])),
    lambda p, x, y, m: p.AddL2NormCost(x[0] ** 2),
    lambda p, x, y, m: p.AddQuadraticConstraint(x[0] ** 3, 0, 1),
    lambda p, x, y, m: p.EvalBinding(p.AddCost(lambda z: z, x), [1, 2, 3.0]),
    lambda p, x, y, m: p.EvalBinding(p.AddCost(lambda z: "a", x), [1, 2, 3.0]),
    lambda p, x, y, m: p.EvalBinding(p.AddCost(x[0]), [1, 2.0]),
    lambda p, x, y, m: p.SetSolverOptions({"a": 1}),
]


@pytest.mark.parametrize("call", CALLS)
def test_bad_calls_raise_the_same_error(call):
    kinds = []
    for s, m in ((theirs, their_symbols), (ours, our_symbols)):
        p = s.MathematicalProgram()
        x = p.NewContinuousVariables(3, "x")
        with pytest.raises(Exception) as caught:
            call(p, x, m.Variable("y"), m)
        kinds.append(type(caught.value))
    assert issubclass(kinds[1], kinds[0])  # who catches the one catches the other


def test_a_setting_that_osqp_refuses_is_invalid_input():
    found = []
    for s in (theirs, ours):
        p = s.MathematicalProgram()
        x = p.NewContinuousVariables(2, "x")
        p.AddQuadraticErrorCost(np.eye(2), [1.0, 2.0], x)
        p.AddBoundingBoxConstraint(0.0, 1.5, x)
        options = s.SolverOptions()
        options.SetOption(s.OsqpSolver.id(), "max_iter", -3)
        result = s.OsqpSolver().Solve(p, None, options)
        assert np.isnan(result.get_optimal_cost())
        assert np.isnan(result.GetSolution(x)).all()
        found.append(result.get_solution_result().name)
    assert found == ["kInvalidInput"] * 2


@pytest.mark.parametrize("quadratic", [False, True])
@pytest.mark.parametrize("solver", ["ScsSolver", "ClarabelSolver"])
def test_results_of_unbounded_programs_agree(solver, quadratic):
    answers = []
    for library in (ours, theirs):
        program = library.MathematicalProgram()
        x = program.NewContinuousVariables(2)
        program.AddLinearCost(x[1])
        program.AddLinearConstraint(x[0] + x[1] <= 3)
        if quadratic:
            program.AddQuadraticCost(x[0] ** 2)
        result = getattr(library, solver)().Solve(program)
        answers.append((result.is_success(), result.get_solution_result().name, result.get_optimal_cost()))
    assert answers[0] == answers[1]


@pytest.mark.parametrize("kind", ["Sos", "Sdsos", "Dsos"])
def test_polynomials_of_even_degree_order_their_variables_the_same(kind):
    orders = []
    for library, symbols in ((ours, our_symbols), (theirs, their_symbols)):
        program = library.MathematicalProgram()
        x = program.NewIndeterminates(2, "x")
        new = getattr(program, f"NewEvenDegree{kind}Polynomial")
        _, odd, even = new(symbols.Variables(x), 4)
        orders.append([[program.FindDecisionVariableIndex(v) for v in Q.ravel()] for Q in (odd, even)])
    assert orders[0] == orders[1]


@pytest.mark.parametrize("solvers", [theirs, ours], ids=["pydrake", "sheldrake"])
@pytest.mark.parametrize("kind", ["few variables", "functions of Python", "quadratic"])
def test_visualization_callbacks_see_the_iterates(solvers, kind):
    """Of which the last is the solution, whichever method runs; the first need not be the guess."""
    program, seen = solvers.MathematicalProgram(), []
    x = program.NewContinuousVariables(2, "x")
    if kind == "functions of Python":
        program.AddConstraint(lambda x: np.array([x[0] ** 2 + x[1] ** 2, x[0] * x[1]]), [1.0, -9.0], [1.0, 0.2], vars=x)
        program.AddCost(lambda x: x[0] + 2.0 * x[1], vars=x)
    elif kind == "few variables":
        program.AddConstraint(x[0] ** 2 + x[1] ** 2 <= 1.0)
        program.AddCost((x[0] - 1.0) ** 4 + (x[1] + 2.0) ** 2)
    else:
        program.AddLinearConstraint(x[0] + x[1] == 1.0)
        program.AddCost(x.dot(x))
    program.AddVisualizationCallback(lambda at: seen.append(np.array(at)), x)
    result = solvers.Solve(program, [0.5, -0.5])
    assert result.is_success() and len(seen) > 0
    np.testing.assert_allclose(seen[-1], result.GetSolution(x), atol=1e-6)
