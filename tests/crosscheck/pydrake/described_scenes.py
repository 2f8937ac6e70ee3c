"""What a description is as a scene: `python described_scenes.py LIBRARY OUT FILE...` pickles it, by file.

LIBRARY is "pydrake", or "sheldrake" under pydrake's name. Names and numbers of everything registered, shapes with all
their properties, pairs that may touch, and from a posture near the default: distances, a step, and a fall onto ground.
"""

import builtins
import pathlib
import pickle
import sys

import numpy as np

LIBRARY, OUT, *FILES = sys.argv[1:]
if LIBRARY == "sheldrake":
    import sheldrake.as_pydrake  # noqa: F401

from pydrake.all import (  # noqa: E402
    AddMultibodyPlantSceneGraph,
    BodyIndex,
    CoulombFriction,
    DiagramBuilder,
    FrameIndex,
    HalfSpace,
    ModelInstanceIndex,
    Parser,
    Rgba,
    RigidTransform,
    Role,
    Simulator,
)

TIME_STEP, FALL = 1e-3, 0.1
SIZES = {
    "Box": ("width", "depth", "height"),
    "Sphere": ("radius",),
    "Cylinder": ("radius", "length"),
    "Capsule": ("radius", "length"),
    "Ellipsoid": ("a", "b", "c"),
}


def scene(path, ground):
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, TIME_STEP)
    parser = Parser(plant)
    parser.package_map().Add("parsing", str(pathlib.Path(path).parent))
    parser.AddModels(path)
    if ground:
        friction = CoulombFriction(0.8, 0.7)
        plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", friction)
    plant.Finalize()
    return builder.Build(), plant, scene_graph


def value_of(property):
    value = property.get_value() if hasattr(property, "get_value") else property
    if isinstance(value, CoulombFriction):
        return (value.static_friction(), value.dynamic_friction())
    return (value.r(), value.g(), value.b(), value.a()) if isinstance(value, Rgba) else value


def properties(given):
    if given is None:
        return None
    found = {}
    for group in sorted(given.GetGroupNames()):
        for name, value in sorted(given.GetPropertiesInGroup(group).items()):
            if (group, name) not in (("hydroelastic", "compliance_type"), ("label", "id")):  # no number, no name
                found[group, name] = value_of(value)
    return found


def registered(plant, scene_graph):
    """All that has a name or a number, in order."""
    inspector, found = scene_graph.model_inspector(), {}
    bodies = [plant.get_body(BodyIndex(i)) for i in range(plant.num_bodies())]
    frames = [plant.get_frame(FrameIndex(i)) for i in range(plant.num_frames())]
    instances = range(plant.num_model_instances())
    found["instances"] = [plant.GetModelInstanceName(ModelInstanceIndex(i)) for i in instances]
    found["bodies"] = [body.scoped_name().get_full() for body in bodies]
    found["frames"] = [frame.scoped_name().get_full() for frame in frames]
    found["states"] = plant.GetStateNames()
    found["actuators"] = plant.GetActuatorNames()
    found["geometries"], found["poses"] = [], []
    for body in bodies:
        for geometry in inspector.GetGeometries(plant.GetBodyFrameIdOrThrow(body.index())):
            shape = inspector.GetShape(geometry)
            sizes = tuple(getattr(shape, size)() for size in SIZES.get(type(shape).__name__, ()))
            roles = (inspector.GetProximityProperties(geometry), inspector.GetIllustrationProperties(geometry))
            roles = (*roles, inspector.GetPerceptionProperties(geometry))
            name = inspector.GetName(geometry)
            found["geometries"].append((name, type(shape).__name__, sizes, *map(properties, roles)))
            found["poses"].append(inspector.GetPoseInFrame(geometry).GetAsMatrix34())
    names = {g: name_of(inspector, g) for g in inspector.GetAllGeometryIds(Role.kProximity)}
    found["pairs"] = sorted(sorted((names[a], names[b])) for a, b in inspector.GetCollisionCandidates())
    found["joints"] = [
        (joint.name(), joint.type_name(), joint.frame_on_parent().name(), joint.frame_on_child().name())
        for joint in map(plant.get_joint, plant.GetJointIndices())
    ]
    return found


def name_of(inspector, geometry):
    return f"{inspector.GetName(inspector.GetFrameId(geometry))}/{inspector.GetName(geometry)}"


def put_near_default(plant, context):
    """A posture without symmetry, so that nothing is the deepest of several, and slow motion."""
    rng = np.random.default_rng(5)
    plant.SetPositions(context, plant.GetPositions(context) + 0.05 * rng.normal(size=plant.num_positions()))
    for index in plant.GetFloatingBaseBodies():
        body = plant.get_body(index)
        pose = plant.GetFreeBodyPose(context, body)
        plant.SetFreeBodyPose(context, body, RigidTransform(pose.rotation(), pose.translation() - [0.0, 0.0, 5.0]))
    plant.SetVelocities(context, 0.1 * rng.normal(size=plant.num_velocities()))
    if plant.num_actuated_dofs():
        plant.get_actuation_input_port().FixValue(context, np.zeros(plant.num_actuated_dofs()))


def touching(scene_graph, root):
    """(name, name): depth of each contact."""
    inspector = scene_graph.model_inspector()
    query = scene_graph.get_query_output_port().Eval(scene_graph.GetMyContextFromRoot(root))
    found = query.ComputePointPairPenetration()
    return {(name_of(inspector, pair.id_A), name_of(inspector, pair.id_B)): pair.depth for pair in found}


def lift_onto_ground(plant, context, depths):
    deepest = builtins.max([d for names, d in depths.items() if any("ground" in n for n in names)], default=None)
    for index in plant.GetFloatingBaseBodies() if deepest is not None else ():
        body = plant.get_body(index)
        pose = plant.GetFreeBodyPose(context, body)
        up = [0.0, 0.0, deepest - 1e-4]
        plant.SetFreeBodyPose(context, body, RigidTransform(pose.rotation(), pose.translation() + up))


def numbers(path):
    found = {}
    for ground in (False, True):
        diagram, plant, scene_graph = scene(path, ground)
        root = diagram.CreateDefaultContext()
        context = plant.GetMyMutableContextFromRoot(root)
        put_near_default(plant, context)
        if ground:
            lift_onto_ground(plant, context, touching(scene_graph, root))
        found[f"touching, ground {ground}"] = touching(scene_graph, root)
        simulator = Simulator(diagram, root)
        for end in (TIME_STEP, FALL):
            simulator.AdvanceTo(end)
            found[f"state at {end}, ground {ground}"] = plant.GetPositionsAndVelocities(context).copy()
    return found


def main():
    found = {}
    for path in FILES:
        try:
            _, plant, scene_graph = scene(path, ground=False)
        except (RuntimeError, SystemExit) as error:  # pydrake ends the process where a demand of Drake's fails
            found[path] = str(error)
            continue
        found[path] = registered(plant, scene_graph), numbers(path)
    pathlib.Path(OUT).write_bytes(pickle.dumps(found))


if __name__ == "__main__":
    main()
