"""What the error for a mixed-integer program advises is what solves it."""

import re

import numpy as np
import pytest

from sheldrake import solvers
from sheldrake.solvers import ChooseBestSolver, MathematicalProgram


@pytest.mark.parametrize("kind", ["MISOCP", "MIQP"])
def test_the_advice_works(kind):
    prog = MathematicalProgram()
    x, b = prog.NewContinuousVariables(2, "x"), prog.NewBinaryVariables(2, "b")
    if kind == "MISOCP":
        prog.AddLorentzConeConstraint(np.array([1.0 + b[0], x[0], x[1]]))
        prog.AddLinearCost(-x[0] - x[1] + 0.5 * b[0] + b[1])
        expected = 2 * -np.sqrt(2.0) + 0.5
    else:
        prog.AddQuadraticCost((x[0] - b[0]) ** 2 + (x[1] - 0.6) ** 2 + (b[1] - 0.2) ** 2)
        expected = 0.04
    with pytest.raises(ValueError, match="no available solver") as error:
        ChooseBestSolver(prog)
    assert f"a {kind} with 2 of them" in str(error.value)
    advice = re.search(r"search = .*search\.GetSolution\(x\)", str(error.value)).group()
    space = {"prog": prog, "x": x, **vars(solvers)}
    exec(advice, space)
    np.testing.assert_allclose(space["search"].GetOptimalCost(), expected, atol=1e-6)
