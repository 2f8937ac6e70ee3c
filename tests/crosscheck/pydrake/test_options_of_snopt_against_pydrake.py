"""Names of SNOPT's options that are taken or refused are those that pydrake's SNOPT takes or refuses."""

import importlib

import pytest

pytest.importorskip("pydrake")

pytestmark = pytest.mark.peer

NAMES = (
    "Major iterations limit|major ITERATIONS limit|Maj iter|Major iterations  bogus|Iterations bogus|"
    "Major optimality tolerance|Maj opt|Major feasibility tolerance|Major print level|Minor iterations|"
    "Scale option|Linesearch tolerance|Hessian full memory|LU factor tolerance|Penalty parameter|Time limit|"
    "Superbasics limit|Verify level|Elastic weight|Function precision|Unbounded step size|Derivative option|Debug|"
    "Solution no|System information|Proximal point method|Feasible point|Infinite bound|QPSolver CG|"
    "Bogus option|Majr iterations limit|Major|Major_iterations_limit|Line search|Feasible exit|Hessian|Scale|"
    "Verify bogus|Elastic|Print|Total|Unbounded|Factorize frequency|Itns|Cycle limit|Radius"
).split("|")


def taken(library, name):
    m = importlib.import_module(f"{library}.solvers")
    prog = m.MathematicalProgram()
    x = prog.NewContinuousVariables(1)
    prog.AddQuadraticCost((x[0] - 1) ** 2)
    prog.SetSolverOption(m.SnoptSolver.id(), name, 1)
    try:
        m.SnoptSolver().Solve(prog)
    except RuntimeError:
        return False
    return True


@pytest.mark.parametrize("name", NAMES)
def test_names(name):
    assert taken("sheldrake", name) is taken("pydrake", name)
