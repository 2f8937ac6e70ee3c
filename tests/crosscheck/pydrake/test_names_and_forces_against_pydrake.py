"""Names that follow model instances, flags of names, and forces for another plant: as in pydrake."""

import importlib

import numpy as np
import pytest

pytest.importorskip("pydrake")

pytestmark = pytest.mark.peer


def both(program):
    """What a program gives with each library, which it gets as a function that imports its modules."""
    return [
        program(lambda module, n=name: importlib.import_module(f"{n}.{module}")) for name in ("sheldrake", "pydrake")
    ]


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


def plant_of(module):
    """A finalized plant with a hinged and a free body of two model instances, at a random state."""
    tree = module("multibody.tree")
    plant = module("multibody.plant").MultibodyPlant(0.01)
    inertia = tree.SpatialInertia(1.0, [0, 0, 0], tree.UnitInertia(1, 1, 1))
    hinged = plant.AddRigidBody("hinged", inertia)
    joint = tree.RevoluteJoint("hinge", plant.world_frame(), hinged.body_frame(), [0, 0, 1], damping=0.5)
    plant.AddJointActuator("motor", plant.AddJoint(joint))
    plant.AddRigidBody("free", plant.AddModelInstance("other"), inertia)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetVelocities(context, np.random.default_rng(1).normal(size=plant.num_velocities()))
    return plant, context


CALLS = ("GetPositionNames", "GetVelocityNames", "GetStateNames", "GetActuatorNames")


@pytest.mark.parametrize("call", CALLS)
def test_names_for_all_ways_to_ask(call):
    def program(module):
        plant, _ = plant_of(module)
        index = module("multibody.tree").ModelInstanceIndex
        ways = [((), {}), ((True,), {}), ((False,), {}), ((None,), {}), ((1,), {}), ((index(2),), {}), (("a",), {})]
        ways += [((index(2), True), {}), ((index(1), None), {}), ((), {"model_instance": index(2)}), ((index(9),), {})]
        ways += [((), {"add_model_instance_prefix": flag}) for flag in (None, True, np.bool_(False), "a")]
        ways += [((index(2),), {"add_model_instance_prefix": flag}) for flag in (None, True)]
        ways += [((), {"model_instance": 2}), ((index(2), True, True, True), {}), ((), {"prefix": True})]
        ways += [((True, False), {}), ((index(1), True, None), {}), ((), {"always_add_suffix": None})]
        found = []
        for args, kwargs in ways:
            try:
                found.append(getattr(plant, call)(*args, **kwargs))
            except (TypeError, RuntimeError) as error:
                found.append(type(error).__name__)
        return found

    ours, theirs = both(program)
    assert ours == theirs
    assert "TypeError" in theirs and "RuntimeError" in theirs


def test_forces_for_another_plant_are_refused_and_stay_as_they_are():
    def program(module):
        plant, context = plant_of(module)
        tree, force = module("multibody.tree"), module("multibody.math").SpatialForce(np.arange(6.0))
        joint, body = plant.GetJointByName("hinge"), plant.GetBodyByName("free")
        W = plant.world_frame()
        calls = {
            "damping": lambda forces: joint.AddInDamping(context, forces),
            "one force": lambda forces: joint.AddInOneForce(context, 0, 2.0, forces),
            "in world": lambda forces: body.AddInForceInWorld(context, force, forces),
            "at a point": lambda forces: body.AddInForce(context, [0, 0, 1], force, W, forces),
            "get": lambda forces: body.GetForceInWorld(context, forces),
        }
        found = {}
        for name, call in calls.items():
            for nb, nv in ((3, 7), (1, 1), (3, 1), (3, 8), (4, 7)):
                forces, refused = tree.MultibodyForces(nb, nv), False
                try:
                    call(forces)
                except (RuntimeError, SystemExit):
                    refused = True
                found[name, nb, nv] = refused, forces.generalized_forces().tolist()
        return found

    ours, theirs = both(program)
    assert ours == theirs
    assert sum(refused for refused, *_ in theirs.values()) == 20


@pytest.mark.parametrize("args", [(2,), (2, None), ()])
def test_forces_without_sizes_are_refused(args):
    def program(module):
        with pytest.raises(TypeError):
            module("multibody.tree").MultibodyForces(*args)

    both(program)
