"""Sparse derivatives of programs against differences, and the sparse factors that solvers stand on."""

import numpy as np
import pytest

from sheldrake.examples import AcrobotPlant
from sheldrake.planning import DirectCollocation, DirectTranscription
from sheldrake.planning._gcs_subgraphs import (
    NonlinearContinuityConstraint,
    NonlinearDerivativeConstraint,
    derivative_matrix,
)
from sheldrake.solvers import MathematicalProgram
from sheldrake.solvers._engines import functions
from sheldrake.solvers._engines.interior_point import Factors
from sheldrake.solvers._engines.nonlinear import Settings
from sheldrake.solvers._engines.nonlinear_form import NonlinearForm
from sheldrake.solvers._engines.sqp import Sqp
from sheldrake.solvers._engines.terms import AlikeTerms, LearnedTerms
from sheldrake.solvers._kernels import barrier
from sheldrake.symbolic import cos, log, pow, sin, sqrt


def of_all_kinds():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(6, "x")
    prog.AddLinearCost(2.0 * x[0] - x[3])
    prog.AddQuadraticCost((x[1] - x[2]) ** 2 + 3.0 * x[4] ** 2)
    prog.AddCost(sin(x[0]) * x[1] + log(2.0 + x[5] ** 2))
    prog.AddLinearConstraint(x[0] + 2.0 * x[5] <= 3.0)
    prog.AddQuadraticConstraint(np.eye(2), np.ones(2), -np.inf, 4.0, x[2:4])
    for i in range(4):
        prog.AddConstraint(cos(x[i]) * x[i + 1] + sqrt(1.5 + x[i + 2]) - pow(2.0 + x[i], 1.5) <= 1.0)
    prog.SetVariableScaling(x[2], 10.0)
    return prog, np.array([0.3, -0.2, 0.04, 0.5, 0.1, -0.4])


def collocation():
    plant = AcrobotPlant()
    prog = DirectCollocation(plant, plant.CreateDefaultContext(), 6, 0.05, 0.2).prog()
    return prog, np.random.default_rng(2).uniform(0.1, 0.5, prog.num_vars())


def transcription():
    plant = AcrobotPlant()
    prog = DirectTranscription(plant, plant.CreateDefaultContext(), 6, DirectTranscription.TimeStep(0.1)).prog()
    return prog, np.random.default_rng(2).uniform(0.1, 0.5, prog.num_vars())


def curves():
    """Lengths, and derivatives of Bézier curves in regions."""
    rng = np.random.default_rng(3)
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(12, "x")
    for i in range(3):
        prog.AddL2NormCost(rng.normal(size=(2, 4)), rng.normal(size=2), x[i : i + 4])
        bounds = NonlinearDerivativeConstraint(derivative_matrix(4, 2 + i % 2), -1.5, 2.0, 2 + i % 2)
        prog.AddConstraint(bounds, x[2 * i : 2 * i + 6])
        last, first = rng.normal(size=4), rng.normal(size=3)
        prog.AddConstraint(NonlinearContinuityConstraint(last, first, 1 + i), x[i : i + 9])
    return prog, rng.uniform(0.5, 1.5, 12)


@pytest.mark.parametrize("make", [of_all_kinds, collocation, transcription, curves])
def test_derivatives_are_those_of_differences(make):
    prog, y = make()
    form = NonlinearForm(prog)
    weights = np.random.default_rng(1).normal(size=form.num_rows)
    n, step = form.num_vars, 1e-6

    def gradient(y):
        values, J = form.dense_constraints(y)
        return values, J, form.cost(y)[1] + weights @ J

    _, J, _ = gradient(y)
    H = np.zeros((n, n))
    np.add.at(H, (form.H_rows, form.H_cols), form.hessian(y, 1.0, weights))
    for j, direction in enumerate(step * np.eye(n)):
        ahead, behind = gradient(y + direction), gradient(y - direction)
        # Differences of values and of slopes err by their curvature, of size step^2, and by rounding over the step.
        np.testing.assert_allclose(J[:, j], (ahead[0] - behind[0]) / (2 * step), atol=1e-6, rtol=1e-6)
        np.testing.assert_allclose(H[:, j], (ahead[2] - behind[2]) / (2 * step), atol=2e-3, rtol=1e-4)
    np.testing.assert_allclose(form.values(y)[1], gradient(y)[0], rtol=1e-12)


@pytest.mark.parametrize("make", [of_all_kinds, collocation, transcription])
def test_curvature_asked_for_once_is_that_of_the_cost(make):
    prog, y = make()
    form = NonlinearForm(prog)
    H = np.zeros((form.num_vars, form.num_vars))
    np.add.at(H, (form.H_rows, form.H_cols), form.hessian(y, 1.0, np.zeros(form.num_rows)))
    np.testing.assert_allclose(form.cost_hessian(y), H, rtol=1e-13)


def test_a_formula_at_one_point_outside_its_domain_is_not_finite():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2, "x")
    prog.AddCost(log(x[0]) + 1.0 / x[1] ** 2)
    form = NonlinearForm(prog)
    with np.errstate(all="ignore"):
        assert form.cost(np.array([0.0, 1.0]))[0] == -np.inf
        assert form.cost(np.array([1.0, 0.0]))[0] == np.inf
        assert np.isnan(form.cost(np.array([-1.0, 1.0]))[0])


