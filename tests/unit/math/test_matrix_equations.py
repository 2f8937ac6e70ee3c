"""Riccati and Lyapunov equations: what solves them, and what it needs."""

import numpy as np
import pytest
import scipy.linalg

from sheldrake.math import (
    ContinuousAlgebraicRiccatiEquation,
    DiscreteAlgebraicRiccatiEquation,
    RealContinuousLyapunovEquation,
    RealDiscreteLyapunovEquation,
)


def problem(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 8))
    C = rng.normal(size=(n, n))
    return rng.normal(size=(n, n)), rng.normal(size=(n, int(rng.integers(1, n + 1)))), C.T @ C, rng


@pytest.fixture
def without_scipy(monkeypatch):
    for name in ("continuous_are", "discrete_are", "continuous_lyapunov", "discrete_lyapunov"):
        monkeypatch.delattr(scipy.linalg, f"solve_{name}")


@pytest.mark.usefixtures("without_scipy")
@pytest.mark.parametrize("seed", range(20))
def test_small_equations_are_solved_without_scipy(seed):
    A, B, Q, rng = problem(seed)
    m = B.shape[1]
    R, N = np.eye(m), 0.1 * rng.normal(size=B.shape)
    Q = Q + N @ N.T

    def is_zero(*terms):
        return np.abs(sum(terms)).max() <= 1e-9 * max(np.abs(term).max() for term in terms)

    S = ContinuousAlgebraicRiccatiEquation(A, B, Q, R)
    assert is_zero(S @ A, A.T @ S, -S @ B @ B.T @ S, Q)
    assert np.linalg.eigvals(A - B @ B.T @ S).real.max() < 0.0
    X = DiscreteAlgebraicRiccatiEquation(A, B, Q, R, N)
    K = np.linalg.solve(B.T @ X @ B + R, B.T @ X @ A + N.T)
    assert is_zero(A.T @ X @ A, -X, -(A.T @ X @ B + N) @ K, Q)
    assert np.abs(np.linalg.eigvals(A - B @ K)).max() < 1.0
    X = RealContinuousLyapunovEquation(A, Q)
    assert is_zero(A.T @ X, X @ A, Q)
    X = RealDiscreteLyapunovEquation(A, Q)
    assert is_zero(A.T @ X @ A, -X, Q)


def test_a_chain_of_many_integrators_is_left_to_scipy():
    n = 60
    A, B = np.diag(np.ones(n - 1), 1) - np.eye(n), np.eye(n)[:, -1:]
    S = ContinuousAlgebraicRiccatiEquation(A, B, np.eye(n), [[1.0]])
    assert np.abs(S @ A + A.T @ S - S @ B @ B.T @ S + np.eye(n)).max() < 1e-9
