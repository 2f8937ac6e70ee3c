"""What bodies, joints, shapes, sets, constraints and the viewer answer is what pydrake's do, line by line."""

import pathlib

import pytest
from tests.crosscheck.pydrake import lines

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")
MODULES = [
    "common", "math", "geometry", "geometry.optimization", "multibody.math", "multibody.tree", "multibody.plant",
    "multibody.inverse_kinematics", "multibody.meshcat", "planning", "symbolic", "autodiffutils", "systems.framework",
    "systems.analysis",
]  # fmt: skip
SETUP = '''
plant = MultibodyPlant(0.0)
body = plant.AddRigidBody("body", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
arm = plant.AddRigidBody("arm", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
joint = plant.AddJoint(RevoluteJoint("joint", plant.world_frame(), body.body_frame(), [0, 0, 1], damping=0.5))
other = plant.AddJoint(RevoluteJoint("other", body.body_frame(), arm.body_frame(), [0, 0, 1]))
actuator = plant.AddJointActuator("motor", joint)
plant.AddJointActuator("other motor", other)
plant.Finalize()
context = plant.CreateDefaultContext()


def mesh_with_margin(shape, margin):
    """Size of the mesh of a compliant shape."""
    scene_graph = SceneGraph()
    source = scene_graph.RegisterSource("s")
    frame = scene_graph.RegisterFrame(source, GeometryFrame("f"))
    geometry = scene_graph.RegisterGeometry(source, frame, GeometryInstance(RigidTransform(), shape, "g"))
    properties = ProximityProperties()
    AddCompliantHydroelasticProperties(0.1, 1e5, properties)
    properties.AddProperty("hydroelastic", "margin", margin)
    scene_graph.AssignRole(source, geometry, properties)
    mesh = scene_graph.model_inspector().maybe_get_hydroelastic_mesh(geometry)
    return mesh.num_vertices(), mesh.CalcVolume()


def to_point(shape, X_WG, p_WQ):
    """Distance of a point, nearest point and gradient, by numbers and by duals of the geometry's position."""
    scene_graph = SceneGraph()
    source = scene_graph.RegisterSource("s")
    frame = scene_graph.RegisterFrame(source, GeometryFrame("f"))
    geometry = scene_graph.RegisterGeometry(source, frame, GeometryInstance(RigidTransform(), shape, "g"))
    scene_graph.AssignRole(source, geometry, ProximityProperties())
    answers = []
    for T, position in ((float, X_WG.translation()), (AutoDiffXd, InitializeAutoDiff(X_WG.translation()).ravel())):
        system = scene_graph if T is float else scene_graph.ToScalarType[T]()
        context, poses = system.CreateDefaultContext(), FramePoseVector_[T]()
        poses.set_value(frame, RigidTransform_[T](X_WG.rotation().cast[T](), position))
        system.get_source_pose_port(source).FixValue(context, poses)
        query = system.get_query_output_port().Eval(context)
        (found,) = query.ComputeSignedDistanceToPoint(np.array(p_WQ) if T is float else np.array([T(x) for x in p_WQ]))
        numbers = [found.distance, *found.p_GN, *found.grad_W]
        answers.append(np.round([float(x if T is float else x.value()) for x in numbers], 12) + 0.0)
        answers.append([] if T is float else np.round(found.distance.derivatives(), 12) + 0.0)
    return answers


def publishes(params, meshcat):
    """How often a simulation of 0.1 s draws."""
    builder = DiagramBuilder()
    MeshcatVisualizer.AddToBuilder(builder, builder.AddSystem(SceneGraph()), meshcat, params)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.1)
    return simulator.get_num_publishes()
'''


def test_answers_are_the_same():
    assert not lines.differences(pathlib.Path(__file__).with_name("robot_lines.txt"), MODULES, SETUP)
