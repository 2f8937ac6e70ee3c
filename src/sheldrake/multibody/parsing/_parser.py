"""Parser: model files into a plant.

Reads a file into a description (`_urdf`, `_sdf`, `_mjcf` into `_model`) and, when there was no mistake in it, builds
the plant (`_build`).
"""

import os
import warnings
from contextlib import AbstractContextManager
from dataclasses import replace

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import instance_of, text
from sheldrake.common._overloads import overload, overloaded
from sheldrake.common.deprecation import DrakeDeprecationWarning
from sheldrake.geometry import SceneGraph
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.plant._parts import parts_of
from sheldrake.multibody.plant._saved_model import all_or_nothing
from sheldrake.multibody.tree import ModelInstanceIndex
from sheldrake.systems.framework import DiagramBuilder

from ._build import ModelBuilder
from ._collision_filter_groups import CollisionFilterGroups, FilterGroupCollector
from ._files.diagnostics import DiagnosticPolicy, Location, ParseError
from ._files.package_map import PackageMap, resolve_uri
from ._model.description import FilterGroupDescription, ModelDescription
from ._reading.reading import Reading
from ._reading.remembered import read_or_remember

_PLANT = instance_of(MultibodyPlant)
_SCENE = (instance_of(SceneGraph), None)
_FORMATS = (".urdf", ".sdf", ".xml", ".dmd.yaml", ".obj")
_FROM_CAD = (".stl", ".3mf", ".ply", ".dae", ".gltf", ".glb")


