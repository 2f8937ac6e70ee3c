"""Coefficients of linear systems that are replaced."""

import numpy as np
import pytest

from sheldrake.all import LinearSystem


@pytest.mark.parametrize("wrong", [{"B": np.zeros((3, 1))}, {}])
def test_all_coefficients_are_replaced_or_none(wrong):
    system = LinearSystem(A=[[0.0, 1.0], [-2.0, -3.0]], B=[[0.0], [1.0]])
    with pytest.raises(RuntimeError, match="UpdateCoefficients"):
        system.UpdateCoefficients(A=np.eye(2), **wrong)
    assert system.A().tolist() == [[0.0, 1.0], [-2.0, -3.0]]
    system.UpdateCoefficients(A=np.eye(2), B=[[2.0], [0.0]])
    assert system.A().tolist() == np.eye(2).tolist()
    assert system.B().tolist() == [[2.0], [0.0]]
