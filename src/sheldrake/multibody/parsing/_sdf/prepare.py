"""SDFormat models in preparation: everything with a name and a pose, includes and merged includes in their places."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from .._files.xml import Element
from .._model.description import FrameDescription, ModelDescription
from .._reading.reading import Reading
from .._urdf.robot import read_urdf
from .children import child_text
from .frames import MODEL_FRAME, Place, SdfScope, read_pose, reference_of_pose
from .scoped_names import NAMES_WITHOUT_SCOPES, with_nested_models

if TYPE_CHECKING:
    from sheldrake.math import RigidTransform

OLDEST, NEWEST = (1, 4), (1, 12)
EXTENSION_TAGS = (
    "drake:collision_filter_group",
    "drake:linear_bushing_rpy",
    "drake:linear_spring_damper",
    "drake:ball_constraint",
    "drake:tendon_constraint",
)
_MODEL_TAGS = ("static", "include", "model", "frame", "pose", "link", "joint", "drake:joint", *EXTENSION_TAGS)
_MODEL_ATTRIBUTES = ("name", "canonical_link", "placement_frame")


@dataclass
class PreparedModel:
    """A model element in preparation: its places are known, its description is not made yet."""

    element: Element
    name: str
    reading: Reading
    version: tuple[int, int]
    scope: SdfScope
    is_static: bool
    elements: list[Element] = field(default_factory=list)  # its children, those of merged includes in their place
    nested: list[tuple[Place, PreparedModel | ModelDescription]] = field(default_factory=list)


def read_version(root: Element, reading: Reading) -> tuple[int, int]:
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


def prepare_model(
    element: Element, reading: Reading, version: tuple[int, int], name: str = "", is_static: bool = False
) -> PreparedModel:
    """Reads everything that has a name and a pose."""
    reading.warn_unknown(element, _MODEL_TAGS, _MODEL_ATTRIBUTES)
    name = name or _plain_name(element, reading)
    static = element.find("static")
    is_static = is_static or (static is not None and reading.parse_bool(static.text, static.where, "<static>"))
    scope = SdfScope(name, element.where, reading)
    model = PreparedModel(element, name, reading, version, scope, is_static)
    gather(model)
    _choose_canonical_link(model)
    return model


def _plain_name(element: Element, reading: Reading) -> str:
    name = reading.name(element, f"<{element.tag}>")
    if "::" in name:
        reading.fail(element, f"The name {name!r} of a <{element.tag}> must not contain '::', which separates names.")
    return name


def gather(model: PreparedModel) -> None:
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
    name = _plain_name(element, reading)
    pose = element.find("pose")
    place = Place(element.where, element.tag, name, read_pose(pose, reading), reference_of_pose(pose))
    if element.tag == "frame":
        reading.warn_unknown(element, ("pose",), ("name", "attached_to"))
        place.attached_to = element.get("attached_to", "")
    elif element.tag == "joint":
        place.attached_to = child_text(element, "child")
    return place


def _gather_nested(element: Element, model: PreparedModel) -> None:
    """Adds a `<model>` or a plain `<include>` as a nested model."""
    pose = element.find("pose")
    inner: PreparedModel | ModelDescription
    if element.tag == "model":
        if model.scope.is_world and model.version < NAMES_WITHOUT_SCOPES:
            element = with_nested_models(element)
        inner = prepare_model(element, model.reading, model.version)
        placement = element.get("placement_frame", "")
    else:
        inner, included_pose, placement = _read_include(element, model)
        pose = pose or included_pose
    scope = inner.scope if isinstance(inner, PreparedModel) else _scope_of_urdf(inner, model.reading)
    place = Place(element.where, "model", inner.name, read_pose(pose, model.reading), reference_of_pose(pose))
    place.scope, place.placement_frame = scope, placement
    model.scope.add(place)
    model.nested.append((place, inner))


def _is_merge(include: Element, reading: Reading) -> bool:
    merge = include.get("merge")
    return merge is not None and reading.parse_bool(merge, include.where_attribute("merge"), "attribute 'merge'")


def _open_include(include: Element, reading: Reading) -> tuple[str, Reading]:
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
        files = reading.read_xml(config).find_all("sdf")
        if not files:
            reading.fail(uri, f"'{config}' names no <sdf> file.")
        path = os.path.join(path, max(files, key=_version_key).text.strip())
    return path, reading.inside(path, uri.where)


def _version_key(element: Element) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", element.get("version", "")))


def _included_model(path: str, inner: Reading, include: Element) -> tuple[Element, tuple[int, int]]:
    root = inner.open_document()
    version = read_version(root, inner)
    inner.warn_unknown(root, ("model",), ("version",))
    models = root.find_all("model")
    if len(models) != 1:
        inner.fail(include, f"An <include> needs a file with one <model>; '{path}' has {len(models)}.")
    return models[0], version


def _read_include(
    include: Element, model: PreparedModel
) -> tuple[PreparedModel | ModelDescription, Element | None, str]:
    """The included model, its own `<pose>`, and its placement frame."""
    path, inner = _open_include(include, model.reading)
    name = child_text(include, "name")
    static = include.find("static")
    is_static = static is not None and model.reading.parse_bool(static.text, static.where, "<static>")
    placement = child_text(include, "placement_frame")
    if placement and include.find("pose") is None:
        model.reading.fail(include, "An <include> with a <placement_frame> needs a <pose>.")
    if path.lower().endswith(".urdf"):
        return read_urdf(inner.open_document(), inner, name), None, placement
    element, version = _included_model(path, inner, include)
    prepared = prepare_model(element, inner, version, name, is_static)
    return prepared, element.find("pose"), placement or element.get("placement_frame", "")


def _merged_elements(include: Element, model: PreparedModel) -> list[Element]:
    """The children of an included model, to stand in the including one; poses stay relative to a proxy frame."""
    path, inner = _open_include(include, model.reading)
    element, version = _included_model(path, inner, include)
    if version < (1, 7):
        inner.warn(include, f"'{path}' is SDFormat {version[0]}.{version[1]}; its axes are read by today's rules.")
    probe = prepare_model(element, inner, version)
    proxy = f"_merged__{child_text(include, 'name') or probe.name}__model__"
    pose = include.find("pose") or element.find("pose")
    result = [_make_proxy(include, proxy, pose, probe, element)]
    for child in probe.elements:
        if child.tag in ("link", "joint", "frame", "model", "include"):
            result.append(_relative_to_proxy(child, proxy))
        elif child.tag.startswith("drake:"):
            inner.warn(child, f"<{child.tag}> is not taken over by a merging <include>, as in Drake; it is ignored.")
    return result


def _make_proxy(include: Element, proxy: str, pose: Element | None, probe: PreparedModel, element: Element) -> Element:
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


def _pose_text(X: RigidTransform) -> str:
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


def _choose_canonical_link(model: PreparedModel) -> None:
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
