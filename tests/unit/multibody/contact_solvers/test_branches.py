"""The factor along the branches of one tree against dense algebra, whatever constraints couple."""

import numpy as np
import pytest
from test_factor import direct

from sheldrake.multibody.contact_solvers._arrays import make_solver_model, make_solver_work, widest
from sheldrake.multibody.contact_solvers._kernels.cost import end_of_run


def path(parents, k):
    """Dofs from the base to k."""
    found = []
    while k >= 0:
        found.append(k)
        k = parents[k]
    return found[::-1]


class Tree:
    """A tree of dofs with random momentum; contacts of what two dofs move last (-1: the ground); rows of any dofs."""

    def __init__(self, parents, contacts=(), rows=(), seed=0):
        rng = np.random.default_rng(seed)
        nv = len(parents)
        depths = [len(path(parents, k)) - 1 for k in range(nv)]
        starts = np.concatenate([[0], np.cumsum(np.array(depths) + 1)])[:-1]
        self.model = make_solver_model(np.array([[0, nv]]), np.column_stack([parents, depths, starts]), 1e-3)
        self.work = make_solver_work(self.model, len(contacts), len(rows), least_width=nv)
        problem, table, scalar, self.factor = self.work
        self.H = np.diag(rng.uniform(0.5, 2.0, nv))
        for k in range(nv):
            on = path(parents, k)
            x = rng.normal(size=len(on))
            self.H[np.ix_(on, on)] += np.outer(x, x)
        for k in range(nv):
            problem.A[starts[k] : starts[k] + depths[k] + 1] = self.H[k, path(parents, k)]
        for c, (a, b) in enumerate(contacts):
            sides = path(parents, a), path(parents, b)
            dofs = [k for k in sides[0] if k not in sides[1]] + [k for k in sides[1] if k not in sides[0]]
            self._put(table, c, dofs)
            J, X = rng.normal(size=(3, len(dofs))), rng.normal(size=(3, 3))
            G = X @ X.T
            table[c].J[:, : len(dofs)] = J
            table[c].G = G[0, 0], G[0, 1], G[1, 1], G[0, 2], G[1, 2], G[2, 2]
            self.H[np.ix_(dofs, dofs)] += J.T @ G @ J
        for r, dofs in enumerate(rows):
            self._put(scalar, r, dofs)
            J, G = rng.normal(size=len(dofs)), rng.uniform(0.5, 2.0)
            scalar[r].J[: len(dofs)], scalar[r].G = J, G
            self.H[np.ix_(dofs, dofs)] += G * np.outer(J, J)
        problem.gradient[:] = rng.normal(size=nv)
        problem.trees_end, problem.contacts_end, problem.rows_end = 1, len(contacts), len(rows)

    @staticmethod
    def _put(constraints, c, dofs):
        constraint = constraints[c]
        constraint.width, constraint.tree_a, constraint.tree_b, constraint.order = len(dofs), 0, -1, c
        constraint.dofs[: len(dofs)] = dofs

    def solve(self, native=True):
        status = direct.bind(self.model, *self.work)() if native else direct(self.model, *self.work)
        assert self.work.problem.along_branches == 1
        return status, self.work.problem.dv.copy()

    def expected(self):
        return -np.linalg.solve(self.H, self.work.problem.gradient)

    def size(self):
        return self.work.problem.factor_size


HUMANOID = [-1, 0, 1, 2, 3, 4, *(5, 6, 7), *(5, 9, 10), *(5, 12), *(13, 14, 15), *(13, 17, 18)]
"""Six dofs of a base; two legs of three; a waist of two that bears two arms of three."""


@pytest.mark.parametrize("native", [True, False], ids=["native", "twin"])
@pytest.mark.parametrize(
    "contacts, rows",
    [
        ([], [[7], [16], [0]]),
        ([(8, -1), (11, -1), (19, 13)], [[10]]),
        ([(8, 11)], []),
        ([(16, 19), (8, 19), (11, -1)], [[14, 18]]),
        ([(5, 16)], [[18, 14, 7], [19, 2, 11]]),
    ],
    ids=["limits", "ground and torso", "legs", "limbs", "tendons"],
)
def test_direction_of_a_humanoid_is_that_of_dense_algebra(contacts, rows, native):
    tree = Tree(HUMANOID, contacts, rows)
    status, dv = tree.solve(native)
    assert status == 0
    np.testing.assert_allclose(dv, tree.expected(), rtol=1e-10, atol=1e-12)


