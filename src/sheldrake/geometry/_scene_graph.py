"""The system that knows all geometry: who registered it, where it is, what may touch."""

from __future__ import annotations

import copy
from typing import Any

from sheldrake.common.value import AbstractValue
from sheldrake.systems.framework import LeafSystem

from ._collision_filter import CollisionFilterManager
from ._compile import compile_proximity
from ._config import SceneGraphConfig
from ._frame_pose_vector import FramePoseVector, GeometryConfigurationVector
from ._hydro_compile import HydroPairs, compile_hydro
from ._ids import FrameId, GeometryId, SourceId
from ._inspector import SceneGraphInspector
from ._instance import GeometryFrame, GeometryInstance
from ._kernels.model import GeometryModel
from ._properties import GeometryProperties
from ._query_object import QueryObject
from ._records import WORLD_FRAME_ID
from ._render.engine import RenderEngine
from ._render.renderers import Renderers
from ._roles import HydroelasticContactRepresentation, Role, RoleAssign
from ._shapes import Shape
from ._state import GeometryState

_STATE = 0  # abstract parameters
_CONFIG = 1


class SceneGraph(LeafSystem):
    """Nexus of all geometry of a diagram.

    Sources register frames and geometries, and publish the poses of their frames through an input port of their own.
    Whoever wants to know looks at the query port's QueryObject. What is registered belongs to the model, and is copied
    into every context made afterwards; the methods that take a context change that copy only.

    Args:
        config: defaults of proximity properties.
    """

    _generic = True

    def __init__(self, config: SceneGraphConfig | None = None) -> None:
        super().__init__()
        self._model = GeometryState()
        self._config = SceneGraphConfig()
        if config is not None:
            self.set_config(config)
        self._pose_ports: dict[SourceId, int] = {}
        self._with_defaults: tuple[int, GeometryState] | None = None
        self._compiled: dict[int, tuple[GeometryModel, list[GeometryId], list[FrameId]]] = {}
        self._hydro: dict[tuple[int, HydroelasticContactRepresentation], HydroPairs] = {}
        self.DeclareAbstractParameter(AbstractValue.Make(GeometryState()))
        self.DeclareAbstractParameter(AbstractValue.Make(SceneGraphConfig()))
        self.DeclareAbstractOutputPort("query", lambda: AbstractValue.Make(QueryObject()), self._calc_query)

    def _copy(self) -> SceneGraph:
        """For clones and conversions: a copy with a model of its own."""
        new = super()._copy()
        new._model, new._config = self._model.copy(), copy.deepcopy(self._config)
        return new

    # ---- ports

    def get_query_output_port(self) -> Any:
        """The port whose value is a QueryObject."""
        return self.get_output_port(0)

    def get_source_pose_port(self, source_id: SourceId) -> Any:
        """The input port for a source's FramePoseVector.

        Raises:
            RuntimeError: unknown source.
        """
        return self.get_input_port(self._port_of(source_id, "pose"))

    def get_source_configuration_port(self, source_id: SourceId) -> Any:
        """The input port for a source's deformable geometry."""
        return self.get_input_port(self._port_of(source_id, "configuration") + 1)

    def _port_of(self, source_id: SourceId, kind: str) -> int:
        if source_id not in self._pose_ports:
            raise RuntimeError(f"Can't acquire {kind} port for unknown source id: {source_id.get_value()}.")
        return self._pose_ports[source_id]

    def _calc_query(self, context: Any, output: AbstractValue) -> None:
        output.get_mutable_value()._bind(self, context)

    # ---- context

    def _set_default_context(self, context: Any) -> None:
        parameters = context.get_mutable_parameters()
        parameters.get_mutable_abstract_parameter(_STATE).set_value(self._default_state().copy())
        parameters.get_mutable_abstract_parameter(_CONFIG).set_value(copy.deepcopy(self._config))

    def _default_state(self) -> GeometryState:
        """The model with default proximity properties filled in; made again when the model has changed."""
        if self._with_defaults is None or self._with_defaults[0] != self._model.serial:
            state = self._model.copy()
            state.apply_proximity_defaults(self._config.default_proximity_properties)
            self._with_defaults = (self._model.serial, state)
        return self._with_defaults[1]

    def _geometry_state(self, context: Any) -> GeometryState:
        """What a context knows."""
        return context.get_abstract_parameter(_STATE).get_value()

    def _mutable_state(self, context: Any | None) -> GeometryState:
        if context is None:
            return self._model
        context._store.restructure()
        return context.get_mutable_abstract_parameter(_STATE).get_mutable_value()

    _structured = True

    def _structure_in(self, context: Any) -> GeometryState | None:
        """The geometry of a context that is not as in new contexts: steps and queries are compiled for it."""
        state = self._geometry_state(context)
        return None if state == self._default_state() else state.copy()

    def _compile_proximity(
        self, body_of_frame: dict[FrameId, int], state: GeometryState | None = None, cells: bool = False
    ) -> tuple[GeometryModel, list[GeometryId]]:
        """Proximity geometry as arrays, and the ids of its rows; of the model if no state is given."""
        return compile_proximity(self._default_state() if state is None else state, body_of_frame, cells)

    def _compile_for_queries(self, state: GeometryState) -> tuple[GeometryModel, list[GeometryId], list[FrameId]]:
        """The same with every frame a body of its own; kept for the last few states."""
        if state.serial not in self._compiled:
            frames = sorted(state.frames)
            frames.remove(WORLD_FRAME_ID)
            frames.insert(0, WORLD_FRAME_ID)
            model, ids = compile_proximity(state, {frame: body for body, frame in enumerate(frames)})
            while len(self._compiled) > 3:
                self._compiled.pop(next(iter(self._compiled)))
            self._compiled[state.serial] = (model, ids, frames)
        return self._compiled[state.serial]

    def _hydro_for_queries(self, state: GeometryState, representation: HydroelasticContactRepresentation) -> HydroPairs:
        """Which of those pairs make contact surfaces, and their meshes; kept for the last few states."""
        key = state.serial, representation
        if key not in self._hydro:
            model, ids, _ = self._compile_for_queries(state)
            found = compile_hydro(state, model, ids, representation)
            while len(self._hydro) > 3:
                self._hydro.pop(next(iter(self._hydro)))
            self._hydro[key] = found
        return self._hydro[key]

    # ---- configuration

    def get_config(self, context: Any | None = None) -> SceneGraphConfig:
        """The configuration of the model, or of a context."""
        if context is None:
            return copy.deepcopy(self._config)
        return copy.deepcopy(context.get_abstract_parameter(_CONFIG).get_value())

    def set_config(self, config: SceneGraphConfig) -> None:
        """Sets the configuration, which contexts made afterwards will have.

        Raises:
            RuntimeError: a value that makes no sense.
        """
        config.default_proximity_properties._validate()
        self._config = copy.deepcopy(config)
        self._with_defaults = None

    # ---- sources and frames

    @staticmethod
    def world_frame_id() -> FrameId:
        """The world frame."""
        return WORLD_FRAME_ID

    def RegisterSource(self, name: str = "") -> SourceId:
        """Registers a source and makes its input ports.

        Raises:
            RuntimeError: the name is taken.
        """
        source_id = self._model.register_source(name)
        name = self._model.sources[source_id].name
        port = self.DeclareAbstractInputPort(f"{name}_pose", AbstractValue.Make(FramePoseVector()))
        self.DeclareAbstractInputPort(f"{name}_configuration", AbstractValue.Make(GeometryConfigurationVector()))
        self._pose_ports[source_id] = int(port.get_index())
        return source_id

    def SourceIsRegistered(self, source_id: SourceId) -> bool:
        """True if the source is registered."""
        return source_id in self._model.sources

    def RegisterFrame(self, source_id: SourceId, *args: Any, **kwargs: Any) -> FrameId:
        """Registers a frame: `(source_id, frame)`, or `(source_id, parent_id, frame)` for one that moves with another.

        Raises:
            RuntimeError: unknown source or parent, or a name that is taken.
        """
        given = [*args]
        frame = kwargs.pop("frame") if "frame" in kwargs else given.pop()
        parent = kwargs.pop("parent_id") if "parent_id" in kwargs else (given.pop() if given else WORLD_FRAME_ID)
        if given or kwargs or not isinstance(frame, GeometryFrame) or not isinstance(parent, FrameId):
            raise TypeError("RegisterFrame(): expected (source_id, frame) or (source_id, parent_id, frame).")
        return self._model.register_frame(source_id, parent, frame)

    def RenameFrame(self, frame_id: FrameId, name: str) -> None:
        """Renames a frame."""
        self._model.rename_frame(frame_id, name)

    # ---- geometries

    def RegisterGeometry(self, *args: Any, **kwargs: Any) -> GeometryId:
        """Registers a geometry with a frame: `([context,] source_id, frame_id, geometry)`.

        Raises:
            RuntimeError: unknown source or frame, or a name that is taken within frame and role.
        """
        context, (source_id, frame_id, geometry) = _arguments(
            "RegisterGeometry", args, kwargs, ("source_id", "frame_id", "geometry")
        )
        if not isinstance(geometry, GeometryInstance):
            raise TypeError(f"RegisterGeometry(): geometry must be a GeometryInstance, got {geometry!r}.")
        geometry_id = self._mutable_state(context).register_geometry(source_id, frame_id, geometry)
        self._fill_defaults(context, geometry_id)
        return geometry_id

    def _fill_defaults(self, context: Any | None, geometry_id: GeometryId) -> None:
        """Default properties of what is added to a context; the model gets them when a context is made."""
        if context is not None:
            defaults = self.get_config(context).default_proximity_properties
            self._mutable_state(context).apply_proximity_defaults(defaults, only=geometry_id)

    def RegisterAnchoredGeometry(self, source_id: SourceId, geometry: GeometryInstance) -> GeometryId:
        """Registers a geometry that is fixed to the world."""
        return self.RegisterGeometry(source_id, WORLD_FRAME_ID, geometry)

    def RegisterDeformableGeometry(self, *args: Any, **kwargs: Any) -> GeometryId:
        """Not available: all geometry is rigid."""
        raise NotImplementedError("SceneGraph.RegisterDeformableGeometry(): deformable geometry is not supported.")

    def RemoveGeometry(self, *args: Any, **kwargs: Any) -> None:
        """Removes a geometry: `([context,] source_id, geometry_id)`."""
        context, (source_id, geometry_id) = _arguments("RemoveGeometry", args, kwargs, ("source_id", "geometry_id"))
        self._mutable_state(context).remove_geometry(source_id, geometry_id)

    def RenameGeometry(self, geometry_id: GeometryId, name: str) -> None:
        """Renames a geometry."""
        self._model.rename_geometry(geometry_id, name)

    def ChangeShape(self, *args: Any, **kwargs: Any) -> None:
        """Gives a geometry another shape: `([context,] source_id, geometry_id, shape, X_FG=None)`."""
        context, (source_id, geometry_id, shape, X_FG) = _arguments(
            "ChangeShape", args, kwargs, ("source_id", "geometry_id", "shape", "X_FG"), X_FG=None
        )
        if not isinstance(shape, Shape):
            raise TypeError(f"ChangeShape(): shape must be a Shape, got {shape!r}.")
        self._mutable_state(context).change_shape(source_id, geometry_id, shape, X_FG)

    # ---- roles

    def AssignRole(self, *args: Any, **kwargs: Any) -> None:
        """Gives a geometry a role: `([context,] source_id, geometry_id, properties, assign=RoleAssign.kNew)`.

        Raises:
            RuntimeError: it has the role already (kNew), or has it not (kReplace).
        """
        context, (source_id, geometry_id, properties, assign) = _arguments(
            "AssignRole", args, kwargs, ("source_id", "geometry_id", "properties", "assign"), assign=RoleAssign.kNew
        )
        if not isinstance(properties, GeometryProperties):
            raise TypeError(f"AssignRole(): properties must be those of a role, got {properties!r}.")
        self._mutable_state(context).assign_role(source_id, geometry_id, properties, assign)
        self._fill_defaults(context, geometry_id)

    def RemoveRole(self, *args: Any, **kwargs: Any) -> int:
        """Takes a role away, `([context,] source_id, frame_id | geometry_id, role)`; from how many geometries."""
        target = "frame_id" if "frame_id" in kwargs else "geometry_id"
        context, (source_id, what, role) = _arguments("RemoveRole", args, kwargs, ("source_id", target, "role"))
        if not isinstance(role, Role):
            raise TypeError(f"RemoveRole(): expected a Role, got {role!r}.")
        return self._mutable_state(context).remove_role(source_id, what, role)

    # ---- looking and filtering

    def model_inspector(self) -> SceneGraphInspector:
        """An inspector of the model: what contexts made from now on will know."""
        return SceneGraphInspector._make(lambda: self._model)

    def collision_filter_manager(self, context: Any | None = None) -> CollisionFilterManager:
        """Changes which pairs may touch, in the model or in a context."""
        return CollisionFilterManager._make(
            edit=lambda: self._mutable_state(context).edit_filter(),
            read=lambda: (self._model if context is None else self._geometry_state(context)).filter,
        )

    # ---- renderers

    def AddRenderer(self, *args: Any, **kwargs: Any) -> None:
        """Adds a clone of a render engine: `([context,] name, renderer)`.

        It is told of all geometry with the perception role, or of that which names it in the set of names that is the
        property ("renderer", "accepting").

        Raises:
            RuntimeError: the name is taken, or the engine refuses a geometry.
        """
        context, (name, renderer) = _with_context("AddRenderer", args, kwargs, ("name", "renderer"))
        if not isinstance(renderer, RenderEngine):
            raise TypeError(
                f"AddRenderer(): incompatible arguments; renderer must be a RenderEngine, not {renderer!r}."
            )
        self._mutable_state(context).add_renderer(name, renderer)

    def RemoveRenderer(self, *args: Any, **kwargs: Any) -> None:
        """Removes a render engine: `([context,] name)`.

        Raises:
            RuntimeError: there is none of the name.
        """
        context, (name,) = _with_context("RemoveRenderer", args, kwargs, ("name",))
        self._mutable_state(context).remove_renderer(name)

    def _renderers(self, context: Any | None) -> Renderers:
        return (self._model if context is None else self._geometry_state(context)).renderers

    def RendererCount(self, context: Any | None = None) -> int:
        """Number of render engines."""
        return len(self._renderers(context).names())

    def RegisteredRendererNames(self, context: Any | None = None) -> list[str]:
        """Names of the render engines, sorted."""
        return self._renderers(context).names()

    def HasRenderer(self, *args: Any, **kwargs: Any) -> bool:
        """True if there is a render engine of the name: `([context,] name)`."""
        context, (name,) = _with_context("HasRenderer", args, kwargs, ("name",))
        return self._renderers(context).find(name) is not None

    def GetRendererParameterYaml(self, *args: Any, **kwargs: Any) -> str:
        """The options of a render engine, `([context,] name)`, as YAML; empty if there is none of the name."""
        context, (name,) = _with_context("GetRendererParameterYaml", args, kwargs, ("name",))
        engine = self._renderers(context).find(name)
        return "" if engine is None else engine.GetParameterYaml()

    def GetRendererTypeName(self, *args: Any, **kwargs: Any) -> str:
        """What kind of render engine, `([context,] name)`, it is; empty if there is none of the name."""
        context, (name,) = _with_context("GetRendererTypeName", args, kwargs, ("name",))
        engine = self._renderers(context).find(name)
        return "" if engine is None else engine._type_name()


