"""What all solvers have.

A solver says which attributes of programs it takes, whether it is installed, and solves.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._made_methods import MadeMethod
from sheldrake.solvers._ids import (
    CommonSolverOption,
    ProgramAttribute,
    SolverId,
    SolverOptions,
    SolverType,
    solver_type_of,
)
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.solvers._result import MathematicalProgramResult

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


def is_installed(package: str) -> bool:
    """Whether a package can be imported."""
    if package not in sys.modules and package not in _found and importlib.util.find_spec(package) is not None:
        _found.add(package)  # to look again takes longer than to solve a small program
    return package in sys.modules or package in _found


_found: set[str] = set()


def attribute_name(attribute: ProgramAttribute) -> str:
    """The name of an attribute without its k."""
    return attribute.name[1:]


def option_name(name: str, meaning: str) -> Callable[[], str]:
    """A static method of a solver that returns the name of an option.

    Args:
        name: The name.
        meaning: What the option is for.
    """
    made = MadeMethod(lambda: name, f"Returns the name of the option for {meaning}.", static=True)
    return made  # type: ignore[return-value]


class SolverInterface:
    """A solver of mathematical programs.

    Solvers of your own derive from it, and override `available`, `enabled`, `solver_id`,
    `AreProgramAttributesSatisfied`, `ExplainUnsatisfiedProgramAttributes` and
    `Solve(prog, initial_guess, solver_options, result)`, which fills the result.
    """

    def available(self) -> bool:
        """Tells whether what it stands on is installed."""
        raise self._lacks("available")

    def enabled(self) -> bool:
        """Tells whether it may be used; a solver that needs a license and has none may not."""
        raise self._lacks("enabled")

    def solver_id(self) -> SolverId:
        """Returns its name as an id."""
        raise self._lacks("solver_id")

    def solver_type(self) -> SolverType | None:
        """Returns its number, if it has one."""
        return solver_type_of(self.solver_id())

    def SolverName(self) -> str:
        """Returns its name."""
        return self.solver_id().name()

    def AreProgramAttributesSatisfied(self, prog: MathematicalProgram) -> bool:
        """Tells whether it knows how to handle all that a program has."""
        raise self._lacks("AreProgramAttributesSatisfied")

    def ExplainUnsatisfiedProgramAttributes(self, prog: MathematicalProgram) -> str:
        """Returns why it cannot solve a program; empty if it can."""
        raise self._lacks("ExplainUnsatisfiedProgramAttributes")

    @checked
    def Solve(
        self,
        prog: MathematicalProgram,
        initial_guess: ArrayLike | None = None,
        solver_options: SolverOptions | None = None,
        result: MathematicalProgramResult | None = None,
    ) -> Any:
        """Solves a program.

        Args:
            prog: The program.
            initial_guess: Values of all decision variables to start from; those of the program if absent.
            solver_options: Options on top of those of the program.
            result: Is filled instead of a new one being returned. A solver of your own always fills one.

        Raises:
            ValueError: the solver is not available, not enabled, or cannot handle what the program has.
        """
        return self._solved(prog, initial_guess, solver_options, result)

    def _solved(
        self,
        prog: MathematicalProgram,
        initial_guess: ArrayLike | None,
        solver_options: SolverOptions | None,
        result: MathematicalProgramResult | None,
    ) -> Any:
        """See `Solve`; here by the `Solve` of a class that somebody derived, which fills a result."""
        if result is not None or type(self).Solve is SolverInterface.Solve:
            raise self._lacks("Solve")
        result = MathematicalProgramResult()
        result._start(prog, self.SolverName())
        self.Solve(prog, initial_guess, solver_options, result)
        return result

    def _lacks(self, call: str) -> RuntimeError:
        return RuntimeError(
            f'Tried to call pure virtual function "solvers::SolverInterface::{call}": '
            f"{type(self).__name__} must override {call}()."
        )


class Engine(SolverInterface):
    """A solver of this library."""

    _name = ""
    _method: str | None = None  # what does the work, where that is not what the solver is named after
    _attributes: frozenset[ProgramAttribute] = frozenset()

    def available(self) -> bool:
        return self._is_available()

    def enabled(self) -> bool:
        return self._is_enabled()

    @classmethod
    def _is_available(cls) -> bool:
        return True

    @classmethod
    def _is_enabled(cls) -> bool:
        return True

    @classmethod
    def id(cls) -> SolverId:
        """Returns the name of this class of solvers."""
        return SolverId(cls._name)

    def solver_id(self) -> SolverId:
        return SolverId(self._name)

    def AreProgramAttributesSatisfied(self, prog: MathematicalProgram) -> bool:
        return not self._unsatisfied(prog)

    @checked
    def ExplainUnsatisfiedProgramAttributes(self, prog: MathematicalProgram) -> str:
        return self._unsatisfied(prog)

    def _unsatisfied(self, prog: MathematicalProgram) -> str:
        has = parts_of(prog).bindings.attributes()
        if has <= self._attributes:
            return self._restriction(prog)
        missing = sorted(has - self._attributes)
        names = [attribute_name(a) for a in missing]
        verb = "was" if len(names) == 1 else "were"
        words = f"a {names[0]}" if len(names) == 1 else ", ".join(f"a {n}" for n in names[:-1]) + f" and a {names[-1]}"
        tail = "is not supported" if len(names) == 1 else "are not supported"
        return f"{type(self).__name__} is unable to solve because {words} {verb} declared but {tail}."

    def _restriction(self, prog: MathematicalProgram) -> str:
        """Why a program whose attributes are all known cannot be solved; empty if it can."""
        return ""

    def _solved(
        self,
        prog: MathematicalProgram,
        initial_guess: ArrayLike | None,
        solver_options: SolverOptions | None,
        result: MathematicalProgramResult | None,
    ) -> Any:
        name = type(self).__name__
        if not self.available():
            raise ValueError(
                f"{name} cannot Solve because {name}::available() is false, i.e., {name} {self._why_not_available()}"
            )
        if not self.enabled():
            raise ValueError(
                f"{name} cannot Solve because {name}::enabled() is false, i.e., {name} has not been properly "
                "configured for use."
            )
        reason = self._unsatisfied(prog)
        if reason:
            raise ValueError(reason)
        return self._solve(prog, initial_guess, solver_options, result)

    def _solve(
        self,
        prog: MathematicalProgram,
        initial_guess: ArrayLike | None,
        solver_options: SolverOptions | None,
        result: MathematicalProgramResult | None = None,
    ) -> Any:
        """`Solve` of a program that this solver is known to take."""
        out = object.__new__(MathematicalProgramResult) if result is None else result
        out._start(prog, self._method or self._name)
        variables = parts_of(prog).variables
        count = variables.num_vars()
        guess = variables.initial_guess() if initial_guess is None else np.asarray(initial_guess, dtype=float).ravel()
        if guess.size != count:
            raise ValueError(f"Solve expects initial guess of size {count}, got {guess.size} instead.")
        options = prog.solver_options()._merged(solver_options)
        self._do_solve(prog, guess, options, out)
        return out if result is None else None

    def _why_not_available(self) -> str:
        return "has not been compiled as part of this binary."

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        raise NotImplementedError(f"{type(self).__name__}.Solve()")

    def _options(self, options: SolverOptions, known: dict[str, Any]) -> dict[str, Any]:
        """Values of the options of this solver, over their defaults.

        Raises:
            RuntimeError: an option is not known.
        """
        return {**known, **self._given(options, known)}

    def _given(self, options: SolverOptions, known: Iterable[str]) -> dict[str, Any]:
        """The options given to this solver.

        Raises:
            RuntimeError: one of them is not among the known ones.
        """
        given = options._of(self._name)
        if not given:
            return {}
        unknown = given.keys() - set(known)
        if unknown:
            raise RuntimeError(
                f"{self._name}: the following solver option names were not recognized: {', '.join(sorted(unknown))}. "
                f"Known are {', '.join(sorted(known))}."
            )
        return dict(given)

    @staticmethod
    def _prints(options: SolverOptions) -> bool:
        return bool(options.options and options._common(CommonSolverOption.kPrintToConsole, 0))
