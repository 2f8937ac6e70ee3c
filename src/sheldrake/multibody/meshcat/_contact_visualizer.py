"""ContactVisualizer: draws a plant's contact results into a Meshcat."""

from __future__ import annotations

import copy
import dataclasses
from typing import Any, overload

import numpy as np

from sheldrake.common.value import AbstractValue
from sheldrake.geometry import Meshcat, QueryObject
from sheldrake.geometry._meshcat.tree import as_float
from sheldrake.multibody.plant import ContactResults, MultibodyPlant
from sheldrake.systems.framework import DiagramBuilder, EventStatus, InputPort, LeafSystem, OutputPort

from ._contact_visualizer_params import ContactVisualizerParams
from ._hydroelastic_arrows import _HydroelasticContactVisualizer, _HydroelasticContactVisualizerItem
from ._point_contact_arrows import _PointContactVisualizer, _PointContactVisualizerItem

_NAME = "meshcat_contact_visualizer"


class ContactVisualizer(LeafSystem):
    """Draws the contact forces of a plant as arrows, every `publish_period` of simulated time.

    Ports: inputs "contact_results" and "query_object"; without the second, geometries are named by number. A point
    contact is an arrow that points both ways, its halves as long as the force asks; a contact surface is drawn
    in the colors of its pressure, with an arrow for the force and one for the moment.

    Args:
        meshcat: Where to draw.
        params: What, where and how often.

    Raises:
        RuntimeError: when the publish period or a threshold is not positive.
    """

    def __init__(self, meshcat: Meshcat, params: ContactVisualizerParams | None = None):
        super().__init__()
        params = ContactVisualizerParams() if params is None else copy.copy(params)
        for name in ("publish_period", "force_threshold", "moment_threshold"):
            if not getattr(params, name) > 0:
                raise RuntimeError(f"ContactVisualizer(): {name} must be positive, got {getattr(params, name)}.")
        self._meshcat, self._params = meshcat, params
        self._names = _Names()
        self._points = _PointContactVisualizer(meshcat, _below(params, "point"))
        self._surfaces = _HydroelasticContactVisualizer(meshcat, _below(params, "hydroelastic"))
        results = self.DeclareAbstractInputPort("contact_results", AbstractValue.Make(ContactResults()))
        query = self.DeclareAbstractInputPort("query_object", AbstractValue.Make(QueryObject()))
        self._results_index, self._query_index = results.get_index(), query.get_index()
        self.DeclareInitializationPublishEvent(publish=self._initialize)
        self.DeclarePeriodicPublishEvent(period_sec=params.publish_period, offset_sec=0.0, publish=self._update)
        self.DeclareForcedPublishEvent(publish=self._update)

    @overload
    @classmethod
    def AddToBuilder(
        cls, builder: DiagramBuilder, plant: MultibodyPlant, meshcat: Meshcat, params: ContactVisualizerParams = ...
    ) -> ContactVisualizer: ...
    @overload
    @classmethod
    def AddToBuilder(
        cls,
        builder: DiagramBuilder,
        contact_results_port: OutputPort,
        query_object_port: OutputPort,
        meshcat: Meshcat,
        params: ContactVisualizerParams = ...,
    ) -> ContactVisualizer: ...
    @overload
    @classmethod
    def AddToBuilder(
        cls,
        builder: DiagramBuilder,
        contact_results_port: OutputPort,
        meshcat: Meshcat,
        params: ContactVisualizerParams = ...,
    ) -> ContactVisualizer: ...
    @classmethod
    def AddToBuilder(cls, builder: DiagramBuilder, *args: Any, **kwargs: Any) -> ContactVisualizer:
        """Adds a visualizer to a diagram, connects it and returns it.

        Args:
            builder: The diagram in the making.
            *args: A plant that is connected to a SceneGraph; or its contact results port and, optionally, the
                SceneGraph's query port; then a Meshcat and, optionally, ContactVisualizerParams.
            **kwargs: The same by name: plant, contact_results_port, query_object_port, meshcat, params.

        Raises:
            RuntimeError: when the plant's geometry query port is not connected.
            TypeError: when the arguments fit no overload.
        """
        results, query, meshcat, params = _sources(builder, args, kwargs)
        visualizer: Any = builder.AddSystem(cls(meshcat, params))
        if not builder.HasSubsystemNamed(_NAME):
            visualizer.set_name(_NAME)
        builder.Connect(results, visualizer.contact_results_input_port())
        if query is not None:
            builder.Connect(query, visualizer.query_object_input_port())
        return visualizer

    def contact_results_input_port(self) -> InputPort:
        """Returns the input port for a plant's contact results."""
        return self.get_input_port(self._results_index)

    def query_object_input_port(self) -> InputPort:
        """Returns the input port for a SceneGraph's query port; it need not be connected."""
        return self.get_input_port(self._query_index)

    def Delete(self) -> None:
        """Removes everything below the prefix; the next publish draws it anew."""
        self._points.Delete()
        self._surfaces.Delete()
        self._meshcat.Delete(self._params.prefix)

    def _initialize(self, context: Any) -> EventStatus:
        if self._params.delete_on_initialization_event:
            self.Delete()
        return self._update(context)

    def _update(self, context: Any) -> EventStatus:
        port = self.contact_results_input_port()
        if not port.HasValue(context):
            raise RuntimeError(
                f"ContactVisualizer '{self.GetSystemPathname()}': input port 'contact_results' is not connected; "
                "connect it to MultibodyPlant.get_contact_results_output_port(), or use "
                "ContactVisualizer.AddToBuilder()."
            )
        query = self.query_object_input_port()
        inspector = query.Eval(context).inspector() if query.HasValue(context) else None
        results, time = port.Eval(context), as_float(context.get_time())
        names = self._names
        names.look_at(results.plant(), inspector)
        self._points.Update(time, _point_items(results, names))
        surfaces = [results.hydroelastic_contact_info(i) for i in range(results.num_hydroelastic_contacts())]
        self._surfaces.Update(time, [_surface_item(info, names) for info in surfaces])
        return EventStatus.Succeeded()


