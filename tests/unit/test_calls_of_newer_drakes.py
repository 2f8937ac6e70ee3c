"""Calls that Drake 1.52 to 1.58 added; the numbers expected were computed by Drake 1.58.0."""

import numpy as np
import pytest

from sheldrake.common.value import Value
from sheldrake.geometry import (
    CollisionFilterDeclaration,
    FramePoseVector,
    GeometryFrame,
    GeometryId,
    GeometryInstance,
    GeometrySet,
    MakeRenderEngineGl,
    ProximityProperties,
    RenderEngineGlParams,
    SceneGraph,
    Sphere,
)
from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.multibody.math import SpatialInertia, SpatialVelocity
from sheldrake.multibody.plant import BaseBodyJointType, MultibodyPlant
from sheldrake.solvers import MathematicalProgram, NloptSolver, SolverOptions
from sheldrake.symbolic import Variable
from sheldrake.systems.framework import DiagramBuilder, SubsystemIndex
from sheldrake.systems.primitives import ConstantVectorSource
from sheldrake.trajectories import PiecewisePolynomial, StackedTrajectory


@pytest.fixture
def inertia():
    return SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 0.1)


def test_bodies_that_no_joint_holds_may_have_angles(inertia):
    plant = MultibodyPlant(0.001)
    plant.SetBaseBodyJointType(BaseBodyJointType.kRpyFloatingJoint)
    body = plant.AddRigidBody("b", inertia)
    plant.SetDefaultFloatingBaseBodyPose(body, RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [1, 2, 3]))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    assert plant.GetPositions(context) == pytest.approx([0.1, 0.2, 0.3, 1, 2, 3])
    assert body.is_floating_base_body() and not body.has_quaternion_dofs()
    assert plant.num_misc_continuous_states() == 0
    plant.SetFreeBodyPose(context, body, RigidTransform([0, 0, 1]))
    plant.SetFreeBodySpatialVelocity(context, body, SpatialVelocity([1, 2, 3], [4, 5, 6]))
    assert plant.GetPositionsAndVelocities(context) == pytest.approx([0, 0, 0, 0, 0, 1, 1, 2, 3, 4, 5, 6])


def test_bodies_that_no_joint_holds_may_be_welded(inertia):
    plant = MultibodyPlant(0.001)
    plant.SetBaseBodyJointType(BaseBodyJointType.kWeldJoint)
    body = plant.AddRigidBody("b", inertia)
    plant.SetDefaultFloatingBaseBodyPose(body, RigidTransform([1, 2, 3]))
    plant.Finalize()
    pose = plant.EvalBodyPoseInWorld(plant.CreateDefaultContext(), body)
    assert plant.num_positions() == 0 and pose.IsExactlyIdentity()
    assert not body.is_floating_base_body()
    assert plant.GetDefaultFloatingBaseBodyPose(body).translation() == pytest.approx([1, 2, 3])


def test_each_model_instance_has_its_own_base_joint(inertia):
    plant = MultibodyPlant(0.001)
    instance = plant.AddModelInstance("m")
    assert plant.GetBaseBodyJointType(instance) is BaseBodyJointType.kQuaternionFloatingJoint
    plant.SetBaseBodyJointType(BaseBodyJointType.kWeldJoint)
    plant.SetBaseBodyJointType(BaseBodyJointType.kRpyFloatingJoint, instance)
    assert plant.GetBaseBodyJointType() is BaseBodyJointType.kWeldJoint
    assert plant.GetBaseBodyJointType(model_instance=instance) is BaseBodyJointType.kRpyFloatingJoint
    plant.AddRigidBody("a", instance, inertia)
    plant.Finalize()
    assert [plant.get_joint(j).type_name() for j in plant.GetJointIndices()] == ["rpy_floating"]
    with pytest.raises(RuntimeError, match="post-finalize"):
        plant.SetBaseBodyJointType(BaseBodyJointType.kWeldJoint)


def test_inactive_geometry_touches_nothing_whatever_declarations_say():
    graph = SceneGraph()
    source = graph.RegisterSource("s")
    ids = []
    for i in range(3):
        frame = graph.RegisterFrame(source, GeometryFrame(f"f{i}"))
        ids.append(graph.RegisterGeometry(source, frame, GeometryInstance(RigidTransform(), Sphere(1), f"g{i}")))
        graph.AssignRole(source, ids[-1], ProximityProperties())
    manager, inspector = graph.collision_filter_manager(), graph.model_inspector()
    manager.Deactivate(GeometrySet([ids[0]]))
    assert len(inspector.GetCollisionCandidates()) == 1
    assert inspector.CollisionFiltered(ids[0], ids[1]) and not inspector.CollisionFiltered(ids[1], ids[2])
    manager.Apply(CollisionFilterDeclaration().AllowWithin(GeometrySet(ids)))
    assert len(inspector.GetCollisionCandidates()) == 1
    transient = manager.ApplyTransient(CollisionFilterDeclaration().ExcludeWithin(GeometrySet(ids[1:])))
    manager.Activate(GeometrySet([ids[0]]))
    assert len(inspector.GetCollisionCandidates()) == 2
    assert manager.RemoveDeclaration(transient) and len(inspector.GetCollisionCandidates()) == 3
    with pytest.raises(RuntimeError, match="doesn't belong to the SceneGraph"):
        manager.Deactivate(GeometrySet([GeometryId.get_new_id()]))


