"""Gains against pydrake's to 1e-9, and a PID loop's trajectory."""

import numpy as np
import pytest

from sheldrake.systems import controllers as ours

pytestmark = pytest.mark.peer
theirs = pytest.importorskip("pydrake.systems.controllers")


def gains(m, seed, error=0.0):
    rng = np.random.default_rng(seed)
    A, B = rng.normal(size=(5, 5)), rng.normal(size=(5, 2))
    A[0, 0] += error
    Q, R, N = np.diag(rng.random(5) + 0.1), np.diag(rng.random(2) + 0.1), 0.05 * rng.normal(size=(5, 2))
    out = [m.LinearQuadraticRegulator(A, B, Q, R), m.LinearQuadraticRegulator(A, B, Q, R, N)]
    out += [m.LinearQuadraticRegulator(A, B, Q, R, F=rng.normal(size=(1, 5)))] if seed % 2 else []
    out += [m.DiscreteTimeLinearQuadraticRegulator(A, B, Q, R), m.DiscreteTimeLinearQuadraticRegulator(A, B, Q, R, N)]
    return [matrix for pair in out for matrix in pair]


def worst(a, b):
    return max(float(np.abs(x - y).max() / max(1.0, np.abs(y).max())) for x, y in zip(a, b))


@pytest.mark.parametrize("seed", range(6))
def test_gains(seed):
    assert worst(gains(ours, seed), gains(theirs, seed)) < 1e-9


def test_the_comparison_sees_a_slightly_wrong_system():
    assert worst(gains(ours, 0, error=1e-7), gains(theirs, 0)) > 1e-9
