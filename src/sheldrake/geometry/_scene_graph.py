"""The system that knows all geometry: who registered it, where it is, what may touch."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from sheldrake.common._checked import checked
from sheldrake.common._kinds import anything, instance_of, text
from sheldrake.common._overloads import overload, overloaded
from sheldrake.common.value import AbstractValue
from sheldrake.geometry._compiled.hydroelastic import HydroPairs, compile_hydro
from sheldrake.geometry._compiled.points import compile_proximity
from sheldrake.geometry._frame_pose_vector import FramePoseVector, GeometryConfigurationVector
from sheldrake.geometry._ids import FrameId, GeometryId, SourceId
from sheldrake.geometry._kernels.model import GeometryModel
from sheldrake.geometry._properties import GeometryProperties
from sheldrake.geometry._query.query_object import QueryObject
from sheldrake.geometry._query.scene import QueryScene
from sheldrake.geometry._render.engine import RenderEngine
from sheldrake.geometry._roles import HydroelasticContactRepresentation, Role, RoleAssign
from sheldrake.geometry._shapes import Shape
from sheldrake.geometry._state.collision_filter import CollisionFilterManager
from sheldrake.geometry._state.config import SceneGraphConfig
from sheldrake.geometry._state.inspector import SceneGraphInspector
from sheldrake.geometry._state.instance import GeometryFrame, GeometryInstance
from sheldrake.geometry._state.records import WORLD_FRAME_ID
from sheldrake.geometry._state.state import GeometryState
from sheldrake.systems.framework import Context, LeafSystem

if TYPE_CHECKING:
    from sheldrake.math import RigidTransform
    from sheldrake.systems.framework import InputPort, OutputPort

_STATE = 0  # abstract parameters
_CONFIG = 1

_SOURCE, _FRAME, _GEOMETRY = (instance_of(cls) for cls in (SourceId, FrameId, GeometryId))


def _of_model_or_context(*forms: dict[str, Any]) -> Callable[[Callable[..., Any]], Any]:
    """Decorates a method that changes or asks the model, or, with a context before the rest, that context."""

    def decorate(body: Callable[..., Any]) -> Any:
        of_model = [overload(lambda self, *values: body(self, None, *values), **form) for form in forms]
        return overloaded(*of_model, *(overload(context=instance_of(Context), **form) for form in forms))(body)

    return decorate


class SceneGraph(LeafSystem):
    """Nexus of all geometry of a diagram.

    Sources register frames and geometries, and publish the poses of their frames through an input port of their own.
    Whoever wants to know looks at the query port's QueryObject. What is registered belongs to the model, and is copied
    into every context made afterwards; the methods that take a context change that copy only.

    Args:
        config: defaults of proximity properties.
    """

    _generic = True

    @checked
    def __init__(self, config: SceneGraphConfig | None = None) -> None:
        super().__init__()
        self._model = GeometryState()
        self._inspector = SceneGraphInspector._make(lambda: self._model)
        self._config = SceneGraphConfig()
        if config is not None:
            self.set_config(config)
        self._pose_ports: dict[SourceId, int] = {}
        self._with_defaults: tuple[int, GeometryState] | None = None
        self._compiled: dict[int, QueryScene] = {}
        self._hydro: dict[tuple[int, HydroelasticContactRepresentation], HydroPairs] = {}
        self.DeclareAbstractParameter(AbstractValue.Make(GeometryState()))
        self.DeclareAbstractParameter(AbstractValue.Make(SceneGraphConfig()))
        self.DeclareAbstractOutputPort("query", lambda: AbstractValue.Make(QueryObject()), self._calc_query)

    def _copy(self) -> SceneGraph:
        """For clones and conversions: a copy with a model of its own."""
        new = super()._copy()
        new._model, new._config = self._model.copy(), copy.deepcopy(self._config)
        new._inspector = SceneGraphInspector._make(lambda: new._model)
        return new

    # ---- ports

    def get_query_output_port(self) -> OutputPort:
        """The port whose value is a QueryObject."""
        return self.get_output_port(0)

    @checked
    def get_source_pose_port(self, source_id: SourceId) -> InputPort:
        """The input port for a source's FramePoseVector.

        Raises:
            RuntimeError: unknown source.
        """
        return self.get_input_port(self._port_of(source_id, "pose"))

    @checked
    def get_source_configuration_port(self, source_id: SourceId) -> InputPort:
        """The input port for a source's deformable geometry."""
        return self.get_input_port(self._port_of(source_id, "configuration") + 1)

    def _port_of(self, source_id: SourceId, kind: str) -> int:
        if source_id not in self._pose_ports:
            raise RuntimeError(f"Can't acquire {kind} port for unknown source id: {source_id.get_value()}.")
        return self._pose_ports[source_id]

    def _calc_query(self, context: Context, output: AbstractValue) -> None:
        query = output.get_mutable_value()
        query._scene_graph, query._context = self, context  # as `_bind`, which would be another call

    # ---- context

    def _set_default_context(self, context: Context) -> None:
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

    def _geometry_state(self, context: Context) -> GeometryState:
        """What a context knows."""
        return context._store.parameters[context._place.abstract_parameters[0] + _STATE].get_value()

    def _known(self, context: Context | None) -> GeometryState:
        """What the model knows, or a context, which must be of this system."""
        if context is None:
            return self._model
        self.ValidateContext(context)
        return self._geometry_state(context)

    def _mutable_state(self, context: Context | None) -> GeometryState:
        if context is None:
            return self._model
        self.ValidateContext(context)
        context._store.restructure()
        return context.get_mutable_abstract_parameter(_STATE).get_mutable_value()

    _structured = True

    def _structure_in(self, context: Context) -> GeometryState | None:
        """The geometry of a context that is not as in new contexts: steps and queries are compiled for it."""
        state = self._geometry_state(context)
        return None if state == self._default_state() else state.copy()

    def _compile_proximity(
        self, body_of_frame: dict[FrameId, int], state: GeometryState | None = None, cells: bool = False
    ) -> tuple[GeometryModel, list[GeometryId]]:
        """Proximity geometry as arrays, and the ids of its rows; of the model if no state is given."""
        return compile_proximity(self._default_state() if state is None else state, body_of_frame, cells)

    def _compile_for_queries(self, state: GeometryState) -> QueryScene:
        """The same with every frame a body of its own; kept for the last few states."""
        if state.serial not in self._compiled:
            frames = sorted(state.frames)
            frames.remove(WORLD_FRAME_ID)
            frames.insert(0, WORLD_FRAME_ID)
            model, ids = compile_proximity(state, {frame: body for body, frame in enumerate(frames)})
            while len(self._compiled) > 3:
                self._compiled.pop(next(iter(self._compiled)))
            self._compiled[state.serial] = QueryScene(state, model, ids, frames)
        return self._compiled[state.serial]

    def _hydro_for_queries(self, state: GeometryState, representation: HydroelasticContactRepresentation) -> HydroPairs:
        """Which of those pairs make contact surfaces, and their meshes; kept for the last few states."""
        key = state.serial, representation
        if key not in self._hydro:
            scene = self._compile_for_queries(state)
            found = compile_hydro(state, scene.model, scene.ids, representation)
            while len(self._hydro) > 3:
                self._hydro.pop(next(iter(self._hydro)))
            self._hydro[key] = found
        return self._hydro[key]

    # ---- configuration

    @checked
    def get_config(self, context: Context | None = None) -> SceneGraphConfig:
        """The configuration of the model, or of a context."""
        if context is None:
            return copy.deepcopy(self._config)
        self.ValidateContext(context)
        return copy.deepcopy(context.get_abstract_parameter(_CONFIG).get_value())

    @checked
    def set_config(self, config: SceneGraphConfig) -> None:
        """Sets the configuration, which contexts made afterwards will have.

        Raises:
            RuntimeError: a value that makes no sense.
        """
        config.default_proximity_properties._validate()
        self._config = copy.deepcopy(config)
        self._with_defaults = None

    def set_default_point_contact_algorithm(self, name: str) -> None:
        """Sets how many contact points pairs report whose properties do not say, for contexts made afterwards.

        Args:
            name: "multi_point", up to four well-spread points of a face or edge that touches (what a new SceneGraph
                has), or "single_point", the deepest one.

        Raises:
            RuntimeError: neither of these.
        """
        self._model.set_point_contact_algorithm(name)

    # ---- sources and frames

    @staticmethod
    def world_frame_id() -> FrameId:
        """The world frame."""
        return WORLD_FRAME_ID

    @checked
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

    @overloaded(
        overload(source_id=_SOURCE, parent_id=_FRAME, frame=instance_of(GeometryFrame)),
        overload(
            lambda self, source_id, frame: self.RegisterFrame(source_id, WORLD_FRAME_ID, frame),
            source_id=_SOURCE,
            frame=instance_of(GeometryFrame),
        ),
    )
    def RegisterFrame(self, source_id: SourceId, parent_id: FrameId, frame: GeometryFrame) -> FrameId:
        """Registers a frame: `(source_id, frame)`, or `(source_id, parent_id, frame)` for one that moves with another.

        Raises:
            RuntimeError: unknown source or parent, or a name that is taken.
        """
        return self._model.register_frame(source_id, parent_id, frame)

    @checked
    def RenameFrame(self, frame_id: FrameId, name: str) -> None:
        """Renames a frame."""
        self._model.rename_frame(frame_id, name)

    # ---- geometries

    @_of_model_or_context({"source_id": _SOURCE, "frame_id": _FRAME, "geometry": instance_of(GeometryInstance)})
    def RegisterGeometry(
        self, context: Context | None, source_id: SourceId, frame_id: FrameId, geometry: GeometryInstance
    ) -> GeometryId:
        """Registers a geometry with a frame: `([context,] source_id, frame_id, geometry)`.

        Raises:
            RuntimeError: unknown source or frame, or a name that is taken within frame and role.
        """
        geometry_id = self._mutable_state(context).register_geometry(source_id, frame_id, geometry)
        self._fill_defaults(context, geometry_id)
        return geometry_id

    def _fill_defaults(self, context: Context | None, geometry_id: GeometryId) -> None:
        """Default properties of what is added to a context; the model gets them when a context is made."""
        if context is not None:
            defaults = self.get_config(context).default_proximity_properties
            self._mutable_state(context).apply_proximity_defaults(defaults, only=geometry_id)

    def RegisterAnchoredGeometry(self, source_id: SourceId, geometry: GeometryInstance) -> GeometryId:
        """Registers a geometry that is fixed to the world."""
        return self.RegisterGeometry(source_id, WORLD_FRAME_ID, geometry)

    def RegisterDeformableGeometry(self, *args: object, **kwargs: object) -> GeometryId:
        """Not available: all geometry is rigid."""
        raise NotImplementedError("SceneGraph.RegisterDeformableGeometry(): deformable geometry is not supported.")

    @_of_model_or_context({"source_id": _SOURCE, "geometry_id": _GEOMETRY})
    def RemoveGeometry(self, context: Context | None, source_id: SourceId, geometry_id: GeometryId) -> None:
        """Removes a geometry: `([context,] source_id, geometry_id)`."""
        self._mutable_state(context).remove_geometry(source_id, geometry_id)

    @checked
    def RenameGeometry(self, geometry_id: GeometryId, name: str) -> None:
        """Renames a geometry."""
        self._model.rename_geometry(geometry_id, name)

    @_of_model_or_context(
        {"source_id": _SOURCE, "geometry_id": _GEOMETRY, "shape": instance_of(Shape), "X_FG": (anything, None)}
    )
    def ChangeShape(
        self,
        context: Context | None,
        source_id: SourceId,
        geometry_id: GeometryId,
        shape: Shape,
        X_FG: RigidTransform | None,
    ) -> None:
        """Gives a geometry another shape: `([context,] source_id, geometry_id, shape, X_FG=None)`."""
        self._mutable_state(context).change_shape(source_id, geometry_id, shape, X_FG)

    # ---- roles

    @_of_model_or_context(
        {
            "source_id": _SOURCE,
            "geometry_id": _GEOMETRY,
            "properties": instance_of(GeometryProperties),
            "assign": (instance_of(RoleAssign), RoleAssign.kNew),
        }
    )
    def AssignRole(
        self, context: Context | None, source_id: SourceId, geometry_id: GeometryId, properties: Any, assign: RoleAssign
    ) -> None:
        """Gives a geometry a role: `([context,] source_id, geometry_id, properties, assign=RoleAssign.kNew)`.

        Raises:
            RuntimeError: it has the role already (kNew), or has it not (kReplace).
        """
        self._mutable_state(context).assign_role(source_id, geometry_id, properties, assign)
        self._fill_defaults(context, geometry_id)

    @_of_model_or_context(
        {"source_id": _SOURCE, "frame_id": _FRAME, "role": instance_of(Role)},
        {"source_id": _SOURCE, "geometry_id": _GEOMETRY, "role": instance_of(Role)},
    )
    def RemoveRole(self, context: Context | None, source_id: SourceId, what: FrameId | GeometryId, role: Role) -> int:
        """Takes a role away, `([context,] source_id, frame_id | geometry_id, role)`; from how many geometries."""
        return self._mutable_state(context).remove_role(source_id, what, role)

    # ---- looking and filtering

    def model_inspector(self) -> SceneGraphInspector:
        """An inspector of the model: what contexts made from now on will know; the same object each time."""
        return self._inspector

    def collision_filter_manager(self, context: Context | None = None) -> CollisionFilterManager:
        """Changes which pairs may touch, in the model or in a context."""
        self._known(context)  # or it is refused
        return CollisionFilterManager._make(
            edit=lambda: self._mutable_state(context).edit_filter(), read=lambda: self._known(context).filter
        )

    # ---- renderers

    @_of_model_or_context({"name": text, "renderer": instance_of(RenderEngine)})
    def AddRenderer(self, context: Context | None, name: str, renderer: RenderEngine) -> None:
        """Adds a clone of a render engine: `([context,] name, renderer)`.

        It is told of all geometry with the perception role, or of that which names it in the set of names that is the
        property ("renderer", "accepting").

        Raises:
            RuntimeError: the name is taken, or the engine refuses a geometry.
        """
        self._mutable_state(context).add_renderer(name, renderer)

    @_of_model_or_context({"name": text})
    def RemoveRenderer(self, context: Context | None, name: str) -> None:
        """Removes a render engine: `([context,] name)`.

        Raises:
            RuntimeError: there is none of the name.
        """
        self._mutable_state(context).remove_renderer(name)

    @checked
    def RendererCount(self, context: Context | None = None) -> int:
        """Number of render engines."""
        return len(self._known(context).renderers.names())

    def RegisteredRendererNames(self, context: Context | None = None) -> list[str]:
        """Names of the render engines, sorted."""
        return self._known(context).renderers.names()

    @_of_model_or_context({"name": text})
    def HasRenderer(self, context: Context | None, name: str) -> bool:
        """True if there is a render engine of the name: `([context,] name)`."""
        return self._known(context).renderers.find(name) is not None

    @_of_model_or_context({"name": text})
    def GetRendererParameterYaml(self, context: Context | None, name: str) -> str:
        """The options of a render engine, `([context,] name)`, as YAML; empty if there is none of the name."""
        engine = self._known(context).renderers.find(name)
        return "" if engine is None else engine.GetParameterYaml()

    @_of_model_or_context({"name": text})
    def GetRendererTypeName(self, context: Context | None, name: str) -> str:
        """What kind of render engine, `([context,] name)`, it is; empty if there is none of the name."""
        engine = self._known(context).renderers.find(name)
        return "" if engine is None else engine._type_name()
