"""Spatial vectors and inertias. (pydrake offers the inertias in `multibody.tree`; so does sheldrake.)"""

from typing import Any

from sheldrake.common._names import _MangledName, show_as_own
from sheldrake.multibody.math._rotational_inertia import RotationalInertia, RotationalInertia_
from sheldrake.multibody.math._spatial_inertia import SpatialInertia, SpatialInertia_
from sheldrake.multibody.math._spatial_vectors import (
    SpatialAcceleration,
    SpatialAcceleration_,
    SpatialForce,
    SpatialForce_,
    SpatialMomentum,
    SpatialMomentum_,
    SpatialVelocity,
    SpatialVelocity_,
)
from sheldrake.multibody.math._unit_inertia import UnitInertia, UnitInertia_

__all__ = [
    "RotationalInertia",
    "RotationalInertia_",
    "SpatialAcceleration",
    "SpatialAcceleration_",
    "SpatialForce",
    "SpatialForce_",
    "SpatialInertia",
    "SpatialInertia_",
    "SpatialMomentum",
    "SpatialMomentum_",
    "SpatialVelocity",
    "SpatialVelocity_",
    "UnitInertia",
    "UnitInertia_",
]

show_as_own(globals())


def __getattr__(name: str) -> Any:
    return _MangledName.module_getattr(module_name=__name__, module_globals=globals(), name=name)