class Parser:
    """Reads robot descriptions into a MultibodyPlant, and their shapes into the SceneGraph it is registered with.

    The format follows from the file name: `.urdf`, `.sdf`, `.xml` (MJCF), `.dmd.yaml` (model directives), `.obj` (one
    body made of a mesh). A file that cannot be used raises RuntimeError (`ParseError`) with file, line and column, and
    leaves the plant as it was; odd but usable content gives a warning through `diagnostic_policy()`.

    Args:
        plant: The plant to add to; models can be added until it is finalized.
        scene_graph: Registered with the plant when it is not yet.
        model_name_prefix: Put before the names of all models, as `prefix::name`.
        builder: A DiagramBuilder with systems called `plant` and, optionally, `scene_graph`, used when these are not
            given.
    """

    @overloaded(
        overload(plant=_PLANT, scene_graph=_SCENE, model_name_prefix=(text, "")),
        overload(lambda self, plant, prefix: self._set_up(plant, None, prefix), plant=_PLANT, model_name_prefix=text),
        overload(
            lambda self, builder, *rest: self._set_up_in(builder, *rest),
            builder=instance_of(DiagramBuilder),
            plant=(_PLANT, None),
            scene_graph=_SCENE,
            model_name_prefix=(text, ""),
        ),
    )
    def __init__(self, plant, scene_graph, prefix) -> None:
        self._set_up(plant, scene_graph, prefix)

    def _set_up_in(self, builder, plant, scene_graph, prefix: str) -> None:
        if plant is None:
            plant = _find_system(builder, "plant")
        if scene_graph is None and builder.HasSubsystemNamed("scene_graph"):
            scene_graph = _find_system(builder, "scene_graph")
        self._set_up(plant, scene_graph, prefix, builder)

    def _set_up(self, plant, scene_graph, prefix: str, builder=None) -> None:
        if scene_graph is not None and not plant.geometry_source_is_registered():
            plant.RegisterAsSourceForSceneGraph(scene_graph)
        self._plant = plant
        self._scene_graph = scene_graph if scene_graph is not None else _find_scene_graph(plant)
        self._builder = builder
        self._prefix = prefix
        self._packages = PackageMap()
        self._policy = DiagnosticPolicy()
        self._auto_renaming = self._joint_friction = False
        self._filters = FilterGroupCollector(plant)

    def plant(self):
        """The plant that is added to."""
        return self._plant

    def scene_graph(self):
        """The scene graph that is added to, or None."""
        return self._scene_graph

    def builder(self):
        """The diagram builder given at construction, or None."""
        return self._builder

    def package_map(self) -> PackageMap:
        """Where `package://` and `model://` addresses lead; change it to add packages."""
        return self._packages

    def diagnostic_policy(self) -> DiagnosticPolicy:
        """What is done with warnings and errors; change it to collect them."""
        return self._policy

    @checked
    def SetAutoRenaming(self, value: bool) -> None:
        """When true, a model whose name is taken becomes `name_1`, `name_2`...; otherwise that is an error."""
        self._auto_renaming = bool(value)

    def GetAutoRenaming(self) -> bool:
        """Whether models whose name is taken are renamed."""
        return self._auto_renaming

    def SetUseJointFriction(self, value: bool) -> None:
        """When true, `<dynamics friction="...">` of a URDF joint becomes dry friction; otherwise, as in Drake, it is
        ignored with a warning. See `Joint.set_dry_friction`.
        """  # fmt: skip
        self._joint_friction = bool(value)

    def SetStrictParsing(self) -> None:
        """Makes every warning an error from now on."""
        self._policy.warnings_are_errors = True

    def GetCollisionFilterGroups(self) -> CollisionFilterGroups:
        """The collision filter groups of everything parsed so far."""
        return self._filters.report()

    def collision_filter_groups(self) -> CollisionFilterGroups:
        """The same as `GetCollisionFilterGroups`."""
        return self.GetCollisionFilterGroups()

    def AddModels(
        self,
        file_name: str | os.PathLike[str] | None = None,
        *,
        url: str | None = None,
        file_contents: str | None = None,
        file_type: str | None = None,
    ) -> list[ModelInstanceIndex]:
        """Adds all models of a file, an address, or a text.

        Call it as `AddModels(file_name)`, `AddModels(url="package://...")` or
        `AddModels(file_contents="...", file_type="urdf")`.

        Returns:
            The ModelInstanceIndex of every model added, outer models before the models nested in them.

        Raises:
            RuntimeError: When the file cannot be used; the plant and its geometry are as before then.
        """
        given = [value is not None for value in (file_name, url, file_contents)]
        if sum(given) != 1 or (file_contents is None) != (file_type is None):
            raise TypeError(
                "Parser.AddModels() takes file_name, or url=, or file_contents= together with file_type=; "
                f"got file_name={file_name!r}, url={url!r}, file_type={file_type!r}."
            )
        if url is not None:
            return self.AddModelsFromUrl(url)
        if file_contents is not None and file_type is not None:
            return self.AddModelsFromString(file_contents, file_type)
        assert file_name is not None
        return self._add_file(os.fspath(file_name))

    @checked
    def AddModelsFromUrl(self, url: str) -> list[ModelInstanceIndex]:
        """Adds all models of the file behind a `package://`, `model://` or `file://` address."""
        where = Location("AddModelsFromUrl()")
        return self._add_file(resolve_uri(url, self._packages, None, where, self._policy))

    @checked
    def AddModelsFromString(self, file_contents: str, file_type: str) -> list[ModelInstanceIndex]:
        """Adds all models of a text; `file_type` is a file name ending without the dot, such as `urdf`."""
        source = f"<literal-string>.{file_type}"
        kind = self._kind_of(source)
        if kind == ".obj":
            self._policy.Error(Location(source), "A mesh cannot be given as a string; use a file.")
        reading = Reading(self._policy, self._packages, source, None, self._wants_geometry())
        reading.joint_friction = self._joint_friction
        return self._add(kind, reading, file_contents)

    def AddModelFromFile(self, file_name, model_name: str = ""):
        """Retired: `AddModels(file_name)[0]`."""
        _hint("AddModelFromFile", "AddModels(file_name)[0]")
        return self._only(self._add_file(os.fspath(file_name), model_name), "AddModelFromFile()")

    def AddModelFromString(self, file_contents: str, file_type: str, model_name: str = ""):
        """Retired: `AddModelsFromString(file_contents, file_type)[0]`."""
        _hint("AddModelFromString", "AddModelsFromString(file_contents, file_type)[0]")
        source = f"<literal-string>.{file_type}"
        reading = Reading(self._policy, self._packages, source, None, self._wants_geometry())
        reading.joint_friction = self._joint_friction
        return self._only(self._add(self._kind_of(source), reading, file_contents, model_name), "AddModelFromString()")

    def AddAllModelsFromFile(self, file_name) -> list:
        """Retired: `AddModels(file_name)`."""
        _hint("AddAllModelsFromFile", "AddModels(file_name)")
        return self._add_file(os.fspath(file_name))

    def _only(self, instances: list, call: str):
        if not instances:
            raise RuntimeError(f"Parser.{call}: the input has no model.")
        return instances[0]

    def _wants_geometry(self) -> bool:
        return self._plant.geometry_source_is_registered()

    def _kind_of(self, name: str) -> str:
        kind = next((ending for ending in _FORMATS if name.lower().endswith(ending)), None)
        if kind is None:
            known = ", ".join(_FORMATS)
            hint = ""
            if name.lower().endswith(_FROM_CAD):
                hint = f" A mesh has neither mass nor units: `sheldrake mesh2urdf {name}` makes a model of it."
            elif name.lower().endswith((".step", ".stp")):
                hint = " Export the part as STL from your CAD program; `sheldrake mesh2urdf` makes a model of that."
            self._policy.Error(Location(name), f"The file type is not recognized; the known endings are {known}.{hint}")
        return kind

    def _add_file(self, path: str, model_name: str = "") -> list:
        if not os.path.isfile(path):
            odd = "is a folder" if os.path.isdir(path) else "is no regular file"
            problem = odd if os.path.exists(path) else "does not exist"
            self._policy.Error(Location(path), f"The file {problem} (working folder: '{os.getcwd()}').")
        return self._add(self._kind_of(path), self._reading_of(path), None, model_name)

    def _reading_of(self, path: str) -> Reading:
        path = os.path.abspath(path)
        folder, geometry = os.path.dirname(path), self._wants_geometry()
        reading = Reading(self._policy, self._packages, path, folder, geometry, (os.path.realpath(path),))
        reading.joint_friction = self._joint_friction
        return reading

    def _add(self, kind: str, reading: Reading, text: "str | None", model_name: str = "") -> list:
        """Reads everything first, then adds it to the plant, which is as before if that fails."""
        if self._plant.is_finalized():
            raise RuntimeError("Parser: the plant was finalized; add models before Finalize().")
        reading.num_bodies, reading.num_actuators = self._plant.num_bodies(), self._plant.num_actuators()
        with self.all_or_nothing():
            if kind == ".dmd.yaml":
                instances = self._add_directives(reading, text)
            else:
                instances = self._build(read_or_remember(kind, reading, text, model_name, read_models), self._prefix)
            self.finish_filters()
        return instances

    def all_or_nothing(self) -> AbstractContextManager:
        """A block after which, if it raises, plant, geometry and filter groups are as they were."""
        return all_or_nothing(self._plant, self._filters)

    def _add_directives(self, reading: Reading, text: "str | None") -> list:
        """Carries out model directives; the prefix is the namespace of all their names."""
        from ._directives.directives import load_directives_file, parse_directives
        from ._directives.process import DirectivesProcessor

        if text is None:
            directives = load_directives_file(reading.source, self._policy)
        else:
            directives = parse_directives(text, reading.source, self._policy)
        processor = DirectivesProcessor(self)
        processor.process(directives, self._prefix, Location(reading.source))
        return processor.instances

    def add_one_model(self, path: str, model_name: str, namespace: str) -> list:
        """Adds a file that must describe one model, under another name; for model directives.

        Raises:
            ParseError: When the file describes several models. (A world may have one.)
        """
        kind = self._kind_of(path)
        if kind == ".dmd.yaml":
            self._policy.Error(Location(path), "add_model takes a model file; use add_directives for this one.")
        reading = self._reading_of(path)
        reading.num_bodies, reading.num_actuators = self._plant.num_bodies(), self._plant.num_actuators()
        models = read_or_remember(kind, reading, None, model_name, read_models)
        if len(models) == 1 and models[0].is_world and len(models[0].nested) == 1:
            (world,) = models
            models = [replace(world.nested[0], name=model_name, comes_first=False)]
            if world.elements:
                self._policy.Warning(world.where, "add_model takes the model of a <world>, without what is beside it.")
        if len(models) != 1 or models[0].is_world:
            self._policy.Error(Location(path), "add_model needs a file with exactly one model.")
        return self._build(models, namespace)

    def add_filter_group(self, group: FilterGroupDescription, namespace: str) -> None:
        """Adds a collision filter group; for model directives."""
        self._filters.add(group, namespace, self._policy)

    def finish_filters(self) -> None:
        """Declares the collision filters of the groups added so far to the scene graph."""
        self._filters.finish(self._scene_graph, self._policy)

    def _build(self, models: "list[ModelDescription]", prefix: str) -> list:
        builder = ModelBuilder(self._plant, self._policy, self._filters, self._auto_renaming)
        instances = []
        for model in models:
            instances += builder.add(model, prefix)
        return instances


