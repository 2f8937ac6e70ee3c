"""Products of matrices of AutoDiffXd by products of floats: what the numbers' own arithmetic gives."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd, ExtractGradient, ExtractValue, InitializeAutoDiff
from sheldrake.autodiffutils._matrices import product
from sheldrake.math import RigidTransform_, RollPitchYaw_


def duals(rng: np.random.Generator, shape: tuple[int, int], derivatives: int) -> np.ndarray:
    values = rng.normal(size=shape)
    if derivatives:
        return InitializeAutoDiff(values, gradient=rng.normal(size=(values.size, derivatives)))
    return np.vectorize(AutoDiffXd, otypes=[object])(values)


def assert_same(found: np.ndarray, expected: np.ndarray) -> None:
    np.testing.assert_allclose(ExtractValue(found), ExtractValue(expected), rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(ExtractGradient(found), ExtractGradient(expected), rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("a, b", [*itertools.product((0, 1, 4), repeat=2)])
def test_as_the_numbers_themselves(a, b):
    rng = np.random.default_rng(3)
    A, B = duals(rng, (2, 3), a), duals(rng, (3, 4), b)
    if {a, b} == {1, 4}:
        with pytest.raises(RuntimeError, match=r"1 and 4|4 and 1"):
            product(A, B)
        return
    assert_same(product(A, B), A.dot(B))


def test_some_without_derivatives_and_numbers_that_are_not_finite():
    rng = np.random.default_rng(5)
    A, B = duals(rng, (3, 3), 2), duals(rng, (3, 3), 2)
    A[1, 2] = AutoDiffXd(0.3)
    assert_same(product(A, B), A.dot(B))
    B[0, 0] = AutoDiffXd(np.inf, [0.0, 1.0])
    A[1, 2] = AutoDiffXd(0.0, [0.0, 1.0])
    assert_same(product(A, B), A.dot(B))


def test_poses():
    x = InitializeAutoDiff(np.linspace(0.1, 0.9, 12)).ravel()
    X, Y = (RigidTransform_[AutoDiffXd](RollPitchYaw_[AutoDiffXd](part[:3]), part[3:]) for part in (x[:6], x[6:]))
    assert_same((X @ Y).GetAsMatrix4()[:3], X.GetAsMatrix4().dot(Y.GetAsMatrix4())[:3])
    assert_same(X.InvertAndCompose(Y).GetAsMatrix4(), (X.inverse() @ Y).GetAsMatrix4())
