"""A program keeps the form its solver needs; whatever changes in between, it is solved as a new one would be."""

import copy
import gc
import pickle
import weakref

import numpy as np
import pytest
from scipy.sparse import csc_matrix

from sheldrake.solvers import (
    ClarabelSolver,
    MathematicalProgram,
    OsqpSolver,
    ScsSolver,
    SnoptSolver,
    Solve,
    SolveInParallel,
    SolverOptions,
)
from sheldrake.solvers._engines import conic
from sheldrake.symbolic import cosh


class Numbers:
    """What a program is made of, and the program made of it."""

    def __init__(self, kind, seed):
        rng = np.random.default_rng(seed)
        self.kind, self.n = kind, 4
        self.A, self.Q = rng.normal(size=(3, 4)), np.eye(4) + np.diag(rng.random(4))
        self.low, self.high, self.box = np.full(3, -0.4), np.full(3, 0.3), np.ones(4)
        self.a, self.E, self.e = rng.normal(size=4), rng.normal(size=(2, 4)), rng.normal(size=2) * 0.1

    def program(self):
        prog = MathematicalProgram()
        x = prog.NewContinuousVariables(self.n)
        found = {"equal": prog.AddLinearEqualityConstraint(self.E, self.e, x)}
        if self.kind != "linear":
            found["cost"] = prog.AddQuadraticCost(self.Q, self.a, x)
        else:
            found["cost"] = prog.AddLinearCost(self.a, 0.0, x)
        if self.kind != "equations":
            found["rows"] = prog.AddLinearConstraint(self.A, self.low, self.high, x)
            found["box"] = prog.AddBoundingBoxConstraint(-self.box, self.box, x)
        return prog, found


def change(numbers, found, step, rng):
    """Changes one thing in the numbers and in the program that was made of them."""
    names = ["cost", "equal"] if numbers.kind == "equations" else ["cost", "equal", "rows", "box", "matrix"]
    name = names[step % len(names)]
    if name == "cost":
        numbers.a = rng.normal(size=4)
        cost = found["cost"].evaluator()
        cost.UpdateCoefficients(*((numbers.a,) if numbers.kind == "linear" else (numbers.Q.copy(), numbers.a)))
        numbers.a = numbers.a.copy()
        numbers.a[1] = 0.25
        (cost.update_coefficient_entry if numbers.kind == "linear" else cost.update_linear_coefficient_entry)(1, 0.25)
    elif name == "equal":
        numbers.e = rng.normal(size=2) * 0.1
        found["equal"].evaluator().UpdateCoefficients(numbers.E.copy(), numbers.e)
    elif name == "rows":
        numbers.low, numbers.high = -rng.random(3) - 0.1, rng.random(3) + 0.1
        if step % 2:
            numbers.low[0] = -np.inf
        found["rows"].evaluator().set_bounds(numbers.low, numbers.high)
    elif name == "box":
        numbers.box = rng.random(4) + 0.5
        found["box"].evaluator().set_bounds(-numbers.box, numbers.box)
    else:
        numbers.A = rng.normal(size=(3, 4))
        found["rows"].evaluator().UpdateCoefficients(numbers.A, numbers.low, numbers.high)


def by_clarabel(prog):
    return ClarabelSolver().Solve(prog)


@pytest.mark.parametrize(
    "kind, solve, solved",
    [
        ("linear", Solve, "Simplex"),
        ("quadratic", Solve, "Active set"),
        ("quadratic", by_clarabel, "Clarabel"),
        ("equations", Solve, "EqConstrainedQP"),
    ],
)
@pytest.mark.parametrize("seed", range(6))
def test_changed_programs_have_the_bits_of_new_ones(kind, solve, solved, seed):
    numbers, rng = Numbers(kind, seed), np.random.default_rng(seed)
    prog, found = numbers.program()
    names = set()
    for step in range(12):
        again, same = solve(prog), solve(prog)
        new, parts = numbers.program()
        conic._forms_of.cache_clear()  # else it may be lent what the other was solved by
        anew = solve(new)
        names.add(again.get_solver_id().name())
        assert again.get_solution_result() is anew.get_solution_result()
        np.testing.assert_array_equal(again.get_x_val(), anew.get_x_val())
        np.testing.assert_array_equal(same.get_x_val(), anew.get_x_val())
        change(numbers, found, step, rng)  # duals are of the program that was solved
        for name in parts if anew.is_success() else ():
            if name != "cost":
                dual = again.GetDualSolution(found[name])
                np.testing.assert_array_equal(dual, anew.GetDualSolution(parts[name]))
    assert solved in names