def _hint(retired: str, today: str) -> None:
    warnings.warn(f"Parser.{retired}() is retired: use {today}.", DrakeDeprecationWarning, stacklevel=3)


def read_models(kind: str, reading: Reading, text: "str | None", model_name: str = "") -> "list[ModelDescription]":
    """The models of one file or text; whatever is wrong with it is a ParseError that names it."""
    try:
        models = _read(kind, reading, text, model_name)
    except ParseError:
        raise
    except RecursionError:
        reading.policy.Error(Location(reading.source), "Elements refer to each other, or are nested, too deeply.")
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        reading.policy.Error(Location(reading.source), f"Numbers are too large to calculate with: {error}.")
    except RuntimeError as error:  # of which no pose or inertia can be made
        reading.policy.Error(Location(reading.source), str(error))
    reading.warn_unchecked()
    return models


def _read(kind: str, reading: Reading, text: "str | None", model_name: str) -> "list[ModelDescription]":
    if kind == ".urdf":
        from ._urdf.robot import read_urdf

        return [read_urdf(reading.open_document(text), reading, model_name)]
    if kind == ".sdf":
        from ._sdf.document import read_sdf

        return read_sdf(reading.open_document(text), reading, model_name)
    if kind == ".xml":
        from ._mjcf.document import read_mjcf

        return [read_mjcf(reading.open_document(text), reading, model_name)]
    from ._mesh_model import read_mesh_model

    return [read_mesh_model(reading, model_name)]


def _find_system(builder, name: str):
    if not builder.HasSubsystemNamed(name):
        names = ", ".join(system.get_name() for system in builder.GetSystems()) or "(none)"
        raise RuntimeError(f"Parser(builder): the builder has no system named '{name}'; it has {names}.")
    return builder.GetMutableSubsystemByName(name)


def _find_scene_graph(plant):
    """The scene graph a plant is registered with, or None."""
    return parts_of(plant).geometry.scene_graph
