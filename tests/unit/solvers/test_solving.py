"""Solvers, each by the conditions that its answer must satisfy."""

import importlib.util
import itertools
import subprocess
import sys
import threading

import numpy as np
import pytest
from scipy.sparse import csc_matrix
from tests.unit.common.counting import calls_of

from sheldrake import solvers
from sheldrake.solvers import (
    ChooseBestSolver,
    ClarabelSolver,
    GurobiSolver,
    IpoptSolver,
    MakeFirstAvailableSolver,
    MakeSolver,
    MathematicalProgram,
    NloptSolver,
    SnoptSolver,
    SolutionResult,
    Solve,
    SolveInParallel,
    SolverId,
    SolverOptions,
)
from sheldrake.solvers._engines import quadratic
from sheldrake.solvers._engines.clarabel import ClarabelSolver as _Clarabel
from sheldrake.solvers._engines.columns import Columns
from sheldrake.solvers._engines.lemke import solve_lcp
from sheldrake.solvers._engines.quadratic import solve_rows
from sheldrake.solvers._engines.splitting import OsqpSolver as _Osqp
from sheldrake.solvers._engines.splitting import ScsSolver as _Scs
from sheldrake.symbolic import sin

needs_clarabel = pytest.mark.skipif(importlib.util.find_spec("clarabel") is None, reason="extra `solvers`")


def quadratic_program():
    """min |x - (1, 2, 3)|^2 with x in the simplex: the projection is (0, 0, 1)."""
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(3, "x")
    prog.AddQuadraticErrorCost(np.eye(3), [1, 2, 3.5], x)
    prog.AddLinearConstraint(x.sum() == 1)
    prog.AddBoundingBoxConstraint(0, np.inf, x)
    return prog, x


@needs_clarabel
def test_quadratic_programs_with_options_or_cones_go_to_clarabel():
    prog, x = quadratic_program()
    assert ChooseBestSolver(prog) == ClarabelSolver.id()
    options = SolverOptions()
    options.SetOption(ClarabelSolver.id(), "max_iter", 50)
    result = Solve(prog, None, options)
    assert result.is_success() and result.get_solver_id() == ClarabelSolver.id()
    np.testing.assert_allclose(result.GetSolution(x), [0, 0, 1], atol=1e-6)
    prog.AddLorentzConeConstraint(np.array([2.0 + 0.0 * x[0], x[1]]))
    result = Solve(prog)
    assert result.is_success() and result.get_solver_id() == ClarabelSolver.id()
    np.testing.assert_allclose(result.GetSolution(x), [0, 0, 1], atol=1e-6)


def test_without_clarabel_quadratic_programs_are_solved_and_the_result_says_by_whom(monkeypatch):
    for cls in (_Clarabel, _Osqp, _Scs):
        monkeypatch.setattr(cls, "_is_available", classmethod(lambda cls: False))
    prog, x = quadratic_program()
    options = SolverOptions()
    options.SetOption(ClarabelSolver.id(), "max_iter", 50)  # for whom the program is left then
    result = Solve(prog, None, options)
    assert result.is_success() and result.get_solver_id().name() == "SQP"
    np.testing.assert_allclose(result.GetSolution(x), [0, 0, 1], atol=1e-6)
    X = prog.NewSymmetricContinuousVariables(2, "X")
    prog.AddPositiveSemidefiniteConstraint(X)
    with pytest.raises(ValueError, match="clarabel"):
        Solve(prog)
    with pytest.raises(ValueError, match="pip install"):
        ClarabelSolver().Solve(prog)


