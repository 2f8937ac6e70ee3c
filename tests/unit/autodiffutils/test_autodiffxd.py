import copy
import math
import pickle

import numpy as np
import pytest

from sheldrake import forwarddiff
from sheldrake.autodiffutils import (
    AutoDiffXd,
    ExtractGradient,
    ExtractValue,
    InitializeAutoDiff,
    InitializeAutoDiffTuple,
    autodiff_equal_to,
)
from sheldrake.common.quick import FEW

UNARY = ["sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "abs"]
NUMPY_NAMES = {"asin": "arcsin", "acos": "arccos", "atan": "arctan"}


def ad(value, *derivatives):
    return AutoDiffXd(value, list(derivatives))


def complex_step(f, x, h=1e-30):
    """Derivative of an analytic function, exact to round-off: an oracle that shares nothing with the class."""
    return f(x + 1j * h).imag / h


@pytest.mark.parametrize("name", [n for n in UNARY if n != "abs"])
@pytest.mark.parametrize("x", [0.15, 0.5, 0.93])
def test_unary_functions_have_the_slope_of_the_complex_step(name, x):
    numpy_function = getattr(np, NUMPY_NAMES.get(name, name))
    y = getattr(ad(x, 1.0, -2.0), name)()
    assert y.value() == pytest.approx(numpy_function(x), rel=1e-15)
    slope = complex_step(numpy_function, x)
    np.testing.assert_allclose(y.derivatives(), [slope, -2.0 * slope], rtol=1e-14)


def test_arithmetic_follows_the_product_and_quotient_rules():
    def f(x, y):
        return (x * y - 3.0 / x) / (2.0 + y) - x + 1.5 * y - (-x) ** 3

    x, y = InitializeAutoDiff([0.7, -1.3]).ravel()
    z = f(x, y)
    assert z.value() == pytest.approx(f(0.7, -1.3), rel=1e-15)
    expected = [complex_step(lambda s: f(s, -1.3), 0.7), complex_step(lambda s: f(0.7, s), -1.3)]
    np.testing.assert_allclose(z.derivatives(), expected, rtol=1e-13)


def test_numpy_functions_work_on_object_arrays():
    x = InitializeAutoDiff([0.3, 0.4]).ravel()
    np.testing.assert_allclose(ExtractValue(np.sin(x)).ravel(), np.sin([0.3, 0.4]))
    assert np.dot(x, x).value() == pytest.approx(0.25)
    np.testing.assert_allclose(np.linalg.norm(x).derivatives(), [0.6, 0.8], rtol=1e-15)
    np.testing.assert_allclose((np.array([1.0, 2.0]) * x)[1].derivatives(), [0.0, 2.0])
    np.testing.assert_allclose((x[0] * np.array([1.0, 2.0]))[1].derivatives(), [2.0, 0.0])
    assert (np.float64(2.0) * x[0]).derivatives()[0] == 2.0
    assert isinstance(np.arctan2(x[:1], x[1:])[0], AutoDiffXd)


def test_constants_mix_and_different_sizes_do_not():
    constant, x = AutoDiffXd(3.0), ad(1.0, 1.0, 0.0)
    for z in (x + constant, constant + x, x - constant, constant - x, x * constant, constant * x, x / constant):
        assert z.derivatives().shape == (2,)
    np.testing.assert_array_equal((constant - x).derivatives(), [-1.0, 0.0])
    np.testing.assert_allclose((constant / x).derivatives(), [-3.0, 0.0])
    assert (constant * constant).derivatives().shape == (0,)
    for operate in (lambda a, b: a + b, lambda a, b: a - b, lambda a, b: a * b, lambda a, b: a / b):
        with pytest.raises(RuntimeError, match="2 and 3 derivatives"):
            operate(x, ad(1.0, 0.0, 0.0, 1.0))


def test_numbers_are_values_and_do_not_share_derivatives():
    x = ad(1.0, 1.0)
    y = x + 1.0
    y.derivatives()[0] = 99.0
    y += 1.0
    assert x.derivatives()[0] == 1.0 and x.value() == 1.0


def test_comparisons_look_at_values():
    x, y = ad(1.0, 1.0, 0.0), ad(1.0, 0.0, 1.0)
    assert x == y and x == 1 and not x != 1.0 and x <= 1 and x >= y and not x < y and 0.5 < x < 2
    assert x != "x" and (x == None) is False  # noqa: E711
    with pytest.raises(TypeError):
        x < "x"  # noqa: B015
    with pytest.raises(TypeError):
        hash(x)
    with pytest.raises(TypeError):
        float(x)


def test_ieee_answers_instead_of_exceptions():
    zero = ad(0.0, 1.0)
    assert math.isinf((1.0 / zero).value()) and math.isinf((ad(1.0, 1.0) / 0).derivatives()[0])
    assert math.isinf(zero.sqrt().derivatives()[0])
    assert zero.log().value() == -math.inf
    assert math.isnan(ad(-1.0, 1.0).sqrt().value()) and math.isnan(ad(2.0, 1.0).asin().value())
    assert math.isinf(ad(1000.0, 1.0).exp().value())
    assert (ad(-1.0, 1.0) ** 2).derivatives()[0] == -2.0


def test_min_max_keep_the_first_of_equals():
    x, y = ad(2.0, 1.0, 0.0), ad(2.0, 0.0, 1.0)
    assert x.max(y).derivatives()[0] == 1.0 and x.min(y).derivatives()[0] == 1.0
    assert x.max(3).derivatives().size == 0 and x.min(3) is x


@pytest.mark.parametrize("size", [1, 3, 40])
def test_the_short_ways_of_calls_made_often_give_the_same_bits(size):
    rng = np.random.default_rng(4)
    x, y = (AutoDiffXd(rng.uniform(0.1, 0.9), rng.normal(size=size)) for _ in range(2))
    calls = {
        "x + y": lambda: x + y,
        "x - y": lambda: x - y,
        "x * y": lambda: x * y,
        "x / y": lambda: x / y,
        "x * 3": lambda: x * 3,
        "atan2": lambda: x.atan2(y),
        "-x": lambda: -x,
        "asin": lambda: x.asin(),
        "of its own": lambda: (x * x).sqrt(),
    }
    before = {name: call() for name, call in calls.items()}
    for _ in range(FEW):
        x * y, -x
    for name, call in calls.items():
        assert autodiff_equal_to(call(), before[name]), name
        assert call().derivatives().flags.writeable, name
    view = AutoDiffXd(2.0)
    view._d = np.ones((size, 2))[:, 0]  # not in one piece
    assert autodiff_equal_to(view * x, AutoDiffXd(2.0, np.ones(size)) * x)


def test_short_ways_are_quiet_about_numbers_that_are_not_finite():
    zero, infinite = ad(0.0, 1.0), ad(math.inf, 1.0)
    for _ in range(FEW + 2):
        product = zero * infinite
    assert math.isnan(product.value()) and product.derivatives() == [math.inf]


def test_nan_gives_way_to_the_other_in_min_and_max():
    for name in ("min", "max"):
        assert getattr(ad(math.nan, 1.0), name)(ad(2.0)).value() == 2.0
        assert math.isnan(getattr(ad(2.0), name)(ad(math.nan)).value())


def test_constructor_forms():
    assert AutoDiffXd(2.0).derivatives().shape == (0,)
    np.testing.assert_array_equal(AutoDiffXd(2, 3, 1).derivatives(), [0.0, 1.0, 0.0])
    np.testing.assert_array_equal(AutoDiffXd(value=2, size=3, offset=1).derivatives(), [0.0, 1.0, 0.0])
    np.testing.assert_array_equal(AutoDiffXd(value=2, derivatives=[[1], [2]]).derivatives(), [1.0, 2.0])
    for bad in (("a",), (1.0, 3), (1.0, [[1.0, 2.0]]), (ad(1.0, 1.0),), (), (1.0, 3.5, 1)):
        with pytest.raises(TypeError):
            AutoDiffXd(*bad)


def test_text_copy_and_pickle():
    x = ad(1.5, 1.0, 2.0)
    assert str(x) == "AD{1.5, nderiv=2}" and repr(x) == "<AutoDiffXd 1.5 nderiv=2>" and f"{x}" == str(x)
    for y in (copy.copy(x), copy.deepcopy(x), pickle.loads(pickle.dumps(x))):
        assert autodiff_equal_to(x, y)
    with pytest.raises(AttributeError):
        x.anything = 1


def test_matrices_of_variables():
    x = InitializeAutoDiff([[1.0, 2.0], [3.0, 4.0]])
    np.testing.assert_array_equal(ExtractGradient(x), np.eye(4))
    np.testing.assert_array_equal(ExtractValue(x), [[1.0, 2.0], [3.0, 4.0]])
    assert InitializeAutoDiff([1.0, 2.0]).shape == (2, 1)
    assert InitializeAutoDiff([1.0, 2.0], 5, 2)[1, 0].derivatives().tolist() == [0, 0, 0, 1, 0]
    gradient = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    np.testing.assert_array_equal(ExtractGradient(InitializeAutoDiff([1.0, 2.0], gradient=gradient)), gradient)
    np.testing.assert_array_equal(ExtractGradient(InitializeAutoDiff([1.0, 2.0], gradient)), gradient)
    a, b = InitializeAutoDiffTuple([1.0, 2.0], [[3.0]])
    np.testing.assert_array_equal(ExtractGradient(np.vstack([a, b])), np.eye(3))
    assert x[1, 0].derivatives().tolist() == [0, 1, 0, 0]  # column by column, as Drake stores matrices
    np.testing.assert_array_equal(ExtractGradient([1.0, x[1, 0]]), [[0, 0, 0, 0], [0, 1, 0, 0]])
    given = np.arange(12.0).reshape(4, 3)
    np.testing.assert_array_equal(ExtractGradient(InitializeAutoDiff(np.eye(2), gradient=given)), given)
    assert ExtractGradient([1.0, 2.0]).shape == (2, 0)
    with pytest.raises(RuntimeError, match="one row for each"):
        InitializeAutoDiff([1.0, 2.0], gradient=np.eye(3))
    with pytest.raises(RuntimeError, match="2 and 3"):
        ExtractGradient([ad(1.0, 1.0, 2.0), ad(1.0, 1.0, 2.0, 3.0)])
    with pytest.raises(TypeError):
        ExtractValue(x[0, 0])
    with pytest.raises(TypeError):
        ExtractValue(["a"])


def test_equality_of_structure():
    assert not autodiff_equal_to(ad(1.0, 0.0), AutoDiffXd(1.0))
    assert autodiff_equal_to(ad(1.0, 0.0), AutoDiffXd(1.0), semantic=True)
    assert not autodiff_equal_to(ad(1.0, 0.0), ad(1.0, 0.0, 0.0), semantic=True)


def test_forwarddiff():
    assert forwarddiff.derivative(lambda x: x * x * x, 2.0) == 12.0
    np.testing.assert_allclose(forwarddiff.gradient(lambda x: x.dot(x), np.array([1.0, 2.0])), [2.0, 4.0])
    A = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])
    np.testing.assert_array_equal(forwarddiff.jacobian(lambda x: A @ x, [1.0, 1.0]), A)
    y = forwarddiff.jacobian(lambda x: np.array([AutoDiffXd(1.0), forwarddiff.sin(x[0])]), [0.0])
    np.testing.assert_array_equal(y, [[0.0], [1.0]])
    with pytest.raises(AssertionError):
        forwarddiff.gradient(lambda x: x, [1.0, 2.0])
