"""SDFormat: `<model>` and `<world>` elements to model descriptions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .._files.xml import Element
from .._model.check import check_model
from .._model.description import BodyDescription, FrameDescription, FrameReference, JointDescription, ModelDescription
from .._reading.reading import Reading
from .extensions import read_extensions
from .frames import MODEL_FRAME, SdfScope, read_pose, reference_of_pose
from .gearbox import make_couplers, read_gearbox
from .geometry import read_collision, read_visual, without_drake_prefix
from .inertial import read_inertial
from .joints import drop_impossible_couplers, read_drake_joint, read_joint
from .prepare import PreparedModel, gather, prepare_model, read_version
from .specification import refuse_undefined, refuse_undefined_attribute

if TYPE_CHECKING:
    from sheldrake.math import RigidTransform

_LINK_TAGS = ("pose", "inertial", "gravity", "visual", "collision", "drake:visual", "drake:surface_velocity_axis")


def read_sdf(root: Element, reading: Reading, model_name: str = "") -> list[ModelDescription]:
    """The models that an SDFormat document describes; a world is one description of its own kind.

    Args:
        root: The document's root, which must be `<sdf>`.
        reading: Its surroundings.
        model_name: Used instead of the name of the document's only model when not empty.

    Raises:
        ParseError: When the document is not usable SDFormat.
    """
    reading.loose_numbers = True
    reading.refuse_undefined = refuse_undefined
    reading.refuse_undefined_attribute = refuse_undefined_attribute
    version = read_version(root, reading)
    reading.warn_unknown(root, ("model", "world"), ("version",))
    worlds, models = root.find_all("world"), root.find_all("model")
    if len(worlds) > 1 or (worlds and models) or not (worlds or models):
        reading.fail(root, f"An SDFormat file has one <world> or <model>; found {len(worlds)} and {len(models)}.")
    if worlds:
        return [_read_world(worlds[0], reading, version)]
    if len(models) > 1:
        reading.warn(models[1], "Several models in one file need a <world> around them; they are read all the same.")
    result = []
    for element in models:
        name = model_name if len(models) == 1 else ""
        prepared = prepare_model(element, reading, version, name)
        pose = element.find("pose")
        X_WM = read_pose(pose, reading)
        if reference_of_pose(pose) not in ("", "world"):
            reading.fail(
                pose or element, f"Model '{prepared.name}' stands alone: its pose cannot be relative to anything."
            )
        placement = element.get("placement_frame")
        if placement:
            X_WM = X_WM @ prepared.scope.pose(placement, element.where).inverse()
        description = _describe(prepared, X_WM)
        check_model(description, reading.policy, may_loop=True)
        result.append(description)
    return result


def _read_world(element: Element, reading: Reading, version: tuple[int, int]) -> ModelDescription:
    from sheldrake.math import RigidTransform

    name = reading.name(element, "<world>")
    reading.warn_unknown(element, ("model", "include", "frame", "joint", "gravity"), ("name",))
    gravity = element.find("gravity")
    if gravity is not None:
        reading.warn(gravity, "The <gravity> of a world is ignored; set it with plant.gravity_field().")
    scope = SdfScope(name, element.where, reading, is_world=True)
    world = PreparedModel(element, name, reading, version, scope, is_static=False)
    gather(world)
    description = ModelDescription(element.where, name, is_world=True)
    X_WW = RigidTransform()
    _describe_nested(world, X_WW, description)
    _describe_frames(world, description)
    _describe_joints(world, X_WW, description)
    check_model(description, reading.policy, may_loop=True)
    return description


def _describe(model: PreparedModel, X_WM: RigidTransform) -> ModelDescription:
    """The description of a model placed at X_WM."""
    reading, scope = model.reading, model.scope
    description = ModelDescription(model.element.where, model.name)
    _describe_nested(model, X_WM, description)
    for element in model.elements:
        if element.tag == "link":
            _describe_link(element, model, X_WM, description)
    path, link = scope.body(MODEL_FRAME, model.element.where)
    X_LM = scope.pose_of_body(path, link, model.element.where).inverse()
    description.elements.append(
        FrameDescription(model.element.where, MODEL_FRAME, FrameReference(link, path), X_LM, is_of_model=True)
    )
    _describe_joints(model, X_WM, description)
    _describe_frames(model, description)
    for element in model.elements:
        if element.tag == "drake:joint":
            read_drake_joint(element, description, scope, X_WM, reading)
    make_couplers(description, scope, reading)
    drop_impossible_couplers(description, reading)
    read_extensions(model, description)
    if model.is_static:
        _weld_to_world(model, X_WM, description)
    return description


def _describe_nested(model: PreparedModel, X_WM: RigidTransform, description: ModelDescription) -> None:
    for place, inner in model.nested:
        X_WN = X_WM @ model.scope.pose(place.name, place.where)
        if isinstance(inner, PreparedModel):
            description.nested.append(_describe(inner, X_WN))
        else:
            for body in inner.bodies:
                body.default_pose = X_WN @ place.scope.pose(body.name, place.where) if not body.is_world else None
            base = FrameReference(place.scope.canonical_link)
            X_LM = place.scope.pose(place.scope.canonical_link, place.where).inverse()
            inner.elements.append(FrameDescription(place.where, MODEL_FRAME, base, X_LM, is_of_model=True))
            inner.comes_first = True
            description.nested.append(inner)


def _describe_link(element: Element, model: PreparedModel, X_WM: RigidTransform, description: ModelDescription) -> None:
    reading, scope = model.reading, model.scope
    name = element.get("name")
    if element.find("drake:deformable_properties") is not None:
        raise NotImplementedError(f"{element.where}: deformable bodies are not implemented.")
    reading.warn_unknown(element, _LINK_TAGS, ("name",))
    gravity = element.find("gravity")
    if gravity is not None and not reading.parse_bool(gravity.text, gravity.where, "<gravity>"):
        reading.warn(gravity, f"Link '{name}': gravity cannot be switched off for one link; <gravity> is ignored.")
    body = BodyDescription(element.where, name, default_pose=X_WM @ scope.pose(name, element.where))
    body.M_BBo_B = read_inertial(element, name, scope, reading)
    axis = element.find("drake:surface_velocity_axis")
    if axis is not None:
        body.surface_velocity_axis = reading.parse_vector(axis.text, 3, axis.where, "<drake:surface_velocity_axis>")
    if not reading.wants_geometry:
        reading.pass_over(*element.find_all("visual", "drake:visual", "collision"))
    else:
        for child in element:
            if child.tag == "visual":
                read_visual(child, body, scope, reading)
            elif child.tag == "drake:visual":
                read_visual(without_drake_prefix(child), body, scope, reading)
        for child in element.find_all("collision"):
            read_collision(child, body, scope, reading)
    description.bodies.append(body)


def _describe_joints(model: PreparedModel, X_WM: RigidTransform, description: ModelDescription) -> None:
    for element in model.elements:
        if element.tag == "joint" and element.get("type") == "gearbox":
            read_gearbox(element, description, model.scope, model.version, model.reading)
        elif element.tag == "joint":
            read_joint(element, description, model.scope, X_WM, model.is_static, model.version, model.reading)
    if description.is_world:
        make_couplers(description, model.scope, model.reading)
        drop_impossible_couplers(description, model.reading)


def _describe_frames(model: PreparedModel, description: ModelDescription) -> None:
    scope = model.scope
    for element in model.elements:
        if element.tag != "frame":
            continue
        name = element.get("name")
        path, link = scope.body(name, element.where)
        X_MF = scope.pose(name, element.where)
        X_BF = scope.pose_of_body(path, link, element.where).inverse() @ X_MF
        base = FrameReference(link, path, is_world=link == "world" and not path)
        is_of_model = scope.is_fixed_to_model_frame(name) and not scope.is_world
        description.elements.append(FrameDescription(element.where, name, base, X_BF, is_of_model))


def _weld_to_world(model: PreparedModel, X_WM: RigidTransform, description: ModelDescription) -> None:
    """Welds to the world what no fixed joint of a static model holds yet."""
    held = {joint.child.name for joint in description.joints() if not joint.child.scope}
    for body in description.bodies:
        if body.name in held:
            continue
        joint = JointDescription(
            body.where,
            f"sdformat_model_static_world_welds_to_{body.name}",
            "weld",
            FrameReference("world", is_world=True),
            FrameReference(body.name),
        )
        joint.X_FM = X_WM @ model.scope.pose(body.name, body.where)
        description.elements.append(joint)