def _steps(count):
    """Programs of the same matrices for other states, as predictive control writes them, and some of others."""
    rng, numbers = np.random.default_rng(5), Numbers("quadratic", 5)
    for step in range(count):
        numbers.e, numbers.box = rng.normal(size=2) * 0.1, rng.random(4) + 0.5
        numbers.high[1] = np.inf if step == 4 else 0.3
        numbers.a[0] = 0.5 if step < 6 else -0.5
        numbers.Q[0, 0] = 1.5 if step % 4 else 1.25
        numbers.A[1, 2] = 0.75 if step % 3 else 0.5
        yield numbers.program()


@pytest.mark.parametrize("solve", [Solve, by_clarabel])
def test_programs_written_anew_have_the_bits_of_the_first_of_their_kind(solve):
    warm = [(solve(prog), prog, found) for prog, found in _steps(12)]
    for (again, _, found), (prog, parts) in zip(warm, _steps(12)):
        conic._forms_of.cache_clear()
        first = solve(prog)
        assert again.is_success() and again.get_optimal_cost() == first.get_optimal_cost()
        np.testing.assert_array_equal(again.get_x_val(), first.get_x_val())
        for name in ("equal", "rows", "box"):
            np.testing.assert_array_equal(again.GetDualSolution(found[name]), first.GetDualSolution(parts[name]))


@pytest.mark.parametrize("solve", [Solve, by_clarabel])
def test_nothing_of_a_program_is_kept_for_the_next(solve):
    ((prog, found),) = _steps(1)
    assert solve(prog).is_success()
    gone = [weakref.ref(binding.evaluator()) for binding in found.values()]
    del prog, found
    gc.collect()
    assert [ref() for ref in gone] == [None] * 4


def test_an_option_counts_in_a_program_written_anew():
    (one, _), (other, _) = list(_steps(3))[1:]
    options = SolverOptions()
    options.SetOption(ClarabelSolver.id(), "max_iter", 1)
    assert by_clarabel(one).is_success()
    assert not Solve(other, None, options).is_success()
    assert by_clarabel(other).is_success()


@pytest.mark.parametrize("solve, asked", [(Solve, None), (by_clarabel, ClarabelSolver.id())])
def test_threads_lend_each_other_what_they_solved_with(solve, asked):
    progs = [prog for prog, _ in _steps(40)]
    several = SolveInParallel(progs, parallelism=4, solver_id=asked)
    for found, (prog, _) in zip(several, _steps(40)):
        np.testing.assert_array_equal(found.get_x_val(), solve(prog).get_x_val())


_CHANGES = {
    "Hessian": lambda found: found["cost"].evaluator().UpdateHessianEntry(1, 1, 5.0),
    "slope": lambda found: found["cost"].evaluator().update_linear_coefficient_entry(1, 5.0),
    "constant": lambda found: found["cost"].evaluator().update_constant_term(5.0),
    "linear": lambda found: found["linear"].evaluator().UpdateCoefficients(np.ones(4), 2.0),
    "entry": lambda found: found["linear"].evaluator().update_coefficient_entry(2, -3.0),
    "constant of a linear cost": lambda found: found["linear"].evaluator().update_constant_term(5.0),
    "lower bound": lambda found: found["box"].evaluator().UpdateLowerBound(np.full(4, 0.1)),
    "upper bound": lambda found: found["box"].evaluator().UpdateUpperBound(np.full(4, -0.1)),
    "small coefficients": lambda found: found["rows"].evaluator().RemoveTinyCoefficient(0.9),
}


