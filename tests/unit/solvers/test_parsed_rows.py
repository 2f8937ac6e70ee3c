"""Constraints and costs that were parsed keep their numbers; arrays are made for those who ask, and for who changes."""

import copy
import pickle

import numpy as np
import pytest

from sheldrake.solvers import (
    BoundingBoxConstraint,
    LinearConstraint,
    LinearEqualityConstraint,
    MathematicalProgram,
    QuadraticCost,
    Solve,
)


def variables():
    prog = MathematicalProgram()
    return prog, prog.NewContinuousVariables(3, "x")


def constraints_of(prog, x):
    return [
        prog.AddLinearConstraint(2.0 * x[2] - x[0] + 1.0 == 3.0 * x[1]),
        prog.AddLinearConstraint(x[0] + 2.0 * x[1] <= 3.0),
        prog.AddLinearConstraint(-4.0 * x[1] <= 2.0),
        prog.AddLinearConstraint(2.0 * (x[0] - x[2] - 1.0), -1.0, 5.0),
    ]


KINDS = [LinearEqualityConstraint, LinearConstraint, BoundingBoxConstraint, LinearConstraint]
MATRICES = [[[-1.0, -3.0, 2.0]], [[1.0, 2.0]], [[1.0]], [[2.0, -2.0]]]
BOUNDS = [(-1.0, -1.0), (-np.inf, 3.0), (-0.5, np.inf), (1.0, 7.0)]


def test_rows_are_as_they_were_written():
    prog, x = variables()
    for b, kind, A, (low, high) in zip(constraints_of(prog, x), KINDS, MATRICES, BOUNDS):
        c = b.evaluator()
        assert type(c) is kind and c.num_vars() == len(A[0]) and c.get_description() == ""
        np.testing.assert_array_equal(c.GetDenseA(), A)
        np.testing.assert_array_equal([*c.lower_bound(), *c.upper_bound()], [low, high])
        np.testing.assert_array_equal(c.Eval(np.ones(len(A[0]))), np.sum(A, axis=1))
        assert c.CheckSatisfied(np.zeros(len(A[0]))) == (low <= 0.0 <= high)


def test_a_row_without_arrays_is_copied_and_pickled():
    prog, x = variables()
    for b, A in zip(constraints_of(prog, x), MATRICES):
        for other in (
            copy.copy(b.evaluator()),
            copy.deepcopy(b.evaluator()),
            pickle.loads(pickle.dumps(b.evaluator())),
        ):
            np.testing.assert_array_equal(other.GetDenseA(), A)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = prog.linear_constraints()[0].evaluator().nothing
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = prog.linear_constraints()[0].nothing


def test_an_infinite_coefficient_is_refused():
    prog, x = variables()
    with pytest.raises(RuntimeError, match="not finite"):
        prog.AddLinearConstraint(np.inf * x[0] + x[1] <= 1.0)


@pytest.mark.parametrize("first", [False, True])
def test_changes_of_rows_and_costs_count(first):
    """Whether the program was solved before or not."""
    prog, x = variables()
    equation, row, box, _ = (b.evaluator() for b in constraints_of(prog, x))
    cost = prog.AddQuadraticCost((x[0] - 2.0) ** 2 + x[1] ** 2 + x[0] * x[2] + x[2] ** 2).evaluator()
    plain = prog.AddCost(x[1] ** 2).evaluator()
    for _ in range(2 if first else 0):
        assert Solve(prog).is_success()
    row.UpdateUpperBound([1.5])
    box.set_bounds([0.1], [0.2])
    equation.UpdateCoefficients([[1.0, 1.0, 1.0]], [1.0])
    cost.update_linear_coefficient_entry(0, -1.0)
    plain.UpdateHessianEntry(0, 0, 8.0)
    np.testing.assert_array_equal(cost.Q(), [[2.0, 0.0, 1.0], [0.0, 2.0, 0.0], [1.0, 0.0, 2.0]])
    np.testing.assert_array_equal(cost.b(), [-1.0, 0.0, 0.0])
    new = MathematicalProgram()
    new.AddDecisionVariables(x)
    new.AddLinearEqualityConstraint(np.ones((1, 3)), np.ones(1), x)
    new.AddLinearConstraint(np.array([[1.0, 2.0]]), [-np.inf], [1.5], x[:2])
    new.AddLinearConstraint(np.array([[2.0, -2.0]]), [1.0], [7.0], x[[0, 2]])
    new.AddBoundingBoxConstraint([0.1], [0.2], x[1:2])
    new.AddQuadraticCost(cost.Q(), cost.b(), cost.c(), x)
    new.AddQuadraticCost([[8.0]], [0.0], x[1:2])
    again, anew = Solve(prog), Solve(new)
    assert again.is_success() and again.get_solver_id() == anew.get_solver_id()
    np.testing.assert_array_equal(again.GetSolution(x), anew.GetSolution(x))
    assert again.get_optimal_cost() == anew.get_optimal_cost()