@pytest.mark.parametrize("solver", [SnoptSolver, IpoptSolver, NloptSolver])
def test_nonlinear_solvers_satisfy_the_first_order_conditions(solver):
    if not solver().available():
        pytest.skip("not installed")
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2, "x")
    prog.AddCost(sin(x[0]) + (x[1] - 1) ** 2 * x[0] ** 2)
    c = prog.AddConstraint(x[0] ** 2 + x[1] ** 2 <= 2)
    prog.AddBoundingBoxConstraint(-1, 3, x[0])
    prog.SetInitialGuess(x, [0.4, 0.2])
    result = solver().Solve(prog)
    assert result.is_success()
    np.testing.assert_allclose(result.GetSolution(x), [-1, 1], atol=1e-4)  # where bound and circle meet
    assert result.EvalBinding(c)[0] <= 2 + 1e-6
    assert result.get_optimal_cost() == pytest.approx(np.sin(-1), abs=1e-6)


def test_variable_scaling_changes_the_path_and_not_the_answer():
    found = []
    for scale in (None, 1e3):
        prog = MathematicalProgram()
        x = prog.NewContinuousVariables(2, "x")
        prog.AddCost(((x[0] - 2000) / 1000) ** 4 + (x[1] - 1) ** 2)
        prog.AddConstraint(x[0] * x[1] >= 500)
        if scale:
            prog.SetVariableScaling(x[0], scale)
        prog.SetInitialGuess(x, [800, 1])
        found.append(SnoptSolver().Solve(prog).get_optimal_cost())
    np.testing.assert_allclose(found, 0.0, atol=1e-6)


def test_bounds_that_leave_nothing_do_not_make_all_other_constraints_look_violated():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2, "x")
    prog.AddBoundingBoxConstraint(1.0, 2.0, x[0]).evaluator().set_description("least")
    prog.AddBoundingBoxConstraint(-1.0, 0.0, x[0])
    prog.AddConstraint(x[0] ** 2 + x[1] ** 2 <= 1.0)
    for solver in (SnoptSolver(), IpoptSolver(), NloptSolver()):
        result = solver.Solve(prog)
        assert result.get_solution_result() is SolutionResult.kInfeasibleConstraints
        (name,) = result.GetInfeasibleConstraintNames(prog)
        assert name.startswith("least"), solver


def test_infeasible_nonlinear_programs_say_what_is_violated():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(1, "x")
    b = prog.AddConstraint(x[0] ** 2 <= -1)
    b.evaluator().set_description("impossible")
    result = SnoptSolver().Solve(prog, [0.3])
    assert not result.is_success()
    assert result.GetInfeasibleConstraintNames(prog)[0].startswith("impossible[0]: -inf <= ")


def test_lemke_answers_are_complementary():
    rng = np.random.default_rng(5)
    for n in (1, 2, 5, 12):
        A = rng.normal(size=(n, n))
        M, q = A @ A.T + 0.1 * np.eye(n), rng.normal(size=n)
        z = solve_lcp(M, q)
        w = M @ z + q
        assert z.min() >= 0 and w.min() >= -1e-9 and abs(z @ w) < 1e-9


def test_lemke_breaks_ties_and_finds_what_all_choices_of_rows_do():
    rng = np.random.default_rng(8)
    seen = 0
    for _ in range(60):
        n = int(rng.integers(2, 5))
        B = rng.integers(-1, 2, size=(n, n)).astype(float)
        M, q = B @ B.T + np.eye(n), rng.integers(-2, 2, size=n).astype(float)  # positive definite: there is one answer
        answers = []
        for bits in itertools.product((False, True), repeat=n):
            at, z = np.array(bits), np.zeros(n)
            z[at] = np.linalg.solve(M[np.ix_(at, at)], -q[at])
            if z.min() >= -1e-9 and (M @ z + q).min() >= -1e-9:
                answers.append(z)
        np.testing.assert_allclose(solve_lcp(M, q), answers[0], atol=1e-9)
        seen += len(answers) > 1  # of a degenerate one several choices give the same
    assert seen > 5


def test_lemke_stops_where_there_is_no_answer():
    assert solve_lcp(np.array([[-1.0]]), np.array([-1.0])) is None