ARM = [-1, 0, 1, 2, 3, 4, 5, 5]
"""Six joints one after the other, and two fingers."""


@pytest.mark.parametrize("contacts", [[(2, -1)], [(4, 7), (6, -1)], [(5, -1), (1, 3), (7, 6)]])
def test_contacts_that_some_of_the_first_six_joints_move(contacts):
    tree = Tree(ARM, contacts, [[6], [3]])
    status, dv = tree.solve()
    assert status == 0
    np.testing.assert_allclose(dv, tree.expected(), rtol=1e-10, atol=1e-12)


def test_random_trees_with_random_constraints():
    rng = np.random.default_rng(8)
    for seed in range(200):
        nv = int(rng.integers(2, 25))
        parents = [int(rng.integers(-1, k)) for k in range(nv)]
        contacts = [tuple(rng.integers(-1, nv, 2)) for _ in range(int(rng.integers(1, 6)))]
        contacts = [(a, b) for a, b in contacts if path(parents, a) != path(parents, b)]
        rows = [rng.choice(nv, int(rng.integers(1, min(nv, 4) + 1)), replace=False).tolist() for _ in range(2)]
        tree = Tree(parents, contacts, rows, seed)
        if nv == 6 and len(path(parents, 5)) == 6:
            continue  # a block of six
        status, dv = tree.solve()
        assert status == 0
        np.testing.assert_allclose(dv, tree.expected(), rtol=1e-8, atol=1e-10)


def test_room_for_what_two_bodies_of_a_tree_can_be_moved_by():
    rng = np.random.default_rng(5)
    for n in (1, 2, 5, 12, 20):
        parents = [-1, *(int(rng.integers(max(0, k - 4), k)) for k in range(1, n))]
        paths = [set(), *(set(path(parents, k)) for k in range(n))]
        pairs = [(a, b) for a in paths for b in paths]
        against, either = widest(Tree(parents).model)
        assert against == max(len(a ^ b) for a, b in pairs)
        assert either == max(len(a | b) for a, b in pairs)


def test_the_ground_limits_and_the_torso_fill_nothing_and_crossed_legs_make_one_path():
    packed = sum(len(path(HUMANOID, k)) for k in range(len(HUMANOID)))
    tree = Tree(HUMANOID, [(8, -1), (11, 5), (19, 13), (13, -1)], [[7], [19]])
    tree.solve()
    assert tree.size() == packed
    tree = Tree(HUMANOID, [(8, 11)])
    tree.solve()
    assert tree.size() == packed + 9  # the three dofs of one leg are on the paths of the other's


def test_columns_are_runs_of_entries_as_far_as_no_other_dofs_come_between():
    def runs(contacts):
        tree = Tree(HUMANOID, contacts)
        tree.solve()
        contact = tree.work[1][0]
        ends = [0]
        while ends[-1] < contact.width:
            ends.append(end_of_run(tree.factor, contact, ends[-1]))
        return ends[1:]

    assert runs([(8, -1)]) == [9]
    assert runs([(8, 11)]) == [6]  # the legs follow each other
    assert runs([(11, 8)]) == [3, 6]  # and here the farther one comes first
    assert runs([(8, 19)]) == [8]  # the torso and the arm follow the leg
    assert runs([(8, 19), (16, 19)]) == [5, 8]  # the other arm comes between


def test_the_comparison_sees_one_wrong_entry():
    tree = Tree(HUMANOID, [(16, 19)])
    tree.H[14, 18] *= 1.0 + 1e-6
    _, dv = tree.solve()
    assert not np.allclose(dv, tree.expected(), rtol=1e-10, atol=1e-12)


def test_a_matrix_that_is_not_positive_is_told():
    tree = Tree(HUMANOID, [(16, 19)])
    tree.work.problem.A[-1] = -1e3
    assert tree.solve()[0] == 2
