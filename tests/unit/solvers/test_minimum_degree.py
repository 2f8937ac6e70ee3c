import subprocess
import sys

import numpy as np
import pytest

from sheldrake.solvers._engines.minimum_degree import minimum_degree
from sheldrake.solvers._kernels.elimination import order_of_least_degree
from sheldrake.solvers._program.polynomials import _in_hull


def entries_of_factor(pattern, order):
    """How many entries a Cholesky factor has, by eliminating row after row of a dense pattern."""
    P = pattern[np.ix_(order, order)].copy()
    for k in range(len(P)):
        below = np.flatnonzero(P[k + 1 :, k]) + k + 1
        P[np.ix_(below, below)] = True
    return int(np.tril(P, -1).sum())


def symmetric(n, rows, cols):
    P = np.eye(n, dtype=bool)
    P[rows, cols] = P[cols, rows] = True
    return P


def test_trees_and_bands_do_not_fill():
    n = 60
    star = np.zeros(n - 1, dtype=int), np.arange(1, n)
    order = minimum_degree(n, *star)
    assert sorted(order) == list(range(n)) and 0 in order[-2:]  # the hub goes last but for one leaf
    assert entries_of_factor(symmetric(n, *star), order) == n - 1
    chain = np.arange(n - 1), np.arange(1, n)
    assert entries_of_factor(symmetric(n, *chain), minimum_degree(n, *chain)) == n - 1


@pytest.mark.parametrize("seed", range(4))
def test_no_worse_than_superlu_orders(seed):
    """Blocks along time that share a variable, as transcriptions have them."""
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import splu

    rng = np.random.default_rng(seed)
    blocks, width = 25, int(rng.integers(3, 8))
    n = blocks * width + 1
    P = np.eye(n, dtype=bool)
    for k in range(blocks):
        near = np.arange(k * width, min(n - 1, (k + 2) * width))
        P[np.ix_(near, near)] |= (B := rng.random((len(near), len(near))) < 0.5) | B.T
        P[k * width, -1] = P[-1, k * width] = True
    i, j = np.nonzero(np.triu(P, 1))
    ours = minimum_degree(n, i, j)
    found = splu(
        csc_matrix(P + n * np.eye(n)),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    assert sorted(ours) == list(range(n))
    assert entries_of_factor(P, ours) <= 1.1 * entries_of_factor(P, np.argsort(found.perm_c))


@pytest.mark.parametrize("size", [1, 2, 30, 80])
@pytest.mark.parametrize("share", [0.0, 0.05, 0.3, 1.0])
def test_any_pattern_gives_an_order_that_fills_as_little_as_always_taking_the_row_of_fewest(size, share):
    rng = np.random.default_rng(size)
    i, j = np.nonzero(rng.random((size, size)) < share)
    order = minimum_degree(size, i, j)
    assert sorted(order) == list(range(size))
    P = symmetric(size, i, j)
    left, greedy = P.copy(), []
    alive = np.ones(size, dtype=bool)
    for _ in range(size):
        row = min(np.flatnonzero(alive), key=lambda r: left[r, alive].sum())
        alive[row] = False
        left |= np.outer(left[row], left[row])
        greedy.append(row)
    assert entries_of_factor(P, order) <= 1.05 * entries_of_factor(P, np.array(greedy)) + 3


def test_the_order_is_the_same_as_machine_code_and_as_python(monkeypatch):
    rng = np.random.default_rng(2)
    i, j = np.nonzero(rng.random((60, 60)) < 0.08)
    native = minimum_degree(60, i, j)
    monkeypatch.setattr(type(order_of_least_degree), "native", property(lambda kernel: kernel))
    np.testing.assert_array_equal(minimum_degree(60, i, j), native)


def test_a_nonlinear_program_is_solved_without_loading_what_it_does_not_need():
    """SciPy's parts take longer to load than all the rest of such a program."""
    program = """
import sys
import numpy as np
from sheldrake.solvers import MathematicalProgram, SnoptSolver
prog = MathematicalProgram()
x = prog.NewContinuousVariables(60)
for a, b in zip(x, x[1:]):
    prog.AddConstraint(a * a * b + b, 1.0, 2.0)
prog.AddCost((x - 0.3).dot(x - 0.3))
assert SnoptSolver().Solve(prog, np.ones(60)).is_success()
assert not {"numpy.ma", "scipy.linalg", "scipy.sparse", "scipy.optimize"} & set(sys.modules)
"""
    subprocess.run([sys.executable, "-c", program], check=True, timeout=120)


def test_points_in_a_hull():
    from scipy.optimize import linprog

    rng = np.random.default_rng(5)
    for _ in range(150):
        n, m = int(rng.integers(1, 5)), int(rng.integers(1, 25))
        points, x = rng.integers(0, 7, (m, n)).astype(float), 2.0 * rng.integers(0, 4, n)
        A = np.vstack((points.T, np.ones(m)))
        expected = linprog(np.zeros(m), A_eq=A, b_eq=np.append(x, 1.0), bounds=(0, None), method="highs").status == 0
        assert _in_hull(x, points) == expected