@pytest.mark.parametrize("what", _CHANGES)
@pytest.mark.parametrize("solver", [ClarabelSolver, OsqpSolver])
def test_each_change_of_a_number_counts(what, solver):
    prog, found = Numbers("quadratic", 3).program()
    found["linear"] = prog.AddLinearCost(np.zeros(4), 0.0, prog.decision_variables())
    prog.RemoveConstraint(found["equal"])
    before, other = solver().Solve(prog), Numbers("quadratic", 4).program()[0]
    _CHANGES[what](found)
    solver().Solve(other)  # that of another program is no look at this one
    again, anew = solver().Solve(prog), solver().Solve(prog.Clone())  # what is kept is not copied
    assert again.get_optimal_cost() == anew.get_optimal_cost() != before.get_optimal_cost()
    np.testing.assert_array_equal(again.get_x_val(), anew.get_x_val())


def test_what_is_added_and_taken_out_counts():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2)
    prog.AddQuadraticCost(np.eye(2), np.array([-1.0, -1.0]), x)
    box = prog.AddBoundingBoxConstraint(-0.5, 0.5, x)
    np.testing.assert_allclose(Solve(prog).get_x_val(), [0.5, 0.5], atol=1e-6)
    prog.RemoveConstraint(box)
    np.testing.assert_allclose(Solve(prog).get_x_val(), [1.0, 1.0], atol=1e-6)
    y = prog.NewContinuousVariables(1)
    prog.AddLinearConstraint(x[0] + y[0] == 3.0)
    prog.AddBoundingBoxConstraint(2.5, 2.5, y)
    np.testing.assert_allclose(Solve(prog).get_x_val(), [0.5, 1.0, 2.5], atol=1e-6)
    prog.AddLorentzConeConstraint(np.array([0.8 + 0.0 * x[0], x[1]]))
    np.testing.assert_allclose(Solve(prog).get_x_val(), [0.5, 0.8, 2.5], atol=1e-5)


def test_options_count_for_a_program_that_was_solved_before():
    prog, _ = Numbers("quadratic", 1).program()
    solver, options = ClarabelSolver(), SolverOptions()
    options.SetOption(solver.id(), "max_iter", 2)
    assert solver.Solve(prog).is_success()
    assert not solver.Solve(prog, None, options).is_success()
    assert solver.Solve(prog).is_success()


def test_results_are_copied_and_pickled_with_their_duals():
    prog, found = Numbers("quadratic", 2).program()
    wanted = Solve(prog).GetDualSolution(found["equal"])
    copied = copy.deepcopy(Solve(prog))
    np.testing.assert_array_equal(copied.GetDualSolution(found["equal"]), wanted)
    result = Solve(prog)
    state = pickle.loads(pickle.dumps(result.__getstate__()["_duals"]))
    assert any(np.array_equal(dual, wanted) for dual in state.values())


def with_cones():
    """A program with a cone of each kind and a length, its bindings, and numbers that it is made of."""
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(3)
    S = prog.NewSymmetricContinuousVariables(2)
    A, b = np.vstack((np.zeros(3), np.eye(3))), np.array([2.0, 0.0, 0.0, 0.1])
    E = np.diag([0.0, 0.0, 1.0])
    found = {
        "Lorentz": prog.AddLorentzConeConstraint(A, b, x),
        "rotated": prog.AddRotatedLorentzConeConstraint(np.eye(3), np.array([2.0, 2.0, 0.0]), x),
        "exponential": prog.AddExponentialConeConstraint(csc_matrix(E), np.array([4.0, 1.0, 0.0]), x),
        "length": prog.AddL2NormCost(np.eye(3), np.full(3, 0.3), x),
        "matrix": prog.AddPositiveSemidefiniteConstraint(S),
        "inequality": prog.AddLinearMatrixInequalityConstraint([np.eye(2), np.diag([1.0, -1.0])], x[:1]),
        "linear": prog.AddLinearCost(np.array([1.0, 1.0, 1.0]), 0.0, x),
        "trace": prog.AddLinearCost(S[0, 0] + S[1, 1]),
        "rows": prog.AddLinearConstraint(np.eye(3), np.full(3, -1.0), np.full(3, 3.0), x),
        "equal": prog.AddLinearEqualityConstraint(np.array([[1.0]]), np.array([0.5]), S[:1, 1]),
    }
    return prog, found, (A, b, E)


