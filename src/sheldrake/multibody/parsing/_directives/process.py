"""Carries model directives out on a plant.

One after another: files are read by the `Parser` that was given, frames and welds added, defaults set.
"""

import contextlib
import copy
import os

from .._build import unused_name
from .._files.diagnostics import DiagnosticPolicy, Location, ParseError
from .._files.package_map import PackageMap, resolve_uri
from .._model.description import FilterGroupDescription
from .._reading.reading import INCLUDE_COUNT, INCLUDE_DEPTH
from .._scoped_names import GetScopedFrameByName, join_names
from .directives import ModelDirective, ModelDirectives, check_directive, load_directives_file, place_of


class ModelInstanceInfo:
    """A model added by directives: what it is, and the weld that placed it.

    Frame names are without scope; they are empty, and X_PC is the identity, when the model was not welded as a child.
    """

    def __init__(self, model_name: str, model_path: str, model_instance):
        from sheldrake.math import RigidTransform

        self._model_name = model_name
        self._model_path = model_path
        self._model_instance = model_instance
        self._parent_frame_name = ""
        self._child_frame_name = ""
        self._X_PC = RigidTransform()

    @property
    def model_name(self) -> str:
        """The name of the model instance, scoped."""
        return self._model_name

    @property
    def model_path(self) -> str:
        """The file."""
        return self._model_path

    @property
    def model_instance(self):
        """The ModelInstanceIndex."""
        return self._model_instance

    @property
    def parent_frame_name(self) -> str:
        """The parent frame of the weld."""
        return self._parent_frame_name

    @property
    def child_frame_name(self) -> str:
        """The child frame of the weld."""
        return self._child_frame_name

    @property
    def X_PC(self):
        """The pose of the child frame in the parent frame."""
        return self._X_PC

    def note_weld(self, parent: str, child: str, X_PC) -> None:
        """Remembers the weld that placed this model."""
        self._parent_frame_name, self._child_frame_name, self._X_PC = parent, child, X_PC


def FlattenModelDirectives(directives: ModelDirectives, package_map: PackageMap) -> ModelDirectives:
    """The same directives with every `add_directives` replaced by what its file says, names prefixed."""
    return _flatten(directives, package_map, _Inclusions(DiagnosticPolicy()))


def _flatten(directives: ModelDirectives, package_map: PackageMap, inclusions: "_Inclusions") -> ModelDirectives:
    result = ModelDirectives()
    for directive in directives.directives:
        if directive.add_directives is None:
            result.directives.append(_with_namespace(directive, ""))
            continue
        where = Location("FlattenModelDirectives()")
        path = resolve_uri(directive.add_directives.file, package_map, None, where, inclusions.policy)
        with inclusions.opened(path, where) as included:
            inner = _flatten(included, package_map, inclusions)
        namespace = directive.add_directives.model_namespace or ""
        result.directives += [_with_namespace(item, namespace) for item in inner.directives]
    return result


class _Inclusions:
    """Opens directives files that others include, as deep and as many as is sensible."""

    def __init__(self, policy: DiagnosticPolicy):
        self.policy = policy
        self._depth = self._count = 0

    @contextlib.contextmanager
    def opened(self, path: str, where: Location):
        """The directives of a file included at `where`, for as long as they are carried out.

        Raises:
            ParseError: When it is not a directives file, or one file too many.
        """
        self._depth += 1
        self._count += 1
        if self._depth > INCLUDE_DEPTH:
            self.policy.Error(where, f"Directives files include each other deeper than {INCLUDE_DEPTH} levels.")
        if self._count > INCLUDE_COUNT:
            self.policy.Error(where, f"More than {INCLUDE_COUNT} directives files are included.")
        yield load_directives_file(path, self.policy)
        self._depth -= 1


def _with_namespace(directive: ModelDirective, namespace: str) -> ModelDirective:
    """A copy of a directive (not add_directives) whose names are prefixed; a frame's is scoped as its base is."""
    result = copy.deepcopy(directive)
    if (frame := result.add_frame) is not None:
        base = frame.X_PF.base_frame or "world"
        local = frame.name if "::" in frame.name else join_names(base.rpartition("::")[0], frame.name)
        frame.name, frame.X_PF.base_frame = join_names(namespace, local), _prefixed(namespace, base)
    if not namespace:
        return result
    for item in (result.add_model, result.add_model_instance):
        if item is not None:
            item.name = join_names(namespace, item.name)
    if result.add_model is not None:
        for pose in result.add_model.default_free_body_pose.values():
            if pose.base_frame:
                pose.base_frame = _prefixed(namespace, pose.base_frame)
    if result.add_weld is not None:
        result.add_weld.parent = _prefixed(namespace, result.add_weld.parent)
        result.add_weld.child = _prefixed(namespace, result.add_weld.child)
    if result.add_collision_filter_group is not None:
        group = result.add_collision_filter_group
        group.model_namespace = join_names(namespace, group.model_namespace) if group.model_namespace else namespace
    return result


def _prefixed(namespace: str, name: str) -> str:
    """The name in a namespace; `world` is the same everywhere."""
    return name if name == "world" else join_names(namespace, name)