def test_lengths_have_derivatives_where_they_are_zero():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(4, "x")
    prog.AddL2NormCost(np.hstack((np.eye(2), -np.eye(2))), np.zeros(2), x)
    form = NonlinearForm(prog)
    value, slope = form.cost(np.array([0.3, 0.4, 0.3, 0.4]))
    assert value == 0.0 and not slope.any()
    value, slope = form.cost(np.array([3.0, 4.0, 0.0, 0.0]))
    assert value == pytest.approx(5.0, abs=1e-7)  # the rounding of lengths near zero
    np.testing.assert_allclose(slope, [0.6, 0.8, -0.6, -0.8], atol=1e-12)


def test_what_differs_by_its_variables_alone_is_evaluated_together():
    for make in (collocation, transcription):
        form = NonlinearForm(make()[0])
        assert [len(t.places) for t in form.functions.parts if isinstance(t, AlikeTerms)] == [5 * 4]


@pytest.mark.parametrize("make", [of_all_kinds, curves])
def test_large_programs_have_the_same_derivatives_without_a_matrix(make, monkeypatch):
    prog, y = make()
    dense = NonlinearForm(prog)
    monkeypatch.setattr(functions, "_DENSE", 0)
    form = NonlinearForm(prog)
    assert dense.functions.is_dense and not form.functions.is_dense
    assert form.cost(y)[0] == dense.cost(y)[0]
    np.testing.assert_allclose(form.cost(y)[1], dense.cost(y)[1], rtol=1e-14)
    for found, expected in zip(form.dense(y), dense.dense(y)):
        np.testing.assert_allclose(found, expected, rtol=1e-14, atol=1e-15)
    np.testing.assert_array_equal(form.constraints(y)[1], dense.constraints(y)[1])


def test_steps_are_the_same_whether_python_evaluates_or_a_kernel():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(4, "x")
    prog.AddCost(x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2])
    prog.AddConstraint(x[0] * x[1] * x[2] * x[3] >= 25.0)
    prog.AddConstraint(x.dot(x) == 40.0)
    prog.AddBoundingBoxConstraint(1.0, 5.0, x)
    ends = []
    for by_kernel in (True, False):
        form = NonlinearForm(prog)
        assert form.functions.is_native
        form.functions.is_native = by_kernel
        ends.append(Sqp(form, np.array([1.0, 5.0, 5.0, 1.0]), Settings()).run())
    assert all(end.converged for end in ends)
    np.testing.assert_array_equal(ends[0].y, ends[1].y)
    np.testing.assert_allclose(ends[0].y, [1.0, 4.742999644, 3.821149979, 1.379408294], atol=1e-6)


def test_python_evaluates_neither_forms_nor_formulas():
    assert not NonlinearForm(of_all_kinds()[0]).functions.parts


def test_functions_of_python_learn_their_curvature():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2, "x")
    prog.AddConstraint(lambda z: [z[0] * z[1] + 2.0 * z[0] ** 2], [0.0], [0.0], x)
    form = NonlinearForm(prog)
    assert [type(t) for t in form.functions.parts] == [LearnedTerms]
    for point in ([0.1, 0.2], [0.5, 0.2], [0.5, 0.9]):
        entries = form.hessian(np.array(point), 0.0, np.ones(1))
    found = np.zeros((2, 2))
    np.add.at(found, (form.H_rows, form.H_cols), entries)
    np.testing.assert_allclose(found, [[4.0, 1.0], [1.0, 0.0]], atol=1e-9)  # two steps suffice for two variables


def test_curvature_is_not_learned_from_points_that_were_only_tried():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(2, "x")
    prog.AddConstraint(lambda z: [z[0] * z[1] ** 2 + z[0] ** 3], [0.0], [0.0], x)
    ways = []
    for tries in (False, True):
        form = NonlinearForm(prog)
        for point in ([0.1, 0.2], [0.5, 0.2], [0.5, 0.9]):
            if tries:
                form.constraints(np.array([7.0, -3.0]))
            entries = form.hessian(np.array(point), 0.0, np.ones(1))
        ways.append(entries)
    assert np.any(ways[0] != 0.0)
    np.testing.assert_array_equal(*ways)


class Saddle:
    """A random sparse saddle point matrix."""

    def __init__(self, rng, n, m):
        self.n, self.m = n, m
        self.H = np.diag(rng.uniform(0.0, 3.0, n))
        for i, j in rng.integers(0, n, (n, 2)):
            self.H[i, j] = self.H[j, i] = rng.normal()
        self.J = rng.normal(size=(m, n)) * (rng.random((m, n)) < 0.3) + np.eye(m, n)
        self.H_rows, self.H_cols = np.nonzero(self.H)
        self.J_rows, self.J_cols = np.nonzero(self.J)


@pytest.mark.parametrize("seed", range(6))
def test_factors_give_the_solution_and_the_inertia(seed):
    rng = np.random.default_rng(seed)
    case = Saddle(rng, 30, 12)
    right_inertia = set()
    system = Factors(case).system
    for delta in (0.0, 0.3, 20.0):
        entries = case.H[case.H_rows, case.H_cols], np.full(30, delta), case.J[case.J_rows, case.J_cols]
        has_right_inertia = barrier.factorize(system, *entries[:2], 0.0, entries[2], 0.0) == 12
        K = np.block([[case.H + delta * np.eye(30), case.J.T], [case.J, np.zeros((12, 12))]])
        assert has_right_inertia == (np.sum(np.linalg.eigvalsh(K) < 0.0) == 12)
        right_inertia.add(has_right_inertia)
        b = rng.normal(size=42)
        if has_right_inertia:
            found = np.zeros(42)
            barrier.solve_factored(system, b, found)
            np.testing.assert_allclose(K @ found, b, atol=1e-9)
    assert True in right_inertia