_CHANGES_OF_CONES = {
    "Lorentz": lambda e, A, b, E: e.UpdateCoefficients(1.5 * A, np.array([1.0, 0.0, 0.0, 0.1])),
    "rotated": lambda e, A, b, E: e.UpdateCoefficients(1.5 * np.eye(3), np.array([0.5, 0.6, 0.1])),
    "exponential": lambda e, A, b, E: e.UpdateCoefficients(csc_matrix(-2.5 * E), np.array([4.0, 1.0, 0.2])),
    "length": lambda e, A, b, E: e.UpdateCoefficients(4.0 * np.eye(3), np.array([-0.5, 0.4, 0.1])),
    "linear": lambda e, A, b, E: e.UpdateCoefficients(np.array([-2.0, 1.0, 1.0]), 0.5),
    "rows": lambda e, A, b, E: e.set_bounds(np.full(3, -0.2), np.full(3, 3.0)),
    "equal": lambda e, A, b, E: e.UpdateCoefficients(np.array([[1.0]]), np.array([0.75])),
}


@pytest.mark.parametrize("what", _CHANGES_OF_CONES)
@pytest.mark.parametrize("solver", [ClarabelSolver, ScsSolver])
def test_changed_programs_with_cones_have_the_bits_of_new_ones(what, solver):
    if not solver().available():
        pytest.skip(f"{solver.__name__} stands on a package that is not installed")
    prog, found, numbers = with_cones()
    first, same = solver().Solve(prog), solver().Solve(prog)
    assert first.is_success()
    third = solver().Solve(prog)
    for result in (same, third):
        np.testing.assert_array_equal(result.get_x_val(), first.get_x_val())
    _CHANGES_OF_CONES[what](found[what].evaluator(), *numbers)
    for _ in range(2):
        again, anew = solver().Solve(prog), solver().Solve(prog.Clone())
        assert again.get_solution_result() is anew.get_solution_result()
        assert again.get_optimal_cost() == anew.get_optimal_cost()
        np.testing.assert_array_equal(again.get_x_val(), anew.get_x_val())
        for name in ("Lorentz", "rotated", "exponential", "matrix", "inequality", "rows", "equal"):
            np.testing.assert_array_equal(again.GetDualSolution(found[name]), anew.GetDualSolution(found[name]))
    assert np.abs(again.get_x_val() - first.get_x_val()).max() > 1e-6


def test_scs_takes_programs_whose_rows_come_and_go():
    if not ScsSolver().available():
        pytest.skip("ScsSolver stands on a package that is not installed")
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2)
    prog.AddQuadraticCost(np.eye(2), np.array([-1.0, -1.0]), x)
    for upper, wanted in ((np.inf, 1.0), (0.5, 0.5), (0.25, 0.25), (np.inf, 1.0)):
        if upper == np.inf:
            box = prog.AddBoundingBoxConstraint(-np.inf, np.inf, x)
        box.evaluator().UpdateUpperBound(np.full(2, upper))
        for _ in range(2):
            np.testing.assert_allclose(ScsSolver().Solve(prog).get_x_val(), wanted, atol=1e-6)
        if upper == 0.25:
            prog.RemoveConstraint(box)


def test_what_was_made_of_expressions_serves_the_next_solve_and_other_bindings():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2)
    cost = prog.AddCost((x[0] - 1.0) ** 2 * cosh(x[0]) + x[1] ** 4)
    prog.AddCost(cost.evaluator(), x[::-1])
    first, second = (SnoptSolver().Solve(prog, np.array([0.3, 0.4])) for _ in range(2))
    np.testing.assert_array_equal(first.get_x_val(), second.get_x_val())
    assert cost.evaluator()._written() is prog.generic_costs()[1].evaluator()._written() is not None
    a, b = first.get_x_val()
    np.testing.assert_allclose(
        first.get_optimal_cost(), (a - 1) ** 2 * np.cosh(a) + b**4 + (b - 1) ** 2 * np.cosh(b) + a**4
    )
