"""The parts of a program, put together: each takes what it needs, and knows nothing of those after it.

variables                    decision variables, indeterminates, guess, scales
bindings                     costs and constraints in lists by kind, and their values
costs, constraints, cones    what calls are given, parsed and bound to variables
epigraphs, polynomials       what is said with new variables and the constraints above
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sheldrake.solvers._program.bindings import ProgramBindings
from sheldrake.solvers._program.cones import ProgramCones
from sheldrake.solvers._program.constraints import ProgramConstraints
from sheldrake.solvers._program.costs import ProgramCosts
from sheldrake.solvers._program.epigraphs import ProgramEpigraphs
from sheldrake.solvers._program.polynomials import ProgramPolynomials
from sheldrake.solvers._program.variables import ProgramVariables

if TYPE_CHECKING:
    from sheldrake.solvers._program.program import MathematicalProgram


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
        self.cones = ProgramCones(variables, bindings)
        self.epigraphs = ProgramEpigraphs(variables, self.costs, self.constraints, self.cones)
        self.polynomials = ProgramPolynomials(variables, bindings, self.cones)

    def copy(self) -> ProgramParts:
        """The same variables and evaluators, in lists of their own."""
        variables = self.variables.copy()
        return ProgramParts(variables, self.bindings.copy(variables))


def parts_of(program: MathematicalProgram) -> ProgramParts:
    """The parts of a program, for solvers and others that need more than its calls."""
    return program._parts