def test_mixed_integer_programs():
    prog = MathematicalProgram()
    b = prog.NewBinaryVariables(4, "b")
    prog.AddLinearCost(-np.array([5, 4, 3, 6.0]), b)
    prog.AddLinearConstraint(np.array([[2, 3, 1, 4.0]]), [-np.inf], [5], b)
    result = Solve(prog)
    best = max((np.array([5, 4, 3, 6]) @ v, v) for v in np.ndindex(2, 2, 2, 2) if np.array([2, 3, 1, 4]) @ v <= 5)
    assert result.get_optimal_cost() == -best[0]
    np.testing.assert_array_equal(result.GetSolution(b), best[1])


def test_solvers_that_nothing_stands_behind_say_so():
    prog, _ = quadratic_program()
    assert not GurobiSolver().available()
    with pytest.raises(ValueError, match="GurobiSolver::available"):
        GurobiSolver().Solve(prog)
    with pytest.raises(ValueError, match="no matching solver foo"):
        MakeSolver(SolverId("foo"))
    with pytest.raises(RuntimeError, match="Gurobi"):
        MakeFirstAvailableSolver([GurobiSolver.id()])
    assert MakeFirstAvailableSolver([GurobiSolver.id(), SnoptSolver.id()]).SolverName() == "SNOPT"


@needs_clarabel
def test_options_reach_the_solver():
    prog, _ = quadratic_program()
    options = SolverOptions()
    options.SetOption(ClarabelSolver.id(), "max_iter", 1)
    assert Solve(prog, None, options).get_solution_result() is SolutionResult.kIterationLimit
    prog.SetSolverOption(ClarabelSolver.id(), "no_such_option", 1)
    with pytest.raises(RuntimeError, match="not recognized: no_such_option"):
        Solve(prog)


@pytest.mark.parametrize("solver", [ClarabelSolver, _Osqp, _Scs, NloptSolver], ids=lambda s: s.__name__)
def test_options_that_a_solver_does_not_know(solver):
    prog, _ = quadratic_program()
    options = SolverOptions()
    options.SetOption(solver.id(), "no_such_option", 1)
    if not solver().available():
        pytest.skip("not installed")
    with pytest.raises(RuntimeError, match="not recognized: no_such_option"):
        solver().Solve(prog, None, options)


@pytest.mark.parametrize("name", ["Major Iterations Limit", "major iterations limit", "Major iterations limit"])
def test_capitals_in_options_of_snopt(name):
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2)
    prog.AddCost((1 - x[0]) ** 2 + 100 * (x[1] - x[0] ** 2) ** 2)
    options = SolverOptions()
    options.SetOption(SnoptSolver.id(), name, 2)
    result = SnoptSolver().Solve(prog, [-1.0, 1.0], options)
    assert result.get_solution_result() is SolutionResult.kIterationLimit


def test_several_programs():
    programs = [quadratic_program()[0] for _ in range(3)]
    costs = [r.get_optimal_cost() for r in SolveInParallel(programs, solver_ids=[None, SnoptSolver.id(), None])]
    np.testing.assert_allclose(costs, costs[0], atol=1e-6)
    with pytest.raises(ValueError, match="2 initial_guesses"):
        SolveInParallel(programs, initial_guesses=[None, None])


@pytest.mark.parametrize("solver", [None, SnoptSolver.id()])
def test_several_programs_on_threads_are_solved_as_one_by_one(solver):
    rng, programs = np.random.default_rng(3), []
    for n in range(4, 12):
        prog = MathematicalProgram()
        x = prog.NewContinuousVariables(n)
        A = rng.normal(size=(n, n))
        prog.AddQuadraticCost(A.T @ A + np.eye(n), rng.normal(size=n), x)
        prog.AddLinearConstraint(rng.normal(size=(2 * n, n)), np.full(2 * n, -np.inf), np.ones(2 * n), x)
        programs.append(prog)
    programs.append(programs[0])
    alone = [solvers.MakeSolver(solver).Solve(prog) if solver else Solve(prog) for prog in programs]
    for threads in (1, 3, None):
        found = SolveInParallel(programs, solver_id=solver, parallelism=threads)
        assert [r.get_x_val().tolist() for r in found] == [r.get_x_val().tolist() for r in alone]


