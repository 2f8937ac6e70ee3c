"""SDFormat: `<model>` and `<world>` elements to model descriptions."""

import os
import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ._check import check_model
from ._description import (
    BallConstraintDescription,
    BodyDescription,
    BushingDescription,
    FilterGroupDescription,
    FrameDescription,
    FrameReference,
    JointDescription,
    ModelDescription,
    SpringDamperDescription,
    TendonDescription,
)
from ._inertia import make_spatial_inertia
from ._reading import Reading
from ._sdf_frames import MODEL_FRAME, Place, SdfScope, read_pose, reference_of_pose
from ._sdf_geometry import (
    child_number,
    child_text,
    child_vector,
    read_collision,
    read_link_pose,
    read_visual,
    without_drake_prefix,
)
from ._sdf_joints import drop_impossible_couplers, frame_reference, read_drake_joint, read_joint
from ._urdf import check_spring_damper, read_urdf
from ._xml import Element, read_xml

OLDEST, NEWEST = (1, 4), (1, 12)
_EXTENSIONS = (
    "drake:collision_filter_group",
    "drake:linear_bushing_rpy",
    "drake:linear_spring_damper",
    "drake:ball_constraint",
    "drake:tendon_constraint",
)
_MODEL_TAGS = ("static", "include", "model", "frame", "pose", "link", "joint", "drake:joint", *_EXTENSIONS)
_MODEL_ATTRIBUTES = ("name", "canonical_link", "placement_frame")
_LINK_TAGS = ("pose", "inertial", "visual", "collision", "drake:visual")
_SILENT = ("plugin", "allow_auto_disable", "enable_wind", "must_be_base_link", "meta")


@dataclass
class _Model:
    """A model element in preparation: its places are known, its description is not made yet."""

    element: Element
    name: str
    reading: Reading
    version: tuple[int, int]
    scope: SdfScope
    is_static: bool
    elements: list[Element] = field(default_factory=list)  # its children, those of merged includes in their place
    nested: "list[tuple[Place, _Model | ModelDescription]]" = field(default_factory=list)


def read_sdf(root: Element, reading: Reading, model_name: str = "") -> "list[ModelDescription]":
    """The models that an SDFormat document describes; a world is one description of its own kind.

    Args:
        root: The document's root, which must be `<sdf>`.
        reading: Its surroundings.
        model_name: Used instead of the name of the document's only model when not empty.

    Raises:
        ParseError: When the document is not usable SDFormat.
    """
    from sheldrake.math import RigidTransform

    version = _read_version(root, reading)
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
        prepared = _prepare_model(element, reading, version, name)
        pose = element.find("pose")
        X_WM = read_pose(pose, reading)
        if reference_of_pose(pose) not in ("", "world"):
            reading.fail(pose, f"Model '{prepared.name}' stands alone: its pose cannot be relative to anything.")
        placement = element.get("placement_frame")
        if placement:
            X_WM = X_WM @ prepared.scope.pose(placement, element.where).inverse()
        description = _describe(prepared, X_WM if X_WM is not None else RigidTransform())
        check_model(description, reading.policy)
        result.append(description)
    return result


def _read_version(root: Element, reading: Reading) -> "tuple[int, int]":
    if root.tag != "sdf":
        reading.fail(root, f"An SDFormat document has an <sdf> element, found <{root.tag}>.")
    text = root.get("version", "")
    match = re.fullmatch(r"\s*(\d+)\.(\d+)\s*", text)
    if match is None:
        reading.fail(root, f"<sdf> needs the attribute 'version', for example 1.9; found '{text}'.")
    version = int(match.group(1)), int(match.group(2))
    if version > NEWEST:
        reading.fail(root, f"SDFormat {text} is newer than the newest known version, {NEWEST[0]}.{NEWEST[1]}.")
    if version < OLDEST:
        reading.warn(root, f"SDFormat {text} is older than {OLDEST[0]}.{OLDEST[1]} and read as if it were that.")
    return version


