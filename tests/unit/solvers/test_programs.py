"""Programs, costs and constraints without a solver."""

import numpy as np
import pytest

from sheldrake.autodiffutils import ExtractGradient, InitializeAutoDiff
from sheldrake.solvers import (
    Binding,
    ClarabelSolver,
    Constraint,
    Cost,
    ExponentialConeConstraint,
    IpoptSolver,
    LinearConstraint,
    LinearCost,
    LorentzConeConstraint,
    MathematicalProgram,
    NloptSolver,
    PyFunctionConstraint,
    QuadraticCost,
    RotatedLorentzConeConstraint,
    ScsSolver,
    SnoptSolver,
    SolutionResult,
    Solve,
    SolverId,
    SolverInterface,
    SolverOptions,
)
from sheldrake.solvers._program.polynomials import half_newton_basis
from sheldrake.symbolic import Expression, Formula, Polynomial, Variable, Variables, cos, sin


@pytest.fixture
def prog():
    return MathematicalProgram()


def test_variables_have_places_in_order_column_by_column(prog):
    x, Y = prog.NewContinuousVariables(2, "x"), prog.NewContinuousVariables(2, 2, "Y")
    assert [str(v) for v in prog.decision_variables()] == ["x(0)", "x(1)", "Y(0,0)", "Y(1,0)", "Y(0,1)", "Y(1,1)"]
    assert prog.FindDecisionVariableIndices([Y[1, 0], x[1]]) == [3, 1]
    assert prog.RemoveDecisionVariable(Y[0, 0]) == 2
    assert prog.FindDecisionVariableIndex(Y[1, 0]) == 2
    with pytest.raises(ValueError, match="not a decision variable"):
        prog.RemoveDecisionVariable(Variable("y"))


def test_expressions_become_the_most_special_cost(prog):
    x = prog.NewContinuousVariables(2, "x")
    kinds = [type(prog.AddCost(e).evaluator()).__name__ for e in (x[0], x[0] ** 2, sin(x[0]), x[0] ** 3)]
    assert kinds == ["LinearCost", "QuadraticCost", "ExpressionCost", "PolynomialCost"]
    assert len(prog.GetAllCosts()) == 4 and len(prog.generic_costs()) == 2


def test_formulas_become_the_most_special_constraint(prog):
    x = prog.NewContinuousVariables(2, "x")
    formulas = [x[0] <= 1, x[0] + x[1] <= 1, x[0] == x[1], x[0] * x[1] >= 1, cos(x[0]) >= x[1]]
    kinds = [type(prog.AddConstraint(f).evaluator()).__name__ for f in formulas]
    assert kinds == [
        "BoundingBoxConstraint",
        "LinearConstraint",
        "LinearEqualityConstraint",
        "QuadraticConstraint",
        "ExpressionConstraint",
    ]
    with pytest.raises(RuntimeError, match="neither a relational formula"):
        prog.AddConstraint(x[0] < 1)
    with pytest.raises(RuntimeError, match="always false"):
        prog.AddConstraint(Formula.False_())
    with pytest.raises(RuntimeError, match=r"formulas\(1, 0\) being always false"):
        prog.AddConstraint([x[0] <= 1, Formula.False_()])


def test_rows_without_variables_are_kept_where_they_hold(prog):
    x = prog.NewContinuousVariables(2, "x")
    zero = Expression(0.0)
    kept = [
        prog.AddLinearConstraint(Expression(1.0), 0.0, 2.0),
        prog.AddLinearConstraint(np.array([x[0], zero]), [0.0, -1.0], [1.0, 1.0]),
        prog.AddConstraint(zero, 0.0, 0.0),
    ]
    kinds = [(type(b.evaluator()).__name__, b.evaluator().num_constraints(), len(b.variables())) for b in kept]
    assert kinds == [("LinearConstraint", 1, 0), ("LinearConstraint", 2, 1), ("LinearEqualityConstraint", 1, 0)]
    with pytest.raises(RuntimeError, match="unsatisfiable"):
        prog.AddLinearConstraint(np.array([x[0], Expression(5.0)]), [0.0, -1.0], [1.0, 1.0])


