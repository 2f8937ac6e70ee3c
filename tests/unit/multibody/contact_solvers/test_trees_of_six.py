"""Trees of six dofs have code of their own: it gives what the code for any tree gives."""

from __future__ import annotations

import numpy as np
import pytest
from tests.unit.multibody.contact_solvers.test_solver import RandomProblem

from sheldrake.common._kernels.vec import dot_six, mul_packed_six, put_packed_six
from sheldrake.multibody.contact_solvers._kernels import problem as codes
from sheldrake.multibody.contact_solvers._kernels.problem import ContactIndex, ContactState

SIZES = (6, 6, 4, 6, 2)
"""The last is never touched."""


def prepared(seed, name="lagged", **options):
    problem = RandomProblem(np.random.default_rng(seed), name, sizes=SIZES, contacts=20, **options)
    problem.model.sigma = 3.0  # so that the regularisation of some contacts is above the tolerance
    problem.prepare()
    return problem


def test_contacts_know_how_many_trees_of_six_move_them_and_how_many_columns_are_six_in_a_row():
    problem = prepared(0)
    for c in range(20):
        contact = problem.work.contacts[c]
        trees = [t for t in (contact.tree_a, contact.tree_b) if t >= 0]
        assert contact.sixes == (len(trees) if all(SIZES[t] == 6 for t in trees) else 0)
        assert contact.in_sixes == (6 * contact.sixes or (6 if SIZES[trees[0]] == 6 else 0))
    assert set(problem.work.contacts.index[:, ContactIndex.sixes]) == {0, 1, 2}
    assert set(problem.work.contacts.index[:, ContactIndex.in_sixes]) == {0, 6, 12}


@pytest.mark.parametrize("name", ["lagged", "sap", "tamsi"])
def test_velocities_of_contacts(name):
    problem = prepared(1, name)
    vc = problem.work.contacts.state[:, ContactState.vc.columns]
    np.testing.assert_allclose(vc.ravel(), problem.J @ problem.v0, atol=1e-14)


@pytest.mark.parametrize("name", ["lagged", "similar"])
def test_regularisation_speeds(name):
    """eps = max(v_s, mu sigma w n0): the quick bound of w decides nothing wrongly."""
    larger = 0
    for seed in range(5):
        problem = prepared(seed, name)
        model = problem.model
        touched = np.concatenate([np.full(n, k in problem.touched) for k, n in enumerate(SIZES)])
        mobility = np.where(touched, 1.0 / np.diag(problem.A), 0.0)
        for c in range(20):
            J = problem.J[3 * c : 3 * c + 3]
            w = np.linalg.norm(J * mobility @ J.T) / 3.0
            contact = problem.work.contacts[c]
            slip = contact.friction * model.sigma * w * contact.n0
            expected = max(model.stiction, slip)
            larger += slip > model.stiction
            assert contact.eps == pytest.approx(expected, rel=1e-14)
    assert 10 < larger < 90


@pytest.mark.parametrize("to_rest", [False, True])
def test_momentum_balance_of_all_kinds_of_trees(to_rest):
    for seed in range(5):
        problem = RandomProblem(np.random.default_rng(seed), sizes=SIZES, contacts=20, to_rest=to_rest)
        assert problem.solve() == codes.SOLVED
        residual = problem.A @ (problem.v - problem.v_star) - problem.J.T @ problem.gamma()
        assert np.abs(residual).max() < 1e-7


def test_packed_triangles():
    rng = np.random.default_rng(2)
    A = rng.normal(size=(6, 6))
    A += A.T
    packed = np.concatenate([rng.normal(size=3), A[np.tril_indices(6)]])
    x = rng.normal(size=6)
    np.testing.assert_allclose(mul_packed_six(packed, 3, x), A @ x, atol=1e-14)
    assert dot_six(x, A[0]) == pytest.approx(x @ A[0], abs=1e-14)
    block = np.zeros(40)
    put_packed_six(block, 4, packed, 3)
    np.testing.assert_array_equal(np.tril(block[4:].reshape(6, 6).T), np.tril(A))


def alone(seed, name, contacts=1, few=True):
    """A body with contacts, solved to rest; without room for impulses as unknowns unless `few`."""
    problem = RandomProblem(np.random.default_rng(seed), name, sizes=(6, 2), contacts=contacts, to_rest=True)
    if not few:
        problem.work = problem.work._replace(factor=problem.work.factor._replace(small=np.zeros(0)))
    assert problem.solve() == codes.SOLVED
    return problem, problem.work.problem.iterations


@pytest.mark.parametrize("name", ["lagged", "similar", "sap"])
def test_one_contact_of_a_free_body_has_three_unknowns(name):
    """The minimum is that with six velocities as unknowns, in no more steps."""
    total = expected_total = 0
    for seed in range(60):
        (three, iterations), (six, expected) = alone(seed, name), alone(seed, name, few=False)
        residual = three.A @ (three.v - three.v_star) - three.J.T @ three.gamma()
        assert np.abs(residual).max() < 1e-8
        np.testing.assert_allclose(three.v, six.v, rtol=0.0, atol=1e-8)
        np.testing.assert_allclose(three.gamma(), six.gamma(), rtol=0.0, atol=1e-8)
        assert three.work.factor.delassus.any() == (iterations > 0)
        assert not six.work.factor.delassus.any()
        total, expected_total = total + iterations, expected_total + expected
    assert 60 < total <= expected_total


def test_bodies_with_more_contacts_keep_six_unknowns():
    problem, iterations = alone(1, "lagged", contacts=2)
    assert iterations > 0
    assert not problem.work.factor.delassus.any()
