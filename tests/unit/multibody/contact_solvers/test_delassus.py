"""Impulses of few contacts as unknowns: the same iterates, and the same answer, as with velocities as unknowns."""

import numpy as np
import pytest
from test_branches import HUMANOID, path
from tests.unit.multibody.contact_solvers.packed import put_factor

from sheldrake.multibody.contact_solvers._arrays import FEW_CONTACTS, make_solver_model, make_solver_work
from sheldrake.multibody.contact_solvers._kernels.laws import put_rows_ahead
from sheldrake.multibody.contact_solvers._kernels.problem import ACTUATOR, ContactState
from sheldrake.multibody.contact_solvers._kernels.solve import APPROXIMATIONS

GROUND = -1
DT = 1e-3


class Limbs:
    """A tree with random momentum and motion, motors on all dofs but the base's, and contacts of what two dofs move.

    Motors have about `spare` N m more than they begin with.
    """

    def __init__(self, name, contacts, spare, seed, few=True):
        rng = np.random.default_rng(seed)
        parents, nv = HUMANOID, len(HUMANOID)
        depths = [len(path(parents, k)) - 1 for k in range(nv)]
        starts = np.concatenate([[0], np.cumsum(np.array(depths) + 1)])[:-1]
        dofs = np.column_stack([parents, depths, starts])
        self.model = make_solver_model(np.array([[0, nv]]), dofs, DT, name, to_rest=True)
        self.work = make_solver_work(self.model, len(contacts), nv - 6, least_width=nv)
        if not few:
            self.work = self.work._replace(factor=self.work.factor._replace(small=np.zeros(0)))
        self.problem, self.contacts, self.rows, self.factor = self.work
        A = np.diag(rng.uniform(0.5, 2.0, nv))
        for k in range(nv):
            on = path(parents, k)
            x = 0.3 * rng.normal(size=len(on))
            A[np.ix_(on, on)] += np.outer(x, x)
        for k in range(nv):
            self.problem.A[starts[k] : starts[k] + depths[k] + 1] = A[k, path(parents, k)]
        self.problem.v0[:] = 0.3 * rng.normal(size=nv)
        self.problem.v_star[:] = self.problem.v0 + 0.01 * rng.normal(size=nv)
        self.problem.p_star[:] = A @ (self.problem.v_star - self.problem.v0)
        for c, (a, b) in enumerate(contacts):
            sides = path(parents, a), path(parents, b)
            moved = [k for k in sides[0] if k not in sides[1]] + [k for k in sides[1] if k not in sides[0]]
            contact = self.contacts[c]
            contact.width, contact.tree_a, contact.tree_b = len(moved), 0, -1
            contact.dofs[: len(moved)] = moved
            contact.J[:, : len(moved)] = 0.5 * rng.normal(size=(3, len(moved)))
            contact.stiffness, contact.dissipation, contact.relaxation, contact.friction = 1e5, 1.0, 0.01, 0.8
            contact.depth = rng.uniform(-1e-4, 1e-3)
        for r in range(nv - 6):
            row = self.rows[r]
            row.width, row.tree_a, row.tree_b, row.kind, row.group = 1, 0, -1, ACTUATOR, 1
            row.dofs[0], row.J[0] = 6 + r, 1.0
            row.stiffness, row.relaxation, row.gap = 100.0, 5.0, 0.1 * rng.normal()
            effort = abs(100.0 * row.gap + 5.0 * self.problem.v0[6 + r]) + spare * rng.normal()  # what it begins with
            row.lower, row.upper = -DT * abs(effort), DT * abs(effort)
        self.problem.num_contacts, self.problem.num_rows = len(contacts), nv - 6
        self.problem.L[:] = self.problem.A
        impulse = self.problem.p_star.copy()
        put_rows_ahead(self.model, self.problem, self.rows, impulse)
        for row in (self.rows[r] for r in range(nv - 6)):
            A[row.dofs[0], row.dofs[0]] += row.G
        self.problem.v_star[:] = self.problem.v0 + np.linalg.solve(A, impulse)
        put_factor(self.model, self.problem)
        self.stages = APPROXIMATIONS[name].to_rest

    def solve(self):
        self.stages.prepare.native(self.model, *self.work[:3])
        assert self.stages.solve.native(self.model, *self.work) == 0
        gamma = self.contacts.state[: self.problem.num_contacts, ContactState.gamma.columns]
        return self.problem.v.copy(), gamma.copy(), self.problem.iterations

    def bounded(self, v):
        """Which motors are at their limits at these velocities."""
        rows = [self.rows[r] for r in range(self.problem.num_rows)]
        return [not row.lower < row.push - row.resistance * v[row.dofs[0]] < row.upper for row in rows]


