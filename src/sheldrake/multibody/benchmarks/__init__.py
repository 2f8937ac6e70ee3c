"""Mechanisms whose motion is known, to measure simulations by."""

from sheldrake.common._names import show_as_own
from sheldrake.multibody.benchmarks._mass_damper_spring import MassDamperSpringAnalyticalSolution

__all__ = ["MassDamperSpringAnalyticalSolution"]

show_as_own(globals())
