"""Polynomials in one variable, by their coefficients. (Polynomials in many: `sheldrake.symbolic`.)"""

from sheldrake.common._scalars import ScalarTemplate
from sheldrake.polynomial._polynomial import Polynomial

__all__ = ["Polynomial", "Polynomial_"]

Polynomial_ = ScalarTemplate("Polynomial_", Polynomial, scope=__name__)
