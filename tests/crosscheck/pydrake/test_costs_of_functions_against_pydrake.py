"""Costs and constraints that are functions of Python: the minima that Drake's solver finds are found."""

import importlib
import warnings

import numpy as np
import pytest

pytest.importorskip("pydrake")
pytestmark = pytest.mark.peer
OURS, THEIRS = (importlib.import_module(f"{name}.all") for name in ("sheldrake", "pydrake"))


def random_program(m, seed):
    """A smooth cost without bounds that say how far to go, and now and then constraints with sines in them."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 9))
    prog = m.MathematicalProgram()
    x = prog.NewContinuousVariables(n)
    A, a, w = rng.normal(size=(n, n)), rng.normal(size=n), rng.uniform(0.2, 3.0, n)

    def sines(v):
        return np.array([np.sin(t) if isinstance(t, float) else m.sin(t) for t in v])

    costs = (
        lambda v: (v - a).dot(v - a),
        lambda v: (v - a).dot((A.T @ A + 0.1 * np.eye(n)).dot(v - a)),
        lambda v: (w * (v - a) ** 2).sum() + 0.3 * (sines(v) * w).sum(),
        lambda v: sum(100 * (v[i + 1] - v[i] ** 2) ** 2 + (1 - v[i]) ** 2 for i in range(n - 1)),
        lambda v: ((v - a) ** 4).sum() + (v - a).dot(v - a),
        lambda v: 1e3 * (v - a).dot(v - a),
        lambda v: 1e-3 * (w * (v - a) ** 2).sum(),
    )
    prog.AddCost(costs[seed % len(costs)], vars=x)
    if seed % 3:
        rows = int(rng.integers(1, n))
        C, b = rng.normal(size=(rows, n)), 0.5 * rng.normal(size=rows)
        upper = np.zeros(rows) if seed % 2 else np.full(rows, np.inf)
        lower = np.zeros(rows) if seed % 2 else np.full(rows, -0.1)
        prog.AddConstraint(lambda v: C.dot(sines(v)) + 0.3 * C.dot(v) - b, lb=lower, ub=upper, vars=x)
    if seed % 5 == 0:
        prog.AddBoundingBoxConstraint(-1, 1, x)
    prog.SetInitialGuess(x, rng.normal(size=n))
    return prog


def test_minima_of_random_programs():
    others = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # NumPy's, about what it makes of expressions
        for seed in range(70):
            ours, theirs = (m.Solve(random_program(m, seed)) for m in (OURS, THEIRS))
            costs = ours.get_optimal_cost(), theirs.get_optimal_cost()
            same_or_better = ours.is_success() and costs[0] <= costs[1] + 1e-4 * (1.0 + abs(costs[1]))
            if theirs.is_success() and not same_or_better:
                others.append((seed, *costs))
    assert len(others) <= 4, others  # these have several minima, and feasible points far away