def test_constraints_without_rows_are_not_kept(prog):
    x, none = prog.NewContinuousVariables(2, "x"), np.zeros(0)
    prog.AddConstraint(0.0 * x[0] <= 1.0)
    prog.AddLinearConstraint(np.zeros((0, 2)), none, none, x)
    prog.AddBoundingBoxConstraint(0.0, 1.0, x[:0])
    assert prog.GetAllConstraints() == []


@pytest.mark.parametrize("solver", [ClarabelSolver, IpoptSolver, NloptSolver, SnoptSolver])
def test_rows_without_variables_trouble_no_solver(prog, solver):
    if not solver().available():
        pytest.skip("its package is not installed")
    x, zero = prog.NewContinuousVariables(2, "x"), Expression(0.0)
    prog.AddLinearConstraint(zero, 0.0, 0.0)
    prog.AddLinearEqualityConstraint(np.array([x[0] - x[1], zero, zero]), [0.5, 0.0, 0.0])
    prog.AddLinearConstraint(np.array([x[0] + x[1], zero]), [1.0, -1.0], [2.0, 1.0])
    prog.AddQuadraticCost(x @ x)
    result = solver().Solve(prog)
    assert result.is_success()
    np.testing.assert_allclose(result.GetSolution(x), [0.75, 0.25], atol=1e-6)


def test_gradients_of_expressions_are_those_of_differences(prog):
    x = prog.NewContinuousVariables(3, "x")
    c = prog.AddConstraint(np.array([sin(x[0] * x[1]) + x[2] ** 3, x[1] / x[2]]), [0, 0], [1, 1]).evaluator()
    at = np.array([0.3, 1.2, 0.8])
    J = ExtractGradient(c.Eval(InitializeAutoDiff(at)[:, 0]))
    h = 1e-6
    differences = np.stack([(c.Eval(at + h * e) - c.Eval(at - h * e)) / (2 * h) for e in np.eye(3)], axis=1)
    np.testing.assert_allclose(J, differences, atol=1e-9)


def test_functions_must_return_the_scalar_they_are_called_with(prog):
    x = prog.NewContinuousVariables(2, "x")
    constant = prog.AddCost(lambda z: 1.0, vars=x).evaluator()
    with pytest.raises(TypeError, match="AutoDiffXd the return value must be the same type, not float"):
        constant.Eval(InitializeAutoDiff([1.0, 2.0]))
    wrong = PyFunctionConstraint(2, lambda z: z, [0, 0, 0], [1, 1, 1])
    with pytest.raises(RuntimeError, match=r"\.size = 3"):
        wrong.Eval([1.0, 2.0])


def test_bindings_are_equal_when_evaluator_and_variables_are(prog):
    x = prog.NewContinuousVariables(2, "x")
    b = prog.AddLinearCost([1, 2], 0.5, x)
    assert Binding[LinearCost](b.evaluator(), x) == b == Binding[Cost](b)
    assert Binding[LinearCost](b.evaluator(), x[::-1]) != b
    with pytest.raises(RuntimeError, match="Unable to cast"):
        Binding[Constraint](b)
    with pytest.raises(RuntimeError, match="has 2 variables"):
        Binding[LinearCost](b.evaluator(), x[:1])


def test_removed_bindings_are_gone_and_clones_keep_them(prog):
    x = prog.NewContinuousVariables(2, "x")
    b = prog.AddConstraint(LinearConstraint([[1, 1]], [0], [1]), x)
    clone = prog.Clone()
    assert prog.RemoveConstraint(b) == 1 and prog.RemoveConstraint(b) == 0
    assert prog.GetAllConstraints() == [] and clone.GetAllConstraints() == [b]


