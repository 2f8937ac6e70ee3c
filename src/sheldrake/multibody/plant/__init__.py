"""MultibodyPlant: bodies, joints, geometry and contact as a system."""

from sheldrake.multibody.math._coulomb_friction import CoulombFriction

from ._config import AddMultibodyPlant, AddMultibodyPlantSceneGraph, ApplyMultibodyPlantConfig, MultibodyPlantConfig
from ._constraints import DistanceConstraintParams
from ._contact_results import ContactResults, ExternallyAppliedSpatialForce, PointPairContactInfo
from ._enums import ContactModel, DiscreteContactApproximation, DiscreteContactSolver
from ._multibody_plant import MultibodyPlant

__all__ = [
    "AddMultibodyPlant",
    "AddMultibodyPlantSceneGraph",
    "ApplyMultibodyPlantConfig",
    "ContactModel",
    "ContactResults",
    "CoulombFriction",
    "DiscreteContactApproximation",
    "DiscreteContactSolver",
    "DistanceConstraintParams",
    "ExternallyAppliedSpatialForce",
    "MultibodyPlant",
    "MultibodyPlantConfig",
    "PointPairContactInfo",
]