def _read_world(element: Element, reading: Reading, version) -> ModelDescription:
    from sheldrake.math import RigidTransform

    name = reading.name(element, "<world>")
    silent = (*_SILENT, "physics", "scene", "light", "gui", "atmosphere", "magnetic_field", "wind", "state", "audio")
    reading.warn_unknown(element, ("model", "include", "frame", "joint", "gravity"), ("name",), (*silent, "road"))
    gravity = child_vector(element, "gravity", 3, reading)
    if gravity is not None and not np.allclose(gravity, (0.0, 0.0, -9.81), atol=0.02):
        reading.warn(element.find("gravity"), "The <gravity> of a world is ignored; set it with plant.gravity_field().")
    scope = SdfScope(name, element.where, reading, is_world=True)
    world = _Model(element, name, reading, version, scope, is_static=False)
    _gather(world)
    description = ModelDescription(element.where, name, is_world=True)
    X_WW = RigidTransform()
    _describe_nested(world, X_WW, description)
    _describe_frames(world, description)
    _describe_joints(world, X_WW, description)
    check_model(description, reading.policy)
    return description


def _prepare_model(element: Element, reading: Reading, version, name: str = "", is_static: bool = False) -> _Model:
    """Reads everything that has a name and a pose."""
    reading.warn_unknown(element, _MODEL_TAGS, _MODEL_ATTRIBUTES, _SILENT)
    name = name or reading.name(element, "<model>")
    static = element.find("static")
    is_static = is_static or (static is not None and reading.parse_bool(static.text, static.where, "<static>"))
    scope = SdfScope(name, element.where, reading)
    model = _Model(element, name, reading, version, scope, is_static)
    _gather(model)
    _choose_canonical_link(model)
    return model


def _gather(model: _Model) -> None:
    for child in model.element:
        if child.tag == "include" and _is_merge(child, model.reading):
            model.elements += _merged_elements(child, model)
        else:
            model.elements.append(child)
    for child in model.elements:
        if child.tag in ("link", "joint", "frame"):
            model.scope.add(_read_place(child, model.reading))
        elif child.tag in ("model", "include"):
            _gather_nested(child, model)


def _read_place(element: Element, reading: Reading) -> Place:
    name = reading.name(element, f"<{element.tag}>")
    pose = element.find("pose")
    place = Place(element.where, element.tag, name, read_pose(pose, reading), reference_of_pose(pose))
    if element.tag == "frame":
        reading.warn_unknown(element, ("pose",), ("name", "attached_to"))
        place.attached_to = element.get("attached_to", "")
    elif element.tag == "joint":
        place.attached_to = child_text(element, "child")
    return place


def _gather_nested(element: Element, model: _Model) -> None:
    """Adds a `<model>` or a plain `<include>` as a nested model."""
    pose = element.find("pose")
    inner: _Model | ModelDescription
    if element.tag == "model":
        inner = _prepare_model(element, model.reading, model.version)
        placement = element.get("placement_frame", "")
    else:
        inner, included_pose, placement = _read_include(element, model)
        pose = pose or included_pose
    scope = inner.scope if isinstance(inner, _Model) else _scope_of_urdf(inner, model.reading)
    place = Place(element.where, "model", inner.name, read_pose(pose, model.reading), reference_of_pose(pose))
    place.scope, place.placement_frame = scope, placement
    model.scope.add(place)
    model.nested.append((place, inner))


def _is_merge(include: Element, reading: Reading) -> bool:
    merge = include.get("merge")
    return merge is not None and reading.parse_bool(merge, include.where_attribute("merge"), "attribute 'merge'")


def _open_include(include: Element, reading: Reading) -> "tuple[str, Reading]":
    """The file of an `<include>`; a folder stands for the newest model its `model.config` names."""
    tags = ("uri", "name", "pose", "static", "placement_frame")
    reading.warn_unknown(include, tags, ("merge",), silent=("plugin",))
    uri = include.find("uri")
    if uri is None or not uri.text.strip():
        reading.fail(include, "An <include> needs a <uri>.")
    path = reading.resolve(uri.text, uri.where)
    if os.path.isdir(path):
        config = os.path.join(path, "model.config")
        if not os.path.isfile(config):
            reading.fail(uri, f"The <include> names the folder '{path}', which has no model.config.")
        files = read_xml(config, reading.policy).find_all("sdf")
        if not files:
            reading.fail(uri, f"'{config}' names no <sdf> file.")
        path = os.path.join(path, max(files, key=_version_key).text.strip())
    return path, reading.inside(path, uri.where)