def test_programs_with_python_functions_are_solved_by_the_calling_thread():
    seen = set()

    def cost(x):
        seen.add(threading.get_ident())
        return (x[0] - 1.0) ** 2

    programs = [quadratic_program()[0]]
    for _ in range(3):
        prog = MathematicalProgram()
        prog.AddCost(cost, prog.NewContinuousVariables(1))
        programs.append(prog)
    assert all(r.is_success() for r in SolveInParallel(programs, parallelism=3))
    assert seen == {threading.get_ident()}


def test_programs_without_python_functions_are_solved_on_threads(monkeypatch):
    """Two are being solved at the same moment: each waits for the other."""
    both, solve = threading.Barrier(2, timeout=20.0), SnoptSolver.Solve

    def meeting(*args):
        both.wait()
        return solve(*args)

    monkeypatch.setattr(SnoptSolver, "Solve", meeting)
    programs = [quadratic_program()[0] for _ in range(2)]
    assert all(r.is_success() for r in SolveInParallel(programs, solver_id=SnoptSolver.id(), parallelism=2))


def test_callbacks_see_the_iterates():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(1, "x")
    seen = []
    prog.AddCost((x[0] - 1) ** 4)
    prog.AddVisualizationCallback(lambda v: seen.append(v[0]), x)
    assert Solve(prog, [4.0]).is_success()
    assert len(seen) > 3 and abs(seen[-1] - 1) < abs(seen[0] - 1)


def test_the_choice_is_by_program_type():
    prog, x = quadratic_program()
    prog.AddConstraint(sin(x[0]) <= 0.5)
    assert solvers.GetProgramType(prog) is solvers.ProgramType.kNLP
    assert ChooseBestSolver(prog).name() == "InteriorPoint"


def test_a_small_quadratic_program_is_solved_in_few_calls():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(3)
    prog.AddQuadraticCost(np.eye(3), np.ones(3), x)
    prog.AddBoundingBoxConstraint(-0.5, 0.5, x)
    prog.AddLinearConstraint(np.ones((1, 3)), [-1.0], [1.0], x)
    assert calls_of(lambda: ClarabelSolver().Solve(prog)) <= 800


def test_triplets_are_compressed_as_scipy_does():
    rng = np.random.default_rng(0)
    for count in (0, 1, 40):
        rows, cols, values = rng.integers(0, 5, count), rng.integers(0, 4, count), rng.normal(size=count)
        ours, scipys = Columns.of_triplets(rows, cols, values, (5, 4)), csc_matrix((values, (rows, cols)), shape=(5, 4))
        assert (ours.indptr == scipys.indptr).all() and (ours.indices == scipys.indices).all()
        assert ours.data == pytest.approx(scipys.data, abs=1e-15)


