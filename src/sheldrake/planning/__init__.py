"""Trajectories by optimization, and diagrams of one robot."""

from sheldrake.planning._direct_collocation import (
    AddDirectCollocationConstraint,
    DirectCollocation,
    DirectCollocationConstraint,
)
from sheldrake.planning._direct_transcription import DirectTranscription
from sheldrake.planning._gcs_trajectory_optimization import GcsTrajectoryOptimization
from sheldrake.planning._kinematic_trajectory import KinematicTrajectoryOptimization
from sheldrake.planning._multiple_shooting import MultipleShooting
from sheldrake.planning._robot_diagram import GetContinuousRevoluteJointIndices, RobotDiagram, RobotDiagramBuilder
from sheldrake.systems.framework._templates import SystemTemplate

__all__ = [
    "AddDirectCollocationConstraint",
    "DirectCollocation",
    "DirectCollocationConstraint",
    "DirectTranscription",
    "GcsTrajectoryOptimization",
    "GetContinuousRevoluteJointIndices",
    "KinematicTrajectoryOptimization",
    "MultipleShooting",
    "RobotDiagram",
    "RobotDiagramBuilder",
    "RobotDiagram_",
]

RobotDiagram_ = SystemTemplate("RobotDiagram_", RobotDiagram, scope=__name__, own=True)

for _name in __all__:
    if not _name.endswith("_"):
        globals()[_name].__module__ = __name__
