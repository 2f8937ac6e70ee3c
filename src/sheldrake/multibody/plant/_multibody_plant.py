"""MultibodyPlant: bodies and joints as a system with ports.

What people call, and what the framework asks. What there is to it is in its parts (`_parts`), whose calls it shows; a
call of a part is declared and documented there.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple
from typing import overload as typing_overload

from sheldrake.common._checked import checked
from sheldrake.common._parts import Call, forget_calls, part
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
    from sheldrake.multibody.math._spatial_inertia import SpatialInertia
    from sheldrake.systems.framework._engine.memory import RootView

_settings = part(Settings, "_parts.settings")
_elements = part(Elements, "_parts.elements")
_constraints = part(Constraints, "_parts.constraints")
_loops = part(Loops, "_parts.loops")
_geometry = part(PlantGeometry, "_parts.geometry")
_surface_axes = part(SurfaceAxes, "_parts.surface_axes")
_topology = part(Topology, "_parts.topology")
_coordinates = part(Coordinates, "_parts.coordinates")
_contexts = part(Contexts, "_parts.contexts")
_free_bodies = part(FreeBodies, "_parts.free_bodies")
_kinematics = part(Kinematics, "_parts.kinematics")
_dynamics = part(Dynamics, "_parts.dynamics")
_accelerations = part(Accelerations, "_parts.accelerations")


class MultibodyPlant(LeafSystem):
    """Rigid bodies connected by joints, with contact, as a system.

    Bodies, joints and geometry are added first; `Finalize()` ends that, and makes state, parameters and ports.

    Args:
        time_step: Period of the discrete update [s], 0 for a plant with continuous state.
    """

    _complex_rows = True
    _generic = True
    _integers_kept = INTEGERS_KEPT
    _ports_are_lookups = True
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

    @typing_overload
    def AddRigidBody(self, name: str, M_BBo_B: SpatialInertia = ...) -> RigidBody: ...
    @typing_overload
    def AddRigidBody(
        self, name: str, model_instance: ModelInstanceIndex, M_BBo_B: SpatialInertia = ...
    ) -> RigidBody: ...
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

    @checked
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
        return self._output_port(self._parts.output_ports.number("state", model_instance))

    def get_body_poses_output_port(self) -> OutputPort:
        """Output: a list of X_WB, by body."""
        return self._output_port(self._parts.output_ports.number("body_poses"))

    def get_body_spatial_velocities_output_port(self) -> OutputPort:
        """Output: a list of V_WB, by body."""
        return self._output_port(self._parts.output_ports.number("body_spatial_velocities"))

    def get_body_spatial_accelerations_output_port(self) -> OutputPort:
        """Output: a list of A_WB, by body."""
        return self._output_port(self._parts.output_ports.number("body_spatial_accelerations"))

    def get_generalized_acceleration_output_port(self, model_instance: ModelInstanceIndex | None = None) -> OutputPort:
        """Output: vdot of all or of one model instance."""
        return self._output_port(self._parts.output_ports.number("generalized_acceleration", model_instance))

    @checked
    def get_generalized_contact_forces_output_port(self, model_instance: ModelInstanceIndex) -> OutputPort:
        """Output: generalized contact forces of one model instance [N or N m]."""
        return self._output_port(self._parts.output_ports.number("generalized_contact_forces", model_instance))

    def get_net_actuation_output_port(self, model_instance: ModelInstanceIndex | None = None) -> OutputPort:
        """Output: efforts that actuators exert, limits and controllers considered, of all or of one model instance."""
        return self._output_port(self._parts.output_ports.number("net_actuation", model_instance))

    def get_reaction_forces_output_port(self) -> OutputPort:
        """Output: a list of F_CJc_Jc, the spatial force on each joint's child at its frame M, expressed in M."""
        return self._output_port(self._parts.output_ports.number("reaction_forces"))

    def get_contact_results_output_port(self) -> OutputPort:
        """Output: ContactResults."""
        return self._output_port(self._parts.output_ports.number("contact_results"))

    def get_surface_displacements_output_port(self) -> OutputPort:
        """Output: a BusValue with how far surfaces that run have come, by the scoped names of the bodies [m]."""
        return self._output_port(self._parts.output_ports.number("surface_displacements"))

    # --- How it advances, and how contact is modelled

    SetUseSampledOutputPorts = Call(_settings.SetUseSampledOutputPorts)
    has_sampled_output_ports = Call(_settings.has_sampled_output_ports)
    set_contact_model = Call(_settings.set_contact_model)
    get_contact_model = Call(_settings.get_contact_model)
    set_discrete_contact_approximation = Call(_settings.set_discrete_contact_approximation)
    get_discrete_contact_approximation = Call(_settings.get_discrete_contact_approximation)
    get_discrete_contact_solver = Call(_settings.get_discrete_contact_solver)
    set_contact_surface_representation = Call(_settings.set_contact_surface_representation)
    get_contact_surface_representation = Call(_settings.get_contact_surface_representation)
    set_penetration_allowance = Call(_settings.set_penetration_allowance)
    get_contact_penalty_method_time_scale = Call(_settings.get_contact_penalty_method_time_scale)
    set_stiction_tolerance = Call(_settings.set_stiction_tolerance)
    set_sap_near_rigid_threshold = Call(_settings.set_sap_near_rigid_threshold)
    get_sap_near_rigid_threshold = Call(_settings.get_sap_near_rigid_threshold)
    GetDefaultContactSurfaceRepresentation = staticmethod(Settings.GetDefaultContactSurfaceRepresentation)

    # --- Model instances, bodies, frames, joints, actuators, force elements

    is_finalized = Call(_elements.is_finalized)
    AddModelInstance = Call(_elements.AddModelInstance)
    RenameModelInstance = Call(_geometry.RenameModelInstance)
    num_model_instances = Call(_elements.num_model_instances)
    HasModelInstanceNamed = Call(_elements.HasModelInstanceNamed)
    GetModelInstanceByName = Call(_elements.GetModelInstanceByName)
    GetModelInstanceName = Call(_elements.GetModelInstanceName)
    num_bodies = Call(_elements.num_bodies)
    world_body = Call(_elements.world_body)
    get_body = Call(_elements.get_body)
    has_body = Call(_elements.has_body)
    HasBodyNamed = Call(_elements.HasBodyNamed)
    NumBodiesWithName = Call(_elements.NumBodiesWithName)
    GetBodyByName = Call(_elements.GetBodyByName)
    GetRigidBodyByName = Call(_elements.GetRigidBodyByName)
    GetBodyIndices = Call(_elements.GetBodyIndices)
    AddFrame = Call(_elements.AddFrame)
    num_frames = Call(_elements.num_frames)
    world_frame = Call(_elements.world_frame)
    get_frame = Call(_elements.get_frame)
    HasFrameNamed = Call(_elements.HasFrameNamed)
    GetFrameByName = Call(_elements.GetFrameByName)
    GetFrameIndices = Call(_elements.GetFrameIndices)
    AddJoint = Call(_elements.AddJoint)
    WeldFrames = Call(_elements.WeldFrames)
    RemoveJoint = Call(_elements.RemoveJoint)
    num_joints = Call(_elements.num_joints)
    has_joint = Call(_elements.has_joint)
    get_joint = Call(_elements.get_joint)
    get_mutable_joint = Call(_elements.get_mutable_joint)
    HasJointNamed = Call(_elements.HasJointNamed)
    GetJointByName = Call(_elements.GetJointByName)
    GetMutableJointByName = Call(_elements.GetMutableJointByName)
    GetJointIndices = Call(_elements.GetJointIndices)
    AddJointActuator = Call(_elements.AddJointActuator)
    RemoveJointActuator = Call(_elements.RemoveJointActuator)
    RemoveAllJointActuatorEffortLimits = Call(_elements.RemoveAllJointActuatorEffortLimits)
    has_joint_actuator = Call(_elements.has_joint_actuator)
    get_joint_actuator = Call(_elements.get_joint_actuator)
    get_mutable_joint_actuator = Call(_elements.get_mutable_joint_actuator)
    HasJointActuatorNamed = Call(_elements.HasJointActuatorNamed)
    GetJointActuatorByName = Call(_elements.GetJointActuatorByName)
    GetJointActuatorIndices = Call(_elements.GetJointActuatorIndices)
    GetActuatedJointIndices = Call(_elements.GetActuatedJointIndices)
    AddForceElement = Call(_elements.AddForceElement)
    num_force_elements = Call(_elements.num_force_elements)
    get_force_element = Call(_elements.get_force_element)
    gravity_field = Call(_elements.gravity_field)
    mutable_gravity_field = Call(_elements.mutable_gravity_field)
    set_gravity_enabled = Call(_elements.set_gravity_enabled)
    is_gravity_enabled = Call(_elements.is_gravity_enabled)

    # --- Constraints

    AddCouplerConstraint = Call(_constraints.AddCouplerConstraint)
    AddTendonConstraint = Call(_constraints.AddTendonConstraint)
    AddDistanceConstraint = Call(_constraints.AddDistanceConstraint)
    AddBallConstraint = Call(_constraints.AddBallConstraint)
    AddWeldConstraint = Call(_constraints.AddWeldConstraint)
    RemoveConstraint = Call(_constraints.RemoveConstraint)
    num_constraints = Call(_constraints.num_constraints)
    GetConstraintIds = Call(_constraints.GetConstraintIds)
    GetConstraintActiveStatus = Call(_constraints.GetConstraintActiveStatus)
    SetConstraintActiveStatus = Call(_constraints.SetConstraintActiveStatus)
    GetDefaultDistanceConstraintParams = Call(_constraints.GetDefaultDistanceConstraintParams)
    GetDistanceConstraintParams = Call(_constraints.GetDistanceConstraintParams)
    SetDistanceConstraintParams = Call(_constraints.SetDistanceConstraintParams)

    SetEnableLoopTopology = Call(_loops.SetEnableLoopTopology)
    GetEnableLoopTopology = Call(_loops.GetEnableLoopTopology)
    num_loop_constraints = Call(_loops.num_loop_constraints)

    # --- Geometry

    geometry_source_is_registered = Call(_geometry.geometry_source_is_registered)
    get_source_id = Call(_geometry.get_source_id)
    RegisterCollisionGeometry = Call(_geometry.RegisterCollisionGeometry)
    RegisterVisualGeometry = Call(_geometry.RegisterVisualGeometry)
    num_collision_geometries = Call(_geometry.num_collision_geometries)
    GetCollisionGeometriesForBody = Call(_geometry.GetCollisionGeometriesForBody)
    GetVisualGeometriesForBody = Call(_geometry.GetVisualGeometriesForBody)
    CollectRegisteredGeometries = Call(_geometry.CollectRegisteredGeometries)
    GetBodyFromFrameId = Call(_geometry.GetBodyFromFrameId)
    GetBodyFrameIdIfExists = Call(_geometry.GetBodyFrameIdIfExists)
    GetBodyFrameIdOrThrow = Call(_geometry.GetBodyFrameIdOrThrow)
    set_adjacent_bodies_collision_filters = Call(_geometry.set_adjacent_bodies_collision_filters)
    get_adjacent_bodies_collision_filters = Call(_geometry.get_adjacent_bodies_collision_filters)

    SetSurfaceVelocityAxis = Call(_surface_axes.SetSurfaceVelocityAxis)
    GetSurfaceVelocityAxis = Call(_surface_axes.GetSurfaceVelocityAxis)

    # --- Its graph

    GetBodiesWeldedTo = Call(_topology.GetBodiesWeldedTo)
    IsAnchored = Call(_topology.IsAnchored)
    GetBodiesKinematicallyAffectedBy = Call(_topology.GetBodiesKinematicallyAffectedBy)

    # --- Positions, velocities and inputs

    num_positions = Call(_coordinates.num_positions)
    num_velocities = Call(_coordinates.num_velocities)
    num_multibody_states = Call(_coordinates.num_multibody_states)
    num_misc_continuous_states = Call(_coordinates.num_misc_continuous_states)
    num_actuators = Call(_coordinates.num_actuators)
    num_actuated_dofs = Call(_coordinates.num_actuated_dofs)
    GetPositionNames = Call(_coordinates.GetPositionNames)
    GetVelocityNames = Call(_coordinates.GetVelocityNames)
    GetStateNames = Call(_coordinates.GetStateNames)
    GetActuatorNames = Call(_coordinates.GetActuatorNames)
    GetPositionLowerLimits = Call(_coordinates.GetPositionLowerLimits)
    GetPositionUpperLimits = Call(_coordinates.GetPositionUpperLimits)
    GetVelocityLowerLimits = Call(_coordinates.GetVelocityLowerLimits)
    GetVelocityUpperLimits = Call(_coordinates.GetVelocityUpperLimits)
    GetAccelerationLowerLimits = Call(_coordinates.GetAccelerationLowerLimits)
    GetAccelerationUpperLimits = Call(_coordinates.GetAccelerationUpperLimits)
    GetEffortLowerLimits = Call(_coordinates.GetEffortLowerLimits)
    GetEffortUpperLimits = Call(_coordinates.GetEffortUpperLimits)
    GetPositions = Call(_coordinates.GetPositions)
    GetVelocities = Call(_coordinates.GetVelocities)
    GetPositionsAndVelocities = Call(_coordinates.GetPositionsAndVelocities)
    SetPositions = Call(_coordinates.SetPositions)
    SetVelocities = Call(_coordinates.SetVelocities)
    SetPositionsAndVelocities = Call(_coordinates.SetPositionsAndVelocities)
    GetPositionsFromArray = Call(_coordinates.GetPositionsFromArray)
    GetVelocitiesFromArray = Call(_coordinates.GetVelocitiesFromArray)
    SetPositionsInArray = Call(_coordinates.SetPositionsInArray)
    SetVelocitiesInArray = Call(_coordinates.SetVelocitiesInArray)
    GetActuationFromArray = Call(_coordinates.GetActuationFromArray)
    SetActuationInArray = Call(_coordinates.SetActuationInArray)
    GetDefaultPositions = Call(_coordinates.GetDefaultPositions)
    SetDefaultPositions = Call(_coordinates.SetDefaultPositions)
    MakeStateSelectorMatrix = Call(_coordinates.MakeStateSelectorMatrix)
    MakeActuatorSelectorMatrix = Call(_coordinates.MakeActuatorSelectorMatrix)
    MakeActuationMatrix = Call(_coordinates.MakeActuationMatrix)
    MakeActuationMatrixPseudoinverse = Call(_coordinates.MakeActuationMatrixPseudoinverse)

    SetDefaultState = Call(_contexts.SetDefaultState)
    parameter_columns = Call(_contexts.parameter_columns)

    # --- Bodies that float

    SetBaseBodyJointType = Call(_free_bodies.SetBaseBodyJointType)
    GetBaseBodyJointType = Call(_free_bodies.GetBaseBodyJointType)
    GetFloatingBaseBodies = Call(_free_bodies.GetFloatingBaseBodies)
    HasUniqueFloatingBaseBody = Call(_free_bodies.HasUniqueFloatingBaseBody)
    GetUniqueFloatingBaseBodyOrThrow = Call(_free_bodies.GetUniqueFloatingBaseBodyOrThrow)
    GetFreeBodyPose = Call(_free_bodies.GetFreeBodyPose)
    SetFreeBodyPose = Call(_free_bodies.SetFreeBodyPose)
    SetFreeBodySpatialVelocity = Call(_free_bodies.SetFreeBodySpatialVelocity)
    SetFloatingBaseBodyPoseInWorldFrame = Call(_free_bodies.SetFloatingBaseBodyPoseInWorldFrame)
    SetFloatingBaseBodyPoseInAnchoredFrame = Call(_free_bodies.SetFloatingBaseBodyPoseInAnchoredFrame)
    SetDefaultFloatingBaseBodyPose = Call(_free_bodies.SetDefaultFloatingBaseBodyPose)
    SetDefaultFreeBodyPose = Call(_free_bodies.SetDefaultFreeBodyPose)
    GetDefaultFreeBodyPose = Call(_free_bodies.GetDefaultFreeBodyPose)
    GetDefaultFloatingBaseBodyPose = Call(_free_bodies.GetDefaultFloatingBaseBodyPose)
    HasUniqueFreeBaseBody = Call(_free_bodies.HasUniqueFreeBaseBody)
    GetUniqueFreeBaseBodyOrThrow = Call(_free_bodies.GetUniqueFreeBaseBodyOrThrow)

    # --- Where things are and how they move

    EvalBodyPoseInWorld = Call(_kinematics.EvalBodyPoseInWorld)
    EvalBodySpatialVelocityInWorld = Call(_kinematics.EvalBodySpatialVelocityInWorld)
    CalcSpatialAccelerationsFromVdot = Call(_kinematics.CalcSpatialAccelerationsFromVdot)
    CalcRelativeTransform = Call(_kinematics.CalcRelativeTransform)
    CalcRelativeRotationMatrix = Call(_kinematics.CalcRelativeRotationMatrix)
    CalcPointsPositions = Call(_kinematics.CalcPointsPositions)
    CalcPointsVelocities = Call(_kinematics.CalcPointsVelocities)
    CalcTotalMass = Call(_kinematics.CalcTotalMass)
    CalcCenterOfMassPositionInWorld = Call(_kinematics.CalcCenterOfMassPositionInWorld)
    CalcCenterOfMassTranslationalVelocityInWorld = Call(_kinematics.CalcCenterOfMassTranslationalVelocityInWorld)
    CalcSpatialMomentumInWorldAboutPoint = Call(_kinematics.CalcSpatialMomentumInWorldAboutPoint)
    CalcSpatialInertia = Call(_kinematics.CalcSpatialInertia)
    CalcPotentialEnergy = Call(_kinematics.CalcPotentialEnergy)
    CalcKineticEnergy = Call(_kinematics.CalcKineticEnergy)
    CalcConservativePower = Call(_kinematics.CalcConservativePower)
    CalcNonConservativePower = Call(_kinematics.CalcNonConservativePower)
    EvalPotentialEnergy = Call(_kinematics.CalcPotentialEnergy)
    EvalKineticEnergy = Call(_kinematics.CalcKineticEnergy)

    # --- The equation of motion, Jacobians

    CalcMassMatrix = Call(_dynamics.CalcMassMatrix)
    CalcMassMatrixViaInverseDynamics = Call(_dynamics.CalcMassMatrixViaInverseDynamics)
    CalcBiasTerm = Call(_dynamics.CalcBiasTerm)
    CalcGravityGeneralizedForces = Call(_dynamics.CalcGravityGeneralizedForces)
    CalcInverseDynamics = Call(_dynamics.CalcInverseDynamics)
    CalcForceElementsContribution = Call(_dynamics.CalcForceElementsContribution)
    CalcGeneralizedForces = Call(_dynamics.CalcGeneralizedForces)
    MapVelocityToQDot = Call(_dynamics.MapVelocityToQDot)
    MapQDotToVelocity = Call(_dynamics.MapQDotToVelocity)
    MakeVelocityToQDotMap = Call(_dynamics.MakeVelocityToQDotMap)
    MakeQDotToVelocityMap = Call(_dynamics.MakeQDotToVelocityMap)
    IsVelocityEqualToQDot = Call(_dynamics.IsVelocityEqualToQDot)
    CalcJacobianSpatialVelocity = Call(_dynamics.CalcJacobianSpatialVelocity)
    CalcJacobianAngularVelocity = Call(_dynamics.CalcJacobianAngularVelocity)
    CalcJacobianTranslationalVelocity = Call(_dynamics.CalcJacobianTranslationalVelocity)
    CalcJacobianPositionVector = Call(_dynamics.CalcJacobianPositionVector)
    CalcJacobianCenterOfMassTranslationalVelocity = Call(_dynamics.CalcJacobianCenterOfMassTranslationalVelocity)
    CalcBiasSpatialAcceleration = Call(_dynamics.CalcBiasSpatialAcceleration)
    CalcBiasTranslationalAcceleration = Call(_dynamics.CalcBiasTranslationalAcceleration)
    CalcBiasCenterOfMassTranslationalAcceleration = Call(_dynamics.CalcBiasCenterOfMassTranslationalAcceleration)
    EvalBodySpatialAccelerationInWorld = Call(_accelerations.EvalBodySpatialAccelerationInWorld)
    CalcCenterOfMassTranslationalAccelerationInWorld = Call(
        _accelerations.CalcCenterOfMassTranslationalAccelerationInWorld
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

    def _implicit_residual(self, context: Context, proposed: np.ndarray) -> np.ndarray:
        if self._parts.settings.is_discrete():
            return super()._implicit_residual(context, proposed)
        return self._parts.accelerations.implicit_residual(context, proposed)

    def _kernel_models(self, root: RootView) -> dict[str, Any]:
        return self._parts.kernel_models.in_root(root)

    def _scratch_in(self, root: RootView) -> int | NamedTuple:
        """Memory of the step in a context; grows with the geometry that may touch."""
        if not self._parts.elements.is_finalized():
            return 0
        return self._parts.advance.prototype(self, self._parts.kernel_models.geometry_in(root))

    def _carry_scratch(self, old: Any, new: Any) -> None:
        self._parts.advance.carry(old, new)

    def _scratch_fault(self, scratch: np.ndarray | NamedTuple) -> str:
        return self._parts.advance.equations.scratch_fault(scratch)

    def _explain_status(self, status: int, context: Context) -> Exception:
        return self._parts.failures.explain(status, context)

    def _input_port(self, i: int) -> InputPort:
        return self._port(("in", i), SpatialForcePort if i == self._parts.inputs.spatial_force else InputPort)

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
