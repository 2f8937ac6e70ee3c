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
