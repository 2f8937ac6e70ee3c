"""Options of SNOPT are told by the beginnings of two words; what is no option is refused."""

import pytest

from sheldrake.solvers import MathematicalProgram, SnoptSolver, SolutionResult, Solve, SolverOptions
from sheldrake.solvers._engines.snopt_options import words_of


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("Major iterations limit", ("major", "iterations")),
        ("MAJ  ITER", ("major", "iterations")),
        ("Iterations limit", ("iterations", "")),
        ("Timing level", ("timing", "")),
        ("Feas point", ("feasible", "point")),
        ("Feasible exit", None),
        ("Major", None),
        ("Major_iterations_limit", None),
        ("Majr iterations limit", None),
        ("Line search", None),
        ("", None),
    ],
)
def test_words(name, words):
    assert words_of(name) == words


def program():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2)
    prog.AddCost((1 - x[0]) ** 2 + 100 * (x[1] - x[0] ** 2) ** 2)
    return prog


def test_what_is_no_option_is_refused():
    options = SolverOptions()
    options.SetOption(SnoptSolver.id(), "Mayor iterations limit", 2)
    for solve in (SnoptSolver().Solve, Solve):
        with pytest.raises(RuntimeError, match="not recognized: Mayor iterations limit"):
            solve(program(), [0.0, 0.0], options)


def test_short_names_are_heeded():
    options = SolverOptions()
    options.SetOption(SnoptSolver.id(), "Maj iter", 2)
    result = SnoptSolver().Solve(program(), [-1.0, 1.0], options)
    assert result.get_solution_result() is SolutionResult.kIterationLimit
