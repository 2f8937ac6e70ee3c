"""The parts of a program, put together: each takes what it needs, and knows nothing of those after it.

variables                    decision variables, indeterminates, guess, scales
bindings                     costs and constraints in lists by kind, and their values
costs, constraints, cones    what calls are given, parsed and bound to variables
epigraphs, polynomials       what is said with new variables and the constraints above
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

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
_NOTHING: list[object] = []


def _same(a: list[object], b: list[object]) -> bool:
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
        self._kept: dict[Any, tuple[tuple[list[object], list[object]], Any]] = {}

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
        contents = self.bindings.contents()
        if contents is None:
            return kind(program)
        before, found = self._kept.get(kind, ((_NOTHING, _NOTHING), None))
        if not _same(before[0], contents[0]):
            found = kind(program)
        elif not _same(before[1], contents[1]):
            found = found.moved(program) or kind(program)
        else:
            return found
        self._kept[kind] = contents, found
        return found

    def copy(self) -> ProgramParts:
        """The same variables and evaluators, in lists of their own."""
        variables = self.variables.copy()
        return ProgramParts(variables, self.bindings.copy(variables))


def parts_of(program: MathematicalProgram) -> ProgramParts:
    """The parts of a program, for solvers and others that need more than its calls."""
    return program._parts
