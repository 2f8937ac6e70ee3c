"""Runs in a process of its own: our parser fills pydrake's plant, beside pydrake's parser filling another.

sheldrake's math, geometry and multibody modules are replaced by pydrake's, so that everything a parser decides (names,
order, poses, inertias, limits, properties, filters) is compared on equal objects, and nothing else is.

Reads a JSON list of cases {"path" | "text"+"type", options} on stdin, writes a JSON list of results.
"""

import contextlib
import json
import logging
import sys
import types

import numpy as np
import pydrake.common.eigen_geometry
import pydrake.common.schema
import pydrake.geometry
import pydrake.math
import pydrake.multibody.plant
import pydrake.multibody.tree
import pydrake.trajectories

SUBSTITUTES = {
    "sheldrake.math": pydrake.math,
    "sheldrake.geometry": pydrake.geometry,
    "sheldrake.multibody.tree": pydrake.multibody.tree,
    "sheldrake.multibody.plant": pydrake.multibody.plant,
    "sheldrake.trajectories": pydrake.trajectories,
    "sheldrake.common.schema": pydrake.common.schema,
    "sheldrake.common.eigen_geometry": pydrake.common.eigen_geometry,
}
TABLES = ("sheldrake.multibody.tree._joint_types", "sheldrake.geometry._shape_types")
"""Plain data in the modules replaced; they stay sheldrake's, with pydrake's classes."""


def tables() -> dict[str, types.ModuleType]:
    import importlib

    joints, shapes = map(importlib.import_module, TABLES)
    for row in shapes.SHAPE_TYPES.values():
        theirs = getattr(pydrake.geometry, row.shape.__name__)
        theirs._names = row.shape._names
        object.__setattr__(row, "shape", theirs)
    theirs, ours = pydrake.multibody.tree.Joint, importlib.import_module("sheldrake.multibody.tree").Joint
    known = vars(pydrake.multibody.tree)
    theirs._classes = {kind: known[cls.__name__] for kind, cls in ours._classes.items() if cls.__name__ in known}
    theirs._type = property(lambda joint: joints.JOINT_TYPES[joint.type_name()])
    return {joints.__name__: joints, shapes.__name__: shapes}


def substitute() -> None:
    import importlib

    kept = tables()
    for name in [name for name in sys.modules if name.partition(".")[0] == "sheldrake"]:
        del sys.modules[name]
    sys.modules.update(kept)
    for name, module in SUBSTITUTES.items():
        parent, _, child = name.rpartition(".")
        sys.modules[name] = module
        setattr(importlib.import_module(parent), child, module)
    sys.modules["sheldrake.geometry._meshes.mesh_files"] = types.SimpleNamespace(SUPPORTED=(".obj", ".gltf", ".vtk"))
    sys.modules["sheldrake.geometry._mass_properties"] = types.SimpleNamespace(mass_properties=mass_properties)
    # Drake's plant cannot be put back.
    saved = types.SimpleNamespace(all_or_nothing=lambda plant, *others: contextlib.nullcontext())
    sys.modules["sheldrake.multibody.plant._saved_model"] = saved
    parts = types.SimpleNamespace(geometry=types.SimpleNamespace(scene_graph=None))
    sys.modules["sheldrake.multibody.plant._parts"] = types.SimpleNamespace(parts_of=lambda plant: parts)
    forget_what_was_made()


def forget_what_was_made() -> None:
    """Descriptions keep joints and shapes for the next plant, which Drake's plants cannot take."""
    from sheldrake.multibody.parsing._model import description

    pydrake.multibody.tree.Joint._model = lambda joint: types.SimpleNamespace(_between=lambda F, M: joint)
    description.JointDescription.model = property(lambda self: None, lambda self, model: None)
    description.BodyDescription.shapes = property(lambda self: None, lambda self, shapes: None)
    building = "sheldrake.multibody.plant._building"
    sys.modules[building] = types.ModuleType(building)
    sys.modules[f"{building}.geometry"] = types.SimpleNamespace(
        BodyShape=lambda *of_shape: of_shape,
        default_visual_roles=lambda: (
            pydrake.geometry.IllustrationProperties(),
            pydrake.geometry.PerceptionProperties(),
        ),
    )


def mass_properties(shape):
    """Volume, centroid, inertia about it for unit density; as in sheldrake.geometry."""
    M = pydrake.multibody.tree.CalcSpatialInertia(shape, 1.0)
    M_cm = M.Shift(M.get_com())
    return M.get_mass(), M.get_com(), M_cm.CalcRotationalInertia().CopyToFullMatrix3()


