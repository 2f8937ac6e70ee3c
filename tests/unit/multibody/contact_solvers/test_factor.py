"""Both sparse block factors against dense algebra: any mix of trees, any graph of contacts, filled or not."""

import numpy as np
import pytest

from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._arrays import make_solver_model, make_solver_work
from sheldrake.multibody.contact_solvers._kernels import tamsi
from sheldrake.multibody.contact_solvers._kernels.cost import newton_direction
from sheldrake.multibody.contact_solvers._kernels.factor import eliminate, scatter, symbolic_factor
from sheldrake.multibody.contact_solvers._kernels.problem import (
    Block,
    Contacts,
    Entry,
    Factor,
    Participation,
    Problem,
    Rows,
    SolverModel,
)


@kernel(top=True)
def direct(solver_model: SolverModel, problem: Problem, contacts: Contacts, rows: Rows, factor: Factor) -> int:
    """dv = -H^-1 gradient of one island; 1 without room, 2 when H is not positive."""
    if symbolic_factor(solver_model, problem, contacts, rows, factor) != 0:
        return 1
    if newton_direction(solver_model, problem, contacts, rows, factor, 1) != 0:
        return 2
    return 0


@kernel(top=True)
def once_more(solver_model: SolverModel, problem: Problem, contacts: Contacts, rows: Rows, factor: Factor) -> int:
    """`direct` by the factor that is there."""
    return newton_direction(solver_model, problem, contacts, rows, factor, 0)


@kernel(top=True)
def unsymmetric(solver_model: SolverModel, problem: Problem, contacts: Contacts, rows: Rows, factor: Factor) -> int:
    """`direct` of kTamsi's matrix, its solution in dv; 2 when it is singular."""
    if symbolic_factor(solver_model, problem, contacts, rows, factor) != 0:
        return 1
    tamsi.assemble(solver_model, problem, contacts, factor)
    if eliminate(factor, problem.trees_end) != 0:
        return 2
    scatter(solver_model, problem, factor)
    return 0


class Island:
    """Trees of given sizes, each a chain; random contacts and rows between given pairs (-1: the world).

    For kTamsi the force of contacts is not symmetric: sliding does not push back the normal force.
    """

    def __init__(self, sizes, pairs, row_pairs=(), seed=0, approximation="lagged"):
        rng = np.random.default_rng(seed)
        first = np.concatenate([[0], np.cumsum(sizes)])
        nv = int(first[-1])
        dof, start = [], 0
        for f, n in zip(first, sizes):
            for k in range(n):
                dof.append((f + k - 1 if k else -1, k, start))
                start += k + 1
        self.model = make_solver_model(np.column_stack([first[:-1], sizes]), np.array(dof), 1e-3, approximation)
        self.direct = unsymmetric if approximation == "tamsi" else direct
        self.work = make_solver_work(self.model, len(pairs), len(row_pairs))
        problem, contacts, rows, _ = self.work
        self.H = np.zeros((nv, nv))
        for f, n in zip(first, sizes):
            X = rng.normal(size=(n, n))
            A = X @ X.T + n * np.eye(n)
            self.H[f : f + n, f : f + n] = A
            for k in range(n):
                at = dof[f + k][2]
                problem.A[at : at + k + 1] = A[k, : k + 1]
        for c, (a, b) in enumerate(pairs):
            dofs = self._put(contacts, c, a, b, first, sizes)
            J = rng.normal(size=(3, len(dofs)))
            contacts[c].J[:, : len(dofs)] = J
            X = rng.normal(size=(3, 3))
            G = X @ X.T
            contacts[c].G = G[0, 0], G[0, 1], G[1, 1], G[0, 2], G[1, 2], G[2, 2]
            if approximation == "tamsi":
                G[2, :2] = 0.0
            self.H[np.ix_(dofs, dofs)] += J.T @ G @ J
        for r, (a, b) in enumerate(row_pairs):
            dofs = self._put(rows, r, a, b, first, sizes)
            J, G = rng.normal(size=len(dofs)), rng.uniform(0.5, 2.0)
            rows[r].J[: len(dofs)], rows[r].G = J, G
            self.H[np.ix_(dofs, dofs)] += G * np.outer(J, J)
        problem.gradient[:] = rng.normal(size=nv)
        problem.tree[:, Participation.order] = np.arange(len(sizes))
        problem.trees_end, problem.contacts_end, problem.rows_end = len(sizes), len(pairs), len(row_pairs)

    @staticmethod
    def _put(constraints, c, a, b, first, sizes):
        dofs = [k for t in (a, b) if t >= 0 for k in range(first[t], first[t] + sizes[t])]
        constraint = constraints[c]
        constraint.width, constraint.tree_a, constraint.tree_b, constraint.order = len(dofs), a, b, c
        constraint.dofs[: len(dofs)] = dofs
        return dofs

    def solve(self, native=True):
        arguments = (self.model, *self.work)
        status = self.direct.bind(*arguments)() if native else self.direct(*arguments)
        return status, self.work.problem.dv.copy()

    def blocks(self):
        block = self.work.factor.block
        return int((block[:, Block.below_end] - block[:, Block.below_begin]).sum())


