"""Names that follow model instances, flags of names, and forces for another plant: as in pydrake."""

import importlib

import numpy as np
import pytest

pytest.importorskip("pydrake")

pytestmark = pytest.mark.peer


def both(program):
    """What a program gives with each library, which it gets as a function that imports its modules."""
    return [program(lambda module, n=name: importlib.import_module(f"{n}.{module}")) for name in ("sheldrake", "pydrake")]


def names_in_the_scene(module):
    plant_module, tree, geometry = module("multibody.plant"), module("multibody.tree"), module("geometry")
    builder, X = module("systems.framework").DiagramBuilder(), module("math").RigidTransform()
    plant, scene_graph = plant_module.AddMultibodyPlantSceneGraph(builder, 0.01)
    inertia = tree.SpatialInertia(1.0, [0, 0, 0], tree.UnitInertia(1, 1, 1))
    instance = plant.AddModelInstance("first")
    body, other = plant.AddRigidBody("body", instance, inertia), tree.ModelInstanceIndex(1)
    loose = plant.AddRigidBody("loose", other, inertia)
    for of, name in ((body, "a"), (body, "b::c"), (loose, "a")):
        plant.RegisterCollisionGeometry(of, X, geometry.Sphere(0.1), name, plant_module.CoulombFriction(1, 1))
    plant.RegisterVisualGeometry(body, X, geometry.Sphere(0.1), "seen", [1, 0, 0, 1])
    for name in ("own", "first::own", "firsts::own"):
        instance_of_it = geometry.GeometryInstance(X, geometry.Sphere(0.2), name)
        scene_graph.RegisterGeometry(plant.get_source_id(), plant.GetBodyFrameIdOrThrow(body.index()), instance_of_it)
    inspector = scene_graph.model_inspector()
    found = []
    for index, name in ((instance, "first"), (instance, "second"), (other, "third")):
        plant.RenameModelInstance(index, name)
        found.append([inspector.GetName(i) for i in (*inspector.GetAllFrameIds(), *inspector.GetAllGeometryIds())])
    return found


def test_frames_and_geometries_follow_a_renamed_model_instance():
    ours, theirs = both(names_in_the_scene)
    assert ours == theirs
    assert "second::a" in theirs[1]
