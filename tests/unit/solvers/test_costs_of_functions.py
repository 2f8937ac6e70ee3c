"""Costs that are functions of Python, of which only gradients are known."""

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.math import cos, sin
from sheldrake.solvers import MathematicalProgram, Solve
from sheldrake.solvers._engines.terms import LearnedTerms


def tip(q):
    """Where a planar arm of links of 0.3 m ends."""
    angles = np.cumsum(q)
    value = [float(a) if not isinstance(a, AutoDiffXd) else a for a in angles]
    return [0.3 * sum(cos(a) for a in value), 0.3 * sum(sin(a) for a in value)]


@pytest.mark.parametrize("weight", [1.0, 30.0, 1e3])
@pytest.mark.parametrize("joints", [3, 6])
def test_a_posture_is_found_near_where_the_search_began(weight, joints):
    """Without bounds nothing but the cost says how far a step may go."""
    prog = MathematicalProgram()
    q = prog.NewContinuousVariables(joints)
    prog.AddConstraint(tip, lb=[0.2, 0.3], ub=[0.25, 0.35], vars=q)
    prog.AddCost(lambda v: weight * (v - 0.1).dot(v - 0.1), vars=q)
    prog.SetInitialGuess(q, np.full(joints, 0.2))
    result = Solve(prog)
    assert result.is_success()
    found = result.GetSolution(q)
    assert np.abs(found).max() < np.pi
    # At a minimum the gradient is a combination of those of the two rows: these have rank 2 of `joints`.
    angles = np.cumsum(found)
    J = 0.3 * np.array(
        [[-np.sin(angles[i:]).sum() for i in range(joints)], [np.cos(angles[i:]).sum() for i in range(joints)]]
    )
    gradient = 2.0 * (found - 0.1)
    left = gradient - J.T @ np.linalg.lstsq(J.T, gradient, rcond=None)[0]
    assert np.abs(left).max() < 1e-4 * np.abs(gradient).max()


def test_curvature_is_known_from_the_first_point_on():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(3)
    evaluator = prog.AddCost(lambda v: 5.0 * v.dot(v) + v[0], vars=x).evaluator()
    for are_costs, expected in ((True, 10.0 * np.eye(3)), (False, np.zeros((3, 3)))):
        terms = LearnedTerms([[evaluator]], np.arange(3)[None], np.zeros((1, 1), int), are_costs)
        terms.slopes(np.array([1.0, -2.0, 3.0]))
        H = terms.hessian(np.zeros(3), np.ones(1)).reshape(3, 3)
        np.testing.assert_allclose(H, expected, rtol=1e-6, atol=1e-12)
