"""Controllers: PID, linear quadratic regulators, inverse dynamics."""

from sheldrake.common._names import show_as_own
from sheldrake.systems.controllers._dynamic_programming import (
    DynamicProgrammingOptions,
    FittedValueIteration,
    PeriodicBoundaryCondition,
)
from sheldrake.systems.controllers._finite_horizon import (
    FiniteHorizonLinearQuadraticRegulator,
    FiniteHorizonLinearQuadraticRegulatorOptions,
    FiniteHorizonLinearQuadraticRegulatorResult,
    MakeFiniteHorizonLinearQuadraticRegulator,
)
from sheldrake.systems.controllers._inverse_dynamics import (
    InverseDynamics,
    InverseDynamicsController,
    JointStiffnessController,
)
from sheldrake.systems.controllers._linear_programming import LinearProgrammingApproximateDynamicProgramming
from sheldrake.systems.controllers._lqr import DiscreteTimeLinearQuadraticRegulator, LinearQuadraticRegulator
from sheldrake.systems.controllers._pid import PidControlledSystem, PidController

__all__ = [
    "DiscreteTimeLinearQuadraticRegulator",
    "DynamicProgrammingOptions",
    "FiniteHorizonLinearQuadraticRegulator",
    "FiniteHorizonLinearQuadraticRegulatorOptions",
    "FiniteHorizonLinearQuadraticRegulatorResult",
    "FittedValueIteration",
    "InverseDynamics",
    "InverseDynamicsController",
    "JointStiffnessController",
    "LinearProgrammingApproximateDynamicProgramming",
    "LinearQuadraticRegulator",
    "MakeFiniteHorizonLinearQuadraticRegulator",
    "PeriodicBoundaryCondition",
    "PidControlledSystem",
    "PidController",
]

show_as_own(globals())
