"""Time along paths, and constraints on motion and balance of a plant."""

from sheldrake.common._names import show_as_own
from sheldrake.multibody.optimization._contact_wrench import ContactWrench, ContactWrenchFromForceInWorldFrameEvaluator
from sheldrake.multibody.optimization._motion_constraints import (
    CentroidalMomentumConstraint,
    QuaternionEulerIntegrationConstraint,
    SpatialVelocityConstraint,
)
from sheldrake.multibody.optimization._static_equilibrium import StaticEquilibriumProblem
from sheldrake.multibody.optimization._toppra import CalcGridPointsOptions, Toppra, ToppraDiscretization

__all__ = [
    "CalcGridPointsOptions",
    "CentroidalMomentumConstraint",
    "ContactWrench",
    "ContactWrenchFromForceInWorldFrameEvaluator",
    "QuaternionEulerIntegrationConstraint",
    "SpatialVelocityConstraint",
    "StaticEquilibriumProblem",
    "Toppra",
    "ToppraDiscretization",
]

show_as_own(globals())
