"""What calls of `symbolic` refuse, as pydrake does, rather than give something."""

import importlib

import numpy as np
import pytest

pytest.importorskip("pydrake.symbolic")

pytestmark = pytest.mark.peer

WRONG = {
    "a negative number of rows": lambda s, x, y: s.MakeVectorVariable(-1, "v"),
    "a negative number of columns": lambda s, x, y: s.MakeMatrixContinuousVariable(2, -1, "v"),
    "half a row": lambda s, x, y: s.MakeVectorContinuousVariable(1.5, "v"),
    "no sine": lambda s, x, y: s.SinCos(None, y),
    "a number for a cosine": lambda s, x, y: s.SinCos(x, 1.0),
    "Taylor of order zero": lambda s, x, y: s.TaylorExpand(x * y, {x: 1.0}, 0),
    "small coefficients below zero": lambda s, x, y: s.Polynomial(x).RemoveTermsWithSmallCoefficients(-1.0),
    "small coefficients of nothing": lambda s, x, y: s.Polynomial(x).RemoveTermsWithSmallCoefficients(0.0),
    "a norm with a negative tolerance": lambda s, x, y: s.DecomposeL2NormExpression(s.sqrt(x * x + y * y), -1.0),
    "a norm with no tolerance": lambda s, x, y: s.DecomposeL2NormExpression(s.sqrt(x * x), 1e-8, -1e-9),
    "an even basis of degree -1": lambda s, x, y: s.EvenDegreeMonomialBasis(s.Variables([x]), -1),
    "an odd basis of degree -1": lambda s, x, y: s.OddDegreeMonomialBasis(s.Variables([x]), -1),
    "no polynomial": lambda s, x, y: s.DecomposeQuadraticPolynomial((), {}),
    "a variable without a place": lambda s, x, y: s.DecomposeQuadraticPolynomial(s.Polynomial(x * y), {x.get_id(): 0}),
}


@pytest.mark.parametrize("what", WRONG)
def test_refused_by_both(what):
    for name in ("sheldrake", "pydrake"):
        symbolic = importlib.import_module(f"{name}.symbolic")
        with pytest.raises((TypeError, ValueError, RuntimeError, IndexError, MemoryError, SystemExit)) as error:
            WRONG[what](symbolic, symbolic.Variable("x"), symbolic.Variable("y"))
        assert name == "pydrake" or isinstance(error.value, (TypeError, ValueError, RuntimeError))


def test_numbers_of_rows_may_be_flags_and_numbers_of_numpy():
    for name in ("sheldrake", "pydrake"):
        symbolic = importlib.import_module(f"{name}.symbolic")
        assert symbolic.MakeMatrixVariable(True, np.int64(2), "v").shape == (1, 2)
        assert symbolic.MakeVectorBinaryVariable(True, "v").shape == (1,)
