"""Model directives: a YAML list of models to add and how to place them."""

from __future__ import annotations

import functools
import os
import typing
from typing import Any, NoReturn

import numpy as np

from sheldrake.common._files import regular_bytes
from sheldrake.common._options import Options
from sheldrake.common._yaml_schema import optional_of
from sheldrake.common.schema import Rotation, Transform

from .._files.diagnostics import DiagnosticPolicy, Location

MAX_YAML_BYTES = 16 * 1024 * 1024
_LONG = 100_000  # letters of a document that is not kept
_MERGE, _SEQUENCE = "tag:yaml.org,2002:merge", "tag:yaml.org,2002:seq"
MAX_YAML_NODES = 1_000_000  # an alias counts as often as it is used


class AddModel(Options):
    """Adds the model of a file under a name.

    Attributes:
        file: `package://` address of the file.
        name: Name of the model instance.
        default_joint_positions: Positions [rad or m] by joint name.
        default_free_body_pose: Pose by body or frame name; "" is the only body.
    """

    file: str = ""
    name: str = ""
    default_joint_positions: dict[str, np.ndarray] = {}
    default_free_body_pose: dict[str, Transform] = {}


class AddModelInstance(Options):
    """Adds an empty model instance."""

    name: str = ""


class AddFrame(Options):
    """Adds a frame; `X_PF.base_frame` names its parent."""

    name: str = ""
    X_PF: Transform = Transform()


class AddWeld(Options):
    """Welds a child frame to a parent frame, at pose `X_PC` (identity by default)."""

    parent: str = ""
    child: str = ""
    X_PC: Transform | None = None


class AddCollisionFilterGroup(Options):
    """Adds a collision filter group.

    Attributes:
        name: Name of the group, without scope.
        members: Bodies.
        member_groups: Groups whose members are members too.
        model_namespace: The model instance that names are relative to.
        ignored_collision_filter_groups: Groups this one does not collide with; itself for no inner collisions.
    """

    name: str = ""
    members: list[str] = []
    member_groups: list[str] = []
    model_namespace: str | None = None
    ignored_collision_filter_groups: list[str] = []


class AddDirectives(Options):
    """Processes another directives file, with names relative to an existing model instance."""

    file: str = ""
    model_namespace: str | None = None


class ModelDirective(Options):
    """One directive: exactly one of the fields is set."""

    add_model: AddModel | None = None
    add_model_instance: AddModelInstance | None = None
    add_frame: AddFrame | None = None
    add_weld: AddWeld | None = None
    add_collision_filter_group: AddCollisionFilterGroup | None = None
    add_directives: AddDirectives | None = None


class ModelDirectives(Options):
    """A list of directives, in order."""

    directives: list[ModelDirective] = []


# What a directive cannot do without.
_REQUIRED = {
    "add_model": ("file", "name"),
    "add_model_instance": ("name",),
    "add_frame": ("name",),
    "add_weld": ("parent", "child"),
    "add_collision_filter_group": ("name",),
    "add_directives": ("file",),
}


def LoadModelDirectives(filename: str | os.PathLike) -> ModelDirectives:
    """The directives in a YAML file.

    Raises:
        RuntimeError: When the file is not a valid directives file; the message has line and column.
    """
    return load_directives_file(os.fspath(filename), DiagnosticPolicy())


def LoadModelDirectivesFromString(model_directives: str) -> ModelDirectives:
    """The directives in a YAML text.

    Raises:
        RuntimeError: When the text is not a valid directives document; the message has line and column.
    """
    return parse_directives(model_directives, "<literal-string>.dmd.yaml", DiagnosticPolicy())


def load_directives_file(path: str, policy: DiagnosticPolicy) -> ModelDirectives:
    """The directives in a YAML file, with errors reported to `policy`."""
    try:
        if os.path.getsize(path) > MAX_YAML_BYTES:
            policy.Error(Location(path), f"The file is larger than {MAX_YAML_BYTES} bytes; this is refused.")
        text = regular_bytes(path, MAX_YAML_BYTES).decode("utf-8")
    except OSError as error:
        policy.Error(Location(path), f"The file cannot be read: {error.strerror}.")
    except UnicodeDecodeError as error:
        policy.Error(Location(path), f"The file is not UTF-8 text: {error}.")
    return parse_directives(text, path, policy)