def _version_key(element: Element) -> "tuple[int, ...]":
    return tuple(int(part) for part in re.findall(r"\d+", element.get("version", "")))


def _included_model(path: str, inner: Reading, include: Element) -> "tuple[Element, tuple[int, int]]":
    root = read_xml(path, inner.policy)
    version = _read_version(root, inner)
    models = root.find_all("model")
    if len(models) != 1:
        inner.fail(include, f"An <include> needs a file with one <model>; '{path}' has {len(models)}.")
    return models[0], version


def _read_include(include: Element, model: _Model) -> "tuple[_Model | ModelDescription, Element | None, str]":
    """The included model, its own `<pose>`, and its placement frame."""
    path, inner = _open_include(include, model.reading)
    name = child_text(include, "name")
    static = include.find("static")
    is_static = static is not None and model.reading.parse_bool(static.text, static.where, "<static>")
    placement = child_text(include, "placement_frame")
    if placement and include.find("pose") is None:
        model.reading.fail(include, "An <include> with a <placement_frame> needs a <pose>.")
    if path.lower().endswith(".urdf"):
        return read_urdf(read_xml(path, inner.policy), inner, name), None, placement
    element, version = _included_model(path, inner, include)
    prepared = _prepare_model(element, inner, version, name, is_static)
    return prepared, element.find("pose"), placement or element.get("placement_frame", "")


def _merged_elements(include: Element, model: _Model) -> "list[Element]":
    """The children of an included model, to stand in the including one; poses stay relative to a proxy frame."""
    path, inner = _open_include(include, model.reading)
    element, version = _included_model(path, inner, include)
    if version < (1, 7):
        inner.warn(include, f"'{path}' is SDFormat {version[0]}.{version[1]}; its axes are read by today's rules.")
    probe = _prepare_model(element, inner, version)
    proxy = f"_merged__{child_text(include, 'name') or probe.name}__model__"
    pose = include.find("pose") or element.find("pose")
    result = [_make_proxy(include, proxy, pose, probe, element)]
    for child in probe.elements:
        if child.tag in ("link", "joint", "frame", "model", "include"):
            result.append(_relative_to_proxy(child, proxy))
        elif child.tag.startswith("drake:"):
            inner.warn(child, f"<{child.tag}> is not taken over by a merging <include>, as in Drake; it is ignored.")
    return result


def _make_proxy(include: Element, proxy: str, pose: "Element | None", probe: _Model, element: Element) -> Element:
    """`<frame>` at the included model's frame, moving with its canonical link."""
    frame = include.renamed("frame")
    frame.attributes = {"name": proxy, "attached_to": probe.scope.canonical_link}
    frame.children = []
    raw = (pose or include).renamed("pose")
    raw.children = []
    if pose is None:
        raw.attributes, raw.text = {}, ""
    placement = child_text(include, "placement_frame") or element.get("placement_frame", "")
    if placement:
        X_MP = probe.scope.pose(placement, include.where)
        X_RM = read_pose(pose, probe.reading) @ X_MP.inverse()
        raw.text = _pose_text(X_RM)
        raw.attributes = {key: value for key, value in raw.attributes.items() if key == "relative_to"}
    if not reference_of_pose(raw):
        raw.attributes["relative_to"] = MODEL_FRAME
    frame.children = [raw]
    return frame


def _pose_text(X) -> str:
    from sheldrake.math import RollPitchYaw

    values = [*X.translation(), *RollPitchYaw(X.rotation()).vector()]
    return " ".join(repr(float(value)) for value in values)


