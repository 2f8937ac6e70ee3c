"""MultibodyPlant: bodies and joints as a system with ports.

What people call, and what the framework asks. What there is to it is in its parts (`_parts`), whose calls it shows; a
call of a part is declared and documented there.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from sheldrake.common._checked import checked
from sheldrake.common._parts import Calls, forget_calls
from sheldrake.geometry import SceneGraph, SceneGraphInspector, SourceId
from sheldrake.multibody.plant._building.constraints import Constraints
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._building.geometry import PlantGeometry
from sheldrake.multibody.plant._building.loops import Loops
from sheldrake.multibody.plant._building.settings import Settings, checked_time_step
from sheldrake.multibody.plant._building.surface_axes import SurfaceAxes
from sheldrake.multibody.plant._building.topology import Topology
from sheldrake.multibody.plant._context.contexts import Contexts
from sheldrake.multibody.plant._context.coordinates import Coordinates
from sheldrake.multibody.plant._context.dynamics import Dynamics
from sheldrake.multibody.plant._context.free_bodies import FreeBodies
from sheldrake.multibody.plant._context.kinematics import Kinematics
from sheldrake.multibody.plant._output_ports import DEFORMABLE_BODY_CONFIGURATION, GEOMETRY_POSE
from sheldrake.multibody.plant._parts import PlantParts
from sheldrake.multibody.plant._step.accelerations import Accelerations
from sheldrake.multibody.plant._step.applied_forces import SpatialForcePort
from sheldrake.multibody.plant._step.contact_in_words import ContactExplanation
from sheldrake.multibody.plant._step.discrete import INTEGERS_KEPT
from sheldrake.multibody.plant._step.input_ports import GEOMETRY_QUERY
from sheldrake.multibody.tree import ModelInstanceIndex, RigidBody
from sheldrake.systems.framework import Context, InputPort, LeafSystem, OutputPort

if TYPE_CHECKING:
    import numpy as np

    from sheldrake.common import RandomGenerator
    from sheldrake.systems.framework._engine.memory import RootView

_settings = Calls(Settings, "_parts.settings")
_elements = Calls(Elements, "_parts.elements")
_constraints = Calls(Constraints, "_parts.constraints")
_loops = Calls(Loops, "_parts.loops")
_geometry = Calls(PlantGeometry, "_parts.geometry")
_surface_axes = Calls(SurfaceAxes, "_parts.surface_axes")
_topology = Calls(Topology, "_parts.topology")
_coordinates = Calls(Coordinates, "_parts.coordinates")
_contexts = Calls(Contexts, "_parts.contexts")
_free_bodies = Calls(FreeBodies, "_parts.free_bodies")
_kinematics = Calls(Kinematics, "_parts.kinematics")
_dynamics = Calls(Dynamics, "_parts.dynamics")
_accelerations = Calls(Accelerations, "_parts.accelerations")


class MultibodyPlant(LeafSystem):
    """Rigid bodies connected by joints, with contact, as a system.

    Bodies, joints and geometry are added first; `Finalize()` ends that, and makes state, parameters and ports.

    Args:
        time_step: Period of the discrete update [s], 0 for a plant with continuous state.
    """

    _complex_rows = True
    _generic = True
    _integers_kept = INTEGERS_KEPT
    _picture: ClassVar[Callable[[Any], str] | None] = None

    def __init__(self, time_step: float):
        time_step = checked_time_step(time_step)
        super().__init__()
        self._parts = PlantParts(self, time_step)
        self._parts.output_ports.declare_of_geometry(self)

    def time_step(self) -> float:
        """Period of the discrete update [s], 0 for a plant with continuous state."""
        return self._parts.settings.time_step

    def is_discrete(self) -> bool:
        """Whether the state is discrete."""
        return self._parts.settings.is_discrete()

    def Finalize(self) -> None:
        """Ends the building of the model: connects free bodies to the world, declares state, parameters and ports.

        Raises:
            RuntimeError: called twice, or the joints do not make a forest; the plant is then as it was.
        """
        self._parts.finalize()

    def _converted(self, scalar: type) -> Any:
        new = super()._converted(scalar)
        if new is not None:
            new._parts = self._parts.copy_for(new)
            forget_calls(new)
        return new

    # --- what concerns several parts

    @checked
    def AddRigidBody(self, name: str, *args: Any, **kwargs: Any) -> RigidBody:
        """Adds a body.

        Args:
            name: Unique in its model instance.
            args: `[model_instance], [M_BBo_B]`: where it belongs (the default instance when left out) and its spatial
                inertia about its origin (zero when left out).
            kwargs: The same by name.

        Raises:
            RuntimeError: the name is taken, the inertia not valid, the model instance unknown or left out though there
                are others than the default one, or the plant is finalized.
        """
        body = self._parts.elements.add_body(name, args, kwargs)
        self._parts.geometry.register_frame(body)
        return body

    def RegisterAsSourceForSceneGraph(self, scene_graph: SceneGraph) -> SourceId:
        """Makes the plant a source of a SceneGraph; its bodies become frames there.

        Raises:
            RuntimeError: it is one already, or the plant is finalized.
        """
        return self._parts.geometry.register_as_source(scene_graph, self.get_name())

    def EvalSceneGraphInspector(self, context: Context) -> SceneGraphInspector:
        """The inspector of the SceneGraph that the geometry_query port is connected to."""
        return self.get_geometry_query_input_port().Eval(context).inspector()

    def GetTopologyGraphvizString(self) -> str:
        """The bodies, grouped by model instance, and their joints, as a Graphviz string."""
        return self._parts.topology.graphviz(self.get_name())

    def explain_contact(self, context: Context) -> ContactExplanation:
        """Who touches whom in a context of the plant, as data and, printed, in words.

        Args:
            context: The plant's, in a diagram with its SceneGraph.

        Returns:
            A list of ContactSummary, by pair of geometries; its text has a line for each.
        """
        return self._parts.contact_in_words.explain(context, self.get_contact_results_output_port().Eval(context))

    def _repr_svg_(self) -> str | None:
        """A picture for notebooks, once the plant is finalized and sheldrake.visualization imported."""
        draw = MultibodyPlant._picture
        return draw(self) if draw is not None and self._parts.elements.is_finalized() else None

    # --- ports

    def get_geometry_query_input_port(self) -> InputPort:
        """Input: the QueryObject of a SceneGraph."""
        return self.get_input_port(GEOMETRY_QUERY)

    def get_geometry_pose_output_port(self) -> OutputPort:
        """Output: poses of the bodies, for a SceneGraph."""
        return self.get_output_port(GEOMETRY_POSE)

    def get_deformable_body_configuration_output_port(self) -> OutputPort:
        """Output: nothing, there are no deformable bodies."""
        return self.get_output_port(DEFORMABLE_BODY_CONFIGURATION)

    def get_actuation_input_port(self, model_instance: ModelInstanceIndex | None = None) -> InputPort:
        """Input: efforts of all actuators, or of those of one model instance [N m or N]."""
        return self.get_input_port(self._parts.inputs.actuation_port(self._parts.elements, model_instance))

    @checked
    def get_desired_state_input_port(self, model_instance: ModelInstanceIndex) -> InputPort:
        """Input: desired positions, then velocities, of a model instance's actuators, for their controllers."""
        return self.get_input_port(self._parts.inputs.desired_state_port(self._parts.elements, model_instance))

    def get_applied_generalized_force_input_port(self) -> InputPort:
        """Input: generalized forces [N or N m], shape (nv,)."""
        self._parts.elements.require_finalized("get_applied_generalized_force_input_port")
        return self.get_input_port(self._parts.inputs.generalized_force)

    def get_applied_spatial_force_input_port(self) -> InputPort:
        """Input: a list of ExternallyAppliedSpatialForce."""
        self._parts.elements.require_finalized("get_applied_spatial_force_input_port")
        return self.get_input_port(self._parts.inputs.spatial_force)

    def get_surface_speeds_input_port(self) -> InputPort:
        """Input: a BusValue with speeds of surfaces that run, by the scoped names of bodies; 0 where none [m/s]."""
        self._parts.elements.require_finalized("get_surface_speeds_input_port")
        return self.get_input_port(self._parts.inputs.surface_speeds)

    def get_state_output_port(self, model_instance: ModelInstanceIndex | None = None) -> OutputPort:
        """Output: positions, then velocities, of all or of one model instance."""
        return self.get_output_port(self._parts.output_ports.number("state", model_instance))

    def get_body_poses_output_port(self) -> OutputPort:
        """Output: a list of X_WB, by body."""
        return self.get_output_port(self._parts.output_ports.number("body_poses"))

    def get_body_spatial_velocities_output_port(self) -> OutputPort:
        """Output: a list of V_WB, by body."""
        return self.get_output_port(self._parts.output_ports.number("body_spatial_velocities"))

    def get_body_spatial_accelerations_output_port(self) -> OutputPort:
        """Output: a list of A_WB, by body."""
        return self.get_output_port(self._parts.output_ports.number("body_spatial_accelerations"))

    def get_generalized_acceleration_output_port(self, model_instance: ModelInstanceIndex | None = None) -> OutputPort:
        """Output: vdot of all or of one model instance."""
        return self.get_output_port(self._parts.output_ports.number("generalized_acceleration", model_instance))

    @checked
    def get_generalized_contact_forces_output_port(self, model_instance: ModelInstanceIndex) -> OutputPort:
        """Output: generalized contact forces of one model instance [N or N m]."""
        return self.get_output_port(self._parts.output_ports.number("generalized_contact_forces", model_instance))

    def get_net_actuation_output_port(self, model_instance: ModelInstanceIndex | None = None) -> OutputPort:
        """Output: efforts that actuators exert, limits and controllers considered, of all or of one model instance."""
        return self.get_output_port(self._parts.output_ports.number("net_actuation", model_instance))

    def get_reaction_forces_output_port(self) -> OutputPort:
        """Output: a list of F_CJc_Jc, the spatial force on each joint's child at its frame M, expressed in M."""
        return self.get_output_port(self._parts.output_ports.number("reaction_forces"))

    def get_contact_results_output_port(self) -> OutputPort:
        """Output: ContactResults."""
        return self.get_output_port(self._parts.output_ports.number("contact_results"))

    def get_surface_displacements_output_port(self) -> OutputPort:
        """Output: a BusValue with how far surfaces that run have come, by the scoped names of the bodies [m]."""
        return self.get_output_port(self._parts.output_ports.number("surface_displacements"))

    # --- How it advances, and how contact is modelled

    SetUseSampledOutputPorts = _settings(Settings.SetUseSampledOutputPorts)
    has_sampled_output_ports = _settings(Settings.has_sampled_output_ports)
    set_contact_model = _settings(Settings.set_contact_model)
    get_contact_model = _settings(Settings.get_contact_model)
    set_discrete_contact_approximation = _settings(Settings.set_discrete_contact_approximation)
    get_discrete_contact_approximation = _settings(Settings.get_discrete_contact_approximation)
    get_discrete_contact_solver = _settings(Settings.get_discrete_contact_solver)
    set_contact_surface_representation = _settings(Settings.set_contact_surface_representation)
    get_contact_surface_representation = _settings(Settings.get_contact_surface_representation)
    set_penetration_allowance = _settings(Settings.set_penetration_allowance)
    get_contact_penalty_method_time_scale = _settings(Settings.get_contact_penalty_method_time_scale)
    set_stiction_tolerance = _settings(Settings.set_stiction_tolerance)
    set_sap_near_rigid_threshold = _settings(Settings.set_sap_near_rigid_threshold)
    get_sap_near_rigid_threshold = _settings(Settings.get_sap_near_rigid_threshold)
    GetDefaultContactSurfaceRepresentation = staticmethod(Settings.GetDefaultContactSurfaceRepresentation)

    # --- Model instances, bodies, frames, joints, actuators, force elements

    is_finalized = _elements(Elements.is_finalized)
    AddModelInstance = _elements(Elements.AddModelInstance)
    RenameModelInstance = _elements(Elements.RenameModelInstance)
    num_model_instances = _elements(Elements.num_model_instances)
    HasModelInstanceNamed = _elements(Elements.HasModelInstanceNamed)
    GetModelInstanceByName = _elements(Elements.GetModelInstanceByName)
    GetModelInstanceName = _elements(Elements.GetModelInstanceName)
    num_bodies = _elements(Elements.num_bodies)
    world_body = _elements(Elements.world_body)
    get_body = _elements(Elements.get_body)
    has_body = _elements(Elements.has_body)
    HasBodyNamed = _elements(Elements.HasBodyNamed)
    NumBodiesWithName = _elements(Elements.NumBodiesWithName)
    GetBodyByName = _elements(Elements.GetBodyByName)
    GetRigidBodyByName = _elements(Elements.GetRigidBodyByName)
    GetBodyIndices = _elements(Elements.GetBodyIndices)
    AddFrame = _elements(Elements.AddFrame)
    num_frames = _elements(Elements.num_frames)
    world_frame = _elements(Elements.world_frame)
    get_frame = _elements(Elements.get_frame)
    HasFrameNamed = _elements(Elements.HasFrameNamed)
    GetFrameByName = _elements(Elements.GetFrameByName)
    GetFrameIndices = _elements(Elements.GetFrameIndices)
    AddJoint = _elements(Elements.AddJoint)
    WeldFrames = _elements(Elements.WeldFrames)
    RemoveJoint = _elements(Elements.RemoveJoint)
    num_joints = _elements(Elements.num_joints)
    has_joint = _elements(Elements.has_joint)
    get_joint = _elements(Elements.get_joint)
    get_mutable_joint = _elements(Elements.get_mutable_joint)
    HasJointNamed = _elements(Elements.HasJointNamed)
    GetJointByName = _elements(Elements.GetJointByName)
    GetMutableJointByName = _elements(Elements.GetMutableJointByName)
    GetJointIndices = _elements(Elements.GetJointIndices)
    AddJointActuator = _elements(Elements.AddJointActuator)
    RemoveJointActuator = _elements(Elements.RemoveJointActuator)
    RemoveAllJointActuatorEffortLimits = _elements(Elements.RemoveAllJointActuatorEffortLimits)
    has_joint_actuator = _elements(Elements.has_joint_actuator)
    get_joint_actuator = _elements(Elements.get_joint_actuator)
    get_mutable_joint_actuator = _elements(Elements.get_mutable_joint_actuator)
    HasJointActuatorNamed = _elements(Elements.HasJointActuatorNamed)
    GetJointActuatorByName = _elements(Elements.GetJointActuatorByName)
    GetJointActuatorIndices = _elements(Elements.GetJointActuatorIndices)
    GetActuatedJointIndices = _elements(Elements.GetActuatedJointIndices)
    AddForceElement = _elements(Elements.AddForceElement)
    num_force_elements = _elements(Elements.num_force_elements)
    get_force_element = _elements(Elements.get_force_element)
    gravity_field = _elements(Elements.gravity_field)
    mutable_gravity_field = _elements(Elements.mutable_gravity_field)
    set_gravity_enabled = _elements(Elements.set_gravity_enabled)
    is_gravity_enabled = _elements(Elements.is_gravity_enabled)

    # --- Constraints

    AddCouplerConstraint = _constraints(Constraints.AddCouplerConstraint)
    AddTendonConstraint = _constraints(Constraints.AddTendonConstraint)
    AddDistanceConstraint = _constraints(Constraints.AddDistanceConstraint)
    AddBallConstraint = _constraints(Constraints.AddBallConstraint)
    AddWeldConstraint = _constraints(Constraints.AddWeldConstraint)
    RemoveConstraint = _constraints(Constraints.RemoveConstraint)
    num_constraints = _constraints(Constraints.num_constraints)
    GetConstraintIds = _constraints(Constraints.GetConstraintIds)
    GetConstraintActiveStatus = _constraints(Constraints.GetConstraintActiveStatus)
    SetConstraintActiveStatus = _constraints(Constraints.SetConstraintActiveStatus)
    GetDefaultDistanceConstraintParams = _constraints(Constraints.GetDefaultDistanceConstraintParams)
    GetDistanceConstraintParams = _constraints(Constraints.GetDistanceConstraintParams)
    SetDistanceConstraintParams = _constraints(Constraints.SetDistanceConstraintParams)

    SetEnableLoopTopology = _loops(Loops.SetEnableLoopTopology)
    GetEnableLoopTopology = _loops(Loops.GetEnableLoopTopology)
    num_loop_constraints = _loops(Loops.num_loop_constraints)

    # --- Geometry

    geometry_source_is_registered = _geometry(PlantGeometry.geometry_source_is_registered)
    get_source_id = _geometry(PlantGeometry.get_source_id)
    RegisterCollisionGeometry = _geometry(PlantGeometry.RegisterCollisionGeometry)
    RegisterVisualGeometry = _geometry(PlantGeometry.RegisterVisualGeometry)
    num_collision_geometries = _geometry(PlantGeometry.num_collision_geometries)
    GetCollisionGeometriesForBody = _geometry(PlantGeometry.GetCollisionGeometriesForBody)
    GetVisualGeometriesForBody = _geometry(PlantGeometry.GetVisualGeometriesForBody)
    CollectRegisteredGeometries = _geometry(PlantGeometry.CollectRegisteredGeometries)
    GetBodyFromFrameId = _geometry(PlantGeometry.GetBodyFromFrameId)
    GetBodyFrameIdIfExists = _geometry(PlantGeometry.GetBodyFrameIdIfExists)
    GetBodyFrameIdOrThrow = _geometry(PlantGeometry.GetBodyFrameIdOrThrow)
    set_adjacent_bodies_collision_filters = _geometry(PlantGeometry.set_adjacent_bodies_collision_filters)
    get_adjacent_bodies_collision_filters = _geometry(PlantGeometry.get_adjacent_bodies_collision_filters)

    SetSurfaceVelocityAxis = _surface_axes(SurfaceAxes.SetSurfaceVelocityAxis)
    GetSurfaceVelocityAxis = _surface_axes(SurfaceAxes.GetSurfaceVelocityAxis)

    # --- Its graph

    GetBodiesWeldedTo = _topology(Topology.GetBodiesWeldedTo)
    IsAnchored = _topology(Topology.IsAnchored)
    GetBodiesKinematicallyAffectedBy = _topology(Topology.GetBodiesKinematicallyAffectedBy)

    # --- Positions, velocities and inputs

    num_positions = _coordinates(Coordinates.num_positions)
    num_velocities = _coordinates(Coordinates.num_velocities)
    num_multibody_states = _coordinates(Coordinates.num_multibody_states)
    num_misc_continuous_states = _coordinates(Coordinates.num_misc_continuous_states)
    num_actuators = _coordinates(Coordinates.num_actuators)
    num_actuated_dofs = _coordinates(Coordinates.num_actuated_dofs)
    GetPositionNames = _coordinates(Coordinates.GetPositionNames)
    GetVelocityNames = _coordinates(Coordinates.GetVelocityNames)
    GetStateNames = _coordinates(Coordinates.GetStateNames)
    GetActuatorNames = _coordinates(Coordinates.GetActuatorNames)
    GetPositionLowerLimits = _coordinates(Coordinates.GetPositionLowerLimits)
    GetPositionUpperLimits = _coordinates(Coordinates.GetPositionUpperLimits)
    GetVelocityLowerLimits = _coordinates(Coordinates.GetVelocityLowerLimits)
    GetVelocityUpperLimits = _coordinates(Coordinates.GetVelocityUpperLimits)
    GetAccelerationLowerLimits = _coordinates(Coordinates.GetAccelerationLowerLimits)
    GetAccelerationUpperLimits = _coordinates(Coordinates.GetAccelerationUpperLimits)
    GetEffortLowerLimits = _coordinates(Coordinates.GetEffortLowerLimits)
    GetEffortUpperLimits = _coordinates(Coordinates.GetEffortUpperLimits)
    GetPositions = _coordinates(Coordinates.GetPositions)
    GetVelocities = _coordinates(Coordinates.GetVelocities)
    GetPositionsAndVelocities = _coordinates(Coordinates.GetPositionsAndVelocities)
    SetPositions = _coordinates(Coordinates.SetPositions)
    SetVelocities = _coordinates(Coordinates.SetVelocities)
    SetPositionsAndVelocities = _coordinates(Coordinates.SetPositionsAndVelocities)
    GetPositionsFromArray = _coordinates(Coordinates.GetPositionsFromArray)
    GetVelocitiesFromArray = _coordinates(Coordinates.GetVelocitiesFromArray)
    SetPositionsInArray = _coordinates(Coordinates.SetPositionsInArray)
    SetVelocitiesInArray = _coordinates(Coordinates.SetVelocitiesInArray)
    GetActuationFromArray = _coordinates(Coordinates.GetActuationFromArray)
    SetActuationInArray = _coordinates(Coordinates.SetActuationInArray)
    GetDefaultPositions = _coordinates(Coordinates.GetDefaultPositions)
    SetDefaultPositions = _coordinates(Coordinates.SetDefaultPositions)
    MakeStateSelectorMatrix = _coordinates(Coordinates.MakeStateSelectorMatrix)
    MakeActuatorSelectorMatrix = _coordinates(Coordinates.MakeActuatorSelectorMatrix)
    MakeActuationMatrix = _coordinates(Coordinates.MakeActuationMatrix)
    MakeActuationMatrixPseudoinverse = _coordinates(Coordinates.MakeActuationMatrixPseudoinverse)

    SetDefaultState = _contexts(Contexts.SetDefaultState)
    parameter_columns = _contexts(Contexts.parameter_columns)

    # --- Bodies that float

    SetBaseBodyJointType = _free_bodies(FreeBodies.SetBaseBodyJointType)
    GetBaseBodyJointType = _free_bodies(FreeBodies.GetBaseBodyJointType)
    GetFloatingBaseBodies = _free_bodies(FreeBodies.GetFloatingBaseBodies)
    HasUniqueFloatingBaseBody = _free_bodies(FreeBodies.HasUniqueFloatingBaseBody)
    GetUniqueFloatingBaseBodyOrThrow = _free_bodies(FreeBodies.GetUniqueFloatingBaseBodyOrThrow)
    GetFreeBodyPose = _free_bodies(FreeBodies.GetFreeBodyPose)
    SetFreeBodyPose = _free_bodies(FreeBodies.SetFreeBodyPose)
    SetFreeBodySpatialVelocity = _free_bodies(FreeBodies.SetFreeBodySpatialVelocity)
    SetFloatingBaseBodyPoseInWorldFrame = _free_bodies(FreeBodies.SetFloatingBaseBodyPoseInWorldFrame)
    SetFloatingBaseBodyPoseInAnchoredFrame = _free_bodies(FreeBodies.SetFloatingBaseBodyPoseInAnchoredFrame)
    SetDefaultFloatingBaseBodyPose = _free_bodies(FreeBodies.SetDefaultFloatingBaseBodyPose)
    SetDefaultFreeBodyPose = _free_bodies(FreeBodies.SetDefaultFreeBodyPose)
    GetDefaultFreeBodyPose = _free_bodies(FreeBodies.GetDefaultFreeBodyPose)
    GetDefaultFloatingBaseBodyPose = _free_bodies(FreeBodies.GetDefaultFloatingBaseBodyPose)
    HasUniqueFreeBaseBody = _free_bodies(FreeBodies.HasUniqueFloatingBaseBody)
    GetUniqueFreeBaseBodyOrThrow = _free_bodies(FreeBodies.GetUniqueFloatingBaseBodyOrThrow)

    # --- Where things are and how they move

    EvalBodyPoseInWorld = _kinematics(Kinematics.EvalBodyPoseInWorld)
    EvalBodySpatialVelocityInWorld = _kinematics(Kinematics.EvalBodySpatialVelocityInWorld)
    CalcSpatialAccelerationsFromVdot = _kinematics(Kinematics.CalcSpatialAccelerationsFromVdot)
    CalcRelativeTransform = _kinematics(Kinematics.CalcRelativeTransform)
    CalcRelativeRotationMatrix = _kinematics(Kinematics.CalcRelativeRotationMatrix)
    CalcPointsPositions = _kinematics(Kinematics.CalcPointsPositions)
    CalcPointsVelocities = _kinematics(Kinematics.CalcPointsVelocities)
    CalcTotalMass = _kinematics(Kinematics.CalcTotalMass)
    CalcCenterOfMassPositionInWorld = _kinematics(Kinematics.CalcCenterOfMassPositionInWorld)
    CalcCenterOfMassTranslationalVelocityInWorld = _kinematics(Kinematics.CalcCenterOfMassTranslationalVelocityInWorld)
    CalcSpatialMomentumInWorldAboutPoint = _kinematics(Kinematics.CalcSpatialMomentumInWorldAboutPoint)
    CalcSpatialInertia = _kinematics(Kinematics.CalcSpatialInertia)
    CalcPotentialEnergy = _kinematics(Kinematics.CalcPotentialEnergy)
    CalcKineticEnergy = _kinematics(Kinematics.CalcKineticEnergy)
    CalcConservativePower = _kinematics(Kinematics.CalcConservativePower)
    CalcNonConservativePower = _kinematics(Kinematics.CalcNonConservativePower)
    EvalPotentialEnergy = _kinematics(Kinematics.CalcPotentialEnergy)
    EvalKineticEnergy = _kinematics(Kinematics.CalcKineticEnergy)

    # --- The equation of motion, Jacobians

    CalcMassMatrix = _dynamics(Dynamics.CalcMassMatrix)
    CalcMassMatrixViaInverseDynamics = _dynamics(Dynamics.CalcMassMatrixViaInverseDynamics)
    CalcBiasTerm = _dynamics(Dynamics.CalcBiasTerm)
    CalcGravityGeneralizedForces = _dynamics(Dynamics.CalcGravityGeneralizedForces)
    CalcInverseDynamics = _dynamics(Dynamics.CalcInverseDynamics)
    CalcForceElementsContribution = _dynamics(Dynamics.CalcForceElementsContribution)
    CalcGeneralizedForces = _dynamics(Dynamics.CalcGeneralizedForces)
    MapVelocityToQDot = _dynamics(Dynamics.MapVelocityToQDot)
    MapQDotToVelocity = _dynamics(Dynamics.MapQDotToVelocity)
    MakeVelocityToQDotMap = _dynamics(Dynamics.MakeVelocityToQDotMap)
    MakeQDotToVelocityMap = _dynamics(Dynamics.MakeQDotToVelocityMap)
    IsVelocityEqualToQDot = _dynamics(Dynamics.IsVelocityEqualToQDot)
    CalcJacobianSpatialVelocity = _dynamics(Dynamics.CalcJacobianSpatialVelocity)
    CalcJacobianAngularVelocity = _dynamics(Dynamics.CalcJacobianAngularVelocity)
    CalcJacobianTranslationalVelocity = _dynamics(Dynamics.CalcJacobianTranslationalVelocity)
    CalcJacobianPositionVector = _dynamics(Dynamics.CalcJacobianPositionVector)
    CalcJacobianCenterOfMassTranslationalVelocity = _dynamics(Dynamics.CalcJacobianCenterOfMassTranslationalVelocity)
    CalcBiasSpatialAcceleration = _dynamics(Dynamics.CalcBiasSpatialAcceleration)
    CalcBiasTranslationalAcceleration = _dynamics(Dynamics.CalcBiasTranslationalAcceleration)
    CalcBiasCenterOfMassTranslationalAcceleration = _dynamics(Dynamics.CalcBiasCenterOfMassTranslationalAcceleration)
    EvalBodySpatialAccelerationInWorld = _accelerations(Accelerations.EvalBodySpatialAccelerationInWorld)
    CalcCenterOfMassTranslationalAccelerationInWorld = _accelerations(
        Accelerations.CalcCenterOfMassTranslationalAccelerationInWorld
    )

    # --- what the framework asks

    def AllocateContext(self) -> Context:
        """A context whose state is not set yet.

        Raises:
            RuntimeError: before Finalize().
        """
        self._require_ready()
        return super().AllocateContext()

    def _require_ready(self) -> None:
        if not self._parts.elements.is_finalized():
            raise RuntimeError(
                f"{self._describe()} has no context yet: call Finalize() first, then Build() or CreateDefaultContext()."
            )

    def _set_default_context(self, context: Context) -> None:
        """Defaults that may have changed since Finalize()."""
        self._require_ready()
        self._parts.contexts.set_defaults(context)
        self._parts.inputs.forget_desired_states(context)

    def _set_random_context(self, context: Context, generator: RandomGenerator) -> None:
        self._parts.contexts.set_random_positions(context, generator)

    def _kernel_models(self, root: RootView) -> dict[str, Any]:
        return self._parts.kernel_models.in_root(root)

    def _scratch_in(self, root: RootView) -> int | NamedTuple:
        """Memory of the step in a context; grows with the geometry that may touch."""
        if not self._parts.elements.is_finalized():
            return 0
        return self._parts.advance.prototype(self._parts.kernel_models.geometry_in(root))

    def _carry_scratch(self, old: Any, new: Any) -> None:
        self._parts.advance.carry(old, new)

    def _scratch_fault(self, scratch: np.ndarray | NamedTuple) -> str:
        return self._parts.advance.equations.scratch_fault(scratch)

    def _explain_status(self, status: int, context: Context) -> Exception:
        return self._parts.failures.explain(status, context)

    def _input_port(self, i: int) -> InputPort:
        if i == self._parts.inputs.spatial_force and ("in", i) not in self._ports:
            port: InputPort = SpatialForcePort._make(self, i)
            self._ports["in", i] = port
            return port
        return super()._input_port(i)

    def _parameter_names(self) -> dict[int, tuple[str, list[str]]]:
        return self._parts.elements.model("GetParameters").parameter_names()

    def _output_names(self, j: int) -> list[str] | None:
        return self._parts.output_ports.names(j)


def draw_plants_with(draw: Callable[[Any], str]) -> None:
    """Has notebooks show finalized plants as pictures.

    Args:
        draw: Gives a plant's bodies and joints as SVG.
    """
    MultibodyPlant._picture = staticmethod(draw)