def parse_directives(text: str, source: str, policy: DiagnosticPolicy) -> ModelDirectives:
    """The directives in a YAML text called `source`, with errors reported to `policy`."""
    result = _YamlReader(source, policy).read(text)
    for directive in result.directives:
        check_directive(directive, place_of(directive, Location(source)), policy)
    return result


def place_of(directive: ModelDirective, otherwise: Location) -> Location:
    """Where a directive stands in its file; `otherwise` for one that was made in Python."""
    return getattr(directive, "_where", otherwise)


def check_directive(directive: ModelDirective, where: Location, policy: DiagnosticPolicy) -> str:
    """The name of the one field that is set.

    Raises:
        ParseError: When none or several are set, or something necessary is empty.
    """
    given = [field.name for field in directive.__fields__ if getattr(directive, field.name) is not None]
    if len(given) != 1:
        known = ", ".join(field.name for field in directive.__fields__)
        policy.Error(where, f"A directive is exactly one of {known}; found {', '.join(given) or 'none'}.")
    kind = given[0]
    content = getattr(directive, kind)
    for name in _REQUIRED[kind]:
        if not getattr(content, name):
            policy.Error(where, f"{kind}: `{name}` must not be empty.")
    if kind == "add_frame" and not content.X_PF.base_frame:
        policy.Error(where, f"add_frame '{content.name}': `X_PF.base_frame` must not be empty.")
    if kind == "add_weld" and content.X_PC is not None and content.X_PC.base_frame:
        policy.Error(where, "add_weld: `X_PC.base_frame` must not be given; the parent frame is meant.")
    if kind == "add_collision_filter_group" and not (content.members or content.member_groups):
        policy.Error(where, f"add_collision_filter_group '{content.name}': it has no members.")
    return kind


@functools.lru_cache(maxsize=32)
def _document(text: str) -> Any:
    """The node of a YAML document, or None of an empty one; nobody changes it.

    Raises:
        yaml.YAMLError: it is none.
    """
    import yaml

    return yaml.SafeLoader(text).get_single_node()


