"""Contact and constraint solvers of the discrete plant: what they are given, and what their status means."""

from sheldrake.common._names import show_as_own

from ._icf_solver_parameters import IcfSolverParameters

__all__ = ["IcfSolverParameters"]

show_as_own(globals())
