"""Poses of bodies as rational functions of half angles: what convex optimization asks of kinematics."""

from sheldrake.common._names import show_as_own
from sheldrake.multibody.rational._rational_forward_kinematics import (
    RationalForwardKinematics,
    RationalForwardKinematicsPose,
    RationalForwardKinematicsPose_,
)

__all__ = ["RationalForwardKinematics", "RationalForwardKinematicsPose", "RationalForwardKinematicsPose_"]

show_as_own(globals())