class _YamlReader:
    """Turns YAML nodes into structs by their declared types; knows line and column of what is wrong."""

    def __init__(self, source: str, policy: DiagnosticPolicy):
        self._source = source
        self._policy = policy
        self._count = 0  # values converted so far
        self._pairs_of: dict[int, dict | None] = {}  # of mappings by id; None while under way

    def read(self, text: str) -> ModelDirectives:
        import yaml

        try:
            node = (_document if len(text) < _LONG else _document.__wrapped__)(text)
            if node is None:
                self._policy.Error(Location(self._source), "The document is empty.")
            return self._convert(node, ModelDirectives, "the document")
        except yaml.MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            where = Location(self._source, mark.line + 1, mark.column + 1) if mark else Location(self._source)
            self._policy.Error(where, f"This is not valid YAML: {error.problem}.")
        except (yaml.YAMLError, RecursionError) as error:
            self._policy.Error(Location(self._source), f"This is not valid YAML: {error}.")

    def _fail(self, node, message: str) -> NoReturn:
        self._policy.Error(Location(self._source, node.start_mark.line + 1, node.start_mark.column + 1), message)

    def _convert(self, node, kind, what: str):
        if (needed := optional_of(kind)) is not None:
            if getattr(node, "value", None) == "" and node.tag.endswith(":null"):
                return None
            kind = needed
        plain = typing.get_origin(kind) or kind
        if plain is str:
            return self._scalar(node, what)
        if plain is np.ndarray:
            return self._vector(node, what)
        if plain is list:
            return [self._convert(item, typing.get_args(kind)[0], what) for item in self._items(node, what)]
        if plain is dict:
            value_kind = typing.get_args(kind)[1]
            return {name: self._convert(value, value_kind, what) for name, value in self._pairs(node, what).items()}
        if plain is Transform:
            return self._transform(node, what)
        return self._struct(node, plain, what)

    def _scalar(self, node, what: str) -> str:
        if not hasattr(node, "value") or not isinstance(node.value, str):
            self._fail(node, f"{what}: expected a text.")
        return node.value

    def _items(self, node, what: str) -> list:
        import yaml

        if not isinstance(node, yaml.SequenceNode):
            self._fail(node, f"{what}: expected a list.")
        self._count_nodes(node)
        return node.value

    def _count_nodes(self, node) -> None:
        """Refuses small documents that stand for large ones."""
        self._count += len(node.value)
        if self._count > MAX_YAML_NODES:
            self._fail(node, f"The document has more than {MAX_YAML_NODES} values, aliases written out.")

    def _pairs(self, node, what: str) -> dict:
        import yaml

        if not isinstance(node, yaml.MappingNode):
            self._fail(node, f"{what}: expected a mapping.")
        own: set[str] = set()
        for key, _ in node.value:
            name = self._scalar(key, what)
            if name in own:
                self._fail(key, f"{what}: the key '{name}' is given twice.")
            own.add(name)
        self._count_nodes(node)
        if id(node) not in self._pairs_of:
            self._pairs_of[id(node)] = None
            self._pairs_of[id(node)] = self._with_merged(node, what)
        result = self._pairs_of[id(node)]
        if result is None:
            self._fail(node, f"{what}: a mapping is merged into itself.")
        return result

    def _with_merged(self, node, what: str) -> dict:
        """The values of a mapping and of those its merge key `<<` names; its own win, then the first of them.

        Each mapping is put together once: that of PyYAML doubles in size with every mapping that is merged twice.
        """
        result = {key.value: value for key, value in node.value if key.tag != _MERGE}
        for key, value in node.value:
            if key.tag == _MERGE:
                for mapping in value.value if value.tag == _SEQUENCE else [value]:
                    result = {**self._pairs(mapping, what), **result}
        return result

    def _struct(self, node, plain, what: str):
        kinds = {field.name: field.type for field in plain.__fields__}
        result = plain()
        where = Location(self._source, node.start_mark.line + 1, node.start_mark.column + 1)
        object.__setattr__(result, "_where", where)
        for name, value in self._pairs(node, what).items():
            if name not in kinds:
                self._fail(value, f"{what}: unknown key '{name}'; the known keys are {', '.join(kinds)}.")
            object.__setattr__(result, name, self._convert(value, kinds[name], name))  # copies have no `_where`
        return result

    def _sure(self, node, tag: str, what: str):
        """What `!Deterministic {value: ...}`, or its vector, says for sure; any other node as it is."""
        if node.tag != tag:
            return node
        fields = self._pairs(node, what)
        if set(fields) != {"value"}:
            self._fail(node, f"{what}: {tag} has the key value, found {tuple(fields) or '(none)'}.")
        return fields["value"]

    def _number(self, node, what: str) -> float:
        text = self._scalar(node, what)
        try:
            value = float(text)
        except ValueError:
            value = np.nan
        if not np.isfinite(value):
            self._fail(node, f"{what}: expected a finite number, found '{text}'.")
        return value

    def _vector(self, node, what: str, size: int | None = None) -> np.ndarray:
        node = self._sure(node, "!DeterministicVector", what)
        if node.tag.startswith("!"):
            self._fail(node, f"{what}: random values ({node.tag}) cannot be used in model directives.")
        items = self._items(node, what)
        if size is not None and len(items) != size:
            self._fail(node, f"{what}: expected {size} numbers, found {len(items)}.")
        return np.array([self._number(item, what) for item in items], dtype=float)

    def _transform(self, node, what: str):
        result = Transform()
        for name, value in self._pairs(node, what).items():
            if name == "base_frame":
                result.base_frame = self._scalar(value, "base_frame")
            elif name == "translation":
                result.translation = self._vector(value, "translation", 3)
            elif name == "rotation":
                result.rotation = self._rotation(value)
            else:
                self._fail(value, f"{what}: unknown key '{name}'; known are base_frame, translation, rotation.")
        return result

    def _rotation(self, node):
        result = Rotation()
        fields = self._pairs(node, "rotation")
        known = {"!Rpy": ("deg",), "!AngleAxis": ("angle_deg", "axis")}.get(node.tag, ())
        if node.tag not in ("!Rpy", "!AngleAxis", "!Identity") and not node.tag.endswith(":map"):
            self._fail(node, f"rotation: unknown tag '{node.tag}'; known are !Identity, !Rpy and !AngleAxis.")
        if not set(fields) <= set(known):
            self._fail(node, f"rotation: expected the keys {known or '(none)'}, found {tuple(fields)}.")
        given = {name: self._vector(fields[name], name, 3) for name in ("deg", "axis") if name in fields}
        if "angle_deg" in fields:
            angle = self._sure(fields["angle_deg"], "!Deterministic", "angle_deg")
            given["angle_deg"] = self._number(angle, "angle_deg")
        if node.tag in ("!Rpy", "!AngleAxis"):
            result.value = getattr(Rotation, node.tag[1:])(**given)
        return result
