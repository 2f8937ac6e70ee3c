"""Calls that do not take None for their first argument: it is a TypeError there, as in pydrake.

Most calls notice a wrong argument by themselves. Those below would take None for a name, an index or an object, and go
wrong later or not at all. They are named in one table, and wrapped when their package is imported; a call that has to
be quick is not among them. `tests/crosscheck/pydrake/test_none_against_pydrake.py` finds what is missing.
"""

from __future__ import annotations

import functools
import inspect
import sys
from typing import Any

_CALLS: dict[str, dict[str, str]] = {
    "autodiffutils": {
        "AutoDiffXd": "pow",
    },
    "examples._pendulum": {
        "PendulumPlant": "get_parameters get_state",
    },
    "geometry._state.collision_filter": {
        "CollisionFilterManager": "IsActive RemoveDeclaration",
    },
    "geometry._state.inspector": {
        "SceneGraphInspector": "NumDeformableGeometriesWithRole NumGeometriesWithRole SourceIsRegistered",
    },
    "geometry._state.instance": {
        "GeometryInstance": (
            "set_illustration_properties set_name set_perception_properties set_pose set_proximity_properties"
        ),
    },
    "geometry._properties": {
        "GeometryProperties": (
            "AddProperty GetPropertiesInGroup GetProperty GetPropertyOrDefault HasGroup HasProperty "
            "RemoveProperty UpdateProperty"
        ),
    },
    "geometry._query.query_object": {
        "QueryObject": "ComputeSignedDistanceToPoint",
    },
    "geometry._query.pictures": {
        "Pictures": "RenderColorImage RenderDepthImage RenderLabelImage",
    },
    "geometry._rgba": {
        "Rgba": "set",
    },
    "geometry._scene_graph": {
        "SceneGraph": "RenameFrame get_source_configuration_port get_source_pose_port set_config",
    },
    "geometry.optimization": {
        "ConvexSet": "CalcVolumeViaSampling IntersectsWith PointInSet Projection",
        "GraphOfConvexSets": (
            "AddEdgeFromTemplate AddVertex AddVertexFromTemplate GetEdgeByName GetMutableEdgeByName "
            "GetMutableVertexByName GetSolutionPath GetVertexByName SamplePaths SolveShortestPath"
        ),
        "HPolyhedron": (
            "CartesianProduct ContainedIn Intersection MaximumVolumeInscribedAffineTransformation PontryaginDifference"
        ),
        "Hyperellipsoid": "MinimumUniformScalingToTouch",
        "VPolytope": "WriteObj",
    },
    "geometry.optimization._gcs_elements": {
        "Edge": "GetSolutionPhiXu GetSolutionPhiXv",
        "Element": "GetSolutionCost",
        "Vertex": "GetSolution",
    },
    "multibody.inverse_kinematics": {
        "InverseKinematics": (
            "AddDistanceConstraint AddMinimumDistanceLowerBoundConstraint AddOrientationConstraint "
            "AddOrientationCost AddPolyhedronConstraint"
        ),
    },
    "multibody.parsing._files.package_map": {
        "PackageMap": "AddMap AddRemote Contains GetPath Remove ResolveUrl",
    },
    "multibody.parsing._parser": {
        "Parser": "AddModelsFromString AddModelsFromUrl",
    },
    "multibody.plant._building.constraints": {
        "Constraints": (
            "AddBallConstraint AddCouplerConstraint AddDistanceConstraint AddWeldConstraint "
            "GetConstraintActiveStatus GetDistanceConstraintParams RemoveConstraint SetConstraintActiveStatus "
            "SetDistanceConstraintParams"
        ),
    },
    "multibody.plant._building.contact_settings": {
        "ContactSettings": (
            "GetDefaultContactSurfaceRepresentation set_contact_model set_contact_surface_representation "
            "set_discrete_contact_approximation"
        ),
    },
    "multibody.plant._building.force_registration": {
        "ForceRegistration": (
            "AddForceElement AddJointActuator HasJointActuatorNamed RemoveJointActuator set_gravity_enabled"
        ),
    },
    "multibody.plant._building.geometry": {
        "PlantGeometry": (
            "CollectRegisteredGeometries GetBodyFromFrameId RegisterCollisionGeometry RegisterVisualGeometry"
        ),
    },
    "multibody.plant._building.registration": {
        "Registration": (
            "AddFrame AddJoint AddModelInstance AddRigidBody GetModelInstanceByName HasBodyNamed HasFrameNamed "
            "HasJointNamed HasModelInstanceNamed NumBodiesWithName RemoveJoint RenameModelInstance"
        ),
    },
    "multibody.plant._building.topology": {
        "Topology": "GetBodiesKinematicallyAffectedBy",
    },
    "multibody.plant._contact.results": {
        "ContactResults": "deformable_contact_info",
    },
    "multibody.plant._context.dynamics": {
        "Dynamics": (
            "CalcBiasSpatialAcceleration CalcBiasTranslationalAcceleration MakeQDotToVelocityMap MakeVelocityToQDotMap"
        ),
    },
    "multibody.plant._context.free_bodies": {
        "FreeBodies": (
            "GetFreeBodyPose GetUniqueFloatingBaseBodyOrThrow HasUniqueFloatingBaseBody "
            "SetFloatingBaseBodyPoseInAnchoredFrame SetFloatingBaseBodyPoseInWorldFrame SetFreeBodyPose "
            "SetFreeBodySpatialVelocity"
        ),
    },
    "multibody.plant._context.kinematics": {
        "Kinematics": "CalcNonConservativePower CalcSpatialAccelerationsFromVdot",
    },
    "multibody.plant._context.state": {
        "State": (
            "GetActuationFromArray GetPositionsFromArray GetVelocitiesFromArray MakeStateSelectorMatrix "
            "SetActuationInArray SetDefaultPositions SetPositionsInArray SetVelocitiesInArray"
        ),
    },
    "multibody.plant._multibody_plant": {
        "MultibodyPlant": "WeldFrames",
    },
    "multibody.plant._ports": {
        "Ports": "get_desired_state_input_port get_generalized_contact_forces_output_port",
    },
    "multibody.tree._force_element": {
        "UniformGravityFieldElement": "set_enabled",
    },
    "multibody.tree._joint": {
        "Joint": (
            "SetDefaultPose set_acceleration_limits set_default_damping_vector set_default_positions "
            "set_position_limits set_velocity_limits"
        ),
    },
    "multibody.tree._joint_actuator": {
        "JointActuator": "set_controller_gains",
    },
    "multibody.tree._joints_axis": {
        "PrismaticJoint": "set_default_translation set_random_translation_distribution",
        "RevoluteJoint": "set_default_angle set_random_angle_distribution",
        "_AxisJoint": "set_default_damping",
    },
    "multibody.tree._multibody_forces": {
        "MultibodyForces": "AddInForces",
    },
    "multibody.tree._rigid_body": {
        "RigidBody": (
            "AddInForce AddInForceInWorld GetForceInWorld SetSpatialInertiaInBodyFrame floating_position_suffix "
            "floating_velocity_suffix"
        ),
    },
    "perception": {
        "PointCloud": "Crop FlipNormalsTowardPoint",
    },
    "planning": {
        "DirectCollocation": "ReconstructInputTrajectory ReconstructStateTrajectory",
        "GcsTrajectoryOptimization": (
            "NormalizeSegmentTimes AddEdges AddNonlinearDerivativeBounds AddVelocityBounds RemoveSubgraph SolvePath "
            "UnwrapToContinuousTrajectory"
        ),
        "MultipleShooting": (
            "GetInputSamples GetSampleTimes GetSequentialVariableAtIndex GetSequentialVariableSamples "
            "GetStateSamples SetInitialTrajectory"
        ),
    },
    "solvers": {
        "Constraint": "CheckSatisfiedVectorized",
        "EvaluatorBase": "set_description",
        "LinearCost": "update_coefficient_entry",
        "MathematicalProgram": "GetBindingVariableValues",
        "MathematicalProgramResult": (
            "EvalBinding GetDualSolution GetInfeasibleConstraintNames GetInfeasibleConstraints SetSolution "
            "set_solution_result set_x_val"
        ),
        "QuadraticCost": "UpdateHessianEntry update_linear_coefficient_entry",
    },
    "solvers._program.cones": {
        "ProgramCones": (
            "RelaxPsdConstraintToDdDualCone RelaxPsdConstraintToSddDualCone TightenPsdConstraintToDd "
            "TightenPsdConstraintToSdd"
        ),
    },
    "solvers._program.constraints": {
        "ProgramConstraints": "RemoveConstraint RemoveCost RemoveVisualizationCallback",
    },
    "solvers._program.variables": {
        "ProgramVariables": (
            "AddIndeterminate FindDecisionVariableIndex FindIndeterminateIndex RemoveDecisionVariable "
            "SetInitialGuessForAllVariables"
        ),
    },
    "symbolic": {
        "Expression": "EvaluatePartial",
        "Monomial": "EqualTo EvaluatePartial degree",
        "Polynomial": "Degree Differentiate SetIndeterminates",
        "RationalFunction": "EqualTo SetIndeterminates",
        "Variables": "EqualTo IsStrictSubsetOf IsStrictSupersetOf IsSubsetOf IsSupersetOf include",
    },
    "systems.framework": {
        "Context": "SetAbstractState SetDiscreteState SetTimeAndContinuousState SetTimeStateAndParametersFrom",
        "Diagram": "AreConnected GetSubsystemByName HasSubsystemNamed",
        "DiagramBuilder": "GetMutableSubsystemByName GetSubsystemByName HasSubsystemNamed",
        "DiscreteValues": "SetFrom",
        "InputPort": "EvalAbstract EvalBasicVector",
        "OutputPort": "EvalAbstract EvalBasicVector",
        "Parameters": "SetFrom set_abstract_parameters set_numeric_parameters",
        "System": "CalcImplicitTimeDerivativesResidual",
        "SystemBase": "input_port_ticket set_name",
    },
    "systems.framework._leaf_events": {
        "LeafEvents": (
            "DeclareForcedDiscreteUpdateEvent DeclareForcedPublishEvent DeclareForcedUnrestrictedUpdateEvent "
            "DeclareInitializationDiscreteUpdateEvent DeclareInitializationPublishEvent "
            "DeclareInitializationUnrestrictedUpdateEvent DeclarePerStepDiscreteUpdateEvent "
            "DeclarePerStepPublishEvent DeclarePerStepUnrestrictedUpdateEvent MakeWitnessFunction"
        ),
    },
    "systems.framework._system_ports": {
        "SystemPorts": (
            "AllocateInputAbstract AllocateInputVector EvalAbstractInput EvalVectorInput FixInputPortsFrom "
            "GetInputPort GetOutputPort HasInputPort HasOutputPort"
        ),
    },
    "systems.primitives": {
        "AffineSystem": "configure_random_state",
        "TrajectorySource": "UpdateTrajectory",
        "VectorLogSink": "FindLog",
    },
    "trajectories": {
        "PiecewisePolynomial": "ConcatenateInTime",
        "PiecewisePose": "IsApprox",
        "PiecewiseTrajectory": "duration",
    },
}
"""By module and class."""