CONTACTS = {
    "one foot": [(8, GROUND)],
    "two feet": [(8, GROUND), (11, GROUND)],
    "legs that touch": [(8, 11), (11, GROUND)],
    "hand on hip": [(16, 7), (8, GROUND), (11, GROUND)],
    "two points of a foot": [(8, GROUND), (8, GROUND), (11, GROUND), (19, GROUND)],
}


@pytest.mark.parametrize("contacts", CONTACTS.values(), ids=CONTACTS)
@pytest.mark.parametrize("name", ["lagged", "similar", "sap"])
def test_impulses_give_what_velocities_give(name, contacts):
    total = expected_total = 0
    for seed in range(20):
        few, all_of_them = (Limbs(name, contacts, np.inf, seed, few) for few in (True, False))
        v, gamma, iterations = few.solve()
        expected_v, expected_gamma, expected_iterations = all_of_them.solve()
        np.testing.assert_allclose(v, expected_v, rtol=0.0, atol=1e-8)
        np.testing.assert_allclose(gamma, expected_gamma, rtol=0.0, atol=1e-8)
        assert iterations <= expected_iterations + 4  # steps that lead nowhere, and lines are searched
        total, expected_total = total + iterations, expected_total + expected_iterations
        assert few.factor.spread.any() and not all_of_them.factor.spread.any()
    assert total <= 1.05 * expected_total
    assert name == "sap" or max(total, expected_total) <= 5.5 * 20


@pytest.mark.parametrize("name", ["lagged", "similar", "sap"])
def test_motors_that_reach_their_limits_are_iterated_on_afterwards(name):
    """The linear rows are those at v0; which others there are shows when velocities come out."""
    reached = 0
    for seed in range(40):
        solved = [Limbs(name, CONTACTS["two feet"], 0.1, seed, few) for few in (True, False)]
        (v, gamma, _), (expected_v, expected_gamma, _) = (limbs.solve() for limbs in solved)
        np.testing.assert_allclose(v, expected_v, rtol=0.0, atol=1e-8)
        np.testing.assert_allclose(gamma, expected_gamma, rtol=0.0, atol=1e-8)
        reached += solved[0].bounded(v) != solved[0].bounded(solved[0].problem.v0)
    assert reached > 10


@pytest.mark.parametrize("name", ["lagged", "similar", "sap"])
def test_motors_alone_take_no_iteration(name):
    """What they do while they do not saturate is in v*."""
    for seed in range(5):
        ahead, all_of_them = (Limbs(name, [], np.inf, seed, few) for few in (True, False))
        v, _, iterations = ahead.solve()
        all_of_them.problem.rows_ahead = 0
        all_of_them.problem.v_star[:] = np.nan  # is not asked for
        expected_v, _, expected_iterations = all_of_them.solve()
        np.testing.assert_allclose(v, expected_v, rtol=0.0, atol=1e-12)
        assert (iterations, expected_iterations) == (0, 1)


def test_many_contacts_have_velocities_as_unknowns():
    limbs = Limbs("lagged", [(8, GROUND)] * (FEW_CONTACTS + 1), np.inf, 0)
    limbs.solve()
    assert not limbs.factor.spread.any()


def test_the_comparison_sees_another_column():
    """One contact of the one has another column."""
    few, all_of_them = (Limbs("lagged", CONTACTS["two feet"], np.inf, 3, few) for few in (True, False))
    few.contacts[0].J[0, 0] += 1e-4
    assert not np.allclose(few.solve()[0], all_of_them.solve()[0], rtol=0.0, atol=1e-8)