class DirectivesProcessor:
    """Carries out directives one after the other through a parser."""

    def __init__(self, parser):
        self.added: list[ModelInstanceInfo] = []
        self.instances: list = []
        self._parser = parser
        self._plant = parser.plant()
        self._policy = parser.diagnostic_policy()
        self._inclusions = _Inclusions(self._policy)

    def process(self, directives: ModelDirectives, namespace: str, where: Location) -> None:
        """Carries out directives whose names are relative to a namespace (or to none).

        Raises:
            ParseError: When something is wrong; what was added before stays.
        """
        for directive in directives.directives:
            here = place_of(directive, where)
            kind = check_directive(directive, here, self._policy)
            try:
                getattr(self, f"_{kind}")(getattr(directive, kind), namespace, here)
            except (ParseError, NotImplementedError):
                raise
            except (RuntimeError, ValueError, ArithmeticError) as error:
                self._policy.Error(here, f"{kind}: {error}")

    def _add_model(self, model, namespace: str, where: Location) -> None:
        path = resolve_uri(model.file, self._parser.package_map(), None, where, self._policy)
        instances = self._parser.add_one_model(path, model.name, namespace)
        instance = instances[0]
        name = self._plant.GetModelInstanceName(instance)
        for joint_name, positions in model.default_joint_positions.items():
            self._plant.GetJointByName(joint_name, instance).set_default_positions(positions)
        for frame_name, pose in model.default_free_body_pose.items():
            self._set_free_body_pose(frame_name, pose, instance, namespace)
        self.instances += instances
        self.added.append(ModelInstanceInfo(name, path, instance))

    def _set_free_body_pose(self, frame_name: str, pose, instance, namespace: str) -> None:
        """Places a free body; relative to a moving frame it gets a floating joint of its own to that frame."""
        frame = self._frame_to_place(frame_name, instance)
        body = frame.body()
        X_PF = pose.GetDeterministicValue()
        X_BF = frame.GetFixedPoseInBodyFrame()
        X_PB = X_PF @ X_BF.inverse()
        base = pose.base_frame or ""
        if base and base != "world":
            from sheldrake.multibody.tree import QuaternionFloatingJoint

            parent = GetScopedFrameByName(self._plant, _prefixed(namespace, base))
            joint = self._plant.AddJoint(QuaternionFloatingJoint(body.name(), parent, body.body_frame()))
            joint.SetDefaultPose(X_PB)
        else:
            self._plant.SetDefaultFloatingBaseBodyPose(body, X_PB)

    def _frame_to_place(self, frame_name: str, instance):
        if frame_name:
            return self._plant.GetFrameByName(frame_name, instance)
        indices = self._plant.GetBodyIndices(instance)
        if len(indices) != 1:
            raise ValueError(
                f"default_free_body_pose without a body name needs a model with one body; "
                f"'{self._plant.GetModelInstanceName(instance)}' has {len(indices)}."
            )
        return self._plant.get_body(indices[0]).body_frame()

    def _add_model_instance(self, model_instance, namespace: str, where: Location) -> None:
        name = join_names(namespace, model_instance.name)
        if not self._parser.GetAutoRenaming() and self._plant.HasModelInstanceNamed(name):
            self._policy.Error(
                where,
                f"add_model_instance: the plant already has a model instance named '{name}'. Call "
                "parser.SetAutoRenaming(True), or give another name.",
            )
        self._plant.AddModelInstance(unused_name(self._plant, name))

    def _add_frame(self, frame, namespace: str, where: Location) -> None:
        from sheldrake.multibody.tree import FixedOffsetFrame

        parent = GetScopedFrameByName(self._plant, _prefixed(namespace, frame.X_PF.base_frame))
        scope, separator, local = frame.name.rpartition("::")
        instance = parent.model_instance()
        if separator:
            owner = join_names(namespace, scope)
            if not self._plant.HasModelInstanceNamed(owner):
                self._policy.Error(where, f"add_frame '{frame.name}': there is no model instance '{owner}'.")
            instance = self._plant.GetModelInstanceByName(owner)
        X_PF = frame.X_PF.GetDeterministicValue()
        if self._plant.HasFrameNamed(local, instance):
            owner = self._plant.GetModelInstanceName(instance)
            self._policy.Error(where, f"add_frame: model instance '{owner}' already has a frame named '{local}'.")
        self._plant.AddFrame(FixedOffsetFrame(local, parent, X_PF, instance))

    def _add_weld(self, weld, namespace: str, where: Location) -> None:
        from sheldrake.math import RigidTransform

        parent = GetScopedFrameByName(self._plant, _prefixed(namespace, weld.parent))
        child = GetScopedFrameByName(self._plant, _prefixed(namespace, weld.child))
        X_PC = RigidTransform() if weld.X_PC is None else weld.X_PC.GetDeterministicValue()
        self._plant.WeldFrames(parent, child, X_PC)
        for info in self.added:
            if info.model_instance == child.model_instance():
                info.note_weld(parent.name(), child.name(), X_PC)

    def _add_collision_filter_group(self, group, namespace: str, where: Location) -> None:
        if self._parser.scene_graph() is None:
            return
        scope = join_names(namespace, group.model_namespace) if group.model_namespace else namespace
        self._parser.add_filter_group(
            FilterGroupDescription(
                where, group.name, group.members, group.member_groups, group.ignored_collision_filter_groups
            ),
            scope,
        )

    def _add_directives(self, directives, namespace: str, where: Location) -> None:
        path = resolve_uri(directives.file, self._parser.package_map(), None, where, self._policy)
        inner = join_names(namespace, directives.model_namespace) if directives.model_namespace else namespace
        if inner and not self._plant.HasModelInstanceNamed(inner):
            self._policy.Error(where, f"The namespace '{inner}' does not exist as a model instance.")
        with self._inclusions.opened(path, where) as included:
            self.process(included, inner, Location(os.path.abspath(path)))