def refuse_none(package: str) -> None:
    """Wraps the calls of a package's classes; to be called at the end of its `__init__`."""
    for name, classes in _CALLS.items():
        module = f"sheldrake.{name}"
        if module.partition("._")[0] != package:
            continue
        for class_name, calls in classes.items():
            cls = getattr(sys.modules[module], class_name)
            for call in calls.split():
                function = inspect.getattr_static(cls, call)
                setattr(cls, call, _refusing(function, f"{class_name}.{call}"))


def _refusing(function: Any, name: str) -> Any:
    if isinstance(function, staticmethod):
        return staticmethod(_refusing_first(function.__func__, name))
    first = function.__code__.co_varnames[1]

    @functools.wraps(function)
    def call(self: Any, *args: Any, **kwargs: Any) -> Any:
        if (args[0] if args else kwargs.get(first, self)) is None:
            raise _refusal(name, first)
        return function(self, *args, **kwargs)

    return call


def _refusing_first(function: Any, name: str) -> Any:
    first = function.__code__.co_varnames[0]

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        if (args[0] if args else kwargs.get(first, name)) is None:
            raise _refusal(name, first)
        return function(*args, **kwargs)

    return call


def _refusal(name: str, first: str) -> TypeError:
    return TypeError(f"{name}(): incompatible function arguments. {first} must not be None.")
