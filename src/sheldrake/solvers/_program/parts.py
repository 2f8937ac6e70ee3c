"""The parts of a program, put together: each takes what it needs, and knows nothing of those after it.

variables                    decision variables, indeterminates, guess, scales
bindings                     costs and constraints in lists by kind, and their values
costs, constraints, cones    what calls are given, parsed and bound to variables
epigraphs, polynomials       what is said with new variables and the constraints above
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

from sheldrake.solvers._functions.evaluators import Changes
from sheldrake.solvers._program.bindings import ProgramBindings
from sheldrake.solvers._program.cones import ProgramCones
from sheldrake.solvers._program.constraints import ProgramConstraints
from sheldrake.solvers._program.costs import ProgramCosts
from sheldrake.solvers._program.epigraphs import ProgramEpigraphs
from sheldrake.solvers._program.polynomials import ProgramPolynomials
from sheldrake.solvers._program.variables import ProgramVariables

if TYPE_CHECKING:
    from sheldrake.solvers._program.program import MathematicalProgram


Form = TypeVar("Form")


def _same(a: Sequence[object], b: Sequence[object]) -> bool:
    """Whether both are the very same objects."""
    return len(a) == len(b) and all(map(operator.is_, a, b))


class ProgramParts:
    """What a program consists of.

    Args:
        variables: Its variables.
        bindings: What is bound to them.
    """

    def __init__(self, variables: ProgramVariables, bindings: ProgramBindings) -> None:
        self.variables = variables
        self.bindings = bindings
        self.costs = ProgramCosts(bindings)
        self.constraints = ProgramConstraints(bindings)
        self._seen: tuple[object, ...] = ()
        self._contents: tuple[list[Any], list[Any]] | None = None
        self._forms: dict[Any, tuple[list[Any], Any]] = {}  # each with the numbers that it has

    @functools.cached_property
    def cones(self) -> ProgramCones:
        """Adds cones."""
        return ProgramCones(self.variables, self.bindings)

    @functools.cached_property
    def epigraphs(self) -> ProgramEpigraphs:
        """Adds what is said with new variables and cones."""
        return ProgramEpigraphs(self.variables, self.costs, self.constraints, self.cones)

    @functools.cached_property
    def polynomials(self) -> ProgramPolynomials:
        """Adds polynomials."""
        return ProgramPolynomials(self.variables, self.bindings, self.cones)

    def form(self, kind: Callable[[MathematicalProgram], Form], program: MathematicalProgram) -> Form:
        """The program in the form of a solver, kept while the program stays the same.

        Args:
            kind: Makes the form; its `moved(program)` gives the same for other bounds, linear costs and constants, or
                None where it must be made anew.
            program: The program of these parts.
        """
        contents = self._look()
        if contents is None:
            return kind(program)
        numbers, found = self._forms.get(kind, (None, None))
        if found is None or numbers is not contents[1]:
            found = (found and found.moved(program)) or kind(program)
            self._forms[kind] = contents[1], found
        return found

    def _look(self) -> tuple[list[Any], list[Any]] | None:
        """What is in the program now, the same while nothing changes; forgets forms that do not fit any more.

        Lists without anything in them where it was not looked at yet; None where forms are not kept.
        """
        seen = Changes.latest, self.bindings.version, self.variables.decisions()
        if _same(seen, self._seen):
            return self._contents
        before = self._contents
        now: tuple[list[Any], list[Any]] | None = None
        if not _same(seen[1:], self._seen[1:]):  # most programs are solved but once: to be looked at when it is again
            now = ([], []) if self.bindings.have_contents() else None
            self._forms.clear()
        elif before is not None:
            now = self.bindings.contents()
            if not _same(before[0], now[0]):
                self._forms.clear()
            elif _same(before[1], now[1]):
                now = before
        self._seen, self._contents = seen, now
        return now

    def copy(self) -> ProgramParts:
        """The same variables and evaluators, in lists of their own."""
        variables = self.variables.copy()
        return ProgramParts(variables, self.bindings.copy(variables))


def parts_of(program: MathematicalProgram) -> ProgramParts:
    """The parts of a program, for solvers and others that need more than its calls."""
    return program._parts
