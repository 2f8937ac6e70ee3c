"""Poses of bodies as rational functions of half angles: what convex optimization asks of kinematics."""

from sheldrake.multibody.rational._rational_forward_kinematics import (
    RationalForwardKinematics,
    RationalForwardKinematicsPose,
    RationalForwardKinematicsPose_,
)

__all__ = ["RationalForwardKinematics", "RationalForwardKinematicsPose", "RationalForwardKinematicsPose_"]

RationalForwardKinematics.__module__ = RationalForwardKinematicsPose.__module__ = __name__