def test_inactive_geometry_has_no_contact_in_a_context():
    graph = SceneGraph()
    source = graph.RegisterSource("s")
    frame = graph.RegisterFrame(source, GeometryFrame("f"))
    ball = graph.RegisterGeometry(source, frame, GeometryInstance(RigidTransform(), Sphere(1), "ball"))
    other = graph.RegisterAnchoredGeometry(source, GeometryInstance(RigidTransform(), Sphere(1), "other"))
    for one in (ball, other):
        graph.AssignRole(source, one, ProximityProperties())
    context = graph.CreateDefaultContext()
    poses = graph.get_source_pose_port(source)
    X = FramePoseVector()
    X.set_value(frame, RigidTransform([0.5, 0, 0]))
    poses.FixValue(context, Value[FramePoseVector](X))
    query = graph.get_query_output_port()
    assert len(query.Eval(context).ComputePointPairPenetration()) == 1
    graph.collision_filter_manager(context).Deactivate(GeometrySet([ball]))
    assert query.Eval(context).ComputePointPairPenetration() == []
    graph.collision_filter_manager(context).Activate(GeometrySet([ball]))
    assert len(query.Eval(context).ComputePointPairPenetration()) == 1


def test_a_diagram_gives_its_systems_by_number():
    builder = DiagramBuilder()
    source = builder.AddSystem(ConstantVectorSource([1.0]))
    diagram = builder.Build()
    assert diagram.get_system(SubsystemIndex(0)) is source
    with pytest.raises(RuntimeError, match="no subsystem 1; this diagram has 1"):
        diagram.get_system(SubsystemIndex(1))


def test_stacked_trajectories_show_their_parts():
    stacked = StackedTrajectory(rowwise=False)
    stacked.Append(PiecewisePolynomial(np.ones((2, 1))))
    assert not stacked.rowwise() and [c.cols() for c in stacked.children()] == [1]


def test_a_variable_without_name_is_a_dummy():
    dummy = Variable()
    assert dummy.is_dummy() and dummy.get_id() == 0 and dummy.EqualTo(Variable())
    assert not Variable("x").is_dummy()


def test_log_determinants_have_weights():
    program = MathematicalProgram()
    cost, _, _ = program.AddMaximizeLogDeterminantCost(program.NewSymmetricContinuousVariables(2), 3.0)
    assert cost.evaluator().a() == pytest.approx([-3.0, -3.0])


def test_nlopt_solves_subproblems_as_told():
    pytest.importorskip("nlopt")
    program = MathematicalProgram()
    x = program.NewContinuousVariables(2)
    program.AddCost((x[0] - 1.0) ** 4 + x[1] ** 2)
    program.AddConstraint(x[0] + x[1] == 1.0)
    options = SolverOptions()
    for name, value in {
        NloptSolver.AlgorithmName(): "AUGLAG",
        NloptSolver.LocalOptimizerAlgorithmName(): "LD_LBFGS",
        NloptSolver.LocalOptimizerMaxEvalName(): 200,
        NloptSolver.LocalOptimizerXRelativeToleranceName(): 1e-8,
        NloptSolver.FAbsoluteToleranceName(): 1e-14,
        NloptSolver.ParamPrefix() + "verbosity": 0,
    }.items():
        options.SetOption(NloptSolver.id(), name, value)
    result = NloptSolver().Solve(program, np.array([3.0, -2.0]), options)
    assert result.is_success() and result.get_optimal_cost() < 1e-6


def test_nlopt_stops_at_a_cost_that_is_good_enough():
    pytest.importorskip("nlopt")
    program = MathematicalProgram()
    x = program.NewContinuousVariables(2)
    program.AddCost((x[0] - 1.0) ** 4 + x[1] ** 2)
    options = SolverOptions()
    options.SetOption(NloptSolver.id(), NloptSolver.StopValName(), 5.0)
    result = NloptSolver().Solve(program, np.array([3.0, -2.0]), options)
    assert 1e-6 < result.get_optimal_cost() <= 5.0 and result.get_solver_details().status == 2


def test_shadows_of_the_gl_engine_are_said_not_to_be_drawn(caplog):
    MakeRenderEngineGl(RenderEngineGlParams(cast_shadows=True))
    assert "MakeRenderEngineGl(): not drawn here: cast_shadows" in caplog.text
