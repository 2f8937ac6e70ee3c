"""What cameras label a body's looks with."""

import pytest

from sheldrake.geometry import (
    GeometryInstance,
    IllustrationProperties,
    PerceptionProperties,
    RenderLabel,
    Role,
    SceneGraph,
    Sphere,
)
from sheldrake.math import RigidTransform
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import SpatialInertia

LOOK = '<visual><geometry><sphere radius="1"/></geometry><material><color rgba="1 0 0 1"/></material></visual>'


@pytest.fixture
def scene():
    plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    return plant, scene_graph.model_inspector()


def label(inspector, geometry_id):
    properties = inspector.GetProperties(geometry_id, Role.kPerception)
    return None if properties is None else properties.GetProperty("label", "id")


def test_looks_of_files_have_the_label_of_their_body(scene):
    plant, inspector = scene
    text = f'<robot name="r"><link name="a">{LOOK}</link><link name="b">{LOOK}</link></robot>'
    Parser(plant).AddModelsFromString(text, "urdf")
    for name in "ab":
        body = plant.GetBodyByName(name)
        (geometry_id,) = plant.GetVisualGeometriesForBody(body)
        assert label(inspector, geometry_id) == RenderLabel(int(body.index()))


def labelled(value):
    properties = PerceptionProperties()
    properties.AddProperty("label", "id", RenderLabel(value))
    return properties


@pytest.mark.parametrize(
    ("illustration", "perception", "expected"),
    [
        (None, None, RenderLabel(1)),
        (None, PerceptionProperties(), RenderLabel(1)),
        (None, labelled(7), RenderLabel(7)),
        (IllustrationProperties(), PerceptionProperties(), RenderLabel(1)),
        (IllustrationProperties(), None, None),  # Cameras do not see what was only given looks.
    ],
)
def test_looks_of_instances(scene, illustration, perception, expected):
    plant, inspector = scene
    body = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    instance = GeometryInstance(RigidTransform(), Sphere(0.1), "look")
    if illustration is not None:
        instance.set_illustration_properties(illustration)
    if perception is not None:
        instance.set_perception_properties(perception)
    found = label(inspector, plant.RegisterVisualGeometry(body, instance))
    assert (found is None) if expected is None else found == expected
