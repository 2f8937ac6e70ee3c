"""Files of semidefinite programs."""

import numpy as np
import pytest

from sheldrake.solvers import GenerateSDPA, MathematicalProgram, RemoveFreeVariableMethod


def test_the_largest_eigenvalue(tmp_path):
    """The least t with t I - F >= 0 is written as a program without t."""
    prog = MathematicalProgram()
    t = prog.NewContinuousVariables(1)
    F = np.array([[2.0, 1.0], [1.0, 3.0]])
    prog.AddLinearMatrixInequalityConstraint([-F, np.eye(2)], t)
    prog.AddLinearCost(t[0])
    assert GenerateSDPA(prog, str(tmp_path / "eigenvalue"), RemoveFreeVariableMethod.kTwoSlackVariables)
    lines = (tmp_path / "eigenvalue.dat-s").read_text().splitlines()
    assert lines[:4] == ["3", "2", "2 -2 ", "2.0 1.0 3.0"]
    assert "1 2 1 1 1.0" in lines and "1 2 2 2 -1.0" in lines and "0 2 1 1 -1.0" in lines


def test_what_the_format_does_not_have(tmp_path):
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2)
    prog.AddQuadraticCost(x[0] ** 2 + x[1])
    with pytest.raises(ValueError, match="cannot be formulated as an SDP"):
        GenerateSDPA(prog, str(tmp_path / "x"))


def test_a_file_that_cannot_be_written(tmp_path, caplog):
    assert not GenerateSDPA(MathematicalProgram(), str(tmp_path / "nowhere" / "x"))
    assert "Cannot open the file" in caplog.text


def test_unbounded_free_variables_are_told(tmp_path, caplog):
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2)
    prog.AddLinearCost(x[0])
    prog.AddLinearEqualityConstraint(x[0] + x[1] == 1)
    assert not GenerateSDPA(prog, str(tmp_path / "x"), RemoveFreeVariableMethod.kNullspace)
    assert "unbounded" in caplog.text and not list(tmp_path.iterdir())
