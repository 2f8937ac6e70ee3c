"""Limits of other scalars."""

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.symbolic import Expression, Variable
from sheldrake.systems.primitives import Adder_, Saturation, Saturation_


def output(system, u):
    context = system.CreateDefaultContext()
    system.get_input_port().FixValue(context, u)
    return system.get_output_port().Eval(context)


def test_an_output_at_a_limit_has_the_derivatives_of_the_limit():
    system = Saturation_[AutoDiffXd]([AutoDiffXd(-1.0, [1.0, 0.0])], [AutoDiffXd(2.0, [0.0, 1.0])])
    for u, value, slopes in ((5.0, 2.0, [0.0, 1.0]), (0.5, 0.5, [7.0, 8.0]), (-3.0, -1.0, [1.0, 0.0])):
        (y,) = output(system, [AutoDiffXd(u, [7.0, 8.0])])
        assert y.value() == value and y.derivatives().tolist() == slopes


def test_limits_that_are_numbers_have_none():
    inside, above = output(
        Saturation([-1.0, -2.0], [1.0, 2.0]).ToAutoDiffXd(), [AutoDiffXd(x, [1.0]) for x in (0.5, 3.0)]
    )
    assert inside.derivatives().tolist() == [1.0] and above.value() == 2.0 and not above.derivatives().any()


@pytest.mark.parametrize("T", [float, AutoDiffXd, Expression])
def test_limits_in_the_wrong_order_or_of_other_sizes_are_refused(T):
    for low, high in (([1.0], [0.0]), ([1.0, 2.0], [3.0])):
        with pytest.raises(RuntimeError, match="must have the size of max_value"):
            Saturation_[T](low, high)


def test_an_expression_within_limits():
    (y,) = output(Saturation_[Expression]([-1.0], [2.0]), [u := Expression(Variable("u"))])
    (variable,) = u.GetVariables()
    assert [y.Evaluate({variable: x}) for x in (-3.0, 0.5, 7.0)] == [-1.0, 0.5, 2.0]


@pytest.mark.parametrize("T", [AutoDiffXd, Expression])
def test_no_state_is_still_of_the_scalar(T):
    assert Adder_[T](2, 3).AllocateTimeDerivatives().CopyToVector().dtype == np.dtype(object)
