"""Contact forces in the page: the arrows' tips are where the forces say, live and in the replay."""

from chromium import until
from test_meshcat_page import READY

from sheldrake.geometry import HalfSpace, Meshcat, MeshcatVisualizer, Sphere
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.meshcat import ContactVisualizer, ContactVisualizerParams
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder

ARROW = "/drake/contact_forces/point/ball+world"
TIP = 9.81 / 50 + 0.02  # of 9.81 N at 50 N/m, and the head of a shaft of 1 cm


def simulator_of(meshcat):
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    ball, friction = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(1.0, 0.1)), CoulombFriction(1, 1)
    plant.RegisterCollisionGeometry(ball, RigidTransform(), Sphere(0.1), "shell", friction)
    plant.RegisterVisualGeometry(ball, RigidTransform(), Sphere(0.1), "look", [0.2, 0.4, 0.9, 0.4])
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", friction)
    plant.Finalize()
    plant.SetDefaultFloatingBaseBodyPose(ball, RigidTransform([0.2, 0.0, 0.15]))
    MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    params = ContactVisualizerParams(newtons_per_meter=50, radius=0.01)
    ContactVisualizer.AddToBuilder(builder, plant, meshcat, params)
    return Simulator(builder.Build())


def visible(page, name):
    return page.evaluate(f"!!window.__viserMutable.nodeRefFromName[{name!r}].visible")


def test_the_arrow_of_the_weight_live_and_in_the_replay(chromium, tmp_path, pictures):
    meshcat = Meshcat(port=0)
    simulator = simulator_of(meshcat)
    page = chromium.open(meshcat.web_url())
    page.wait_for(READY)
    meshcat.StartRecording()
    simulator.AdvanceTo(1.0)
    page.wait_until_at(f"{ARROW}/head", [0.2, 0.0, TIP], 1e-3)
    page.wait_until_at(f"{ARROW}/tail", [0.2, 0.0, -TIP], 1e-3)
    until(lambda: visible(page, ARROW))
    page.screenshot(pictures, "contact-arrow.png")
    meshcat.PublishRecording()
    file = tmp_path / "arrow.html"
    file.write_text(meshcat.StaticHtml(), encoding="utf-8")
    replay = chromium.open(file.as_uri())
    replay.wait_for(READY)
    replay.wait_until_at(f"{ARROW}/head", [0.2, 0.0, TIP], 1e-3)
    assert page.console() == replay.console() == []
