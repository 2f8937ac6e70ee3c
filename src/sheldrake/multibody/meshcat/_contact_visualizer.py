"""ContactVisualizer: draws a plant's contact results into a Meshcat."""

from __future__ import annotations

import copy
import functools
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import kind, overload, overloaded
from sheldrake.common.value import AbstractValue
from sheldrake.geometry import Meshcat, QueryObject
from sheldrake.geometry._meshcat.tree import as_float
from sheldrake.multibody.plant import ContactResults, MultibodyPlant
from sheldrake.systems.framework import DiagramBuilder, EventStatus, LeafSystem, OutputPort
from sheldrake.systems.framework._port_getters import input_port

from ._arrow import as_floats
from ._contact_items import Names, names_of_pairs, names_of_surface, point_items, surface_item
from ._contact_visualizer_params import ContactVisualizerParams
from ._hydroelastic_arrows import _HydroelasticContactVisualizer
from ._point_contact_arrows import _PointContactVisualizer

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context

_NAME = "meshcat_contact_visualizer"


def _ports_of(builder: DiagramBuilder, plant: MultibodyPlant) -> tuple[OutputPort, OutputPort]:
    """Returns a plant's contact results port and the query port it is connected to."""
    port = plant.get_geometry_query_input_port()
    source = builder.connection_map().get((plant, port.get_index()))
    if source is None:
        raise RuntimeError(
            f"ContactVisualizer.AddToBuilder(): the geometry query port of plant '{plant.get_name()}' is not "
            "connected in this builder; use AddMultibodyPlantSceneGraph(), or pass the two ports."
        )
    return plant.get_contact_results_output_port(), source[0].get_output_port(source[1])


def _of_plant(cls: type[ContactVisualizer], builder: DiagramBuilder, plant: MultibodyPlant, *drawn: Any) -> Any:
    return cls.AddToBuilder(builder, *_ports_of(builder, plant), *drawn)


def _without_query(cls: type[ContactVisualizer], builder: DiagramBuilder, results: OutputPort, *drawn: Any) -> Any:
    return cls.AddToBuilder(builder, results, None, *drawn)


_BUILDER, _PORT = instance_of(DiagramBuilder), instance_of(OutputPort)
_QUERY = kind("OutputPort")(instance_of(OutputPort, type(None)))
_DRAWN = {"meshcat": instance_of(Meshcat), "params": (instance_of(ContactVisualizerParams), None)}


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

    _generic, _symbolic = True, False

    def __init__(self, meshcat: Meshcat, params: ContactVisualizerParams | None = None):
        super().__init__()
        params = ContactVisualizerParams() if params is None else copy.copy(params)
        if not (params.publish_period >= 0.0 and params.force_threshold > 0.0):
            raise RuntimeError(
                f"ContactVisualizer(): publish_period {params.publish_period} must not be negative, "
                f"force_threshold {params.force_threshold} must be positive."
            )
        self._meshcat, self._params = meshcat, params
        self._names = Names()
        # The pairs of the contacts drawn last, and where these are drawn.
        self._paths: tuple[tuple[Sequence[Any], np.ndarray] | None, list[str]] = None, []
        self._points = _PointContactVisualizer(meshcat, _below(params, "point"))
        self._surfaces = _HydroelasticContactVisualizer(meshcat, _below(params, "hydroelastic"))
        self.DeclareAbstractInputPort("contact_results", AbstractValue.Make(ContactResults()))
        self.DeclareAbstractInputPort("query_object", AbstractValue.Make(QueryObject()))
        self.DeclareInitializationPublishEvent(publish=self._initialize)
        if params.publish_period > 0.0:
            self.DeclarePeriodicPublishEvent(period_sec=params.publish_period, offset_sec=0.0, publish=self._update)
        self.DeclareForcedPublishEvent(publish=self._update)

    @classmethod
    @overloaded(
        overload(_of_plant, builder=_BUILDER, plant=instance_of(MultibodyPlant), **_DRAWN),
        overload(builder=_BUILDER, contact_results_port=_PORT, query_object_port=_QUERY, **_DRAWN),
        overload(_without_query, builder=_BUILDER, contact_results_port=_PORT, **_DRAWN),
    )
    def AddToBuilder(
        cls,
        builder: DiagramBuilder,
        results: OutputPort,
        query: OutputPort | None,
        meshcat: Meshcat,
        params: ContactVisualizerParams,
    ) -> ContactVisualizer:
        """Adds a visualizer to a diagram, connects it and returns it.

        Called with a plant that is connected to a SceneGraph; or with its contact results port and, optionally, the
        SceneGraph's query port.

        Args:
            builder: The diagram in the making.
            results: The plant; or its port, called `contact_results_port`.
            query: The SceneGraph's port, called `query_object_port`.
            meshcat: Where to draw.
            params: Options.

        Raises:
            RuntimeError: when the plant's geometry query port is not connected.
            TypeError: when the arguments fit no form.
        """
        visualizer: Any = builder.AddSystem(cls(meshcat, params))
        if not builder.HasSubsystemNamed(_NAME):
            visualizer.set_name(_NAME)
        builder.Connect(results, visualizer.contact_results_input_port())
        if query is not None:
            builder.Connect(query, visualizer.query_object_input_port())
        return visualizer

    contact_results_input_port = input_port(0, "Returns the input port for a plant's contact results.")
    query_object_input_port = input_port(
        1, "Returns the input port for a SceneGraph's query port; it need not be connected."
    )

    def Delete(self) -> None:
        """Removes everything below the prefix; the next publish draws it anew."""
        self._points.Delete()
        self._surfaces.Delete()
        self._meshcat.Delete(self._params.prefix)

    def _initialize(self, context: Context) -> EventStatus:
        if self._params.delete_on_initialization_event:
            self.Delete()
        return self._update(context)

    def _update(self, context: Context) -> EventStatus:
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
        if names.look_at(results.plant(), inspector):
            self._paths = None, []
        surfaces = [results.hydroelastic_contact_info(i) for i in range(results.num_hydroelastic_contacts())]
        sides = [names_of_surface(info, names) for info in surfaces]
        draw_points = self._drawing_of_points(results, time)

        def draw() -> None:
            draw_points()
            self._surfaces.Update(time, [surface_item(info, pair) for info, pair in zip(surfaces, sides)])

        self._meshcat._defer(self._params.prefix, draw)
        return EventStatus.Succeeded()

    def _drawing_of_points(self, results: ContactResults, time: float) -> Callable[[], None]:
        """What draws the point contacts, in any thread; it keeps what it needs."""
        arrays = results._arrays
        if arrays is None:
            return functools.partial(self._points.Update, time, point_items(results, self._names))
        same, paths = self._paths
        pairs = arrays.geometries, arrays.pair
        if same is None or same[0] is not pairs[0] or not np.array_equal(same[1], pairs[1]):
            paths = self._points.paths(names_of_pairs(arrays, self._names))
            self._paths = pairs, paths
        return functools.partial(self._points.show, time, paths, as_floats(arrays.f_Bc_W), as_floats(arrays.p_WC))


def _below(params: ContactVisualizerParams, name: str) -> ContactVisualizerParams:
    below = copy.copy(params)
    below.prefix = f"{params.prefix}/{name}"
    return below
