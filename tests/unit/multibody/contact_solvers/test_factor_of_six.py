"""Blocks of free bodies, six by six: their factor is Cholesky's with 1 / L_ii on the diagonal, or none."""

import numpy as np
import pytest

from sheldrake.multibody.contact_solvers._kernels.factor import factorise_six
from sheldrake.multibody.contact_solvers._kernels.problem import HESSIAN_NOT_POSITIVE, SOLVED

AT = 3  # where the block begins


def factor_of(H):
    """Status and lower triangle of the factor of a matrix, in a block that is stored column after column."""
    L = np.full(AT + 36 + 2, 7.0)
    L[AT : AT + 36] = np.tril(H).T.ravel()
    status = factorise_six(L, AT)
    assert (L[:AT] == 7.0).all() and (L[AT + 36 :] == 7.0).all()
    return status, L[AT : AT + 36].reshape(6, 6).T


def test_factor_is_choleskys():
    rng = np.random.default_rng(0)
    for _ in range(20):
        B = rng.normal(size=(6, 6)) * 10.0 ** rng.uniform(-3, 3, 6)
        H = B.T @ B + 1e-6 * np.diag(np.diag(B.T @ B))
        status, L = factor_of(H)
        assert status == SOLVED
        np.fill_diagonal(L, 1.0 / np.diag(L))
        np.testing.assert_allclose(np.tril(L) @ np.tril(L).T, H, rtol=0.0, atol=1e-14 * np.abs(H).max())


@pytest.mark.parametrize("k", range(6))
@pytest.mark.parametrize("pivot", [0.0, -1.0, np.nan])
def test_what_is_not_positive_has_none(k, pivot):
    H = np.diag(np.arange(1.0, 7.0))
    H[k, k] = pivot
    assert factor_of(H)[0] == HESSIAN_NOT_POSITIVE