class Messages(logging.Handler):
    def __init__(self):
        super().__init__()
        self.lines = []

    def emit(self, record):
        self.lines.append(record.getMessage())


def numbers(values):
    return np.asarray(values, dtype=float).tolist()


def describe_shape(shape):
    names = {
        "Box": ["size"],
        "Sphere": ["radius"],
        "Cylinder": ["radius", "length"],
        "Capsule": ["radius", "length"],
        "Ellipsoid": ["a", "b", "c"],
        "HalfSpace": [],
        "Mesh": ["scale3"],
        "Convex": ["scale3"],
    }
    kind = type(shape).__name__
    result = [kind, *(numbers(getattr(shape, name)()) for name in names[kind])]
    if kind in ("Mesh", "Convex"):
        result.append(str(shape.source().path()))
    return result


def describe_value(value):
    try:
        value = value.get_value() if hasattr(value, "get_value") else value
    except RuntimeError:
        return "a type without Python binding"
    if type(value).__name__ == "CoulombFriction":
        return [value.static_friction(), value.dynamic_friction()]
    if type(value).__name__ == "Rgba":
        return numbers(value.rgba)
    return value if isinstance(value, (float, int, bool)) else str(value)


def describe_properties(properties):
    return {
        f"{group}/{name}": describe_value(value)
        for group in sorted(properties.GetGroupNames())
        for name, value in sorted(properties.GetPropertiesInGroup(group).items())
    }


def describe_geometry(inspector):
    from pydrake.geometry import Role

    getters = {
        Role.kProximity: inspector.GetProximityProperties,
        Role.kIllustration: inspector.GetIllustrationProperties,
        Role.kPerception: inspector.GetPerceptionProperties,
    }
    result = []
    for role, get_properties in getters.items():
        for geometry in sorted(inspector.GetAllGeometryIds(role), key=lambda g: g.get_value()):
            result.append(
                [
                    str(role),
                    inspector.GetName(inspector.GetFrameId(geometry)),
                    inspector.GetName(geometry),
                    describe_shape(inspector.GetShape(geometry)),
                    numbers(inspector.GetPoseInFrame(geometry).GetAsMatrix34()),
                    describe_properties(get_properties(geometry)),
                ]
            )
    return result


def describe_joint(joint):
    axis = next(
        (
            getattr(joint, name)()
            for name in ("revolute_axis", "translation_axis", "screw_axis")
            if hasattr(joint, name)
        ),
        [],
    )
    vectors = (
        "position_lower_limits",
        "position_upper_limits",
        "velocity_lower_limits",
        "velocity_upper_limits",
        "acceleration_lower_limits",
        "acceleration_upper_limits",
        "default_positions",
        "default_damping_vector",
    )
    return [
        joint.name(),
        joint.type_name(),
        joint.frame_on_parent().name(),
        joint.parent_body().name(),
        joint.frame_on_child().name(),
        joint.child_body().name(),
        numbers(axis),
        *(numbers(getattr(joint, name)()) for name in vectors),
        joint.screw_pitch() if hasattr(joint, "screw_pitch") else 0.0,
        numbers(joint.X_FM().GetAsMatrix34()) if joint.type_name() == "weld" else [],
    ]


def describe_force(element):
    result = [type(element).__name__]
    for name in dir(element):
        if name in (
            "stiffness",
            "nominal_angle",
            "nominal_position",
            "free_length",
            "damping",
            "p_AP",
            "p_BQ",
            "gravity_vector",
            "force_stiffness_constants",
            "force_damping_constants",
            "torque_stiffness_constants",
            "torque_damping_constants",
        ):
            result.append([name, numbers(getattr(element, name)())])
        elif name in ("joint", "frameA", "frameC", "bodyA", "bodyB"):
            result.append([name, getattr(element, name)().name()])
    return result


