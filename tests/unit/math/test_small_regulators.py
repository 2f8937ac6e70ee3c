"""Regulators by a kernel are those of the long way, or are refused."""

import numpy as np
import pytest

from sheldrake.math import _matrix_equations as equations
from sheldrake.math._kernels import riccati
from sheldrake.systems.controllers import DiscreteTimeLinearQuadraticRegulator, LinearQuadraticRegulator

KERNELS = {False: riccati.continuous_regulator, True: riccati.discrete_regulator}
both = pytest.mark.parametrize("discrete", [False, True])


def by_kernel(discrete, A, B, Q, R, N=None):
    """S and K, or a status: the kernel as Python, whether or not it is compiled."""
    n, m = B.shape
    found, N = np.zeros((n + m, n)), np.zeros((n, m)) if N is None else N
    status = KERNELS[discrete](A, B, Q, R, N, riccati.make_room(n, m), found)
    return status or (found[:n], found[n:])


def process(seed):
    generator = np.random.default_rng(seed)
    n = int(generator.integers(1, 6))
    m = int(generator.integers(1, n + 1))
    A, B, Q, R = (generator.normal(size=shape) for shape in ((n, n), (n, m), (n, n), (m, m)))
    return A, B, Q @ Q.T + np.eye(n), R @ R.T + 0.1 * np.eye(m), 0.1 * generator.normal(size=(n, m))


@both
@pytest.mark.parametrize("seed", range(12))
def test_they_are_those_of_the_long_way(discrete, seed, monkeypatch):
    A, B, Q, R, N = process(seed)
    long_way = DiscreteTimeLinearQuadraticRegulator if discrete else LinearQuadraticRegulator
    monkeypatch.setattr(equations.quick, "worth_making", lambda kernel: False)
    monkeypatch.setattr(equations, "_regulators", {})
    K, S = long_way(A, B, Q, R, N)
    found = by_kernel(discrete, A, B, Q, R, N)
    np.testing.assert_allclose(found[0], S, rtol=0, atol=1e-9 * np.abs(S).max())  # conditions of up to 1e5
    np.testing.assert_allclose(found[1], K, rtol=0, atol=1e-9 * np.abs(K).max())
    np.testing.assert_array_equal(found[0], found[0].T)


@both
def test_the_compiled_kernel_says_the_same(discrete, monkeypatch):
    monkeypatch.setattr(equations.quick, "worth_making", lambda kernel: True)
    monkeypatch.setattr(equations, "_regulators", {})
    A, B, Q, R, N = process(5)
    expected = by_kernel(discrete, A, B, Q, R, N)
    for _ in range(2):  # made, and kept
        made = equations.small_regulator(A, B, np.asfortranarray(Q), R, N, discrete=discrete)
        for ours, interpreted in zip(made, expected):
            np.testing.assert_allclose(ours, interpreted, rtol=0, atol=1e-11 * np.abs(interpreted).max())
    assert list(equations._regulators) == [(*B.shape, discrete)]


REFUSED = {
    "R is indefinite": lambda A, B, Q, R: (A, B, Q, -R),
    "R is singular": lambda A, B, Q, R: (A, np.hstack([B, B]), Q, np.ones((2, 2))),
    "R is not symmetric": lambda A, B, Q, R: (A, np.hstack([B, B]), Q, np.array([[1.0, 0.1], [0.0, 1.0]])),
    "Q is not symmetric": lambda A, B, Q, R: (A, B, Q + np.array([[0.0, 0.1], [0.0, 0.0]]), R),
    "nothing moves what grows": lambda A, B, Q, R: (A, 0 * B, Q, R),
    "nothing sees what stays": lambda A, B, Q, R: (A * [[1.0, 0.0], [0.0, 0.0]] + np.diag([0, 1e-12]), B, 0 * Q, R),
    "a number is none": lambda A, B, Q, R: (A * np.nan, B, Q, R),
    "a number is infinite": lambda A, B, Q, R: (A, B, Q + np.diag([np.inf, 0.0]), R),
}


@both
@pytest.mark.parametrize("why", REFUSED)
def test_what_is_not_clearly_solved_is_refused(discrete, why):
    A, B, Q, R = np.array([[1.5, 0.3], [0.0, 2.0]]), np.array([[0.0], [1.0]]), np.eye(2), np.eye(1)
    assert not isinstance(by_kernel(discrete, A, B, Q, R), int)
    with np.errstate(all="ignore"):
        assert by_kernel(discrete, *REFUSED[why](A, B, Q, R)) == riccati.UNSOLVED
