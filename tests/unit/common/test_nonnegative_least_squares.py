import numpy as np
import pytest

from sheldrake.common._nonnegative_least_squares import nonnegative_least_squares


@pytest.mark.parametrize("seed", range(60))
def test_the_residual_is_scipys(seed):
    from scipy.optimize import nnls

    rng = np.random.default_rng(seed)
    m, n = rng.integers(1, 9, 2)
    A, b = rng.normal(size=(m, n)) * 10.0 ** rng.uniform(-3, 3), rng.normal(size=m) * 10.0 ** rng.uniform(-3, 3)
    if seed % 3 == 0:
        A = np.round(A)  # columns that depend on each other, or are zero
    x = nonnegative_least_squares(A, b)
    assert (x >= 0.0).all()
    assert np.linalg.norm(A @ x - b) == pytest.approx(nnls(A, b)[1], rel=1e-9, abs=1e-12 * np.linalg.norm(b))


def test_no_columns():
    assert nonnegative_least_squares(np.zeros((3, 0)), np.ones(3)).shape == (0,)