def _relative_to_proxy(element: Element, proxy: str) -> Element:
    """A copy in which everything that was relative to the model frame is relative to the proxy frame."""

    def swap(name: str) -> str:
        return proxy if name == MODEL_FRAME else name

    copy = element.renamed(element.tag)
    pose = element.find("pose")
    by_default = element.tag in ("link", "model") or (element.tag == "frame" and not element.get("attached_to"))
    if pose is None and by_default:
        pose = element.renamed("pose")
        pose.attributes, pose.children, pose.text = {}, [], ""
        copy.children.insert(0, pose)
    for index, child in enumerate(copy.children):
        if child.tag == "pose":
            child = child.renamed("pose")
            name = reference_of_pose(child) or (MODEL_FRAME if by_default else "")
            if name:
                child.attributes["relative_to"] = swap(name)
            copy.children[index] = child
        elif child.tag in ("parent", "child"):
            copy.children[index] = child.renamed(child.tag)
            copy.children[index].text = swap(child.text.strip())
    if element.tag == "frame":
        copy.attributes["attached_to"] = swap(element.get("attached_to") or MODEL_FRAME)
    return copy


def _choose_canonical_link(model: _Model) -> None:
    """The link that the model frame moves with: the named one, or the first, or the first nested model's."""
    name = model.element.get("canonical_link")
    if name:
        model.scope.find(name, model.element.where_attribute("canonical_link"))
        model.scope.canonical_link = name
        return
    links = [place.name for place in model.scope.places.values() if place.kind == "link"]
    if links:
        model.scope.canonical_link = links[0]
        return
    for place, _ in model.nested:
        if place.scope.canonical_link:
            model.scope.canonical_link = f"{place.name}::{place.scope.canonical_link}"
            return
    model.reading.fail(model.element, f"Model '{model.name}' has no link.")


def _scope_of_urdf(description: ModelDescription, reading: Reading) -> SdfScope:
    """The places of an included URDF model, in its zero configuration with roots at the model frame."""
    from sheldrake.math import RigidTransform

    scope = SdfScope(description.name, description.where, reading)
    inboard = {joint.child.name: joint for joint in description.joints()}
    for body in description.bodies:
        if body.is_world:
            continue
        joint = inboard.get(body.name)
        X_RP, relative_to = RigidTransform(), MODEL_FRAME
        if joint is not None and not joint.parent.is_world:
            X_FM = RigidTransform() if joint.X_CM is None else joint.X_CM.inverse()
            X_RP, relative_to = joint.X_PF @ X_FM, joint.parent.name
        scope.add(Place(body.where, "link", body.name, X_RP, relative_to))
        scope.canonical_link = scope.canonical_link or body.name
    for element in description.elements:
        if isinstance(element, FrameDescription):
            scope.add(Place(element.where, "frame", element.name, element.X_PF, "", attached_to=element.base.name))
    return scope


def _describe(model: _Model, X_WM) -> ModelDescription:
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
        FrameDescription(model.element.where, MODEL_FRAME, FrameReference(link, path), X_LM, True)
    )
    _describe_joints(model, X_WM, description)
    _describe_frames(model, description)
    for element in model.elements:
        if element.tag == "drake:joint":
            read_drake_joint(element, description, scope, X_WM, reading)
    drop_impossible_couplers(description, reading)
    for element in model.elements:
        reader = _EXTENSION_READERS.get(element.tag)
        if reader is not None:
            reader(element, description, model)
    if model.is_static:
        _weld_to_world(model, X_WM, description)
    return description


def _describe_nested(model: _Model, X_WM, description: ModelDescription) -> None:
    for place, inner in model.nested:
        X_WN = X_WM @ model.scope.pose(place.name, place.where)
        if isinstance(inner, _Model):
            description.nested.append(_describe(inner, X_WN))
        else:
            for body in inner.bodies:
                body.default_pose = X_WN @ place.scope.pose(body.name, place.where) if not body.is_world else None
            base = FrameReference(place.scope.canonical_link)
            X_LM = place.scope.pose(place.scope.canonical_link, place.where).inverse()
            inner.elements.append(FrameDescription(place.where, MODEL_FRAME, base, X_LM, True))
            inner.comes_first = True
            description.nested.append(inner)


