import copy
import pickle

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.polynomial import Polynomial, Polynomial_
from sheldrake.symbolic import Expression, Variable


def c(p):
    return p.GetCoefficients().tolist()


def test_values_derivatives_integrals():
    p = Polynomial([1.0, 2.0, 3.0])
    assert p.EvaluateUnivariate(2.0) == 17.0 and p.EvaluateUnivariate(x=2.0, derivative_order=1) == 14.0
    assert p.EvaluateUnivariate(2.0, 2) == 6.0 and p.EvaluateUnivariate(2.0, 5) == 0.0
    assert c(p.Derivative()) == [2.0, 6.0] and c(p.Derivative(3)) == [0.0] and c(p.Derivative(0)) == [1.0, 2.0, 3.0]
    assert c(p.Integral(5.0)) == [5.0, 1.0, 1.0, 1.0] and c(p.Integral(2.5).Derivative()) == c(p)
    assert (p.GetDegree(), p.GetNumberOfCoefficients(), p.IsAffine()) == (2, 3, False)
    assert c(Polynomial()) == [0.0] and c(Polynomial(3)) == [3.0] and c(Polynomial([])) == [0.0]
    assert c(Polynomial([1.0, 0.0, 0.0])) == [1.0, 0.0, 0.0]


def test_ring():
    rng = np.random.default_rng(1)
    p, q, r = (Polynomial(rng.normal(size=n)) for n in (3, 5, 2))
    x = 0.7
    for made, expected in (
        (p + q, p.EvaluateUnivariate(x) + q.EvaluateUnivariate(x)),
        (p - q, p.EvaluateUnivariate(x) - q.EvaluateUnivariate(x)),
        (p * q, p.EvaluateUnivariate(x) * q.EvaluateUnivariate(x)),
        ((p + q) * r, (p * r + q * r).EvaluateUnivariate(x)),
        (1 - p, 1 - p.EvaluateUnivariate(x)),
        (2 * p / 4 + 3, p.EvaluateUnivariate(x) / 2 + 3),
        (-p, -p.EvaluateUnivariate(x)),
    ):
        assert made.EvaluateUnivariate(x) == pytest.approx(expected, rel=1e-14)
    assert c(p - p) == [0.0] and p == Polynomial(p.GetCoefficients()) and p != q and p != 3
    assert p.CoefficientsAlmostEqual(p + 1e-3, 2e-3) and not p.CoefficientsAlmostEqual(p + 1e-3, 1e-4)
    assert copy.deepcopy(p) == p and pickle.loads(pickle.dumps(p)) == p


def test_refusals():
    with pytest.raises(TypeError):
        Polynomial([[1.0, 2.0]])
    with pytest.raises(TypeError):
        Polynomial("a")
    with pytest.raises(TypeError):
        Polynomial([1.0]) + Polynomial_[AutoDiffXd](1.0)
    with pytest.raises(RuntimeError, match="negative"):
        Polynomial([1.0]).Derivative(-1)
    with pytest.raises(TypeError):
        hash(Polynomial())


def test_other_scalars():
    p = Polynomial_[AutoDiffXd]([AutoDiffXd(1.0, [1.0, 0.0]), AutoDiffXd(2.0, [0.0, 1.0])])
    y = p.EvaluateUnivariate(AutoDiffXd(3.0))
    assert y.value() == 7.0 and y.derivatives().tolist() == [1.0, 3.0]
    a, x = Variable("a"), Variable("x")
    q = Polynomial_[Expression]([a * 1, Expression(2)])
    assert str((q * q).EvaluateUnivariate(x)) == "((x * (4 * a + 4 * x)) + pow(a, 2))"
    assert str(q.CoefficientsAlmostEqual(q, 1e-6)) == "True"
    assert Polynomial_[float] is Polynomial and Polynomial_[None] is Polynomial
    assert Polynomial_[AutoDiffXd].__name__ == "Polynomial_𝓣AutoDiffXd𝓤"
