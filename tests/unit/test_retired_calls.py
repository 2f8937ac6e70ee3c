"""Calls of pydrake from 2021 on: each works, with a hint that names today's."""

import pathlib

import numpy as np
import pytest

import sheldrake.all as m
from sheldrake.common.deprecation import DrakeDeprecationWarning


def ball():
    """A plant with one floating ball in a scene."""
    builder = m.DiagramBuilder()
    plant, scene_graph = m.AddMultibodyPlantSceneGraph(builder, 0.01)
    body = plant.AddRigidBody("ball", m.SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    plant.RegisterCollisionGeometry(body, m.RigidTransform(), m.Sphere(0.1), "ball", m.CoulombFriction(1, 1))
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    return plant, scene_graph, body, plant.GetMyContextFromRoot(context)


def free_pose(call, *more):
    plant, _, body, context = ball()
    X = m.RigidTransform([1.0, 2.0, 3.0])
    getattr(plant, call)(context, *(plant.world_frame() for _ in more), body, X)
    return plant.EvalBodyPoseInWorld(context, body).IsExactlyEqualTo(X)


def path_by_ids():
    graph = m.GraphOfConvexSets()
    u, v, w = (graph.AddVertex(m.Point([float(x)]), name) for x, name in enumerate("uvw"))
    edges = [graph.AddEdge(u.id(), v.id(), "uv"), graph.AddEdge(u_id=v.id(), v_id=w.id(), name="vw")]
    result = graph.SolveShortestPath(source_id=u.id(), target_id=w.id(), convex_relaxation=True)
    return result.is_success() and [e.u().name() + e.v().name() for e in edges] == ["uv", "vw"]


def jacobian_with_an_old_argument():
    plant, _, body, context = ball()
    W = plant.world_frame()
    J = plant.CalcJacobianSpatialVelocity(context, m.JacobianWrtVariable.kV, body.body_frame(), p_BP=[0, 0, 0],
                                          frame_A=W, frame_E=W)  # fmt: skip
    return np.allclose(J, np.eye(6))


def discrete_update():
    class Three(m.LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareDiscreteState(1)
            self.DeclareForcedDiscreteUpdateEvent(lambda context, x: x.get_mutable_vector().SetFromVector([3.0]))

    system = Three()
    x = system.AllocateDiscreteVariables()
    system.CalcDiscreteVariableUpdates(system.CreateDefaultContext(), x)
    return x.get_vector()[0] == 3.0


def camera():
    properties = m.DepthCameraProperties(width=64, height=48, fov_y=0.7, renderer_name="r", z_near=0.2, z_far=20.0)
    sensor = m.RgbdSensor(m.SceneGraph.world_frame_id(), m.RigidTransform(), properties=properties)
    depth, core = properties.depth_range(), sensor.default_color_render_camera().core()
    return (depth.min_depth(), depth.max_depth(), core.intrinsics().width()) == (0.2, 20.0, 64)


def compliant():
    properties = m.ProximityProperties()
    m.AddSoftHydroelasticProperties(resolution_hint=0.1, hydroelastic_modulus=1e7, properties=properties)
    return properties.GetProperty("hydroelastic", "hydroelastic_modulus") == 1e7


def params_by_an_old_name():
    params = m.MeshcatVisualizerParams()
    params.delete_prefix_initialization_event = False
    return not params.delete_on_initialization_event and not params.delete_prefix_initialization_event


def scene_without_a_time_step():
    builder = m.DiagramBuilder()
    plant, _ = m.AddMultibodyPlantSceneGraph(builder)
    return plant.time_step() == 0.0 and plant.get_source_id() is not None


def contacts_without_the_scene():
    builder = m.DiagramBuilder()
    plant, _ = m.AddMultibodyPlantSceneGraph(builder, 0.01)
    plant.Finalize()
    publisher = m.ConnectContactResultsToDrakeVisualizer(builder, plant, m.DrakeLcm("memq://"))
    return publisher.get_channel_name() == "CONTACT_RESULTS"


def material_with_a_modulus():
    properties = m.ProximityProperties()
    m.AddContactMaterial(1e7, 2.0, 1e5, m.CoulombFriction(0.3, 0.2), properties)
    return (
        properties.GetProperty("hydroelastic", "hydroelastic_modulus") == 1e7
        and properties.GetProperty("material", "hunt_crossley_dissipation") == 2.0
        and properties.GetProperty("material", "coulomb_friction").dynamic_friction() == 0.2
    )


def camera_poses():
    core = m.RenderCameraCore("r", m.CameraInfo(64, 48, 0.7), m.ClippingRange(0.1, 2), m.RigidTransform())
    sensor = m.RgbdSensor(
        m.SceneGraph.world_frame_id(),
        m.RigidTransform(),
        m.DepthRenderCamera(core, m.DepthRange(0.1, 1)),
        camera_poses=m.RgbdSensor.CameraPoses(X_BC=m.RigidTransform([1, 0, 0]), X_BD=m.RigidTransform([0, 1, 0])),
        show_window=False,
    )
    X_BC, X_BD = (
        camera.core().sensor_pose_in_camera_body().translation().tolist()
        for camera in (sensor.default_color_render_camera(), sensor.default_depth_render_camera())
    )
    return (X_BC, X_BD) == ([1, 0, 0], [0, 1, 0])


def bias_of_a_jacobian():
    builder = m.DiagramBuilder()
    plant = builder.AddSystem(m.MultibodyPlant(0.0))
    body = plant.AddRigidBody("arm", m.SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    plant.AddJoint(m.RevoluteJoint("hinge", plant.world_frame(), body.body_frame(), [0, 0, 1]))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetVelocities(context, [3.0])
    W, v = plant.world_frame(), m.JacobianWrtVariable.kV
    a = plant.CalcBiasForJacobianTranslationalVelocity(
        context=context, with_respect_to=v, frame_F=body.body_frame(), p_FoBi_F=[2, 0, 0], frame_A=W, frame_E=W
    )
    A = plant.CalcBiasForJacobianSpatialVelocity(context, v, body.body_frame(), [2, 0, 0], W, W)
    return np.allclose(np.ravel(a), [-18, 0, 0]) and np.allclose(A.translational(), [-18, 0, 0])


def collocation_that_is_a_program():
    """What DirectCollocation was until 2022: its methods are those of its program, and Solve() takes it."""
    system = m.LinearSystem([[0.0, 1.0], [0.0, 0.0]], [[0.0], [1.0]], np.eye(2), np.zeros((2, 1)))
    dircol = m.DirectCollocation(system, system.CreateDefaultContext(), 11, 0.1, 0.1)
    dircol.AddBoundingBoxConstraint([0.0, 0.0], [0.0, 0.0], dircol.initial_state())
    dircol.AddLinearConstraint(m.eq(dircol.final_state(), [1.0, 0.0]))
    dircol.AddRunningCost(dircol.input()[0] ** 2)
    result, again = m.Solve(dircol), m.ChooseBestSolver(dircol.prog())
    also = m.MakeSolver(again).Solve(dircol, None, None)
    states = [r.GetSolution(dircol.state(10)) for r in (result, also)]
    return result.is_success() and np.allclose(states, [[1.0, 0.0]] * 2, atol=1e-6) and not hasattr(dircol, "AddNone")


def found_resource():
    folder = m.temp_directory()
    path = pathlib.Path(folder) / "drake" / "here.txt"
    path.parent.mkdir()
    path.touch()
    m.AddResourceSearchPath(folder)
    missing = m.FindResource("drake/nowhere.txt")
    with pytest.raises(RuntimeError, match="nowhere"):
        missing.get_absolute_path_or_throw()
    return m.FindResource("drake/here.txt").get_absolute_path_or_throw() == str(path) and missing.get_error_message()


def vertices_of_a_mesh():
    vertices = [m.SurfaceVertex(r_MV=r) for r in ([0, 0, 0], [1, 0, 0], [0, 1, 0])]
    mesh = m.SurfaceMesh([m.SurfaceFace(0, 1, 2)], vertices)
    return mesh.total_area() == 0.5 and vertices[1].r_MV().tolist() == [1, 0, 0]


def memory_of_the_state():
    plant, _, body, context = ball()
    plant.GetMutablePositions(context)[4:] = [1.0, 2.0, 3.0]
    plant.GetMutableVelocities(context)[5] = 4.0
    plant.GetMutablePositionsAndVelocities(context)[7] = 5.0
    moved = np.array_equal(plant.EvalBodyPoseInWorld(context, body).translation(), [1.0, 2.0, 3.0])
    return moved and np.array_equal(plant.GetVelocities(context), [5.0, 0, 0, 0, 0, 4.0])


def states_of_a_free_body():
    plant, _, body, context = ball()
    X = m.RigidTransform([1.0, 2.0, 3.0])
    plant.SetFreeBodyPose(context=context, body=body, X_WB=X)
    plant.SetFreeBodySpatialVelocity(body=body, V_WB=m.SpatialVelocity([1.0, 0, 0], [0.0, 0, 2]), context=context)
    plant.SetDefaultFreeBodyPose(body=body, X_WB=X)
    joint = plant.get_joint(plant.GetJointIndices(body.model_instance())[0])
    where = joint.get_pose(context).IsExactlyEqualTo(X) and np.array_equal(joint.get_position(context), [1.0, 2, 3])
    joint.set_position(context, [0.0, 0.0, 4.0])
    joint.SetFromRotationMatrix(context, m.RotationMatrix.MakeZRotation(0.1))
    where = where and np.array_equal(plant.GetPositions(context)[4:], [0.0, 0.0, 4.0])
    return where and np.array_equal(plant.GetVelocities(context), [1.0, 0, 0, 0, 0, 2]) and joint.angular_damping() == 0


def arguments_of_spatial_vectors():
    V = m.SpatialVelocity([0.0, 0, 1], [0.0, 0, 0])
    moved = V.Shift(p_BpBq_E=[1.0, 0, 0]).translational()
    composed = V.ComposeWithMovingFrameVelocity(p_PoBo_E=[1.0, 0, 0], V_PB_E=m.SpatialVelocity.Zero())
    A = m.SpatialAcceleration.Zero().Shift(p_PoQ_E=[1.0, 0, 0], w_WP_E=[0.0, 0, 1])
    return (
        np.array_equal(moved, [0, 1, 0])
        and np.array_equal(composed.translational(), moved)
        and A.translational()[0] == -1.0
    )


def options_of_programs():
    program = m.MathematicalProgram()
    x = program.NewIndeterminates(1, "x")
    program.NewNonnegativePolynomial(m.Variables(x), 2, m.MathematicalProgram.NonnegativePolynomial.kSos)
    program.SetSolverOption(m.OsqpSolver.id(), "max_iter", 7)
    options = m.SolverOptions()
    options.SetOption(solver_id=m.OsqpSolver.id(), solver_option="polish", option_value=1)
    return (
        program.GetSolverOptions(m.OsqpSolver.id()) == {"max_iter": 7}
        and options.GetOptions(m.OsqpSolver.id()) == {"polish": 1}
        and m.SolutionResult.kUnknownError is m.SolutionResult.kSolverSpecificError
        and np.array_equal(m.LinearConstraint(np.eye(2), [0, 0], [1, 1]).A(), np.eye(2))
    )


def settings_of_contact_and_graphs():
    config = m.MultibodyPlantConfig(discrete_contact_solver="sap")
    graph = m.GraphOfConvexSetsOptions()
    graph.rounding_solver_options = m.SolverOptions()
    delay = m.DiscreteTimeDelay(update_sec=0.1, delay_timesteps=2, vector_size=1)
    url = m.DrakeLcm("memq://", defer_initialization=True).get_lcm_url()
    used = graph.restriction_solver_options is not None and delay.get_input_port(0).size() == 1
    return config.discrete_contact_approximation == config.discrete_contact_solver == "sap" and used and "memq" in url


def pose_in_parent():
    inspector = ball()[1].model_inspector()
    return inspector.GetPoseInParent(inspector.GetAllGeometryIds()[0]).IsExactlyEqualTo(m.RigidTransform())


def options_by_type_of_solver():
    program, options = m.MathematicalProgram(), m.SolverOptions()
    program.SetSolverOption(m.SolverType.kIpopt, "tol", 1e-3)
    options.SetOption(m.SolverType.kIpopt, "tol", 1e-4)
    options.SetOption(solver_id=m.SolverType.kSnopt, solver_option="Timing level", option_value=3)
    given = [options.GetOptions(m.SolverType.kIpopt), options.GetOptions(m.SnoptSolver.id())]
    found = program.GetSolverOptions(m.SolverType.kIpopt) == {"tol": 1e-3}
    return found and given == [{"tol": 1e-4}, {"Timing level": 3}] and m.CsdpSolver(method=2).available()


def options_of_all_solvers():
    options = m.SolverOptions()
    unset = (options.get_print_to_console(), options.get_print_file_name(), options.get_max_threads())
    options.SetOption(m.CommonSolverOption.kPrintToConsole, 1)
    options.SetOption(m.CommonSolverOption.kPrintFileName, "log.txt")
    options.SetOption(m.CommonSolverOption.kMaxThreads, 2)
    now = (options.get_print_to_console(), options.get_print_file_name(), options.get_max_threads())
    common = options.common_solver_options()[m.CommonSolverOption.kPrintFileName] == "log.txt"
    return unset == (False, "", None) and now == (True, "log.txt", 2) and common


def settings_in_a_file_of_2022():
    text = "{time_step: 0.01, discrete_contact_solver: sap, contact_model: point}"
    config = m.yaml_load_typed(schema=m.MultibodyPlantConfig, data=text)
    with pytest.raises(RuntimeError, match="discrete_contact_colour"):
        m.yaml_load_typed(schema=m.MultibodyPlantConfig, data=text.replace("solver", "colour"))
    plant, _ = m.AddMultibodyPlant(config, m.DiagramBuilder())
    return plant.get_discrete_contact_approximation() is m.DiscreteContactApproximation.kSap


def projected_points():
    line = m.AffineSubspace([[1.0], [1.0]], [0.0, 2.0])
    both = line.Project(np.eye(2))
    return np.allclose(line.Project([2.0, 0.0]), [0.0, 2.0]) and np.allclose(both, [[-0.5, -0.5], [1.5, 1.5]])


def arm_in_parts():
    def plant_of_an_arm(builder=None):
        plant = m.MultibodyPlant(0.01)
        link = plant.AddRigidBody("link", m.SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        joint = plant.AddJoint(m.RevoluteJoint("hinge", plant.world_frame(), link.body_frame(), [0, 0, 1]))
        plant.AddJointActuator("motor", joint)
        plant.Finalize()
        return plant

    def driver_and_ports(call):
        builder, arm = m.DiagramBuilder(), m.default_model_instance()
        driver = call(builder, builder.AddSystem(plant_of_an_arm()), arm, plant_of_an_arm())
        found = driver or next(s for s in builder.GetSystems() if isinstance(s, m.SimIiwaDriver))
        return [found.get_input_port(i).get_name() for i in range(found.num_input_ports())]

    mode, lcm = m.IiwaControlMode.kPositionOnly, m.DrakeLcm("memq://null")
    calls = [
        lambda b, plant, arm, known: m.SimIiwaDriver.AddToBuilder(b, plant, arm, known, 0.02, [100.0], mode),
        lambda b, plant, arm, known: m.SimIiwaDriver(mode, known, 0.02, [100.0]),
        lambda b, plant, arm, known: m.BuildIiwaControl(
            plant, arm, known, lcm, b, desired_iiwa_kp_gains=[100.0], control_mode=mode
        ),
    ]
    return all(driver_and_ports(c) == ["state", "generalized_contact_forces", "position"] for c in calls)


def unconstrained_limit():
    parameters = m.DifferentialInverseKinematicsParameters(7, 7)
    before = parameters.get_unconstrained_degrees_of_freedom_velocity_limit()
    parameters.set_unconstrained_degrees_of_freedom_velocity_limit(0.1)
    return before is None and parameters.get_unconstrained_degrees_of_freedom_velocity_limit() == 0.1


def label_of_unlabelled():
    params = m.RenderEngineVtkParams(default_label=m.RenderLabel.kDontCare)
    return params.default_label == m.RenderLabel.kDontCare


def pairs_that_meet():
    boxes = [m.HPolyhedron.MakeBox([low], [low + 1.0]) for low in (0.0, 0.5, 3.0)]
    return [(i, j, offset.tolist()) for i, j, offset in m.CalcPairwiseIntersections(boxes, [])] == [
        (0, 1, [0.0]),
        (1, 0, [0.0]),
    ]


CALLS = {
    "label": label_of_unlabelled,
    "pairs": pairs_that_meet,
    "type of solver": options_by_type_of_solver,
    "all solvers": options_of_all_solvers,
    "file of settings": settings_in_a_file_of_2022,
    "projection": projected_points,
    "arm": arm_in_parts,
    "unconstrained": unconstrained_limit,
    "field": params_by_an_old_name,
    "time step": scene_without_a_time_step,
    "contacts": contacts_without_the_scene,
    "material": material_with_a_modulus,
    "poses of cameras": camera_poses,
    "bias": bias_of_a_jacobian,
    "collocation": collocation_that_is_a_program,
    "resource": found_resource,
    "vertices": vertices_of_a_mesh,
    "pose in parent": pose_in_parent,
    "memory of the state": memory_of_the_state,
    "states of a free body": states_of_a_free_body,
    "spatial vectors": arguments_of_spatial_vectors,
    "options": options_of_programs,
    "settings": settings_of_contact_and_graphs,
    "volume": lambda: np.isclose(m.Hyperellipsoid.MakeUnitBall(2).Volume(), np.pi),
    "identity": lambda: m.RigidTransform().IsIdentityToEpsilon(1e-3),
    "free pose": lambda: free_pose("SetFreeBodyPoseInWorldFrame"),
    "free pose in a frame": lambda: free_pose("SetFreeBodyPoseInAnchoredFrame", "F"),
    "index of velocities": lambda: ball()[2].floating_velocities_start() == 7,
    "shortest path": path_by_ids,
    "keyword": jacobian_with_an_old_argument,
    "update": discrete_update,
    "camera": camera,
    "compliant": compliant,
    "mesh": lambda: m.Mesh(absolute_filename="/a/b.obj", scale=2.0).filename() == "/a/b.obj",
    "frames": lambda: len(ball()[1].model_inspector().all_frame_ids()) == 2,
    "pose": lambda: (
        m.PiecewisePose.MakeLinear([0.0, 1.0], [m.RigidTransform(), m.RigidTransform([2, 0, 0])])
        .get_pose(0.5)
        .IsNearlyEqualTo(m.RigidTransform([1, 0, 0]), 1e-12)
    ),
    "builder": lambda: m.RobotDiagramBuilder().mutable_plant().num_bodies() == 1,
    "finalized": lambda: not m.RobotDiagramBuilder().IsPlantFinalized(),
    "visualizer": lambda: (
        not m.MeshcatVisualizerParams(delete_prefix_on_initialization_event=False).delete_on_initialization_event
    ),
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_works_with_a_hint(call):
    with pytest.warns(DrakeDeprecationWarning):
        assert call()


def test_an_overridden_publish_runs_once_per_event():
    class Counter(m.LeafSystem):
        def __init__(self):
            super().__init__()
            self.times, self.updates = [], 0
            self.DeclareDiscreteState(1)
            with pytest.warns(DrakeDeprecationWarning):
                self.DeclarePeriodicPublish(0.1)
                self.DeclarePeriodicDiscreteUpdate(0.1)

        def DoPublish(self, context, events):
            m.LeafSystem.DoPublish(self, context, events)
            self.times.append(context.get_time())

        def DoCalcDiscreteVariableUpdates(self, context, events, discrete_state):
            m.LeafSystem.DoCalcDiscreteVariableUpdates(self, context, events, discrete_state)
            self.updates += 1

    counter = Counter()
    m.Simulator(counter).AdvanceTo(0.45)
    np.testing.assert_allclose(counter.times, [0.0, 0.1, 0.2, 0.3, 0.4])
    assert counter.updates == 5


def test_feedthrough_of_a_vector_system_may_be_left_out():
    class Square(m.VectorSystem):
        def __init__(self):
            super().__init__(1, 1)

        def DoCalcVectorOutput(self, context, u, x, y):
            y[:] = u * u

    system = Square()
    context = system.CreateDefaultContext()
    system.get_input_port().FixValue(context, [3.0])
    assert system.get_output_port().Eval(context) == [9.0]


def test_time_steps_had_another_name():
    system = m.LinearSystem([[0.0]], [[1.0]], [[1.0]], [[0.0]])
    with pytest.warns(DrakeDeprecationWarning, match="minimum_timestep is now minimum_time_step"):
        dircol = m.DirectCollocation(
            system, system.CreateDefaultContext(), num_time_samples=5, minimum_timestep=0.1, maximum_timestep=0.2
        )
    assert dircol.prog().num_vars() == 14


@pytest.mark.parametrize(
    "old, today",
    [
        (lambda: m.UnitInertia.SolidCylinder(1, 2), lambda: m.UnitInertia.SolidCylinder(1, 2, [0, 0, 1])),
        (lambda: m.UnitInertia.SolidCylinder(r=1, L=2), lambda: m.UnitInertia.SolidCylinder(1, 2, [0, 0, 1])),
        (
            lambda: m.UnitInertia.SolidCylinder(1, L=2, b_E=[1, 0, 0]),
            lambda: m.UnitInertia.SolidCylinder(1, 2, [1, 0, 0]),
        ),
        (
            lambda: m.UnitInertia.SolidCylinderAboutEnd(r=1, L=2),
            lambda: m.UnitInertia.SolidCylinderAboutEnd(1, 2, [0, 0, 1]),
        ),
        (lambda: m.UnitInertia.ThinRod(L=2, b_E=[1, 0, 0]), lambda: m.UnitInertia.ThinRod(2, [1, 0, 0])),
        (lambda: m.UnitInertia.StraightLine(K=2, b_E=[1, 0, 0]), lambda: m.UnitInertia.StraightLine(2, [1, 0, 0])),
        (
            lambda: m.UnitInertia.AxiallySymmetric(J=1, K=2, b_E=[1, 0, 0]),
            lambda: m.UnitInertia.AxiallySymmetric(1, 2, [1, 0, 0]),
        ),
    ],
)
def test_retired_arguments_of_inertias(old, today):
    with pytest.warns(DrakeDeprecationWarning, match="UnitInertia"):
        got = old()
    assert got.CopyToFullMatrix3().tolist() == today().CopyToFullMatrix3().tolist()


def test_retired_arguments_of_inertias_of_other_scalars():
    with pytest.warns(DrakeDeprecationWarning, match="UnitInertia.ThinRod"):
        rod = m.UnitInertia_[m.AutoDiffXd].ThinRod(L=m.AutoDiffXd(2.0, [1.0]), unit_vector=[1.0, 0.0, 0.0])
    np.testing.assert_allclose(rod.get_moments()[1].derivatives(), [2.0 * 2.0 / 12.0])
