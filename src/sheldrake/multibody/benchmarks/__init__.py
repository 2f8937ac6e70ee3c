"""Mechanisms whose motion is known, to measure simulations by."""

from sheldrake.multibody.benchmarks._mass_damper_spring import MassDamperSpringAnalyticalSolution

__all__ = ["MassDamperSpringAnalyticalSolution"]

for _name in __all__:
    globals()[_name].__module__ = __name__