def test_initial_guess(prog):
    x = prog.NewContinuousVariables(2, 2, "x")
    assert np.isnan(prog.GetInitialGuess(x)).all()
    prog.SetInitialGuess(x, [[1, 2], [3, 4]])
    prog.SetInitialGuess(x[0, 1], 7)
    np.testing.assert_array_equal(prog.GetInitialGuess(x), [[1, 7], [3, 4]])
    np.testing.assert_array_equal(prog.initial_guess(), [1, 3, 7, 4])
    with pytest.raises(RuntimeError, match="2 values"):
        prog.SetInitialGuess(x, [1, 2])


def test_options_are_kept_by_solver():
    options = SolverOptions()
    options.SetOption(SolverId("B"), "z", 1)
    options.SetOption(SolverId("A"), "y", "text")
    assert repr(options) == "SolverOptions(options={'A': {'y': 'text'}, 'B': {'z': 1}})"
    assert options == SolverOptions(options={"B": {"z": 1}, "A": {"y": "text"}})


def test_options_set_twice_keep_the_last_value_and_their_order():
    options = SolverOptions()
    for value in (1, 2):
        for key in ("b", "a"):
            options.SetOption(SolverId("S"), key, value)
    assert list(options.options["S"].items()) == [("a", 2), ("b", 2)]
    before = options.options
    options.SetOption(SolverId("S"), "a", 3)
    assert before["S"]["a"] == 2 and options.options["S"]["a"] == 3


def test_what_is_asked_often_whether_it_satisfies_answers_as_at_first(prog):
    """A kernel takes over after some calls; the bounds, their tolerance and what is no number say the same to it."""
    x = prog.NewContinuousVariables(2, "x")
    asked = [
        prog.AddQuadraticConstraint(np.eye(2), np.zeros(2), -np.inf, 1.0, x),
        prog.AddLorentzConeConstraint(np.eye(2), np.zeros(2), x),
        prog.AddConstraint(x[0] ** 3 + sin(x[1]) <= 1.0),
        prog.AddConstraint(lambda z: np.array([z[0] * z[1], z[0]]), [0.0, -1.0], [1.0, np.inf], x),
        prog.AddConstraint(PyFunctionConstraint(2, lambda z: [np.nan * z[0]], [-np.inf], [np.inf]), x),
    ]
    points = np.array([[0.3, 0.2], [1.0, 1.0], [1.0, 1.0 + 1e-7], [1.0, 1.0 + 1e-5], [-1.0, 2.0], [np.nan, 0.0]])
    questions = [(b, point, tol) for b in asked for point in points for tol in (0.0, 1e-6, 1)]
    first = [b.evaluator().CheckSatisfied(point, tol) for b, point, tol in questions]
    values = [(b.evaluator(), b.evaluator().Eval(point), tol) for b, point, tol in questions]
    plain = [(e.lower_bound() - tol <= y).all() and (y <= e.upper_bound() + tol).all() for e, y, tol in values]
    for _ in range(10):
        assert first == plain == [b.evaluator().CheckSatisfied(point, tol) for b, point, tol in questions]
    assert 0 < sum(first) < len(first)
    together = [prog.CheckSatisfied(asked[:4], point) for point in points]
    assert together == [all(b.evaluator().CheckSatisfied(point) for b in asked[:4]) for point in points]
    with pytest.raises(RuntimeError, match="expected 2 values"):
        prog.CheckSatisfied(asked, np.zeros(3))


def test_free_polynomials_have_a_variable_for_each_monomial(prog):
    x = prog.NewIndeterminates(2, "x")
    p = prog.NewFreePolynomial(Variables(x), 2)
    assert len(p.monomial_to_coefficient_map()) == 6 == prog.num_vars()
    q = prog.MakePolynomial(x[0] * prog.decision_variable(0) + 1)
    assert q.TotalDegree() == 1 and len(q.decision_variables()) == 1