def _describe_link(element: Element, model: _Model, X_WM, description: ModelDescription) -> None:
    reading, scope = model.reading, model.scope
    name = element.get("name")
    if element.find("drake:deformable_properties") is not None:
        raise NotImplementedError(f"{element.where}: deformable bodies are not implemented.")
    reading.warn_unknown(element, _LINK_TAGS, ("name",), ("gravity", *_SILENT))
    gravity = element.find("gravity")
    if gravity is not None and not reading.parse_bool(gravity.text, gravity.where, "<gravity>"):
        reading.warn(gravity, f"Link '{name}': gravity cannot be switched off for one link; <gravity> is ignored.")
    body = BodyDescription(element.where, name, default_pose=X_WM @ scope.pose(name, element.where))
    body.M_BBo_B = _read_inertial(element, name, scope, reading)
    if reading.wants_geometry:
        for child in element:
            if child.tag == "visual":
                read_visual(child, body, scope, reading)
            elif child.tag == "drake:visual":
                read_visual(without_drake_prefix(child), body, scope, reading)
        for child in element.find_all("collision"):
            read_collision(child, body, scope, reading)
    description.bodies.append(body)


def _read_inertial(link: Element, name: str, scope: SdfScope, reading: Reading):
    """M_BBo_B; what the file does not say is 1 kg and 1 kg m^2."""
    from sheldrake.math import RigidTransform

    element = link.find("inertial")
    if element is None:
        return make_spatial_inertia(1.0, RigidTransform(), [1.0] * 3, [0.0] * 3, lambda text: None)
    reading.warn_unknown(element, ("pose", "mass", "inertia"), ("auto",))
    auto = element.get("auto")
    if auto is not None and reading.parse_bool(auto, element.where_attribute("auto"), "attribute 'auto'"):
        raise NotImplementedError(f"{element.where}: <inertial auto='true'> is not implemented.")
    mass = child_number(element, "mass", reading, 1.0)
    inertia = element.find("inertia")
    moments, products = [1.0] * 3, [0.0] * 3
    if inertia is not None:
        tags = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        reading.warn_unknown(inertia, tags)
        moments = [child_number(inertia, tag, reading, 1.0) for tag in tags[:3]]
        products = [child_number(inertia, tag, reading, 0.0) for tag in tags[3:]]
    X_BI = read_link_pose(element, name, scope, reading)
    return make_spatial_inertia(
        mass, X_BI, moments, products, lambda text: reading.warn(element, f"Link '{name}': {text}")
    )


def _describe_joints(model: _Model, X_WM, description: ModelDescription) -> None:
    for element in model.elements:
        if element.tag == "joint":
            read_joint(element, description, model.scope, X_WM, model.is_static, model.version, model.reading)
    if description.is_world:
        drop_impossible_couplers(description, model.reading)


def _describe_frames(model: _Model, description: ModelDescription) -> None:
    scope = model.scope
    for element in model.elements:
        if element.tag != "frame":
            continue
        name = element.get("name")
        path, link = scope.body(name, element.where)
        X_MF = scope.pose(name, element.where)
        X_BF = scope.pose_of_body(path, link, element.where).inverse() @ X_MF
        base = FrameReference(link, path, is_world=link == "world" and not path)
        description.elements.append(FrameDescription(element.where, name, base, X_BF))


def _weld_to_world(model: _Model, X_WM, description: ModelDescription) -> None:
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


def _read_filter_group(element: Element, description: ModelDescription, model: _Model) -> None:
    reading = model.reading
    if not reading.wants_geometry:
        return
    name = reading.name(element, f"<{element.tag}>")
    ignore = element.get("ignore")
    if ignore is not None and reading.parse_bool(ignore, element.where_attribute("ignore"), "attribute 'ignore'"):
        return
    tags = ("drake:member", "drake:member_group", "drake:ignored_collision_filter_group")
    reading.warn_unknown(element, tags, ("name", "ignore"))
    lists = [[child.text.strip() for child in element.find_all(tag)] for tag in tags]
    description.filter_groups.append(FilterGroupDescription(element.where, name, *lists))


