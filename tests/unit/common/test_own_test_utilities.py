"""Helpers for tests: each accepts what is equal, and refuses the nearest thing that is not."""

import copy
import unittest
import warnings

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd, InitializeAutoDiff
from sheldrake.common.deprecation import DrakeDeprecationWarning
from sheldrake.common.test_utilities import numpy_compare
from sheldrake.common.test_utilities.deprecation import catch_drake_warnings
from sheldrake.common.test_utilities.memory_test_util import actual_ref_count
from sheldrake.common.test_utilities.meta import ValueParameterizedTest, run_with_multiple_values
from sheldrake.common.test_utilities.pickle_compare import assert_pickle
from sheldrake.math import RigidTransform_
from sheldrake.symbolic import Expression, Polynomial, Variable

x, y = Variable("x"), Variable("y")
DUAL = AutoDiffXd(1.0, [1.0, 0.0])

EQUAL = [
    (1.0, 1.0),
    ([1.0, np.nan], [1.0, np.nan]),
    (DUAL, AutoDiffXd(1.0, [1.0, 0.0])),
    (DUAL, 1.0),
    (x, x),
    (x + y, y + x),
    (x + y, "(x + y)"),
    (Expression(2.0), 2.0),
    (2.0, Expression(2.0)),
    (x < y, x < y),
    (Polynomial(x * y), Polynomial(y * x)),
    (np.array([x, y + 1.0]), [x, 1.0 + y]),
    (np.array([[1.0, 2.0]]), [[1, 2]]),
    (np.zeros((0, 3)), np.zeros((0, 3))),
    ("same", "same"),
]
UNEQUAL = [
    (1.0, 1.0 + 1e-15),
    (DUAL, AutoDiffXd(1.0, [1.0, 1e-9])),
    (DUAL, 1.0 + 1e-15),
    (x, y),
    (x + y, x - y),
    (x + y, "x + y"),
    (Expression(2.0), 3.0),
    (x < y, x <= y),
    (Polynomial(x * y), Polynomial(x)),
    (np.array([x, y]), [y, x]),
    (np.array([1.0, 2.0]), [1.0, 3.0]),
    ("one", "another"),
]


@pytest.mark.parametrize("a, b", EQUAL)
def test_equal(a, b):
    numpy_compare.assert_equal(a, b)
    if not isinstance(a, list):  # of a NaN it cannot be said that it is equal
        with pytest.raises(AssertionError, match="all elements are equal"):
            numpy_compare.assert_not_equal(a, b)


@pytest.mark.parametrize("a, b", UNEQUAL)
def test_not_equal(a, b):
    numpy_compare.assert_not_equal(a, b)
    with pytest.raises(AssertionError):
        numpy_compare.assert_equal(a, b)


@pytest.mark.parametrize("b", [np.zeros(3), np.zeros((2, 1)), 0.0])
def test_shapes_count(b):
    for a in (np.zeros(2), np.full(2, Expression(0.0))):
        with pytest.raises(AssertionError, match="shapes differ"):
            numpy_compare.assert_equal(a, b)


def test_a_difference_is_named():
    with pytest.raises(AssertionError, match=r"element \(1,\)"):
        numpy_compare.assert_equal(np.array([x, y]), [x, x])


def test_values_against_floats():
    duals = InitializeAutoDiff([1.0, 2.0])
    numpy_compare.assert_float_equal(duals, np.array([[1.0], [2.0]]))
    numpy_compare.assert_float_equal(Expression(3.0), 3.0)
    numpy_compare.assert_float_not_equal(duals, np.array([[1.0], [2.5]]))
    numpy_compare.assert_float_allclose(duals, np.array([[1.0], [2.0 + 1e-16]]))
    numpy_compare.assert_float_allclose(duals, np.array([[1.0], [2.1]]), atol=0.2)
    for wrong in (np.array([[1.0], [2.0 + 1e-12]]), np.array([1.0, 2.0])):
        with pytest.raises(AssertionError):
            numpy_compare.assert_float_allclose(duals, wrong)
    with pytest.raises(AssertionError, match="floats are expected"):
        numpy_compare.assert_float_equal(duals, duals)
    with pytest.raises(RuntimeError):
        numpy_compare.to_float(x + 1)


def test_close_derivatives_count():
    near, far = AutoDiffXd(1.0, [1.0, 1e-9]), AutoDiffXd(1.0, [1.0, 1e-3])
    numpy_compare.assert_allclose(DUAL, near, atol=1e-8)
    numpy_compare.assert_allclose(DUAL, 1.0)
    with pytest.raises(AssertionError, match="derivatives differ"):
        numpy_compare.assert_allclose(DUAL, far, atol=1e-8)


def test_types():
    assert numpy_compare.resolve_type(np.zeros((2, 2))) is float
    assert numpy_compare.resolve_type(np.array([DUAL, DUAL])) is AutoDiffXd
    assert numpy_compare.resolve_type(x + y) is Expression
    with pytest.raises(AssertionError, match="2 types"):
        numpy_compare.resolve_type(np.array([x, 1.0], dtype=object))
    assert type(numpy_compare.to_float(DUAL)) is float and numpy_compare.to_float(np.zeros((0, 2))).shape == (0, 2)


def test_each_scalar_type_in_turn():
    seen = []
    numpy_compare.check_all_types(lambda T, more: seen.append((T, more)))(more=1)
    assert seen == [(float, 1), (AutoDiffXd, 1), (Expression, 1)]
    seen.clear()
    numpy_compare.check_nonsymbolic_types(lambda T: seen.append(T))()
    assert seen == [float, AutoDiffXd]


def test_warnings_are_counted():
    with catch_drake_warnings(expected_count=1) as caught:
        warnings.warn("gone on 2030-01-01", DrakeDeprecationWarning, stacklevel=1)
    assert len(caught) == 1
    with pytest.raises(AssertionError, match="0 deprecation warnings, expected 2"):
        with catch_drake_warnings(expected_count=2):
            pass


class Forgetful:
    def __init__(self, n):
        self.n = n

    def __reduce__(self):
        return Forgetful, (0,)


def test_pickles():
    test = unittest.TestCase()
    for T in (float, AutoDiffXd):
        assert_pickle(test, RigidTransform_[T]([1.0, 2.0, 3.0]), lambda X: X.GetAsMatrix4(), T=T)
    assert_pickle(test, RigidTransform_[Expression](), lambda X: X.GetAsMatrix4(), T=Expression)
    with pytest.raises(AssertionError):
        assert_pickle(test, Forgetful(3))
    assert copy.copy(Forgetful(3)).n == 0


def test_parameters_of_test_methods():
    seen = []

    class Case(unittest.TestCase, metaclass=ValueParameterizedTest):
        @run_with_multiple_values([dict(a=1, T=float), dict(a=2, T=int)])
        def test_it(self, *, a, T):
            seen.append((a, T))

        def test_plain(self):
            seen.append("plain")

    assert [n for n in dir(Case) if n.startswith("test")] == ["test_it_a_1_T_float", "test_it_a_2_T_int", "test_plain"]
    result = unittest.TestResult()
    unittest.defaultTestLoader.loadTestsFromTestCase(Case).run(result)
    assert result.wasSuccessful() and seen == [(1, float), (2, int), "plain"]


def test_owners():
    obj = object()
    assert actual_ref_count(obj) == 1
    other = obj
    assert actual_ref_count(other) == 2
