"""NumPy's scalars leave operators to symbols and duals; arrays apply them element by element."""

import operator

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.symbolic import Monomial, Polynomial, Variable

x = Variable("x")
OBJECTS = [x, x + 1.0, Polynomial(x), Monomial(x), AutoDiffXd(2.0, [1.0])]


@pytest.mark.parametrize("other", OBJECTS, ids=lambda o: type(o).__name__)
@pytest.mark.parametrize("scalar", [np.float64(3.0), np.float32(3.0), np.int64(3)], ids=lambda s: type(s).__name__)
def test_scalars_are_as_floats(scalar, other):
    for op in (operator.mul,) if isinstance(other, Monomial) else (operator.mul, operator.add, operator.sub):
        assert str(op(scalar, other)) == str(op(3.0, other))
        assert type(op(scalar, other)) is type(op(3.0, other))


@pytest.mark.parametrize("other", OBJECTS, ids=lambda o: type(o).__name__)
def test_arrays_take_each_element(other):
    found = np.array([3.0, 4.0]) * other
    assert found.shape == (2,) and [str(e) for e in found] == [str(3.0 * other), str(4.0 * other)]


def test_comparisons():
    assert str(np.float64(1.0) <= x) == str(1.0 <= x) == "(x >= 1)"
    assert (np.float64(1.0) < AutoDiffXd(2.0, [1.0])) is True
