"""Calls of pydrake from 2021 on: each works, with a hint that names today's."""

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


CALLS = {
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
