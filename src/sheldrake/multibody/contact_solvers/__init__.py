"""Contact and constraint solvers of the discrete plant: what they are given, and what their status means."""

from ._icf_solver_parameters import IcfSolverParameters

__all__ = ["IcfSolverParameters"]
