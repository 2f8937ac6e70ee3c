"""What a constraint says of bounds whose size is not its own."""

import numpy as np
import pytest

from sheldrake.solvers import BoundingBoxConstraint, LinearConstraint, LinearEqualityConstraint, MathematicalProgram

ONE, TWO, THREE = np.ones(1), np.ones(2), np.ones(3)


@pytest.mark.parametrize(
    "make",
    [
        lambda prog, x: BoundingBoxConstraint(TWO, THREE),
        lambda prog, x: LinearConstraint(np.eye(2), THREE, TWO),
        lambda prog, x: LinearEqualityConstraint(np.eye(2), THREE),
        lambda prog, x: prog.AddLinearConstraint(np.eye(2), TWO, THREE, x),
        lambda prog, x: prog.AddConstraint(lambda z: z, TWO, ONE, x),
    ],
)
def test_a_new_constraint_is_a_value_error(make):
    prog = MathematicalProgram()
    with pytest.raises(ValueError, match="bound"):
        make(prog, prog.NewContinuousVariables(2))


@pytest.mark.parametrize("change", ["UpdateLowerBound", "UpdateUpperBound"])
def test_a_change_of_bounds_is_a_runtime_error_and_changes_nothing(change):
    constraint = LinearConstraint(np.eye(2), TWO, 2.0 * TWO)
    with pytest.raises(RuntimeError, match=r"expects bounds of size 2, got a .* size 3"):
        getattr(constraint, change)(THREE)
    assert constraint.lower_bound().tolist() == [1.0, 1.0] and constraint.upper_bound().tolist() == [2.0, 2.0]
