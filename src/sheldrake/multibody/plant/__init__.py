"""MultibodyPlant: bodies, joints, geometry and contact as a system."""

from sheldrake.common._names import show_as_own
from sheldrake.multibody.math._coulomb_friction import CoulombFriction
from sheldrake.systems.framework import LeafSystem_
from sheldrake.systems.framework._templates import SystemTemplate

from ._building.constraints import DistanceConstraintParams
from ._config import AddMultibodyPlant, AddMultibodyPlantSceneGraph, ApplyMultibodyPlantConfig, MultibodyPlantConfig
from ._contact.friction import CalcContactFrictionFromSurfaceProperties
from ._contact.hydroelastic import HydroelasticContactInfo
from ._contact.results import ContactResults, PointPairContactInfo
from ._enums import BaseBodyJointType, ContactModel, DiscreteContactApproximation, DiscreteContactSolver
from ._multibody_plant import MultibodyPlant
from ._step.external_force import ExternallyAppliedSpatialForce
from ._systems.contact_results_to_lcm import ConnectContactResultsToDrakeVisualizer, ContactResultsToLcmSystem
from ._systems.forces import ExternallyAppliedSpatialForceMultiplexer, Propeller, PropellerInfo, Wing

MultibodyPlant_ = SystemTemplate("MultibodyPlant_", MultibodyPlant, scope=__name__, own=True, base=LeafSystem_)


ExternallyAppliedSpatialForceMultiplexer_ = SystemTemplate(
    "ExternallyAppliedSpatialForceMultiplexer_",
    ExternallyAppliedSpatialForceMultiplexer,
    scope=__name__,
    own=True,
    base=LeafSystem_,
)
Propeller_ = SystemTemplate("Propeller_", Propeller, scope=__name__, own=True, base=LeafSystem_)
Wing_ = SystemTemplate("Wing_", Wing, scope=__name__, own=True, base=LeafSystem_)


def _family(cls: type) -> SystemTemplate:
    return SystemTemplate(f"{cls.__name__}_", cls, scope=__name__)


ContactResults_ = _family(ContactResults)
CoulombFriction_ = _family(CoulombFriction)
ExternallyAppliedSpatialForce_ = _family(ExternallyAppliedSpatialForce)
HydroelasticContactInfo_ = _family(HydroelasticContactInfo)
PointPairContactInfo_ = _family(PointPairContactInfo)


__all__ = [
    "AddMultibodyPlant",
    "AddMultibodyPlantSceneGraph",
    "ApplyMultibodyPlantConfig",
    "BaseBodyJointType",
    "CalcContactFrictionFromSurfaceProperties",
    "ConnectContactResultsToDrakeVisualizer",
    "ContactModel",
    "ContactResults",
    "ContactResultsToLcmSystem",
    "ContactResults_",
    "CoulombFriction",
    "CoulombFriction_",
    "DiscreteContactApproximation",
    "DiscreteContactSolver",
    "DistanceConstraintParams",
    "ExternallyAppliedSpatialForce",
    "ExternallyAppliedSpatialForceMultiplexer",
    "ExternallyAppliedSpatialForceMultiplexer_",
    "ExternallyAppliedSpatialForce_",
    "HydroelasticContactInfo",
    "HydroelasticContactInfo_",
    "MultibodyPlant",
    "MultibodyPlantConfig",
    "MultibodyPlant_",
    "PointPairContactInfo",
    "PointPairContactInfo_",
    "Propeller",
    "PropellerInfo",
    "Propeller_",
    "Wing",
    "Wing_",
]

show_as_own(globals())
