"""Choices of contact model and solver."""

from sheldrake.common._enums import BoundEnum
from sheldrake.multibody.contact_solvers._kernels.solve import APPROXIMATIONS, Approximation


class ContactModel(BoundEnum):
    """How contact between two geometries is computed."""

    kHydroelastic = 0
    kPoint = 1
    kHydroelasticWithFallback = 2
    kHydroelasticsOnly = 0
    kPointContactOnly = 1


class DiscreteContactApproximation(BoundEnum):
    """How the discrete update models contact and friction."""

    kTamsi = 0
    kSap = 1
    kSimilar = 2
    kLagged = 3

    @property
    def _made_of(self) -> Approximation:
        """What it is made of."""
        return APPROXIMATIONS[self.name[1:].lower()]


class DiscreteContactSolver(BoundEnum):
    """The solver of the discrete update."""

    kTamsi = 0
    kSap = 1


class BaseBodyJointType(BoundEnum):
    """The joint by which Finalize() holds a body to the world that no joint of the user's holds."""

    kQuaternionFloatingJoint = 0
    kRpyFloatingJoint = 1
    kWeldJoint = 2
