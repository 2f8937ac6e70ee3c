"""Positions of a plant that satisfy constraints, and velocities that follow an end effector."""

from sheldrake.common._names import show_as_own
from sheldrake.multibody.inverse_kinematics._center_of_mass import ComInPolyhedronConstraint, ComPositionConstraint
from sheldrake.multibody.inverse_kinematics._differential import (
    DifferentialInverseKinematicsParameters,
    DifferentialInverseKinematicsResult,
    DifferentialInverseKinematicsStatus,
    DoDifferentialInverseKinematics,
)
from sheldrake.multibody.inverse_kinematics._differential_systems import (
    DifferentialInverseKinematicsController,
    DifferentialInverseKinematicsIntegrator,
    DifferentialInverseKinematicsSystem,
)
from sheldrake.multibody.inverse_kinematics._distance import (
    DistanceConstraint,
    MinimumDistanceLowerBoundConstraint,
    MinimumDistanceUpperBoundConstraint,
)
from sheldrake.multibody.inverse_kinematics._global_inverse_kinematics import GlobalInverseKinematics
from sheldrake.multibody.inverse_kinematics._inverse_kinematics import InverseKinematics
from sheldrake.multibody.inverse_kinematics._orientation import (
    AngleBetweenVectorsConstraint,
    AngleBetweenVectorsCost,
    OrientationConstraint,
    OrientationCost,
)
from sheldrake.multibody.inverse_kinematics._plant_constraints import (
    AddMultibodyPlantConstraints,
    AddUnitQuaternionConstraintOnPlant,
    UnitQuaternionConstraint,
)
from sheldrake.multibody.inverse_kinematics._position import (
    GazeTargetConstraint,
    PointToLineDistanceConstraint,
    PointToPointDistanceConstraint,
    PolyhedronConstraint,
    PositionConstraint,
    PositionCost,
)

__all__ = [
    "AddMultibodyPlantConstraints",
    "AddUnitQuaternionConstraintOnPlant",
    "AngleBetweenVectorsConstraint",
    "AngleBetweenVectorsCost",
    "ComInPolyhedronConstraint",
    "ComPositionConstraint",
    "DifferentialInverseKinematicsController",
    "DifferentialInverseKinematicsIntegrator",
    "DifferentialInverseKinematicsParameters",
    "DifferentialInverseKinematicsResult",
    "DifferentialInverseKinematicsStatus",
    "DifferentialInverseKinematicsSystem",
    "DistanceConstraint",
    "DoDifferentialInverseKinematics",
    "GazeTargetConstraint",
    "GlobalInverseKinematics",
    "InverseKinematics",
    "MinimumDistanceLowerBoundConstraint",
    "MinimumDistanceUpperBoundConstraint",
    "OrientationConstraint",
    "OrientationCost",
    "PointToLineDistanceConstraint",
    "PointToPointDistanceConstraint",
    "PolyhedronConstraint",
    "PositionConstraint",
    "PositionCost",
    "UnitQuaternionConstraint",
]

show_as_own(globals())