def _below(params: ContactVisualizerParams, name: str) -> ContactVisualizerParams:
    return dataclasses.replace(params, prefix=f"{params.prefix}/{name}")


def _sources(builder: DiagramBuilder, args: tuple, kwargs: dict) -> tuple[Any, Any, Meshcat, Any]:
    """Returns contact results port, query port (or None), Meshcat and options of AddToBuilder()'s overloads."""
    if "plant" in kwargs or (args and isinstance(args[0], MultibodyPlant)):
        names = ["plant", "meshcat", "params"]
    elif "query_object_port" in kwargs or (len(args) > 1 and isinstance(args[1], OutputPort)):
        names = ["contact_results_port", "query_object_port", "meshcat", "params"]
    else:
        names = ["contact_results_port", "meshcat", "params"]
    free = [name for name in names if name not in kwargs]
    given = {**dict(zip(free, args)), **kwargs}
    plant, results, query = given.get("plant"), given.get("contact_results_port"), given.get("query_object_port")
    fits = len(args) <= len(free) and set(given) <= set(names) and isinstance(given.get("meshcat"), Meshcat)
    fits = fits and all(port is None or isinstance(port, OutputPort) for port in (results, query))
    if not fits or (plant is None) == (results is None):
        found = ", ".join(type(value).__name__ for value in (*args, *kwargs.values()))
        raise TypeError(
            "ContactVisualizer.AddToBuilder(): expected a MultibodyPlant (or its contact results port, and the "
            f"SceneGraph's query port) and a Meshcat, got {found or 'nothing'}."
        )
    if plant is not None:
        port = plant.get_geometry_query_input_port()
        source = builder.connection_map().get((plant, port.get_index()))
        if source is None:
            raise RuntimeError(
                f"ContactVisualizer.AddToBuilder(): the geometry query port of plant '{plant.get_name()}' is not "
                "connected in this builder; use AddMultibodyPlantSceneGraph(), or pass the two ports."
            )
        results, query = plant.get_contact_results_output_port(), source[0].get_output_port(source[1])
    return results, query, given["meshcat"], given.get("params")