def test_polynomials_that_are_never_equal_make_a_program_infeasible(prog):
    x, a = prog.NewIndeterminates(1, "x")[0], prog.NewContinuousVariables(1, "a")[0]
    q = Polynomial(a * x, Variables([x]))
    (never,) = prog.AddEqualityConstraintBetweenPolynomials(q, q + 1)
    assert never.variables().size == 0 and never.evaluator().GetDenseA().shape == (1, 0)
    np.testing.assert_array_equal(never.evaluator().lower_bound(), [1.0])
    assert str(never).endswith("0 == 1\n")
    assert Solve(prog).get_solution_result() is SolutionResult.kInfeasibleConstraints


def test_symmetry_is_asked_of_semidefinite_matrices(prog):
    x = prog.NewContinuousVariables(2, "x")
    with pytest.raises(RuntimeError, match="not symmetric"):
        prog.AddPositiveSemidefiniteConstraint(np.array([[x[0], 2 * x[1]], [x[1], Expression(1.0)]]))


@pytest.mark.parametrize("solver", [ClarabelSolver, ScsSolver])
def test_the_lower_triangle_of_variables_is_semidefinite(prog, solver):
    """pydrake 1.51 finds a trace of 1 with both: 0.5 below the diagonal counts, 0.1 above it does not."""
    X = prog.NewContinuousVariables(2, 2, "X")
    prog.AddPositiveSemidefiniteConstraint(X)
    prog.AddLinearCost(X[0, 0] + X[1, 1])
    prog.AddLinearConstraint(X[1, 0] == 0.5)
    prog.AddLinearConstraint(X[0, 1] == 0.1)
    assert solver().Solve(prog).get_optimal_cost() == pytest.approx(1.0, abs=1e-5)


def test_kinds_of_what_programs_give_back():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2, "x")
    for added in (
        prog.AddLinearConstraint(x[0] + x[1] == 1),
        prog.AddLinearConstraint(x[0] <= 1),
        prog.AddLinearConstraint(x, [1.0, 1.0], [1.0, 1.0]),
    ):
        assert type(added) is Binding[LinearConstraint]
    slack, _, linear = prog.AddL1NormCostInEpigraphForm([[2.0, 3.0]], [0.5], x)
    assert [v.get_name() for v in linear.variables()] == [v.get_name() for v in (*slack, *x)]
    np.testing.assert_array_equal(linear.evaluator().GetDenseA(), [[-1.0, 2.0, 3.0], [-1.0, -2.0, -3.0]])
    np.testing.assert_array_equal(linear.evaluator().upper_bound(), [-0.5, 0.5])
    X = prog.NewSymmetricContinuousVariables(2, "X")
    part = prog.AddScaledDiagonallyDominantMatrixConstraint(X)[0][1]
    assert part[0, 1].EqualTo(X[0, 1]) and all(isinstance(v, Variable) for v in part.ravel())
    assert isinstance(prog.AddScaledDiagonallyDominantMatrixConstraint(1.0 * X)[0][1][0, 0], Expression)


def test_which_derivatives_of_cones_vanish():
    A, b = np.array([[1.0, 0.0, 2.0, 0.0], [0.0, 3.0, 0.0, 0.0], [0.0, 0.0, 4.0, 0.0]]), np.zeros(3)
    kinds = LorentzConeConstraint.EvalType
    assert LorentzConeConstraint(A, b).gradient_sparsity_pattern() == [(0, 0), (0, 1), (0, 2)]
    two = LorentzConeConstraint(A, b, kinds.kNonconvex).gradient_sparsity_pattern()
    assert two == [(0, 0), (1, 0), (1, 1), (0, 2), (1, 2)]
    rotated = RotatedLorentzConeConstraint(A, b)
    assert rotated.gradient_sparsity_pattern() == [(0, 0), (2, 0), (1, 1), (2, 1), (0, 2), (2, 2)]
    x = np.array([3.0, 5.0, 7.0, 11.0])
    gradient = ExtractGradient(rotated.Eval(InitializeAutoDiff(x).ravel()))
    assert {tuple(at) for at in np.argwhere(gradient).tolist()} <= set(rotated.gradient_sparsity_pattern())
    assert isinstance(ExponentialConeConstraint(A, b).A(), np.ndarray)