CHAIN = [(i, i + 1) for i in range(11)]
ISLANDS = {
    "one free body": ([6], [(0, -1)], []),
    "one arm": ([7], [(-1, 0)], [(0, -1)]),
    "free bodies in a chain": ([6] * 12, [*CHAIN, (0, -1)], []),
    "a star": ([6] * 9, [(0, i) for i in range(1, 9)], []),
    "everyone with everyone": ([6] * 7, [(i, j) for i in range(7) for j in range(i + 1, 7)], []),
    "a ring, both ways round": ([6] * 8, [(i, (i + 1) % 8) for i in range(8)], [(4, 0)]),
    "sizes of all kinds": ([6, 1, 7, 6, 3, 6, 2], [(1, 0), (2, 1), (0, 2), (3, 4), (5, 3), (4, 6)], [(6, 0), (2, 5)]),
    "no couple": ([6, 2, 6], [(0, -1)], []),
    "more than a word of bits": ([6, 2] * 50, [(i, (i * 7 + 3) % 100) for i in range(100)], []),
}


@pytest.mark.parametrize("native", [True, False], ids=["native", "twin"])
@pytest.mark.parametrize("name", ISLANDS)
def test_direction_is_that_of_dense_algebra(name, native):
    sizes, pairs, rows = ISLANDS[name]
    pairs = [(a, b) for a, b in pairs if a != b]
    island = Island(sizes, pairs, rows)
    status, dv = island.solve(native)
    assert status == 0
    expected = -np.linalg.solve(island.H, island.work.problem.gradient)
    np.testing.assert_allclose(dv, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("native", [True, False], ids=["native", "twin"])
@pytest.mark.parametrize("name", ISLANDS)
def test_direction_of_unsymmetric_matrices_is_that_of_dense_algebra(name, native):
    sizes, pairs, _ = ISLANDS[name]
    island = Island(sizes, [(a, b) for a, b in pairs if a != b], approximation="tamsi")
    assert not np.allclose(island.H, island.H.T)
    status, dv = island.solve(native)
    assert status == 0
    expected = -np.linalg.solve(island.H, island.work.problem.gradient)
    np.testing.assert_allclose(dv, expected, rtol=1e-9, atol=1e-11)


def test_rows_of_a_tree_are_exchanged_where_its_pivot_is_zero():
    """A tree of two dofs whose momentum matrix has zeros on its diagonal, coupled to others."""
    island = Island([2, 6, 3], [(0, 1), (1, 2), (0, 2)], approximation="tamsi")
    a, b, c = island.work.problem.A[:3]
    before = np.array([[a, b], [b, c]])
    island.work.problem.A[:3] = 0.0, 40.0, 0.0
    island.H[:2, :2] += np.array([[0.0, 40.0], [40.0, 0.0]]) - before
    status, dv = island.solve()
    assert status == 0
    expected = -np.linalg.solve(island.H, island.work.problem.gradient)
    np.testing.assert_allclose(dv, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("approximation", ["lagged", "tamsi"])
def test_random_graphs(approximation):
    rng = np.random.default_rng(5)
    for seed in range(30):
        n = int(rng.integers(2, 15))
        sizes = rng.choice([6, 6, 6, 1, 4], n)
        pairs = [tuple(rng.choice(n, 2, replace=False)) for _ in range(int(rng.integers(1, 3 * n)))]
        island = Island(sizes, pairs, seed=seed, approximation=approximation)
        status, dv = island.solve()
        assert status == 0
        residual = island.H @ dv + island.work.problem.gradient
        assert np.abs(residual).max() < 1e-9 * np.abs(island.H).max()


@pytest.mark.parametrize("name", ISLANDS)
def test_a_factor_serves_again(name):
    island = Island(*ISLANDS[name])
    _, dv = island.solve()
    problem = island.work.problem
    problem.dv[:] = np.nan
    assert once_more.bind(island.model, *island.work)() == 0
    assert problem.dv.tobytes() == dv.tobytes()  # what is done with the factor is the same, while it is made or after
    problem.gradient[:] = np.random.default_rng(4).normal(size=len(dv))
    assert once_more.bind(island.model, *island.work)() == 0
    np.testing.assert_allclose(problem.dv, -np.linalg.solve(island.H, problem.gradient), rtol=1e-9, atol=1e-12)


def eliminated(n, pairs, cost):
    """The trees in the order of elimination, least cost and then the lowest number first, and the neighbours they had.

    `cost` is of how many neighbours a tree has, and of how many each eliminated tree had that made it one of them.
    """
    beside = [set() for _ in range(n)]
    for a, b in pairs:
        beside[a].add(b)
        beside[b].add(a)
    left, columns, cliques = set(range(n)), [], []
    while left:
        i = min(left, key=lambda i: (cost(len(beside[i]), [len(c) for c in cliques if i in c]), i))
        left.remove(i)
        columns.append((i, beside[i]))
        cliques = [c for c in cliques if i not in c] + [set(beside[i])]
        for u in beside[i]:
            beside[u] = (beside[u] | beside[i]) - {u, i}
    return columns


def fill(neighbours, cliques):
    """Twice the pairs of neighbours but those in cliques, as if these shared nobody else; and the neighbours."""
    return max(neighbours * (neighbours - 1) - sum((c - 1) * (c - 2) for c in cliques), 0) + neighbours


def in_postorder(columns):
    """The same columns, those that hang on a tree directly before it: on the one that comes first in their rows."""
    place_of = {i: place for place, (i, _) in enumerate(columns)}
    below = {i: [] for i in place_of}
    for i, rows in columns:
        if rows:
            below[min(rows, key=place_of.get)].append((i, rows))

    def with_all_below(column):
        return [found for child in below[column[0]] for found in with_all_below(child)] + [column]

    return [found for column in columns if not column[1] for found in with_all_below(column)]


def grid(side):
    """The pairs of a square net, row after row."""
    n = side * side
    return [(k, k + 1) for k in range(n - 1) if (k + 1) % side] + [(k, k + side) for k in range(n - side)]


@pytest.mark.parametrize("approximation", ["lagged", "tamsi"])
def test_trees_that_fill_least_are_eliminated_first(approximation):
    rng = np.random.default_rng(8)
    graphs = [(144, grid(12)), (144, [(143 - a, 143 - b) for a, b in grid(12)])]
    for _ in range(20):
        n = int(rng.integers(2, 40))
        graphs.append(
            (n, [tuple(map(int, rng.choice(n, 2, replace=False))) for _ in range(int(rng.integers(1, 3 * n)))])
        )
    for n, pairs in graphs:
        island = Island([1] * n, pairs, approximation=approximation)
        assert island.solve()[0] == 0
        factor = island.work.factor
        trees = [int(factor.blocks[place].tree) for place in range(n)]
        expected = in_postorder(eliminated(n, pairs, fill))
        assert trees == [i for i, _ in expected]
        place_of = {i: place for place, i in enumerate(trees)}
        for place, (_, rows) in enumerate(expected):
            block = factor.blocks[place]
            found = [int(factor.entries[e].place) for e in range(block.below_begin, block.below_end)]
            assert found == sorted(place_of[u] for u in rows)


def products(columns):
    """How many blocks are multiplied with blocks."""
    return sum(len(rows) * (len(rows) + 1) // 2 for _, rows in columns)


def test_less_is_multiplied_than_by_minimum_degree():
    by_degree = eliminated(324, grid(18), lambda neighbours, cliques: neighbours)
    assert products(eliminated(324, grid(18), fill)) < 0.93 * products(by_degree)


def test_room_grows_with_the_number_of_trees():
    n = 30_000
    model = make_solver_model(
        np.column_stack([np.arange(n), np.ones(n)]), np.column_stack([-np.ones(n), np.zeros(n), np.arange(n)]), 1e-3
    )
    factor = make_solver_work(model, n, 0).factor
    assert len(factor.L) >= 100 * n and len(factor.below) >= 30 * n
    assert sum(array.nbytes for array in factor) < 4000 * n  # no square


def test_a_chain_and_a_star_do_not_fill():
    for name in ("free bodies in a chain", "a star"):
        sizes, pairs, rows = ISLANDS[name]
        island = Island(sizes, pairs, rows)
        island.solve()
        assert island.blocks() == len(sizes) - 1, name  # as many as there are couples


def test_the_comparison_sees_one_wrong_block():
    sizes, pairs, rows = ISLANDS["sizes of all kinds"]
    island = Island(sizes, pairs, rows)
    island.H[0, 0] *= 1.0 + 1e-6
    _, dv = island.solve()
    expected = -np.linalg.solve(island.H, island.work.problem.gradient)
    assert not np.allclose(dv, expected, rtol=1e-9, atol=1e-12)


def test_a_matrix_that_is_not_positive_is_told():
    island = Island([6, 6], [(0, 1)])
    island.work.problem.A[0] = -1e3
    assert island.solve()[0] == 2


def test_a_singular_matrix_is_told():
    island = Island([2], [(0, -1)], approximation="tamsi")
    island.work.problem.A[:], island.work.contacts.state[:] = 0.0, 0.0
    assert island.solve()[0] == 2


@pytest.mark.parametrize("approximation", ["lagged", "tamsi"])
def test_too_little_room_is_told(approximation):
    sizes, pairs, rows = ISLANDS["everyone with everyone"]
    island = Island(sizes, pairs, rows, approximation=approximation)
    island.work = island.work._replace(factor=island.work.factor._replace(L=np.zeros(100)))
    assert island.solve()[0] == 1
    island = Island(sizes, pairs, rows, approximation=approximation)
    island.work = island.work._replace(factor=island.work.factor._replace(below=np.zeros((3, Entry.SIZE), np.int64)))
    assert island.solve()[0] == 1
