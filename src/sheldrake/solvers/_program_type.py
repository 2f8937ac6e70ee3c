"""Which family a program belongs to."""

from __future__ import annotations

import functools

from sheldrake.solvers._ids import ProgramAttribute as A
from sheldrake.solvers._ids import ProgramType
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.program import MathematicalProgram

LINEAR = frozenset({A.kLinearCost, A.kLinearConstraint, A.kLinearEqualityConstraint})
CONES = frozenset({A.kLorentzConeConstraint, A.kRotatedLorentzConeConstraint})
CONIC = LINEAR | CONES | {A.kPositiveSemidefiniteConstraint, A.kExponentialConeConstraint}
NONLINEAR = (
    LINEAR
    | CONES
    | {
        A.kGenericCost,
        A.kGenericConstraint,
        A.kQuadraticCost,
        A.kQuadraticConstraint,
        A.kLinearComplementarityConstraint,
        A.kL2NormCost,
        A.kCallback,
    }
)


def quadratic_costs_are_convex(prog: MathematicalProgram) -> bool:
    """Whether each quadratic cost is convex."""
    return parts_of(prog).bindings.are_convex()


def GetProgramType(prog: MathematicalProgram) -> ProgramType:
    """Returns which family a program belongs to."""
    return type_of_program(prog, parts_of(prog).bindings.attributes())


def type_of_program(prog: MathematicalProgram, has: frozenset[A]) -> ProgramType:
    """The family of a program that has these attributes."""
    return _family(has, quadratic_costs_are_convex(prog))


@functools.cache
def _family(has: frozenset[A], convex: bool) -> ProgramType:
    mixed = A.kBinaryVariable in has
    has = has - {A.kBinaryVariable}
    if mixed:
        return _mixed_integer(has, convex)
    return _continuous(has, convex)


def _mixed_integer(has: frozenset[A], convex: bool) -> ProgramType:
    if has <= LINEAR:
        return ProgramType.kMILP
    if has <= LINEAR | {A.kQuadraticCost} and convex:
        return ProgramType.kMIQP
    if has <= LINEAR | CONES:
        return ProgramType.kMISOCP
    return ProgramType.kMISDP if has <= LINEAR | CONES | {A.kPositiveSemidefiniteConstraint} else ProgramType.kUnknown


def _continuous(has: frozenset[A], convex: bool) -> ProgramType:
    if not has:
        return ProgramType.kUnknown
    if has <= LINEAR:
        return ProgramType.kLP
    if has <= LINEAR | {A.kQuadraticCost} and convex:
        return ProgramType.kQP
    if has <= LINEAR | CONES:
        return ProgramType.kSOCP
    if has <= LINEAR | CONES | {A.kPositiveSemidefiniteConstraint}:
        return ProgramType.kSDP
    if has <= {A.kLinearCost, A.kExponentialConeConstraint}:
        return ProgramType.kGP
    if has <= CONIC:
        return ProgramType.kCGP
    if has <= CONIC | {A.kQuadraticCost} and convex:
        return ProgramType.kQuadraticCostConicConstraint
    if has == {A.kLinearComplementarityConstraint}:
        return ProgramType.kLCP
    general = {A.kGenericCost, A.kGenericConstraint, A.kQuadraticConstraint, A.kLinearComplementarityConstraint}
    if has & general or (A.kQuadraticCost in has and not convex):
        return ProgramType.kNLP
    return ProgramType.kUnknown