def describe(plant, scene_graph):
    from pydrake.multibody.tree import BodyIndex, ForceElementIndex, FrameIndex, ModelInstanceIndex

    def owner(element):
        return plant.GetModelInstanceName(element.model_instance())

    result = {}
    frames = [plant.get_frame(FrameIndex(i)) for i in range(plant.num_frames())]
    result["frames"] = [
        [f.name(), owner(f), f.body().name(), numbers(f.GetFixedPoseInBodyFrame().GetAsMatrix34())] for f in frames
    ]
    plant.Finalize()
    result["models"] = [plant.GetModelInstanceName(ModelInstanceIndex(i)) for i in range(plant.num_model_instances())]
    bodies = [plant.get_body(BodyIndex(i)) for i in range(1, plant.num_bodies())]
    inertias = [body.default_spatial_inertia() for body in bodies]
    result["bodies"] = [
        [b.name(), owner(b), numbers(M.get_mass()), numbers(M.get_com()), numbers(M.CopyToFullMatrix6())]
        for b, M in zip(bodies, inertias)
    ]
    joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
    result["joints"] = [[owner(j), *describe_joint(j)] for j in joints]
    actuators = [plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices()]
    result["actuators"] = [
        [
            a.name(),
            owner(a),
            a.joint().name(),
            a.effort_limit(),
            a.default_rotor_inertia(),
            a.default_gear_ratio(),
            [a.get_controller_gains().p, a.get_controller_gains().d] if a.has_controller() else None,
        ]
        for a in actuators
    ]
    forces = [plant.get_force_element(ForceElementIndex(i)) for i in range(plant.num_force_elements())]
    result["forces"] = [describe_force(element) for element in forces]
    result["constraints"] = plant.num_constraints()
    result["names"] = [*plant.GetPositionNames(), *plant.GetVelocityNames(), *plant.GetActuatorNames()]
    context = plant.CreateDefaultContext()
    result["default_positions"] = numbers(plant.GetPositions(context))
    result["dynamics"] = describe_dynamics(plant, context)
    if scene_graph is not None:
        inspector = scene_graph.model_inspector()
        result["geometry"] = describe_geometry(inspector)
        pairs = [sorted(pair, key=lambda g: g.get_value()) for pair in inspector.GetCollisionCandidates()]
        result["collision_candidates"] = sorted([[inspector.GetName(g) for g in pair] for pair in pairs])
    return result


def describe_dynamics(plant, context):
    """Mass matrix and gravity at three random states."""
    rng = np.random.default_rng(7)
    result = []
    for _ in range(3 if plant.num_velocities() else 0):
        plant.SetPositions(context, rng.normal(size=plant.num_positions()))
        result.append(numbers(plant.CalcMassMatrixViaInverseDynamics(context)))
        result.append(numbers(plant.CalcGravityGeneralizedForces(context)))
    return result


def parse(case, parser_class, messages):
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, DiscreteContactApproximation, MultibodyPlant
    from pydrake.systems.framework import DiagramBuilder

    messages.lines.clear()
    builder = DiagramBuilder()
    time_step = case.get("time_step", 1e-3)
    if case.get("scene", True):
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step)
    else:
        plant, scene_graph = MultibodyPlant(time_step), None
    if case.get("tamsi"):
        plant.set_discrete_contact_approximation(DiscreteContactApproximation.kTamsi)
    options = {"model_name_prefix": case.get("prefix", "")}
    try:
        parser = parser_class(plant=plant, scene_graph=scene_graph, **options)
        parser.SetAutoRenaming(case.get("rename", False))
        if case.get("strict"):
            parser.SetStrictParsing()
        for name, folder in case.get("packages", {}).items():
            parser.package_map().Add(name, folder)
        indices = []
        for _ in range(case.get("times", 1)):
            if "path" in case:
                indices += parser.AddModels(case["path"])
            else:
                indices += parser.AddModelsFromString(case["text"], case["type"])
        result = describe(plant, scene_graph)
        result["returned"] = [int(index) for index in indices]
        groups = parser.GetCollisionFilterGroups()
        result["filter_groups"] = sorted([name, sorted(members)] for name, members in groups.groups().items())
        result["filter_pairs"] = sorted(map(list, groups.exclusion_pairs()))
    except (Exception, SystemExit) as error:
        result = {"error": f"{type(error).__name__}: {error}"}
    result["warnings"] = list(messages.lines)
    return result


def main():
    import pydrake.multibody.parsing

    substitute()
    import sheldrake.multibody.parsing

    messages = Messages()
    log = logging.getLogger("drake")
    log.addHandler(messages)
    log.propagate = False
    log.setLevel(logging.WARNING)
    results = []
    for case in json.load(sys.stdin):
        theirs = parse(case.get("theirs", case), pydrake.multibody.parsing.Parser, messages)
        ours = parse(case, sheldrake.multibody.parsing.Parser, messages)
        results.append([theirs, ours])
    json.dump(results, sys.stdout)


if __name__ == "__main__":
    main()