def test_formulas_of_bounds_and_names_of_own_solvers():
    x = Variable("x")
    assert str(LinearConstraint([[1.0]], [-1.0], [2.0]).CheckSatisfied(np.array([x]))) == "((-1 <= x) and (x <= 2))"

    class Mine(SolverInterface):
        def solver_id(self):
            return SolverId("mine")

    assert Mine().SolverName() == "mine"


def test_a_row_alone_is_read_as_it_is_among_others(prog):
    x, y = prog.NewContinuousVariables(2, "x")
    for f in (x + 2 * y <= 1, -2 * x >= 3, x - y == 0, 2 * x + 1 <= np.inf):
        alone = prog.AddConstraint(f)
        among = prog.AddConstraint(np.array([f, f]))
        one, two = alone.evaluator(), among.evaluator()
        assert type(one) is type(two)
        rows = [one.GetDenseA(), one.lower_bound(), one.upper_bound()]
        found = [two.GetDenseA(), two.lower_bound(), two.upper_bound()]
        for a, b in zip(rows, found):
            np.testing.assert_array_equal(np.atleast_2d(a)[:1], np.atleast_2d(b)[:1, : np.atleast_2d(a).shape[1]])


def test_polynomials_are_read_alike_expanded_or_not(prog):
    x, y = prog.NewContinuousVariables(2, "x")
    product, sum_ = (x + 2 * y - 1) * (x - y), x**2 + x * y - 2 * y**2 - x + y
    a, b = prog.AddCost(product).evaluator(), prog.AddCost(sum_).evaluator()
    assert isinstance(a, QuadraticCost) and isinstance(b, QuadraticCost)
    np.testing.assert_array_equal(a.Q(), b.Q())
    np.testing.assert_array_equal(a.b(), b.b())
    assert prog.AddCost(3.0 * x**2 * y - y).evaluator().num_vars() == 2
    for e in (x**2 * (x + y), (x + y) ** 2 * (x - y), x * (x * y + 1.0)):
        assert type(prog.AddCost(e).evaluator()).__name__ == "PolynomialCost"
    assert isinstance(prog.AddCost(0.5 * x * (x + y)).evaluator(), QuadraticCost)


def test_variables_are_added_all_or_none():
    """Also those before one that cannot be added are not."""
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2, "x")
    b, y = Variable("b", Variable.Type.BOOLEAN), Variable("y")
    with pytest.raises(RuntimeError, match="no decision variable"):
        prog.AddDecisionVariables(np.array([y, b]))
    assert prog.num_vars() == 2
    prog.AddDecisionVariables(np.array([x[1], y, y]))
    assert [v.get_id() for v in prog.decision_variables()] == [v.get_id() for v in (*x, y)]


def test_bases_of_sums_of_squares_depend_on_exponents_alone():
    """Of M = x^4 y^2 + x^2 y^4 - 3 x^2 y^2 + 1, half of whose Newton polytope holds 1, x y, x^2 y and x y^2."""

    def exponents(scale, terms):
        x, y = MathematicalProgram().NewIndeterminates(2, "x")
        p = Polynomial(sum((scale * x**i * y**j for i, j in terms), Expression(0.0)), Variables([x, y]))
        return sorted((m.degree(x), m.degree(y)) for m in half_newton_basis(*p._by_indeterminates()))

    motzkin = [(4, 2), (2, 4), (2, 2), (0, 0)]
    assert exponents(1.0, motzkin) == exponents(-3.0, motzkin) == [(0, 0), (1, 1), (1, 2), (2, 1)]
    assert exponents(1.0, [*motzkin, (4, 0)]) == [(0, 0), (1, 0), (1, 1), (1, 2), (2, 0), (2, 1)]
    assert exponents(1.0, [(0, 0)]) == [(0, 0)]
