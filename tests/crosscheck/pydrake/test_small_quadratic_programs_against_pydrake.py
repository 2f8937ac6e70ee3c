"""Small quadratic programs have Drake's solutions, costs and duals."""

import pydrake.solvers as drake
import pytest
from tests.unit.solvers.test_small_quadratic_programs import KINDS, OURS, compare, some_program

from sheldrake.solvers import Solve


@pytest.mark.parametrize("kind", KINDS)
def test_solutions_and_duals_are_those_of_drake(kind):
    for seed in range(80, 140):
        (prog, rows), (theirs, their_rows) = some_program(kind, seed), some_program(kind, seed, drake)
        found, wanted = Solve(prog), drake.Solve(theirs)
        assert found.is_success() == wanted.is_success(), seed
        if found.get_solver_id().name() in OURS:
            compare(found, wanted, rows, their_rows, seed)
