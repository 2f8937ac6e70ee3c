"""Relaxed rotation matrices: the same least values of linear costs, by one solver for both programs."""

import importlib

import numpy as np
import pytest
from tests.crosscheck.pydrake.mixed_integer import least

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")

ROTATION = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]]) + 1e-3
APPROACHES = ("kBilinearMcCormick", "kBoxSphereIntersection", "kBoth")


def program(name, approach, intervals, binning):
    """A program of either library as arrays, and the places of the matrix in it."""
    s = importlib.import_module(f"{name}.solvers")
    Generator = s.MixedIntegerRotationConstraintGenerator
    prog = s.MathematicalProgram()
    R = prog.NewContinuousVariables(3, 3, "R")
    generator = Generator(getattr(Generator.Approach, approach), intervals, getattr(s.IntervalBinning, binning))
    added = generator.AddToProgram(R, prog)
    shapes = (np.shape(added.B_), np.shape(added.lambda_), generator.phi(), generator.phi_nonnegative())
    return prog, [prog.FindDecisionVariableIndex(v) for v in R.ravel()], shapes


CASES = [(a, 1, b) for a in APPROACHES for b in ("kLogarithmic", "kLinear")]
CASES += [("kBoxSphereIntersection", 2, "kLogarithmic"), ("kBoxSphereIntersection", 2, "kLinear")]


@pytest.mark.parametrize(("approach", "intervals", "binning"), CASES)
def test_least_values_are_pydrakes(approach, intervals, binning):
    ours, places, shapes = program("sheldrake", approach, intervals, binning)
    theirs, their_places, their_shapes = program("pydrake", approach, intervals, binning)
    assert shapes[:2] == their_shapes[:2]
    np.testing.assert_allclose(np.concatenate(shapes[2:]), np.concatenate(their_shapes[2:]), atol=1e-15)
    if intervals > 1:  # One orthant for each column: that is enough, and fast.
        for prog, where in ((ours, places), (theirs, their_places)):
            x = prog.decision_variables()[where].reshape(3, 3)
            for element, sign in zip(x.ravel(), (ROTATION > 0).ravel()):
                prog.AddBoundingBoxConstraint(0.0 if sign else -1.0, 1.0 if sign else 0.0, element)
    for cost in np.random.default_rng(7).normal(size=(1, 9)):
        assert least(ours, places, cost) == pytest.approx(least(theirs, their_places, cost), abs=2e-5)


def test_a_planted_fault_is_caught():
    ours, places, _ = program("sheldrake", "kBoth", 1, "kLinear")
    theirs, their_places, _ = program("pydrake", "kBoth", 1, "kLinear")
    cost = np.random.default_rng(7).normal(size=9)
    first = ours.decision_variables()[places[0]]
    ours.AddBoundingBoxConstraint(-0.4, 0.4, first)
    assert least(ours, places, cost) > least(theirs, their_places, cost) + 1e-3
