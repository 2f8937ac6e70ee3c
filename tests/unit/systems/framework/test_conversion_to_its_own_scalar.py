"""A system is not converted to the scalar it has: Clone() is for that."""

import pytest

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.systems.primitives import Adder


def test_the_same_scalar_is_refused():
    adder = Adder(2, 3)
    assert adder.ToScalarTypeMaybe[float]() is None
    with pytest.raises(RuntimeError, match="does not support scalar conversion to type float"):
        adder.ToScalarType[float]()
    dual = adder.ToAutoDiffXd()
    assert dual.ToAutoDiffXdMaybe() is None
    assert isinstance(dual.ToScalarType[float](), Adder)
    assert isinstance(adder.ToScalarTypeMaybe[AutoDiffXd](), type(dual))