def _arguments(call: str, args: tuple, kwargs: dict, names: tuple[str, ...], **defaults: Any) -> tuple[Any, tuple]:
    """Splits `([context,] ...)` into the context, or None, and the values of `names`."""
    rest = list(args)
    given = dict(kwargs)
    context = given.pop("context", None)
    if context is None and rest and not isinstance(rest[0], SourceId):
        context = rest.pop(0)
    if len(rest) <= len(names):
        given = {**defaults, **dict(zip(names, rest)), **given}
    if len(rest) > len(names) or set(given) != set(names) or not isinstance(given[names[0]], SourceId):
        raise TypeError(f"{call}(): incompatible arguments; expected ([context,] {', '.join(names)}).")
    return context, tuple(given[name] for name in names)


def _with_context(call: str, args: tuple, kwargs: dict, names: tuple[str, ...]) -> tuple[Any, tuple]:
    """Splits `([context,] name, ...)` in the same way, where a text comes first."""
    rest, given = list(args), dict(kwargs)
    context = given.pop("context", None)
    if context is None and rest and not isinstance(rest[0], str):
        context = rest.pop(0)
    values = {**dict(zip(names, rest)), **given}
    if len(rest) + len(given) != len(names) or set(values) != set(names) or not isinstance(values["name"], str):
        raise TypeError(f"{call}(): incompatible arguments; expected ([context,] {', '.join(names)}).")
    return context, tuple(values[name] for name in names)
