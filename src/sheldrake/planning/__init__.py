"""Trajectories by optimization, and diagrams of one robot."""

from sheldrake.common._names import show_as_own
from sheldrake.planning._body_shapes import BodyShapeDescription, MakeBodyShapeDescription
from sheldrake.planning._clearance import EdgeMeasure, RobotClearance, RobotCollisionType
from sheldrake.planning._clique_cover import IrisFromCliqueCoverOptions, IrisInConfigurationSpaceFromCliqueCover
from sheldrake.planning._cliques import (
    MaxCliqueSolverBase,
    MaxCliqueSolverViaGreedy,
    MaxCliqueSolverViaMip,
    MinCliqueCoverSolverBase,
    MinCliqueCoverSolverViaGreedy,
    VisibilityGraph,
)
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
from sheldrake.planning._iris_np2 import IrisNp2, IrisNp2Options, RaySamplerOptions
from sheldrake.planning._joint_limits import JointLimits
from sheldrake.planning._kinematic_trajectory import KinematicTrajectoryOptimization
from sheldrake.planning._multiple_shooting import MultipleShooting
from sheldrake.planning._robot_diagram import GetContinuousRevoluteJointIndices, RobotDiagram, RobotDiagramBuilder
from sheldrake.planning._sampled_iris import (
    CommonSampledIrisOptions,
    IrisParameterizationFunction,
    IrisZo,
    IrisZoOptions,
)
from sheldrake.planning._scene_graph_checker import SceneGraphCollisionChecker, UnimplementedCollisionChecker
from sheldrake.planning._zmp_planner import ZmpPlanner
from sheldrake.systems.framework._templates import SystemTemplate

__all__ = [
    "AddDirectCollocationConstraint",
    "BodyShapeDescription",
    "CollisionChecker",
    "CollisionCheckerContext",
    "CollisionCheckerParams",
    "CommonSampledIrisOptions",
    "DirectCollocation",
    "DirectCollocationConstraint",
    "DirectTranscription",
    "DistanceAndInterpolationProvider",
    "DofMask",
    "EdgeMeasure",
    "GcsTrajectoryOptimization",
    "GetContinuousRevoluteJointIndices",
    "IrisFromCliqueCoverOptions",
    "IrisInConfigurationSpaceFromCliqueCover",
    "IrisNp2",
    "IrisNp2Options",
    "IrisParameterizationFunction",
    "IrisZo",
    "IrisZoOptions",
    "JointLimits",
    "KinematicTrajectoryOptimization",
    "LinearDistanceAndInterpolationProvider",
    "MakeBodyShapeDescription",
    "MaxCliqueSolverBase",
    "MaxCliqueSolverViaGreedy",
    "MaxCliqueSolverViaMip",
    "MinCliqueCoverSolverBase",
    "MinCliqueCoverSolverViaGreedy",
    "MultipleShooting",
    "RaySamplerOptions",
    "RobotClearance",
    "RobotCollisionType",
    "RobotDiagram",
    "RobotDiagramBuilder",
    "RobotDiagramBuilder_",
    "RobotDiagram_",
    "SceneGraphCollisionChecker",
    "UnimplementedCollisionChecker",
    "VisibilityGraph",
    "ZmpPlanner",
]

RobotDiagram_ = SystemTemplate("RobotDiagram_", RobotDiagram, scope=__name__, own=True)
RobotDiagramBuilder_ = SystemTemplate("RobotDiagramBuilder_", RobotDiagramBuilder, scope=__name__, own=True)

show_as_own(globals())
