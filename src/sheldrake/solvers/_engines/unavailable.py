"""Solvers that nothing stands behind here."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from sheldrake.solvers._engines.interface import Engine
from sheldrake.solvers._ids import ProgramAttribute as A
from sheldrake.solvers._program_type import CONIC


class _Unavailable(Engine):
    @classmethod
    def _is_available(cls) -> bool:
        return False

    @classmethod
    def _is_enabled(cls) -> bool:
        return False

    def _why_not_available(self) -> str:
        return "has not been compiled as part of this binary; sheldrake has nothing that stands behind it."


class _License:
    """A license; there is none to be had."""

    def is_valid(self) -> bool:
        """Tells whether it may be used: never."""
        return False

    def __enter__(self) -> _License:
        return self

    def __exit__(self, *error: object) -> None:
        """Does nothing: there is nothing to give back."""


class _Licensed(_Unavailable):
    """A solver that asks for a license."""

    _attributes = CONIC | {A.kQuadraticCost, A.kL2NormCost, A.kBinaryVariable}

    @classmethod
    def AcquireLicense(cls) -> _License:
        """Gives no license.

        Raises:
            RuntimeError: always.
        """
        raise RuntimeError(f"{cls.__name__}.AcquireLicense(): {cls._name} is not available in this build.")


class GurobiSolver(_Licensed):
    """Gurobi; never available."""

    _name = "Gurobi"

    class License(_License):
        """A license of Gurobi; there is none to be had."""

    @classmethod
    def AcquireLicense(cls) -> _License:
        """Gives a license that is not valid: programs hold one around all that they solve, by whatever solver."""
        return cls.License()

    class SolveStatusInfo:
        """What a running solve tells its callbacks."""

        def __init__(self) -> None:
            self.reported_runtime = self.current_objective = self.best_objective = self.best_bound = 0.0
            self.explored_node_count = self.feasible_solutions_count = 0

    def AddMipNodeCallback(self, callback: Callable) -> None:
        """Sets a function to be called at nodes of the search tree; it never is."""
        self._node_callback = callback

    def AddMipSolCallback(self, callback: Callable) -> None:
        """Sets a function to be called with new solutions; it never is."""
        self._solution_callback = callback


class GurobiSolverDetails(NamedTuple):
    """What Gurobi would tell of a solve."""

    optimizer_time: float
    error_code: int
    optimization_status: int
    objective_bound: float


class MosekSolver(_Licensed):
    """MOSEK; never available."""

    _name = "MOSEK"

    class License(_License):
        """A license of MOSEK; there is none to be had."""


class MosekSolverDetails(NamedTuple):
    """What MOSEK would tell of a solve."""

    optimizer_time: float
    rescode: int
    solution_status: int
