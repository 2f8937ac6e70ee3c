"""Two plants on one SceneGraph: each knows its own geometry, and refuses contact with that of others when it comes."""

import importlib

import numpy as np
import pytest

pytest.importorskip("pydrake")
pytestmark = pytest.mark.peer

LIBRARIES = [importlib.import_module(f"{name}.all") for name in ("sheldrake", "pydrake")]
ASIDE, HIGH, WITHIN = [1.0, 0.0, 0.09995], [0.0, 0.0, 3.0], [0.05, 0.0, 0.09995]


def ball(m, plant, position, touches=True):
    body = plant.AddRigidBody("ball", m.SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    if touches:
        plant.RegisterCollisionGeometry(body, m.RigidTransform(), m.Sphere(0.1), "skin", soft(m, body.name()))
    else:
        plant.RegisterVisualGeometry(body, m.RigidTransform(), m.Sphere(0.1), "look", np.ones(4))
    plant.SetDefaultFloatingBaseBodyPose(body, m.RigidTransform(position))


def soft(m, name):
    properties = m.ProximityProperties()
    m.AddContactMaterial(friction=m.CoulombFriction(0.5, 0.5), properties=properties)
    if name == "ball":
        m.AddCompliantHydroelasticProperties(0.05, 1e6, properties)
    else:
        m.AddRigidHydroelasticProperties(1.0, properties)
    return properties


class Scene:
    """A ball that lies on the ground, and one of another plant: the ghost."""

    def __init__(self, m, time_step, position, touches=True, hydroelastic=False, simulated=False):
        self.m, builder = m, m.DiagramBuilder()
        self.real, self.scene_graph = m.AddMultibodyPlantSceneGraph(builder, time_step)
        model = m.ContactModel.kHydroelasticWithFallback if hydroelastic else m.ContactModel.kPoint
        self.real.set_contact_model(model)
        ball(m, self.real, [0.0, 0.0, 0.09995])
        ground = self.real.world_body()
        X_WG = m.RigidTransform([0.0, 0.0, -0.5])
        self.real.RegisterCollisionGeometry(ground, X_WG, m.Box(10.0, 10.0, 1.0), "ground", soft(m, "ground"))
        self.ghost = m.MultibodyPlant(time_step)
        self.ghost.set_name("ghost")
        source = self.ghost.RegisterAsSourceForSceneGraph(self.scene_graph)
        ball(m, self.ghost, position, touches)
        self.real.Finalize()
        self.ghost.Finalize()
        if simulated:
            builder.AddSystem(self.ghost)
            poses = self.ghost.get_geometry_pose_output_port()
            query = self.scene_graph.get_query_output_port()
            builder.Connect(query, self.ghost.get_geometry_query_input_port())
        else:
            q = self.ghost.GetPositions(self.ghost.CreateDefaultContext())
            positions = builder.AddSystem(m.ConstantVectorSource(q))
            to_poses = builder.AddSystem(m.MultibodyPositionToGeometryPose(self.ghost))
            builder.Connect(positions.get_output_port(), to_poses.get_input_port())
            poses = to_poses.get_output_port()
        builder.Connect(poses, self.scene_graph.get_source_pose_port(source))
        self.diagram_builder = builder

    def begin(self, filtered=""):
        """A simulator; what the ghost has touches nothing, if so, from the model on or only in the context."""
        if filtered == "model":
            self.filter()
        diagram = self.diagram_builder.Build()
        root = diagram.CreateDefaultContext()
        if filtered == "context":
            self.filter(self.scene_graph.GetMyMutableContextFromRoot(root))
        return self.m.Simulator(diagram, root)

    def filter(self, *context):
        """Excludes what the ghost has from what everybody has."""
        m, scene_graph = self.m, self.scene_graph
        inspector = scene_graph.model_inspector()
        ids = inspector.GetAllGeometryIds()
        ghosts = [i for i in ids if inspector.GetOwningSourceName(i) == "ghost"]
        declaration = m.CollisionFilterDeclaration().ExcludeBetween(m.GeometrySet(ghosts), m.GeometrySet(ids))
        scene_graph.collision_filter_manager(*context).Apply(declaration)

    def seen(self, simulator):
        """After a while: positions of the real ball, and how many contacts it reports."""
        simulator.AdvanceTo(0.1)
        context = self.real.GetMyContextFromRoot(simulator.get_context())
        contacts = self.real.get_contact_results_output_port().Eval(context)
        counts = contacts.num_point_pair_contacts(), contacts.num_hydroelastic_contacts()
        return self.real.GetPositions(context), counts


def in_both(filtered="", **scene):
    """What is seen in each library."""
    scenes = [Scene(m, **scene) for m in LIBRARIES]
    return [one.seen(one.begin(filtered)) for one in scenes]


@pytest.mark.parametrize("time_step", [0.0, 0.01])
@pytest.mark.parametrize(
    "scene",
    [
        dict(position=WITHIN, touches=False, simulated=True),
        dict(position=WITHIN, touches=False),
        dict(position=WITHIN, filtered="model"),
        dict(position=WITHIN, filtered="model", hydroelastic=True),
        dict(position=WITHIN, filtered="context"),
        dict(position=HIGH),
        dict(position=HIGH, hydroelastic=True),
    ],
    ids=str,
)
def test_a_ghost_that_touches_nothing_is_in_nobodys_way(time_step, scene):
    (q, counts), (q_drake, counts_drake) = in_both(time_step=time_step, **scene)
    assert counts == counts_drake and sum(counts) == 1
    np.testing.assert_allclose(q, q_drake, atol=1e-4 if time_step == 0.0 else 1e-6)  # error of the integrator


@pytest.mark.parametrize("time_step", [0.0, 0.01])
@pytest.mark.parametrize("scene", [dict(position=WITHIN), dict(position=ASIDE), dict(position=WITHIN, simulated=True)])
def test_contact_with_a_ghost_is_refused_when_it_comes(time_step, scene):
    for m in LIBRARIES:
        one = Scene(m, time_step, **scene)
        simulator = one.begin()
        with pytest.raises(RuntimeError, match="known to this plant"):
            simulator.AdvanceTo(0.1)


def test_a_ghost_may_come_closer_until_it_touches():
    one = Scene(LIBRARIES[0], 0.001, [0.0, 0.0, 0.4], simulated=True)  # pydrake's refuses the contact of others, too
    simulator = one.begin()
    simulator.AdvanceTo(0.1)
    with pytest.raises(
        RuntimeError, match=r"'skin' of 'plant' is in contact with 'skin' of 'ghost'.*known to this plant"
    ):
        simulator.AdvanceTo(0.3)
    falls = (2.0 * 0.1 / 9.81) ** 0.5  # 0.1 m
    assert simulator.get_context().get_time() == pytest.approx(falls, abs=2e-3)
