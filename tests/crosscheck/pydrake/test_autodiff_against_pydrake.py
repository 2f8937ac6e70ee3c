"""AutoDiffXd against Eigen's AutoDiffScalar as pydrake shows it."""

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd

pytestmark = pytest.mark.peer
theirs = pytest.importorskip("pydrake.autodiffutils")

BINARY = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "atan2": lambda a, b: a.arctan2(b),
    "min": lambda a, b: a.min(b),
    "max": lambda a, b: a.max(b),
    "radd": lambda a, b: 2.5 + b,
    "rsub": lambda a, b: 2.5 - b,
    "rmul": lambda a, b: 2.5 * b,
    "rdiv": lambda a, b: 2.5 / b,
    "divf": lambda a, b: a / -0.3,
    "pow": lambda a, b: a**3,
    "pow_half": lambda a, b: abs(a) ** 0.5,
    "neg": lambda a, b: -a,
    "lt": lambda a, b: AutoDiffXd(float(a < b)) if isinstance(a, AutoDiffXd) else theirs.AutoDiffXd(float(a < b)),
}
UNARY = ["sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "abs"]


def operands():
    rng = np.random.default_rng(3)
    numbers = [(v, d) for v in (0.3, -0.7, 0.9) for d in ([], list(rng.normal(size=3)))]
    numbers += [(0.0, [1.0, 0.0, -1.0]), (1.0, [0.5, 0.0, 0.0]), (-2.0, [0.0, 0.0, 0.0])]
    return numbers


def disagreement(ours, peers) -> float:
    a = np.array([ours.value(), *ours.derivatives()])
    b = np.array([peers.value(), *peers.derivatives()])
    if a.shape != b.shape or (np.isnan(a) != np.isnan(b)).any() or (np.isinf(a) != np.isinf(b)).any():
        return np.inf
    with np.errstate(invalid="ignore"):
        difference = np.where(a == b, 0.0, np.abs(a - b) / np.maximum(1.0, np.abs(b)))
    return float(np.nanmax(difference, initial=0.0))


@pytest.mark.parametrize("name", BINARY)
def test_binary(name):
    for a in operands():
        for b in operands():
            ours = BINARY[name](AutoDiffXd(*a), AutoDiffXd(*b))
            peers = BINARY[name](theirs.AutoDiffXd(*a), theirs.AutoDiffXd(*b))
            assert disagreement(ours, peers) < 1e-14, (a, b, ours, peers)


@pytest.mark.parametrize("name", UNARY)
def test_unary(name):
    for a in operands():
        ours, peers = getattr(AutoDiffXd(*a), name)(), getattr(theirs.AutoDiffXd(*a), name)()
        assert disagreement(ours, peers) < 1e-14, (a, ours, peers)
        assert repr(AutoDiffXd(*a)) == repr(theirs.AutoDiffXd(*a)) and str(AutoDiffXd(*a)) == str(theirs.AutoDiffXd(*a))


def test_the_comparison_sees_a_wrong_derivative():
    assert disagreement(AutoDiffXd(1.0, [1.0, 2.0]), theirs.AutoDiffXd(1.0, [1.0, 2.0 + 1e-12])) > 1e-14
    assert disagreement(AutoDiffXd(1.0, [np.nan]), theirs.AutoDiffXd(1.0, [1.0])) == np.inf