def small_programs(count):
    """Costs with and without curvature, rows that hold, bounds that meet; every tenth cannot be met."""
    rng = np.random.default_rng(3)
    for i in range(count):
        n = rng.integers(2, 12)
        P = rng.normal(size=(rng.integers(0, n + 1), n))
        A = np.vstack((rng.normal(size=(rng.integers(n, 3 * n), n)), np.eye(n)))
        inside = A @ rng.normal(size=n)
        room = rng.uniform(0.0, 2.0, size=inside.size)
        lower = np.where(rng.integers(0, 3, size=room.size) > 0, inside - room, -np.inf)
        upper = inside + rng.uniform(0.0, 2.0, size=room.size)
        lower[-n:], upper[-n:] = inside[-n:] - 3.0, inside[-n:] + 3.0
        equal = rng.integers(0, max(1, n // 2))
        lower[:equal] = upper[:equal] = inside[:equal]
        if i % 10 == 9:
            lower[-1] = upper[-1] = inside[-1] + 4.0
            A[-2], lower[-2], upper[-2] = A[-1], inside[-1], inside[-1] + 3.0
        yield P.T @ P, rng.normal(size=n), A, lower, upper


def least(Q, q, A, lower, upper):
    """The x with the least 1/2 x' Q x + q' x and lower <= A x <= upper."""
    equal = lower == upper
    below, above = ~equal & (upper < np.inf), ~equal & (lower > -np.inf)
    b = np.concatenate((upper[equal], upper[below], -lower[above]))
    return solve_rows(Q, q, np.concatenate((A[equal], A[below], -A[above])), b, int(np.count_nonzero(equal)))


def test_small_quadratic_programs_take_no_solver(monkeypatch):
    """The same as Clarabel's but to rounding; it may be asked only where nothing was found, thus of what has no x."""
    answers, original = [], quadratic.solve_dense

    def answer(*arrays):
        answers.append(original(*arrays))
        return answers[-1]

    missed = 0
    for arrays in small_programs(300):
        Q, q, A, lower, upper = arrays
        monkeypatch.setattr(quadratic, "solve_dense", lambda *arrays: None)
        expected = least(*arrays)
        monkeypatch.setattr(quadratic, "solve_dense", answer)
        found = least(*arrays)
        assert (found is None) == (expected is None)
        if answers[-1] is None:
            missed += found is not None
            continue
        cost, theirs = (0.5 * x @ Q @ x + q @ x for x in (found, expected))
        assert cost == pytest.approx(theirs, rel=2e-8, abs=2e-8)
        within = 2e-9 * (1.0 + np.abs(found).max())
        assert np.all(A @ found >= lower - within) and np.all(A @ found <= upper + within)
    assert missed <= 6


def test_quadratic_programs_as_arrays(monkeypatch):
    rng = np.random.default_rng(7)
    M, A = rng.normal(size=(4, 4)), rng.normal(size=(5, 4))
    lower, upper = np.array([0.5, -np.inf, -1.0, 0.2, -np.inf]), np.array([0.5, 1.0, np.inf, 0.4, np.inf])
    arrays = M.T @ M, rng.normal(size=4), A, lower, upper
    at_once = least(*arrays)
    apart = np.array([1.0, -2.0]), np.array([2.0, 0.0])
    assert least(np.eye(1), np.zeros(1), np.ones((2, 1)), *apart) is None
    monkeypatch.setattr(_Clarabel, "_is_available", classmethod(lambda cls: False))
    np.testing.assert_allclose(at_once, least(*arrays), atol=1e-5)  # OSQP stops sooner


def test_a_semidefinite_program_is_solved_without_loading_scipys_linear_algebra():
    """What Clarabel takes of `scipy.linalg` is in two of its modules; who imports it later gets all of it."""
    program = """
import sys
import numpy as np
from sheldrake.solvers import ClarabelSolver, MathematicalProgram
prog = MathematicalProgram()
X = prog.NewSymmetricContinuousVariables(5)
prog.AddPositiveSemidefiniteConstraint(X)
prog.AddPositiveSemidefiniteConstraint(X - np.eye(5))
prog.AddLinearCost(np.trace(X) + X[0, 4])
result = ClarabelSolver().Solve(prog)
assert result.is_success() and abs(result.get_optimal_cost() - 5.0) < 1e-6, result.get_optimal_cost()
assert not [name for name in sys.modules if name.startswith("scipy.linalg")]
import scipy.linalg
assert scipy.linalg.cython_blas.__pyx_capi__ and scipy.linalg.cython_lapack.__pyx_capi__
"""
    subprocess.run([sys.executable, "-c", program], check=True, timeout=120)


@pytest.mark.parametrize("curvature, kind", [(1.0, "kSolutionFound"), (0.0, "kUnbounded")])
def test_scs_takes_programs_without_constraints(curvature, kind):
    pytest.importorskip("scs")
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2)
    prog.AddQuadraticCost(np.diag([1.0, curvature]), np.ones(2), x)
    result = _Scs().Solve(prog)
    assert result.get_solution_result().name == kind
    if curvature:
        np.testing.assert_allclose(result.GetSolution(x), [-1.0, -1.0], atol=1e-6)