class _Names:
    """Short names of the two sides of a contact, unique within a plant; kept once they are found."""

    def __init__(self) -> None:
        self._plant: Any = None
        self._inspector: Any = None
        self._known: dict[tuple[Any, Any], str] = {}

    def look_at(self, plant: Any, inspector: Any) -> None:
        """Takes names from a plant, and from the SceneGraph's inspector where it is known."""
        if plant is not self._plant or (inspector is None) != (self._inspector is None):
            self._known.clear()
        self._plant, self._inspector = plant, inspector

    def of_body(self, index: Any, geometry: Any) -> str:
        """Returns the body's name, with its model's where it is not the only one, and the geometry's likewise."""
        name = self._known.get((index, geometry))
        if name is None:
            name = self._known[index, geometry] = self._find(index, geometry)
        return name

    def _find(self, index: Any, geometry: Any) -> str:
        plant = self._plant
        body = plant.get_body(index)
        name = body.name()
        if plant.NumBodiesWithName(name) > 1:
            name = f"{plant.GetModelInstanceName(body.model_instance())}.{name}"
        geometries = plant.GetCollisionGeometriesForBody(body)
        if len(geometries) > 1:
            name = f"{name}.{self.of_geometry(geometry)}"
        return name

    def of_geometry(self, geometry: Any) -> str:
        """Returns a geometry's name without its model's, or its number."""
        if self._inspector is None:
            return f"Id({geometry.get_value()})"
        return self._inspector.GetName(geometry).rpartition("::")[2]

    def of_geometries_body(self, geometry: Any) -> str:
        """Returns the name of the body that a geometry belongs to."""
        if self._inspector is None:
            return self.of_geometry(geometry)
        body = self._plant.GetBodyFromFrameId(self._inspector.GetFrameId(geometry))
        return self.of_body(body.index(), geometry)


def _point_items(results: ContactResults, names: _Names) -> list[_PointContactVisualizerItem]:
    arrays = results._arrays
    if arrays is not None:
        return [
            _PointContactVisualizerItem(names.of_body(a, A), names.of_body(b, B), force, point)
            for a, b, A, B, force, point in zip(*arrays)
        ]
    items = []
    for info in map(results.point_pair_contact_info, range(results.num_point_pair_contacts())):
        A, B = (names.of_body(info.bodyA_index(), info.point_pair().id_A),
                names.of_body(info.bodyB_index(), info.point_pair().id_B))  # fmt: skip
        items.append(_PointContactVisualizerItem(A, B, info.contact_force(), info.contact_point()))
    return items


def _surface_item(info: Any, names: _Names) -> _HydroelasticContactVisualizerItem:
    surface = info.contact_surface()
    mesh = surface.tri_mesh_W() if surface.is_triangle() else surface.poly_mesh_W()
    field = surface.tri_e_MN() if surface.is_triangle() else surface.poly_e_MN()
    count = mesh.num_vertices()
    faces = []
    for f in range(surface.num_faces()):
        element = mesh.element(f)
        ring = [element.vertex(i) for i in range(3 if surface.is_triangle() else element.num_vertices())]
        faces += [(ring[0], ring[i], ring[i + 1]) for i in range(1, len(ring) - 1)]
    force = info.F_Ac_W()
    return _HydroelasticContactVisualizerItem(
        names.of_geometries_body(surface.id_M()),
        names.of_geometries_body(surface.id_N()),
        surface.centroid(),
        force.translational(),
        force.rotational(),
        np.array([mesh.vertex(v) for v in range(count)]).reshape(-1, 3).T,
        np.array(faces, dtype=np.int64).reshape(-1, 3).T,
        np.array([field.EvaluateAtVertex(v) for v in range(count)]),
    )