def test_costs_of_few_variables():
    prog, x = variables()
    e = 3.0 * (x[2] ** 2 - 2.0 * x[0] * x[2] + x[0] + 5.0)
    for cost in (prog.AddQuadraticCost(e), prog.AddCost(e)):
        c = cost.evaluator()
        assert type(c) is QuadraticCost and not c.is_convex()
        np.testing.assert_array_equal(c.Q(), [[0.0, -6.0], [-6.0, 6.0]])
        np.testing.assert_array_equal(c.b(), [3.0, 0.0])
        assert c.c() == 15.0 and [v.get_id() for v in cost.variables()] == [x[0].get_id(), x[2].get_id()]
        np.testing.assert_array_equal(copy.deepcopy(c).Q(), c.Q())
    assert prog.AddQuadraticCost(x.dot(x)).evaluator().is_convex()
    assert not prog.AddQuadraticCost(x[0] ** 2 - x[1] ** 2).evaluator().is_convex()
    assert not prog.AddQuadraticCost(x[0] ** 2, False).evaluator().is_convex()  # as the user says


def test_variables_are_those_of_the_call():
    """Also when the array they came in is changed later."""
    prog, x = variables()
    given = x.copy()
    b = prog.AddLinearConstraint(np.ones(3), -1.0, 1.0, given)
    given[0] = x[2]
    assert [v.get_id() for v in b.variables()] == [v.get_id() for v in x]
    assert str(b) == str(prog.AddLinearConstraint(np.ones((1, 3)), [-1.0], [1.0], x))


def test_bounds_that_are_no_numbers_are_refused():
    prog, x = variables()
    with pytest.raises(RuntimeError, match="nan"):
        prog.AddBoundingBoxConstraint(np.nan, 1.0, x[0])
    with pytest.raises(RuntimeError, match="nan"):
        prog.AddLinearConstraint(np.ones(3), -1.0, np.nan, x)
    assert not prog.GetAllConstraints()


@pytest.mark.parametrize("scale", [1.0, -1.0, 0.25])
def test_squares_alone_are_a_diagonal_in_the_order_of_variables(scale):
    prog, x = variables()
    cost = prog.AddQuadraticCost(3.0 * x[2] ** 2 + scale * x[0] ** 2 + 4.0)
    assert [v.get_name() for v in cost.variables()] == ["x(0)", "x(2)"]
    np.testing.assert_array_equal(cost.evaluator().Q(), np.diag([2.0 * scale, 6.0]))
    np.testing.assert_array_equal(cost.evaluator().b(), np.zeros(2))
    assert cost.evaluator().c() == 4.0 and cost.evaluator().is_convex() == (scale > 0.0)


def test_names_of_many_variables_and_of_few_are_alike():
    prog = MathematicalProgram()
    few, many = prog.NewContinuousVariables(3, 2, "x"), prog.NewContinuousVariables(3, 500, "x")
    assert [v.get_name() for v in few.ravel()] == [v.get_name() for v in many[:, :2].ravel()]
    again = prog.NewContinuousVariables(3, 2, "x")
    assert again[2, 1].get_name() == "x(2,1)" and again[2, 1].get_id() != few[2, 1].get_id()
