"""Numbers in LaTeX."""

import math

import pytest

from sheldrake.symbolic import ToLatex, Variable


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (math.pi, r"\pi"), (-math.pi, r"-\pi"), (2 * math.pi, r"2\pi"), (math.e, "e"), (-3 * math.e, "-3e"),
        (math.inf, r"\infty"), (-math.inf, r"-\infty"), (math.pi / 2, "1.571"), (3.14, "3.140"), (-4.0, "-4"),
        (1e20, "100000000000000000000"),
    ],
)  # fmt: skip
def test_numbers(number, text):
    assert ToLatex(number) == text
    assert ToLatex(number + Variable("x")) == f"({text} + x)"
