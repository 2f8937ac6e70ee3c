"""Trajectories by optimization, and diagrams of one robot."""

from sheldrake.planning._body_shapes import BodyShapeDescription, MakeBodyShapeDescription
from sheldrake.planning._clearance import EdgeMeasure, RobotClearance, RobotCollisionType
from sheldrake.planning._collision_checker import CollisionChecker, CollisionCheckerContext, CollisionCheckerParams
from sheldrake.planning._configurations import DistanceAndInterpolationProvider, LinearDistanceAndInterpolationProvider
from sheldrake.planning._direct_collocation import (
    AddDirectCollocationConstraint,
    DirectCollocation,
    DirectCollocationConstraint,
)
from sheldrake.planning._direct_transcription import DirectTranscription
from sheldrake.planning._dof_mask import DofMask
from sheldrake.planning._gcs_trajectory_optimization import GcsTrajectoryOptimization
from sheldrake.planning._joint_limits import JointLimits
from sheldrake.planning._kinematic_trajectory import KinematicTrajectoryOptimization
from sheldrake.planning._multiple_shooting import MultipleShooting
from sheldrake.planning._robot_diagram import GetContinuousRevoluteJointIndices, RobotDiagram, RobotDiagramBuilder
from sheldrake.planning._scene_graph_checker import SceneGraphCollisionChecker, UnimplementedCollisionChecker
from sheldrake.systems.framework._templates import SystemTemplate

__all__ = [
    "AddDirectCollocationConstraint",
    "BodyShapeDescription",
    "CollisionChecker",
    "CollisionCheckerContext",
    "CollisionCheckerParams",
    "DirectCollocation",
    "DirectCollocationConstraint",
    "DirectTranscription",
    "DistanceAndInterpolationProvider",
    "DofMask",
    "EdgeMeasure",
    "GcsTrajectoryOptimization",
    "GetContinuousRevoluteJointIndices",
    "JointLimits",
    "KinematicTrajectoryOptimization",
    "LinearDistanceAndInterpolationProvider",
    "MakeBodyShapeDescription",
    "MultipleShooting",
    "RobotClearance",
    "RobotCollisionType",
    "RobotDiagram",
    "RobotDiagramBuilder",
    "RobotDiagram_",
    "SceneGraphCollisionChecker",
    "UnimplementedCollisionChecker",
]

RobotDiagram_ = SystemTemplate("RobotDiagram_", RobotDiagram, scope=__name__, own=True)

for _name in __all__:
    if not _name.endswith("_"):
        globals()[_name].__module__ = __name__
