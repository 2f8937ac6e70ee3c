"""Rows of programs as sparse matrices, against SciPy's and dense ones."""

import numpy as np
import pytest
from scipy.sparse import coo_matrix, csc_matrix

from sheldrake.solvers import MathematicalProgram, QuadraticCost
from sheldrake.solvers._engines.columns import Columns
from sheldrake.solvers._engines.conic import ConicRows, LinearObjective
from sheldrake.solvers._engines.linear_rows import Blocks, LinearRows, entries


@pytest.mark.parametrize("count", [0, 1, 40, 9000])
def test_triplets_by_columns(count):
    rng = np.random.default_rng(count)
    rows, cols, values = rng.integers(7, size=count), rng.integers(5, size=count), rng.normal(size=count)
    found = Columns.of_triplets(rows, cols, values, (7, 5))
    expected = coo_matrix((values, (rows, cols)), shape=(7, 5)).tocsc()
    expected.sum_duplicates()
    np.testing.assert_array_equal(found.indptr, expected.indptr)
    np.testing.assert_array_equal(found.indices, expected.indices)
    np.testing.assert_allclose(found.data, expected.data, atol=1e-12)


@pytest.mark.parametrize("count", [0, 1, 40, 9000])
def test_upper_triangle_of_triplets_at_places(count):
    rng = np.random.default_rng(count)
    places = rng.integers(6, size=9)
    rows, cols, values = rng.integers(9, size=count), rng.integers(9, size=count), rng.normal(size=count)
    found = Columns.upper(rows, cols, values, places, 6)
    expected = np.triu(coo_matrix((values, (places[rows], places[cols])), shape=(6, 6)).toarray())
    np.testing.assert_allclose(found.for_scipy().toarray(), expected, atol=1e-12)
    assert all((np.diff(found.indices[a:b]) > 0).all() for a, b in zip(found.indptr, found.indptr[1:]))


def test_blocks_have_rows_and_columns_of_their_own():
    rng = np.random.default_rng(0)
    dense = [rng.normal(size=(2, 3)), np.array([[0.0, 4.0]]), np.asfortranarray(rng.normal(size=(3, 2)))]
    sparse = csc_matrix(np.array([[0.0, 1.0, 0.0], [2.0, 0.0, 3.0]]))
    blocks = [dense[0], None, sparse, dense[1], [5.0, 0.0, 6.0], dense[2], None]
    sizes = [2, 4, 2, 1, 1, 3, 1]
    rows, cols, values = entries(blocks, sizes)
    assert np.all(values != 0.0)
    found = coo_matrix((values, (rows, cols)), shape=(14, 18)).toarray()
    expected, row, col = np.zeros((14, 18)), 0, 0
    for block, size in zip(blocks, sizes):
        M = np.eye(size) if block is None else np.atleast_2d(block.toarray() if block is sparse else block)
        expected[row : row + M.shape[0], col : col + M.shape[1]] = M
        row, col = row + M.shape[0], col + M.shape[1]
    np.testing.assert_array_equal(found, expected)
    assert [len(part) for part in entries([], [])] == [0, 0, 0]


def test_blocks_are_the_same_where_their_matrices_are():
    A, b, sparse = np.arange(6.0).reshape(2, 3), [1.0, 2.0], csc_matrix(np.eye(2))
    sizes = [2, 1, 3]
    known = Blocks([A, b, None], sizes).identity(9)
    assert known == Blocks([np.asfortranarray(A), np.array([b]), None], sizes).identity(9)
    others = [[A + 1.0, b, None], [A, None, None], [A, b, np.eye(3)], [A.reshape(3, 2), b, None]]
    assert known not in [Blocks(blocks, sizes).identity(99) for blocks in others]
    assert Blocks([A, b, None], sizes).identity(7) is Blocks([A, sparse], [2, 2]).identity(99) is None
    assert Blocks([], []).identity(0) is not None


def test_linear_costs_are_added_up_again_when_one_changes():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(3)
    quadratic = prog.AddQuadraticCost(np.eye(2), [1.0, 2.0], 5.0, x[:2]).evaluator()
    linear = prog.AddLinearCost([3.0, 4.0], 6.0, x[1:]).evaluator()
    objective = LinearObjective(prog)
    c, constant = objective.now()
    assert c.tolist() == [1.0, 5.0, 4.0] and constant == 11.0
    linear.update_constant_term(7.0)
    assert objective.now()[0] is c and objective.now()[1] == 12.0
    linear.UpdateCoefficients([0.0, 1.0])
    quadratic.UpdateCoefficients(np.eye(2), [2.0, 2.0])
    assert objective.now()[0].tolist() == [2.0, 2.0, 1.0] and c.tolist() == [1.0, 5.0, 4.0]


def test_rows_of_the_conic_form():
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(3)
    inf, A = np.inf, np.arange(1.0, 19.0).reshape(6, 3)
    lower, upper = np.array([1.0, -inf, -2.0, -inf, 0.0, inf]), np.array([1.0, 5.0, 2.0, inf, inf, inf])
    constraint = prog.AddLinearConstraint(A, lower, upper, x)
    found = ConicRows.of(LinearRows(prog, [constraint]), 3)
    assert (found.equations, found.first_lower, found.never) == (2, 4, 1)
    np.testing.assert_array_equal(found.chosen, [0, 5, 1, 2, 2, 4])
    np.testing.assert_array_equal(found.b, [1.0, inf, 5.0, 2.0, 2.0, -0.0])
    np.testing.assert_array_equal(found.columns.for_scipy().toarray(), np.vstack((A[[0, 5, 1, 2]], -A[[2, 4]])))
    np.testing.assert_array_equal(found.prices(np.arange(1.0, 9.0)), [-1.0, -3.0, -4.0 + 5.0, 0.0, 6.0, -2.0])


def test_costs_are_found_convex_as_their_eigenvalues_say():
    rng, costs = np.random.default_rng(3), []
    for n in (0, 1, 2, 3, 6, 250):
        for shift in (0.0, 1.0, -1e-3):
            M = rng.normal(size=(n, max(n - 1, 0)))
            costs.append(QuadraticCost(M @ M.T + shift * np.eye(n), np.zeros(n)))
    costs += [QuadraticCost(np.array(Q), np.zeros(2)) for Q in ([[0.0, 0.0], [0.0, 1.0]], [[0.0, 1.0], [1.0, 0.0]])]
    costs += [QuadraticCost(np.zeros((3, 3)), np.zeros(3)), QuadraticCost(-1e-13 * np.eye(2), np.zeros(2))]
    alone = [QuadraticCost(c.Q(), c.b()).is_convex() for c in costs]
    assert QuadraticCost.are_convex(costs) == all(alone)
    for c in costs:
        c._is_convex = None
    assert [QuadraticCost.are_convex([c]) for c in costs] == alone
