"""A result names what found it."""

import numpy as np
import pytest

from sheldrake.solvers import (
    ClpSolver,
    MathematicalProgram,
    MobyLcpSolver,
    SolverId,
    UnrevisedLemkeSolver,
)
from sheldrake.solvers._engines.equality import LinearSystemSolver


def linear():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2)
    prog.AddBoundingBoxConstraint(0.0, 1.0, x)
    prog.AddLinearCost(x[0] - x[1])
    return prog


def complementary():
    prog = MathematicalProgram()
    prog.AddLinearComplementarityConstraint(np.eye(2), np.array([-1.0, 2.0]), prog.NewContinuousVariables(2))
    return prog


def system():
    prog = MathematicalProgram()
    prog.AddLinearEqualityConstraint(prog.NewContinuousVariables(1)[0] == 2.0)
    return prog


@pytest.mark.parametrize(
    ("solver", "make", "ran"),
    [
        (ClpSolver, linear, SolverId("HiGHS")),
        (MobyLcpSolver, complementary, UnrevisedLemkeSolver.id()),
        (UnrevisedLemkeSolver, complementary, UnrevisedLemkeSolver.id()),
        (LinearSystemSolver, system, LinearSystemSolver.id()),
    ],
)
def test_results_name_what_ran(solver, make, ran):
    result = solver().Solve(make())
    assert result.is_success() and result.get_solver_id() == ran