def _require(element: Element, tag: str, reading: Reading) -> Element:
    child = element.find(tag)
    if child is None or not child.text.strip():
        reading.fail(element, f"<{element.tag}> needs a <{tag}>.")
    return child


def _frame_of(element: Element, tag: str, model: _Model) -> FrameReference:
    child = _require(element, tag, model.reading)
    return frame_reference(model.scope, child.text.strip(), child)


def _body_of(element: Element, tag: str, model: _Model) -> FrameReference:
    child = _require(element, tag, model.reading)
    name = child.text.strip()
    if name != "world" and model.scope.find(name, child.where)[1].kind != "link":
        model.reading.fail(child, f"<{tag}> names '{name}', which is not a link.")
    return frame_reference(model.scope, name, child)


def _vector(element: Element, tag: str, reading: Reading):
    _require(element, tag, reading)
    return child_vector(element, tag, 3, reading)


def _read_bushing(element: Element, description: ModelDescription, model: _Model) -> None:
    prefix = "drake:bushing_"
    names = ("torque_stiffness", "torque_damping", "force_stiffness", "force_damping")
    model.reading.warn_unknown(element, [prefix + name for name in ("frameA", "frameC", *names)])
    frame_a, frame_c = (_frame_of(element, prefix + name, model) for name in ("frameA", "frameC"))
    constants = [_vector(element, prefix + name, model.reading) for name in names]
    description.elements.append(BushingDescription(element.where, frame_a, frame_c, *constants))


def _read_spring_damper(element: Element, description: ModelDescription, model: _Model) -> None:
    prefix, reading = "drake:linear_spring_damper_", model.reading
    names = ("body_A", "p_AP", "body_B", "p_BQ", "free_length", "stiffness", "damping")
    reading.warn_unknown(element, [prefix + name for name in names])
    values: list[Any] = []
    for name in names:
        _require(element, prefix + name, reading)
        if name.startswith("body"):
            values.append(_body_of(element, prefix + name, model))
        elif name.startswith("p_"):
            values.append(_vector(element, prefix + name, reading))
        else:
            values.append(child_number(element, prefix + name, reading))
    spring = SpringDamperDescription(element.where, *values)
    check_spring_damper(spring, reading)
    description.elements.append(spring)


def _read_ball_constraint(element: Element, description: ModelDescription, model: _Model) -> None:
    prefix, reading = "drake:ball_constraint_", model.reading
    reading.warn_unknown(element, [prefix + name for name in ("body_A", "p_AP", "body_B", "p_BQ")])
    description.elements.append(
        BallConstraintDescription(
            element.where,
            _body_of(element, prefix + "body_A", model),
            _vector(element, prefix + "p_AP", reading),
            _body_of(element, prefix + "body_B", model),
            _vector(element, prefix + "p_BQ", reading),
        )
    )


def _read_tendon(element: Element, description: ModelDescription, model: _Model) -> None:
    prefix, reading = "drake:tendon_constraint_", model.reading
    numbers = ("offset", "lower_limit", "upper_limit", "stiffness", "damping")
    reading.warn_unknown(element, [prefix + name for name in ("joint", *numbers)])
    joints, coefficients = [], []
    for child in element.find_all(prefix + "joint"):
        name, a = reading.name(child, f"<{child.tag}>"), reading.number(child, "a")
        if name not in model.scope.places or model.scope.places[name].kind != "joint" or a is None:
            reading.fail(child, f"<{child.tag}> needs the name of a joint of the model and the attribute 'a'.")
        joints.append(name)
        coefficients.append(a)
    if not joints:
        reading.fail(element, f"<{element.tag}> needs at least one <{prefix}joint>.")
    values = [child_number(element, prefix + name, reading) for name in numbers]
    description.elements.append(TendonDescription(element.where, joints, np.array(coefficients), *values))


_EXTENSION_READERS = {
    "drake:collision_filter_group": _read_filter_group,
    "drake:linear_bushing_rpy": _read_bushing,
    "drake:linear_spring_damper": _read_spring_damper,
    "drake:ball_constraint": _read_ball_constraint,
    "drake:tendon_constraint": _read_tendon,
}
